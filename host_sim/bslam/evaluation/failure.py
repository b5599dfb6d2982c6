"""Whether a run failed, and whether its map is the true one, beacon by beacon."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

NEAR_M: Final = 0.5  # a mapped beacon stands for a true one within this
OFF_M: Final = 1.0
OFF_RATIO: Final = 3.0  # times the error of known association at that moment
OFF_S: Final = 5.0
NEES_MAX: Final = 20.0  # mean over the last 50 s

Array = NDArray[np.float64]


def map_one_to_one(mapped_m: Array, true_m: Array, needed: NDArray[np.bool_]) -> dict[str, int]:
    """How many confirmed beacons (b, 2) are matched one to one with true ones (t, 2) within NEAR_M.

    needed (t,): true beacons that were sighted often enough to be missed. doubled: left over by a true one.
    """
    near = np.hypot(*(true_m[:, None] - mapped_m[None]).transpose(2, 0, 1)) <= NEAR_M  # (t, b)
    true_of = _matching(near, np.argsort(~needed, kind="stable").tolist())
    left = np.setdiff1d(np.arange(len(mapped_m)), list(true_of))
    doubled = int(near[:, left].any(axis=0).sum())
    missing = np.flatnonzero(needed & ~np.isin(np.arange(len(true_m)), list(true_of.values())))
    return {
        "matched": len(true_of),
        "doubled": doubled,
        "missing": len(missing),
        "false": len(left) - doubled,
    }


def _matching(near: NDArray[np.bool_], order: list[int]) -> dict[int, int]:
    """The row of each matched column: as many pairs as there can be, earlier rows first (Kuhn's paths)."""
    row_of: dict[int, int] = {}

    def place(row: int, tried: set[int]) -> bool:
        for column in np.flatnonzero(near[row]).tolist():
            if column not in tried:
                tried.add(column)
                if column not in row_of or place(row_of[column], tried):
                    row_of[column] = row
                    return True
        return False

    for row in order:
        place(row, set())
    return row_of


def is_exact(counts: dict[str, int]) -> bool:
    """Whether a map is the true one: nothing doubled, missing or false."""
    return not (counts["doubled"] or counts["missing"] or counts["false"])


def was_off(time_s: Array, error_m: Array, known_error_m: Array | None = None) -> bool:
    """Whether the position was off for OFF_S on end; all (n,), NaN where the truth is not known.

    Off: above OFF_M, and above OFF_RATIO times the error of the run with known association, if there is one.
    """
    limit_m = np.full(len(error_m), OFF_M)
    if known_error_m is not None:
        limit_m = np.fmax(limit_m, OFF_RATIO * known_error_m)
    scored = np.isfinite(error_m)
    off, time_s = error_m[scored] > limit_m[scored], time_s[scored]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], off, [False]]).astype(np.int8)))
    return any(time_s[end - 1] - time_s[start] >= OFF_S for start, end in edges.reshape(-1, 2))
