"""Drives on which something is not as the filter is told: the rows of `bslam stress`, and their figures."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from bslam.evaluation.consistency import share_interval_95
from bslam.runs.sources import ScenarioSource
from bslam.world.arena import Arena, Beacon, Wall
from bslam.world.crowd import Mover
from bslam.world.planner import RoutePlanner
from bslam.world.scenario import Gaps, Scenario, Slips, Start, check_together, load_scenario

ENCODERS_MPS: Final = 0.05
"""Wheel-speed sigma of real encoders: with more, a slip or a loop is lost in the noise."""
NOMINAL: Final = "nominal"

Change = Callable[[Scenario], Scenario]


@dataclass(frozen=True)
class Row:
    """One thing that is not as told. `elsewhere`: in a world of its own, which nominal is no measure of."""

    meaning: str
    change: Change
    sigma_mps: float | None = None  # of the wheels' speed; None: as is asked for
    elsewhere: bool = False
    resume_sd: tuple[float, float] | None = None  # m, rad that the filter is told after an interruption


def _with(**tables: Any) -> Change:
    """Puts a table of the scenario in place, or of a mapping those keys into the table that is there."""

    def change(scenario: Scenario) -> Scenario:
        made: dict[str, Any] = {
            name: one if is_dataclass(one) else replace(getattr(scenario, name), **one)
            for name, one in tables.items()
        }
        return replace(scenario, **made)

    return change


def _with_people(count: int, scenario: Scenario) -> Scenario:
    """So many people who go to and fro on ways that a robot could go, too; it waits for those ahead."""
    driving, start = scenario.driving, (scenario.start.x_m, scenario.start.y_m)
    planner = RoutePlanner(scenario.arena, driving.cell_m, driving.path_clearance_m, start)
    random = np.random.default_rng(count)  # in every drive the same ways
    movers = list(scenario.movers)
    while len(movers) < len(scenario.movers) + count:
        ends = random.choice(planner.places, 2)
        way = planner.route(*((x_m, y_m) for x_m, y_m in ends.tolist()))
        if len(way) > 1:
            movers.append(Mover(tuple(way), 0.8, 0.25, 0.0, hides=True, looks="person"))
    return replace(scenario, movers=tuple(movers), driving=replace(driving, keep_off_m=0.5))


# Of a loop: it begins and ends with rounds among four beacons, which it does not see on the way.
_SPEED_MPS, _ROUND_M, _ROUNDS_S = 1.0, 2.0, (15.0, 52.0)
_LOOP_BEACONS_M = ((4.0, 1.0), (3.0, -2.0), (-3.0, 2.0), (1.0, -3.0))
_IN_VIEW_M = 6.0


def _loop(length_m: float, scenario: Scenario) -> Scenario:
    """The robot and its sensors on a round through an empty hall, whose beacons are at its start."""
    step_s = scenario.step_us * 1e-6
    before, after = (_circle(_ROUND_M, one / step_s, step_s) for one in _ROUNDS_S)
    radius_m = length_m / math.tau
    away = _circle(radius_m, length_m / _SPEED_MPS / step_s, step_s)
    turn_rad = np.concatenate([before, away, after])
    heading_rad = np.concatenate([[0.0], np.cumsum(turn_rad)])
    chord_rad, chord_m = heading_rad[:-1] + 0.5 * turn_rad, _SPEED_MPS * step_s * np.sinc(turn_rad / math.tau)
    x_m, y_m = (np.concatenate([[0.0], np.cumsum(chord_m * of(chord_rad))]) for of in (np.cos, np.sin))
    time_us = np.arange(len(x_m)) * scenario.step_us
    half_m = 2.0 * radius_m + 10.0
    corners = [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)]
    walls = tuple(Wall(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    beacons = tuple(Beacon(number, at) for number, at in enumerate(_LOOP_BEACONS_M))
    return replace(
        scenario,
        steps=len(turn_rad),
        arena=Arena(walls, beacons),
        areas=(),
        movers=(),
        slips=None,
        gaps=None,
        start=Start(0.0, 0.0, 0.0),
        driving=replace(scenario.driving, waypoints=()),
        sensor=replace(scenario.sensor, range_max_m=_IN_VIEW_M),
        recorded=tuple(zip(*(one.tolist() for one in (time_us, x_m, y_m, heading_rad)), strict=True)),
    )


def _circle(radius_m: float, steps: float, step_s: float) -> Any:
    """Turns to the left, rad a step, of so many steps on a circle."""
    return np.full(round(steps), _SPEED_MPS * step_s / radius_m)


ROWS: Final[Mapping[str, Row]] = {
    NOMINAL: Row("all as told", _with()),
    "range-scale": Row("distances 5 % too long", _with(mismatch={"range_scale": 1.05})),
    "range-bias": Row("distances 5 % off, a beacon", _with(mismatch={"range_scale_sd": 0.05})),
    "sensor-yaw": Row("sensor turned by 2 deg", _with(mismatch={"sensor_yaw_rad": math.radians(2.0)})),
    "sensor-place": Row("sensor 0.1 m ahead", _with(mismatch={"sensor_x_m": 0.1})),
    "delay": Row("sightings 100 ms late", _with(mismatch={"delay_us": 100_000})),
    "one-radius": Row("left wheel 3 % larger", _with(mismatch={"left_radius_scale": 1.03})),
    "both-radii": Row(
        "both wheels 3 % larger", _with(mismatch={"left_radius_scale": 1.03, "right_radius_scale": 1.03})
    ),
    "wheelbase": Row("wheelbase 3 % longer", _with(mismatch={"wheelbase_scale": 1.03})),
    "outliers": Row("10 % of bearings anywhere", _with(sensor={"bearing_outlier_share": 0.1})),
    "misses": Row("30 % of sightings missing", _with(sensor={"miss_share": 0.3})),
    "people": Row("four people", partial(_with_people, 4)),
    "sightings-0.3s": Row("sighting noise over 0.3 s", _with(sensor={"noise_time_s": 0.3})),
    "sightings-1s": Row("sighting noise over 1 s", _with(sensor={"noise_time_s": 1.0})),
    "wheels-0.2s": Row("wheel noise over 0.2 s", _with(wheels={"noise_time_s": 0.2})),
    "gaps": Row("odometry missing 6 x 2 s", _with(gaps=Gaps(6, (2.0, 2.0)))),
    "slip": Row("four slips of 0.5 to 1.5 s", _with(slips=Slips(4)), ENCODERS_MPS),
    **{
        f"loop-{length_m}m": Row(
            f"{length_m} m without beacons", partial(_loop, length_m), ENCODERS_MPS, elsewhere=True
        )
        for length_m in (30, 100, 150)
    },
    "resume": Row(
        "carried 3 x, told 1 m, 1 rad",
        _with(gaps=Gaps(3, (5.0, 5.0), blind=True, carried_sd_m=1.0, carried_sd_rad=1.0)),
        ENCODERS_MPS,
        resume_sd=(1.0, 1.0),
    ),
}
"""By name, in the order of the table. Whatever a row says, the filter is told what the scenario says."""


@dataclass(frozen=True)
class StressSource(ScenarioSource):
    """A drive of a scenario on which that row's thing is not as told."""

    row: str = field(kw_only=True)

    @property
    def name(self) -> str:
        return f"{super().name}_{self.row}"

    def world(self) -> Scenario:
        """The scenario as the row has it. Raises BslamError where it cannot be."""
        scenario = load_scenario(self.scenario)
        changed = ROWS[self.row].change(scenario)
        check_together(changed, f"scenario {scenario.name}, row {self.row}")
        return changed


