"""What a lens does to directions, both ways: pixels to rays for the ray caster, points to pixels for boxes.

The level frame: origin at the eye, x forward, y left, z up, without the camera's pitch.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.rig import Camera, Lens
from bslam.world.camera import raw

Floats = NDArray[np.float64]

_NEWTON_STEPS = 30
_NEAR_M = 0.01  # a pinhole sees nothing beside or behind it: edges are cut off here
_POINTS_AN_EDGE = 17
_EDGE_LIGHT = 0.75  # a 60-degree lens keeps so much of the middle's light in its corners


def unproject(camera: Camera, u_px: Floats, v_px: Floats) -> Floats:
    """Unit rays (..., 3) in the level frame; (0, 0, 0) where the lens shows nothing."""
    lens = camera.lens
    mx, my = (u_px - lens.cx_px) / lens.fx_px, (v_px - lens.cy_px) / lens.fy_px
    bent = np.hypot(mx, my)
    straight = _straighten(lens, bent)
    with np.errstate(invalid="ignore", divide="ignore"):
        if lens.kind == "pinhole":
            scale = np.where(bent > 0.0, straight / bent, 1.0)
            ray = np.stack([np.ones_like(mx), -mx * scale, -my * scale], axis=-1)
        else:
            scale = np.where(bent > 0.0, np.sin(straight) / bent, 1.0)
            ray = np.stack([np.cos(straight), -mx * scale, -my * scale], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    if lens.kind == "equidistant":
        ray[straight > 0.5 * math.pi] = 0.0
    return _pitch(ray, camera.pitch_rad)


def project(camera: Camera, points: Floats) -> tuple[Floats, Floats]:
    """Pixels u, v (...,) of points (..., 3) in the level frame; a pinhole's must lie before it (x > 0).

    A point beyond the angle where the distortion's polynomial turns back lands on that angle's circle.
    """
    lens = camera.lens
    x, y, z = np.moveaxis(_pitch(np.asarray(points, dtype=np.float64), -camera.pitch_rad), -1, 0)
    across = np.hypot(y, z)
    straight = across / x if lens.kind == "pinhole" else np.arctan2(across, x)
    bent = _bend(lens, np.minimum(straight, _turning_point(lens)))
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = np.where(across > 0.0, bent / across, 0.0)
    return lens.cx_px - lens.fx_px * scale * y, lens.cy_px - lens.fy_px * scale * z


def outline(camera: Camera, quads: Floats) -> tuple[tuple[float, float, float, float], bool] | None:
    """Box (left, top, right, bottom; px edges, clipped to the frame) around rectangles; whether it was cut.

    quads: (n, 4, 3) corners in order in the level frame. None if nothing of them is before the lens.
    """
    starts = quads.reshape(-1, 3)
    ends = np.roll(quads, -1, axis=1).reshape(-1, 3)
    hidden = False
    if camera.lens.kind == "pinhole":
        starts, ends, hidden = _before_lens(camera, starts, ends)
        if not len(starts):
            return None
    share = np.linspace(0.0, 1.0, _POINTS_AN_EDGE)[:, np.newaxis, np.newaxis]
    points = starts + share * (ends - starts)
    u_px, v_px = project(camera, points)
    if camera.lens.kind == "equidistant":
        hidden = bool((_pitch(points, -camera.pitch_rad)[..., 0] < 0.0).any())
    left, top, right, bottom = u_px.min(), v_px.min(), u_px.max(), v_px.max()
    high_u, high_v = camera.lens.width_px - 0.5, camera.lens.height_px - 0.5
    cut = hidden or left < -0.5 or top < -0.5 or right > high_u or bottom > high_v
    box = (max(left, -0.5), max(top, -0.5), min(right, high_u), min(bottom, high_v))
    return (float(box[0]), float(box[1]), float(box[2]), float(box[3])), bool(cut)


@lru_cache(maxsize=32)
def rays(camera: Camera) -> raw.LensTables:
    """The tables of a camera for the ray caster: one ray each half pixel, and the lens's shading."""
    lens = camera.lens
    u_px = np.arange(2 * lens.width_px + 1) / 2.0 - 0.5
    v_px = np.arange(2 * lens.height_px + 1) / 2.0 - 0.5
    table = unproject(camera, *np.meshgrid(u_px, v_px))
    centre = _pitch(table[1::2, 1::2], -camera.pitch_rad)[..., 0]
    # cos^4 is what a simple pinhole loses; real lenses are built to lose less, fisheyes most of all.
    power = math.log(_EDGE_LIGHT) / math.log(0.81) if lens.kind == "pinhole" else 0.35
    vignette = np.clip(centre, 0.05, 1.0) ** power
    pixel_rad = 1.0 / max(lens.fx_px, lens.fy_px)
    return raw.LensTables(lens.width_px, lens.height_px, table, vignette, pixel_rad)


