"""What a run says at one moment, for whoever watches it.

Data only, like a log: runs make moments while it feeds the filter, view shows them. Everything is in
the frame of the map, whose origin is the start pose: x forward, y left, m, rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

PAUSED, RUNNING, FINISHED, FAILED = "paused", "running", "finished", "failed"
"""What a run can be doing."""


@dataclass(frozen=True)
class Told:
    """A sighting, and the account that the filter gave of it."""

    time_s: float
    bearing_rad: float  # from the sensor's forward axis
    range_m: float | None  # None: direction only
    true_id: int  # -1: of no beacon
    result: str  # "matched", "new", "rejected", "deferred"; "refused": the whole frame was
    reason: str
    beacon_uid: int | None
    test_ratio: float | None  # innovation squared over the gate's bound: above 1 it is rejected
    weight: float
    wrong: bool = False  # matched with another beacon, or a new one of a beacon that is in the map

    @property
    def verdict(self) -> str:
        """The result, or "wrong"."""
        return "wrong" if self.wrong else self.result


@dataclass(frozen=True)
class Spot:
    """A beacon of the map."""

    uid: int
    label: int  # -1: none
    x_m: float
    y_m: float
    covariance_m2: NDArray[np.float64]  # (2, 2)
    sightings: int
    confirmed: bool


@dataclass(frozen=True)
class Box:
    """What the front end found in a camera's frame; edges in px, pixel i covers [i - 0.5, i + 0.5]."""

    outline: tuple[float, float, float, float]  # left, top, right, bottom
    lines: tuple[str, ...]
    result: str  # what became of its sighting, as in Told, or "wrong"; "": nothing yet


@dataclass(frozen=True)
class Shown:
    """A camera's frame."""

    rgb: NDArray[np.uint8]  # (h, w, 3)
    boxes: Sequence[Box]
    caption: str


@dataclass(frozen=True)
class Course:
    """Rows that the run has gone through, the start first; arrays that only grow are never copied."""

    time_s: NDArray[np.float64]  # (k,)
    estimate: NDArray[np.float64]  # (k, 3)
    sd_m: NDArray[np.float64]  # (k,) what the filter says of its position: root of the two variances' sum
    truth: NDArray[np.float64]  # (k, 3) NaN where nobody knows
    error_m: NDArray[np.float64]  # (k,)


@dataclass(frozen=True)
class Moment:
    """The run after step `step`."""

    state: str
    step: int
    course: Course
    covariance_m2: NDArray[np.float64]  # (2, 2) of the position
    beacons: Sequence[Spot]
    true_beacons_m: NDArray[np.float64]  # (b, 2), in the order of Stage.beacon_id
    frame: Sequence[Told]  # the newest frame, if it belongs to this step
    told: Sequence[Told]  # the newest sightings, the last first
    shown: Shown | None = None
    message: str = ""  # why it failed


@dataclass(frozen=True)
class Stage:
    """What does not change while a run goes on."""

    title: str
    steps: int
    walls_m: NDArray[np.float64]  # (w, 4) x1, y1, x2, y2
    beacon_id: NDArray[np.int64]  # (b,) of the true beacons
    beacon_name: tuple[str, ...] = ()  # (b,) of them, as the log has it
    sensor: tuple[float, float, float] = (0.0, 0.0, 0.0)  # x m, y m, yaw rad on the robot
    aligned: bool = False  # the truth has a frame of its own, and is moved to fit the estimate so far
    has_camera: bool = False
    extent_m: tuple[float, float, float, float] = field(default=(-1.0, -1.0, 1.0, 1.0))  # x, y low; x, y high
