"""The coarse SVM that decides where a window's own one looks: over means of 2x2 cells, at a quarter of them.

It is to lose hardly any thing, not to be right: its floors are set on examples that it was not trained on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.core.scanner import Level
from bslam.detect.linear import fit_linear, quantised
from bslam.detect.windows import Shape, halved, window_features, window_values
from bslam.errors import BslamError
from bslam.scannerfile import BLOCK, CHANNELS

_ROUNDS: Final = 2
_RANDOM: Final = 6  # windows of each picture and size, to begin with
_HARD: Final = -0.5
_HARD_MOST: Final = 30  # of a picture and round
_PARTS: Final = 4
_LOST: Final = 0.005  # of the examples that are left, by each row's floor

Cells = NDArray[np.uint8]


@dataclass(frozen=True)
class Ground:
    """A picture's means of 2x2 cells at one size, and at which places a window shows something else."""

    level: Level
    free: NDArray[np.bool_]  # (places,), row by row

    @staticmethod
    def of(level: Level, shape: Shape, places: NDArray[np.int64]) -> Ground:
        """places: of windows of whole cells, row by row."""
        rows, columns = (
            max(0, side - its + 1)
            for side, its in zip(level.cells.shape, (shape.rows, shape.columns), strict=False)
        )
        free = np.zeros((rows, columns), bool)
        free.flat[places] = True
        return Ground(Level(halved(level.cells), BLOCK * level.cell_px), free[::BLOCK, ::BLOCK].ravel())


@dataclass(frozen=True)
class Coarse:
    """As bslam_window_t has it."""

    weights: NDArray[np.int8]  # (rows // 2, columns // 2, CHANNELS)
    bias: int
    order: NDArray[np.uint8]  # (rows // 2,)
    floors: NDArray[np.int32]  # (rows // 2,)


def fit_coarse(
    examples: Cells,
    pictures: NDArray[np.int64],
    grounds: Sequence[Ground],
    shape: Shape,
    rng: np.random.Generator,
) -> Coarse:
    """examples: (n, 1 + rows, 1 + columns, CHANNELS), as `cropped` gives them; pictures: (n,) of each."""
    its = shape.halved
    starts = [(down, across) for down in range(BLOCK) for across in range(BLOCK)]
    moved = np.concatenate(
        [halved(examples[:, y : y + shape.rows, x : x + shape.columns]) for y, x in starts]
    )
    numbers = np.unique(pictures, return_inverse=True)[1]
    parts = np.tile(numbers * _PARTS // (numbers.max() + 1), len(starts))  # neighbours are alike
    negatives = usual = _random(grounds, its, rng)
    for _ in range(_ROUNDS):
        weights, bias = fit_linear(moved, negatives)
        negatives = np.unique(np.concatenate([negatives, _hard(grounds, its, weights, bias)]), axis=0)
    weights, bias = fit_linear(moved, negatives)
    whole, whole_bias, scale = quantised(weights, bias)
    left, biases = _left_out(moved, parts, negatives)
    order, floors = _order(left, biases, _row_sums(usual, weights), bias)
    return Coarse(whole, whole_bias, order, np.floor(floors / scale).astype(np.int32))


def _random(grounds: Sequence[Ground], its: Shape, rng: np.random.Generator) -> Cells:
    found = []
    for one in grounds:
        places = np.flatnonzero(one.free)
        if len(places):
            found.append(
                window_features(one.level, its, rng.choice(places, min(len(places), _RANDOM), replace=False))
            )
    if not found:
        raise BslamError(
            f"no place in {len(grounds)} sizes of pictures is free of the thing; allowed: add pictures"
        )
    return np.concatenate(found)


def _hard(grounds: Sequence[Ground], its: Shape, weights: NDArray[np.float32], bias: float) -> Cells:
    found = [np.empty((0, its.rows, its.columns, CHANNELS), np.uint8)]
    for one in grounds:
        if one.free.any():
            values = np.where(one.free, window_values(one.level, its, weights) + bias, -np.inf)
            best = np.argsort(-values, kind="stable")[:_HARD_MOST]
            found.append(window_features(one.level, its, best[values[best] > _HARD]))
    return np.concatenate(found)


def _left_out(
    moved: Cells, parts: NDArray[np.int64], negatives: Cells
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What rows add up to in examples that were left out (n, rows), and the bias there (n,)."""
    sums, biases = np.zeros(moved.shape[:2]), np.zeros(len(moved))
    for part in np.unique(parts):
        its = parts == part
        rest = moved[~its] if not its.all() else moved  # a thing in one picture is known by it
        weights, biases[its] = fit_linear(rest, negatives)
        sums[its] = _row_sums(moved[its], weights)
    return sums, biases


def _order(
    left: NDArray[np.float64], biases: NDArray[np.float64], usual: NDArray[np.float64], bias: float
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """In which order rows are added, and the floor after each: every time the row that gives up most."""
    rows = list(range(left.shape[1]))
    sums, others = biases.copy(), np.full(len(usual), bias)
    order, floors = [], []
    while rows:
        chosen = []
        for row in rows:
            floor = float(np.quantile(sums + left[:, row], _LOST))
            chosen.append((int(np.count_nonzero(others + usual[:, row] >= floor)), row, floor))
        _, row, floor = min(chosen)
        kept = sums + left[:, row] >= floor
        sums, left, biases = (sums + left[:, row])[kept], left[kept], biases[kept]
        stays = others + usual[:, row] >= floor
        others, usual = (others + usual[:, row])[stays], usual[stays]
        rows.remove(row)
        order.append(row)
        floors.append(floor)
    return np.array(order, np.uint8), np.array(floors)


def _row_sums(cells: Cells, weights: NDArray[np.float32]) -> NDArray[np.float64]:
    """(n, rows): products of cells and weights, added within rows."""
    return np.einsum("nrck,rck->nr", cells.astype(np.float64), weights.astype(np.float64), optimize=True)
