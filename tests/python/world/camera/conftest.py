"""A plain room to put things into: 6 x 4 m, x from 0 to 6, y from 0 to 4."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from bslam.rig import Camera, Lens
from bslam.world.arena import Wall
from bslam.world.camera.furnish import Area, Furnisher
from bslam.world.camera.looks import Artist, style_of
from bslam.world.camera.scene import Scene
from bslam.world.kinds import Kind

ROOM_M = (6.0, 4.0)


@pytest.fixture(scope="session")
def pinhole() -> Lens:
    """60 degrees across."""
    return Lens("pinhole", 320, 240, 277.1, 277.1, 159.5, 119.5)


@pytest.fixture(scope="session")
def fisheye() -> Lens:
    """180 degrees across."""
    return Lens("equidistant", 320, 240, 101.859, 101.859, 159.5, 119.5)


@pytest.fixture(scope="session")
def ahead(pinhole: Lens) -> Camera:
    return Camera(pinhole)


def flat_kind(width_m: float, height_m: float, bottom_m: float, depth_m: float = 0.01) -> Kind:
    return Kind(height_m, (width_m, width_m), (bottom_m, bottom_m), (depth_m, depth_m))


@pytest.fixture
def furnisher() -> Callable[..., Furnisher]:
    """A function: an empty room, with more walls if any are given."""

    def make(*more: Wall, seed: int = 0) -> Furnisher:
        width_m, depth_m = ROOM_M
        corners = [(0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m)]
        walls = tuple(Wall(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
        artist = Artist(style_of("train"), np.random.default_rng(seed))
        return Furnisher((*walls, *more), (Area((0.0, 0.0), ROOM_M),), artist)

    return make


def hang_ahead(room: Furnisher, beacon_id: int, y_m: float, kind: Kind, name: str = "poster") -> None:
    """A beacon on the wall x = 6, its middle at y_m."""
    face = next(face for face in room.faces if math.isclose(face.normal[0], -1.0) and face.left[0] == 6.0)
    along_m = ROOM_M[1] - y_m  # seen from inside, y falls from left to right
    room.add_beacon(beacon_id, name, kind, face, along_m, kind.width_m[0])


@pytest.fixture
def poster_room(furnisher: Callable[..., Furnisher]) -> Scene:
    """One flat poster, id 7, 0.6 x 0.8 m, middle at y 2, from z 0.2 up, front at x = 5.99."""
    room = furnisher()
    hang_ahead(room, 7, 2.0, flat_kind(0.6, 0.8, 0.2))
    return room.finish(0)
