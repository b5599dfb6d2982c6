"""How sightings move while the robot does: signs and gross factors, without a map and without a start.

From one sighting of a beacon to its next, the distance shrinks by the way times the bearing's cosine, and the
bearing falls by the turn: two equations, linear in what way and turn are to be multiplied by.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from bslam.log import wrap_rad
from bslam.logcheck.drive import Drive, Floats, Ints

_LAGS_S: Final = (0.4, 1.2)
_LONGEST: Final = 2.5  # of the lag
DELAYS_S: Final = np.arange(-0.6, 1.61, 0.05)
_ROUNDS: Final = 12
_PAIRS_MIN, _PAIRS_MAX = 20, 6000
_DELAY_GAIN: Final = 0.03  # a delay other than the told one must explain so much more


@dataclass(frozen=True)
class Flow:
    """What way and turn are to be multiplied by, with standard errors; the way's is NaN without ranges."""

    way: float
    turn: float  # if none of the scatter were odometry's
    way_error: float
    turn_error: float
    turn_most: float  # if all were
    delay_s: float
    spread: float  # what is left of the changes of bearings and ranges, in no unit
    spreads: Floats  # (d,) the same at other delays, DELAYS_S
    turned_rad: Floats  # (n,) by odometry, between the sightings of a pair
    shifted_rad: Floats  # (n,) of the bearing, less what the way explains


def best_flow(drive: Drive) -> Flow | None:
    """At the delay that explains most; None where too few beacons are seen again within a short while."""
    pairs = _pairs(drive)
    if len(pairs) < _PAIRS_MIN or not np.any(np.diff(drive.odometry.sums(drive.seen.time_s), axis=0)):
        return None
    told = _flow_at(drive, pairs, drive.delay_s)
    flows = [_flow_at(drive, pairs, delay_s) for delay_s in DELAYS_S.tolist()]
    best = min(flows, key=lambda flow: flow.spread)
    best = best if best.spread < told.spread * (1.0 - _DELAY_GAIN) else told
    return replace(best, spreads=np.array([flow.spread for flow in flows]))


def _pairs(drive: Drive) -> Ints:
    """Rows (n, 2) of sightings of one beacon, a lag apart."""
    found = [np.empty((0, 2), dtype=np.intp)]
    for label in range(len(drive.names)):
        rows = np.flatnonzero(drive.seen.label == label)
        time_s = drive.seen.time_s[rows]
        for lag_s in np.maximum(_LAGS_S, 2.0 * drive.row_s):
            later = np.searchsorted(time_s, time_s + lag_s)
            near = later < len(rows)
            near[near] = time_s[later[near]] - time_s[near] <= _LONGEST * lag_s
            found.append(np.column_stack([rows[near], rows[later[near]]]))
    pairs = np.concatenate(found)
    return pairs[:: 1 + len(pairs) // _PAIRS_MAX]


def _flow_at(drive: Drive, pairs: Ints, delay_s: float) -> Flow:
    """The factors at that delay: rows by way and by turn, for changes of bearings and of ranges."""
    seen, (i, j) = drive.seen, pairs.T
    sums = drive.odometry.sums(seen.time_s - delay_s)
    way_m, turn_rad = (sums[j] - sums[i]).T
    shift_rad = wrap_rad(seen.bearing_rad[j] - seen.bearing_rad[i])
    middle_rad = seen.bearing_rad[i] + 0.5 * shift_rad
    cos, sin = np.cos(middle_rad), np.sin(middle_rad)
    x_m, y_m = drive.robot.sensor_x_m, drive.robot.sensor_y_m
    if drive.has_ranges:
        nearness = 2.0 / (seen.range_m[i] + seen.range_m[j])
        ranges = np.column_stack([-cos * way_m, turn_rad * (y_m * cos - x_m * sin)])
        groups = [(ranges, seen.range_m[j] - seen.range_m[i])]
    else:  # as if far away: the turn alone
        nearness, groups = np.zeros(len(i)), []
    by_turn = -turn_rad * (1.0 + nearness * (x_m * cos + y_m * sin))
    bearings = np.column_stack([nearness * sin * way_m, by_turn])
    factors, errors, spread = _robust([(bearings, shift_rad), *groups])
    left_rad = shift_rad - bearings[:, 0] * np.nan_to_num(factors[0])
    weight = 1.0 / np.maximum(np.abs(left_rad), np.mean(np.abs(left_rad)) + 1e-12)
    most = float(weight @ left_rad**2 / (weight @ (by_turn * left_rad) or np.nan))
    (way, turn), (way_error, turn_error) = factors, errors
    return Flow(way, turn, way_error, turn_error, most, delay_s, spread, np.empty(0), turn_rad, left_rad)


def _robust(groups: list[tuple[Floats, Floats]]) -> tuple[list[float], list[float], float]:
    """Both factors, their standard errors, and the spread; each group of rows in units of its own scatter."""
    free = [column for column in (0, 1) if any(np.any(rows[:, column]) for rows, _ in groups)]
    factors, errors = np.full(2, np.nan), np.full(2, np.nan)
    left = [values for _, values in groups]
    for _ in range(_ROUNDS):
        scatter = [float(np.mean(np.abs(one))) + 1e-12 for one in left]
        weights = [
            1.0 / (size * np.sqrt(np.maximum(np.abs(one) / size, 0.1)))
            for one, size in zip(left, scatter, strict=True)
        ]
        pairs = list(zip(weights, groups, strict=True))
        rows = np.concatenate([weight[:, None] * of[:, free] for weight, (of, _) in pairs])
        values = np.concatenate([weight * of for weight, (_, of) in pairs])
        square = rows.T @ rows + 1e-12 * np.eye(len(free))
        factors[free] = np.linalg.solve(square, rows.T @ values)
        left = [of - columns[:, free] @ factors[free] for columns, of in groups]
    errors[free] = np.sqrt(np.diag(np.linalg.inv(square)))
    return factors.tolist(), errors.tolist(), float(np.exp(np.mean(np.log(scatter))))
