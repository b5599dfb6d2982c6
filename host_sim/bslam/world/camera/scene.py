"""What a camera looks at: a furnished arena as textured rectangles, with its beacons and its light.

Lengths in metres, in the arena's frame, z up from the floor. A Scene is made by `make_world` or `dress`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.world.arena import Arena
from bslam.world.camera import raw

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

NO_BEACON = -1
CLUTTER = -2
"""Identities of what is no beacon: walls and the like, and things that a detector might take for one."""

IDENTITY_MAX = 2**15 - 1


@dataclass(frozen=True)
class BeaconLook:
    """A beacon as it looks. x_m, y_m: the middle of its front face, in plan; that is where it is seen.

    facing_rad: the direction from the wall into the room. A body with depth stands out from the wall by it:
    the foot on the wall is depth_m behind (x_m, y_m).
    """

    beacon_id: int
    kind: str
    x_m: float
    y_m: float
    height_m: float
    width_m: float
    bottom_m: float
    depth_m: float
    facing_rad: float

    @property
    def foot(self) -> tuple[float, float]:
        """Where its middle touches the wall, in plan."""
        cos, sin = math.cos(self.facing_rad), math.sin(self.facing_rad)
        return self.x_m - self.depth_m * cos, self.y_m - self.depth_m * sin


@dataclass(frozen=True)
class Drift:
    """A level that wanders slowly around 1: two sines."""

    amplitude: float
    period_s: float
    phase_rad: float

    def at(self, time_s: float) -> float:
        angle = math.tau * time_s / self.period_s + self.phase_rad
        return 1.0 + self.amplitude * (0.7 * math.sin(angle) + 0.3 * math.sin(2.7 * angle))


@dataclass(frozen=True)
class Lighting:
    """Colour (RGB, linear) and course of the lamps' and of the sky's light."""

    lamp_rgb: tuple[float, float, float]
    sky_rgb: tuple[float, float, float]
    lamp_drift: Drift
    sky_drift: Drift

    def at(self, time_s: float) -> tuple[list[float], list[float]]:
        """The lamps' and the sky's light, RGB."""
        lamp, sky = self.lamp_drift.at(time_s), self.sky_drift.at(time_s)
        return [lamp * one for one in self.lamp_rgb], [sky * one for one in self.sky_rgb]


@dataclass(frozen=True)
class Obstacle:
    """A thing on the floor that a robot does not drive through: a circle."""

    x_m: float
    y_m: float
    radius_m: float


@dataclass(frozen=True)
class Body:
    """Which of the scene's surfaces are a beacon's; their corners (n, 4, 3); `turns`: it faces every eye."""

    first: int
    count: int
    corners_m: Floats
    turns: bool

    def corners_from(self, eye: tuple[float, float, float]) -> Floats:
        """The corners as an eye sees them."""
        if not self.turns:
            return self.corners_m
        middle = self.corners_m.mean(axis=(0, 1))
        away = math.atan2(middle[1] - eye[1], middle[0] - eye[0])
        half_m = 0.5 * float(np.linalg.norm(self.corners_m[0, 1] - self.corners_m[0, 0]))
        turned = self.corners_m.copy()
        for index, side in enumerate((-half_m, half_m, half_m, -half_m)):
            turned[:, index, :2] = middle[:2] + side * np.array([math.sin(away), -math.cos(away)])
        return turned


@dataclass(frozen=True)
class Scene:
    """`arena` has the walls, and the beacons where they are seen: at the middles of their front faces."""

    seed: int
    style: str
    arena: Arena
    height_m: float
    beacons: tuple[BeaconLook, ...]
    bodies: tuple[Body, ...]  # of the beacons, in their order
    areas: tuple[tuple[float, float, float, float], ...]  # rooms: low x, low y, high x, high y
    obstacles: tuple[Obstacle, ...]
    movers: tuple[int, ...]  # the surfaces of what moves about, one each
    lighting: Lighting
    tables: raw.SceneTables


class SceneBuilder:
    """Collects surfaces and textures."""

    def __init__(self) -> None:
        self._surfaces: list[tuple[Any, ...]] = []
        self._textures: list[tuple[Any, ...]] = []
        self._texels: list[NDArray[np.uint32]] = []
        self._texel_count = 0

    @property
    def surface_count(self) -> int:
        return len(self._surfaces)

    def texture(self, picture: Picture) -> int:
        """Takes a picture (height, width, 4) uint8 RGBA, sides powers of two; returns its number.

        Bytes are square roots of linear light. Alpha: see `rectangle`.
        """
        height, width = picture.shape[:2]
        assert height & (height - 1) == 0 and width & (width - 1) == 0 and picture.shape[2] == 4
        first = []
        for level in _mip_levels(picture):
            first.append(self._texel_count)
            self._texels.append(np.ascontiguousarray(level).view(np.uint32).ravel())
            self._texel_count += self._texels[-1].size
        unused = [0] * (raw.LEVELS_MAX - len(first))
        sizes = (width.bit_length() - 1, height.bit_length() - 1, len(first))
        self._textures.append(((*first, *unused), *sizes))
        return len(self._textures) - 1

    def rectangle(
        self,
        corner_m: Floats,
        right_m: Floats,
        down_m: Floats,
        texture: int,
        identity: int = NO_BEACON,
        tiles: tuple[float, float] = (1.0, 1.0),
        glow: tuple[float, float] = (0.0, 0.0),
        flags: int = 0,
    ) -> None:
        """A surface; corner is the upper left one as seen from the front.

        With the flag CUT_OUT alpha below a half is a hole; without it alpha 0 is where the surface glows, by
        `glow` times the lamps' and the sky's light.
        """
        self._surfaces.append(
            (tuple(corner_m), tuple(right_m), tuple(down_m), *tiles, *glow, texture, flags, identity)
        )

    def tables(self, light: raw.Light) -> raw.SceneTables:
        """All that was collected, in that light."""
        textures = np.array(self._textures, dtype=raw.TEXTURE)
        return raw.SceneTables(self._array(), textures, np.concatenate(self._texels), light)

    def body(self, first: int, turns: bool) -> Body:
        """The surfaces from `first` on."""
        surfaces = self._array()[first:]
        corner, right, down = (surfaces[key].astype(float) for key in ("corner_m", "right_m", "down_m"))
        corners = np.stack([corner, corner + right, corner + right + down, corner + down], axis=1)
        return Body(first, len(surfaces), corners, turns)

    def _array(self) -> NDArray[Any]:
        return np.array(self._surfaces, dtype=raw.SURFACE)


def _mip_levels(picture: Picture) -> list[Picture]:
    """The picture and its halvings, until a side is one texel."""
    levels = [picture]
    while min(levels[-1].shape[:2]) > 1:
        half = levels[-1].astype(np.uint16)
        half = half[0::2] + half[1::2]
        half = (half[:, 0::2] + half[:, 1::2] + np.uint16(2)) >> np.uint16(2)
        levels.append(half.astype(np.uint8))
    return levels
