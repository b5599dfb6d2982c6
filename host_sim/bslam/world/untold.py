"""What a drive has that the filter is not told: another truth, noise that hangs together, slips, gaps.

A scenario without any of it makes the same drive to the bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.world.scenario import Gaps, Scenario, Slips

Matrix = NDArray[np.float64]

# Which wheels slip: one of these, drawn each time.
_SLIPPING: Final = np.array([[True, False], [False, True], [True, True]])
_MOVES: Final = 100  # so many are tried for one that leads to where the robot can be


def as_built(scenario: Scenario) -> Scenario:
    """The scenario with the sensor and the wheelbase that the robot truly has."""
    off, sensor = scenario.mismatch, scenario.sensor
    mounted = replace(
        sensor,
        x_m=sensor.x_m + off.sensor_x_m,
        y_m=sensor.y_m + off.sensor_y_m,
        yaw_rad=sensor.yaw_rad + off.sensor_yaw_rad,
        delay_us=sensor.delay_us + off.delay_us,
    )
    wheelbase_m = scenario.body.wheelbase_m * off.wheelbase_scale
    return replace(scenario, sensor=mounted, body=replace(scenario.body, wheelbase_m=wheelbase_m))


def coloured(white: Matrix, step_s: float, time_s: float) -> Matrix:
    """Gauss-Markov noise of sd 1 and correlation time `time_s` from white noise of sd 1; time is the last
    axis but one. The white noise itself where `time_s` is 0.
    """
    if time_s == 0.0:
        return white
    keep = math.exp(-step_s / time_s)
    noise, fresh = white.copy(), math.sqrt(1.0 - keep * keep)
    for k in range(1, white.shape[-2]):
        noise[..., k, :] = keep * noise[..., k - 1, :] + fresh * white[..., k, :]
    return noise


def _stretches_us(events: Slips | Gaps | None, random: np.random.Generator, end_us: int) -> NDArray[np.int64]:
    """When they begin and end, (count, 2): one in each of `count` equal parts of the middle half."""
    if events is None:
        return np.empty((0, 2), dtype=np.int64)
    part_us = end_us / 2.0 / events.count
    lasts_us = 1e6 * random.uniform(*events.lasts_s, events.count)
    first_us = end_us / 4.0 + part_us * np.arange(events.count)
    first_us += (part_us - lasts_us) * random.random(events.count)
    return np.stack([first_us, first_us + lasts_us], axis=1).astype(np.int64)


def within(time_us: NDArray[np.int64], spans_us: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which times (n,) lie in one of the stretches."""
    first_us, end_us = spans_us.T
    inside = (time_us[:, np.newaxis] > first_us) & (time_us[:, np.newaxis] <= end_us)
    return inside.any(axis=1)


@dataclass(frozen=True)
class Mishaps:
    """What takes the robot where its wheels do not say.

    `grip` (steps, 2) is the share of each wheel's roll that moves the robot; None: all of it. `off` are steps
    in which the motors are off. `carried` are moves (k, 3) after a step, x, y m and turn rad: the first that
    can be is made.
    """

    grip: Matrix | None = None
    off: frozenset[int] = frozenset()
    carried: Mapping[int, Matrix] = field(default_factory=dict)


NO_MISHAPS: Final = Mishaps()


def mishaps(scenario: Scenario, slipping: np.random.Generator, gaps: np.random.Generator) -> Mishaps:
    """Slips, and who is carried in a gap. `gaps` is as for `gaps_us`."""
    return Mishaps(_grip(scenario, slipping), *_carried(scenario, gaps))


def gaps_us(scenario: Scenario, random: np.random.Generator) -> NDArray[np.int64]:
    """When odometry is missing, (gaps, 2)."""
    return _stretches_us(scenario.gaps, random, scenario.steps * scenario.step_us)


def _carried(scenario: Scenario, random: np.random.Generator) -> tuple[frozenset[int], Mapping[int, Matrix]]:
    """Steps in which the motors are off, and moves at the end of each gap."""
    spans_us, gaps = gaps_us(scenario, random), scenario.gaps
    if gaps is None or not gaps.carries:
        return NO_MISHAPS.off, NO_MISHAPS.carried
    off = frozenset(np.flatnonzero(within(_step_ends_us(scenario), spans_us)).tolist())
    sd = (gaps.carried_sd_m, gaps.carried_sd_m, gaps.carried_sd_rad)
    moves = random.standard_normal((len(spans_us), _MOVES, 3)) * sd
    last_steps = spans_us[:, 1] // scenario.step_us - 1
    return off, dict(zip(last_steps.tolist(), moves, strict=True))


def _grip(scenario: Scenario, random: np.random.Generator) -> Matrix | None:
    slips = scenario.slips
    if slips is None:
        return None
    ends_us = _step_ends_us(scenario)
    grip = np.ones((scenario.steps, 2))
    for span_us in _stretches_us(slips, random, int(ends_us[-1])):
        slipping = _SLIPPING[random.integers(len(_SLIPPING))]
        grip[np.ix_(within(ends_us, span_us[np.newaxis]), slipping)] = 1.0 - slips.ratio
    return grip


def _step_ends_us(scenario: Scenario) -> NDArray[np.int64]:
    return np.arange(1, scenario.steps + 1, dtype=np.int64) * scenario.step_us
