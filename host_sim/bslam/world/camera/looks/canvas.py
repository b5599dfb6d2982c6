"""Painting with numpy: a canvas in fractions of its width and height, (0, 0) the upper left corner.

Colours are (r, g, b) from 0 to 1, the square roots of linear light. A canvas holds alpha as well: what it
means is up to the surface (see `SceneBuilder.rectangle`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float]
Mask = NDArray[np.bool_]


class Canvas:
    """`aspect`: real width over real height, so that circles are round."""

    def __init__(self, width_px: int, height_px: int, colour: Colour, aspect: float | None = None) -> None:
        self.rgb = np.empty((height_px, width_px, 3), dtype=np.float32)
        self.rgb[:] = colour
        self.alpha = np.ones((height_px, width_px), dtype=np.float32)
        self.aspect = width_px / height_px if aspect is None else aspect

    def picture(self) -> NDArray[np.uint8]:
        """(height, width, 4) uint8 RGBA."""
        both = np.concatenate([self.rgb, self.alpha[..., np.newaxis]], axis=2)
        return (np.clip(both, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)

    def rect(
        self, left: float, top: float, right: float, bottom: float, colour: Colour, cover: float = 1.0
    ) -> None:
        """Fills a rectangle, at least a texel thick; cover below 1 lets through what was there."""
        part = self.rgb[self._slices(left, top, right, bottom)]
        part += np.float32(cover) * (np.asarray(colour, dtype=np.float32) - part)

    def frame(
        self, left: float, top: float, right: float, bottom: float, thick: float, colour: Colour
    ) -> None:
        """A rectangle's outline of so much of the width, inside it."""
        tall = thick * self.aspect
        self.rect(left, top, right, top + tall, colour)
        self.rect(left, bottom - tall, right, bottom, colour)
        self.rect(left, top, left + thick, bottom, colour)
        self.rect(right - thick, top, right, bottom, colour)

    def bevel(self, left: float, top: float, right: float, bottom: float, thick: float, depth: float) -> None:
        """A sunk panel: dark above and left, light below and right; depth below 0 raises it."""
        tall = thick * self.aspect
        self.scale(left, top, right, top + tall, 1.0 - depth)
        self.scale(left, top, left + thick, bottom, 1.0 - 0.6 * depth)
        self.scale(left, bottom - tall, right, bottom, 1.0 + depth)
        self.scale(right - thick, top, right, bottom, 1.0 + 0.6 * depth)

    def scale(self, left: float, top: float, right: float, bottom: float, factor: float) -> None:
        """Makes a rectangle darker or lighter."""
        self.rgb[self._slices(left, top, right, bottom)] *= np.float32(factor)

    def ellipse(
        self, x: float, y: float, wide: float, tall: float, colour: Colour, cover: float = 1.0
    ) -> None:
        """wide, tall: half its axes, in fractions of the canvas."""
        slices = self._slices(x - wide, y - tall, x + wide, y + tall)
        xs, ys = self._grid(slices)
        self._fill(slices, ((xs - x) / wide) ** 2 + ((ys - y) / tall) ** 2 <= 1.0, colour, cover)

    def circle(self, x: float, y: float, radius: float, colour: Colour, cover: float = 1.0) -> None:
        """radius in fractions of the width."""
        self.ellipse(x, y, radius, radius * self.aspect, colour, cover)

    def polygon(self, points: Sequence[tuple[float, float]], colour: Colour, cover: float = 1.0) -> None:
        xs, ys = zip(*points, strict=True)
        slices = self._slices(min(xs), min(ys), max(xs), max(ys))
        self._fill(slices, _inside(points, *self._grid(slices)), colour, cover)

    def line(
        self, start: tuple[float, float], end: tuple[float, float], thick: float, colour: Colour
    ) -> None:
        """thick in fractions of the width."""
        half_x, half_y = 0.5 * thick, 0.5 * thick * self.aspect
        slices = self._slices(
            min(start[0], end[0]) - half_x,
            min(start[1], end[1]) - half_y,
            max(start[0], end[0]) + half_x,
            max(start[1], end[1]) + half_y,
        )
        xs, ys = self._grid(slices)
        along = np.array([end[0] - start[0], (end[1] - start[1]) / self.aspect])
        off_x, off_y = xs - start[0], (ys - start[1]) / self.aspect
        share = np.clip((off_x * along[0] + off_y * along[1]) / max(along @ along, 1e-9), 0.0, 1.0)
        near = np.hypot(off_x - share * along[0], off_y - share * along[1]) <= half_x
        self._fill(slices, near, colour, 1.0)

    def gradient(self, top: Colour, bottom: Colour, sideways: bool = False) -> None:
        """The whole canvas from one colour to another."""
        height, width = self.alpha.shape
        share = np.linspace(0.0, 1.0, width if sideways else height, dtype=np.float32)
        share = share[np.newaxis, :, np.newaxis] if sideways else share[:, np.newaxis, np.newaxis]
        self.rgb[:] = np.asarray(top, np.float32) + share * (np.asarray(bottom, np.float32) - top)

    def hole(self, left: float, top: float, right: float, bottom: float, alpha: float = 0.0) -> None:
        """Sets alpha in a rectangle."""
        self.alpha[self._slices(left, top, right, bottom)] = alpha

    def keep(self, mask: Mask) -> None:
        """Makes alpha 0 outside a mask of the canvas's size."""
        self.alpha[~mask] = 0.0

    def ground(self) -> NDArray[np.float32]:
        """A copy of what is painted so far; see `painted_on`."""
        return self.rgb.copy()

    def painted_on(self, ground: NDArray[np.float32]) -> Mask:
        """Where the canvas no longer is as it was: the outline of what was painted."""
        return (self.rgb != ground).any(axis=2)

    def grain(
        self, random: np.random.Generator, amount: float, cells_x: int, cells_y: int, hue: float = 0.0
    ) -> None:
        """Multiplies by smooth noise around 1 of so many cells across; `hue`: how much channels differ."""
        height, width = self.alpha.shape
        coarse = random.normal(0.0, 1.0, (cells_y, cells_x, 1)) * np.ones(3)
        if hue > 0.0:
            coarse = coarse + hue * random.normal(0.0, 1.0, (cells_y, cells_x, 3))
        self.rgb *= (1.0 + amount * _enlarge(coarse, height, width)).astype(np.float32)

    def _slices(self, left: float, top: float, right: float, bottom: float) -> tuple[slice, slice]:
        height, width = self.alpha.shape
        x0 = min(max(0, round(left * width)), width - 1)
        y0 = min(max(0, round(top * height)), height - 1)
        return slice(y0, max(y0 + 1, round(bottom * height))), slice(x0, max(x0 + 1, round(right * width)))

    def _grid(self, slices: tuple[slice, slice]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        height, width = self.alpha.shape
        ys = (np.arange(height)[slices[0]] + 0.5) / height
        xs = (np.arange(width)[slices[1]] + 0.5) / width
        return xs[np.newaxis, :], ys[:, np.newaxis]

    def _fill(self, slices: tuple[slice, slice], mask: Mask, colour: Colour, cover: float) -> None:
        part = self.rgb[slices]
        part[mask] += np.float32(cover) * (np.asarray(colour, dtype=np.float32) - part[mask])


def _inside(points: Sequence[tuple[float, float]], xs: NDArray[np.float64], ys: NDArray[np.float64]) -> Mask:
    """Even-odd rule."""
    inside = np.zeros(np.broadcast_shapes(xs.shape, ys.shape), dtype=np.bool_)
    for (x0, y0), (x1, y1) in zip(points, [*points[1:], points[0]], strict=True):
        if y0 == y1:
            continue
        crosses = (ys < y0) != (ys < y1)
        inside ^= crosses & (xs < x0 + (ys - y0) * (x1 - x0) / (y1 - y0))
    return inside


def _enlarge(coarse: NDArray[np.float64], height: int, width: int) -> NDArray[np.float64]:
    """Bilinear, and seamless where the picture is repeated."""
    for axis, size in ((0, height), (1, width)):
        count = coarse.shape[axis]
        at = (np.arange(size) + 0.5) * count / size - 0.5
        low = np.floor(at).astype(int)
        share = (at - low).reshape([-1, 1, 1] if axis == 0 else [1, -1, 1])
        coarse = (1.0 - share) * coarse.take(low % count, axis) + share * coarse.take((low + 1) % count, axis)
    return coarse


def mix(a: Colour, b: Colour, share: float) -> Colour:
    return tuple((1.0 - share) * one + share * other for one, other in zip(a, b, strict=True))  # type: ignore


def tint(colour: Colour, factor: float) -> Colour:
    """Darker or lighter."""
    return tuple(min(1.0, factor * one) for one in colour)  # type: ignore[return-value]


def hsv(hue: float, saturation: float, value: float) -> Colour:
    """Hue in turns."""
    channels = [
        value * (1.0 - saturation * min(1.0, max(0.0, abs(math.fmod(6.0 * hue + off, 6.0) - 3.0) - 1.0)))
        for off in (3.0, 1.0, 5.0)
    ]
    return channels[0], channels[1], channels[2]
