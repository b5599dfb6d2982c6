"""One window's linear SVM, from pictures: examples, hard negatives over rounds, int8 weights, edges.

scikit-learn fits; the cells come from the scanner in C, so that what was trained is what runs.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.core.scanner import Level, Scanner
from bslam.detect.boxes import Floats, overlaps
from bslam.detect.clutter import clutter
from bslam.detect.coarse import Coarse, Ground, fit_coarse
from bslam.detect.examples import Example
from bslam.detect.linear import fit_linear, quantised
from bslam.detect.windows import (
    Change,
    Shape,
    blocks,
    cropped,
    shape_for,
    window_boxes,
    window_features,
    window_values,
)
from bslam.scannerfile import BLOCK, CHANNELS, Window

_CHANGES: Final = 8  # of an example
_MOVED: Final = 0.05
_SCALED: Final = 0.09
_ROUNDS: Final = 3
_CLUTTER: Final = 40  # pictures made of what is around
_RANDOM: Final = 6  # windows of each picture and size, to begin with
_HARD: Final = -1.0  # score from which on a window that shows something else is an example
_NEGATIVE_OVERLAP: Final = 0.3  # at most, with any box of the class
_EDGE_OVERLAP: Final = 0.55  # at least, of windows that edges are learned from: as near as those found
_EDGE_WINDOWS: Final = 40  # a picture and level
_EDGE_RIDGE: Final = 200.0
_EDGE_UNIT: Final = 512.0
_ASPECT_SD: Final = 0.35  # of the logarithm: beyond, one window is not for all
_ASPECTS_MAX: Final = 3
_BOXES_A_SHAPE: Final = 6
_NEGATIVES_MAX: Final = 16_000


@dataclass(frozen=True)
class Seen:
    """An example and its cells of all sizes."""

    example: Example
    levels: tuple[Level, ...]


def look_at(examples: Sequence[Example]) -> list[Seen]:
    """The cells of all pictures."""
    scanner = Scanner()
    return [Seen(one, tuple(scanner.levels(one.frame))) for one in examples]


def shapes_of(boxes: Floats) -> list[tuple[Shape, NDArray[np.bool_]]]:
    """Windows for boxes (n, 4) of one class, and which boxes each is for: as few as their aspects allow."""
    aspects = np.log((boxes[:, 2] - boxes[:, 0]) / (boxes[:, 3] - boxes[:, 1]))
    count = 1
    groups = np.zeros(len(aspects), int)
    while _spread(aspects, groups) > _ASPECT_SD and count < min(_ASPECTS_MAX, len(aspects) // _BOXES_A_SHAPE):
        count += 1
        groups = _clusters(aspects, count)
    found = []
    for group in range(count):
        middle = float(np.median(aspects[groups == group]))
        found.append((shape_for(np.exp(middle)), (groups == group) | (np.abs(aspects - middle) < _ASPECT_SD)))
    return found


def _clusters(aspects: Floats, count: int) -> NDArray[np.int64]:
    from sklearn.cluster import KMeans

    return KMeans(count, n_init=5, random_state=0).fit(aspects[:, None]).labels_.astype(np.int64)


def _spread(aspects: Floats, groups: NDArray[np.int64]) -> float:
    return max(float(aspects[groups == group].std()) for group in np.unique(groups))


def fit_windows(kind: int, name: str, seen: Sequence[Seen], rng: np.random.Generator) -> list[Window]:
    """The windows of a class. BslamError if scikit-learn is missing."""
    seen = [*seen, *look_at(clutter([one.example for one in seen], name, _CLUTTER, rng))]
    where = [(i, box) for i, one in enumerate(seen) for box in one.example.of(name)]
    boxes = np.array([box for _, box in where])
    return [
        _Fit(kind, name, shape, seen, rng).window(
            [pair for pair, its in zip(where, chosen, strict=True) if its]
        )
        for shape, chosen in shapes_of(boxes)
    ]


class _Fit:
    """The work on one window."""

    def __init__(
        self, kind: int, name: str, shape: Shape, seen: Sequence[Seen], rng: np.random.Generator
    ) -> None:
        self._kind, self._name, self._shape, self._seen, self._rng = kind, name, shape, seen, rng
        self._others = [[(level, self._places(one, level)) for level in one.levels] for one in seen]

    def window(self, where: Sequence[tuple[int, Floats]]) -> Window:
        """From which boxes of which pictures."""
        larger = self._examples(where)
        examples = larger[:, 1:, 1:]
        negatives = self._random_windows()
        for _ in range(_ROUNDS):
            weights, bias = fit_linear(examples, negatives)
            negatives = np.unique(np.concatenate([negatives, self._hard_windows(weights, bias)]), axis=0)
        weights, bias = fit_linear(examples, negatives)
        pictures = np.repeat([index for index, _ in where], _CHANGES)
        grounds = [Ground.of(level, self._shape, places) for level, places in itertools.chain(*self._others)]
        return self._quantised(weights, bias, fit_coarse(larger, pictures, grounds, self._shape, self._rng))

    def _examples(self, where: Sequence[tuple[int, Floats]]) -> NDArray[np.uint8]:
        scanner = Scanner()
        return np.array(
            [
                cropped(scanner, self._seen[index].example.frame, box, self._shape, self._change(number))
                for index, box in where
                for number in range(_CHANGES)
            ]
        )

    def _change(self, number: int) -> Change:
        if number == 0:
            return Change()
        x, y = self._rng.uniform(-_MOVED, _MOVED, 2)
        return Change(x, y, float(np.exp(self._rng.uniform(-_SCALED, _SCALED))), number % 2 == 1)

    def _places(self, one: Seen, level: Level) -> NDArray[np.int64]:
        """Windows that show something else."""
        boxes, its = window_boxes(level, self._shape), one.example.of(self._name)
        return np.flatnonzero(overlaps(boxes, its).max(axis=1, initial=0.0) < _NEGATIVE_OVERLAP)

    def _random_windows(self) -> NDArray[np.uint8]:
        found = [self._none()]
        for level, places in itertools.chain(*self._others):
            if len(places):
                chosen = self._rng.choice(places, min(len(places), _RANDOM), replace=False)
                found.append(window_features(level, self._shape, chosen))
        return np.concatenate(found)

    def _hard_windows(self, weights: NDArray[np.float32], bias: float) -> NDArray[np.uint8]:
        most = max(8, min(60, _NEGATIVES_MAX // len(self._seen) // _ROUNDS))
        found = [self._none()]
        for others in self._others:
            scored: list[tuple[float, int, int]] = []
            for number, (level, places) in enumerate(others):
                values = window_values(level, self._shape, weights)[places] + bias
                best = np.argsort(-values, kind="stable")[:most]
                scored += [(-float(values[i]), number, int(places[i])) for i in best if values[i] > _HARD]
            for _, number, place in sorted(scored)[:most]:
                found.append(window_features(others[number][0], self._shape, [place]))
        return np.concatenate(found)

    def _none(self) -> NDArray[np.uint8]:
        return np.empty((0, self._shape.rows, self._shape.columns, CHANNELS), np.uint8)

    def _quantised(self, weights: NDArray[np.float32], bias: float, coarse: Coarse) -> Window:
        whole, whole_bias, scale = quantised(weights, bias)
        edges, edge_scale, edge_bias = self._edges()
        return Window(
            kind=self._kind,
            box_columns=float(np.float32(self._shape.box_columns)),
            box_rows=float(np.float32(self._shape.box_rows)),
            weights=whole,
            scale=scale,
            bias=whole_bias,
            coarse=coarse.weights,
            coarse_bias=coarse.bias,
            order=coarse.order,
            floors=coarse.floors,
            edges=edges,
            edge_scale=edge_scale,
            edge_bias=edge_bias,
        )

    def _edges(self) -> tuple[NDArray[np.int8], NDArray[np.float32], NDArray[np.float32]]:
        """Ridge regression of where the box's edges are, from windows near labelled ones."""
        features, targets = [], []
        for one in self._seen:
            its = one.example.of(self._name)
            for level in one.levels if len(its) else ():
                boxes = window_boxes(level, self._shape)
                shared = overlaps(boxes, its)
                near = np.flatnonzero(shared.max(axis=1, initial=0.0) > _EDGE_OVERLAP)
                if len(near) > _EDGE_WINDOWS:
                    near = self._rng.choice(near, _EDGE_WINDOWS, replace=False)
                if len(near):
                    features.append(blocks(window_features(level, self._shape, near)))
                    targets.append(_edge_shares(boxes[near], its[shared[near].argmax(axis=1)]))
        if not features:  # none fits: edges are the window's
            none = np.zeros((4, self._shape.rows // BLOCK, self._shape.columns // BLOCK, CHANNELS), np.int8)
            return none, np.zeros(4, np.float32), np.zeros(4, np.float32)
        x = np.concatenate(features).astype(np.float64) / _EDGE_UNIT
        y = np.concatenate(targets)
        shape = x.shape[1:]
        x = x.reshape(len(x), -1)
        mean_x, mean_y = x.mean(axis=0), y.mean(axis=0)
        gram = (x - mean_x).T @ (x - mean_x) + _EDGE_RIDGE * np.eye(x.shape[1])
        slopes = np.linalg.solve(gram, (x - mean_x).T @ (y - mean_y)).T / _EDGE_UNIT  # (4, features)
        scale = np.maximum(np.abs(slopes).max(axis=1) / 127.0, 1e-12)
        whole = np.rint(slopes / scale[:, None]).astype(np.int8)
        bias = mean_y - scale * (whole @ (mean_x * _EDGE_UNIT))
        return whole.reshape(4, *shape), scale.astype(np.float32), bias.astype(np.float32)


def _edge_shares(boxes: Floats, labelled: Floats) -> Floats:
    """How far labelled boxes' edges are from those of boxes, of their widths and heights."""
    sides = boxes[:, 2:] - boxes[:, :2]
    return (labelled - boxes) / np.concatenate([sides, sides], axis=1)
