"""Faults of memory: a full map, flipped bits, power cuts, damaged maps, restarts."""

from __future__ import annotations

import json
import math
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from bslam.core.appearance import SIGNATURE_SIZE
from bslam.core.builds import SIZE_CLASSES
from bslam.core.scanner import NOTHING
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.faults.flash import Flash
from bslam.faults.promise import (
    PARAMS,
    STEP_US,
    Course,
    Fault,
    Measured,
    flip,
    places_of,
    refusal,
    started,
)
from bslam.maps.blob import KeptMap, parse
from bslam.maps.merge import merge
from bslam.scannerfile import read_scanner, scanner_text


def _map_full(protected: bool) -> Measured:
    room = SIZE_CLASSES[0]
    slam = Slam(PARAMS, beacons_max=room)
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


_SIGN, _EXPONENT = (3, 7), (3, 6)  # byte and bit of a float


def _is_noticed(slam: Slam) -> bool:
    """By the guard, which looks before it is asked whether this reading is one: it is too old."""
    return refusal(lambda: slam.odometry("wheels", 0, 0.0, 0.0)) == "BSLAM_E_STATE"


def _indefinite(protected: bool) -> Measured:
    """The variance of the heading, which the factor of the covariance begins with, becomes negative."""
    guarded, course = (started(filter=0, guard=on) for on in (int(protected), 0))
    for one in (guarded, course):
        byte, bit = _SIGN
        flip(one.slam, places_of(one.slam, one.slam.pose_covariance_lower()[5])[0] + byte, bit)
    noticed = _is_noticed(guarded.slam)
    course.drive(1)
    insane = course.slam.counters()["insane"] if protected else 0
    return Measured(
        noticed and insane > 0, f"guard {'noticed' if noticed else 'off'}, insane counted {insane}"
    )


def _guarded_bits(protected: bool) -> Measured:
    """Every bit of the memory that is in use, but those that change nothing that the filter knows."""
    course = started(guard=int(protected))
    slam = course.slam
    known = slam.fingerprint(0)
    if protected:
        used = [at for at, byte in enumerate(slam.state_bytes) if byte]
    else:  # of the pose alone: a damaged clock would keep the filter busy for years
        first = places_of(slam, *slam.pose())[0]
        used = list(range(first, first + 12))
    found = tried = 0
    for at in used:
        for bit in range(8):
            flip(slam, at, bit)
            is_found = _is_noticed(slam) if protected else not _looks_sane(slam)
            found += is_found
            # A count that is not as it was is always found: nothing is gone through that is not there.
            tried += is_found or slam.fingerprint(0) != known
            flip(slam, at, bit)
    return Measured(found == tried, f"{found} of {tried} found")


def _looks_sane(slam: Slam) -> bool:
    """What range checks alone find: a pose or a variance that cannot be."""
    pose, lower = slam.pose(), slam.pose_covariance_lower()
    return all(map(math.isfinite, (*pose, *lower))) and min(lower[0], lower[2], lower[5]) >= 0


def _damage(slam: Slam, copies: int) -> None:
    """The pose of the filter, and of so many copies of it."""
    byte, bit = _EXPONENT
    for at in places_of(slam, *slam.pose())[: 1 + copies]:
        flip(slam, at + byte, bit)


def _estimate(slam: Slam) -> tuple[object, ...]:
    places = [(one.uid, one.x_m, one.y_m) for one in slam.beacons()]
    return slam.pose(), slam.pose_covariance_lower(), places


def _fall_back(protected: bool) -> Measured:
    course = started(guard=int(protected))
    before = _estimate(course.slam)
    _damage(course.slam, 0)
    restored = _is_noticed(course.slam) and not refusal(lambda: course.slam.restart(0.0, 0.0))
    same = _estimate(course.slam) == before
    course.drive(25)
    kept = restored and same and course.error_m() < 0.05
    return Measured(
        kept, f"restored {restored}, state {'same' if same else 'wrong'}, error {course.error_m():.3g} m"
    )


def _as_loaded(slam: Slam) -> bytes:
    """What is saved of a map that was loaded from a save: what its values hung on besides is gone."""
    reader = Slam(PARAMS)
    reader.load_map(slam.save_map())
    return reader.save_map()


