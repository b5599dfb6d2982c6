"""bslam's own core as one algorithm among others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.algorithms.protocol import Account, Landmark, Setup, Sighting
from bslam.core.errors import CoreError
from bslam.core.slam import Slam
from bslam.motion import Pose

_NO_GYRO: tuple[None, float] = (None, 0.0)


class Bslam:
    """The C library. What it refuses is counted there, and the drive goes on, as on a robot."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._slam = self._new()

    def _new(self) -> Slam:
        setup = self._setup
        params = {**setup.parameters, "recovery": 0}  # nobody carries the robot away
        return Slam(params, beacons_max=setup.beacons_max, real=setup.real, seeds=setup.seeds)

    def reset(self, seed: int) -> None:
        """See `Algorithm`. Nothing inside is random."""
        self._slam = self._new()
        self._accounts: Sequence[Account] | None = None
        self._gyro: tuple[float | None, float] = _NO_GYRO  # of the step to come

    def gyro(self, time_us: int, rate_radps: float, sd_radps: float) -> None:
        """See `Gyroscopic`."""
        self._gyro = (rate_radps, sd_radps)

    def odometry(self, time_us: int, left_m: float, right_m: float) -> None:
        """See `Algorithm`."""
        try:
            self._slam.odometry("wheels", time_us, left_m, right_m, *self._gyro)
        except CoreError:
            return  # the core has counted it
        finally:
            self._gyro = _NO_GYRO

    def observe(self, time_us: int, sightings: Sequence[Sighting]) -> None:
        """See `Algorithm`."""
        columns, looks = _columns(sightings), _signatures(sightings)
        kinds = [one.beacon_class or 0 for one in sightings]
        scores = [one.score or 0.0 for one in sightings]
        try:
            told = self._slam.sightings(time_us, *columns, signature=looks, beacon_class=kinds, score=scores)
        except CoreError:
            self._accounts = None  # the core has counted it
            return
        self._accounts = [Account(one.result, one.beacon_uid, one.reason) for one in told]

    def accounts(self) -> Sequence[Account] | None:
        """See `Algorithm`."""
        return self._accounts

    def uids(self) -> Iterable[int]:
        """See `Algorithm`."""
        return [one.uid for one in self._slam.beacons()]

    def pose(self) -> Pose:
        """See `Algorithm`."""
        return self._slam.pose()

    def pose_covariance(self) -> NDArray[np.float64]:
        """See `Algorithm`."""
        return self._slam.pose_covariance()

    def map(self) -> Sequence[Landmark]:
        """The confirmed beacons."""
        return [
            Landmark(one.x_m, one.y_m, one.label if one.label >= 0 else None, one.covariance_m2, one.uid)
            for one in self._slam.beacons()
            if one.confirmed
        ]


def _columns(sightings: Sequence[Sighting]) -> tuple[Any, Any, Any, Any, Any, Any, Any]:
    """bearing_rad, range_m, label, mappable and the three noises as the core has them: no None."""
    rows = [
        (
            one.bearing_rad,
            math.nan if one.range_m is None else one.range_m,
            -1 if one.label is None else one.label,
            one.mappable,
            one.bearing_sd_rad or 0.0,
            one.range_sd_m or 0.0,
            one.range_scale_sd or 0.0,
        )
        for one in sightings
    ]
    bearing, range_m, label, mappable, *noise = zip(*rows, strict=True) if rows else ((),) * 7
    return bearing, range_m, label, mappable, noise[0], noise[1], noise[2]


def _signatures(sightings: Sequence[Sighting]) -> NDArray[np.float32] | None:
    """(m, 71); None unless every sighting has one."""
    looks = [one.signature for one in sightings if one.signature is not None]
    return np.stack(looks) if looks and len(looks) == len(sightings) else None
