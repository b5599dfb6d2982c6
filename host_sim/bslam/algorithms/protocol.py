"""What an algorithm must offer to be compared: a class with five methods (docs/PLUGIN.md).

Times are integer microseconds, lengths metres, angles radians in (-pi, pi]. The map's frame is the start
pose: x forward, y left, heading counter-clockwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bslam.log import Robot
from bslam.motion import Pose


@dataclass(frozen=True)
class Setup:
    """What an algorithm may know before the drive; it is handed to the constructor."""

    robot: Robot
    """Geometry and noise of wheels and sensor, as in a log's robot.toml."""
    observation: str
    """ "distance" (direction and distance) or "direction" (no sighting has a range)."""
    identities: bool
    """True: sightings have labels; False: the algorithm has to find out whose they are."""
    beacons_max: int
    """Beacons that the map must hold."""
    parameters: Mapping[str, int | float]
    """Every parameter of bslam's core in force, by its name in the C headers (see `bslam params`)."""
    real: str = "float"
    """Scalar type of bslam's core: "float" or "double"."""
    seeds: NDArray[np.float32] | None = None
    """(k, 71) signatures of what is no beacon, for algorithms that learn looks; None: there are none."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """One beacon in one image, seen from the sensor: `robot` says where on the robot that sits."""

    bearing_rad: float
    """Direction from the sensor's forward axis, to the left positive."""
    range_m: float | None
    """Distance; None: direction only."""
    label: int | None
    """Identity; None: nobody knows."""
    mappable: bool = True
    """False: the detector says that it is a moving thing."""
    bearing_sd_rad: float | None = None
    """Noise as the detector gives it; None: as `robot` has it."""
    range_sd_m: float | None = None
    """The same of the distance."""
    range_scale_sd: float | None = None
    """By what part all distances of this thing err alike."""
    signature: NDArray[np.float32] | None = None
    """(71,) how it looks; None: nobody knows, or identities are given."""
    beacon_class: int | None = None
    """The detector's kind of beacon, 1 to 254; None: it does not say, or identities are given."""
    score: float | None = None
    """How sure the detector is that this is a beacon; None: it does not say."""


@dataclass(frozen=True, slots=True)
class Account:
    """What became of one sighting, for an algorithm that says so."""

    result: str
    """ "matched" with a beacon of the map, "new" beacon, "rejected" (gated out), "deferred" (undecided,
    or it only says whether there is a beacon)."""
    beacon_uid: int | None = None
    """The beacon that it was matched with or that was made of it: a number that no other ever has."""
    reason: str = "none"
    """Why it was rejected: "class" if because the detector calls it a moving thing."""


@dataclass(frozen=True)
class Landmark:
    """A beacon of the final map, in the start pose's frame."""

    x_m: float
    y_m: float
    label: int | None = None
    """Identity, if sightings had any."""
    covariance_m2: NDArray[np.float64] | None = None
    """(2, 2); None: not known."""
    uid: int | None = None
    """The number by which accounts name it; None: there are no accounts."""


class Algorithm(Protocol):
    """A SLAM algorithm. The constructor takes a `Setup`, or nothing.

    Beyond these methods a class may have `pose_covariance() -> (3, 3)` of (x, y, theta), from which NEES is
    computed, and `needs_identity = True`, if it cannot do without labels: it gets them whatever
    --association says, and the table marks it.

    Wrong associations can be counted of a class that has `accounts() -> Sequence[Account] | None` of the last
    image's sightings (None: it refused the image), and `uids() -> Iterable[int]` of the beacons in its map,
    tentative ones included.

    Of robots with a gyro, a class that has `gyro(time_us, rate_radps, sd_radps)` is told what it says
    (`Gyroscopic`).

    An exception ends the run and is reported with the algorithm's name; so do a pose or map that is not
    finite, and a call that takes longer than --call-limit.
    """

    def reset(self, seed: int) -> None:
        """Begin a new drive at pose (0, 0, 0) with an empty map. `seed` for whatever is random inside."""

    def odometry(self, time_us: int, left_m: float, right_m: float) -> None:
        """The wheels have rolled so far since the call before; the first call: since the start.

        time_us is the end of that way and rises from call to call.
        """

    def observe(self, time_us: int, sightings: Sequence[Sighting]) -> None:
        """One image; it may show nothing. Called once before the first `odometry`, with the start's image.

        time_us is the stamp: that of the odometry call before, or between it and the next.
        """

    def pose(self) -> Pose:
        """(x_m, y_m, theta_rad) at the last odometry call, by all that was seen until now."""

    def map(self) -> Sequence[Landmark]:
        """The beacons known by now; asked for at the end of the drive."""


class Gyroscopic(Algorithm, Protocol):
    """An algorithm that takes a gyro."""

    def gyro(self, time_us: int, rate_radps: float, sd_radps: float) -> None:
        """How fast the robot turned on the way that the next `odometry`, of the same stamp, tells of.

        The mean over that time, to the left positive, and its noise, independent of others. Not called for a
        step without a reading.
        """
