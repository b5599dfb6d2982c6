"""The turn rates that a drive's cameras tell, beside its wheels: one frame a step."""

from __future__ import annotations

import math

import numpy as np

from bslam.core.vision import Turn
from bslam.core.visual_gyro import VisualGyro
from bslam.evaluation.truth import odometry_increments
from bslam.log import Log

_LEAST_SPEED_SD_MPS = 0.01  # where the log says that its wheels do not err


class Compass:
    """Frames in, in order of time; `rates_radps` fills up.

    rates_radps, sds_radps: (n,) one a row of the log's odometry, as `Odometry.gyro_radps` and
    `gyro_sd_radps`; NaN and 0: not known (yet). The log's `gyro_sigma_radps` is what a rate errs by at least.
    """

    def __init__(self, log: Log) -> None:
        robot, rows = log.robot, len(log.odometry.time_us)
        self._step_us, step_s = robot.step_us, robot.step_us * 1e-6
        travelled_m, _ = odometry_increments(log)
        self._speed_mps = (travelled_m / step_s).tolist()
        self._speed_sd_mps = max(robot.wheel_speed_sigma_mps / math.sqrt(2.0), _LEAST_SPEED_SD_MPS)
        self._first_row = rows - len(travelled_m)  # of ticks the first row only sets the counters
        self._gyro = VisualGyro(robot.gyro_sigma_radps)
        self._next_step = 0
        self.rates_radps, self.sds_radps = np.full(rows, math.nan), np.zeros(rows)

    def take(self, step: int, camera: int, turn: Turn | None) -> None:
        """The frame that a camera took at the end of a step (0: at the start), and what it told."""
        while self._next_step <= step:
            ended = self._next_step - 1
            speed_mps = self._speed_mps[ended] if ended >= 0 else 0.0
            self._gyro.advance(self._next_step * self._step_us, speed_mps, self._speed_sd_mps)
            self._next_step += 1
        self._gyro.take(camera, turn)
        told = self._gyro.rate()
        if step > 0 and told is not None:
            row = self._first_row + step - 1
            self.rates_radps[row], self.sds_radps[row] = told
