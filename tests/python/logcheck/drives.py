"""Drives made up for the log check: eights past eight beacons, with the noise that robot.toml tells."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bslam.log import Beacons, Log, Odometry, Robot, Sightings, Truth, wrap_rad

STEP_US = 40_000
_FRAME_ROWS = 4  # of odometry, from frame to frame
BASE_M = 0.3
PLACES_M = np.array([[3, 1], [-2, 2], [1, -3], [-3, -1], [2, 3.5], [4, -2], [-1, 4], [0.5, 1.5]], dtype=float)
ROBOT = Robot(
    wheelbase_m=BASE_M,
    wheel_speed_sigma_mps=0.02,
    step_us=STEP_US,
    field_of_view_rad=4.0,
    bearing_sigma_rad=0.02,
    range_sigma_fraction=0.02,
    range_sigma_scale_m=math.inf,
    range_sigma_floor_m=0.02,
    wheel_noise="actuation",
)


def made_up(
    seed: int = 0,
    seconds: float = 60.0,
    kind: str = "wheels",
    has_truth: bool = False,
    turn_most_radps: float = 0.7,
) -> Log:
    """A log as it should be, with beacons.csv, or with truth.csv in its place; sightings at 6 Hz within the
    field of view, to 5 m.
    """
    random = np.random.default_rng(seed)
    count = round(seconds * 1e6 / STEP_US)
    time_us = STEP_US * np.arange(count + 1, dtype=np.int64)
    dt_s, middle_s = 1e-6 * STEP_US, 1e-6 * (time_us[1:] - STEP_US // 2)
    speed_mps, turn_radps = (
        0.4 + 0.1 * np.sin(0.5 * middle_s),
        turn_most_radps * np.sin(0.35 * middle_s + 0.4),
    )
    told = np.column_stack([speed_mps - turn_radps * BASE_M / 2, speed_mps + turn_radps * BASE_M / 2]) * dt_s
    driven = told + 0.02 * dt_s * random.standard_normal(told.shape)
    way, turn = driven.mean(axis=1), np.diff(driven, axis=1)[:, 0] / BASE_M
    theta = np.append(0.0, np.cumsum(turn))
    course = theta[:-1] + 0.5 * turn
    x, y = (np.append(0.0, np.cumsum(way * of(course))) for of in (np.cos, np.sin))
    rows = np.repeat(np.arange(0, count + 1, _FRAME_ROWS), len(PLACES_M))
    label = np.tile(np.arange(len(PLACES_M)), count // _FRAME_ROWS + 1)
    dx, dy = (PLACES_M[label] - np.column_stack([x, y])[rows]).T
    bearing, range_m = wrap_rad(np.arctan2(dy, dx) - theta[rows]), np.hypot(dx, dy)
    seen = (np.abs(bearing) < 0.5 * ROBOT.field_of_view_rad) & (range_m < 5.0) & (range_m > 0.3)
    rows, label, bearing, range_m = (one[seen] for one in (rows, label, bearing, range_m))
    bearing = wrap_rad(bearing + ROBOT.bearing_sigma_rad * random.standard_normal(len(rows)))
    range_m = range_m + np.hypot(0.02, 0.02 * range_m) * random.standard_normal(len(rows))
    mappable = np.ones(len(rows), dtype=bool)
    sightings = Sightings(time_us[rows], label.astype(np.int64), bearing, range_m, mappable)
    beacons = None if has_truth else Beacons(np.arange(len(PLACES_M)), *PLACES_M.T)
    truth = Truth(time_us, x, y, wrap_rad(theta)) if has_truth else None
    return Log("made_up", _odometry(kind, time_us, told), sightings, truth, beacons, _robot(kind))


def arc(seed: int, sigma_mps: float) -> Log:
    """A log as it should be: 20 s on one gentle arc past three beacons, by wheels of that noise."""
    random, steps = np.random.default_rng(seed), np.arange(1, 1001)
    left_m, right_m = 6.0e-3, 6.6e-3
    theta, way_m = (right_m - left_m) / BASE_M * steps, 0.5 * (left_m + right_m) * steps
    radius_m = way_m[-1] / theta[-1]
    x_m, y_m = radius_m * np.sin(theta), radius_m * (1.0 - np.cos(theta))
    rows, label = np.repeat(steps[4::5] - 1, 3), np.tile(np.arange(3), 200)
    dx, dy = (np.array([[3, 1], [-1, 3], [2, -2]])[label] - np.column_stack([x_m, y_m])[rows]).T
    bearing = np.arctan2(dy, dx) - theta[rows] + random.normal(0.0, 0.02, 600)
    range_m = np.hypot(dx, dy) + random.normal(0.0, 0.03, 600)
    time_us = 20_000 * steps
    mappable = np.ones(600, dtype=bool)
    sightings = Sightings(time_us[rows], label, wrap_rad(bearing), range_m, mappable)
    told_m = [one + random.normal(0.0, 0.02 * sigma_mps, 1000) for one in (left_m, right_m)]
    noise = {"range_sigma_fraction": 0.01, "range_sigma_floor_m": 0.03, "wheel_speed_sigma_mps": sigma_mps}
    robot = replace(ROBOT, step_us=20_000, wheel_noise="speedometer", field_of_view_rad=6.28, **noise)
    return Log("arc", Odometry("wheels", time_us, *told_m), sightings, None, None, robot)


def _odometry(kind: str, time_us, told) -> Odometry:
    if kind == "wheels":
        return Odometry("wheels", time_us[1:], *told.T)
    if kind == "velocity":
        pairs = np.column_stack([told.mean(axis=1), np.diff(told, axis=1)[:, 0] / BASE_M]) / (1e-6 * STEP_US)
        return Odometry("velocity", time_us, *np.vstack([[0.0, 0.0], pairs]).T)
    counts = np.round(np.cumsum(told, axis=0) / (2.0 * math.pi * 0.05 / 4096)) + 1000
    return Odometry("ticks", time_us, *np.vstack([[1000, 1000], counts]).T)


def _robot(kind: str) -> Robot:
    if kind != "ticks":
        return ROBOT
    ticks = {"ticks_per_revolution": 4096, "counter_bits": 32}
    return replace(ROBOT, left_radius_m=0.05, right_radius_m=0.05, **ticks)


def with_sightings(log: Log, **columns) -> Log:
    """The log with other columns of sightings."""
    return replace(log, sightings=replace(log.sightings, **columns))


def with_odometry(log: Log, **columns) -> Log:
    """The log with other columns of odometry."""
    return replace(log, odometry=replace(log.odometry, **columns))


def with_robot(log: Log, **keys) -> Log:
    """The log with other keys of robot.toml."""
    return replace(log, robot=replace(log.robot, **keys))


def exchanged(log: Log, a: int, b: int, first_s: float, last_s: float) -> Log:
    """Two labels exchanged for a while."""
    s = log.sightings
    inside = (s.time_us >= 1e6 * first_s) & (s.time_us <= 1e6 * last_s)
    other = np.where(s.beacon_id == a, b, np.where(s.beacon_id == b, a, s.beacon_id))
    return with_sightings(log, beacon_id=np.where(inside, other, s.beacon_id))
