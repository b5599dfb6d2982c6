"""Relative pose error: what goes wrong over each metre of path, whatever frame the estimate stands in."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.align import wrap_angle

DELTA_M: Final = 1.0  # true path between the two poses of a pair


class _Motions(NamedTuple):
    """From each pose to the next, (n - 1,) each."""

    length_m: NDArray[np.float64]
    way_m: NDArray[np.complex128]  # ahead + i left, as the robot sees it; NaN without heading
    turn_rad: NDArray[np.float64]


def relative_pose_error(estimate: NDArray[np.float64], truth: NDArray[np.float64]) -> dict[str, float]:
    """RMSE over consecutive pairs, `DELTA_M` of true path apart; poses (n, 3) each, NaN where none is known.

    These are evo's pairs and figures (`evo_rpe tum TRUTH ESTIMATE --delta 1 --delta_unit m
    --pairs_from_reference`): its trans_part, the difference of the motions that the robot itself sees; its
    angle_rad; its point_distance, the difference of their lengths, which needs no true heading. What no pair
    tells is left out.
    """
    known = np.isfinite(truth[:, 0])
    rows = _ends(truth[known])
    estimated, true = (_motions(poses[known][rows]) for poses in (estimate, truth))
    figures = {
        "translation_rmse_m": np.abs(estimated.way_m - true.way_m),
        "rotation_rmse_rad": wrap_angle(estimated.turn_rad - true.turn_rad),
        "distance_rmse_m": estimated.length_m - true.length_m,
    }
    return {name: _rms(errors) for name, errors in figures.items() if np.isfinite(errors).any()}


def _ends(truth: NDArray[np.float64]) -> list[int]:
    """Rows at which one pair ends and the next begins."""
    steps_m = np.hypot(*np.diff(truth[:, :2], axis=0).T)
    path_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    ends = np.searchsorted(path_m, path_m + DELTA_M).tolist()
    rows = [0] if len(truth) else []
    while rows and ends[rows[-1]] < len(path_m):
        rows.append(ends[rows[-1]])
    return rows


def _motions(poses: NDArray[np.float64]) -> _Motions:
    way_m = np.diff(poses[:, 0] + 1j * poses[:, 1])
    return _Motions(np.abs(way_m), way_m * np.exp(-1j * poses[:-1, 2]), np.diff(poses[:, 2]))


def _rms(errors: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(errors[np.isfinite(errors)] ** 2)))
