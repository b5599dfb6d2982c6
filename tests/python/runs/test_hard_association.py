"""Several hypotheses at once, where the world is against them: a robot carried off amid a doubt, beacons that
look alike, a room that is its own image, things reported twice, clutter."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bslam.evaluation.consistency import POSE_95
from bslam.evaluation.failure import is_exact
from bslam.evaluation.metrics import evaluate, summarise
from bslam.evaluation.trace import Trace
from bslam.link.messages import STATES
from bslam.log import Log, wrap_rad
from bslam.options import RunOptions
from bslam.runs.runner import run_log
from bslam.world.scenario import Scenario
from bslam.world.sensor import range_sigma_m
from bslam.world.simulate import load_scenario, simulate

ROOM = load_scenario("paper_room")
BEACONS, MOST_BEACONS = 6, 80
KNOWN, BOTH, POSITION = (RunOptions(association=name) for name in ("known", "both", "position"))
CARRIED = replace(BOTH, recovery="carried")
BY_LOOKS_OR_NOT = pytest.mark.parametrize("options", [BOTH, POSITION], ids=["both", "position"])
SETTLED_STEPS = 1900  # the map has not grown for 30 s, which recovery wants
FAR_M = 2.0


class Watch:
    """What the core says of its hypotheses after each step."""

    def __init__(self) -> None:
        self.said: list[tuple[str, int, float]] = []

    def frame(self, *_: Any) -> None:
        """A step is asked when it is done."""

    def step(self, _time_us: int, _pose: tuple[float, float, float], slam: Any) -> None:
        health = slam._lib.bslam_health(slam._robot)
        self.said.append((STATES[health.state], health.hypotheses, health.lead_nats))


@dataclass(frozen=True, repr=False)
class Driven:
    """What came of a drive; rows (n + 1,) as in the trace."""

    trace: Trace
    state: NDArray[np.str_]
    alive: NDArray[np.int64]
    lead_nats: NDArray[np.float64]
    error_m: NDArray[np.float64]
    nees: NDArray[np.float64]
    map_counts: dict[str, int]

    @property
    def mean_error_m(self) -> float:
        return float(np.nanmean(self.error_m))

    @property
    def following_nees(self) -> float:
        """The mean where nothing is in doubt: there the covariance is to be believed."""
        return float(np.nanmean(self.nees[self.state == "following"]))

    @property
    def confirmed(self) -> int:
        return sum(beacon.confirmed for beacon in self.trace.beacons)


def drive(log: Log, options: RunOptions) -> Driven:
    watch = Watch()
    trace = run_log(log, options, watcher=watch)
    evaluation = evaluate(log, trace, options)
    assert evaluation is not None
    counts = summarise(log, trace, options, evaluation)["map_one_to_one"]
    state, alive, lead_nats = (np.array(column) for column in zip(*watch.said, strict=True))
    return Driven(trace, state, alive, lead_nats, evaluation.error_m, evaluation.nees, counts)


def check_doubts(driven: Driven, most: int = 2) -> None:
    """The case forces a doubt, and the core says so: then, and only then, with odds, and within its room."""
    doubting = driven.state == "doubting"
    assert driven.alive.min() == 1 and 1 < driven.alive.max() <= most
    np.testing.assert_array_equal(doubting, driven.alive > 1)
    check_odds(driven)


def check_odds(driven: Driven) -> None:
    assert np.isfinite(driven.lead_nats).all()
    assert not driven.lead_nats[driven.alive == 1].any()
    assert np.mean(driven.lead_nats[driven.alive > 1] != 0) > 0.98  # two may explain all so far alike


def check_sane(driven: Driven) -> None:
    trace = driven.trace
    assert np.isfinite(trace.pose).all() and np.isfinite(trace.covariance).all()
    assert (np.linalg.eigvalsh(trace.covariance[51:]) > 0).all()  # it was 0 at the start
    for beacon in trace.beacons:
        assert math.isfinite(beacon.x_m) and math.isfinite(beacon.y_m)
        assert (np.linalg.eigvalsh(beacon.covariance_m2) > 0).all()
    assert len({beacon.uid for beacon in trace.beacons}) == len(trace.beacons) < MOST_BEACONS
    counters = trace.counters
    assert (counters["insane"], counters["map_full"], sum(trace.refusals.values())) == (0, 0, 0)
    outcomes = [counters[name] for name in ("matched", "added", "rejected", "deferred")]
    assert sum(outcomes) == counters["sightings"] == trace.counts.sightings


def rows_of(table: Any, rows: Any) -> Any:
    """A table of the log with some of its rows."""
    return replace(table, **{name: values[rows] for name, values in arrays(table).items()})


def joined(first: Any, second: Any) -> Any:
    """A table of the log with the rows of another behind its own, in order of time."""
    both = {name: np.concatenate([values, vars(second)[name]]) for name, values in arrays(first).items()}
    order = np.argsort(both["time_us"], kind="stable")
    return replace(first, **{name: values[order] for name, values in both.items()})


def arrays(table: Any) -> dict[str, NDArray[Any]]:
    return {name: values for name, values in vars(table).items() if isinstance(values, np.ndarray)}


def looking_like(whose: dict[int, int]) -> Scenario:
    """The room with beacons that look like another."""
    beacons = (replace(one, looks_like=whose[one.beacon_id]) for one in ROOM.arena.beacons)
    return replace(ROOM, arena=replace(ROOM.arena, beacons=tuple(beacons)))


ALIKE = looking_like(dict.fromkeys(range(BEACONS), 0))
# The room about its middle: beacon 0 hangs opposite 5, 1 opposite 4, 2 opposite 3.
SYMMETRIC = looking_like({one: min(one, 5 - one) for one in range(BEACONS)})


SCENARIOS = {"room": ROOM, "alike": ALIKE, "symmetric": SYMMETRIC}


@cache
def half_a_drive(scenario: str, seed: int, sigma_mps: float = 0.3) -> Log:
    """100 s: every beacon was seen from several sides."""
    return simulate(replace(SCENARIOS[scenario], steps=2500), seed, sigma_mps)


# ---- set down elsewhere amid a doubt ----------------------------------------------------------------------


def set_down(log: Log, at: int, to: int, steps: int = 500) -> Log:
    """The drive up to a step and from another one on: somebody carried the robot there."""
    assert log.truth is not None
    at_us, to_us, end_us = (int(log.truth.time_us[step]) for step in (at, to, to + steps))

    def spliced(table: Any) -> Any:
        after = rows_of(table, (table.time_us > to_us) & (table.time_us <= end_us))
        return joined(
            rows_of(table, table.time_us <= at_us), replace(after, time_us=after.time_us - to_us + at_us)
        )

    tables = {name: spliced(vars(log)[name]) for name in ("odometry", "sightings", "truth")}
    return replace(log, **tables)


def places(log: Log, at: int) -> tuple[int, int]:
    """The next step that is FAR_M from where the robot is, and the farthest one."""
    assert log.truth is not None
    steps = np.arange(at + 200, 4400)
    away_m = np.hypot(log.truth.x_m[steps] - log.truth.x_m[at], log.truth.y_m[steps] - log.truth.y_m[at])
    return int(steps[away_m >= FAR_M][0]), int(steps[np.argmax(away_m)])


@cache
def amid_a_doubt(scenario: str, seed: int, options: RunOptions) -> tuple[Log, int]:
    """A drive, and a step in a doubt, of a map that has settled."""
    log = simulate(SCENARIOS[scenario], seed, 0.6)
    alive = drive(log, options).alive
    lasts = (alive[SETTLED_STEPS:-4] > 1) & (alive[SETTLED_STEPS + 4 :] > 1)
    return log, int(np.flatnonzero(lasts)[0]) + SETTLED_STEPS + 4


@pytest.mark.parametrize("seed", [500, 504])
@pytest.mark.parametrize("place", [0, 1], ids=["next", "farthest"])
def test_set_down_elsewhere_amid_a_doubt_it_ends_the_doubt_and_finds_itself(seed: int, place: int) -> None:
    log, at = amid_a_doubt("room", seed, CARRIED)
    driven = drive(set_down(log, at, places(log, at)[place]), CARRIED)
    check_sane(driven)
    check_odds(driven)
    assert driven.alive[at] == driven.alive.max() == 2
    lost = np.flatnonzero(driven.state == "lost")
    assert at < lost[0] <= at + 75  # 3 s
    assert (driven.alive[lost] == 1).all() and lost[-1] < at + 250
    found = driven.state[lost[-1] + 1 :]
    np.testing.assert_array_equal(found == "doubting", driven.alive[lost[-1] + 1 :] > 1)
    np.testing.assert_array_equal(driven.state[: at + 1] == "doubting", driven.alive[: at + 1] > 1)
    # Five seconds hang together: one draw, of which one in a thousand is above 16.3.
    assert driven.nees[-125:].mean() < 16.3 and driven.error_m[-125:].max() < 0.3
    assert driven.confirmed == BEACONS


def test_set_down_elsewhere_by_position_alone_it_stays_within_its_hypotheses() -> None:
    log, at = amid_a_doubt("room", 500, POSITION)
    for to in places(log, at):
        driven = drive(set_down(log, at, to), POSITION)
        assert driven.alive[at] == 2
        check_doubts(driven)
        check_sane(driven)


# ---- all beacons look alike -------------------------------------------------------------------------------


def of_one_class(log: Log) -> Log:
    """As a detector says it that knows one kind of beacon."""
    seen = log.sightings
    return replace(log, sightings=replace(seen, beacon_class=np.ones(len(seen.time_us), np.int64)))


def check_as_good_as_known(log: Log, driven: Driven) -> None:
    known = drive(log, KNOWN)
    assert driven.trace.counts.wrong_associations <= 0.01 * driven.trace.counts.sightings
    assert driven.mean_error_m < 1.2 * known.mean_error_m
    assert driven.following_nees < POSE_95
    assert is_exact(driven.map_counts)


@pytest.mark.parametrize("seed", [500, 501])
@pytest.mark.parametrize(
    ("options", "has_class"),
    [(BOTH, False), (BOTH, True), (POSITION, True)],
    ids=["both, no class", "both, one class", "position"],
)
def test_where_all_beacons_look_alike_their_places_tell_them_apart(
    seed: int, options: RunOptions, has_class: bool
) -> None:
    log = half_a_drive("alike", seed)
    log = of_one_class(log) if has_class else log
    driven = drive(log, options)
    check_doubts(driven)
    check_sane(driven)
    check_as_good_as_known(log, driven)


@pytest.mark.parametrize("seed", [500, 501])
def test_looks_that_are_anybody_s_do_no_harm(seed: int) -> None:
    log = of_one_class(half_a_drive("room", seed))
    signature = log.sightings.signature
    assert signature is not None
    mixed = np.random.default_rng(seed).permutation(len(signature))
    log = replace(log, sightings=replace(log.sightings, signature=signature[mixed]))
    driven = drive(log, BOTH)
    check_doubts(driven)
    check_sane(driven)
    check_as_good_as_known(log, driven)


# ---- a room that is its own image -------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [500, 501])
@BY_LOOKS_OR_NOT
def test_in_a_symmetric_room_the_way_tells_the_two_halves_apart(seed: int, options: RunOptions) -> None:
    log = of_one_class(half_a_drive("symmetric", seed, 1.0))
    driven = drive(log, options)
    check_doubts(driven)
    check_sane(driven)
    check_as_good_as_known(log, driven)


@pytest.mark.parametrize("place", [0, 1], ids=["next", "farthest"])
def test_set_down_in_a_symmetric_room_it_is_right_or_says_that_it_does_not_know(place: int) -> None:
    log, at = amid_a_doubt("symmetric", 501, CARRIED)
    driven = drive(set_down(log, at, places(log, at)[place]), CARRIED)
    check_sane(driven)
    check_odds(driven)
    assert driven.alive[at] == driven.alive.max() == 2
    last = slice(-125, None)
    assert (driven.state[last] != "following").all() or driven.error_m[last].max() < 0.3


# ---- each thing reported twice ----------------------------------------------------------------------------


def seen_twice(log: Log, own_noise: bool) -> Log:
    """Each sighting again in its frame, as it was or with a noise of its own."""
    again, truth, true = log.sightings, log.truth, log.beacons
    assert truth is not None and true is not None
    if own_noise:
        random, sensor = np.random.default_rng(4), ROOM.sensor
        step = np.searchsorted(truth.time_us, again.time_us)
        beacon = np.searchsorted(true.beacon_id, again.beacon_id)
        east_m, north_m = true.x_m[beacon] - truth.x_m[step], true.y_m[beacon] - truth.y_m[step]
        bearing_noise, range_noise = random.standard_normal((2, len(step)))
        true_range_m = np.hypot(east_m, north_m)
        bearing_rad = np.arctan2(north_m, east_m) - truth.theta_rad[step]
        again = replace(
            again,
            bearing_rad=wrap_rad(bearing_rad + sensor.bearing_sigma_rad * bearing_noise),
            range_m=true_range_m + range_sigma_m(sensor, true_range_m) * range_noise,
        )
    return replace(log, sightings=joined(log.sightings, again))


@cache
def driven_twice(own_noise: bool, options: RunOptions) -> Driven:
    return drive(seen_twice(half_a_drive("room", 500), own_noise), options)


OWN_NOISE = pytest.mark.parametrize("own_noise", [False, True], ids=["copied", "own noise"])


@OWN_NOISE
@BY_LOOKS_OR_NOT
def test_reported_twice_each_thing_leaves_the_pose_as_good(own_noise: bool, options: RunOptions) -> None:
    driven, once = driven_twice(own_noise, options), drive(half_a_drive("room", 500), options)
    check_doubts(driven)
    check_sane(driven)
    assert driven.mean_error_m < 1.5 * once.mean_error_m  # a copy counts as a second opinion
    assert driven.following_nees < POSE_95


@OWN_NOISE
@BY_LOOKS_OR_NOT
def test_reported_twice_each_thing_is_in_the_map_twice_at_most(own_noise: bool, options: RunOptions) -> None:
    counts = driven_twice(own_noise, options).map_counts
    assert counts["doubled"] <= BEACONS and counts["missing"] == counts["false"] == 0


# ---- clutter ----------------------------------------------------------------------------------------------


def with_clutter(log: Log, share: float, seed: int) -> Log:
    """With sightings of what is no beacon, so large a share of all: anywhere in view, with other looks."""
    seen, random = log.sightings, np.random.default_rng(seed)
    count = round(len(seen.time_us) * share / (1 - share))
    looks = simulate(replace(ROOM, steps=len(log.odometry.time_us)), seed + 1).sightings.signature
    assert looks is not None
    half_rad = log.robot.field_of_view_rad / 2
    false = replace(
        rows_of(seen, np.zeros(count, np.int64)),
        time_us=random.choice(log.odometry.time_us, count),
        beacon_id=np.full(count, -1),
        bearing_rad=random.uniform(-half_rad, half_rad, count),
        range_m=random.uniform(0.5, 8.0, count),
        signature=looks[random.integers(len(looks), size=count)],
    )
    return replace(log, sightings=joined(seen, false))


@cache
def driven_in_clutter(seed: int, options: RunOptions) -> Driven:
    return drive(with_clutter(half_a_drive("room", seed), 0.3, seed), options)


CLUTTERED = [500, 501]


@pytest.mark.parametrize("seed", CLUTTERED)
@BY_LOOKS_OR_NOT
def test_in_clutter_it_doubts_within_its_hypotheses(seed: int, options: RunOptions) -> None:
    driven = driven_in_clutter(seed, options)
    check_doubts(driven)
    check_sane(driven)


@pytest.mark.parametrize("seed", CLUTTERED)
@BY_LOOKS_OR_NOT
def test_in_clutter_every_beacon_is_mapped_and_the_pose_within_a_metre(
    seed: int, options: RunOptions
) -> None:
    driven = driven_in_clutter(seed, options)
    assert driven.map_counts["missing"] == 0 and driven.mean_error_m < 1.0


@pytest.mark.parametrize("most", [1, 2, 3, 8])
def test_no_more_hypotheses_live_than_the_setting_says(most: int) -> None:
    log = with_clutter(simulate(replace(ROOM, steps=500), 500), 0.3, 500)
    driven = drive(log, replace(BOTH, parameters=(("hypotheses", most),)))
    check_sane(driven)
    assert driven.alive.max() == most
    if most > 1:
        check_doubts(driven, most)
    else:
        assert (driven.state == "following").all() and not driven.lead_nats.any()
