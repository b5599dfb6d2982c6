"""Windows over the cells of pictures: what the scanner in C computes, for many pictures at once, in numpy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from PIL import Image

from bslam.core.scanner import LEVEL_PAD, Level, Scanner
from bslam.detect.boxes import Floats
from bslam.scannerfile import BLOCK, CHANNELS, SIDE_MAX

CELL_PX = 4
_MARGIN = 1.0  # cells around the box, on each side
_AREA = 60.0  # of the box, cells
_AROUND = 4  # cells around a crop, that edges are relative to


@dataclass(frozen=True)
class Shape:
    """A window: its sides in cells, and those of the box in its middle."""

    columns: int
    rows: int
    box_columns: float
    box_rows: float

    @property
    def halved(self) -> Shape:
        """Of means of BLOCK x BLOCK cells."""
        sides = (self.columns // BLOCK, self.rows // BLOCK)
        return Shape(*sides, self.box_columns / BLOCK, self.box_rows / BLOCK)


def shape_for(aspect: float) -> Shape:
    """The window for boxes of such a width to height."""
    longest = (SIDE_MAX - 2 * _MARGIN) ** 2
    area = min(_AREA, longest * min(aspect, 1.0 / aspect))
    columns, rows = (area * aspect) ** 0.5, (area / aspect) ** 0.5
    across, down = (_even(side + 2 * _MARGIN) for side in (columns, rows))
    return Shape(across, down, columns, rows)


def _even(side: float) -> int:
    return min(SIDE_MAX, max(BLOCK, BLOCK * round(side / BLOCK)))


def window_boxes(level: Level, shape: Shape) -> Floats:
    """The boxes (rows * columns, 4) of all windows of a level, row by row."""
    rows, columns = (
        side - its + 1 for side, its in zip(level.cells.shape, (shape.rows, shape.columns), strict=False)
    )
    row, column = np.mgrid[: max(rows, 0), : max(columns, 0)]
    x = (column + shape.columns / 2 - LEVEL_PAD) * level.cell_px
    y = (row + shape.rows / 2 - LEVEL_PAD) * level.cell_px
    half_x, half_y = shape.box_columns * level.cell_px / 2, shape.box_rows * level.cell_px / 2
    return np.stack([x - half_x, y - half_y, x + half_x, y + half_y], axis=-1).reshape(-1, 4)


def window_values(level: Level, shape: Shape, weights: NDArray[np.float32]) -> NDArray[np.float32]:
    """The products of all windows of a level with weights (rows, columns, CHANNELS), row by row."""
    return row_values(level, shape, weights).sum(axis=1)


def row_values(level: Level, shape: Shape, weights: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same before their rows are added: (windows, rows of a window)."""
    rows, columns = level.cells.shape[0] - shape.rows + 1, level.cells.shape[1] - shape.columns + 1
    if rows < 1 or columns < 1:
        return np.empty((0, shape.rows), np.float32)
    flat = level.cells.reshape(level.cells.shape[0], -1).astype(np.float32)
    runs = sliding_window_view(flat, shape.columns * CHANNELS, axis=1)[:, ::CHANNELS]
    products = runs.reshape(-1, shape.columns * CHANNELS) @ weights.reshape(shape.rows, -1).T
    products = products.reshape(level.cells.shape[0], columns, shape.rows)
    parts = [products[k : k + rows, :, k] for k in range(shape.rows)]
    return np.stack(parts, axis=-1).reshape(-1, shape.rows)


def window_features(
    level: Level, shape: Shape, chosen: Sequence[int] | NDArray[np.int64]
) -> NDArray[np.uint8]:
    """The cells (n, rows, columns, CHANNELS) of chosen windows, by their places row by row."""
    columns = level.cells.shape[1] - shape.columns + 1
    views = sliding_window_view(level.cells, (shape.rows, shape.columns), axis=(0, 1))
    row, column = np.divmod(np.asarray(chosen, dtype=np.int64), max(columns, 1))
    return np.ascontiguousarray(views[row, column].transpose(0, 2, 3, 1))


def halved(cells: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Means of 2x2 cells (..., rows // 2, columns // 2, CHANNELS), rounded as the scanner does."""
    rows, columns = cells.shape[-3] // BLOCK * BLOCK, cells.shape[-2] // BLOCK * BLOCK
    whole = cells[..., :rows, :columns, :].astype(np.uint16)
    across = (whole[..., ::2, :] + whole[..., 1::2, :]) // 2
    return ((across[..., ::2, :, :] + across[..., 1::2, :, :]) // 2).astype(np.uint8)


def blocks(features: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Sums of blocks of cells (n, rows // BLOCK, columns // BLOCK, CHANNELS), that edges are read from."""
    n, rows, columns, _ = features.shape
    rows, columns = rows // BLOCK, columns // BLOCK
    whole = features[:, : rows * BLOCK, : columns * BLOCK].astype(np.int32)
    return whole.reshape(n, rows, BLOCK, columns, BLOCK, CHANNELS).sum(axis=(2, 4))


@dataclass(frozen=True)
class Change:
    """How a crop differs from its box: moved and scaled by shares of it, and mirrored."""

    x: float = 0.0
    y: float = 0.0
    scale: float = 1.0
    is_mirrored: bool = False


def cropped(
    scanner: Scanner, frame: NDArray[np.uint8], box: Floats, shape: Shape, change: Change
) -> NDArray[np.uint8]:
    """The cells of a window that frames a box of a picture just so, with one more row above and column left:
    (1 + rows, 1 + columns, CHANNELS). Beyond the picture it goes on as at its edge.
    """
    left, top, right, bottom = box
    width, height = right - left, bottom - top
    side = change.scale * (width * height / (shape.box_columns * shape.box_rows)) ** 0.5  # of a cell, px
    x, y = (left + right) / 2 + change.x * width, (top + bottom) / 2 + change.y * height
    columns, rows = shape.columns + 2 * _AROUND, shape.rows + 2 * _AROUND
    columns += columns % 2  # a frame is a multiple of two cells wide
    first_x = x - side * (shape.columns / 2 + _AROUND)
    first_y = y - side * (shape.rows / 2 + _AROUND)
    last_x, last_y = first_x + side * columns, first_y + side * rows
    beyond = 2 + int(max(0.0, -first_x, -first_y, last_x - frame.shape[1], last_y - frame.shape[0]))
    padded = np.pad(frame, ((beyond, beyond), (beyond, beyond), (0, 0)), "edge")
    filter_ = Image.Resampling.BOX if side > CELL_PX else Image.Resampling.BILINEAR
    cut = (first_x + beyond, first_y + beyond, last_x + beyond, last_y + beyond)
    small = np.asarray(Image.fromarray(padded).resize((columns * CELL_PX, rows * CELL_PX), filter_, box=cut))
    at = _AROUND
    if change.is_mirrored:
        small, at = small[:, ::-1], columns - shape.columns - _AROUND
    cells = scanner.first_level(np.ascontiguousarray(small))
    row, column = LEVEL_PAD + _AROUND, LEVEL_PAD + at
    return cells[row - 1 : row + shape.rows, column - 1 : column + shape.columns].copy()
