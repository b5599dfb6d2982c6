"""Pictures of a checkerboard through a lens, by casting a ray for each pixel: nothing of OpenCV in them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bslam.rig import Lens

ACROSS, DOWN, SQUARE_M = 8, 5, 0.06
"""Inner corners and side of the board's squares."""

_SAMPLES = 3  # a side of a pixel


def rays(lens: Lens, u_px: NDArray[np.float64], v_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directions (..., 3), x right, y down, z forward, of pixels; the distortion is inverted by a table."""
    a, b = (u_px - lens.cx_px) / lens.fx_px, (v_px - lens.cy_px) / lens.fy_px
    radius = np.hypot(a, b)
    undistorted = np.linspace(0.0, 1.2 if lens.kind == "pinhole" else math.pi / 2, 20001)
    distorted = undistorted * (1.0 + lens.k1 * undistorted**2 + lens.k2 * undistorted**4)
    assert np.all(np.diff(distorted) > 0)
    straight = np.interp(radius, distorted, undistorted, right=np.nan)
    angle = np.arctan(straight) if lens.kind == "pinhole" else straight
    sine = np.sin(angle) / np.maximum(radius, 1e-12)
    return np.stack([a * sine, b * sine, np.cos(angle)], axis=-1)


def rotation(yaw_rad: float, pitch_rad: float, roll_rad: float) -> NDArray[np.float64]:
    """From the board's axes to the camera's: rolled, then tipped, then turned."""
    cy, sy, cp, sp = math.cos(yaw_rad), math.sin(yaw_rad), math.cos(pitch_rad), math.sin(pitch_rad)
    cr, sr = math.cos(roll_rad), math.sin(roll_rad)
    turn = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    tip = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    roll = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
    return turn @ tip @ roll


def picture(
    lens: Lens, turn: NDArray[np.float64], middle_m: NDArray[np.float64], seed: int
) -> NDArray[np.uint8]:
    """The board, grey and a little noisy, its middle at `middle_m` (3,) in camera axes, turned by `turn`."""
    step = 1.0 / _SAMPLES
    offsets = (np.arange(_SAMPLES) + 0.5) * step - 0.5
    v, u = np.meshgrid(
        (np.arange(lens.height_px)[:, None] + offsets).ravel(),
        (np.arange(lens.width_px)[:, None] + offsets).ravel(),
        indexing="ij",
    )
    light = _light(rays(lens, u, v), turn, middle_m)
    pixels = light.reshape(lens.height_px, _SAMPLES, lens.width_px, _SAMPLES).mean(axis=(1, 3))
    noise = np.random.default_rng(seed).normal(0.0, 2.0, pixels.shape)
    return np.clip(pixels + noise, 0, 255).astype(np.uint8)


def _light(
    ray: NDArray[np.float64], turn: NDArray[np.float64], middle_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    normal = turn[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (normal @ middle_m) / (ray @ normal)
    on_board = (ray * distance[..., None] - middle_m) @ turn[:, :2] / SQUARE_M
    across, down = on_board[..., 0] + (ACROSS + 1) / 2, on_board[..., 1] + (DOWN + 1) / 2
    hit = (distance > 0) & (across > -0.7) & (across < ACROSS + 1.7) & (down > -0.7) & (down < DOWN + 1.7)
    field = (across > 0) & (across < ACROSS + 1) & (down > 0) & (down < DOWN + 1)
    with np.errstate(invalid="ignore"):
        dark = field & ((np.floor(across) + np.floor(down)) % 2 == 0)
    return np.where(hit, np.where(dark, 30.0, 225.0), 120.0)
