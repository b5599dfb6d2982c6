"""Faults of odometry, frames and the serial line."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from cobs import cobs

from bslam.core.appearance import SIGNATURE_SIZE
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.faults.promise import (
    PARAMS,
    STEP_US,
    Course,
    Fault,
    Measured,
    put,
    refusal,
    started,
    state_of,
)
from bslam.link.frames import LONGEST, VERSION, Decoder, Frame, crc16, encode


def _number_in_odometry(value: float, protected: bool) -> Measured:
    course = started()
    before = state_of(course.slam)
    if protected:
        status = refusal(lambda: course.slam.odometry("wheels", 51 * STEP_US, value, 0.0))
    else:
        pose = course.slam.pose()
        put(course.slam, pose[0] + value, *pose)
        status = ""
    same = state_of(course.slam) == before
    return Measured(bool(status) and same, f"{status or 'taken'}, state {'same' if same else 'changed'}")


def _number_in_sighting(value: float, protected: bool) -> Measured:
    course = started()
    before = state_of(course.slam)
    if protected:
        # The binding reads a distance that is NaN as none: the direction, then.
        polar = ([value], [1.0]) if math.isnan(value) else ([0.1], [value])
        status = refusal(lambda: course.slam.sightings(51 * STEP_US, *polar, [9], [True]))
    else:
        beacon = course.slam.beacons()[0]
        put(course.slam, value, beacon.x_m, beacon.y_m)
        status = ""
    same = state_of(course.slam) == before
    return Measured(bool(status) and same, f"{status or 'taken'}, state {'same' if same else 'changed'}")


def _is_refused(call: Callable[[], object]) -> bool:
    """By the core, or before it comes there."""
    try:
        return bool(refusal(call))
    except BslamError:
        return True


def _number_elsewhere(value: float, protected: bool) -> Measured:
    """In every other input that is a number."""
    course = started(25)
    slam, time_us = course.slam, 26 * STEP_US
    signature = np.full((1, SIGNATURE_SIZE), value, np.float32)
    calls = {
        "gyro": lambda: slam.odometry("wheels", time_us, 0.01, 0.01, value),
        "signature": lambda: slam.sightings(time_us, [0.1], [2.0], [-1], [True], signature=signature),
        "pose": lambda: slam.set_pose(value, 0.0, 0.0, 0.1, 0.1),
        "doubt": lambda: slam.resume_odometry(value, 0.1),
        "known beacon": lambda: slam.add_known_beacon(77, value, 1.0),
        "parameter": lambda: Slam(PARAMS | {"gate_d2": value}),
    }
    before = state_of(slam)
    taken = [name for name, call in calls.items() if not (protected and _is_refused(call))]
    if not protected:
        put(slam, value, *slam.pose())
    same = state_of(slam) == before
    text = f"{len(calls) - len(taken)} of {len(calls)} refused, state {'same' if same else 'changed'}"
    return Measured(not taken and same, text)


def _denormal_odometry(protected: bool) -> Measured:
    """Travel so small is none; only an interval so small would do harm, and time is whole microseconds."""
    # Unprotected: the least that one may tell of, travel in an interval without any length.
    travel_m, time_us = (1e-40, 51 * STEP_US) if protected else (2e-5, 50 * STEP_US + 1)
    course, plain = (started(velocity_states=1) for _ in range(2))
    status = refusal(lambda: course.slam.odometry("wheels", time_us, travel_m, travel_m))
    refusal(lambda: plain.slam.odometry("wheels", time_us, 0.0, 0.0))
    off_m = math.dist(plain.slam.pose()[:2], course.slam.pose()[:2])
    finite = all(map(math.isfinite, (*course.slam.pose(), *course.slam.pose_covariance_lower())))
    state = "finite" if finite else "not finite"
    text = f"{status or 'taken'}, {off_m:.1e} m beside no travel, state {state}"
    return Measured(finite and off_m < 1e-6, text)


def _no_time(step_us: int, protected: bool) -> Measured:
    course = started(velocity_states=1)
    before = state_of(course.slam)
    time_us = 50 * STEP_US + step_us if protected else 51 * STEP_US  # as if it were another reading
    status = refusal(lambda: course.slam.odometry("wheels", time_us, 0.01, 0.01))
    same = state_of(course.slam) == before
    return Measured(bool(status) and same, f"{status or 'taken'}, state {'same' if same else 'changed'}")


def _long_gap(protected: bool) -> Measured:
    course = started()
    before_m = course.sd_m()
    if not protected:
        course = started(gap_speed_sd_mps=0.0, gap_turn_sd_radps=0.0)
    course.slam.odometry("velocity", 50 * STEP_US + 3_000_000, 0.0, 0.0)
    sd_m = course.sd_m()
    return Measured(sd_m > 0.3, f"sd {before_m:.3f} -> {sd_m:.2f} m after 3 s unseen")


def _too_long(protected: bool) -> Measured:
    course = started()
    late_us = 50 * STEP_US + 10_000_000
    if protected:
        status = refusal(lambda: course.slam.odometry("velocity", late_us, 0.4, 0.0))
        course.slam.resume_odometry(4.0, 3.0)
    else:
        status = refusal(lambda: course.slam.odometry("velocity", 51 * STEP_US, 0.4, 0.0))
    return Measured(
        status == "BSLAM_E_TIME" and course.sd_m() > 4.0, f"{status or 'taken'}, sd {course.sd_m():.2f} m"
    )


def _ticks(start: int, reset_at: int | None, drop: int, **params: float) -> Course:
    course = Course(Slam(PARAMS | params))
    course.slam.sightings(0, [], [], [], [])
    for step in range(201):
        course.step = step
        left, right = course.ticks(step, start)
        if reset_at is not None and step >= reset_at:
            left, right = (left - 20000) % 65536, (right - 20000) % 65536
        if drop and step % drop == 1:
            continue
        _feed_ticks(course, step, left, right)
    return course


def _feed_ticks(course: Course, step: int, left: int, right: int) -> None:
    """A reading that may be refused."""
    refusal(lambda: course.slam.odometry("ticks", step * STEP_US, left, right))


def _roll_over(protected: bool) -> Measured:
    course = _ticks(65000, None, 0, **({} if protected else {"counter_bits": 32}))
    return Measured(course.error_m() < 0.02, f"error {course.error_m():.3f} m over 8 s")


def _encoder_reset(protected: bool) -> Measured:
    course = _ticks(30000, 100, 0, **({} if protected else {"speed_max_mps": 1000.0}))
    jumps = course.slam.counters()["jumps"]
    kept = jumps == 2 and course.error_m() < 0.05
    return Measured(kept, f"{jumps} counted, error {course.error_m():.3f} m")


def _lost_odometry(protected: bool) -> Measured:
    if protected:
        course = _ticks(0, None, 3)
    else:  # travel since the reading before, of which some are missing
        course = Course(Slam(PARAMS))
        course.slam.sightings(0, [], [], [], [])
        for step in range(1, 201):
            course.step = step
            if step % 3 != 1:
                course.slam.odometry("wheels", step * STEP_US, *course.travel())
    return Measured(course.error_m() < 0.05, f"every third lost: error {course.error_m():.3f} m over 8 s")


def _odometry_again(time_us: int, protected: bool) -> Measured:
    course = started()
    before = course.slam.pose()
    status = refusal(
        lambda: course.slam.odometry("wheels", time_us if protected else 51 * STEP_US, *course.travel())
    )
    moved = math.dist(before, course.slam.pose())
    return Measured(status == "BSLAM_E_TIME" and moved == 0, f"{status or 'taken'}, pose moved {moved:.3f} m")


def _frames_lost(protected: bool) -> Measured:
    sure = {"left_speed_sd_mps": 1e-4, "right_speed_sd_mps": 1e-4}
    course = started(50, **({} if protected else sure))
    seen_m = course.sd_m()
    course.drive(100, look=False)
    blind_m = course.sd_m()
    course.drive(5)
    kept = blind_m > 1.5 * seen_m and course.sd_m() < blind_m and course.error_m() < 3 * course.sd_m()
    return Measured(kept, f"sd {seen_m:.4f}, blind {blind_m:.4f}, then {course.sd_m():.4f} m")


def _frame_again(back_steps: int, protected: bool) -> Measured:
    course = started()
    course.drive(1, look=False)
    course.slam.sightings(51 * STEP_US, *course.see())
    before, seen = state_of(course.slam), course.see(51 - back_steps)
    time_us = (51 - back_steps) * STEP_US if protected else 51 * STEP_US + 1
    status = refusal(lambda: course.slam.sightings(time_us, *seen))
    same = state_of(course.slam) == before
    return Measured(
        status == "BSLAM_E_TIME" and same, f"{status or 'taken'}, state {'same' if same else 'changed'}"
    )


# ---- the line ----------------------------------------------------------------------------------------------

_SENT = [Frame(3, number, number * STEP_US, bytes(range(number % 40))) for number in range(60)]


def _received(line: bytes, protected: bool) -> tuple[int, int]:
    """Frames that came through as they were sent, and others."""
    decoder = Decoder()
    frames = list(decoder.push(line)) if protected else _without_check(line)
    good = sum(frame in _SENT for frame in frames)
    return good, len(frames) - good


def _without_check(line: bytes) -> list[Frame]:
    """As a reader without a CRC and a version takes them."""
    frames = []
    for stuffed in line.split(b"\0"):
        try:
            content = cobs.decode(stuffed)
        except cobs.DecodeError:
            continue
        if len(content) >= 12:
            fields = int.from_bytes(content[2:4], "little"), int.from_bytes(content[4:12], "little")
            frames.append(Frame(content[1], *fields, content[12:-2]))
    return frames


def _bits_flipped(protected: bool) -> Measured:
    good = others = 0
    for frame in _SENT[:20]:
        sent = encode(frame)
        for bit in range(8 * (len(sent) - 1)):
            line = bytearray(sent)
            line[bit // 8] ^= 1 << bit % 8
            one, other = _received(bytes(line) + encode(_SENT[30]), protected)
            good, others = good + one, others + other
    return Measured(others == 0, f"{others} wrong frames taken, {good} good ones after them")


def _line_cut(protected: bool) -> Measured:
    others = lost = 0
    for frame in _SENT[:20]:
        sent = encode(frame)
        for cut in range(1, len(sent) - 1):
            one, other = _received(sent[:cut] + b"\0" + encode(_SENT[30]), protected)
            others, lost = others + other, lost + (one != 1)
    return Measured(
        others == 0 and lost == 0, f"{others} wrong frames taken, {lost} good ones lost after them"
    )


def _flood(protected: bool) -> Measured:
    decoder, noise = Decoder(), bytes(1 + i * 7 % 255 for i in range(200_000))
    waiting = 0
    for at in range(0, len(noise), 997):
        list(decoder.push(noise[at : at + 997]))
        waiting = max(waiting, len(decoder._bytes) if protected else at)
    after = len(list(decoder.push(b"\0" + encode(_SENT[3]))))
    return Measured(
        waiting <= LONGEST + 1000 and after == 1, f"{waiting} bytes held at most, {after} frame after it"
    )


def _other_version(protected: bool) -> Measured:
    content = bytes([VERSION + 1, 3, 1, 0]) + bytes(8)
    line = cobs.encode(content + crc16(content).to_bytes(2, "big")) + b"\0"
    good, others = _received(line, protected)
    return Measured(good + others == 0, f"{good + others} frames of version {VERSION + 1} taken")


def _number_faults() -> list[Fault]:
    """Numbers that are none, wherever one goes in."""
    inject = {
        "in odometry": _number_in_odometry,
        "in a sighting": _number_in_sighting,
        "in any other input": _number_elsewhere,
    }
    promise, check = "refused, state unchanged", "the check at the boundary"
    rows = [
        Fault(f"{word} {where}", promise, check, partial(one, value))
        for word, value in (("NaN", math.nan), ("infinity", math.inf))
        for where, one in inject.items()
    ]
    none, whole = "as no travel, state finite", "time in whole microseconds"
    return [
        *rows,
        Fault("denormal in a sighting", promise, check, partial(_number_in_sighting, 1e-40)),
        Fault("denormal in odometry", none, whole, _denormal_odometry),
    ]


def input_faults() -> list[Fault]:
    """The rows of numbers, time, encoders, odometry, frames and the line."""
    clock = "the check of the time stamp"
    crc = "the link's CRC and version"
    return [
        *_number_faults(),
        Fault("dt zero", "refused, state unchanged", clock, partial(_no_time, 0)),
        Fault("dt negative", "refused, state unchanged", clock, partial(_no_time, -STEP_US)),
        Fault("dt too long", "refused; after resuming, as doubtful as told", clock, _too_long),
        Fault("long gap", "the covariance covers what was not seen", "the noise of a gap", _long_gap),
        Fault("encoder roll-over", "no jump: error < 2 cm", "the modular difference", _roll_over),
        Fault("encoder reset", "two jumps counted, error < 5 cm", "speed_max_mps", _encoder_reset),
        Fault("odometry lost", "ticks: error < 5 cm", "counters in place of increments", _lost_odometry),
        Fault(
            "odometry twice", "refused, pose unchanged", clock, lambda on: _odometry_again(50 * STEP_US, on)
        ),
        Fault(
            "odometry out of order",
            "refused, pose unchanged",
            clock,
            partial(_odometry_again, 48 * STEP_US),
        ),
        Fault("frames lost", "doubt grows, and shrinks with the next", "the noise of odometry", _frames_lost),
        Fault("frame twice", "refused, state unchanged", clock, partial(_frame_again, 0)),
        Fault("frame out of order", "refused, state unchanged", clock, partial(_frame_again, 2)),
        Fault("line: bits flipped", "no wrong frame taken", crc, _bits_flipped),
        Fault("line: truncation", "dropped, the next frame is whole", crc, _line_cut),
        Fault("line: flood", "bounded memory, the next frame is whole", "the longest frame", _flood),
        Fault("line: other version", "dropped", crc, _other_version),
    ]