@dataclass(frozen=True)
class RowFigures:
    """What came of a row's runs. Means are over the runs that have the figure, NaN where none has."""

    row: str
    sigma_mps: float
    runs: int
    error_cm: tuple[float, ...]  # mean position error, a run
    nees: tuple[float, ...]  # mean, a run
    last_50s_cm: float
    inside_95: float  # share of steps
    lost: int  # runs that diverged, or failed otherwise before their end
    failed: int | None  # runs that failed, lost ones included; None: unseen for so long, all do
    to_nominal: float | None  # of the mean errors; None: nothing to compare with

    @property
    def mean_cm(self) -> float:
        return _mean(self.error_cm)

    @property
    def mean_nees(self) -> float:
        return _mean(self.nees)

    @property
    def lost_interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the share of runs that are lost."""
        return share_interval_95(self.lost, self.runs)

    def as_json(self) -> dict[str, Any]:
        """For summary.json."""
        low, high = self.lost_interval
        return {
            "row": self.row,
            "meaning": ROWS[self.row].meaning,
            "sigma_mps": self.sigma_mps,
            "runs": self.runs,
            "position_error_mean_m": self.mean_cm / 100.0,
            "position_error_last_50s_m": self.last_50s_cm / 100.0,
            "ratio_to_nominal": self.to_nominal,
            "nees_mean": self.mean_nees,
            "nees_inside_95": self.inside_95,
            "lost": self.lost,
            "lost_share_95": [low, high],
            "failed": self.failed,
        }


def row_figures(entries: Sequence[Mapping[str, Any]]) -> list[RowFigures]:
    """A row's figures from the entries of its runs, which say their `row`, in the order of the entries."""
    groups: dict[tuple[str, float], list[Mapping[str, Any]]] = {}
    for entry in entries:
        groups.setdefault((entry["row"], entry["sigma_mps"]), []).append(entry)
    nominal_cm = {sigma: _mean(_errors_cm(group)) for (row, sigma), group in groups.items() if row == NOMINAL}
    return [
        _figures(row, sigma_mps, group, nominal_cm.get(sigma_mps))
        for (row, sigma_mps), group in groups.items()
    ]


def _figures(
    row: str, sigma_mps: float, entries: Sequence[Mapping[str, Any]], nominal_cm: float | None
) -> RowFigures:
    errors_cm, elsewhere = _errors_cm(entries), ROWS[row].elsewhere
    return RowFigures(
        row=row,
        sigma_mps=sigma_mps,
        runs=len(entries),
        error_cm=errors_cm,
        nees=_values(entries, "nees_mean"),
        last_50s_cm=100.0 * _mean(_values(entries, "position_error_last_50s_m")),
        inside_95=_mean(_values(entries, "nees_inside_95")),
        lost=sum(bool(entry["diverged"]) for entry in entries),
        failed=None if elsewhere else sum(bool(entry["failed"]) for entry in entries),
        to_nominal=None if elsewhere or nominal_cm is None else _mean(errors_cm) / nominal_cm,
    )


def _errors_cm(entries: Sequence[Mapping[str, Any]]) -> tuple[float, ...]:
    return tuple(100.0 * one["position_error_m"]["mean"] for one in entries if "position_error_m" in one)


def _values(entries: Sequence[Mapping[str, Any]], key: str) -> tuple[float, ...]:
    return tuple(one[key] for one in entries if key in one)


def _mean(values: Sequence[float]) -> float:
    return statistics.fmean(values) if values else math.nan
