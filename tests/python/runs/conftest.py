"""Small logs and traces made by hand, for the tests beside: the fixture `made`."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from bslam.evaluation.trace import MapBeacon, SightingCounts, Trace
from bslam.log import Beacons, Log, Odometry, Robot, Sightings, Truth

STEP_US = 40_000
ROBOT = Robot(
    wheelbase_m=0.4,
    wheel_speed_sigma_mps=0.05,
    step_us=STEP_US,
    field_of_view_rad=math.pi,
    bearing_sigma_rad=0.01,
    range_sigma_fraction=0.02,
    range_sigma_scale_m=math.inf,
)
BEACONS = Beacons(np.array([3, 5, 8]), np.array([2.0, 0.0, -2.0]), np.array([0.5, 2.0, 0.0]))


def make_sightings(rows):
    """Rows (time_us, beacon_id, bearing_rad, range_m, mappable) as Sightings."""
    columns = list(zip(*rows, strict=True)) if rows else [()] * 5
    kinds = (np.int64, np.int64, np.float64, np.float64, np.bool_)
    return Sightings(*(np.array(column, dtype=kind) for column, kind in zip(columns, kinds, strict=True)))


def circle_log(steps=200, radius_m=1.0, speed_mps=0.5, name="circle", seed=None):
    """A robot on a circle that sees all beacons at every step; with a seed, odometry and sightings err."""
    dt_s = STEP_US * 1e-6
    time_us = STEP_US * np.arange(steps + 1, dtype=np.int64)
    theta = speed_mps / radius_m * dt_s * np.arange(steps + 1)
    x, y = radius_m * np.sin(theta), radius_m * (1.0 - np.cos(theta))
    wheels_m = speed_mps * dt_s * (1.0 + np.array([-1.0, 1.0]) * ROBOT.wheelbase_m / (2.0 * radius_m))
    travel_m = np.tile(wheels_m, (steps, 1))
    rng = np.random.default_rng(seed)
    noise = 0.0 if seed is None else 1.0
    travel_m += noise * ROBOT.wheel_speed_sigma_mps * dt_s * rng.standard_normal(travel_m.shape)
    rows = []
    for k in range(steps + 1):
        for identity, bx, by in zip(BEACONS.beacon_id, BEACONS.x_m, BEACONS.y_m, strict=True):
            range_m = math.hypot(bx - x[k], by - y[k])
            bearing = math.remainder(math.atan2(by - y[k], bx - x[k]) - theta[k], math.tau)
            bearing += noise * ROBOT.bearing_sigma_rad * rng.standard_normal()
            range_m *= 1.0 + noise * ROBOT.range_sigma_fraction * rng.standard_normal()
            rows.append((time_us[k], identity, bearing, range_m, True))
    return Log(
        name=name,
        odometry=Odometry("wheels", time_us[1:], travel_m[:, 0], travel_m[:, 1]),
        sightings=make_sightings(rows),
        truth=Truth(time_us, x, y, np.array([math.remainder(one, math.tau) for one in theta])),
        beacons=BEACONS,
        robot=ROBOT,
    )


def map_beacon(uid, true_id, x_m, y_m, confirmed=True, label=-1):
    """A beacon of a final map."""
    return MapBeacon(
        uid=uid,
        label=label,
        true_id=true_id,
        x_m=x_m,
        y_m=y_m,
        covariance_m2=np.diag([0.01, 0.04]),
        sightings=9,
        confirmed=confirmed,
        range_m=math.hypot(x_m, y_m),
        phi_rad=math.atan2(y_m, x_m),
    )


def trace_of(poses, time_us, beacons=(), covariance=None, counts=None):
    """A trace with these estimates."""
    rows = len(poses)
    return Trace(
        time_us=np.asarray(time_us, dtype=np.int64),
        pose=np.asarray(poses, dtype=np.float64),
        covariance=np.tile(0.01 * np.eye(3), (rows, 1, 1)) if covariance is None else covariance,
        seen=np.ones(rows, dtype=np.bool_),
        counts=counts or SightingCounts(),
        beacons=tuple(beacons),
        parameters={},
    )


@pytest.fixture(scope="session")
def made():
    """What makes logs and traces, by name."""
    return SimpleNamespace(
        step_us=STEP_US,
        robot=ROBOT,
        beacons=BEACONS,
        sightings=make_sightings,
        circle_log=circle_log,
        map_beacon=map_beacon,
        trace=trace_of,
    )
