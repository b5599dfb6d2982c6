"""A log as its check looks at it: way and turn up to any moment, and the sightings whose beacon is named."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.truth import odometry_increments, step_times_us
from bslam.log import Log, Robot, wrap_rad
from bslam.options import RunOptions, core_params

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

_FRAMES_MAX: Final = 4000  # more tell nothing new, and take time
_SIGHTINGS_MAX: Final = 10_000
_BEACONS_MAX: Final = 120  # so many, those seen most, make a map
_SIGHTINGS_MIN: Final = 4  # of a beacon
LEAST_SD: Final = (1e-4, 1e-3)  # rad, m: a sensor without noise may be told
_FIT_SD: Final = (5e-3, 0.01)  # that a fit takes for it at least: it begins as it is told
_NOISES: Final = ("left_speed_sd_mps", "forward_sd_per_sqrt_m", "turn_sd_per_sqrt_m", "turn_sd_per_sqrt_rad")


@dataclass(frozen=True)
class Factors:
    """What the numbers of a log are to be multiplied by."""

    way: float = 1.0
    turn: float = 1.0
    bearing: float = 1.0
    range: float = 1.0

    def __mul__(self, other: Factors) -> Factors:
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Factors(*(one * more for one, more in pairs))


@dataclass(frozen=True)
class Odometry:
    """Way along the path and turn since the start, at the odometry's stamps."""

    time_s: Floats  # (n,) from the first row
    way_m: Floats  # (n,)
    turn_rad: Floats  # (n,)

    def at(self, time_s: Floats, way: float, turn: float, bend_radpm: float) -> Floats:
        """Dead reckoning (k, 3) at `time_s`: way and turn multiplied, each metre turning by so much more."""
        theta = turn * self.turn_rad + bend_radpm * self.way_m
        half = 0.5 * np.diff(theta)
        chord = way * np.diff(self.way_m) * np.sinc(half / np.pi)
        x, y = (np.append(0.0, np.cumsum(chord * of(theta[:-1] + half))) for of in (np.cos, np.sin))
        return np.column_stack([np.interp(time_s, self.time_s, column) for column in (x, y, theta)])

    def sums(self, time_s: Floats) -> Floats:
        """Way and turn, (k, 2), at `time_s`."""
        return np.column_stack([np.interp(time_s, self.time_s, one) for one in (self.way_m, self.turn_rad)])


@dataclass(frozen=True)
class Seen:
    """Sightings in order of time."""

    time_s: Floats  # (m,)
    label: Ints  # (m,) places in `names` of the drive
    bearing_rad: Floats  # (m,) from the robot's axis
    range_m: Floats  # (m,) NaN: none
    sd: Floats  # (m, 2) of bearing and range, for a fit
    told_sd: Floats  # (m, 2) as told


@dataclass(frozen=True)
class Drive:
    """A drive, with what the filter is told of it."""

    odometry: Odometry
    seen: Seen
    names: NDArray[np.int64]  # (b,) identities
    robot: Robot
    delay_s: float
    scales: tuple[float, float]  # forward_scale and turn_scale, which `odometry` has already
    is_exact: bool  # odometry is told to have no noise at all
    is_commanded: bool  # odometry says what the robot shall do, and not what its wheels did

    @property
    def row_s(self) -> float:
        """From one row of odometry to the next."""
        return float(np.median(np.diff(self.odometry.time_s)))

    @property
    def is_usable(self) -> bool:
        """It moves, and something is seen meanwhile."""
        return len(self.names) > 0 and len(self.odometry.time_s) > 2 and bool(np.ptp(self.seen.time_s) > 0.0)

    @property
    def has_ranges(self) -> bool:
        """Distances stand beside the directions."""
        return bool(np.isfinite(self.seen.range_m).all())

    def thinned(self) -> Drive:
        """With at most about so many frames, evenly in time, sightings and beacons."""
        seen = self.seen
        often = np.argsort(-np.bincount(seen.label), kind="stable")[:_BEACONS_MAX]
        rows = np.flatnonzero(np.isin(seen.label, often))
        times_s, first, frame = np.unique(seen.time_s[rows], return_index=True, return_inverse=True)
        most = min(_FRAMES_MAX, len(times_s) * _SIGHTINGS_MAX // len(rows))
        slot = np.floor((seen.time_s[rows] - seen.time_s[0]) / np.ptp(seen.time_s) * most)
        if len(times_s) > most:
            rows = rows[np.append(True, np.diff(slot[first]) > 0.0)[frame]]
        names, label = np.unique(seen.label[rows], return_inverse=True)
        kept = Seen(*(column[rows] for column in vars(seen).values()))
        return replace(self, seen=replace(kept, label=label.astype(np.intp)), names=self.names[names])


def drive_of(log: Log, factors: Factors) -> Drive:
    """The log with its numbers multiplied; its sightings with an identity that comes a few times."""
    start_us = int(log.odometry.time_us[0])
    times_s = _seconds(step_times_us(log) - start_us)
    way_m, turn_rad = (np.append(0.0, np.cumsum(one)) for one in odometry_increments(log))
    params = core_params(RunOptions(association="known", sensor="recorded"), log)
    s, time_s = log.sightings, _seconds(log.sightings.time_us - start_us)
    has_range = np.isfinite(s.range_m)
    good = (s.beacon_id >= 0) & s.mappable & (has_range | ~has_range.any())
    good &= (time_s >= times_s[0]) & (time_s <= times_s[-1])
    _, place, count = np.unique(s.beacon_id[good], return_inverse=True, return_counts=True)
    rows = np.flatnonzero(good)[count[place] >= _SIGHTINGS_MIN]
    names, label = np.unique(s.beacon_id[rows], return_inverse=True)
    range_m = factors.range * s.range_m[rows]
    bearing_rad = wrap_rad(factors.bearing * s.bearing_rad[rows] + log.robot.sensor_yaw_rad)
    told_sd = _told_sd(log, range_m, rows)
    sd = np.where(told_sd > LEAST_SD, told_sd, _FIT_SD)
    seen = Seen(time_s[rows], label.astype(np.intp), bearing_rad, range_m, sd, told_sd)
    scales = params["forward_scale"], params["turn_scale"]
    odometry = Odometry(times_s, factors.way * scales[0] * way_m, factors.turn * scales[1] * turn_rad)
    delay_s, is_commanded = 1e-6 * params["sighting_delay_us"], log.odometry.kind == "velocity"
    is_exact = not any(params[name] for name in _NOISES)
    return Drive(odometry, seen, names, log.robot, delay_s, scales, is_exact, is_commanded)


def _seconds(time_us: NDArray[np.int64]) -> Floats:
    return np.asarray(1e-6 * time_us, dtype=np.float64)


def _told_sd(log: Log, range_m: Floats, rows: Ints) -> Floats:
    """By robot.toml, or by the sighting's own columns."""
    robot, s = log.robot, log.sightings
    parts = (
        robot.range_sigma_floor_m,
        robot.range_sigma_fraction * range_m,
        range_m**2 / robot.range_sigma_scale_m,
    )
    told = [np.full(len(rows), robot.bearing_sigma_rad), np.sqrt(sum(np.square(part) for part in parts))]
    for column, own in enumerate((s.bearing_sd_rad, s.range_sd_m)):
        if own is not None:
            told[column] = np.where(own[rows] > 0.0, own[rows], told[column])
    return np.maximum(np.column_stack(told), LEAST_SD)
