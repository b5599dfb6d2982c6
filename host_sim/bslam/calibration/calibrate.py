"""Odometry against the truth: its scale, its noise, and how far it runs ahead."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.evaluation.align import wrap_angle
from bslam.evaluation.truth import odometry_increments, step_times_us, truth_at
from bslam.log import Log, Truth

# Errors of odometry are compared over windows: shorter ones see jitter of the truth, longer ones leave too
# few.
_WINDOW_S: Final = 2.0
_MOVING_MPS: Final = 0.02  # a window counts as driven from this mean speed up
_LEADS_US: Final = range(-100_000, 500_001, 10_000)
_FEWEST_WINDOWS: Final = 20


@dataclass(frozen=True)
class Estimate:
    """A figure with its standard error."""

    value: float
    error: float


@dataclass(frozen=True)
class Calibration:
    """What one log says of its odometry."""

    windows: int
    lead_us: (
        int  # odometry at t shows what the truth does at t + lead; 0 for wheels that are read, not commanded
    )
    scales: dict[str, Estimate]  # forward_scale, turn_scale: true over measured
    noise: dict[str, float]  # parameters of the core

    @property
    def parameters(self) -> dict[str, float]:
        """For the core, by the names in the C headers."""
        return {name: one.value for name, one in self.scales.items()} | self.noise


@dataclass(frozen=True)
class _Windows:
    """Sums over windows of steps in which the truth is known throughout and the robot drives."""

    duration_s: NDArray[np.float64]  # (w,)
    steps: int  # in a window
    measured: NDArray[np.float64]  # (w, 2) forward m, turn rad
    true: NDArray[np.float64]  # (w, 2)


def calibrate(log: Log) -> Calibration:
    """Scale and noise of the log's odometry. Raises BslamError if its truth is missing or too sparse."""
    truth = log.truth
    if truth is None:
        raise BslamError(f"{log.name}: has no truth; allowed: a log with truth to calibrate with")
    if not np.isfinite(truth.theta_rad).all():
        raise BslamError(f"{log.name}: its truth lacks headings; allowed: theta_rad in each row")
    commanded = log.odometry.kind == "velocity"
    lead_us = _best_lead_us(log, truth) if commanded else 0
    windows = _windows(log, truth, lead_us)
    if len(windows.true) < _FEWEST_WINDOWS:
        raise BslamError(
            f"{log.name}: truth covers {len(windows.true)} driven stretches of {_WINDOW_S:g} s; "
            f"allowed: at least {_FEWEST_WINDOWS} (a sparse truth does not do)"
        )
    scales = {
        name: _scale(windows.measured[:, column], windows.true[:, column], commanded)
        for column, name in enumerate(("forward_scale", "turn_scale"))
    }
    residual = windows.true - windows.measured * [one.value for one in scales.values()]
    noise = _noise_of_commands(windows, residual) if commanded else _noise_of_wheels(log, windows, residual)
    return Calibration(len(windows.true), lead_us, scales, noise)


def as_toml(calibration: Calibration, log_name: str) -> str:
    """A file for --params."""
    lines = [f"# Odometry calibrated on {log_name}, {calibration.windows} windows of {_WINDOW_S:g} s."]
    lines += [f"{name} = {value:.6g}" for name, value in calibration.parameters.items()]
    return "\n".join(lines) + "\n"


def _windows(log: Log, truth: Truth, lead_us: int) -> _Windows:
    times_us = step_times_us(log)
    poses, known = truth_at(truth, times_us + lead_us)
    true = _true_increments(poses)
    measured = np.column_stack(odometry_increments(log))
    steps = max(1, round(_WINDOW_S * 1e6 / float(np.median(np.diff(times_us)))))
    count = len(true) // steps

    def cut(rows: NDArray[np.float64]) -> NDArray[np.float64]:
        return rows[: count * steps].reshape(count, steps, -1).sum(axis=1)

    duration_s = cut(np.diff(times_us)[:, None] * 1e-6)[:, 0]
    whole = cut((~(known[1:] & known[:-1]))[:, None].astype(np.float64))[:, 0] == 0.0
    sums, true_sums = cut(measured), cut(np.nan_to_num(true))
    driven = whole & (np.abs(true_sums[:, 0]) > _MOVING_MPS * duration_s)
    return _Windows(duration_s[driven], steps, sums[driven], true_sums[driven])


def _true_increments(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Way along the robot's own forward axis and turn of each step, (n, 2)."""
    delta = np.diff(poses, axis=0)
    turn = wrap_angle(delta[:, 2])
    course = poses[:-1, 2] + 0.5 * turn
    forward = delta[:, 0] * np.cos(course) + delta[:, 1] * np.sin(course)
    return np.column_stack([forward, turn])


def _best_lead_us(log: Log, truth: Truth) -> int:
    """The lead at which measured and true turn rates agree best: turning has the sharpest edges."""
    times_us = step_times_us(log)
    measured = odometry_increments(log)[1]

    def agreement(lead_us: int) -> float:
        poses, known = truth_at(truth, times_us + lead_us)
        rows = known[1:] & known[:-1]
        true = wrap_angle(np.diff(poses[:, 2]))[rows]
        norm = float(np.linalg.norm(true) * np.linalg.norm(measured[rows]))
        return float(true @ measured[rows]) / norm if norm > 0.0 else 0.0

    return max(_LEADS_US, key=agreement)


def _scale(measured: NDArray[np.float64], true: NDArray[np.float64], commanded: bool) -> Estimate:
    """True over measured, by least squares in the direction in which the noise acts.

    What is commanded is exact and the motion errs: true = s measured + noise. What is read errs about an
    exact motion: measured = true / s + noise; the first form would come out too small there.
    """
    cause, effect = (measured, true) if commanded else (true, measured)
    power = float(cause @ cause)
    slope = float(cause @ effect) / power
    slope_error = float(np.std(effect - slope * cause)) / np.sqrt(power)
    if commanded:
        return Estimate(slope, float(slope_error))
    return Estimate(1.0 / slope, float(slope_error) / slope**2)


def _noise_of_commands(windows: _Windows, residual: NDArray[np.float64]) -> dict[str, float]:
    """Errors that grow with the square root of time while the robot moves."""
    per_sqrt_s = np.sqrt(np.mean(residual**2 / windows.duration_s[:, None], axis=0))
    return {"forward_sd_per_sqrt_s": float(per_sqrt_s[0]), "turn_sd_per_sqrt_s": float(per_sqrt_s[1])}


def _noise_of_wheels(log: Log, windows: _Windows, residual: NDArray[np.float64]) -> dict[str, float]:
    """Noise of each wheel's speed reading, independent at each step: a sum of k has sqrt(k) times it."""
    half_m = 0.5 * log.robot.wheelbase_m * residual[:, 1]
    step_s = windows.duration_s / windows.steps
    noise = {}
    for name, error_m in (("left", residual[:, 0] - half_m), ("right", residual[:, 0] + half_m)):
        noise[f"{name}_speed_sd_mps"] = float(np.sqrt(np.mean((error_m / step_s) ** 2) / windows.steps))
    return noise
