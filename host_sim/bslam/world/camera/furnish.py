"""Puts walls, floor, ceiling, lamps, beacons and clutter into an arena."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bslam.world.arena import Arena, Beacon, Point, Wall
from bslam.world.camera import looks, raw
from bslam.world.camera.looks import Artist, Look, Piece
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
from bslam.world.kinds import ROUND, Kind

_FLOOR_PIECE_M = 6.0  # a light map is coarse: floors and ceilings are laid in pieces
_LAMP_SPACING_M = 3.5
_LAMP_SIDES_M = ((0.6, 0.6), (1.2, 0.3), (0.3, 1.2))
_LAMP_GLOW = 1.5
_SIDES_FROM_M = 0.015  # a body thinner than this has no sides worth drawing
_MARGIN_M = 0.08  # between things on a wall
_OBSTACLE_FROM_M = 0.2  # what stands out farther than this is in the way of a robot along the wall
_TOUCH_M = 0.001  # a wall that comes no nearer to another's front only touches it
_WINDOW_LIGHT = 2.0  # for each metre of its width
_WALL_LOOKS = 3  # at most so many in an arena
_LAMP_DRIFT, _SKY_DRIFT = 0.15, 0.5
_DRIFT_PERIOD_S = (8.0, 60.0)
_HEIGHT_M = (2.4, 3.2)
_TRIES = 40


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

    def along_and_out(self, point: Point) -> tuple[float, float]:
        """The inverse of `at`."""
        x_m, y_m = point[0] - self.left[0], point[1] - self.left[1]
        return (
            x_m * self.right[0] + y_m * self.right[1],
            x_m * self.normal[0] + y_m * self.normal[1],
        )


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


@dataclass(frozen=True)
class Mount:
    """Where on a wall a thing hangs: its middle along the wall, and its sizes."""

    face: WallFace
    along_m: float
    width_m: float
    depth_m: float
    bottom_m: float
    height_m: float


class Furnisher:
    """Furnishes one arena; everything random comes from the artist."""

    def __init__(self, walls: tuple[Wall, ...], areas: tuple[Area, ...], artist: Artist) -> None:
        self.walls, self.areas, self._artist = walls, areas, artist
        shell = Arena(walls, ())
        self._low, self._high = shell.low, shell.high
        self._height_m = artist.between(*_HEIGHT_M)
        self._builder = SceneBuilder()
        self._beacons: list[BeaconLook] = []
        self._bodies: list[Body] = []
        self._obstacles: list[Obstacle] = []
        self._movers: list[int] = []
        self._lamps: list[tuple[float, float, float, float, float]] = []
        self._taken: list[Footprint] = []
        self.faces = [face for wall in walls for face in faces_of(wall)]
        self._cover_walls()
        self._lay_floor()
        self._hang_lamps()

    # --- Beacons and things ---------------------------------------------------------------------------------

    def is_free(self, face: WallFace, along_m: float, width_m: float, depth_m: float) -> bool:
        """Whether a thing fits the wall there and touches nothing else."""
        half_m = 0.5 * width_m + _MARGIN_M
        if along_m < half_m or along_m > face.length_m - half_m:
            return False
        if any(_stands_in(wall, face, along_m, half_m, depth_m) for wall in self.walls):
            return False
        footprint = _footprint(face, along_m, 2.0 * half_m, depth_m + _MARGIN_M)
        return not any(footprint.overlaps(other) for other in self._taken)

    def add_beacon(
        self,
        beacon_id: int,
        name: str,
        kind: Kind,
        face: WallFace,
        along_m: float,
        width_m: float,
        look: looks.Look | None = None,
    ) -> looks.Look:
        """A beacon of a kind on a wall, its middle so far from the wall's left end; how it looks.

        look: another's; None: a new one is painted.
        """
        depth_m, bottom_m = self._artist.between(*kind.depth_m), self._artist.between(*kind.bottom_m)
        place = Mount(face, along_m, width_m, depth_m, bottom_m, kind.height_m)
        x_m, y_m = face.at(along_m, depth_m)
        facing_rad = math.atan2(face.normal[1], face.normal[0])
        first = self._builder.surface_count
        look = look or looks.BEACONS[name](self._artist)
        self._hang(place, look, beacon_id, name in ROUND)
        self._beacons.append(
            BeaconLook(beacon_id, name, x_m, y_m, kind.height_m, width_m, bottom_m, depth_m, facing_rad)
        )
        self._bodies.append(self._builder.body(first, name in ROUND))
        self._stand(place)
        if name == "window":
            lamp_x_m, lamp_y_m = face.at(along_m, 0.3)
            middle_m = bottom_m + 0.5 * kind.height_m
            self._lamps.append((lamp_x_m, lamp_y_m, middle_m, _WINDOW_LIGHT * width_m, 1.0))
        return look

    def add_wall_things(self, count: int) -> None:
        """Small things on the walls that are no beacons; those that find no place stay away."""
        for _ in range(count):
            piece = looks.wall_thing(self._artist)
            place = self.draw_place(piece.width_m, piece.out_m)
            if place is not None:
                face, along_m = place
                mount = Mount(face, along_m, piece.width_m, piece.out_m, piece.bottom_m, piece.height_m)
                self._hang(mount, piece.look, CLUTTER, False)
                self._stand(mount)

    def add_clutter(self, piece: Piece, x_m: float, y_m: float) -> None:
        """A thing that stands on the floor and always shows the same side."""
        self._stand_up(piece, x_m, y_m)
        self._obstacles.append(Obstacle(x_m, y_m, 0.5 * piece.width_m))

    def add_mover(self, piece: Piece, x_m: float, y_m: float) -> None:
        """The same, but it moves about from there (`Renderer.render`): nothing keeps clear of the place."""
        self._movers.append(self._builder.surface_count)
        self._stand_up(piece, x_m, y_m)

    def _stand_up(self, piece: Piece, x_m: float, y_m: float) -> None:
        self._builder.rectangle(
            np.array([x_m - 0.5 * piece.width_m, y_m, piece.height_m]),
            np.array([piece.width_m, 0.0, 0.0]),
            np.array([0.0, 0.0, -piece.height_m]),
            self._builder.texture(piece.look.front),
            CLUTTER,
            flags=raw.CUT_OUT | raw.BILLBOARD,
        )

    def draw_place(self, width_m: float, depth_m: float) -> tuple[WallFace, float] | None:
        """A free place on some wall's inner face, or None if none was found."""
        inner = [face for face in self.faces if self.is_inside(face.at(0.5 * face.length_m, 0.2))]
        ends_m = np.cumsum([face.length_m for face in inner])
        for _ in range(_TRIES):
            at_m = self._artist.between(0.0, ends_m[-1])
            face = inner[int(np.searchsorted(ends_m, at_m))]
            along_m = self._artist.between(0.0, face.length_m)
            if self.is_free(face, along_m, width_m, depth_m):
                return face, along_m
        return None

    def is_inside(self, point: Point) -> bool:
        """Whether a point lies between the arena's outermost walls."""
        return all(self._low[i] < point[i] < self._high[i] for i in range(2))

    def draw_foot(self, width_m: float, out_m: float) -> Point | None:
        """A place so far before a wall, with no beacon or thing behind it; None if none was found."""
        place = self.draw_place(width_m, out_m)
        return None if place is None else place[0].at(place[1], out_m)

    def is_free_floor(self, x_m: float, y_m: float, radius_m: float) -> bool:
        """Whether a round thing there would stand clear of all others."""
        footprint = Footprint((x_m - radius_m, y_m - radius_m), (x_m + radius_m, y_m + radius_m))
        return not any(footprint.overlaps(other) for other in self._taken) and all(
            math.hypot(one.x_m - x_m, one.y_m - y_m) > one.radius_m + radius_m for one in self._obstacles
        )

    def finish(self, seed: int) -> Scene:
        artist = self._artist
        walls = np.array([[*wall.start, *wall.end] for wall in self.walls])
        ambient = artist.between(*artist.style.ambient), 0.5 * artist.between(*artist.style.ambient)
        return Scene(
            seed=seed,
            style=artist.style.name,
            arena=Arena(
                self.walls, tuple(Beacon(one.beacon_id, (one.x_m, one.y_m)) for one in self._beacons)
            ),
            areas=tuple((*area.low, *area.high) for area in self.areas),
            height_m=self._height_m,
            beacons=tuple(self._beacons),
            bodies=tuple(self._bodies),
            obstacles=tuple(self._obstacles),
            movers=tuple(self._movers),
            lighting=_draw_lighting(artist),
            tables=self._builder.tables(raw.Light(np.array(self._lamps), walls, ambient)),
        )

    # --- The shell ------------------------------------------------------------------------------------------

    def _cover_walls(self) -> None:
        """Most walls alike, a few otherwise; all with the same skirting."""
        artist = self._artist
        style = looks.wall_style(artist)
        coverings = [looks.wall(artist, style, self._height_m) for _ in range(artist.count(1, _WALL_LOOKS))]
        textures = [self._builder.texture(one.picture) for one in coverings]
        down = np.array([0.0, 0.0, -self._height_m])
        for face in self.faces:
            index = 0 if artist.chance(0.6) else artist.count(0, len(coverings) - 1)
            corner = np.array([*face.left, self._height_m])
            right = np.array([*face.right, 0.0]) * face.length_m
            tiles = (face.length_m / coverings[index].period_m, 1.0)
            self._builder.rectangle(corner, right, down, textures[index], tiles=tiles)

    def _lay_floor(self) -> None:
        floor, ceiling = looks.floor(self._artist), looks.ceiling(self._artist)
        floor_texture, ceiling_texture = (self._builder.texture(one.picture) for one in (floor, ceiling))
        for low, high in _pieces(self._low, self._high, _FLOOR_PIECE_M):
            width_m, depth_m = high[0] - low[0], high[1] - low[1]
            right, back = np.array([width_m, 0.0, 0.0]), np.array([0.0, depth_m, 0.0])
            tiles = (width_m / floor.period_m, depth_m / floor.period_m)
            self._builder.rectangle(
                np.array([low[0], high[1], 0.0]), right, -back, floor_texture, tiles=tiles
            )
            tiles = (width_m / ceiling.period_m, depth_m / ceiling.period_m)
            corner = np.array([*low, self._height_m])
            self._builder.rectangle(corner, right, back, ceiling_texture, tiles=tiles)

    def _hang_lamps(self) -> None:
        """A grid of luminous panels under the ceiling, each with a strength of its own, some of them off."""
        artist = self._artist
        texture = self._builder.texture(looks.lamp(artist))
        side_m, strength = artist.pick(_LAMP_SIDES_M), artist.between(*artist.style.lamp_strength)
        for low, high in _pieces(self._low, self._high, _LAMP_SPACING_M):
            x_m, y_m = (0.5 * (low[i] + high[i]) for i in range(2))
            share = 0.0 if artist.chance(0.1) else artist.between(0.6, 1.2)
            self._lamps.append((x_m, y_m, self._height_m - 0.1, share * strength, 0.0))
            corner = np.array([x_m - 0.5 * side_m[0], y_m - 0.5 * side_m[1], self._height_m - 0.03])
            right, back = np.array([side_m[0], 0.0, 0.0]), np.array([0.0, side_m[1], 0.0])
            self._builder.rectangle(corner, right, back, texture, glow=(_LAMP_GLOW * share, 0.0))

    def _stand(self, mount: Mount) -> None:
        """What stands out far is in the way."""
        if mount.depth_m > _OBSTACLE_FROM_M:
            at = mount.face.at(mount.along_m, 0.5 * mount.depth_m)
            self._obstacles.append(Obstacle(*at, 0.5 * mount.width_m))

    def _hang(self, mount: Mount, look: Look, identity: int, turns: bool) -> None:
        """A thing on a wall: its front, and its sides if it stands out enough."""
        face = mount.face
        right = np.array([*face.right, 0.0]) * mount.width_m
        out = np.array([*face.normal, 0.0]) * mount.depth_m
        down = np.array([0.0, 0.0, -mount.height_m])
        at_wall = np.array([*face.at(mount.along_m - 0.5 * mount.width_m), mount.bottom_m + mount.height_m])
        flags = (raw.CUT_OUT if look.cut_out else 0) | (raw.BILLBOARD if turns else 0)
        front = self._builder.texture(look.front)
        self._builder.rectangle(at_wall + out, right, down, front, identity, glow=look.glow, flags=flags)
        self._taken.append(_footprint(face, mount.along_m, mount.width_m, mount.depth_m))
        if mount.depth_m < _SIDES_FROM_M or look.cut_out:
            return
        side = self._builder.texture(look.side_picture)
        self._builder.rectangle(at_wall, out, down, side, identity)
        self._builder.rectangle(at_wall + right + out, -out, down, side, identity)
        self._builder.rectangle(at_wall, right, out, side, identity)
        self._builder.rectangle(at_wall + out + down, right, -out, side, identity)


