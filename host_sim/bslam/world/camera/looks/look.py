"""How a thing looks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bslam.world.camera.looks.canvas import Colour


@dataclass(frozen=True)
class Look:
    """`front` (h, w, 4) uint8 RGBA, sides powers of two; `side`: the colour of a body's other sides.

    `cut_out`: the front's alpha is the thing's outline. Otherwise the front glows where alpha is 0: `glow`
    times the lamps' and the sky's light.
    """

    front: NDArray[np.uint8]
    side: Colour
    cut_out: bool = False
    glow: tuple[float, float] = (0.0, 0.0)

    @property
    def side_picture(self) -> NDArray[np.uint8]:
        """One texel."""
        channels = [round(255.0 * min(1.0, max(0.0, one))) for one in self.side]
        return np.array([[[*channels, 255]]], dtype=np.uint8)
