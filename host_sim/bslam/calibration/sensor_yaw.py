"""A sensor's yaw on the robot, from a drive: what stands still must seem to move as the robot did."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.calibration.calibrate import Estimate
from bslam.errors import BslamError
from bslam.evaluation.align import wrap_angle
from bslam.evaluation.truth import dead_reckoning, step_times_us, truth_at
from bslam.log import Log

# A beacon is compared with itself over drives of this length: longer ones show more of the angle, and more of
# odometry's own errors.
_WAY_M: Final = 0.5
_FEWEST_WAYS: Final = 20
_BLOCKS: Final = 10


def find_yaw(log: Log) -> Estimate:
    """The sensor's yaw on the robot, rad, from distances and directions of beacons that stand still.

    A beacon seen at two poses gives u, how it moved in the sensor's axes (the robot's turn undone), and the
    robot's own way d; d = R(yaw) u, so the yaw is the angle of sum(d conj(u)). Noise of the sightings
    averages out of it, scale errors of distance or odometry only change its length. d is from the truth if
    the log has one, else from odometry. BslamError if there is too little to compare.
    """
    products, times_us = _ways(log)
    if len(products) < _FEWEST_WAYS:
        raise BslamError(
            f"{log.name}: {len(products)} pairs of sightings of one beacon, with distance, {_WAY_M:g} m of "
            f"driving apart; allowed: at least {_FEWEST_WAYS}, with beacon_id and range_m"
        )
    yaw_rad = float(np.angle(products.sum()))
    # What is left out block by block: errors of neighbours in time are not independent.
    block = np.minimum(_BLOCKS * (times_us - times_us[0]) // max(int(np.ptp(times_us)), 1), _BLOCKS - 1)
    left_out = [np.angle(products[block != one].sum()) for one in np.unique(block)]
    spread = wrap_angle(np.array(left_out) - yaw_rad)
    count = len(left_out)
    error_rad = math.sqrt((count - 1) / count * float(np.sum(spread**2))) if count > 1 else math.nan
    return Estimate(yaw_rad, error_rad)


def _ways(log: Log) -> tuple[NDArray[np.complex128], NDArray[np.int64]]:
    """d conj(u) of each pair of sightings of one beacon about _WAY_M of driving apart, and their times."""
    sightings = log.sightings
    poses, known = _poses_at(log, sightings.time_us - log.robot.sighting_delay_us)
    usable = known & np.isfinite(sightings.range_m) & (sightings.beacon_id >= 0) & sightings.mappable
    where = poses[:, 0] + 1j * poses[:, 1]
    mount = complex(log.robot.sensor_x_m, log.robot.sensor_y_m)
    seen = sightings.range_m * np.exp(1j * sightings.bearing_rad)
    products, times_us = [], []
    for identity in np.unique(sightings.beacon_id[usable]):
        rows = np.flatnonzero(usable & (sightings.beacon_id == identity))
        for first, second in _pairs(rows, where):
            turned = np.exp(1j * (poses[second, 2] - poses[first, 2]))
            way = (where[second] - where[first]) * np.exp(-1j * poses[first, 2]) + (turned - 1.0) * mount
            products.append(way * np.conj(seen[first] - turned * seen[second]))
            times_us.append(int(sightings.time_us[first]))
    order = np.argsort(times_us, kind="stable")
    return np.array(products, dtype=np.complex128)[order], np.array(times_us, dtype=np.int64)[order]


def _pairs(rows: NDArray[np.intp], where: NDArray[np.complex128]) -> Sequence[tuple[int, int]]:
    """Consecutive rows at least _WAY_M apart, each row once."""
    pairs = []
    start = 0
    for at in range(1, len(rows)):
        if abs(where[rows[at]] - where[rows[start]]) >= _WAY_M:
            pairs.append((int(rows[start]), int(rows[at])))
            start = at
    return pairs


def _poses_at(log: Log, time_us: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The robot's poses (n, 3), by the truth if there is one with headings, and where they are known."""
    if log.truth is not None and np.isfinite(log.truth.theta_rad).all():
        return truth_at(log.truth, time_us)
    steps_us, track = step_times_us(log), dead_reckoning(log)
    track[:, 2] = np.unwrap(track[:, 2])
    poses = np.column_stack([np.interp(time_us, steps_us, column) for column in track.T])
    return poses, (time_us >= steps_us[0]) & (time_us <= steps_us[-1])
