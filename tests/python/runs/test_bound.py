"""The bound for directions alone, against least squares over all steps at once."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bslam.evaluation.bound import bound, has_bound, mean_bound_m
from bslam.motion import move_on_arc
from bslam.options import RunOptions

DIRECTION = RunOptions(observation="direction")
STEPS = 30


def truth_of(log):
    return np.column_stack([log.truth.x_m, log.truth.y_m, log.truth.theta_rad])


def least_squares(log):
    """Error and covariance of the last pose: unknown are all ways, all rates and the beacons' places."""
    robot, truth = log.robot, truth_of(log)
    dt_s, count = robot.step_us * 1e-6, len(truth) - 1
    turn = np.unwrap(truth[:, 2])
    rate = np.diff(turn) / dt_s
    chord = np.hypot(*np.diff(truth[:, :2], axis=0).T)
    way = chord / np.sinc(rate * dt_s / (2.0 * np.pi))
    places = np.column_stack([log.beacons.x_m, log.beacons.y_m])
    true = np.concatenate([way, rate, places.ravel()])
    left, right = log.odometry.a, log.odometry.b
    speed_sd, base = robot.wheel_speed_sigma_mps, robot.wheelbase_m
    keep = math.exp(-dt_s)
    seen = log.sightings
    first = seen.bearing_rad[: len(places)]  # all are seen at the start
    guess = 4.0 * np.column_stack([np.cos(first), np.sin(first)])

    def poses_of(unknown):
        poses = [(0.0, 0.0, 0.0)]
        for s, omega in zip(unknown[:count], unknown[count : 2 * count], strict=True):
            half = 0.5 * base * omega * dt_s
            poses.append(move_on_arc(poses[-1], s - half, s + half, base))
        return np.array(poses)

    def residuals(unknown):
        s, omega, place = unknown[:count], unknown[count : 2 * count], unknown[2 * count :].reshape(-1, 2)
        poses = poses_of(unknown)
        parts = [(s - 0.5 * (left + right)) / (speed_sd * dt_s / math.sqrt(2.0))]
        parts.append((omega - (right - left) / (base * dt_s)) / (math.sqrt(2.0) * speed_sd / base))
        start_sd = math.sqrt((keep * 0.05) ** 2 + dt_s)
        parts.append([omega[0] / start_sd])
        parts.append((omega[1:] - keep * omega[:-1]) / math.sqrt(dt_s))
        parts.append((place - guess).ravel() / 2.5)
        pose = poses[np.searchsorted(log.truth.time_us, seen.time_us)]
        which = np.searchsorted(log.beacons.beacon_id, seen.beacon_id)
        ray = place[which] - pose[:, :2]
        error = np.arctan2(ray[:, 1], ray[:, 0]) - pose[:, 2] - seen.bearing_rad
        parts.append((np.remainder(error + np.pi, 2.0 * np.pi) - np.pi) / robot.bearing_sigma_rad)
        return np.concatenate(parts)

    def slope(function):
        steps = 1e-6 * np.eye(len(true))
        return np.array([(function(true + h) - function(true - h)).ravel() / 2e-6 for h in steps]).T

    jacobian, by_last = slope(residuals), slope(lambda unknown: poses_of(unknown)[-1])
    normal = np.linalg.inv(jacobian.T @ jacobian)
    return -by_last @ normal @ jacobian.T @ residuals(true), by_last @ normal @ by_last.T


def test_bound_is_least_squares_linearised_at_the_truth(made):
    log = made.circle_log(steps=STEPS, seed=5)
    errors, covariances = bound(log, log.truth.time_us, truth_of(log))
    error, covariance = least_squares(log)
    # The filter takes a rate's pull on the way sideways to second order of a step's turn: 0.02 rad.
    np.testing.assert_allclose(errors[-1], error, atol=2e-3 * np.sqrt(np.trace(covariance)))
    np.testing.assert_allclose(covariances[-1], covariance, rtol=2e-3, atol=2e-3 * np.abs(covariance).max())


def test_bound_of_a_turned_sensor_is_that_of_one_that_looks_ahead(made):
    log = made.circle_log(steps=STEPS, seed=5)
    turned = replace(
        log,
        robot=replace(log.robot, sensor_yaw_rad=0.4),
        sightings=replace(log.sightings, bearing_rad=log.sightings.bearing_rad - 0.4),
    )
    plain = mean_bound_m(log, log.truth.time_us, truth_of(log))
    assert mean_bound_m(turned, log.truth.time_us, truth_of(log)) == pytest.approx(plain, rel=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        {"options": RunOptions(observation="distance")},
        {"options": RunOptions(observation="direction", noise="actuation")},
        {"truth": None},
        {"beacons": None},
    ],
)
def test_bound_is_for_simulated_drives_in_direction_only(made, change):
    log = made.circle_log(steps=3)
    assert has_bound(log, DIRECTION)
    options = change.pop("options", DIRECTION)
    assert not has_bound(replace(log, **change), options)


def test_bound_knows_nothing_of_a_camera_s_noise(made):
    log = made.circle_log(steps=3)
    noise = np.full(len(log.sightings.time_us), 0.01)
    assert not has_bound(replace(log, sightings=replace(log.sightings, bearing_sd_rad=noise)), DIRECTION)
