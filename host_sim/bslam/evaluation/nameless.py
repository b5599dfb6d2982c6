"""A map and the true beacons, of which nobody says which is which: laid over each other."""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.align import Points, Rigid, fit, fit_rigid

_FIRST: Final = 12  # beacons of the map that are tried in pairs
_SAME_LENGTH_M: Final = 0.3  # two beacons may be this much farther apart in one map than in the other
_FAR_M: Final = 0.5  # one farther from every true beacon counts as this far away
_ROUNDS: Final = 10


def lay_over(kind: str, mapped_m: Points, true_m: Points, start: Rigid | None = None) -> Rigid:
    """The transform of a kind (`align.fit`) by which most beacons of a map meet true ones.

    start: nearly right; None: any pair of the map may be any pair of true beacons, and the best such fit is
    taken. Then as many times as it takes: each beacon's nearest, and the fit to these.
    """
    if kind == "none" or len(mapped_m) == 0 or len(true_m) == 0:
        return Rigid()
    best = _best_start(mapped_m, true_m) if start is None else start
    for _ in range(_ROUNDS):
        nearest = nearest_of(best.points(mapped_m), true_m)
        near = np.hypot(*(best.points(mapped_m) - true_m[nearest]).T) < _FAR_M
        if near.sum() < 2:
            break
        best = fit(kind, mapped_m[near], true_m[nearest[near]])
    return best


def nearest_of(places_m: Points, true_m: Points) -> NDArray[np.intp]:
    """Index of the true beacon nearest to each place, (n,); there is at least one."""
    nearest: NDArray[np.intp] = _distances_m(places_m, true_m).argmin(axis=1)
    return nearest


def _distances_m(places_m: Points, true_m: Points) -> NDArray[np.float64]:
    return np.hypot(*(places_m[:, None] - true_m[None]).transpose(2, 0, 1))


def _best_start(mapped_m: Points, true_m: Points) -> Rigid:
    apart_m = _distances_m(true_m, true_m)
    best, lowest = fit_rigid(mapped_m[:1], true_m[:1]), np.inf
    for i, j in itertools.combinations(range(min(len(mapped_m), _FIRST)), 2):
        length_m = float(np.hypot(*(mapped_m[i] - mapped_m[j])))
        for a, b in np.argwhere((np.abs(apart_m - length_m) < _SAME_LENGTH_M) & (apart_m > 0.0)).tolist():
            move = fit_rigid(mapped_m[[i, j]], true_m[[a, b]])
            off_m = _distances_m(move.points(mapped_m[:_FIRST]), true_m).min(axis=1)
            cost = float(np.sum(np.minimum(off_m, _FAR_M) ** 2))
            if cost < lowest:
                best, lowest = move, cost
    return best
