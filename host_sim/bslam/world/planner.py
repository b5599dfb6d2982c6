"""Ways around the walls: the shortest path that keeps a distance, by a visibility graph."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bslam.world.arena import Arena, Point

_DIRECTIONS = 8  # corners of the polygon around each wall end
_STEP_OFF_M = 0.02


class RoutePlanner:
    """Plans in one arena for one distance to the walls.

    A shortest path turns only where a wall ends or sticks out. Around every wall end stands an octagon whose
    sides keep the distance; those of its corners that no wall comes too near are the nodes of the graph.
    """

    def __init__(self, arena: Arena, clearance_m: float) -> None:
        self._arena = arena
        self._clearance_m = clearance_m
        self._nodes = self._corners()
        count = len(self._nodes)
        first, second = np.triu_indices(count, k=1)
        self._lengths_m = np.full((count, count), math.inf)
        lengths_m = self._free_lengths_m(self._nodes[first], self._nodes[second])
        self._lengths_m[first, second] = self._lengths_m[second, first] = lengths_m

    def step_off(self, point: Point, more_m: float) -> Point:
        """A point away from the walls, farther from them by `more_m` than a path must be.

        Where that is too far, between two walls for instance, the farthest that was found.
        """
        x_m, y_m = point
        enough_m = self._clearance_m + more_m
        best, best_m = point, 0.0
        for _ in range(math.ceil(2.0 * enough_m / _STEP_OFF_M)):
            distance_m, away_x, away_y = self._arena.nearest_wall(x_m, y_m)
            if distance_m > best_m:
                best, best_m = (x_m, y_m), distance_m
            if distance_m >= enough_m:
                break
            x_m, y_m = x_m + _STEP_OFF_M * away_x, y_m + _STEP_OFF_M * away_y
        return best

    def route(self, start: Point, goal: Point) -> list[Point]:
        """The points to drive to in turn, the goal last; empty if there is no way that keeps the distance."""
        ends = np.array([start, goal])
        targets = np.vstack([self._nodes, ends[:1]])
        following = self._search(self._lengths_to(ends[0], targets), self._lengths_to(ends[1], targets))
        if following is None:
            return []
        way: list[Point] = []
        node = int(following[-1])
        while node >= 0:
            way.append((float(targets[node, 0]), float(targets[node, 1])))
            node = int(following[node])
        return [*way, goal]

    def _corners(self) -> NDArray[np.float64]:
        """Corners of the octagons, (nodes, 2), that are far enough from all walls."""
        ends = sorted({end for wall in self._arena.walls for end in (wall.start, wall.end)})
        # 1 % more than touches, so that a path along a side is not refused for rounding.
        radius_m = 1.01 * self._clearance_m / math.cos(math.pi / _DIRECTIONS)
        angles_rad = np.arange(_DIRECTIONS) * (2.0 * math.pi / _DIRECTIONS)
        octagon = radius_m * np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=1)
        corners = (np.array(ends).reshape(-1, 1, 2) + octagon).reshape(-1, 2)
        return corners[self._arena.path_clearance(corners, corners) >= self._clearance_m]

    def _free_lengths_m(self, a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Lengths of the straight paths a -> b, (k, 2) each; infinite where a wall is too near."""
        lengths_m = np.hypot(*(b - a).T)
        lengths_m[self._arena.path_clearance(a, b) < self._clearance_m] = math.inf
        return lengths_m

    def _lengths_to(self, point: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._free_lengths_m(np.broadcast_to(point, others.shape), others)

    def _search(
        self, from_start_m: NDArray[np.float64], to_goal_m: NDArray[np.float64]
    ) -> NDArray[np.int64] | None:
        """Dijkstra's search from the goal over the nodes and, last, the start.

        Takes the lengths of the straight paths from the start and to the goal, (nodes + 1,). Returns for each
        of them the one to go to next, -1 for the goal itself; None if the start was not reached.
        """
        count = len(to_goal_m)
        lengths_m = np.full((count, count), math.inf)
        lengths_m[:-1, :-1] = self._lengths_m
        lengths_m[-1] = lengths_m[:, -1] = from_start_m
        following = np.full(count, -1)
        done = np.zeros(count, dtype=np.bool_)
        while not done[-1]:
            nearest = int(np.argmin(np.where(done, math.inf, to_goal_m)))
            if to_goal_m[nearest] == math.inf:
                return None
            done[nearest] = True
            through_m = to_goal_m[nearest] + lengths_m[nearest]
            better = through_m < to_goal_m
            to_goal_m[better] = through_m[better]
            following[better] = nearest
        return following
