"""Faults of a drive: slip, bumps, kidnapping, outliers, look-alikes, long runs in float32."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bslam.core.slam import Slam
from bslam.evaluation.metrics import evaluate
from bslam.evaluation.trace import Trace
from bslam.faults.promise import STEP_S, Fault, Measured
from bslam.log import Log
from bslam.options import RunOptions, core_params
from bslam.runs.runner import run_log
from bslam.world.simulate import load_scenario, simulate

SIGMA_MPS = 0.6
FIRST_SEED = 500  # the recovery was tuned on seeds 100 to 159
CARRIED_M = 2.0
NOTICED_S, FOUND_S, FOUND_M = 2.0, 5.0, 0.3
BEACONS_ROOM = 80
DISTANCE_M, DIRECTION_M = 0.2, 0.5  # after a restart in a kept map
DIRECTION_SHARE = 0.5  # of drives: in the others one of the three is not recognised


def drive(seed: int, scenario: str = "paper_room", sigma_mps: float = SIGMA_MPS) -> Log:
    """A simulated drive."""
    return simulate(load_scenario(scenario), seed, sigma_mps, "speedometer")


class Follower:
    """A filter that is fed parts of a drive, one after the other, as if they were one."""

    def __init__(
        self, log: Log, *, recovery: bool, map_blob: bytes | None = None, direction_only: bool = False
    ) -> None:
        options = RunOptions(
            association="both", sigma_mps=SIGMA_MPS, recovery="carried" if recovery else "off"
        )
        params = core_params(options, log)
        self.slam = Slam(params, beacons_max=BEACONS_ROOM, seeds=log.seeds)
        if map_blob is not None:
            self.slam.load_map(map_blob)
        self.log = log
        self.direction_only = direction_only
        self.step = 0
        self.error_m: list[float] = []
        self.lost: list[bool] = []
        self.contradicted: list[bool] = []

    def feed(self, first: int, end: int) -> None:
        """Rows of the drive, on the clock of what was fed before."""
        log, slam = self.log, self.slam
        odometry, seen, truth = log.odometry, log.sightings, log.truth
        assert truth is not None
        period_us = int(odometry.time_us[1] - odometry.time_us[0])
        at = np.searchsorted(truth.time_us, odometry.time_us)
        bounds = np.searchsorted(seen.time_us, [odometry.time_us, odometry.time_us + 1])
        for row in range(first, end):
            self.step += 1
            time_us = self.step * period_us
            slam.odometry("wheels", time_us, odometry.a[row], odometry.b[row])
            rows = slice(*bounds[:, row])
            self.contradicted.append(self._contradicts(rows))
            assert seen.signature is not None
            slam.sightings(
                time_us,
                seen.bearing_rad[rows].tolist(),
                [math.nan] * (rows.stop - rows.start) if self.direction_only else seen.range_m[rows].tolist(),
                [-1] * (rows.stop - rows.start),
                seen.mappable[rows].tolist(),
                signature=seen.signature[rows],
            )
            x, y, _ = slam.pose()
            self.error_m.append(math.hypot(x - truth.x_m[at[row]], y - truth.y_m[at[row]]))
            self.lost.append(slam.is_lost)

    def _contradicts(self, rows: slice) -> bool:
        """A beacon is seen a metre or more, and five deviations, from where the filter expects it."""
        seen, true = self.log.sightings, self.log.beacons
        assert true is not None
        x, y, theta = self.slam.pose()
        lower = self.slam.pose_covariance_lower()
        for one in range(rows.start, rows.stop):
            angle, range_m = theta + seen.bearing_rad[one], seen.range_m[one]
            place = np.flatnonzero(true.beacon_id == seen.beacon_id[one])[0]
            off_m = math.hypot(
                x + range_m * math.cos(angle) - true.x_m[place],
                y + range_m * math.sin(angle) - true.y_m[place],
            )
            sd_m = math.sqrt(lower[0] + lower[2] + lower[5] * range_m**2) + 0.1 * range_m
            if off_m > max(1.0, 5 * sd_m):
                return True
        return False


@dataclass(frozen=True)
class Carried:
    """What became of one robot that was carried."""

    seed: int
    false_alarms: int
    noticed_s: float
    found_s: float

    @property
    def is_kept(self) -> bool:
        return not self.false_alarms and self.noticed_s <= NOTICED_S and self.found_s <= FOUND_S


def kidnap(seed: int, recovery: bool) -> Carried:
    """A robot is carried 2 m or more, to where its own drive comes by later, and looks around there."""
    log = drive(seed)
    random = np.random.default_rng(10_000 + seed)
    cut = int(random.integers(2200, 2800))
    truth = log.truth
    assert truth is not None
    while True:
        to = int(random.integers(cut + 200, 4500))
        if math.hypot(truth.x_m[cut] - truth.x_m[to], truth.y_m[cut] - truth.y_m[to]) >= CARRIED_M:
            break
    robot = Follower(log, recovery=recovery)
    robot.feed(0, cut)
    alarms = int(np.sum(np.diff(np.array(robot.lost, dtype=int)) == 1))
    robot.feed(to, to + 500)
    lost = _first(robot.lost, cut)
    contradicted = min(_first(robot.contradicted, cut), lost)  # it may notice what is no metre off, too
    found = next(
        (k for k in range(lost, robot.step) if not robot.lost[k] and robot.error_m[k] <= FOUND_M), None
    )
    return Carried(
        seed,
        alarms,
        (lost - contradicted) * STEP_S if lost < robot.step else math.inf,
        (found - lost) * STEP_S if found is not None else math.inf,
    )


def _first(flags: list[bool], start: int) -> int:
    return next((k for k in range(start, len(flags)) if flags[k]), len(flags))


def _kidnapping(seeds: int, protected: bool) -> Measured:
    runs = [kidnap(FIRST_SEED + seed, protected) for seed in range(seeds)]
    kept = sum(one.is_kept for one in runs)
    noticed = sum(one.noticed_s <= NOTICED_S for one in runs)
    found = sum(one.found_s <= FOUND_S for one in runs)
    alarms = sum(one.false_alarms for one in runs)
    text = f"{kept} of {seeds}: {noticed} noticed, {found} found in time, {alarms} false alarms"
    return Measured(kept == seeds, text)


def _quiet(seeds: int, protected: bool) -> Measured:
    alarms = 0
    for seed in range(seeds):
        log = drive(FIRST_SEED + seed)
        if not protected:  # as if nothing but position told beacons apart: looks are everybody's
            signature = log.sightings.signature
            assert signature is not None
            mixed = np.random.default_rng(seed).permutation(len(signature))
            log = replace(log, sightings=replace(log.sightings, signature=signature[mixed]))
        robot = Follower(log, recovery=True)
        robot.feed(0, len(log.odometry.time_us))
        alarms += int(np.sum(np.diff(np.array(robot.lost, dtype=int)) == 1))
        if not protected:
            alarms += max(robot.error_m) > 1.0
    return Measured(alarms == 0, f"{alarms} false alarms in {seeds} runs of 200 s")


def _restart(seeds: int, direction_only: bool, protected: bool) -> Measured:
    """Switched on in a kept map, at an unknown place. Directions alone need a third beacon."""
    good = elsewhere = 0
    needed, within_m = (3, DIRECTION_M) if direction_only else (2, DISTANCE_M)
    for seed in range(seeds):
        log = drive(FIRST_SEED + seed)
        first = Follower(log, recovery=True)
        first.feed(0, 3000)
        blob = first.slam.save_map()
        second = Follower(log, recovery=protected, map_blob=blob, direction_only=direction_only)
        # Five seconds of driving from the first frame in which so many beacons show.
        times = log.sightings.time_us[log.sightings.time_us >= log.odometry.time_us[3500]]
        shown, counts = np.unique(times, return_counts=True)
        start = int(np.searchsorted(log.odometry.time_us, shown[counts >= needed][0]))
        second.feed(3500, start + 125)
        is_near = second.error_m[-1] <= within_m
        good += not second.lost[-1] and is_near
        elsewhere += not second.lost[-1] and not is_near
    kept = elsewhere == 0 and good >= (DIRECTION_SHARE * seeds if direction_only else seeds)
    seen = f"5 s after {needed} beacons were in view"
    lost = seeds - good - elsewhere
    return Measured(
        kept, f"{good} of {seeds} within {within_m} m {seen}, {elsewhere} elsewhere, {lost} still lost"
    )


def _disturbed(change: str, seed: int, protected: bool) -> Measured:
    """The drive with wheels that spin, or with a bump that turns the robot, which the wheels do not feel."""
    log = drive(seed)
    cut, steps = 2500, 75
    robot = Follower(log, recovery=protected)
    robot.feed(0, cut)
    before_m = robot.error_m[-1]
    if change == "slip":
        for _ in range(steps):
            robot.step += 1
            robot.slam.odometry("wheels", robot.step * 40_000, 0.06, 0.06)
    else:  # ten seconds of the drive that the wheels do not tell
        cut += 250
    robot.feed(cut, cut + 500)
    after = np.array(robot.error_m[-375:])
    mean_m, most_m = float(after.mean()), max(robot.error_m[-500:])
    text = f"error {before_m:.2f} m before, {most_m:.2f} m at most, {mean_m:.2f} m from 5 s on"
    return Measured(mean_m < 0.2, text)


def _slips(seeds: int, protected: bool) -> Measured:
    drives = range(FIRST_SEED, FIRST_SEED + seeds)
    good = sum(_disturbed("slip", seed, protected).kept for seed in drives)
    return Measured(good >= seeds / 2, f"{good} of {seeds} below 20 cm from 5 s on")


def with_outliers(log: Log, rate: float, seed: int) -> Log:
    """A share of the sightings seen anywhere in view: identity stays, the place is uniform."""
    random = np.random.default_rng(seed)
    seen = log.sightings
    wrong = random.random(len(seen.time_us)) < rate
    half = log.robot.field_of_view_rad / 2
    bearing = np.where(wrong, random.uniform(-half, half, len(wrong)), seen.bearing_rad)
    range_m = np.where(wrong, random.uniform(0.5, 8.0, len(wrong)), seen.range_m)
    return replace(log, sightings=replace(seen, bearing_rad=bearing, range_m=range_m))


def _mapped(log: Log, trace: Trace) -> int:
    """Confirmed beacons within a metre of the true one of their label."""
    true = log.beacons
    assert true is not None
    place = {one: (x, y) for one, x, y in zip(true.beacon_id, true.x_m, true.y_m, strict=True)}
    return sum(
        one.confirmed and math.dist(place[one.label], (one.x_m, one.y_m)) <= 1.0 for one in trace.beacons
    )


def without_outliers(dirty: Log, clean: Log) -> Log:
    """What is left of the drive when every outlier is known and taken out: no filter can do better."""
    seen = dirty.sightings
    right = (seen.bearing_rad == clean.sightings.bearing_rad) & (seen.range_m == clean.sightings.range_m)
    columns = {
        name: value[right]
        for name, value in vars(seen).items()
        if isinstance(value, np.ndarray) and len(value) == len(right)
    }
    return replace(dirty, sightings=replace(seen, **columns))


def _outliers(seeds: int, protected: bool) -> Measured:
    clean, dirty, best, false_beacons = [], [], [], 0
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        log = drive(seed)
        options = RunOptions(association="known", sigma_mps=SIGMA_MPS)
        clean.append(_mean_error_m(log, options)[0])
        if not protected:
            options = replace(options, parameters=(("gate_d2", 0),))
        spoiled = with_outliers(log, 0.4, seed)
        best.append(_mean_error_m(without_outliers(spoiled, log), options)[0])
        error_m, trace = _mean_error_m(spoiled, options)
        dirty.append(error_m)
        false_beacons += sum(one.confirmed for one in trace.beacons) - _mapped(log, trace)
    ratio = float(np.mean(dirty) / np.mean(clean))
    errors = f"error {100 * np.mean(dirty):.1f} cm, clean {100 * np.mean(clean):.1f}: {ratio:.2f}"
    bound = f"{np.mean(best) / np.mean(clean):.2f} with every outlier known"
    text = f"{errors} ({bound}); {false_beacons} false beacons"
    return Measured(ratio <= 1.5 and false_beacons == 0, text)


def _mean_error_m(log: Log, options: RunOptions) -> tuple[float, Trace]:
    trace = run_log(log, options)
    evaluation = evaluate(log, trace, options)
    assert evaluation is not None
    return float(np.nanmean(evaluation.error_m)), trace


def _look_alikes(seeds: int, protected: bool) -> Measured:
    wrong = sightings = 0
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        log = drive(seed, "lookalikes", 0.3)
        association = "both" if protected else "nearest"
        counts = run_log(log, RunOptions(association=association, sigma_mps=0.3)).counts
        wrong, sightings = wrong + counts.wrong_associations, sightings + counts.sightings
    share = wrong / sightings
    return Measured(share <= 0.03, f"{100 * share:.2f} % of {sightings} sightings fused with another beacon")


def _hours(protected: bool) -> Measured:
    log = drive(FIRST_SEED, sigma_mps=0.3)
    kind = "invariant" if protected else "standard"
    options = RunOptions(association="known", filter=kind, sigma_mps=0.3, velocity_states=protected)
    single_m, single = _mean_error_m(log, options)
    duplicate_m, double = _mean_error_m(log, replace(options, real="double"))
    evaluation = evaluate(log, single, options)
    assert evaluation is not None
    mean_nees = float(np.nanmean(evaluation.nees))
    repairs = single.counters["insane"] + double.counters["insane"]
    kept = abs(single_m / duplicate_m - 1) < 0.1 and 1.5 <= mean_nees <= 4.0 and repairs == 0
    errors = f"200 s: float {100 * single_m:.2f} cm, double {100 * duplicate_m:.2f}"
    text = f"{errors}; NEES {mean_nees:.2f}, {repairs} repairs"
    return Measured(kept, text)


def drive_faults(seeds: int) -> list[Fault]:
    """The rows of slip, bumps, kidnapping, outliers, look-alikes and hours."""
    looks = "identity by looks"
    return [
        Fault(
            "kidnapping",
            f"lost {NOTICED_S:g} s after the first contradiction, within {FOUND_M:g} m {FOUND_S:g} s later",
            "recovery",
            partial(_kidnapping, seeds),
        ),
        Fault("no kidnapping", "no false alarm", looks, partial(_quiet, seeds)),
        Fault(
            "restart in a kept map",
            f"within {DISTANCE_M:g} m 5 s after two beacons were in view",
            "recovery",
            partial(_restart, seeds, False),
        ),
        Fault(
            "restart by directions alone",
            f"half of them within {DIRECTION_M:g} m 5 s after three beacons, the others still lost",
            "recovery",
            partial(_restart, seeds, True),
        ),
        Fault("wheel slip", "half of them below 20 cm again after 5 s", "recovery", partial(_slips, seeds)),
        Fault("bump", "below 20 cm again after 5 s", "recovery", partial(_disturbed, "bump", 503)),
        Fault(
            "40 % outlier sightings",
            "at most 1.5 times the clean error, no false beacon",
            "the gate",
            partial(_outliers, seeds),
        ),
        Fault(
            "look-alike beacons",
            "at most 3 % fused with another",
            "position and looks",
            partial(_look_alikes, seeds),
        ),
        Fault(
            "long run in float32",
            "within 10 % of double, NEES near 3, no repair",
            "the invariant filter",
            _hours,
        ),
    ]
