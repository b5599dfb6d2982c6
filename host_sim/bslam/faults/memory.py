"""Faults of memory: a full map, flipped bits, power cuts, damaged maps, restarts."""

from __future__ import annotations

import json
import math
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from bslam.core.keeping import Flash, Guard, memory_of, offset_of
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.faults.promise import PARAMS, STEP_US, Course, Fault, Measured, started, state_of
from bslam.maps.blob import KeptMap, parse
from bslam.maps.merge import merge
from bslam.modelfile import FORMAT, VERSION, read_recogniser


def _map_full(protected: bool) -> Measured:
    slam = Slam(PARAMS)
    room = slam._raw.beacons_max
    for label in range(room):
        slam.add_known_beacon(label, float(label), 1.0)
    before = [beacon.uid for beacon in slam.beacons()]
    if not protected:  # make room for what is new
        slam.remove_beacon(before[0])
    account = slam.sightings(0, [0.0], [3.0], [room + 5], [True])[0]
    after = [beacon.uid for beacon in slam.beacons()]
    kept = before == after and account.reason == "map_full" and slam.counters()["map_full"] == 1
    return Measured(
        kept, f"{account.result}, {account.reason}; {len(set(before) & set(after))} of {room} kept"
    )


def _indefinite(protected: bool) -> Measured:
    course = started()
    guard = Guard(course.slam)
    guard.seal()
    memory = memory_of(course.slam)
    at = offset_of(course.slam, "ekf", "covariance")
    memory[at + 3] ^= 0x80  # the variance of x becomes negative
    noticed = not guard.is_good() if protected else False
    course.drive(1)
    insane = course.slam.counters()["insane"] if protected else 0
    return Measured(
        noticed and insane > 0, f"guard {'noticed' if noticed else 'off'}, insane counted {insane}"
    )


