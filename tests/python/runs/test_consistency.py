"""NEES in both error coordinates."""

import numpy as np
import pytest

from bslam.evaluation.align import wrap_angle
from bslam.evaluation.consistency import (
    POSE_95,
    SINGULAR,
    error_invariant,
    error_standard,
    half_interval_95,
    nees,
    nees_band_95,
)

RUNS = 20_000
# Mean of 20000 chi-square values of 3 degrees: standard error sqrt(6 / 20000) = 0.017; four of them.
MEAN_TOLERANCE = 0.07


def exp_motion(xi):
    """R(theta) and V(theta) xi_p of the group's exponential, computed the plain way: by many small steps."""
    x, y, angle = xi
    position, steps = np.zeros(2), 2000
    for k in range(steps):
        turn = angle * (k + 0.5) / steps
        c, s = np.cos(turn), np.sin(turn)
        position += np.array([c * x - s * y, s * x + c * y]) / steps
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]), position


def random_case(seed):
    rng = np.random.default_rng(seed)
    root = rng.uniform(-0.1, 0.1, (3, 3)) + np.diag([0.1, 0.15, 0.1])
    return rng, root @ root.T, rng.uniform(-5, 5, (RUNS, 3)) * [1, 1, 0.6]


def test_nees_of_a_consistent_standard_filter_is_three():
    rng, covariance, estimate = random_case(1)
    truth = estimate + rng.multivariate_normal(np.zeros(3), covariance, RUNS)
    truth[:, 2] = wrap_angle(truth[:, 2])
    values = nees(estimate, truth, np.tile(covariance, (RUNS, 1, 1)), "standard")
    assert values.mean() == pytest.approx(3.0, abs=MEAN_TOLERANCE)
    assert np.mean(values < POSE_95) == pytest.approx(0.95, abs=0.01)


def test_nees_of_a_consistent_invariant_filter_is_three():
    # Errors are drawn as xi; the filter reports the covariance of the plain difference, T P T^T.
    rng, of_xi, estimate = random_case(2)
    xi = rng.multivariate_normal(np.zeros(3), of_xi, RUNS)
    angle = xi[:, 2]
    sin_term, cos_term = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle
    c, s = np.cos(angle), np.sin(angle)
    x, y = estimate[:, 0], estimate[:, 1]
    truth = np.column_stack(
        [
            c * x - s * y + sin_term * xi[:, 0] - cos_term * xi[:, 1],
            s * x + c * y + cos_term * xi[:, 0] + sin_term * xi[:, 1],
            wrap_angle(estimate[:, 2] + angle),
        ]
    )
    t = np.tile(np.eye(3), (RUNS, 1, 1))
    t[:, 0, 2], t[:, 1, 2] = -y, x
    values = nees(estimate, truth, t @ of_xi @ t.transpose(0, 2, 1), "invariant")
    assert values.mean() == pytest.approx(3.0, abs=MEAN_TOLERANCE)
    assert np.mean(values < POSE_95) == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("xi", [(0.3, -0.2, 0.8), (0.3, -0.2, -2.5), (1.0, 2.0, 1e-9), (0.0, 0.0, 0.5)])
def test_error_invariant_inverts_the_exponential(xi):
    estimate = np.array([[2.0, -1.0, 0.4]])
    rotation, position = exp_motion(xi)
    true_position = rotation @ estimate[0, :2] + position
    truth = np.array([[*true_position, wrap_angle(estimate[0, 2] + xi[2])]])
    # 2000 midpoint steps integrate the exponential to about 1e-7.
    np.testing.assert_allclose(error_invariant(estimate, truth)[0], xi, atol=1e-6)


def test_error_standard_wraps_the_heading():
    error = error_standard(np.array([[1.0, 1.0, 3.1]]), np.array([[1.5, 0.0, -3.1]]))
    np.testing.assert_allclose(error[0], [0.5, -1.0, 2 * np.pi - 6.2])


@pytest.mark.parametrize("name", ["standard", "invariant"])
def test_nees_of_a_covariance_that_is_not_definite_is_singular(name):
    bad = np.array([np.diag([1.0, -1.0, 1.0]), np.zeros((3, 3)), np.eye(3)])
    values = nees(np.zeros((3, 3)), np.full((3, 3), 0.1), bad, name)
    assert values[:2].tolist() == [SINGULAR, SINGULAR]
    assert values[2] < 1.0


# Tables of chi-square: 2.5 and 97.5 % quantiles of 6, 30 and 150 degrees of freedom.
@pytest.mark.parametrize(
    ("runs", "low", "high"), [(2, 1.2373, 14.4494), (10, 16.791, 46.979), (50, 117.985, 185.8)]
)
def test_nees_band_holds_the_quantiles_of_chi_square(runs, low, high):
    np.testing.assert_allclose(nees_band_95(runs), (low / runs, high / runs), rtol=0.03)


def test_interval_of_a_mean_needs_five_runs():
    assert half_interval_95([1.0, 2.0, 3.0, 4.0]) is None
    # Student's t of 4 degrees of freedom: 2.7764, times the root of 2.5 / 5.
    assert half_interval_95([1.0, 2.0, 3.0, 4.0, 5.0]) == pytest.approx(2.7764 * 0.5**0.5, rel=0.005)
