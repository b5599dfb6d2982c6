"""Walls and beacons, and the geometry that driving and sensing ask about. Lengths in metres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]

# A beacon hangs on a wall: the last millimetre of a sight line does not count as hidden by that wall.
_BEACON_DEPTH_M = 0.001


@dataclass(frozen=True)
class Wall:
    """A straight wall without thickness."""

    start: Point
    end: Point


@dataclass(frozen=True)
class Beacon:
    """A point that the sensor can see and tell from others, unless it looks like another on purpose."""

    beacon_id: int
    at: Point
    looks_like: int | None = None  # the beacon whose looks it has; None: its own
    kind: str | None = None  # before a camera, these three; None: whatever fits
    width_m: float | None = None
    texture: int | None = None  # beacons of one kind and texture look alike


@dataclass(frozen=True)
class Box:
    """A thing that stands about: a rectangle on the floor, turned about its middle."""

    at: Point
    size_m: Point
    turn_rad: float = 0.0
    hides: bool = True  # higher than the sensor: what is behind cannot be seen

    @property
    def sides(self) -> tuple[Wall, ...]:
        """Its four sides."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        half_x, half_y = 0.5 * self.size_m[0], 0.5 * self.size_m[1]
        corners = [
            (self.at[0] + c * x - s * y, self.at[1] + s * x + c * y)
            for x, y in ((-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y))
        ]
        return tuple(Wall(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))


@dataclass(frozen=True)
class Arena:
    walls: tuple[Wall, ...]
    beacons: tuple[Beacon, ...]
    boxes: tuple[Box, ...] = ()

    @cached_property
    def obstacles(self) -> tuple[Wall, ...]:
        """All that stops a robot: walls and the sides of boxes."""
        return (*self.walls, *(side for box in self.boxes for side in box.sides))

    @cached_property
    def screens(self) -> tuple[Wall, ...]:
        """All that hides what is behind: walls and the sides of high boxes."""
        return (*self.walls, *(side for box in self.boxes if box.hides for side in box.sides))

    @property
    def low(self) -> Point:
        """The corner of the bounding box with the smallest coordinates."""
        ends = [end for wall in self.walls for end in (wall.start, wall.end)]
        return min(x for x, _ in ends), min(y for _, y in ends)

    @property
    def high(self) -> Point:
        """The corner of the bounding box with the largest coordinates."""
        ends = [end for wall in self.walls for end in (wall.start, wall.end)]
        return max(x for x, _ in ends), max(y for _, y in ends)

    @property
    def beacon_xy_m(self) -> NDArray[np.float64]:
        """Positions, (beacons, 2)."""
        return np.array([beacon.at for beacon in self.beacons], dtype=np.float64).reshape(-1, 2)

    @cached_property
    def _spans(self) -> list[tuple[float, float, float, float, float]]:
        """Start, vector to the end, and 1 / length^2 of each obstacle: what the distance to it needs."""
        spans = []
        for (x0, y0), (x1, y1) in ((wall.start, wall.end) for wall in self.obstacles):
            dx, dy = x1 - x0, y1 - y0
            spans.append((x0, y0, dx, dy, 1.0 / (dx * dx + dy * dy)))
        return spans

    def nearest_wall(self, x_m: float, y_m: float) -> tuple[float, float, float]:
        """Distance to the nearest wall, and the unit vector from there to the point; inf without walls.

        Plain floats: the driving loop asks for one point at a time, where numpy is slower.
        """
        least, away_x, away_y = math.inf, 0.0, 0.0
        for x0, y0, dx, dy, inverse in self._spans:
            px, py = x_m - x0, y_m - y0
            along = (px * dx + py * dy) * inverse
            if along >= 1.0:
                px, py = px - dx, py - dy
            elif along > 0.0:
                px, py = px - along * dx, py - along * dy
            squared = px * px + py * py
            if squared < least:
                least, away_x, away_y = squared, px, py
        distance = math.sqrt(least)
        if 0.0 < distance < math.inf:
            return distance, away_x / distance, away_y / distance
        return distance, 0.0, 0.0

    def path_clearance(self, a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Least distance of straight paths a -> b, (k, 2) each, to any wall: (k,), 0 where one is crossed."""
        clearance = np.full(len(a), math.inf)
        for wall in self.obstacles:
            p, q = np.array(wall.start), np.array(wall.end)
            for distance in (
                _distance_to_segment(a, p, q),
                _distance_to_segment(b, p, q),
                _distance_to_segment(p, a, b),
                _distance_to_segment(q, a, b),
            ):
                np.minimum(clearance, distance, out=clearance)
            clearance[_cross(a, b, p, q)] = 0.0
        return clearance

    def in_sight(self, eye: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether no wall hides target from eye, (k, 2) each: (k,). A wall seen end-on hides nothing."""
        ray = target - eye
        length = np.hypot(ray[:, 0], ray[:, 1])
        free = length > _BEACON_DEPTH_M
        for wall in self.screens:
            look = np.flatnonzero(free)
            depth_share = 1.0 - _BEACON_DEPTH_M / length[look]
            free[look] = ~_hides(wall, eye[look], ray[look], depth_share)
        return free


def _hides(
    wall: Wall, eye: NDArray[np.float64], ray: NDArray[np.float64], depth_share: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the wall crosses the first `depth_share` of each ray.

    With eye + t ray = start + u along: t det = (start - eye) x along, u det = (start - eye) x ray,
    det = ray x along. Multiplied out, so that a ray parallel to the wall (det = 0) divides nothing.
    """
    along = np.subtract(wall.end, wall.start)
    offset = np.array(wall.start) - eye
    det = _cross_product(ray, along)
    sign = np.sign(det)
    t_det = _cross_product(offset, along) * sign
    u_det = _cross_product(offset, ray) * sign
    det = np.abs(det)
    return (t_det > 0.0) & (t_det < det * depth_share) & (u_det >= 0.0) & (u_det <= det)


def _cross_product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _cross(
    a: NDArray[np.float64], b: NDArray[np.float64], p: NDArray[np.float64], q: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the segments ab and pq cross in a point that is an end of neither."""
    apart = _cross_product(q - p, a - p) * _cross_product(q - p, b - p) < 0.0
    return apart & (_cross_product(b - a, p - a) * _cross_product(b - a, q - a) < 0.0)


def _distance_to_segment(
    point: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance of points to segments ab; either may be one for all the others."""
    span, offset = b - a, point - a
    length_squared = np.maximum((span * span).sum(axis=-1), np.finfo(float).tiny)  # a segment may be a point
    along = np.clip((offset * span).sum(axis=-1) / length_squared, 0.0, 1.0)
    rest = offset - along[..., np.newaxis] * span
    return np.hypot(rest[..., 0], rest[..., 1])
