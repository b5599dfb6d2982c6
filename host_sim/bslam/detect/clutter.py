"""Pictures full of other things, made from what is around the labelled boxes.

Forty photographs of corridors do not show what else there is. Patches of them, of all sizes and in other
colours, side by side, have the edges and colours of much that a robot will meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bslam.datasets.pictures import Scaled
from bslam.detect.boxes import overlaps
from bslam.detect.examples import Example

_WIDTH, _HEIGHT = 320, 240
_SIDES_PX: Final = (16, 120)
_SCALES: Final = (0.3, 2.0)  # a patch's pixels in the picture that it is from
_TRIES: Final = 40


def clutter(examples: Sequence[Example], kind: str, count: int, rng: np.random.Generator) -> list[Example]:
    """So many pictures without a thing of the class."""
    return [_picture(examples, kind, index, rng) for index in range(count)]


def _picture(examples: Sequence[Example], kind: str, index: int, rng: np.random.Generator) -> Example:
    frame = np.empty((_HEIGHT, _WIDTH, 3), np.uint8)
    # Strips of patches: each strip of one height, each patch of a width of its own.
    top = 0
    while top < _HEIGHT:
        height = min(int(rng.integers(*_SIDES_PX)), _HEIGHT - top)
        left = 0
        while left < _WIDTH:
            width = min(int(rng.integers(*_SIDES_PX)), _WIDTH - left)
            patch = _patch(examples, kind, (width, height), rng)
            frame[top : top + height, left : left + width] = patch
            left += width
        top += height
    return Example(f"clutter {index}", frame, {}, Scaled(frame, 1.0, 0.0, 0.0))


def _patch(
    examples: Sequence[Example], kind: str, size: tuple[int, int], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """A piece of a picture without the class, scaled, in other colours; plain where there is none."""
    for _ in range(_TRIES):
        one = examples[int(rng.integers(len(examples)))]
        scale = float(np.exp(rng.uniform(*np.log(_SCALES))))
        width, height = (side / scale for side in size)
        room = one.frame.shape[1] - width, one.frame.shape[0] - height
        if min(room) < 0.0:
            continue
        left, top = (rng.uniform(0.0, its) for its in room)
        box = (left, top, left + width, top + height)
        if overlaps(np.array([box]), one.of(kind)).max(initial=0.0) > 0.0:
            continue
        piece = np.asarray(Image.fromarray(one.frame).resize(size, Image.Resampling.BOX, box=box))
        return _recoloured(piece[:, :: int(rng.choice([-1, 1]))], rng)
    return np.broadcast_to(rng.integers(0, 256, 3, dtype=np.uint8), (size[1], size[0], 3))


def _recoloured(piece: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Half of the pieces as they are; of the others channels change places, and contrast."""
    if rng.random() < 0.5:
        return piece
    changed = piece[:, :, rng.permutation(3)].astype(np.float64)
    middle = changed.mean(axis=(0, 1))
    changed = (changed - middle) * rng.uniform(0.5, 2.0) + middle + rng.uniform(-40.0, 40.0)
    return np.clip(changed, 0.0, 255.0).astype(np.uint8)
