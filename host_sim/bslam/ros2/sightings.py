"""Markers of a bag as sightings: corners to places, places to bearings and ranges, names to numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.log import Sightings
from bslam.parsing.csvtable import is_number
from bslam.parsing.identities import BEACON_ID_MAX, WORD_MAX, is_identity
from bslam.ros2.geometry import Camera, Mount, Transform, on_ground, place_tags
from bslam.ros2.messages import Detection, Frame
from bslam.ros2.stamps import in_order
from bslam.ros2.tags import TagSizes

Floats = NDArray[np.float64]

BEARING_LEFT_RAD: Final = 0.005
RANGE_LEFT: Final = 0.01
"""What calibration leaves: noise beside that of the corners; of a distance, a part of it."""
_BEARING_SD_RAD, _RANGE_SD_M = (1e-5, math.pi), (1e-3, 1e4)  # as a log may have them
_FARTHEST_M = 1e6
_ROUNDING: Final = 1e-6  # of a covariance's largest eigenvalue, as numbers of 32 bits leave it
_MIDDLE: Final = Mount(0.0, 0.0, 0.0)
_COLUMNS: Final = ("bearing_rad", "range_m", "bearing_sd_rad", "range_sd_m", "label", "mappable")


@dataclass(frozen=True)
class Markers:
    """How detections become sightings.

    sizes, camera: needed for corners alone. poses: of each camera frame on the robot.
    """

    poses: Mapping[str, Transform]
    sizes: TagSizes
    camera: Camera | None
    pixel_sd: float

    @property
    def mount(self) -> Mount:
        """The sensor of the log: the camera; the robot's middle, where there are several."""
        only = list(self.poses.values())
        return Mount.of(only[0]) if len(only) == 1 else _MIDDLE

    def placed(self, detections: Sequence[Detection]) -> list[Detection | None]:
        """Each with its place, which corners are turned into; None: it has none in front of the camera.

        An identity that is a number but no count, as -1 for a marker that is not known, becomes none; so does
        a covariance that can be none.
        """
        seen = [i for i, one in enumerate(detections) if one.corners_px is not None]
        found = list(detections)
        for i, place in zip(seen, self._of_corners([detections[i] for i in seen]), strict=True):
            found[i] = place
        return [_cleared(one) if _is_place(one) else None for one in found]

    def _of_corners(self, detections: Sequence[Detection]) -> list[Detection]:
        if not detections:
            return []
        assert self.camera is not None
        corners = np.array([one.corners_px for one in detections])
        rays = self.camera.rays(corners.reshape(-1, 2)).reshape(-1, 4, 2)
        side_m = np.array([self.sizes.of(one.identity) or math.nan for one in detections])
        places, covariances = place_tags(rays, side_m, self.pixel_sd / min(self.camera.fx, self.camera.fy))
        columns = zip(detections, places, covariances, strict=True)
        return [Detection(one.identity, place, covariance) for one, place, covariance in columns]

    def sight(
        self, frame_id: str, placed: Detection, mount: Mount
    ) -> tuple[float, float, float, float] | None:
        """Bearing, range, and the sd of each (0: as the robot has it); None: it is right above the mount."""
        assert placed.position_m is not None
        told = placed.covariance_m2
        bearing_rad, range_m, bearing_sd, range_sd = on_ground(
            placed.position_m, told, self.poses[frame_id], mount
        )
        if not range_m > 0.0:
            return None
        if told is None:
            return bearing_rad, range_m, 0.0, 0.0
        bearing_sd = math.hypot(bearing_sd, BEARING_LEFT_RAD)
        range_sd = math.hypot(range_sd, RANGE_LEFT * range_m)
        return bearing_rad, range_m, _within(bearing_sd, _BEARING_SD_RAD), _within(range_sd, _RANGE_SD_M)

    def columns(self, frame: Frame, words: dict[str, int]) -> dict[str, list[Any]]:
        """A frame as `Slam.sightings` takes it, seen from the robot's middle, with its detector's noise.

        So the filter needs no mount, and any number of cameras will do. words: the label of each identity;
        new ones are added. Without an identity the label is -1.
        """
        columns: dict[str, list[Any]] = {name: [] for name in _COLUMNS}
        for one in self.placed(frame.detections):
            sight = None if one is None else self.sight(frame.frame_id, one, _MIDDLE)
            if one is not None and sight is not None:
                label = words.setdefault(one.identity, len(words)) if one.identity else -1
                for name, value in zip(_COLUMNS, (*sight, label, True), strict=True):
                    columns[name].append(value)
        return columns