def _draw_lighting(artist: Artist) -> Lighting:
    blue = artist.between(*artist.style.lamp_warmth)
    lamp_drift, sky_drift = (
        Drift(artist.between(0.0, most), artist.between(*_DRIFT_PERIOD_S), artist.between(0.0, math.tau))
        for most in (_LAMP_DRIFT, _SKY_DRIFT)
    )
    sky_rgb = (artist.between(0.8, 1.0), 0.95, artist.between(1.0, 1.15))
    return Lighting((1.0, 0.5 + 0.5 * blue, blue), sky_rgb, lamp_drift, sky_drift)


def _stands_in(wall: Wall, face: WallFace, along_m: float, half_m: float, depth_m: float) -> bool:
    """Whether a wall runs through the floor before a stretch of another wall's face."""
    start, end = face.along_and_out(wall.start), face.along_and_out(wall.end)
    enter, leave = 0.0, 1.0
    for from_m, to_m, low_m, high_m in (
        (start[0], end[0], along_m - half_m, along_m + half_m),
        (start[1], end[1], _TOUCH_M, max(depth_m, 2.0 * _TOUCH_M)),
    ):
        if from_m == to_m:
            if not low_m < from_m < high_m:
                return False
            continue
        ends = sorted(((low_m - from_m) / (to_m - from_m), (high_m - from_m) / (to_m - from_m)))
        enter, leave = max(enter, ends[0]), min(leave, ends[1])
    return enter < leave


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
