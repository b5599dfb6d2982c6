"""What the wheels, and a gyro, say of the motion. Travel (steps, 2): how far left and right wheel went, m."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bslam.log import Odometry, wrap_rad
from bslam.world.scenario import Encoders, Gyro


def read_travel(time_us: NDArray[np.int64], travel_m: NDArray[np.float64]) -> Odometry:
    """The travel of every step as it stands in a log; time_us is when the steps end."""
    left_m, right_m = travel_m.T
    return Odometry("wheels", time_us, left_m.copy(), right_m.copy())


def count_ticks(encoders: Encoders, time_us: NDArray[np.int64], travel_m: NDArray[np.float64]) -> Odometry:
    """The counters, 0 at time 0, which is the first row; then after every step the whole ticks so far."""
    radii_m = np.array([encoders.left_radius_m, encoders.right_radius_m])
    ticks_per_m = encoders.ticks_per_revolution / (2.0 * math.pi * radii_m)
    start = np.zeros((1, 2))
    ticks = np.floor(np.concatenate([start, np.cumsum(travel_m, axis=0) * ticks_per_m]))
    left_ticks, right_ticks = np.mod(ticks, 2.0**encoders.counter_bits).T
    times_us = np.concatenate([np.zeros(1, dtype=np.int64), time_us])
    return Odometry("ticks", times_us, left_ticks.copy(), right_ticks.copy())


def read_gyro(
    gyro: Gyro, random: np.random.Generator, theta_rad: NDArray[np.float64], step_us: int
) -> NDArray[np.float64]:
    """Its rate in each step, rad/s (steps,), from the headings (steps + 1,) at their ends."""
    rate_radps = wrap_rad(np.diff(theta_rad)) / (step_us * 1e-6)
    bias_radps = gyro.bias_sigma_radps * random.standard_normal()
    return rate_radps + bias_radps + gyro.sigma_radps * random.standard_normal(len(rate_radps))
