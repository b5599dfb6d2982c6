"""How well directions alone can do at all on a drive: a Kalman filter linearised at the truth.

Such a filter cannot be inconsistent, and no filter or smoother knows better points to linearise at: what it
errs by is what the noise of this very drive leaves. It has no model of the forward speed, since a prior on
that in m/s would tell the scale, which directions do not; of the turning rate it knows that it decays with
1 s and walks by 1 rad/s in a root second. A beacon starts 4 m along its first direction, +- 2.5 m.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.align import wrap_angle
from bslam.evaluation.truth import odometry_increments, starts_at_origin
from bslam.log import Log
from bslam.options import RunOptions, wheel_noise

Array = NDArray[np.float64]

_TURN_DECAY_S: Final = 1.0
_TURN_WALK_RADPS_SQRT_S: Final = 1.0
_TURN_SD_RADPS: Final = 0.05  # at the start: the robot stands
_FIRST_RANGE_M: Final = 4.0
_FIRST_RANGE_SD_M: Final = 2.5
_X, _Y, _THETA, _TURN, _BEACONS = range(5)


def has_bound(log: Log, options: RunOptions) -> bool:
    """True for drives seen in direction only whose true poses and noise are those of the simulator."""
    return (
        options.observation == "direction"
        and log.sightings.bearing_sd_rad is None  # white and alike: no camera's
        and log.truth is not None
        and starts_at_origin(log)
        and log.beacons is not None
        and log.odometry.kind == "wheels"
        and log.robot.sighting_delay_us == 0
        and wheel_noise(options, log) == "speedometer"
        and log.robot.wheel_speed_sigma_mps > 0.0
        and log.robot.bearing_sigma_rad > 0.0
    )


def bound(log: Log, time_us: NDArray[np.int64], truth: Array) -> tuple[Array, Array]:
    """Errors of the pose, (n, 3), and their covariance, (n, 3, 3), at the steps `time_us`, `truth` (n, 3).

    The log is one that `has_bound`; poses and beacons are in the frame of the start. Sightings of clutter
    and of times between steps are left out.
    """
    filter_ = _Linear(log)
    errors, covariances = np.zeros((len(truth), 3)), np.zeros((len(truth), 3, 3))
    rows = _rows_of_steps(log, time_us)
    forward_m, turn_rad = odometry_increments(log)
    for step in range(len(truth)):
        if step:
            dt_s = float(time_us[step] - time_us[step - 1]) * 1e-6
            filter_.move(truth[step - 1], truth[step], dt_s, forward_m[step - 1], turn_rad[step - 1])
        filter_.see(truth[step], rows[step])
        errors[step], covariances[step] = filter_.error[:3], filter_.covariance[:3, :3]
    return errors, covariances


def _rows_of_steps(log: Log, time_us: NDArray[np.int64]) -> list[NDArray[np.intp]]:
    """Which sightings were taken at each step."""
    low = np.searchsorted(log.sightings.time_us, time_us, "left")
    high = np.searchsorted(log.sightings.time_us, time_us, "right")
    return [np.arange(a, b) for a, b in zip(low.tolist(), high.tolist(), strict=True)]


def mean_bound_m(log: Log, time_us: NDArray[np.int64], truth: Array) -> float:
    """Mean distance of the bound's position from the true one, all steps but the first."""
    errors, _ = bound(log, time_us, truth)
    return float(np.mean(np.hypot(errors[1:, 0], errors[1:, 1])))


