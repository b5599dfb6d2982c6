"""Truth at the times of the steps, and odometry alone."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bslam.evaluation.truth import (
    INTERPOLATE_US,
    NEAR_US,
    dead_reckoning,
    is_dense,
    odometry_increments,
    step_times_us,
    truth_at,
)
from bslam.log import Odometry, Truth

START_US = 1_248_272_272_841_000  # real logs count from 1970


def truth_of(times_us, theta=None):
    times_us = np.array(times_us, dtype=np.int64)
    theta = np.zeros(len(times_us)) if theta is None else np.array(theta)
    return Truth(times_us, np.arange(len(times_us)) * 1.0, np.zeros(len(times_us)), theta)


def test_truth_at_interpolates_between_near_stamps_and_across_pi():
    truth = truth_of([START_US, START_US + 100_000], [3.1, -3.1])
    poses, known = truth_at(truth, np.array([START_US + 50_000]))
    assert known.all()
    assert poses[0, 0] == pytest.approx(0.5)
    assert abs(poses[0, 2]) == pytest.approx(math.pi)


def test_truth_at_a_long_gap_is_known_only_near_the_stamps():
    gap_us = 10 * INTERPOLATE_US
    truth = truth_of([START_US, START_US + gap_us])
    asked = START_US + np.array([-NEAR_US - 1, -NEAR_US, 0, NEAR_US, NEAR_US + 1, gap_us - NEAR_US, gap_us])
    poses, known = truth_at(truth, asked)
    assert known.tolist() == [False, True, True, True, False, True, True]
    assert np.isnan(poses[~known]).all()
    assert poses[known, 0].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0]


def test_truth_at_one_stamp_is_known_there_alone():
    poses, known = truth_at(truth_of([START_US]), START_US + np.array([0, 10 * NEAR_US]))
    assert known.tolist() == [True, False]
    assert poses[0].tolist() == [0.0, 0.0, 0.0]


def test_is_dense_tells_a_recording_from_moments_of_rest():
    assert is_dense(truth_of(np.arange(1000) * 10_000))
    assert not is_dense(truth_of(np.arange(100) * 60_000_000))


def test_dead_reckoning_of_exact_wheels_is_the_truth(made):
    log = made.circle_log(steps=300)
    poses = dead_reckoning(log)
    np.testing.assert_allclose(poses[:, 0], log.truth.x_m, atol=1e-9)
    np.testing.assert_allclose(poses[:, 1], log.truth.y_m, atol=1e-9)
    np.testing.assert_allclose(np.cos(poses[:, 2] - log.truth.theta_rad), 1.0, atol=1e-12)


def test_dead_reckoning_scales_way_and_turn(made):
    log = made.circle_log(steps=10)
    forward_m, turn_rad = odometry_increments(log)
    scaled = dead_reckoning(log, forward_scale=0.5, turn_scale=2.0)
    assert scaled[-1, 2] == pytest.approx(2.0 * turn_rad.sum())
    assert np.hypot(*np.diff(scaled[:2, :2], axis=0)[0]) == pytest.approx(0.5 * forward_m[0], rel=1e-3)


def test_odometry_increments_of_ticks_roll_over(made):
    robot = replace(
        made.robot, left_radius_m=0.05, right_radius_m=0.1, ticks_per_revolution=100.0, counter_bits=8
    )
    odometry = Odometry(
        "ticks", np.array([0, 40_000, 80_000]), np.array([250.0, 4.0, 254.0]), np.array([0.0, 10.0, 20.0])
    )
    forward_m, turn_rad = odometry_increments(
        replace(made.circle_log(steps=1), odometry=odometry, robot=robot)
    )
    left_m = np.array([10.0, -6.0]) / 100.0 * math.tau * 0.05
    right_m = np.array([10.0, 10.0]) / 100.0 * math.tau * 0.1
    np.testing.assert_allclose(forward_m, 0.5 * (left_m + right_m))
    np.testing.assert_allclose(turn_rad, (right_m - left_m) / robot.wheelbase_m)


def wheels_from(made, first_us, seen_us=(), true_us=None):
    """A log whose first wheel row stands at first_us, with sightings and truth at these times."""
    log = made.circle_log(steps=2)
    odometry = Odometry("wheels", first_us + made.step_us * np.arange(2), np.zeros(2), np.zeros(2))
    sightings = made.sightings([(time_us, 3, 0.0, 1.0, True) for time_us in seen_us])
    return replace(
        log, odometry=odometry, sightings=sightings, truth=None if true_us is None else truth_of(true_us)
    )


def test_step_times_of_what_is_not_wheel_travel_begin_at_the_first_row(made):
    log = wheels_from(made, 40_000)
    log = replace(log, odometry=replace(log.odometry, kind="velocity"))
    assert step_times_us(log).tolist() == [40_000, 80_000]


@pytest.mark.parametrize(
    ("first_us", "seen_us", "true_us", "start_us"),
    [
        (40_000, [], None, 0),
        (START_US, [], None, START_US - 40_000),  # a step before the first row
        (39_998, [0], [0, 39_998], 0),  # no clock begins before 0
        (START_US, [START_US - 30_000], None, START_US - 40_000),
        (START_US, [START_US - 90_000], None, START_US - 90_000),  # the first row is late
        (START_US, [], [START_US - 5_000_000, START_US - 50_000, START_US], START_US - 50_000),
        (START_US, [0], [START_US - 10_000_001], START_US - 40_000),  # another drive
    ],
)
def test_step_times_of_wheels_begin_before_the_first_row(made, first_us, seen_us, true_us, start_us):
    log = wheels_from(made, first_us, seen_us, true_us)
    assert step_times_us(log).tolist() == [start_us, first_us, first_us + made.step_us]
