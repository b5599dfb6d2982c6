"""Puts walls, floor, ceiling, lamps, beacons and clutter into an arena."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bslam.world.arena import Arena, Beacon, Point, Wall
from bslam.world.camera import looks, raw
from bslam.world.camera.kinds import ROUND, Kind
from bslam.world.camera.looks import Look
from bslam.world.camera.scene import (
    CLUTTER,
    BeaconLook,
    Body,
    Drift,
    Lighting,
    Obstacle,
    Scene,
    SceneBuilder,
)

_FLOOR_PIECE_M = 6.0  # a light map is coarse: floors and ceilings are laid in pieces
_FLOOR_PERIOD_M = 1.2
_LAMP_SPACING_M = 3.5
_WALL_PERIOD_M = 2.4
_SIDES_FROM_M = 0.015  # a body thinner than this has no sides worth drawing
_MARGIN_M = 0.08  # between things on a wall
_WINDOW_LIGHT = 3.0


@dataclass(frozen=True)
class Area:
    """A rectangle of floor."""

    low: Point
    high: Point


@dataclass(frozen=True)
class WallFace:
    """One side of a wall: its left end as seen from the front; unit vectors to the right and to the front."""

    left: Point
    right: Point
    normal: Point
    length_m: float

    def at(self, along_m: float, out_m: float = 0.0) -> Point:
        """The point so far from the left end and so far before the wall."""
        x_m = self.left[0] + along_m * self.right[0] + out_m * self.normal[0]
        y_m = self.left[1] + along_m * self.right[1] + out_m * self.normal[1]
        return x_m, y_m


def faces_of(wall: Wall) -> tuple[WallFace, WallFace]:
    """Both sides."""
    length_m = math.dist(wall.start, wall.end)
    x, y = (wall.end[0] - wall.start[0]) / length_m, (wall.end[1] - wall.start[1]) / length_m
    return (
        WallFace(wall.start, (x, y), (y, -x), length_m),
        WallFace(wall.end, (-x, -y), (-y, x), length_m),
    )


@dataclass(frozen=True)
class Footprint:
    """The floor that a thing takes, as a box along the axes."""

    low: Point
    high: Point

    def overlaps(self, other: Footprint) -> bool:
        return all(self.low[i] < other.high[i] and other.low[i] < self.high[i] for i in range(2))


class Furnisher:
    """Furnishes one arena; everything random comes from one generator."""

    def __init__(
        self, walls: tuple[Wall, ...], areas: tuple[Area, ...], style: str, random: np.random.Generator
    ) -> None:
        self.walls, self.areas, self.random = walls, areas, random
        self.style = style
        shell = Arena(walls, ())
        self._low, self._high = shell.low, shell.high
        self.height_m = random.uniform(2.4, 3.2)
        self._builder = SceneBuilder()
        self._beacons: list[BeaconLook] = []
        self._bodies: list[Body] = []
        self._obstacles: list[Obstacle] = []
        self._lamps: list[tuple[float, float, float, float, float]] = []
        self._taken: list[Footprint] = []
        self.faces = [face for wall in walls for face in faces_of(wall)]
        self._build_shell()
        self._hang_lamps()

    # --- Beacons and things ---------------------------------------------------------------------------------

    def is_free(self, face: WallFace, along_m: float, width_m: float, depth_m: float) -> bool:
        """Whether a thing fits the wall there and touches nothing else."""
        half_m = 0.5 * width_m + _MARGIN_M
        if along_m < half_m or along_m > face.length_m - half_m:
            return False
        footprint = _footprint(face, along_m, 2.0 * half_m, depth_m + _MARGIN_M)
        return not any(footprint.overlaps(other) for other in self._taken)

    def add_beacon(
        self, beacon_id: int, name: str, kind: Kind, face: WallFace, along_m: float, width_m: float
    ) -> None:
        """A beacon of a kind on a wall, its middle so far from the wall's left end."""
        depth_m, bottom_m = self.random.uniform(*kind.depth_m), self.random.uniform(*kind.bottom_m)
        x_m, y_m = face.at(along_m, depth_m)
        facing_rad = math.atan2(face.normal[1], face.normal[0])
        beacon = BeaconLook(beacon_id, name, x_m, y_m, kind.height_m, width_m, bottom_m, depth_m, facing_rad)
        look = looks.beacon_look(name, self.style, self.random)
        first = self._builder.surface_count
        turns = name in ROUND
        self._box(face, along_m, width_m, depth_m, bottom_m, kind.height_m, look, beacon_id, turns)
        self._beacons.append(beacon)
        self._bodies.append(self._builder.body(first))
        self._taken.append(_footprint(face, along_m, width_m, depth_m))
        if name == "window":
            lamp_x_m, lamp_y_m = face.at(along_m, 0.3)
            self._lamps.append((lamp_x_m, lamp_y_m, bottom_m + 0.7, _WINDOW_LIGHT * width_m, 1.0))

    def add_wall_things(self, count: int) -> None:
        """Small things on the walls that are no beacons."""
        for _ in range(count):
            look, width_m, height_m, bottom_m = looks.wall_thing_look(self.style, self.random)
            place = self.draw_place(width_m, 0.02)
            if place is None:
                continue
            face, along_m = place
            self._box(face, along_m, width_m, 0.02, bottom_m, height_m, look, CLUTTER, False)
            self._taken.append(_footprint(face, along_m, width_m, 0.02))

    def add_clutter(self, x_m: float, y_m: float, look: Look, width_m: float, height_m: float) -> None:
        """A thing that stands on the floor and always shows the same side."""
        self._builder.rectangle(
            np.array([x_m - 0.5 * width_m, y_m, height_m]),
            np.array([width_m, 0.0, 0.0]),
            np.array([0.0, 0.0, -height_m]),
            self._builder.texture(look.front),
            CLUTTER,
            flags=raw.CUT_OUT | raw.BILLBOARD,
        )
        self._obstacles.append(Obstacle(x_m, y_m, 0.5 * width_m))

    def draw_place(self, width_m: float, depth_m: float) -> tuple[WallFace, float] | None:
        """A free place on some wall's inner face, or None if none was found."""
        inner = [face for face in self.faces if self.is_inside(face.at(0.5 * face.length_m, 0.2))]
        lengths_m = np.array([face.length_m for face in inner])
        for _ in range(40):
            face = inner[int(self.random.choice(len(inner), p=lengths_m / lengths_m.sum()))]
            along_m = self.random.uniform(0.0, face.length_m)
            if self.is_free(face, along_m, width_m, depth_m):
                return face, along_m
        return None

    def is_inside(self, point: Point) -> bool:
        """Whether a point lies between the arena's outermost walls."""
        return all(self._low[i] < point[i] < self._high[i] for i in range(2))

    def is_free_floor(self, x_m: float, y_m: float, radius_m: float) -> bool:
        """Whether a round thing there would stand clear of all others."""
        footprint = Footprint((x_m - radius_m, y_m - radius_m), (x_m + radius_m, y_m + radius_m))
        return not any(footprint.overlaps(other) for other in self._taken) and all(
            math.hypot(one.x_m - x_m, one.y_m - y_m) > one.radius_m + radius_m for one in self._obstacles
        )

    def finish(self, seed: int) -> Scene:
        beacons = tuple(Beacon(one.beacon_id, (one.x_m, one.y_m)) for one in self._beacons)
        walls = np.array([[*wall.start, *wall.end] for wall in self.walls])
        ambient = self.random.uniform(0.1, 0.3), self.random.uniform(0.03, 0.2)
        return Scene(
            seed=seed,
            style=self.style,
            arena=Arena(self.walls, beacons),
            areas=tuple((*area.low, *area.high) for area in self.areas),
            height_m=self.height_m,
            beacons=tuple(self._beacons),
            bodies=tuple(self._bodies),
            obstacles=tuple(self._obstacles),
            lighting=self._draw_lighting(),
            tables=self._builder.tables(np.array(self._lamps), walls, ambient),
        )

    # --- The shell ------------------------------------------------------------------------------------------

    def _build_shell(self) -> None:
        height = np.array([0.0, 0.0, -self.height_m])
        wall = self._builder.texture(looks.wall_look(self.style, self.random))
        for face in self.faces:
            corner = np.array([*face.left, self.height_m])
            right = np.array([*face.right, 0.0]) * face.length_m
            self._builder.rectangle(corner, right, height, wall, tiles=(face.length_m / _WALL_PERIOD_M, 1.0))
        floor = self._builder.texture(looks.floor_look(self.style, self.random))
        ceiling = self._builder.texture(looks.ceiling_look(self.style, self.random))
        for low, high in _pieces(self._low, self._high, _FLOOR_PIECE_M):
            width_m, depth_m = high[0] - low[0], high[1] - low[1]
            right, back = np.array([width_m, 0.0, 0.0]), np.array([0.0, depth_m, 0.0])
            tiles = (width_m / _FLOOR_PERIOD_M, depth_m / _FLOOR_PERIOD_M)
            self._builder.rectangle(np.array([low[0], high[1], 0.0]), right, -back, floor, tiles=tiles)
            self._builder.rectangle(np.array([*low, self.height_m]), right, back, ceiling, tiles=tiles)

    def _hang_lamps(self) -> None:
        for low, high in _pieces(self._low, self._high, _LAMP_SPACING_M):
            x_m, y_m = (0.5 * (low[i] + high[i]) for i in range(2))
            self._lamps.append((x_m, y_m, self.height_m - 0.1, self.random.uniform(1.5, 4.0), 0.0))

    def _draw_lighting(self) -> Lighting:
        drifts = [
            Drift(
                self.random.uniform(0.0, most),
                self.random.uniform(10.0, 60.0),
                self.random.uniform(0.0, 6.28),
            )
            for most in (0.15, 0.5)
        ]
        lamp = (1.0, self.random.uniform(0.85, 1.0), self.random.uniform(0.65, 1.0))
        sky = (self.random.uniform(0.8, 1.0), 0.95, 1.0)
        return Lighting(lamp, sky, *drifts)

    def _box(
        self,
        face: WallFace,
        along_m: float,
        width_m: float,
        depth_m: float,
        bottom_m: float,
        height_m: float,
        look: Look,
        identity: int,
        turns: bool,
    ) -> None:
        """A thing on a wall: its front, and its sides if it stands out enough."""
        left_m = along_m - 0.5 * width_m
        right = np.array([*face.right, 0.0]) * width_m
        out = np.array([*face.normal, 0.0]) * depth_m
        down = np.array([0.0, 0.0, -height_m])
        at_wall = np.array([*face.at(left_m), bottom_m + height_m])
        flags = (raw.CUT_OUT if look.cut_out else 0) | (raw.BILLBOARD if turns else 0)
        front = self._builder.texture(look.front)
        self._builder.rectangle(at_wall + out, right, down, front, identity, glow=look.glow, flags=flags)
        if depth_m < _SIDES_FROM_M or look.cut_out:
            return
        side = self._builder.texture(look.side)
        self._builder.rectangle(at_wall, out, down, side, identity)
        self._builder.rectangle(at_wall + right + out, -out, down, side, identity)
        self._builder.rectangle(at_wall, right, out, side, identity)
        self._builder.rectangle(at_wall + out + down, right, -out, side, identity)


def _footprint(face: WallFace, along_m: float, width_m: float, depth_m: float) -> Footprint:
    corners = [face.at(along_m + side * 0.5 * width_m, out_m) for side in (-1, 1) for out_m in (0.0, depth_m)]
    xs, ys = zip(*corners, strict=True)
    return Footprint((min(xs), min(ys)), (max(xs), max(ys)))


def _pieces(low: Point, high: Point, side_m: float) -> list[tuple[Point, Point]]:
    """A rectangle in equal pieces of about side_m."""
    cuts = [
        np.linspace(low[i], high[i], max(2, round((high[i] - low[i]) / side_m) + 1)).tolist()
        for i in range(2)
    ]
    return [
        ((x0, y0), (x1, y1))
        for x0, x1 in zip(cuts[0], cuts[0][1:], strict=False)
        for y0, y1 in zip(cuts[1], cuts[1][1:], strict=False)
    ]
