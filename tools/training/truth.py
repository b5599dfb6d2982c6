"""What a box in a rendered picture is: a beacon of a kind, nothing, or something that does not count.

An object counts if it is whole in the frame, at least 150 px of it are visible, it is seen at less than 60
degrees from its front, and at most a tenth of it is hidden. A box is of an object if they overlap by a half
(intersection over union). Boxes on beacons that do not count are neither right nor wrong.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

VISIBLE_PX_MIN = 150
SLANT_RAD_MAX = np.radians(60.0)
HIDDEN_MAX = 0.1
OVERLAP_MIN = 0.5
IGNORED_SHARE = 0.5
"""A box with this share of it on a beacon that does not count is not counted either."""

EDGE_PX = 1.5
"""A box that comes this near to the frame's edge may go on outside."""

Boxes = NDArray[np.floating]

NOTHING = -1
IGNORED = -2


def counts(seen: NDArray[np.void]) -> NDArray[np.bool_]:
    """Which of the beacons in view (render_set.SEEN) count."""
    hidden = 1.0 - seen["visible_px"] / np.maximum(seen["own_px"], 1)
    return (
        (seen["visible_px"] >= VISIBLE_PX_MIN)
        & ~seen["cut"]
        & (seen["slant_rad"] < SLANT_RAD_MAX)
        & (hidden <= HIDDEN_MAX)
    )


def teaches(seen: NDArray[np.void], width_px: int) -> NDArray[np.bool_]:
    """Which of them a detector learns from: also those that the frame cuts above or below, which still have
    a direction, and that a robot near a wall sees most of."""
    left, right = seen["box"][:, 0], seen["box"][:, 2]
    upright = (left > EDGE_PX) & (right < width_px - 1 - EDGE_PX)
    whole = seen.copy()
    whole["cut"] &= ~upright
    return counts(whole)


def intersections(boxes: Boxes, others: Boxes) -> NDArray[np.float64]:
    """Areas (n, m) that boxes (n, 4) share with others (m, 4)."""
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    return np.clip(high - low, 0.0, None).prod(axis=2).astype(np.float64)


def areas(boxes: Boxes) -> NDArray[np.float64]:
    """Of boxes (n, 4)."""
    return (boxes[:, 2:] - boxes[:, :2]).prod(axis=1).astype(np.float64)


def overlaps(boxes: Boxes, others: Boxes) -> NDArray[np.float64]:
    """Intersection over union (n, m)."""
    both = intersections(boxes, others)
    return both / np.maximum(areas(boxes)[:, None] + areas(others)[None, :] - both, 1e-9)


def owners(
    boxes: Boxes, seen: NDArray[np.void], good: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """For each box (n, 4) of a picture the row of `seen` it is of, NOTHING or IGNORED; and its best overlap
    with an object of those that are `good`."""
    if len(boxes) == 0:
        return np.zeros(0, np.int64), np.zeros(0)
    if len(seen) == 0:
        return np.full(len(boxes), NOTHING), np.zeros(len(boxes))
    overlap = overlaps(boxes, seen["box"])
    share = intersections(boxes, seen["box"]) / np.maximum(areas(boxes)[:, None], 1e-9)
    countable = np.where(good[None, :], overlap, 0.0)
    best = countable.argmax(axis=1)
    value = countable.max(axis=1)
    ignored = ((share > IGNORED_SHARE) & ~good[None, :]).any(axis=1)
    owner = np.where(value >= OVERLAP_MIN, best, np.where(ignored, IGNORED, NOTHING))
    return owner, value
