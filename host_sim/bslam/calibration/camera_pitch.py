"""A camera's pitch from the pictures of a drive: what hangs at a known height tells where the horizon is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.calibration.calibrate import Estimate
from bslam.core.vision import Candidate, FrontEnd, Picture
from bslam.datasets.pictures import SUFFIXES, load_picture
from bslam.errors import BslamError
from bslam.rig import Camera
from bslam.world.kinds import KINDS, Kind

_SCORE_MIN: Final = -0.15
_FEWEST: Final = 12
# A pitch is believed if this share of what is seen whole hangs where its kind does, and if leaving out some
# of the pictures changes it by less.
_HANGING_MIN: Final = 0.85
_ERROR_MAX_RAD: Final = math.radians(1.0)
# How far off all that one room shows may be: its beacons' rims, the kinds' own heights.
_LOOKS_RAD: Final = math.radians(0.2)
_BLOCKS: Final = 10
_ROUNDS: Final = 6
_STARTS_RAD: Final = tuple(math.radians(degrees) for degrees in (-6.0, -3.0, 0.0, 3.0, 6.0))
_ENOUGH_RAD: Final = math.radians(0.02)
# Marks of which neither upper nor lower side is in doubt. With a wrong pitch most things hang misplaced.
_ALLOWED: Final = frozenset({"misplaced"})


def load_drive(folder: Path, camera: Camera) -> list[NDArray[np.uint8]]:
    """The pictures of a folder as frames of the camera, in the order of their names.

    BslamError if there is none, or one cannot be read or is not of the camera's shape.
    """
    paths = sorted(path for path in folder.glob("*") if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise BslamError(f"{folder}: no pictures; allowed: a folder with {', '.join(SUFFIXES)}")
    return [load_picture(path, camera).rgb for path in paths]


@dataclass(frozen=True)
class _Look:
    """What a drive's pictures say of a camera that sits as it is believed to."""

    turns_rad: NDArray[np.float64]  # by how much a beacon says that it looks farther down
    numbers: NDArray[np.int64]  # of the pictures that say so
    whole: int  # things seen whole, of all kinds,
    hanging: int  # and as high above the floor as their kind


def find_pitch(pictures: Sequence[Picture], camera: Camera) -> Estimate:
    """The pitch, rad, positive looks down, and its standard error.

    A thing whose upper side is h_t and whose lower side h_b above the camera (negative: below) is seen at the
    tangents z_t and z_b. Both are h / distance, plus the same error of the horizon: two equations for the
    distance and that error. What is taken for another kind is far off and outvoted. The front end sees most
    where it is told the right pitch, and most then hangs where its kind does: it starts from the best of
    some, and looks again with the pitch found, until it stays. camera: as it is believed to sit; its height
    must be right, its pitch to 6 degrees. BslamError if too little is seen, or it does not agree.
    """
    starts = [replace(camera, pitch_rad=camera.pitch_rad + start_rad) for start_rad in _STARTS_RAD]
    looks = [(_look(pictures, start), start) for start in starts]
    look, camera = max(looks, key=lambda one: 2 * one[0].hanging - one[0].whole)
    for _ in range(_ROUNDS):
        if len(look.turns_rad) < _FEWEST:
            raise BslamError(
                f"{len(look.turns_rad)} doors, cabinets and the like, whole and well seen, in "
                f"{len(pictures)} pictures; allowed: at least {_FEWEST}"
            )
        turn_rad = _densest(look.turns_rad)
        if abs(turn_rad) < _ENOUGH_RAD:
            break
        camera = replace(camera, pitch_rad=camera.pitch_rad + turn_rad)
        look = _look(pictures, camera)
    error_rad = _error(look.turns_rad, _BLOCKS * look.numbers // len(pictures))
    if look.hanging < _HANGING_MIN * look.whole or not error_rad < _ERROR_MAX_RAD:
        raise BslamError(
            f"what is seen does not agree on a pitch: {look.hanging} of {look.whole} things hang as high as "
            f"their kind at {math.degrees(camera.pitch_rad):.1f} degrees, known to "
            f"{math.degrees(error_rad):.1f}; allowed: {_HANGING_MIN:.0%}, and "
            f"{math.degrees(_ERROR_MAX_RAD):.1f} degrees: pictures of more doors and cabinets"
        )
    return Estimate(camera.pitch_rad, math.hypot(error_rad, _LOOKS_RAD))


def _densest(values: NDArray[np.float64]) -> float:
    """The mean of the half of the values that is closest together."""
    ordered = np.sort(values)
    half = len(ordered) // 2 + 1
    first = int(np.argmin(ordered[half - 1 :] - ordered[: len(ordered) - half + 1]))
    return float(ordered[first : first + half].mean())


def _error(values: NDArray[np.float64], block: NDArray[np.int64]) -> float:
    """By leaving out block by block: errors of neighbours in time are not independent. inf for one block."""
    blocks = np.unique(block)
    count = len(blocks)
    if count < 2:
        return math.inf
    left_out = [_densest(values[block != one]) for one in blocks]
    return math.sqrt((count - 1) / count * float(np.sum((np.array(left_out) - _densest(values)) ** 2)))


def _look(pictures: Sequence[Picture], camera: Camera) -> _Look:
    front_end = FrontEnd([camera], threshold=_SCORE_MIN)
    turns_rad, numbers, whole, hanging = [], [], 0, 0
    for number, picture in enumerate(pictures):
        for one in front_end.see(picture).candidates:
            if not one.marks <= _ALLOWED or one.kind not in KINDS:
                continue
            whole += 1
            hanging += one.range_m is not None
            if _stands_across(KINDS[one.kind], camera.z_m):
                turns_rad.append(_turn(one, camera))
                numbers.append(number)
    return _Look(np.array(turns_rad), np.array(numbers, dtype=np.int64), whole, hanging)


def _stands_across(kind: Kind, height_m: float) -> bool:
    """Whether all of the kind begin at one height, below the camera, and end above it: what hangs higher has
    the horizon outside, where it is told badly.
    """
    low_m, high_m = kind.bottom_m
    return low_m == high_m and low_m < height_m < low_m + kind.height_m


def _turn(one: Candidate, camera: Camera) -> float:
    from bslam.world.camera.lens import unproject  # here: most commands need no ray caster

    kind = KINDS[one.kind]
    low_m = kind.bottom_m[0] - camera.z_m
    high_m = low_m + kind.height_m
    left_px, top_px, right_px, bottom_px = one.outline
    middle_px = np.full(2, 0.5 * (left_px + right_px))
    ray = unproject(camera, middle_px, np.array([top_px, bottom_px])).T
    high, low = (float(z) for z in ray[2] / np.hypot(ray[0], ray[1]))
    return (low_m * high - high_m * low) / (low_m * (1 + high * high) - high_m * (1 + low * low))