def _is_place(one: Detection) -> bool:
    return one.position_m is not None and 0.0 < float(np.linalg.norm(one.position_m)) < _FARTHEST_M


def _cleared(one: Detection) -> Detection:
    """Without an identity or a covariance that can be none."""
    known = is_identity(one.identity) or not is_number(one.identity)
    told = one.covariance_m2 is not None and _is_covariance(one.covariance_m2)
    identity, covariance_m2 = one.identity if known else "", one.covariance_m2 if told else None
    return replace(one, identity=identity, covariance_m2=covariance_m2)


def _is_covariance(matrix: Floats) -> bool:
    values = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
    return bool(values[0] >= -_ROUNDING * values[-1])


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])


def sightings_of(
    frames: Sequence[Frame], markers: Markers, topic: str, notes: list[str]
) -> tuple[Sightings, tuple[str, ...]]:
    """The sightings in order of time, and the words that stand for identities, if they are no numbers.

    Raises BslamError where the stamps make no sense.
    """
    order, mount = in_order([one.time_ns for one in frames], topic, notes), markers.mount
    rows = [(frames[i], one) for i in order for one in frames[i].detections]
    texts, numbers = list[str](), list[tuple[float, ...]]()
    lost = twice = unknown = odd = 0
    seen: set[tuple[int, str, str]] = set()
    for (frame, one), placed in zip(rows, markers.placed([one for _, one in rows]), strict=True):
        sight = None if placed is None else markers.sight(frame.frame_id, placed, mount)
        if placed is None or sight is None:
            lost += 1
            continue
        key = (frame.time_ns // 1000, frame.frame_id, placed.identity)
        if placed.identity and key in seen:
            twice += 1
            continue
        unknown += placed.identity != one.identity
        odd += one.covariance_m2 is not None and placed.covariance_m2 is None
        seen.add(key)
        texts.append(placed.identity)
        numbers.append((float(key[0]), *sight))
    for count, said in (
        (twice, "left out {} markers that their frame has already"),
        (lost, "left out {} markers without a place in front of the camera"),
        (unknown, "{} markers have a number that is no count; their identity counts as unknown"),
        (odd, "{} markers have a covariance that is none (a negative eigenvalue); it is left out"),
    ):
        if count:
            notes.append(f"{topic}: {said.format(count)}")
    return _table(texts, numbers)


def _table(texts: list[str], numbers: list[tuple[float, ...]]) -> tuple[Sightings, tuple[str, ...]]:
    time, bearing_rad, range_m, bearing_sd, range_sd = np.array(numbers, dtype=np.float64).reshape(-1, 5).T
    identity, words = _numbered(texts)
    told = bool(bearing_sd.any())
    table = Sightings(
        time_us=time.astype(np.int64),
        beacon_id=identity,
        bearing_rad=bearing_rad,
        range_m=range_m,
        mappable=np.ones(len(texts), dtype=np.bool_),
        bearing_sd_rad=bearing_sd if told else None,
        range_sd_m=range_sd if told else None,
    )
    return table, words


def _numbered(texts: Sequence[str]) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Numbers for identities; the words that they stand for, unless all are numbers of one family."""
    names = sorted({one for one in texts if one})
    tails = [one.rpartition(":")[2] for one in names]
    of_one_family = len({one.rpartition(":")[0] for one in names}) <= 1
    if of_one_family and all(one.isdecimal() and int(one) <= BEACON_ID_MAX for one in tails):
        number, words = dict(zip(names, map(int, tails), strict=True)), list[str]()
    else:
        number, words = {one: i for i, one in enumerate(names)}, names
    for one in words:
        if len(one) > WORD_MAX or not one.isprintable():
            raise BslamError(f"marker {one!r}: allowed: up to {WORD_MAX} printable characters")
    return np.array([number.get(one, -1) for one in texts], dtype=np.int64), tuple(words)
