"""Faults of the place: a beacon that is moved while the robot is there."""

from __future__ import annotations

import math

import numpy as np

from bslam.core.appearance import SIGNATURE_SIZE
from bslam.core.slam import Slam
from bslam.faults.promise import BEACONS, PARAMS, STEP_US, Course, Fault, Measured

_AMID = (0.5, 1.8)
"""Of the beacon that is moved: amid the course, so that it is seen from all sides."""
_MOVED_TO = (-3.0, -2.5)
_IN_VIEW_RAD = 2.5
_ROUND = 630  # steps of the course for a way round
_AT_M = 0.3


class _Shown(Course):
    """The course with beacons that are told apart by their looks, and may be moved."""

    def __init__(self, slam: Slam) -> None:
        super().__init__(slam)
        self.places = [*BEACONS, _AMID]
        self._random = np.random.default_rng(8)
        self._looks = self._random.uniform(0.0, 1.0, (len(self.places), SIGNATURE_SIZE))

    def go_round(self, rounds: float) -> None:
        """Drives and looks."""
        for _ in range(round(rounds * _ROUND)):
            self.step += 1
            self.slam.odometry("wheels", self.step * STEP_US, *self.travel())
            x, y, theta = self.pose(self.step)
            away = [(bx - x, by - y) for bx, by in self.places]
            bearing = [math.remainder(math.atan2(dy, dx) - theta, 2 * math.pi) for dx, dy in away]
            seen = [index for index, one in enumerate(bearing) if abs(one) < _IN_VIEW_RAD]
            noise = 0.03 * self._random.standard_normal((len(seen), SIGNATURE_SIZE))
            signature = np.clip(self._looks[seen] + noise, 0, 1).astype(np.float32)
            self.slam.sightings(
                self.step * STEP_US,
                [bearing[index] for index in seen],
                [math.hypot(*away[index]) for index in seen],
                [-1] * len(seen),
                [True] * len(seen),
                signature=signature,
            )

    def mapped_at(self, place: tuple[float, float]) -> int:
        """Confirmed beacons there."""
        return sum(
            one.confirmed and math.dist(place, (one.x_m, one.y_m)) <= _AT_M for one in self.slam.beacons()
        )


def _moved(protected: bool) -> Measured:
    off = {} if protected else {"missed_views": 0}
    course = _Shown(Slam(PARAMS | {"association": 3} | off))
    course.slam.sightings(0, [], [], [], [])
    course.go_round(2)
    before = course.mapped_at(_AMID)
    course.places[-1] = _MOVED_TO
    course.go_round(2)
    old, new = course.mapped_at(_AMID), course.mapped_at(_MOVED_TO)
    text = f"mapped where it was: {before}, then {old}; where it is {new}; error {course.error_m():.3f} m"
    return Measured(before == 1 and old == 0 and new == 1 and course.error_m() < 0.1, text)


def place_faults() -> list[Fault]:
    """The rows of what changes in the room."""
    return [
        Fault(
            "beacon moved",
            "retired where it was, mapped where it is",
            "what is missed from where it was seen",
            _moved,
        )
    ]
