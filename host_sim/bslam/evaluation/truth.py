"""True poses at the times of the steps, and dead reckoning to compare with."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.align import wrap_angle
from bslam.log import Log, Truth

# Between two true poses no farther apart in time than this, the truth is interpolated (Vicon gaps, short
# rests);
INTERPOLATE_US: Final = 500_000
# elsewhere it is only known this near to a true pose. Sparse truth stands still there.
NEAR_US: Final = 50_000
# A drive whose wheels are logged began no longer than this before the first row (what the core takes for one
# step).
START_WINDOW_US: Final = 4_000_000


def truth_at(truth: Truth, time_us: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """True poses (n, 3) at `time_us` (n,), and where they are known, (n,); NaN elsewhere."""
    stamps = truth.time_us
    after = np.clip(np.searchsorted(stamps, time_us), 1, max(len(stamps) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(stamps) - 1)
    inside = (time_us >= stamps[before]) & (time_us <= stamps[after])
    close = inside & (stamps[after] - stamps[before] <= INTERPOLATE_US)
    distance_us = np.minimum(np.abs(time_us - stamps[before]), np.abs(time_us - stamps[after]))
    known = close | (distance_us <= NEAR_US)
    poses = _interpolate(truth, np.where(close, time_us, _nearest(stamps, time_us, before, after)))
    poses[~known] = np.nan
    return poses, known


def starts_at_origin(log: Log) -> bool:
    """True if the truth says that the drive starts at its origin: then its frame is the map's."""
    if log.truth is None:
        return False
    pose, known = truth_at(log.truth, step_times_us(log)[:1])
    return bool(known[0] and np.all(np.abs(pose[0]) <= 1e-6))


def is_dense(truth: Truth) -> bool:
    """True if the truth covers the drive without long gaps, so that a way can be measured on it."""
    return len(truth.time_us) > 1 and float(np.mean(np.diff(truth.time_us) <= INTERPOLATE_US)) > 0.99


def dead_reckoning(log: Log, forward_scale: float = 1.0, turn_scale: float = 1.0) -> NDArray[np.float64]:
    """Poses (n + 1, 3) of odometry alone, by exact arcs from the origin; rows as in a Trace.

    The scales are true over measured.
    """
    forward_m, turn_rad = odometry_increments(log)
    forward_m, turn_rad = forward_scale * forward_m, turn_scale * turn_rad
    theta = np.concatenate([[0.0], np.cumsum(turn_rad)])
    chord_m = forward_m * np.sinc(turn_rad / (2.0 * np.pi))  # numpy's sinc(x) is sin(pi x) / (pi x)
    course = theta[:-1] + 0.5 * turn_rad
    x = np.concatenate([[0.0], np.cumsum(chord_m * np.cos(course))])
    y = np.concatenate([[0.0], np.cumsum(chord_m * np.sin(course))])
    return np.column_stack([x, y, wrap_angle(theta)])


def step_times_us(log: Log) -> NDArray[np.int64]:
    """Times of the start and of the end of each step, (n + 1,), by whatever clock the log has.

    The first row of wheel travel already moves, so the start stands before it; the first row of other
    odometry only gives the reading at the start.
    """
    times_us = log.odometry.time_us
    if log.odometry.kind == "wheels":
        return np.concatenate([[_wheels_start_us(log)], times_us]).astype(np.int64)
    return times_us


def _wheels_start_us(log: Log) -> int:
    """One step before the first row, or the last image or true pose at or before that moment, if any is near.

    A first row may be late, and what was seen at the start then tells when that was; truth that was recorded
    for a while before the drive must not make its first step longer.
    """
    first_us = int(log.odometry.time_us[0])
    latest_us = max(first_us - _step_us(log), 0)
    tables_us = [log.sightings.time_us] + ([log.truth.time_us] if log.truth is not None else [])
    seen_us = np.concatenate(tables_us)
    near = (seen_us <= latest_us) & (seen_us >= first_us - START_WINDOW_US)
    return int(seen_us[near].max()) if near.any() else latest_us


def _step_us(log: Log) -> int:
    """As the robot says, or where its rows come much more rarely than that, as they do."""
    times_us = log.odometry.time_us
    usual_us = int(np.median(np.diff(times_us))) if len(times_us) > 1 else 0
    return usual_us if usual_us > 1.5 * log.robot.step_us else log.robot.step_us


def odometry_increments(log: Log) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Way along the path, m, and turn, rad, of each step, (n,) each, as odometry gives them."""
    odometry = log.odometry
    if odometry.kind == "velocity":
        dt_s = np.diff(odometry.time_us) * 1e-6
        return odometry.a[1:] * dt_s, odometry.b[1:] * dt_s
    left_m, right_m = wheel_travel(log)
    return 0.5 * (left_m + right_m), (right_m - left_m) / log.robot.wheelbase_m


def wheel_travel(log: Log) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Travel of the left and the right wheel in each step, m, (n,) each, whatever odometry the log has."""
    odometry = log.odometry
    if odometry.kind == "ticks":
        return _travel_of_ticks(log)
    if odometry.kind == "wheels":
        return odometry.a, odometry.b
    travelled_m, turn_rad = odometry_increments(log)
    half_m = 0.5 * log.robot.wheelbase_m * turn_rad
    return travelled_m - half_m, travelled_m + half_m


def gyro_rates(log: Log) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean turn rate of each step by the gyro, rad/s, and its noise, (n,) each; NaN where none tells."""
    steps = len(step_times_us(log)) - 1
    rates_radps, sds_radps = log.odometry.gyro_radps, log.odometry.gyro_sd_radps
    rates = np.full(steps, np.nan) if rates_radps is None else rates_radps[len(rates_radps) - steps :]
    own = np.zeros(steps) if sds_radps is None else sds_radps[len(sds_radps) - steps :]
    return rates, np.where(own > 0.0, own, log.robot.gyro_sigma_radps)


def _travel_of_ticks(log: Log) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    robot = log.robot
    assert robot.left_radius_m and robot.right_radius_m and robot.ticks_per_revolution and robot.counter_bits
    modulus, per_turn = 2.0**robot.counter_bits, robot.ticks_per_revolution

    def travel_m(ticks: NDArray[np.float64], radius_m: float) -> NDArray[np.float64]:
        rolled_over = np.mod(np.diff(ticks) + 0.5 * modulus, modulus) - 0.5 * modulus
        return rolled_over * (2.0 * np.pi * radius_m / per_turn)

    return travel_m(log.odometry.a, robot.left_radius_m), travel_m(log.odometry.b, robot.right_radius_m)


def _nearest(
    stamps: NDArray[np.int64],
    time_us: NDArray[np.int64],
    before: NDArray[np.intp],
    after: NDArray[np.intp],
) -> NDArray[np.int64]:
    nearer_before = np.abs(time_us - stamps[before]) <= np.abs(time_us - stamps[after])
    return np.where(nearer_before, stamps[before], stamps[after])


def _interpolate(truth: Truth, time_us: NDArray[np.int64]) -> NDArray[np.float64]:
    start_us = truth.time_us[0]  # differences are exact in a double, times since 1970 squared are not
    at, stamps = time_us - start_us, truth.time_us - start_us
    theta = np.interp(at, stamps, np.unwrap(truth.theta_rad))
    return np.column_stack(
        [np.interp(at, stamps, truth.x_m), np.interp(at, stamps, truth.y_m), wrap_angle(theta)]
    )
