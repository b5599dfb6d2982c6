"""Whole scenes: random furnished rooms to train and test detectors in, and the arenas of scenarios."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bslam.errors import BslamError
from bslam.world.arena import Beacon, Box, Point, Wall
from bslam.world.camera.furnish import Area, Furnisher, WallFace
from bslam.world.camera.looks import BEACONS, Artist, Look, clutter, person, style_of, trolley
from bslam.world.camera.scene import IDENTITY_MAX, Scene
from bslam.world.crowd import Mover
from bslam.world.kinds import KINDS, Kind, KindDeck
from bslam.world.scenario import Scenario

_SIDE_M = (5.0, 12.0)
_ROOM_SIDE_MIN_M = 3.5
_GAP_M = (1.2, 2.2)
_TRIES = 60
_BEFORE_WALL_M, _BEFORE_WALL_SHARE = 0.9, 0.9

_ON_WALL_M = 0.05  # a scenario's beacon this near to a wall hangs on it
_GAP_SHARE = 0.9  # of the way to the neighbour that two beacons may take together
_AT_WALL_M = 0.15  # clutter of a dressed scenario stands so near to a wall, out of the robot's way
_HIGH_BOX_M, _LOW_BOX_M = 1.3, 0.3  # a box that hides what is behind, and one that does not
_TEXTURES = 2  # the stream that a scenario's own textures come from
_MOVERS = 3  # and the one for what moves about: with and without it, all else looks the same
_DRESSED_DEPTH_M = 0.25  # a scenario's robot comes as near to the walls as 0.3 m


def make_world(seed: int, style: str = "train") -> Scene:
    """A random furnished arena of one to three rooms. The styles differ in settings and in all textures.

    BslamError names a bad seed (allowed: 0 and up) or style.
    """
    artist = _artist(seed, style, 0)
    low, high = (0.0, 0.0), (artist.between(*_SIDE_M), artist.between(*_SIDE_M))
    furnisher = Furnisher(*_rooms(low, high, artist.count(0, 2), artist), artist)
    beacon_id = 0
    for name in _balanced_names(artist.count(*artist.style.beacon_count), artist):
        kind = KINDS[name]
        width_m = artist.between(*kind.width_m)
        place = furnisher.draw_place(width_m, kind.depth_m[1])
        if place is not None:
            furnisher.add_beacon(beacon_id, name, kind, *place, width_m)
            beacon_id += 1
    furnisher.add_wall_things(artist.count(*artist.style.thing_count))
    _stand_clutter(furnisher, artist, artist.count(*artist.style.clutter_count))
    return furnisher.finish(seed)


def dress(scenario: Scenario, seed: int, style: str = "test") -> Scene:
    """A scenario's arena, furnished: each beacon gets a kind that fits its place, and a look, or those
    of the beacon that it looks like.

    A beacon's foot is where the scenario has it; what stands out from the wall is seen its depth farther in
    (`Scene.beacons`, `Scene.arena`). Clutter stands at the walls, where no robot drives; a scenario's box is
    a piece of clutter as wide as its longer side; people and what else moves stand where their paths begin,
    until they are rendered elsewhere. BslamError: a beacon that hangs on no wall, or has too
    little of it for its kind; an id beyond 32767; a bad seed or style.
    """
    artist = _artist(seed, style, 1)
    arena = scenario.arena
    areas = tuple(Area((one.x_m[0], one.y_m[0]), (one.x_m[1], one.y_m[1])) for one in scenario.areas) or (
        Area(arena.low, arena.high),
    )
    furnisher = Furnisher(arena.walls, areas, artist)
    hung = [_hang_beacon(furnisher, scenario, beacon) for beacon in arena.beacons]
    deck, made = KindDeck(artist.random), dict[int, tuple[str, Kind, float, Look]]()
    for beacon, (face, along_m, _) in zip(arena.beacons, hung, strict=True):
        whose = _own_looks(beacon)
        if whose in made:
            name, kind, width_m, look = made[whose]
            furnisher.add_beacon(beacon.beacon_id, name, kind, face, along_m, width_m, look)
            continue
        alike = zip(arena.beacons, hung, strict=True)
        free_m = min(place[2] for other, place in alike if _own_looks(other) == whose)
        drawn = _kind_for(scenario, beacon, free_m, deck)
        kind = KINDS[drawn].shallow(_DRESSED_DEPTH_M)
        width_m = beacon.width_m or artist.between(kind.width_m[0], min(kind.width_m[1], free_m))
        painted = None if beacon.texture is None else _textured(drawn, beacon.texture, artist)
        look = furnisher.add_beacon(beacon.beacon_id, drawn, kind, face, along_m, width_m, painted)
        made[whose] = drawn, kind, width_m, look
    furnisher.add_wall_things(artist.count(*artist.style.thing_count) * len(areas))
    for _ in range(artist.count(*artist.style.clutter_count) * len(areas)):
        piece = clutter(artist)
        foot = furnisher.draw_foot(piece.width_m, _AT_WALL_M)
        if foot is not None:
            furnisher.add_clutter(piece, *foot)
    _stand_boxes(furnisher, artist, arena.boxes)
    _add_movers(furnisher, _artist(seed, style, _MOVERS), scenario.movers)
    return furnisher.finish(seed)


def _kind_for(scenario: Scenario, beacon: Beacon, free_m: float, deck: KindDeck) -> str:
    """The kind that the scenario has for a beacon, or one that fits. Raises BslamError if it does not fit."""
    drawn = beacon.kind or deck.draw(free_m)
    narrowest_m = min(kind.width_m[0] for kind in KINDS.values())
    needed_m = beacon.width_m or (narrowest_m if drawn is None else KINDS[drawn].width_m[0])
    if drawn is None or needed_m > free_m:
        where = f"scenario {scenario.name}, beacon {beacon.beacon_id} at {beacon.at}"
        raise BslamError(
            f"{where}: {free_m:.2f} m of free wall; allowed: enough for a beacon, {needed_m:g} m"
        )
    return drawn


def _textured(name: str, texture: int, artist: Artist) -> Look:
    """The look of that number: the same in every scene of a style."""
    painter = np.random.default_rng([artist.style.stream, _TEXTURES, texture])
    return BEACONS[name](Artist(artist.style, painter))


def _stand_boxes(furnisher: Furnisher, artist: Artist, boxes: Sequence[Box]) -> None:
    for box in boxes:
        piece = replace(clutter(artist), width_m=max(box.size_m), height_m=_box_height(box.hides))
        furnisher.add_clutter(piece, *box.at)


def _box_height(hides: bool) -> float:
    return _HIGH_BOX_M if hides else _LOW_BOX_M


def _add_movers(furnisher: Furnisher, artist: Artist, movers: Sequence[Mover]) -> None:
    """Where their paths begin, each as wide as it is round."""
    for mover in movers:
        width_m = 2.0 * mover.radius_m
        if mover.looks == "person":
            piece = person(artist, width_m)
        else:
            piece = trolley(artist, width_m, _box_height(mover.hides))
        furnisher.add_mover(piece, *mover.path[0])


def _own_looks(beacon: Beacon) -> int:
    """The beacon whose looks it has."""
    return beacon.beacon_id if beacon.looks_like is None else beacon.looks_like


def _hang_beacon(furnisher: Furnisher, scenario: Scenario, beacon: Beacon) -> tuple[WallFace, float, float]:
    """Where on which wall a beacon hangs, and how wide it may be."""
    where = f"scenario {scenario.name}, beacon {beacon.beacon_id} at {beacon.at}"
    if beacon.beacon_id > IDENTITY_MAX:
        raise BslamError(f"{where}: allowed with a camera: ids up to {IDENTITY_MAX}")
    face, along_m = _hang(furnisher, beacon.at, where)
    others = [other.at for other in scenario.arena.beacons]
    return face, along_m, _free_width(face, along_m, beacon.at, others)


def _artist(seed: int, style: str, purpose: int) -> Artist:
    known = style_of(style)
    if seed < 0:
        raise BslamError(f"seed {seed}: allowed: 0 and up")
    return Artist(known, np.random.default_rng([known.stream, purpose, seed]))


def _rooms(
    low: Point, high: Point, partitions: int, artist: Artist
) -> tuple[tuple[Wall, ...], tuple[Area, ...]]:
    """Outer walls and rooms: the longest room is parted, so many times, by a wall with a passage."""
    corners = [low, (high[0], low[1]), high, (low[0], high[1])]
    walls = [Wall(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    rooms = [Area(low, high)]
    for _ in range(partitions):
        sides = [max(room.high[i] - room.low[i] for i in range(2)) for room in rooms]
        room = rooms.pop(int(np.argmax(sides)))
        across = int(room.high[1] - room.low[1] > room.high[0] - room.low[0])  # the axis that is parted
        if room.high[across] - room.low[across] < 2.0 * _ROOM_SIDE_MIN_M:
            rooms.append(room)
            break
        cut_m = artist.between(room.low[across] + _ROOM_SIDE_MIN_M, room.high[across] - _ROOM_SIDE_MIN_M)
        from_m, to_m = room.low[1 - across], room.high[1 - across]
        gap_m = artist.between(*_GAP_M)
        gap_from_m = artist.between(from_m + 0.3, to_m - 0.3 - gap_m)
        for start_m, end_m in ((from_m, gap_from_m), (gap_from_m + gap_m, to_m)):
            walls.append(Wall(_point(across, cut_m, start_m), _point(across, cut_m, end_m)))
        rooms.append(Area(room.low, _point(across, cut_m, to_m)))
        rooms.append(Area(_point(across, cut_m, from_m), room.high))
    return tuple(walls), tuple(rooms)


def _point(axis: int, on_axis_m: float, other_m: float) -> Point:
    return (on_axis_m, other_m) if axis == 0 else (other_m, on_axis_m)


def _balanced_names(count: int, artist: Artist) -> list[str]:
    """Kinds in random order, all about equally often; the widest come first, while there is place."""
    names: list[str] = []
    while len(names) < count:
        names += artist.random.permutation(list(KINDS)).tolist()
    return sorted(names[:count], key=lambda name: -KINDS[name].width_m[1])


def _stand_clutter(furnisher: Furnisher, artist: Artist, count: int) -> None:
    """Most of it before the walls, the rest anywhere."""
    for _ in range(count):
        piece = clutter(artist)
        for _ in range(_TRIES):
            area = artist.pick(furnisher.areas)
            x_m, y_m = (artist.between(area.low[i] + 0.35, area.high[i] - 0.35) for i in range(2))
            to_wall_m = min(x_m - area.low[0], area.high[0] - x_m, y_m - area.low[1], area.high[1] - y_m)
            if to_wall_m > _BEFORE_WALL_M and artist.chance(_BEFORE_WALL_SHARE):
                continue
            if furnisher.is_free_floor(x_m, y_m, 0.5 * piece.width_m):
                furnisher.add_clutter(piece, x_m, y_m)
                break


def _hang(furnisher: Furnisher, at: Point, where: str) -> tuple[WallFace, float]:
    """The wall face that a point lies on, and how far from its left end.

    Of the two faces of a wall, the one on whose side the point is; on the wall itself, the one that looks
    into the arena.
    """
    best: tuple[float, WallFace, float] | None = None
    for face in furnisher.faces:
        along_m, out_m = face.along_and_out(at)
        if not (0.0 <= along_m <= face.length_m and -1e-6 <= out_m <= _ON_WALL_M):
            continue
        if not furnisher.is_inside(face.at(along_m, 0.2)):
            continue
        if best is None or out_m < best[0]:
            best = (out_m, face, along_m)
    if best is None:
        raise BslamError(f"{where}: hangs on no wall; allowed: at most {_ON_WALL_M:g} m before one")
    return best[1], best[2]


def _free_width(face: WallFace, along_m: float, at: Point, others: list[Point]) -> float:
    """How wide a beacon may be: up to the wall's ends, and half-way to each neighbour on it."""
    half_m = min(along_m, face.length_m - along_m)
    for other in others:
        distance_m = math.dist(at, other)
        if distance_m > 0.0:
            half_m = min(half_m, 0.5 * _GAP_SHARE * distance_m)
    return 2.0 * half_m