class _Linear:
    """The filter's error, estimate less truth, and its covariance: linear in the noise of the drive."""

    def __init__(self, log: Log) -> None:
        assert log.beacons is not None
        robot, seen = log.robot, log.sightings
        self._place_m = np.column_stack([log.beacons.x_m, log.beacons.y_m])
        place_of = {identity: at for at, identity in enumerate(log.beacons.beacon_id.tolist())}
        self._beacon = [place_of.get(identity, -1) for identity in seen.beacon_id.tolist()]
        self._bearing_rad = seen.bearing_rad
        self._mount = (robot.sensor_x_m, robot.sensor_y_m, robot.sensor_yaw_rad)
        self._bearing_variance = robot.bearing_sigma_rad**2
        self._speed_variance = robot.wheel_speed_sigma_mps**2 / 2.0
        self._turn_variance = 2.0 * (robot.wheel_speed_sigma_mps / robot.wheelbase_m) ** 2
        size = _BEACONS + 2 * len(self._place_m)
        self.error, self.covariance = np.zeros(size), np.zeros((size, size))
        self.covariance[_TURN, _TURN] = _TURN_SD_RADPS**2
        self._started = [False] * len(self._place_m)
        self._turn_radps = 0.0

    def move(self, before: Array, after: Array, dt_s: float, forward_m: float, turn_rad: float) -> None:
        """From one true pose to the next; odometry read forward_m, turn_rad."""
        error, p = self.error, self.covariance
        turned = float(wrap_angle(after[2] - before[2]))
        course = before[2] + 0.5 * turned
        along = np.array([np.cos(course), np.sin(course)])
        way = after[:2] - before[:2]
        keep = np.exp(-dt_s / _TURN_DECAY_S)
        error[_TURN] = keep * (error[_TURN] + self._turn_radps) - turned / dt_s
        self._turn_radps = turned / dt_s
        p[_TURN] *= keep
        p[:, _TURN] *= keep
        p[_TURN, _TURN] += _TURN_WALK_RADPS_SQRT_S**2 * dt_s
        f = np.eye(4)
        f[:2, _THETA] = (-way[1], way[0])
        f[:2, _TURN] = 0.5 * dt_s * f[:2, _THETA]
        f[_THETA, _TURN] = dt_s
        error[:4] = f @ error[:4]
        p[:4] = f @ p[:4]
        p[:, :4] = p[:, :4] @ f.T
        chord_m = np.sinc(turned / (2.0 * np.pi))
        error[:2] += (forward_m * chord_m - float(along @ way)) * along
        p[:2, :2] += self._speed_variance * dt_s**2 * np.outer(along, along)
        row = np.zeros(len(error))
        row[_TURN] = 1.0
        self._fuse(row, (turn_rad - turned) / dt_s, self._turn_variance)

    def see(self, pose: Array, rows: NDArray[np.intp]) -> None:
        """The sightings of these rows, taken from the true pose."""
        x_m, y_m, yaw_rad = self._mount
        c, s = np.cos(pose[2]), np.sin(pose[2])
        eye = np.array([c * x_m - s * y_m, s * x_m + c * y_m])
        for at in rows.tolist():
            beacon, bearing_rad = self._beacon[at], self._bearing_rad[at]
            if beacon < 0:
                continue
            ray = self._place_m[beacon] - pose[:2] - eye
            square = float(ray @ ray)
            first = _BEACONS + 2 * beacon
            if not self._started[beacon]:
                self._start(beacon, pose[:2] + eye, pose[2] + yaw_rad + bearing_rad)
            row = np.zeros(len(self.error))
            row[first : first + 2] = (-ray[1] / square, ray[0] / square)
            row[:2] = -row[first : first + 2]
            row[_THETA] = -1.0 - float(row[first : first + 2] @ np.array([-eye[1], eye[0]]))
            true_rad = np.arctan2(ray[1], ray[0]) - pose[2] - yaw_rad
            self._fuse(row, float(wrap_angle(bearing_rad - true_rad)), self._bearing_variance)

    def _start(self, beacon: int, eye_m: Array, direction_rad: float) -> None:
        guess_m = eye_m + _FIRST_RANGE_M * np.array([np.cos(direction_rad), np.sin(direction_rad)])
        at = slice(_BEACONS + 2 * beacon, _BEACONS + 2 * beacon + 2)
        self.error[at] = guess_m - self._place_m[beacon]
        self.covariance[at, at] = _FIRST_RANGE_SD_M**2 * np.eye(2)
        self._started[beacon] = True

    def _fuse(self, row: Array, noise: float, variance: float) -> None:
        """One measurement that errs by `noise`."""
        column = self.covariance @ row
        s = float(row @ column) + variance
        self.error += column * ((noise - float(row @ self.error)) / s)
        self.covariance -= np.outer(column, column / s)
