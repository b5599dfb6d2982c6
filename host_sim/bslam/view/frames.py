"""Frames with boxes and words drawn into them, and many of them on a sheet."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

RIGHT: Final = "#38e05a"
WRONG: Final = "#ff4d4d"
UNKNOWN: Final = "#ffd34d"
_INK: Final = "#ffffff"
_PAPER: Final = "#202020"
_SCALE: Final = 3  # of a frame's pixels in its picture
_WORDS_PX: Final = 20
_CAPTION_PX: Final = 30
_GAP_PX: Final = 6


@dataclass(frozen=True)
class Mark:
    """A box, edges in px of the frame (pixel i covers [i - 0.5, i + 0.5]), and the words on it."""

    box: tuple[float, float, float, float]
    lines: tuple[str, ...]
    colour: str


def annotate(rgb: NDArray[np.uint8], marks: Sequence[Mark], caption: str) -> Image.Image:
    """The frame (h, w, 3), enlarged, with its marks and a caption below."""
    frame = Image.fromarray(rgb)
    width, height = _SCALE * frame.width, _SCALE * frame.height
    picture = Image.new("RGB", (width, height + _CAPTION_PX), _PAPER)
    picture.paste(frame.resize((width, height), Image.Resampling.NEAREST))
    pen = ImageDraw.Draw(picture)
    font = ImageFont.load_default(_WORDS_PX)
    for mark in marks:
        left, top, right, bottom = (_SCALE * (edge + 0.5) for edge in mark.box)
        pen.rectangle((left, top, right, bottom), outline=mark.colour, width=2)
        words = "\n".join(mark.lines)
        # Above the box where there is room, else inside; never past the frame's right edge.
        _, _, words_width, words_height = pen.multiline_textbbox((0, 0), words, font=font)
        x = max(0.0, min(left, width - words_width))
        y = top - words_height - 4 if top > words_height + 4 else top + 2
        pen.rectangle((x, y, x + words_width, y + words_height + 2), fill=_PAPER)
        pen.multiline_text((x, y), words, fill=mark.colour, font=font)
    pen.text((6, height + 3), caption, fill=_INK, font=font)
    return picture


def contact_sheet(pictures: Sequence[Image.Image], columns: int = 4, width_px: int = 480) -> Image.Image:
    """The pictures, of any shapes, reduced to fit as wide and as high as the widest is then, in rows."""
    columns = min(columns, len(pictures))
    scale = width_px / max(picture.width for picture in pictures)
    height_px = round(scale * max(picture.height for picture in pictures))
    rows = math.ceil(len(pictures) / columns)
    size = (columns * (width_px + _GAP_PX) - _GAP_PX, rows * (height_px + _GAP_PX) - _GAP_PX)
    sheet = Image.new("RGB", size, _INK)
    for index, picture in enumerate(pictures):
        row, column = divmod(index, columns)
        small = picture.resize(
            (round(scale * picture.width), round(scale * picture.height)), Image.Resampling.LANCZOS
        )
        sheet.paste(small, (column * (width_px + _GAP_PX), row * (height_px + _GAP_PX)))
    return sheet


def png(picture: Image.Image) -> bytes:
    """The picture as the content of a PNG file."""
    buffer = io.BytesIO()
    picture.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()
