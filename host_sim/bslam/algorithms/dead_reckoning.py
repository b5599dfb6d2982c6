"""Odometry alone: what every other method has to better."""

from __future__ import annotations

from collections.abc import Sequence

from bslam.algorithms.protocol import Landmark, Setup, Sighting
from bslam.motion import Pose, move_on_arc


class DeadReckoning:
    """Adds up the wheels' travel by exact arcs and maps nothing."""

    def __init__(self, setup: Setup) -> None:
        self._wheelbase_m = setup.robot.wheelbase_m
        self._pose: Pose = (0.0, 0.0, 0.0)

    def reset(self, seed: int) -> None:
        """See `Algorithm`."""
        self._pose = (0.0, 0.0, 0.0)

    def odometry(self, time_us: int, left_m: float, right_m: float) -> None:
        """See `Algorithm`."""
        self._pose = move_on_arc(self._pose, left_m, right_m, self._wheelbase_m)

    def observe(self, time_us: int, sightings: Sequence[Sighting]) -> None:
        """What is seen changes nothing."""

    def pose(self) -> Pose:
        """See `Algorithm`."""
        return self._pose

    def map(self) -> Sequence[Landmark]:
        """None."""
        return ()