def _bend(lens: Lens, straight: Floats) -> Floats:
    square = straight * straight
    return straight * (1.0 + square * (lens.k1 + square * lens.k2))


def _slope(lens: Lens, straight: Floats) -> Floats:
    square = straight * straight
    return 1.0 + square * (3.0 * lens.k1 + square * 5.0 * lens.k2)


@lru_cache(maxsize=32)
def _turning_point(lens: Lens) -> float:
    """The least tan or angle at which the distortion's polynomial stops rising; inf if it never does."""
    roots = np.roots([5.0 * lens.k2, 3.0 * lens.k1, 1.0]) if lens.k2 or lens.k1 else np.array([])
    squares = [root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 0.0]
    return math.sqrt(min(squares)) if squares else math.inf


def _straighten(lens: Lens, bent: Floats) -> Floats:
    """The inverse of _bend by Newton's method; BslamError if the polynomial does not reach some pixel."""
    if not lens.k1 and not lens.k2:
        return bent
    turn = _turning_point(lens)
    straight = np.minimum(bent, 0.99 * turn)
    for _ in range(_NEWTON_STEPS):
        straight = np.clip(straight - (_bend(lens, straight) - bent) / _slope(lens, straight), 0.0, turn)
    if not np.allclose(_bend(lens, straight), bent, rtol=0.0, atol=1e-9):
        raise BslamError(
            f"lens, k1 and k2: {lens.k1:g}, {lens.k2:g} do not reach the corners of the picture; "
            "allowed: a distortion that rises over the whole picture"
        )
    return straight


def _pitch(vectors: Floats, pitch_rad: float) -> Floats:
    """From the camera's frame to the level one: positive pitch looks down."""
    if pitch_rad == 0.0:
        return vectors
    cos, sin = math.cos(pitch_rad), math.sin(pitch_rad)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([cos * x + sin * z, y, cos * z - sin * x], axis=-1)


def _before_lens(camera: Camera, starts: Floats, ends: Floats) -> tuple[Floats, Floats, bool]:
    """The parts of the edges that are before a pinhole, and whether any was cut off."""
    ahead_start = _pitch(starts, -camera.pitch_rad)[:, 0] - _NEAR_M
    ahead_end = _pitch(ends, -camera.pitch_rad)[:, 0] - _NEAR_M
    some = (ahead_start > 0.0) | (ahead_end > 0.0)
    hidden = bool(((ahead_start <= 0.0) | (ahead_end <= 0.0)).any())
    starts, ends, ahead_start, ahead_end = starts[some], ends[some], ahead_start[some], ahead_end[some]
    crosses = ahead_start * ahead_end < 0.0
    cut = np.where(crosses, ahead_start / np.where(crosses, ahead_start - ahead_end, 1.0), 0.0)
    crossing = starts + cut[:, np.newaxis] * (ends - starts)
    starts = np.where(ahead_start[:, np.newaxis] <= 0.0, crossing, starts)
    ends = np.where(ahead_end[:, np.newaxis] <= 0.0, crossing, ends)
    return starts, ends, hidden
