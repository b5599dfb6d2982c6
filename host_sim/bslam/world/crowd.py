"""Things that move about in the arena, people most of all. Lengths in metres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bslam.world.arena import Point

LOOKS = ("person", "box")
_DISTANCE_M = 0.1  # nobody walks nearer to the robot than this


@dataclass(frozen=True)
class Mover:
    """Goes to and fro on a path; round, and higher than the sensor or not."""

    path: tuple[Point, ...]
    speed_mps: float
    radius_m: float
    pause_s: float  # at both ends
    hides: bool
    looks: str  # before a camera: one of LOOKS


@dataclass(frozen=True)
class Screens:
    """Where those movers were that hide what is behind them."""

    xy_m: NDArray[np.float64]  # (poses, movers, 2)
    radius_m: NDArray[np.float64]  # (movers,)

    def hide(
        self, pose: NDArray[np.intp], eye: NDArray[np.float64], target: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Whether one of them stands between eye and target, (k, 2) each, at the pose of that number."""
        ray = target - eye
        length_squared = np.maximum(np.sum(ray**2, axis=1), np.finfo(float).tiny)
        hidden = np.zeros(len(pose), dtype=np.bool_)
        for mover, radius_m in enumerate(self.radius_m.tolist()):
            offset = self.xy_m[pose, mover] - eye
            share = np.clip(np.sum(offset * ray, axis=1) / length_squared, 0.0, 1.0)
            beside = offset - share[:, np.newaxis] * ray
            hidden |= np.hypot(beside[:, 0], beside[:, 1]) < radius_m
        return hidden


class Crowd:
    """Moves all movers step by step; whoever would come too near to the robot waits."""

    def __init__(
        self, movers: Sequence[Mover], step_s: float, robot_radius_m: float, random: np.random.Generator
    ) -> None:
        self._walks = [_Walk(mover, step_s, random.uniform()) for mover in movers]
        self._keep_m = robot_radius_m + _DISTANCE_M

    def discs(self) -> list[tuple[float, float, float]]:
        """x, y and radius of each."""
        return [(*walk.place, walk.mover.radius_m) for walk in self._walks]

    def step(self, robot: Point) -> None:
        """Everybody goes on by one step, unless the robot is in the way."""
        for walk in self._walks:
            ahead = walk.ahead()
            near_m = self._keep_m + walk.mover.radius_m
            if math.dist(ahead, robot) >= min(near_m, math.dist(walk.place, robot)):
                walk.go()


class _Walk:
    """One mover: its way there and back is a round of twice its path's length and both pauses."""

    def __init__(self, mover: Mover, step_s: float, phase: float) -> None:
        self.mover = mover
        ends = list(zip(mover.path, mover.path[1:], strict=False))
        self._ends_m = np.concatenate([[0.0], np.cumsum([math.dist(a, b) for a, b in ends])])
        self._length_m = float(self._ends_m[-1])
        self._pause_m = mover.pause_s * mover.speed_mps  # as if it were a way
        self._step_m = mover.speed_mps * step_s
        self._round_m = 2.0 * (self._length_m + self._pause_m)
        self._at_m = phase * self._round_m
        self.place = self._place(self._at_m)

    def ahead(self) -> Point:
        """Where it is one step later."""
        return self._place(self._at_m + self._step_m)

    def go(self) -> None:
        """Make that step."""
        self._at_m = math.fmod(self._at_m + self._step_m, self._round_m)
        self.place = self._place(self._at_m)

    def _place(self, at_m: float) -> Point:
        travelled_m = math.fmod(at_m, self._round_m)
        if travelled_m > self._length_m + self._pause_m:
            travelled_m = self._round_m - self._pause_m - travelled_m
        travelled_m = min(max(travelled_m, 0.0), self._length_m)
        x_m, y_m = (
            float(np.interp(travelled_m, self._ends_m, [point[axis] for point in self.mover.path]))
            for axis in (0, 1)
        )
        return x_m, y_m
