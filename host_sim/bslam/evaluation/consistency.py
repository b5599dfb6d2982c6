"""NEES: are the errors as large as the filter says? In the coordinates in which it keeps its error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.align import wrap_angle

POSE_95: Final = 7.815  # chi-square, 3 degrees of freedom: 95 % of a consistent filter's NEES lie below
BELOW_95: Final = f"below {POSE_95:g}"  # in tables
RUNS_FOR_INTERVAL: Final = 5
SINGULAR: Final = 1e9  # stands for the infinite NEES of a covariance that is not positive definite


def error_standard(estimate: NDArray[np.float64], truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Plain difference truth - estimate; all (n, 3) x_m, y_m, theta_rad."""
    error = truth - estimate
    error[:, 2] = wrap_angle(error[:, 2])
    return error


def error_invariant(estimate: NDArray[np.float64], truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Right-invariant error xi, (n, 3): x, y, theta parts of the motion that takes the estimate to the truth.

    theta_true = theta_est + xi_theta,  p_true = R(xi_theta) p_est + V(xi_theta) xi_p, with
    V(a) = [[sin a, -(1 - cos a)], [1 - cos a, sin a]] / a, the integral of R along the motion.
    """
    angle = wrap_angle(truth[:, 2] - estimate[:, 2])
    c, s = np.cos(angle), np.sin(angle)
    x, y = estimate[:, 0], estimate[:, 1]
    dx, dy = truth[:, 0] - (c * x - s * y), truth[:, 1] - (s * x + c * y)
    half = 0.5 * angle
    # V^-1 = [[h cot h, h], [-h, h cot h]] with h = a / 2; h cot h -> 1 for small angles.
    small = np.abs(half) < 1e-6
    h_cot_h = np.where(small, 1.0, half / np.tan(np.where(small, 1.0, half)))
    return np.column_stack([h_cot_h * dx + half * dy, h_cot_h * dy - half * dx, angle])


def covariance_invariant(
    estimate: NDArray[np.float64], covariance: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Covariance of xi from that of the plain difference d, (n, 3, 3): d = T xi to first order.

    dp = xi_p + J p_est xi_theta, J = [[0, -1], [1, 0]], so T^-1 subtracts J p_est times the heading part.
    """
    t_inverse = np.tile(np.eye(3), (len(estimate), 1, 1))
    t_inverse[:, 0, 2] = estimate[:, 1]
    t_inverse[:, 1, 2] = -estimate[:, 0]
    return t_inverse @ covariance @ t_inverse.transpose(0, 2, 1)


def nees(
    estimate: NDArray[np.float64],
    truth: NDArray[np.float64],
    covariance: NDArray[np.float64],
    filter_name: str,
) -> NDArray[np.float64]:
    """Normalised estimation error squared of the pose, (n,); 3 on average if the covariance is right.

    estimate, truth (n, 3) in the map frame, covariance (n, 3, 3); `filter_name` "standard" or "invariant"
    says in which coordinates the filter keeps its error. SINGULAR where the covariance is not positive
    definite.
    """
    if filter_name == "standard":
        error = error_standard(estimate, truth)
    else:
        error = error_invariant(estimate, truth)
        covariance = covariance_invariant(estimate, covariance)
    definite = _is_positive_definite(covariance)
    result = np.full(len(estimate), SINGULAR)
    solved = np.linalg.solve(covariance[definite], error[definite][:, :, None])[:, :, 0]
    result[definite] = np.sum(error[definite] * solved, axis=1)
    return np.minimum(result, SINGULAR)


def _is_positive_definite(matrix: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n, 3, 3) -> (n,), by the three leading minors."""
    minor2 = matrix[:, 0, 0] * matrix[:, 1, 1] - matrix[:, 0, 1] * matrix[:, 1, 0]
    return (matrix[:, 0, 0] > 0.0) & (minor2 > 0.0) & (np.linalg.det(matrix) > 0.0)


def nees_band_95(runs: int, dof: int = 3) -> tuple[float, float]:
    """Band that holds 95 % of a consistent filter's NEES when it is averaged over `runs` runs.

    Chi-square quantiles of dof x runs degrees of freedom over `runs`, by Wilson and Hilferty's cube root:
    within 3 % from two runs on; the lower bound of one run comes out as 0.18 for 0.22.
    """
    k, z = float(dof * runs), 1.959964
    spread = float(np.sqrt(2.0 / (9.0 * k)))
    low, high = (k * (1.0 - 2.0 / (9.0 * k) + sign * z * spread) ** 3 / runs for sign in (-1.0, 1.0))
    return low, high


def half_interval_95(values: Sequence[float]) -> float | None:
    """Half of the 95 % interval of the mean of `values`, by their scatter and Student's t.

    None below RUNS_FOR_INTERVAL: the scatter of so few says little (of two values the interval would be nine
    times as wide as they lie apart). The quantile is Cornish and Fisher's expansion about the normal, within
    0.5 %.
    """
    if len(values) < RUNS_FOR_INTERVAL:
        return None
    z, dof = 1.959964, len(values) - 1
    first, second = (z**3 + z) / 4.0, (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    third = (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0
    quantile = z + first / dof + second / dof**2 + third / dof**3
    return float(quantile * np.std(values, ddof=1) / np.sqrt(len(values)))


def share_interval_95(count: int, total: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a binomial share, of `count` of `total`."""
    z2 = 1.959964**2
    middle = (count + 0.5 * z2) / (total + z2)
    half = float(np.sqrt(z2 * (count * (total - count) / total + 0.25 * z2))) / (total + z2)
    return max(0.0, middle - half), min(1.0, middle + half)
