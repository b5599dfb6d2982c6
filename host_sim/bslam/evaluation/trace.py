"""What a run leaves behind: the input of every figure and picture."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class MapBeacon:
    """A beacon of the final map, map frame (origin = start pose)."""

    uid: int
    label: int  # identity that the map holds, -1: none
    true_id: int  # identity of the sighting that made it, -1: clutter
    x_m: float
    y_m: float
    covariance_m2: NDArray[np.float64]  # (2, 2)
    sightings: int
    confirmed: bool
    range_m: float  # polar, from the start pose
    phi_rad: float


@dataclass(frozen=True)
class SightingCounts:
    """How the sightings of a run were used; definitions in `ledger`."""

    sightings: int = 0
    wrong_associations: int = 0
    false_new: int = 0
    missed: int = 0
    deferred: int = 0
    rejected: int = 0
    refused: int = 0
    told: bool = True  # False: nobody said what became of them, only `sightings` counts


@dataclass(frozen=True)
class Trace:
    """Estimates of one run; row 0 is the start, row k follows odometry step k and the sightings after it.

    With an odometry lead, `pose` is where the robot was at the row's time by all that was known then; the
    covariance is always that of the newest state.
    """

    time_us: NDArray[np.int64]  # (n + 1,) time of the log
    pose: NDArray[np.float64]  # (n + 1, 3) x_m, y_m, theta_rad in the map frame
    covariance: NDArray[np.float64]  # (n + 1, 3, 3) of x_m, y_m, theta_rad
    seen: NDArray[np.bool_]  # (n + 1,) at least one sighting belongs to the row
    counts: SightingCounts
    beacons: tuple[MapBeacon, ...]
    parameters: dict[str, int | float]  # effective parameters of the core that differ from its defaults
    counters: dict[str, int] = field(default_factory=dict)  # the core's own counters
    refusals: dict[str, int] = field(default_factory=dict)  # inputs that the core refused, by status
    target: dict[str, Any] = field(default_factory=dict)  # image, hash, instructions, if it ran on a target
    step_us_median: float = 0.0
    kept_map: bytes | None = None  # the final map as docs/MAP.md has it; None: none could be saved

    @property
    def steps(self) -> int:
        """Odometry steps."""
        return len(self.time_us) - 1

    @property
    def time_s(self) -> NDArray[np.float64]:
        """(n + 1,) seconds since the start."""
        return (self.time_us - self.time_us[0]) * 1e-6