def _guarded_bits(protected: bool) -> Measured:
    """Every bit of parameters, mean, covariance, beacons and odometry."""
    course = started()
    slam = course.slam
    guard = Guard(slam)
    guard.seal()
    memory = memory_of(slam)
    rows, beacons = slam._slam.ekf.dim, slam._slam.ekf.beacon_count
    regions = [
        ("params", (offset_of(slam, "params"), slam._ffi.sizeof("bslam_settings_t"))),
        ("mean", (offset_of(slam, "ekf", "mean"), 4 * rows)),
        ("covariance", (offset_of(slam, "ekf", "covariance"), 4 * _row(rows))),
        (
            "beacons",
            (
                offset_of(slam, "ekf", "beacons"),
                beacons * slam._ffi.sizeof("bslam_beacon_t"),
            ),
        ),
        ("odometry", (offset_of(slam, "odometry"), slam._ffi.sizeof("bslam_odometry_t"))),
        ("history", (offset_of(slam, "history"), slam._ffi.sizeof("bslam_history_t"))),
    ]
    if not protected:  # a damaged clock would keep the pipeline busy for years
        regions = regions[1:3]
    found = tried = 0
    for _, (first, size) in regions:
        for bit in range(8 * first, 8 * (first + size)):
            memory[bit // 8] ^= 1 << bit % 8
            found += not (guard.is_good() if protected else _looks_sane(slam))
            memory[bit // 8] ^= 1 << bit % 8
            tried += 1
    return Measured(found == tried, f"{found} of {tried} found")


def _looks_sane(slam: Slam) -> bool:
    """What range checks alone find: a pose or a variance that cannot be."""
    pose, lower = slam.pose(), slam.pose_covariance_lower()
    return all(map(math.isfinite, (*pose, *lower))) and min(lower[0], lower[2], lower[5]) >= 0


def _row(i: int) -> int:
    """Elements before row i of the packed triangle (bslam/linalg/symmat.h)."""
    block = i // 4
    return 4 * (block + 1) * (2 * block + i % 4)


def _fall_back(protected: bool) -> Measured:
    course = started()
    guard = Guard(course.slam)
    guard.seal()
    before = state_of(course.slam)
    memory_of(course.slam)[offset_of(course.slam, "ekf", "mean") + 3] ^= 0x40
    restored = protected and not guard.is_good() and guard.restore()
    same = state_of(course.slam) == before
    course.drive(25)
    kept = restored and same and course.error_m() < 0.05
    return Measured(
        kept, f"restored {restored}, state {'same' if same else 'wrong'}, error {course.error_m():.3g} m"
    )


def _power_cut(every: int, protected: bool) -> Measured:
    old, new = started(30), started(60)
    flash = Flash(old.slam, 2048)
    flash.save(old.slam)
    flash.save(old.slam)
    before = [bytes(slot) for slot in flash.slots]
    used = flash.used
    flash.save(new.slam)
    takes = flash.used - used
    maps = {old.slam.save_map(): "old", new.slam.save_map(): "new"}
    counts = {"old": 0, "new": 0, "neither": 0}
    cuts = [*range(0, takes, every), takes]
    for cut in cuts:
        flash.slots = [bytearray(one) for one in before]
        flash.left = cut
        if not protected:  # one slot only: the other is as good as not there
            flash.slots[1] = bytearray(b"\xff" * len(before[1]))
        flash.save(new.slam)
        flash.left = 1 << 30
        if not protected:
            flash.slots[1][:] = b"\xff" * len(before[1])
        reader = Slam(PARAMS)
        counts[maps.get(reader.save_map() if flash.load(reader) else b"", "neither")] += 1
    kept = counts["neither"] == 0 and counts["new"] >= 1
    return Measured(
        kept, f"{takes + 1} cuts: {counts['old']} old, {counts['new']} new, {counts['neither']} neither"
    )


def _bad_map(protected: bool) -> Measured:
    course = started()
    blob = course.slam.save_map()
    other = Slam(PARAMS)
    other.sightings(0, [], [], [], [])
    before = other.state_bytes
    bad = [blob[:size] for size in range(0, len(blob), 7)] + [blob + b"\0"]
    for bit in range(0, 8 * len(blob), 3):
        damaged = bytearray(blob)
        damaged[bit // 8] ^= 1 << bit % 8
        bad.append(bytes(damaged))
    if protected:
        taken = sum(other.map_fault(one) == "fine" for one in bad)
    else:  # by its beginning alone
        taken = sum(one[:4] == b"BSLM" for one in bad)
    same = other.state_bytes == before
    return Measured(
        taken == 0 and same,
        f"{taken} of {len(bad)} damaged maps taken, state {'same' if same else 'changed'}",
    )


def _restart_in_good_memory(protected: bool) -> Measured:
    """The program starts again, and the memory is as it was; unprotected: the start-up code clears it."""
    course = started()
    guard = Guard(course.slam)
    guard.seal()
    memory = memory_of(course.slam)
    if not protected:
        memory[:] = bytes(len(memory))
    good = guard.is_good()
    if not good:
        return Measured(False, "the memory is empty: all is lost")
    course.slam.resume_odometry(0.2, 0.5)
    course.drive(25)
    return Measured(course.error_m() < 0.05, f"taken up: error {course.error_m():.3f} m 1 s later")


def _restart_in_bad_memory(protected: bool) -> Measured:
    """The program starts again, and a bit of the memory has flipped."""
    course = started()
    flash, guard = Flash(course.slam), Guard(course.slam)
    flash.save(course.slam)
    guard.seal()
    memory_of(course.slam)[offset_of(course.slam, "ekf", "mean") + 4 + 3] ^= 0x40
    if protected and not guard.is_good():
        fresh = Course(Slam(PARAMS, recovery=True))
        fresh.step = course.step
        loaded = flash.load(fresh.slam)
        fresh.slam.odometry("wheels", course.step * STEP_US, 0.0, 0.0)
        fresh.drive(25)
    else:
        fresh, loaded = course, False
        fresh.drive(1, look=False)
    return Measured(
        loaded and fresh.error_m() < 0.05, f"map loaded {loaded}, error {fresh.error_m():.3g} m 1 s later"
    )


_SQUARE = ((2.0, 2.0), (2.0, -2.0), (-2.0, 2.0), (-2.0, -2.0))


def _map_of(labels: list[int], places: tuple[tuple[float, float], ...]) -> KeptMap:
    slam = Slam(PARAMS)
    for step in range(10):
        slam.odometry("wheels", step * STEP_US, 0.0, 0.0)
        bearings = [math.atan2(y, x) for x, y in places]
        slam.sightings(
            step * STEP_US, bearings, [math.hypot(*at) for at in places], labels, [True] * len(labels)
        )
    return parse(slam.save_map())


def _nameless(kept: KeptMap) -> KeptMap:
    return replace(kept, beacons=tuple(replace(one, label=-1) for one in kept.beacons))


def _bad_merge(protected: bool) -> Measured:
    """Maps of two rooms in which four things stand alike, by which one fits on the other."""
    uneven = (*_SQUARE[:3], (-3.0, -1.0))
    here, there = _map_of([0, 1, 2, 3], uneven), _map_of([4, 5, 6, 7], uneven)
    if not protected:
        here, there = _nameless(here), _nameless(there)
    try:
        merged = merge(here, there)
    except BslamError as error:
        return Measured(True, f"refused: {str(error).split(';')[0]}")
    return Measured(False, f"{len(merged.shared)} beacons of one room taken for those of another")


def _full_store(protected: bool) -> Measured:
    """A machine's store is full of one side of its beacon, and then sees the other side only."""
    from bslam.core.learner import SIGNATURE_SIZE, Learner

    random = np.random.default_rng(5)
    sides = random.uniform(0.0, 1.0, (2, SIGNATURE_SIZE)).astype(np.float32)
    # It looks much like the side that was seen first.
    rival = (sides[0] + random.uniform(-0.2, 0.2, SIGNATURE_SIZE)).astype(np.float32)

    def views(side: np.ndarray, count: int) -> np.ndarray:
        return np.clip(side + 0.05 * random.standard_normal((count, SIGNATURE_SIZE)), 0, 1).astype(np.float32)

    learner = Learner()
    own, other = learner.add(), learner.add()
    shown = np.concatenate([views(sides[0], 16), views(sides[1], 60)])
    if not protected:  # the newest in place of the oldest
        shown = shown[-16:]
    for one, strange in zip(shown, views(rival, len(shown)), strict=True):
        learner.show(own, one)
        learner.show(other, strange)
        learner.train()
    values = learner.decide([own], views(sides[0], 50))
    share = float(np.mean(values > 0))
    held = learner.samples(own)
    return Measured(
        held <= 16 and share > 0.95, f"{held} samples held, first side recognised {100 * share:.0f} %"
    )


def _bad_model(protected: bool) -> Measured:
    """Files of a recogniser that are cut short, of another version, or hold what is no number."""
    good = {
        "format": FORMAT,
        "version": VERSION,
        "notes": {},
        "objects": [
            {"name": "door", "height_m": 2.0, "depth_m": 0.1},
            {"name": "box", "height_m": 1.0, "depth_m": 0.1},
        ],
        "features": 3,
        "reject_margin": 0.0,
        "bias": [0.0, 0.0],
        "weights": [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]],
    }
    text = json.dumps(good)
    bad = [text[:cut] for cut in range(0, len(text), 5)]
    for key, value in (
        ("version", 99),
        ("features", 4),
        ("weights", [[1.0, math.nan, 3.0]]),
        ("bias", [0.0]),
    ):
        bad.append(json.dumps(good | {key: value}))
    taken = 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.json")
        path.write_text(text)
        read_recogniser(path, 3)
        for one in bad:
            path.write_text(one)
            try:
                read_recogniser(path, 3) if protected else json.loads(one)
                taken += 1
            except (BslamError, ValueError):
                pass
    return Measured(taken == 0, f"{taken} of {len(bad)} damaged models taken")


def memory_faults(cut_every: int) -> list[Fault]:
    """The rows of full stores, memory, flash and restarts."""
    return [
        Fault("map full", "said and counted, no beacon overwritten", "no eviction", _map_full),
        Fault("sample store full", "what matters stays", "the choice of what leaves", _full_store),
        Fault(
            "covariance loses definiteness",
            "noticed and counted, never repaired",
            "guard and sanity check",
            _indefinite,
        ),
        Fault("RAM bit flip", "each one found at the next check", "the guard's checksum", _guarded_bits),
        Fault(
            "fall back to the last good state",
            "the state as it was sealed, and on from there",
            "the guard's copy",
            _fall_back,
        ),
        Fault(
            "power loss during a save",
            "old or new map at every byte",
            "the second slot",
            partial(_power_cut, cut_every),
        ),
        Fault("malformed model", "refused whole", "the check of every key", _bad_model),
        Fault("malformed map", "refused whole, state unchanged", "CRC and length", _bad_map),
        Fault("maps of two places merged", "refused with the reason", "identities of beacons", _bad_merge),
        Fault(
            "watchdog: memory good",
            "goes on where it was",
            "memory that outlasts a reset",
            _restart_in_good_memory,
        ),
        Fault(
            "watchdog: memory bad",
            "goes on from the saved map",
            "the guard",
            _restart_in_bad_memory,
        ),
    ]
