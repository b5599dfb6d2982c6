"""Pictures as small cameras send them: 16 bits a pixel, RRRRRGGG GGGBBBBB."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def to_rgb565(rgb: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """(h, w, 3) uint8 -> (h, w) uint16, rounded to the nearest step."""
    wide = rgb.astype(np.uint32)
    red, green, blue = ((wide[..., i] * top + 127) // 255 for i, top in enumerate((31, 63, 31)))
    return (red << 11 | green << 5 | blue).astype(np.uint16)


def from_rgb565(pixels: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """(h, w) uint16 -> (h, w, 3) uint8, full range."""
    wide = pixels.astype(np.uint32)
    channels = [(wide >> 11, 31), (wide >> 5 & 63, 63), (wide & 31, 31)]
    return np.stack([(value * 255 + top // 2) // top for value, top in channels], axis=-1).astype(np.uint8)
