"""Picture files as the front end takes them: upright, scaled to a frame, with a camera."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from bslam.errors import BslamError
from bslam.rig import Camera, Lens

SUFFIXES: Final = (".png", ".jpg", ".jpeg", ".bmp", ".ppm")
_TRAINED_PX: Final = (320, 240)
"""The detector was trained on frames of this size: a larger picture of no known camera is made as small."""
_STEP_PX: Final = (8, 4)
"""A frame's sides are multiples of these."""
_SIDE_MIN_PX: Final = 32
_FIELD_OF_VIEW_RAD: Final = math.radians(60.0)
_SAME_SHAPE: Final = 0.01  # width to height of a picture and of its camera's frame may differ by this share

Box = tuple[float, float, float, float]
"""Left, top, right, bottom."""


@dataclass(frozen=True)
class Scaled:
    """A picture as the front end gets it, and how its pixels became the frame's."""

    rgb: NDArray[np.uint8]  # (h, w, 3)
    scale: float
    left_px: float  # of the picture, cut off
    top_px: float

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.rgb.shape[1], self.rgb.shape[0]

    def box(self, left_px: float, top_px: float, right_px: float, bottom_px: float) -> Box:
        """Edges in the picture, 0 to its width and height, as edges in the frame.

        There pixel i covers [i - 0.5, i + 0.5].
        """
        left, right = ((edge - self.left_px) * self.scale - 0.5 for edge in (left_px, right_px))
        top, bottom = ((edge - self.top_px) * self.scale - 0.5 for edge in (top_px, bottom_px))
        return left, top, right, bottom


def load_picture(path: Path, camera: Camera | None = None) -> Scaled:
    """A picture, upright, scaled to the frame of `camera`, or else to the largest that the front end takes.

    It is not enlarged. Without a camera its width becomes a multiple of 8, its height of 4: some pixels
    of the frame are cut off, half on each side. BslamError if it cannot be read, or is not of the camera's
    shape.
    """
    try:
        with Image.open(path) as opened:
            picture = ImageOps.exif_transpose(opened).convert("RGB")
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise BslamError(f"{path}: cannot be read: {error}; allowed: a picture (PNG, JPEG)") from error
    return scale_picture(picture, str(path), camera)


def scale_picture(picture: Image.Image, where: str, camera: Camera | None = None) -> Scaled:
    """The same for a picture at hand; `where` starts every error."""
    if camera is None:
        scale, width_px, height_px = _natural_size(picture.size, where)
    else:
        width_px, height_px = camera.lens.width_px, camera.lens.height_px
        scale = _scale_to(picture.size, (width_px, height_px), where)
    left_px = max(0.0, 0.5 * (picture.size[0] - width_px / scale))
    top_px = max(0.0, 0.5 * (picture.size[1] - height_px / scale))
    cut = (left_px, top_px, picture.size[0] - left_px, picture.size[1] - top_px)
    small = picture.resize((width_px, height_px), Image.Resampling.BOX, box=cut)
    return Scaled(np.array(small), scale, left_px, top_px)


def camera_for(width_px: int, height_px: int) -> Camera:
    """A stand-in for the camera that took a picture: 60 degrees across."""
    focal_px = 0.5 * width_px / math.tan(0.5 * _FIELD_OF_VIEW_RAD)
    centre_px = (0.5 * (width_px - 1), 0.5 * (height_px - 1))
    return Camera(Lens("pinhole", width_px, height_px, focal_px, focal_px, *centre_px))


def _natural_size(size: tuple[int, int], where: str) -> tuple[float, int, int]:
    scale = min(1.0, *(most / side for most, side in zip(_TRAINED_PX, size, strict=True)))
    width_px, height_px = (
        step * int(side * scale / step + 1e-6) for side, step in zip(size, _STEP_PX, strict=True)
    )
    if min(width_px, height_px) < _SIDE_MIN_PX:
        allowed = f"sides from {_SIDE_MIN_PX} px, not longer than 7:1"
        raise BslamError(f"{where}: is {size[0]}x{size[1]}; allowed: {allowed}")
    return scale, width_px, height_px


def _scale_to(size: tuple[int, int], frame_px: tuple[int, int], where: str) -> float:
    across, down = (frame / side for frame, side in zip(frame_px, size, strict=True))
    if max(across, down) > 1.0 or abs(across / down - 1.0) > _SAME_SHAPE:
        allowed = f"{frame_px[0]}x{frame_px[1]}, its camera's frame, or larger in the same proportion"
        raise BslamError(f"{where}: is {size[0]}x{size[1]}; allowed: {allowed}")
    return max(across, down)
