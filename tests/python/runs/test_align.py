"""Rigid alignment in the plane."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bslam.evaluation.align import Rigid, Similarity, fit_rigid, fit_scale, wrap_angle

ANGLES = st.floats(-math.pi, math.pi)
METRES = st.floats(-100.0, 100.0)


@given(turn=ANGLES, x=METRES, y=METRES, seed=st.integers(0, 1000))
def test_fit_rigid_recovers_a_known_transform(turn, x, y, seed):
    points = np.random.default_rng(seed).uniform(-10, 10, (7, 2))
    found = fit_rigid(points, Rigid(turn, x, y).points(points))
    # 1e-9 m at 100 m is a thousand roundings of a double.
    np.testing.assert_allclose(found.points(points), Rigid(turn, x, y).points(points), atol=1e-9)


def umeyama(moving, fixed):
    """The textbook way, by the singular values of the covariance: R and shift."""
    p, q = moving - moving.mean(axis=0), fixed - fixed.mean(axis=0)
    u, _, vt = np.linalg.svd(q.T @ p)
    rotation = u @ np.diag([1.0, np.linalg.det(u @ vt)]) @ vt
    return rotation, fixed.mean(axis=0) - rotation @ moving.mean(axis=0)


def test_fit_rigid_agrees_with_umeyama_on_noisy_points():
    rng = np.random.default_rng(5)
    moving = rng.uniform(-5, 5, (40, 2))
    fixed = Rigid(2.7, 2.0, -1.0).points(moving) + 0.3 * rng.standard_normal((40, 2))
    found = fit_rigid(moving, fixed)
    rotation, shift = umeyama(moving, fixed)
    np.testing.assert_allclose(found.rotation, rotation, atol=1e-12)
    np.testing.assert_allclose([found.shift_x_m, found.shift_y_m], shift, atol=1e-12)


def test_fit_rigid_does_not_scale():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    found = fit_rigid(square, 2.0 * square)
    assert found.turn_rad == pytest.approx(0.0)
    assert np.ptp(found.points(square)[:, 0]) == pytest.approx(1.0)


def test_fit_rigid_of_one_pair_shifts_and_of_none_does_nothing():
    one = fit_rigid(np.array([[1.0, 2.0]]), np.array([[4.0, -2.0]]))
    assert (one.turn_rad, one.shift_x_m, one.shift_y_m) == (0.0, 3.0, -4.0)
    assert fit_rigid(np.empty((0, 2)), np.empty((0, 2))) == Rigid()


@given(turn=ANGLES, x=METRES, y=METRES)
def test_inverse_undoes(turn, x, y):
    there = Rigid(turn, x, y)
    pose = np.array([[1.0, -2.0, 3.0]])
    np.testing.assert_allclose(there.inverse().poses(there.poses(pose)), pose, atol=1e-9)


def test_wrap_angle_keeps_pi_and_turns_minus_pi():
    wrapped = wrap_angle(np.array([math.pi, -math.pi, 3.0 * math.pi, 0.5]))
    np.testing.assert_allclose(wrapped, [math.pi, math.pi, math.pi, 0.5])


def test_fit_scale_leaves_less_than_any_other_scale():
    rng = np.random.default_rng(6)
    moving = rng.uniform(-5, 5, (40, 2))
    fixed = 1.3 * Rigid(-2.0, 4.0, 1.0).points(moving) + 0.3 * rng.standard_normal((40, 2))

    def left(scale):
        return np.sum((fit_rigid(scale * moving, fixed).points(scale * moving) - fixed) ** 2)

    scale = fit_scale(moving, fixed)
    assert scale == pytest.approx(1.3, abs=0.05)
    assert left(scale) < min(left(scale - 1e-3), left(scale + 1e-3))
    assert fit_scale(moving[:1], fixed[:1]) == fit_scale(moving[:0], fixed[:0]) == 1.0


def test_covariance_is_that_of_the_points_that_were_moved():
    points = np.random.default_rng(1).normal(0.0, (0.3, 0.1), (50, 2))
    moved = Similarity(0.7, 2.0, -1.0, 1.5)
    np.testing.assert_allclose(moved.covariance(np.cov(points.T)), np.cov(moved.points(points).T))
