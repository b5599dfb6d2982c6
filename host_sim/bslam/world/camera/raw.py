"""The ray caster 1:1. Nothing else in the world touches ffi. Arrays are kept and their sizes checked here."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError

try:
    from bslam.world.camera import _render  # type: ignore[attr-defined]
except ImportError as error:
    raise BslamError(
        f"the ray caster is not built ({error}): run `make setup` in a clone, or install the package anew"
    ) from error

Floats = NDArray[np.float64]
ffi, lib = _render.ffi, _render.lib
SOURCES: str = ffi.string(lib.SOURCES_DIGEST).decode()
"""SHA-256 of the C sources that it was made of."""

LIGHT_NODES = lib.RENDER_LIGHT_NODES
CUT_OUT = lib.RENDER_CUT_OUT
BILLBOARD = lib.RENDER_BILLBOARD
BLUR_TAPS = lib.RENDER_BLUR_TAPS
SURFACES_MAX = 32_000  # an index must fit 16 bits

# As render_surface_t and render_texture_t.
SURFACE = np.dtype(
    [
        ("corner_m", "f4", 3),
        ("right_m", "f4", 3),
        ("down_m", "f4", 3),
        ("tiles_u", "f4"),
        ("tiles_v", "f4"),
        ("glow_lamp", "f4"),
        ("glow_sky", "f4"),
        ("texture", "i4"),
        ("flags", "i4"),
        ("identity", "i4"),
    ]
)
LEVELS_MAX = lib.RENDER_LEVELS_MAX
TEXTURE = np.dtype(
    [("first", "i4", LEVELS_MAX), ("width_log2", "i4"), ("height_log2", "i4"), ("levels", "i4")]
)
assert ffi.sizeof("render_surface_t") == SURFACE.itemsize
assert ffi.sizeof("render_texture_t") == TEXTURE.itemsize

_NORMALS = np.array(
    [NormalDist().inv_cdf((i + 0.5) / lib.RENDER_NORMALS) for i in range(lib.RENDER_NORMALS)],
    dtype=np.float32,
)


def _tone_curve() -> NDArray[np.uint8]:
    """The sRGB curve: linear light 0 to 1 in steps -> byte."""
    light = np.linspace(0.0, 1.0, lib.RENDER_TONES)
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * curve).astype(np.uint8)


_TONES = _tone_curve()


def _pointer(array: NDArray[Any], c_type: str = "float *") -> Any:
    return ffi.cast(c_type, ffi.from_buffer(array))


class LensTables:
    """Rays (2 height + 1, 2 width + 1, 3) and shading (height, width) of a lens."""

    def __init__(
        self, width_px: int, height_px: int, rays: Floats, vignette: Floats, pixel_rad: float
    ) -> None:
        self.shape = (height_px, width_px)
        self._rays = np.ascontiguousarray(np.moveaxis(rays, -1, 0), dtype=np.float32)
        assert self._rays.shape == (3, 2 * height_px + 1, 2 * width_px + 1) and vignette.shape == self.shape
        self.vignette = np.ascontiguousarray(vignette, dtype=np.float32)
        tiles = [-(-count // lib.RENDER_TILE) for count in self._rays.shape[1:]]
        self._tiles = np.zeros((*tiles, 4), dtype=np.float32)
        self.c = ffi.new("render_lens_t *")
        self.c.width_px, self.c.height_px, self.c.pixel_rad = width_px, height_px, pixel_rad
        self.c.ray_x, self.c.ray_y, self.c.ray_z = (_pointer(one) for one in self._rays)
        self.c.tiles = _pointer(self._tiles)
        lib.render_tiles(self.c, _pointer(self._tiles))


class Light:
    """Where light comes from: lamps (k, 5), walls (w, 4), ambient (lamps', sky's) as render_bake has them."""

    def __init__(self, lamps: Floats, walls: Floats, ambient: tuple[float, float]) -> None:
        self._lamps = np.ascontiguousarray(lamps, dtype=np.float32).reshape(-1, 5)
        self._walls = np.ascontiguousarray(walls, dtype=np.float32).reshape(-1, 4)
        self._ambient = list(ambient)

    def bake(self, surfaces: NDArray[Any], maps: NDArray[np.float32]) -> None:
        """Writes the light maps of surfaces (n,) SURFACE: (n, nodes, nodes, 2) float32."""
        assert surfaces.dtype == SURFACE and maps.dtype == np.float32
        assert maps.shape == (len(surfaces), LIGHT_NODES, LIGHT_NODES, 2)
        lib.render_bake(
            _pointer(surfaces, "render_surface_t *"),
            len(surfaces),
            _pointer(self._lamps),
            len(self._lamps),
            _pointer(self._walls),
            len(self._walls),
            self._ambient,
            _pointer(maps),
        )


class SceneTables:
    """A scene's surfaces (n,) SURFACE, textures (m,) TEXTURE and their texels, and light maps."""

    def __init__(
        self, surfaces: NDArray[Any], textures: NDArray[Any], texels: NDArray[np.uint32], light: Light
    ) -> None:
        assert surfaces.dtype == SURFACE and textures.dtype == TEXTURE and len(surfaces) <= SURFACES_MAX
        assert texels.dtype == np.uint32
        self._surfaces, self._textures, self._texels, self._light = surfaces, textures, texels, light
        self._maps = np.zeros((len(surfaces), LIGHT_NODES, LIGHT_NODES, 2), dtype=np.float32)
        light.bake(surfaces, self._maps)
        self.surface_count = len(surfaces)
        self.c = ffi.new("render_scene_t *")
        self.c.surfaces = _pointer(surfaces, "render_surface_t *")
        self.c.surface_count = len(surfaces)
        self.c.textures = _pointer(textures, "render_texture_t *")
        self.c.texels = _pointer(texels, "uint32_t *")
        self.c.light = _pointer(self._maps)

    def copy(self) -> SceneTables:
        """One whose surfaces can be moved without moving these; textures are shared."""
        return SceneTables(self._surfaces.copy(), self._textures, self._texels, self._light)

    def move(self, surface: int, x_m: float, y_m: float) -> None:
        """Puts the middle of an upright surface there, and in the light there."""
        one = self._surfaces[surface : surface + 1]
        one["corner_m"][0, :2] = (x_m, y_m) - 0.5 * one["right_m"][0, :2]
        self._light.bake(one, self._maps[surface : surface + 1])


