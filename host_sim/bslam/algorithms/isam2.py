"""GTSAM's incremental smoother (iSAM2), used as its manual has it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import gtsam
import numpy as np
from gtsam.symbol_shorthand import L, X
from numpy.typing import NDArray

from bslam.algorithms.noise import NO_GYRO, measured_motion, range_sd_m
from bslam.algorithms.protocol import Landmark, Setup, Sighting
from bslam.motion import Pose

_SIDEWAYS_SD_M: Final = 1e-4  # wheels do not slip sideways; GTSAM wants some noise in every direction
_START_SD: Final = 1e-6  # m, rad
_RELINEARISE: Final = 0.01  # GTSAM's default, 0.1, is meant for larger maps and costs accuracy here
_FIRST_RANGE_M: Final = 4.0  # of a beacon seen in direction only, +- 2.5 m
_FIRST_RANGE_SD_M: Final = 2.5


class Isam2:
    """A pose a step, a point a beacon, standard factors between; updated once a step.

    It has no model of inertia: odometry moves the pose, as in the filter without velocity states. The sd of a
    distance is that of the predicted one when the sighting comes in.
    """

    needs_identity = True

    def __init__(self, setup: Setup) -> None:
        self._p = setup.parameters
        self.reset(0)

    def reset(self, seed: int) -> None:
        """See `Algorithm`. Nothing inside is random."""
        options = gtsam.ISAM2Params()
        options.setRelinearizeThreshold(_RELINEARISE)
        options.relinearizeSkip = 1
        options.setFactorization("QR")
        self._isam = gtsam.ISAM2(options)
        self._mount = gtsam.Pose2(*(self._p[key] for key in ("mount_x_m", "mount_y_m", "mount_yaw_rad")))
        self._pose = gtsam.Pose2()
        self._times_us: list[int] = []
        self._places: dict[int, NDArray[np.float64]] = {}
        self._gyro = NO_GYRO  # of the step to come
        self._begin_batch()
        start = gtsam.noiseModel.Isotropic.Sigma(3, _START_SD)
        self._factors.add(gtsam.PriorFactorPose2(X(0), self._pose, start))
        self._values.insert(X(0), self._pose)

    def _begin_batch(self) -> None:
        self._factors, self._values = gtsam.NonlinearFactorGraph(), gtsam.Values()

    def gyro(self, time_us: int, rate_radps: float, sd_radps: float) -> None:
        """See `Gyroscopic`."""
        self._gyro = (rate_radps, sd_radps)

    def odometry(self, time_us: int, left_m: float, right_m: float) -> None:
        """See `Algorithm`."""
        p = self._p
        dt_s = (time_us - self._times_us[-1]) * 1e-6
        (travelled_m, turn_rad), spread = measured_motion(p, dt_s, left_m, right_m, *self._gyro)
        self._gyro = NO_GYRO
        twist = np.array([travelled_m, 0.0, turn_rad])
        covariance = np.zeros((3, 3))
        covariance[np.ix_([0, 2], [0, 2])] = spread
        covariance[1, 1] = _SIDEWAYS_SD_M**2
        to_end = gtsam.Pose2.ExpmapDerivative(twist)
        noise = gtsam.noiseModel.Gaussian.Covariance(to_end @ covariance @ to_end.T)
        moved = gtsam.Pose2.Expmap(twist)
        last = len(self._times_us) - 1
        self._factors.add(gtsam.BetweenFactorPose2(X(last), X(last + 1), moved, noise))
        self._pose = self._pose.compose(moved)
        self._values.insert(X(last + 1), self._pose)
        self._times_us.append(time_us)

    def observe(self, time_us: int, sightings: Sequence[Sighting]) -> None:
        """See `Algorithm`. A late sighting counts for the newest pose that is not younger."""
        if not self._times_us:
            self._times_us.append(time_us)
        seen_us = time_us - int(self._p["sighting_delay_us"])
        number = int(np.searchsorted(self._times_us, seen_us, side="right")) - 1
        for one in sightings:
            if one.mappable and one.label is not None:
                self._add(max(number, 0), one, one.label)

    def _add(self, number: int, one: Sighting, label: int) -> None:
        p = self._p
        here = (
            self._pose if number == len(self._times_us) - 1 else self._isam.calculateEstimatePose2(X(number))
        )
        eye = here.compose(self._mount)
        if label not in self._places:
            guess_m = _FIRST_RANGE_M if one.range_m is None else one.range_m
            place = eye.transformFrom(
                guess_m * np.array([math.cos(one.bearing_rad), math.sin(one.bearing_rad)])
            )
            self._places[label] = place
            self._values.insert(L(label), place)
            if one.range_m is None:
                spread = gtsam.noiseModel.Isotropic.Sigma(2, _FIRST_RANGE_SD_M)
                self._factors.add(gtsam.PriorFactorPoint2(L(label), place, spread))
        direction = gtsam.Rot2.fromAngle(one.bearing_rad + p["mount_yaw_rad"])
        if one.range_m is None:
            alone = gtsam.noiseModel.Isotropic.Sigma(1, p["bearing_sd_rad"])
            self._factors.add(gtsam.BearingFactor2D(X(number), L(label), direction, alone))
            return
        sd_m = range_sd_m(p, eye.range(self._places[label]))
        noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([p["bearing_sd_rad"], sd_m]))
        self._factors.add(gtsam.BearingRangeFactor2D(X(number), L(label), direction, one.range_m, noise))

    def pose(self) -> Pose:
        """See `Algorithm`."""
        self._update()
        return self._pose.x(), self._pose.y(), self._pose.theta()

    def map(self) -> Sequence[Landmark]:
        """See `Algorithm`."""
        self._update()
        return [Landmark(float(place[0]), float(place[1]), label) for label, place in self._places.items()]

    def _update(self) -> None:
        """Work off what has come in since the last time."""
        if self._factors.size() == 0 or not self._times_us:
            return
        self._isam.update(self._factors, self._values)
        self._begin_batch()
        self._pose = self._isam.calculateEstimatePose2(X(len(self._times_us) - 1))
        for label in self._places:
            self._places[label] = self._isam.calculateEstimatePoint2(L(label))