def _power_cut(every: int, protected: bool) -> Measured:
    old, new = started(30), started(60)
    flash = Flash(2048)
    flash.save(old.slam)
    flash.save(old.slam)
    before = [bytes(slot) for slot in flash.slots]
    used = flash.used
    flash.save(new.slam)
    takes = flash.used - used
    maps = {_as_loaded(old.slam): "old", _as_loaded(new.slam): "new"}
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
        taken = sum(not refusal(partial(other.load_map, one)) for one in bad)
    else:  # by its beginning alone
        taken = sum(one[:4] == b"BSLM" for one in bad)
    same = other.state_bytes == before
    return Measured(
        taken == 0 and same,
        f"{taken} of {len(bad)} damaged maps taken, state {'same' if same else 'changed'}",
    )


def _restart_in_good_memory(protected: bool) -> Measured:
    """The program starts again, and the memory is as it was; unprotected: the start-up code clears it."""
    course = started(guard=1)
    if not protected:
        course.slam.memory[:] = bytes(len(course.slam.memory))
    if refusal(lambda: course.slam.restart(0.2, 0.5)):
        return Measured(False, "the memory is empty: all is lost")
    course.drive(25)
    return Measured(course.error_m() < 0.05, f"taken up: error {course.error_m():.3f} m 1 s later")


def _restart_in_bad_memory(protected: bool) -> Measured:
    """The program starts again, and a bit of the memory has flipped, and the same one of the copy."""
    course, flash = started(guard=int(protected)), Flash()
    flash.save(course.slam)
    _damage(course.slam, 1)
    if protected and refusal(lambda: course.slam.restart(0.2, 0.5)):
        fresh = Course(Slam(PARAMS | {"recovery": 1}))
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


# Of a machine's store alone: where a thing stands says which one it is, since nothing is new.
_STORE = {"association": 3, "new_per_m2": 1e-9, "learn_budget": 100_000, "missed_views": 0}
_VIEW_US = 2 * STEP_US  # so that sixteen views last for the second that a beacon needs
_STEP_M = 0.11  # a view is learned once the robot has gone 0.1 m: it goes to and fro


def _full_store(protected: bool) -> Measured:
    """A classifier's store is full of one side of its beacon, and then sees the other side only."""
    random = np.random.default_rng(5)
    sides = random.uniform(0.0, 1.0, (2, SIGNATURE_SIZE)).astype(np.float32)
    # It looks much like the side that was seen first.
    rival = (sides[0] + random.uniform(-0.2, 0.2, SIGNATURE_SIZE)).astype(np.float32)

    def views(side: np.ndarray, count: int) -> np.ndarray:
        return np.clip(side + 0.05 * random.standard_normal((count, SIGNATURE_SIZE)), 0, 1).astype(np.float32)

    slam = Slam(PARAMS | _STORE)
    shown = np.concatenate([views(sides[0], 16), views(sides[1], 60)])
    if not protected:  # the newest in place of the oldest
        shown = shown[-16:]
    for step, (one, strange) in enumerate(zip(shown, views(rival, len(shown)), strict=True)):
        way_m = _STEP_M if step % 2 else -_STEP_M
        slam.odometry("wheels", step * _VIEW_US, way_m, way_m)
        both = np.stack([one, strange])
        ahead_m = 2.0 - (_STEP_M if step % 2 else 0.0)
        range_m, bearing_rad = math.hypot(ahead_m, 1.0), math.atan2(1.0, ahead_m)
        places = ([bearing_rad, -bearing_rad], [range_m, range_m])
        slam.sightings(step * _VIEW_US, *places, [-1, -1], [True, True], signature=both)
    kept = parse(slam.save_map())
    owner = next(one.machine for one in kept.beacons if one.y_m > 0)
    assert owner is not None
    own = kept.machines[owner]
    values = own.values(np.rint(127 * views(sides[0], 50)).astype(np.int8))
    share = float(np.mean(values > 0))
    held = len(own.samples)
    return Measured(
        held <= 16 and share > 0.95, f"{held} samples held, first side recognised {100 * share:.0f} %"
    )


def _bad_model(protected: bool) -> Measured:
    """Files of a scanner that are cut short, of another version, or hold what is no number."""
    text = scanner_text(NOTHING)
    good = json.loads(text)
    bad = [text[:cut] for cut in range(0, len(text) - 1, 5)]
    bad += [json.dumps(good | {key: 99}) for key in ("version", "channels")]
    window = good["windows"][0]
    for key, value in (
        ("scale", math.nan),
        ("edge_bias", [0.0]),
        ("weights", [128] * len(window["weights"])),
    ):
        bad.append(json.dumps(good | {"windows": [window | {key: value}]}))
    taken = 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.json")
        path.write_text(text)
        read_scanner(path)
        for one in bad:
            path.write_text(one)
            try:
                read_scanner(path) if protected else json.loads(one)
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
