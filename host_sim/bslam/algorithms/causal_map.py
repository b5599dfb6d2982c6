"""The best that can be known at each moment, from all readings until then: the bound for every filter."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence

from bslam.algorithms.noise import NO_GYRO, measured_motion
from bslam.algorithms.protocol import Landmark, Setup, Sighting
from bslam.algorithms.smoother import Smoother
from bslam.motion import Pose, move_on_arc

_START_STEPS = 25
"""For no longer does a solution start from odometry alone: one that starts far off may settle elsewhere."""


class CausalMap:
    """Maximum a posteriori of the whole drive so far, solved anew to convergence at every n-th step at least.

    Under the very model that bslam's filter has, velocity states included. Between those steps the pose
    goes on by odometry, so it is comparable at those steps only. A sighting that was taken between two
    steps counts for the nearer one.
    """

    needs_identity = True

    def __init__(self, setup: Setup, every: int = 25) -> None:
        self._parameters = setup.parameters
        self._every = every
        self.reset(0)

    def reset(self, seed: int) -> None:
        """See `Algorithm`. Nothing inside is random."""
        self._smoother = Smoother(self._parameters)
        self._times_us: list[int] = []
        self._number_of: dict[int, int] = {}
        self._solved_steps = 0
        self._gyro = NO_GYRO  # of the step to come

    def gyro(self, time_us: int, rate_radps: float, sd_radps: float) -> None:
        """See `Gyroscopic`."""
        self._gyro = (rate_radps, sd_radps)

    def odometry(self, time_us: int, left_m: float, right_m: float) -> None:
        """See `Algorithm`."""
        p, gyro = self._parameters, self._gyro
        dt_s = (time_us - self._times_us[-1]) * 1e-6
        travelled_m, turn_rad = measured_motion(p, dt_s, left_m, right_m, *gyro)[0].tolist()
        half_turn_m = 0.5 * turn_rad * p["wheelbase_m"]
        pose = move_on_arc(
            self._smoother.last_pose, travelled_m - half_turn_m, travelled_m + half_turn_m, p["wheelbase_m"]
        )
        self._smoother.add_step(dt_s, left_m, right_m, pose, *gyro)
        self._times_us.append(time_us)
        self._gyro = NO_GYRO

    def observe(self, time_us: int, sightings: Sequence[Sighting]) -> None:
        """See `Algorithm`."""
        if not self._times_us:
            self._times_us.append(time_us)
        node = self._nearest_node(time_us - int(self._parameters["sighting_delay_us"]))
        for one in sightings:
            if one.mappable and one.label is not None:
                number = self._number_of.setdefault(one.label, len(self._number_of))
                range_m = math.nan if one.range_m is None else one.range_m
                self._smoother.add_sighting(node, number, one.bearing_rad, range_m)

    def _nearest_node(self, time_us: int) -> int:
        times_us = self._times_us
        after = min(bisect_left(times_us, time_us), len(times_us) - 1)
        before = max(after - 1, 0)
        return before if time_us - times_us[before] < times_us[after] - time_us else after

    def pose(self) -> Pose:
        """See `Algorithm`."""
        if self._smoother.steps % min(self._every, _START_STEPS) == 0:
            self._solve()
        x_m, y_m, theta_rad = self._smoother.last_pose
        return x_m, y_m, math.remainder(theta_rad, math.tau)

    def map(self) -> Sequence[Landmark]:
        """See `Algorithm`."""
        self._solve()
        places = self._smoother.beacons.tolist()
        return [
            Landmark(places[number][0], places[number][1], label) for label, number in self._number_of.items()
        ]

    def _solve(self) -> None:
        if self._smoother.steps > self._solved_steps:
            self._smoother.solve()
            self._solved_steps = self._smoother.steps
