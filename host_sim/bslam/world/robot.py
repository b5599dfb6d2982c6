"""The robot's body: how wheel travel moves it, and how a wall stops it. Metres and radians."""

from __future__ import annotations

import math

from bslam.motion import Pose, move_on_arc
from bslam.world.arena import Arena

# The body is held against the walls every so often: by far less than its radius, so that no wall is jumped.
_PIECE_M = 0.02


class Feeler:
    """Asks how near the walls are, without measuring all of them in every step.

    The distance to the nearest wall changes by no more than the way gone, so one measurement is good until
    that way has eaten it up.
    """

    def __init__(self, arena: Arena) -> None:
        self._arena = arena
        self._measured = (math.inf, 0.0, 0.0)
        self._x_m = self._y_m = math.nan

    def nearest_within(self, x_m: float, y_m: float, reach_m: float) -> tuple[float, float, float] | None:
        """Like `Arena.nearest_wall`, or None if every wall is at least `reach_m` away."""
        at_least_m = self._measured[0] - math.hypot(x_m - self._x_m, y_m - self._y_m)
        if at_least_m >= reach_m:
            return None
        self._measured = self._arena.nearest_wall(x_m, y_m)
        self._x_m, self._y_m = x_m, y_m
        return self._measured if self._measured[0] < reach_m else None


class Body:
    """A round body on two wheels in an arena: it goes where the wheels roll, unless a wall is there."""

    def __init__(self, arena: Arena, pose: Pose, radius_m: float, wheelbase_m: float) -> None:
        self.pose = pose
        self.feeler = Feeler(arena)
        self.others: list[tuple[float, float, float]] = []  # x, y, radius of what moves about
        self._radius_m = radius_m
        self._wheelbase_m = wheelbase_m

    def roll(self, left_m: float, right_m: float) -> bool:
        """Roll the wheels. False: something is in the way, both wheels stall and nothing has moved."""
        pieces = max(1, math.ceil(abs(left_m + right_m) / 2.0 / _PIECE_M))
        pose = self.pose
        for piece in range(1, pieces + 1):
            share = piece / pieces
            pose = move_on_arc(self.pose, left_m * share, right_m * share, self._wheelbase_m)
            if self.feeler.nearest_within(pose[0], pose[1], self._radius_m) is not None:
                return False
            if any(self._touches(pose, other) for other in self.others):
                return False
        self.pose = pose
        return True

    def _touches(self, pose: Pose, other: tuple[float, float, float]) -> bool:
        """A robot that stands too near already may still go away."""
        x_m, y_m, radius_m = other
        distance_m = math.hypot(pose[0] - x_m, pose[1] - y_m)
        before_m = math.hypot(self.pose[0] - x_m, self.pose[1] - y_m)
        return distance_m < self._radius_m + radius_m and distance_m < before_m
