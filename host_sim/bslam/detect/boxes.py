"""Boxes: how they overlap, and how good those that were found are.

Boxes are arrays (n, 4) of left, top, right, bottom in pixels, edges from 0 to a picture's sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def overlaps(one: Floats, other: Floats) -> Floats:
    """Intersection over union (n, m) of boxes (n, 4) and (m, 4)."""
    low = np.maximum(one[:, None, :2], other[None, :, :2])
    high = np.minimum(one[:, None, 2:], other[None, :, 2:])
    both = np.prod(np.clip(high - low, 0.0, None), axis=2)
    return both / np.maximum(_areas(one)[:, None] + _areas(other)[None] - both, 1e-9)


def _areas(boxes: Floats) -> Floats:
    return np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)


@dataclass(frozen=True)
class Found:
    """What was found of one class in one picture, and what is there."""

    boxes: Floats  # (n, 4)
    scores: Floats  # (n,)
    labelled: Floats  # (m, 4)


@dataclass(frozen=True)
class Curve:
    """Precision and recall as the threshold falls, over many pictures.

    hits: which detections are on a labelled thing, surest first; scores: theirs.
    """

    scores: Floats
    hits: NDArray[np.bool_]
    labelled: int
    pictures: int

    @property
    def recall(self) -> Floats:
        return np.cumsum(self.hits) / max(self.labelled, 1)

    @property
    def precision(self) -> Floats:
        return np.cumsum(self.hits) / np.maximum(np.arange(1, len(self.hits) + 1), 1)

    @property
    def average_precision(self) -> float:
        """Area under the curve, of the best precision at each recall or beyond."""
        if not len(self.hits):
            return 0.0
        best = np.maximum.accumulate(self.precision[::-1])[::-1]
        return float(np.sum(np.diff(self.recall, prepend=0.0) * best))

    def recall_at(self, false_a_picture: float) -> float:
        """Largest recall with at most so many false detections a picture."""
        allowed = np.cumsum(~self.hits) <= false_a_picture * self.pictures
        return float(self.recall[allowed].max(initial=0.0))

    def threshold_at(self, false_a_picture: float) -> float:
        """The score for the most hits with at most so many false detections a picture: halfway between the
        last of these hits and what comes below; infinite where there is none.
        """
        allowed = np.cumsum(~self.hits) <= false_a_picture * self.pictures
        last = np.flatnonzero(allowed & self.hits)
        if not len(last):
            return float("inf")
        return float(self.scores[last[-1] : last[-1] + 2].mean())


def curve(found: Sequence[Found], overlap: float) -> Curve:
    """A detection is a hit if it overlaps a labelled box by so much that no surer one of it took."""
    scores, hits = [np.empty(0)], [np.empty(0, bool)]
    for one in found:
        order = np.argsort(-one.scores, kind="stable")
        scores.append(one.scores[order])
        hits.append(_hits(one.boxes[order], one.labelled, overlap))
    all_scores, all_hits = np.concatenate(scores), np.concatenate(hits)
    order = np.argsort(-all_scores, kind="stable")
    labelled = sum(len(one.labelled) for one in found)
    return Curve(all_scores[order], all_hits[order], labelled, len(found))


def _hits(boxes: Floats, labelled: Floats, overlap: float) -> NDArray[np.bool_]:
    hits = np.zeros(len(boxes), bool)
    free = np.ones(len(labelled), bool)
    shared = overlaps(boxes, labelled)
    for i in range(len(boxes)):
        its = np.where(free, shared[i], -1.0)
        if len(its) and its.max() >= overlap:
            free[its.argmax()] = False
            hits[i] = True
    return hits
