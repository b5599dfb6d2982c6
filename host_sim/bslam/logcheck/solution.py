"""One drive solved: what the verdicts rest on."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from bslam.log import Log
from bslam.logcheck.batch import (
    BEND,
    DELAY,
    TURN,
    WAY,
    YAW,
    Problem,
    State,
    cost,
    errors_at,
    fit,
    minimise,
    problem_of,
    sameness_of_curvature,
    scatter,
    standard_errors,
)
from bslam.logcheck.drive import Bools, Drive, Floats
from bslam.logcheck.flow import DELAYS_S, Flow
from bslam.logcheck.identity import contradictions
from bslam.logcheck.reference import Fitted, references
from bslam.logcheck.start import first_state
from bslam.logcheck.units import is_gross

_ALL: Final = (WAY, TURN, BEND, DELAY, YAW)
_TIMED: Final = (WAY, TURN, BEND, YAW)  # the delay stays
_FAR_D2: Final = 25.0  # that makes a sighting doubtful
_FAR_KNOWN_D2: Final = 9.0  # once odometry's noise is known
_DOUBT: Final = 1e3  # by what the noise of a doubtful sighting counts as larger
_BLOCK_S: Final = 5.0
_COLLINEAR: Final = 0.9
_AS_GOOD: Final = 1.05  # by which the flow's spread may be larger at a delay that is tried
_TRIED_MAX: Final = 9
_CLEAR: Final = 10.0  # by which the best delay costs less than any other
_FAR_S: Final = 0.15  # from it
_ROUNDS_EXACT: Final = 10  # until the noise of odometry that may have none is found to be small


@dataclass(frozen=True)
class Estimate:
    """A parameter: its value, its standard error, and what that would be by the noise that is told."""

    value: float
    error: float
    cover: float = 0.0

    @property
    def text(self) -> str:
        return f"{self.value:.3f} +- {self.error:.3f}"


@dataclass(frozen=True)
class Noise:
    """Scatter of bearings or ranges over what is told: of single sightings, and of a beacon's sums over 5 s.

    A sum is over the root of its count, so that independent errors of the told size give 1 in both.
    """

    single: float
    block: float
    errors: Floats  # (m,) over what is told


@dataclass(frozen=True)
class Solution:
    """Path, map and parameters of a drive."""

    problem: Problem
    state: State
    way: Estimate
    turn: Estimate
    bend: Estimate
    yaw: Estimate
    delay: Estimate  # beyond the told one
    delay_gain: float  # log-likelihood by it
    noise: tuple[Noise, Noise]  # bearings, ranges
    references: list[Fitted]
    is_delay_clear: bool  # no delay far from it fits about as well
    has_one_curvature: bool  # on which turn and bend cannot be told apart


def solve(log: Log, drive: Drive, flow: Flow) -> Solution:
    """The whole drive at once, from where the flow stands. The log: what beacons.csv and truth.csv say."""
    whole = problem_of(drive.thinned())
    problem, state, doubtful = _fitted(whole, np.array([1.0, 1.0, 0.0, flow.delay_s, 0.0]), _FAR_D2)
    if contradictions(whole, state):
        # Odometry is known better now than it was told, which tells labels apart that fitted either way.
        sharp = whole.step_sd * np.minimum(1.0, 2.0 * state.scale[[2, 2, 3]])
        problem, state, doubtful = _fitted(replace(whole, step_sd=sharp), state.parameters, _FAR_KNOWN_D2)
    state, is_clear = _searched(problem, state, flow)
    delay_s = float(state.parameters[DELAY]) - drive.delay_s
    error_s = float(standard_errors(problem, state, _ALL)[DELAY])
    rows = np.rint(delay_s / drive.row_s)  # between rows of odometry its noise is averaged, which a fit likes
    gain = _cost_at(problem, state, drive.delay_s)
    gain -= _cost_at(problem, state, drive.delay_s + (rows * drive.row_s if rows else delay_s))
    if gain > 0.0:  # by delay the likelihood is bumpy: its bend at a bump is more than that of the whole
        error_s = max(error_s, abs(delay_s) / math.sqrt(2.0 * gain))
    delay = Estimate(delay_s, error_s)
    rows = rows if abs(delay_s) >= drive.row_s else 0.0
    rounds = _ROUNDS_EXACT if drive.is_exact else 1
    state = fit(problem, _delayed(state, drive.delay_s + rows * drive.row_s), _TIMED, rounds)
    errors, covers = (standard_errors(problem, state, _TIMED, told).tolist() for told in (False, True))
    values = state.parameters[list(_TIMED)].tolist()
    way, turn, bend, yaw = (Estimate(*one) for one in zip(values, errors, covers, strict=True))
    noise, fitted = _noise(problem, state, ~doubtful), references(log, problem, state)
    has_one_curvature = sameness_of_curvature(problem, state) > _COLLINEAR
    return Solution(
        whole, state, way, turn, bend, yaw, delay, gain, noise, fitted, is_clear, has_one_curvature
    )


def _searched(problem: Problem, state: State, flow: Flow) -> tuple[State, bool]:
    """The state at the best of the delays that the flow allows, as a fit stays among bumps where it began;
    and whether it is clearly the best.
    """
    row_s, told_s = problem.drive.row_s, problem.drive.delay_s
    own_s = told_s + row_s * np.rint((state.parameters[DELAY] - told_s) / row_s)
    stride_s = row_s * max(1.0, np.rint(0.1 / row_s))  # whole rows, as within one its noise is averaged
    first, last = np.ceil((DELAYS_S[[0, -1]] - told_s) / stride_s)
    tried_s = told_s + stride_s * np.arange(first, last)
    tried_s = tried_s[np.interp(tried_s, DELAYS_S, flow.spreads) < _AS_GOOD * flow.spreads.min()]
    tried_s = np.append(tried_s[:: 1 + len(tried_s) // _TRIED_MAX], own_s)
    costs = np.array([_cost_tried(problem, state, delay_s) for delay_s in tried_s[:-1].tolist()])
    costs = np.append(costs, _cost_at(problem, state, own_s))
    best_s = float(tried_s[np.argmin(costs)])
    if abs(best_s - own_s) < _FAR_S or costs[-1] < costs.min() + _CLEAR:
        best_s = float(own_s)
    is_clear = bool(np.all(costs[np.abs(tried_s - best_s) > _FAR_S] > costs.min() + _CLEAR))
    if best_s == own_s:
        return state, is_clear
    moved = fit(problem, _delayed(state, best_s), _ALL, rounds=1)
    return (moved, is_clear) if _has_size(moved) else (state, False)


def _fitted(problem: Problem, parameters: Floats, far_d2: float) -> tuple[Problem, State, Bools]:
    """The problem with doubtful sightings (m,) as good as left out, and its solution."""
    state, doubtful = first_state(problem, parameters, far_d2)
    seen = problem.drive.seen
    seen = replace(seen, sd=np.where(doubtful[:, None], _DOUBT, 1.0) * seen.sd)
    problem = replace(problem, drive=replace(problem.drive, seen=seen))
    return problem, fit(problem, state, _ALL, rounds=3), doubtful


def _delayed(state: State, delay_s: float) -> State:
    parameters = state.parameters.copy()
    parameters[DELAY] = delay_s
    return replace(state, parameters=parameters)


def _cost_at(problem: Problem, state: State, delay_s: float) -> float:
    return cost(problem, minimise(problem, _delayed(state, delay_s), _TIMED))


def _cost_tried(problem: Problem, state: State, delay_s: float) -> float:
    """The same; infinite where it is bought with a way, and so a map, of another size."""
    found = minimise(problem, _delayed(state, delay_s), _TIMED)
    return cost(problem, found) if _has_size(found) else math.inf


def _has_size(state: State) -> bool:
    """Whether the way is of the size that odometry tells: units are right by now."""
    return not is_gross(max(float(state.parameters[WAY]), 1e-9))


def _noise(problem: Problem, state: State, kept: Bools) -> tuple[Noise, Noise]:
    seen, free = problem.drive.seen, np.sqrt(scatter(problem, state, _TIMED)[1])
    errors = errors_at(problem, state)[problem.step_sd.size :].reshape(-1, 2)[kept]
    errors *= (seen.sd / seen.told_sd)[kept]
    slots = np.floor(seen.time_s[kept] / _BLOCK_S) * len(problem.drive.names) + seen.label[kept]
    _, slot, count = np.unique(slots, return_inverse=True, return_counts=True)
    bearing, range_ = (
        Noise(_sigma(of) / free[group], _sigma(np.bincount(slot, of) / np.sqrt(count)), of)
        for group, of in enumerate(errors.T)
    )
    return bearing, range_


def _sigma(values: Floats) -> float:
    """Standard deviation, by the share of a normal distribution that lies within it."""
    return float(np.quantile(np.abs(values), 0.683))
