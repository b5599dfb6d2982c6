"""What a fault is, what is promised of it, and what was measured."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass

from bslam.core.errors import CoreError
from bslam.core.slam import Slam


@dataclass(frozen=True)
class Measured:
    """What was found. kept: as promised."""

    kept: bool
    text: str


@dataclass(frozen=True)
class Fault:
    """One fault. `inject(protected)` measures it; protected False: without what protects from it."""

    name: str
    promise: str
    protection: str
    inject: Callable[[bool], Measured]
    takes_clone: bool = False  # what it is injected into is built from the firmware's sources


STEP_US = 40_000
STEP_S = 0.04
BEACONS = ((4.0, 0.0), (3.0, 3.0), (-1.0, 4.0), (-3.0, 0.5), (0.5, -3.0))
SPEED_MPS, TURN_RADPS = 0.4, 0.25
WHEELBASE_M = 0.4
TICKS, RADIUS_M = 1024, 0.05

PARAMS: dict[str, float] = {
    "velocity_states": 0,
    "association": 0,
    "left_speed_sd_mps": 0.05,
    "right_speed_sd_mps": 0.05,
    "ticks_per_revolution": TICKS,
    "left_radius_m": RADIUS_M,
    "right_radius_m": RADIUS_M,
    "wheelbase_m": WHEELBASE_M,
}


class Course:
    """A robot on a circle, seen exactly, among labelled beacons."""

    def __init__(self, slam: Slam) -> None:
        self.slam = slam
        self.step = 0

    def pose(self, step: float) -> tuple[float, float, float]:
        """Where it is by then."""
        theta = TURN_RADPS * STEP_S * step
        radius = SPEED_MPS / TURN_RADPS
        return radius * math.sin(theta), radius * (1 - math.cos(theta)), theta

    def travel(self) -> tuple[float, float]:
        """Of the left and right wheel in a step, m."""
        middle, half = SPEED_MPS * STEP_S, TURN_RADPS * STEP_S * WHEELBASE_M / 2
        return middle - half, middle + half

    def ticks(self, step: int, start: int = 0) -> tuple[int, int]:
        """The 16-bit counters by then."""
        per_m = TICKS / (2 * math.pi * RADIUS_M)
        left, right = self.travel()
        return (start + round(left * step * per_m)) % 65536, (start + round(right * step * per_m)) % 65536

    def see(self, step: float | None = None) -> tuple[list[float], list[float], list[int], list[bool]]:
        """What a frame shows then: bearings, ranges, labels, mappable."""
        x, y, theta = self.pose(self.step if step is None else step)
        polar = [(bx - x, by - y) for bx, by in BEACONS]
        bearing = [math.remainder(math.atan2(dy, dx) - theta, 2 * math.pi) for dx, dy in polar]
        return bearing, [math.hypot(*one) for one in polar], list(range(len(BEACONS))), [True] * len(BEACONS)

    def drive(self, steps: int, *, look: bool = True) -> None:
        """Feed so many steps."""
        for _ in range(steps):
            self.step += 1
            self.slam.odometry("wheels", self.step * STEP_US, *self.travel())
            if look:
                self.slam.sightings(self.step * STEP_US, *self.see())

    def error_m(self) -> float:
        """Of the estimated position now."""
        x, y, _ = self.slam.pose()
        true_x, true_y, _ = self.pose(self.step)
        error = math.hypot(x - true_x, y - true_y)
        return error if math.isfinite(error) else math.inf

    def sd_m(self) -> float:
        """What the filter says of it."""
        xx, _, yy, *_ = self.slam.pose_covariance_lower()
        return math.sqrt(max(xx + yy, 0.0))


def started(steps: int = 50, **params: float) -> Course:
    """A course that goes well."""
    course = Course(Slam(PARAMS | params))
    course.slam.sightings(0, [], [], [], [])
    course.drive(steps)
    return course


def refusal(call: Callable[[], object]) -> str:
    """The status with which a call is refused; empty: it is taken."""
    try:
        call()
    except CoreError as error:
        return error.status
    return ""


def state_of(slam: Slam) -> tuple[int, tuple[float, float, float]]:
    """A fingerprint of all that the filter knows, and where odometry since then has the robot."""
    return slam.fingerprint(0), slam.pose()


# ---- damage ------------------------------------------------------------------------------------------------


def places_of(slam: Slam, *values: float) -> list[int]:
    """Where these numbers stand in the memory of an instance, one after the other."""
    wanted, memory = struct.pack(f"={len(values)}f", *values), slam.state_bytes
    found, at = [], memory.find(wanted)
    while at >= 0:
        found.append(at)
        at = memory.find(wanted, at + 1)
    return found


def put(slam: Slam, after: float, *before: float) -> None:
    """A number in the place of the first of those that stand there, past every check."""
    at = places_of(slam, *before)[0]
    slam.memory[at : at + 4] = struct.pack("=f", after)


def flip(slam: Slam, at: int, bit: int) -> None:
    """Flips a bit of a byte of an instance's memory."""
    slam.memory[at] ^= 1 << bit
