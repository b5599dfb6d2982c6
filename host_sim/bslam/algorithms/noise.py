"""The noise of wheels and sensor by the core's parameters, as MATH (5) and (13) have it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

# Of a way, m², or a turn, rad²: readings without noise would weigh infinitely.
_VARIANCE_MIN: Final = 1e-12


def motion_covariance(
    p: Mapping[str, int | float], dt_s: Any, left_m: Any, right_m: Any
) -> NDArray[np.float64]:
    """Covariance (..., 2, 2) of (way m, turn rad) of steps (...), from the wheels' travel, MATH (5)."""
    dt_s, left_m, right_m = (np.asarray(one, dtype=np.float64) for one in (dt_s, left_m, right_m))
    base_m = p["wheelbase_m"]
    way, turn = np.abs(0.5 * (left_m + right_m)), np.abs(right_m - left_m) / base_m
    grown = p["travel_sd_per_sqrt_m"] ** 2
    left = (p["left_speed_sd_mps"] * dt_s) ** 2 + grown * np.abs(left_m)
    right = (p["right_speed_sd_mps"] * dt_s) ** 2 + grown * np.abs(right_m)
    moving_s = np.where((left_m != 0.0) | (right_m != 0.0), dt_s, 0.0)
    covariance = np.empty((*np.shape(dt_s), 2, 2))
    covariance[..., 0, 0] = (
        0.25 * (left + right)
        + p["forward_sd_per_sqrt_s"] ** 2 * moving_s
        + p["forward_sd_per_sqrt_m"] ** 2 * way
        + _VARIANCE_MIN
    )
    covariance[..., 1, 1] = (
        (left + right) / base_m**2
        + p["turn_sd_per_sqrt_s"] ** 2 * moving_s
        + p["turn_sd_per_sqrt_m"] ** 2 * way
        + p["turn_sd_per_sqrt_rad"] ** 2 * turn
        + _VARIANCE_MIN
    )
    covariance[..., 0, 1] = covariance[..., 1, 0] = 0.5 * (right - left) / base_m
    return covariance


NO_GYRO: Final = (math.nan, math.nan)
"""Rate and noise where no gyro tells."""


def measured_motion(
    p: Mapping[str, int | float],
    dt_s: Any,
    left_m: Any,
    right_m: Any,
    gyro_radps: Any,
    gyro_sd_radps: Any,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(way m, turn rad) (..., 2) of steps by wheels and gyro, scaled, and its covariance, MATH (5), (6).

    gyro_radps: NaN where there is none. gyro_sd_radps: its noise.
    """
    dt_s, left_m, right_m, rate, rate_sd = (
        np.asarray(one, dtype=np.float64) for one in (dt_s, left_m, right_m, gyro_radps, gyro_sd_radps)
    )
    read = np.stack([0.5 * (left_m + right_m), (right_m - left_m) / p["wheelbase_m"]], axis=-1)
    covariance = motion_covariance(p, dt_s, left_m, right_m)
    told = np.isfinite(rate)
    total = covariance[..., 1, 1] + np.where(told, rate_sd * dt_s, 1.0) ** 2
    gain = np.where(told[..., np.newaxis], covariance[..., 1] / total[..., np.newaxis], 0.0)
    off_rad = np.where(told, rate, 0.0) * dt_s - read[..., 1]
    read = read + gain * off_rad[..., np.newaxis]
    covariance = covariance - gain[..., :, np.newaxis] * covariance[..., np.newaxis, 1, :]
    return read * np.array([p["forward_scale"], p["turn_scale"]]), covariance


def range_sd_m(p: Mapping[str, int | float], range_m: Any) -> Any:
    """Standard deviation of a distance, MATH (13)."""
    fraction, per_m = p["range_sd_fraction"], p["range_sd_per_m"]
    return np.sqrt(p["range_sd_floor_m"] ** 2 + (fraction * range_m) ** 2 + (per_m * range_m**2) ** 2)