class Caster:
    """Casts the rays of one lens into one scene; owns the frame's buffers."""

    def __init__(self, scene: SceneTables, lens: LensTables, seed: int) -> None:
        self._scene, self._lens = scene, lens
        height, width = lens.shape
        self._faces = ffi.new("render_face_t[]", max(1, scene.surface_count))
        self._list = ffi.new("int32_t[]", max(1, scene.surface_count))
        self._hits = np.empty((2 * height + 1, 2 * width + 1), dtype=np.int16)
        self._linear = np.empty((height, width, 3), dtype=np.float32)
        self._scratch = np.empty((height + 1, width, 3), dtype=np.float32)
        self._counts = np.zeros(scene.surface_count, dtype=np.int32)
        self._random = ffi.new("uint64_t *", seed)
        self._eye = ffi.new("render_eye_t *")
        self._light = ffi.new("render_light_t *")
        self._sensor = ffi.new("render_sensor_t *")

    def trace(
        self, at_m: tuple[float, float, float], yaw: tuple[float, float], lamp: list[float], sky: list[float]
    ) -> tuple[NDArray[np.int16], NDArray[np.float32]]:
        """Identity and depth pictures from an eye; yaw is (cos, sin). Keeps the light for `expose`."""
        height, width = self._lens.shape
        identity = np.empty((height, width), dtype=np.int16)
        depth_m = np.empty((height, width), dtype=np.float32)
        self._eye.at_m, self._eye.cos_yaw, self._eye.sin_yaw = at_m, *yaw
        self._light.lamp, self._light.sky = lamp, sky
        hits = _pointer(self._hits, "int16_t *")
        scene, lens = self._scene.c, self._lens.c
        lib.render_place(scene, self._eye, self._faces)
        lib.render_trace(scene, lens, self._faces, self._list, hits)
        lib.render_shade(
            scene,
            lens,
            self._faces,
            hits,
            self._light,
            _pointer(self._lens.vignette),
            _pointer(self._linear),
        )
        identity_c, depth_c = _pointer(identity, "int16_t *"), _pointer(depth_m)
        lib.render_truth(
            scene, lens, self._faces, hits, identity_c, depth_c, _pointer(self._counts, "int32_t *")
        )
        return identity, depth_m

    def brightness(self) -> float:
        """Mean light of the picture as traced, values beyond 4 times the mean held back."""
        every = self._linear[::4, ::4]
        return float(np.minimum(every, 4.0 * every.mean()).mean())

    def visible_px(self, first: int, count: int) -> int:
        """Pixel centres that some surfaces got in the picture as traced."""
        return int(self._counts[first : first + count].sum())

    def own_px(self, first: int, count: int, box: tuple[float, float, float, float]) -> int:
        """Pixel centres that some surfaces would cover in the picture as traced, if nothing hid them.

        box: left, top, right, bottom of their projection in px edges, within the frame.
        """
        height, width = self._lens.shape
        left, top = (max(0, math.floor(edge)) for edge in box[:2])
        right, bottom = min(width - 1, math.ceil(box[2])), min(height - 1, math.ceil(box[3]))
        corners = [left, top, right, bottom]
        return lib.render_own_px(self._scene.c, self._lens.c, self._faces, first, count, corners)

    def expose(
        self,
        gain: list[float],
        noise: tuple[float, float],
        blur_row: list[float],
        blur_column: float,
    ) -> NDArray[np.uint8]:
        """The picture (height, width, 3) as the sensor has it. noise: shot, read."""
        rgb = np.empty(self._linear.shape, dtype=np.uint8)
        sensor = self._sensor
        sensor.gain, sensor.blur_row, sensor.blur_column = gain, blur_row, blur_column
        sensor.shot, sensor.read = noise
        lib.render_expose(
            self._lens.c,
            sensor,
            _pointer(_NORMALS),
            _pointer(_TONES, "uint8_t *"),
            self._random,
            _pointer(self._linear),
            _pointer(self._scratch),
            _pointer(rgb, "uint8_t *"),
        )
        return rgb
