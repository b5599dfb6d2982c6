"""What could be known at best of a whole drive that was seen by cameras.

The reference for `bslam tables --sensor camera`, on the same drives, by code that shares nothing with the
core: the exact MAP (bslam.algorithms.smoother) of all that the wheels and the pictures say, with hindsight.
It is told which beacon each sighting shows, and sets out from the true way and map. Printed is the mean
distance of its way from the true one. What errs then is what the pictures say.

They do not say how their errors hang together, so the sightings are believed in several ways: as they are
told, directions alone, with three times the standard deviation, and with the size of each beacon, for each
kind that it is taken for, estimated with all else. With --sizes the distances to each beacon
are first divided by what they err in the median over the drive, which only the truth tells. With --moments N
there is no hindsight: looked at is where the robot is at N moments of each drive, by what it was told until
then, and where its own filter has it.

    .venv/bin/python tools/bound_drive.py --seeds 1000:1020 --sigma 0.6
    .venv/bin/python tools/bound_drive.py --seeds 1000:1020 --sigma 0.6 --sizes
    .venv/bin/python tools/bound_drive.py --seeds 1000:1020 --sigma 1.0 --moments 6
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bslam.algorithms.noise import range_sd_m
from bslam.algorithms.smoother import Smoother
from bslam.commands.arguments import positive_count
from bslam.core.slam import Slam
from bslam.experiment.align import Rigid
from bslam.experiment.camera import TOLD_THRESHOLD, CameraStore, camera_log
from bslam.experiment.metrics import evaluate
from bslam.experiment.options import Number, RunOptions, core_params
from bslam.experiment.runner import run_log
from bslam.experiment.truth import gyro_rates, truth_at
from bslam.log import Log, Sightings
from bslam.rig import load_rig
from bslam.world.simulate import load_scenario
from camera_drives import arguments
from measure_restart import part

KNOWN_SD_M, UNKNOWN_SD_M = 1e-3, 1e3


class Way(NamedTuple):
    """How sightings are believed."""

    factor: float  # of their standard deviations
    has_range: bool
    rounds: int = 0  # of estimating by what the sizes err; 0: that is noise of each distance


WAYS = {
    "as told": Way(1.0, True),
    "directions alone": Way(1.0, False),
    "a third as good": Way(3.0, True),
    "sizes estimated": Way(1.0, True, 20),
}


def best_errors_m(log: Log, params: Mapping[str, Number], way: Way, place_sd_m: float) -> NDArray[np.float64]:
    """How far off the MAP is at each step of a log, (n,) m; beacons' true places are told so well."""
    assert log.truth is not None
    true = truth_at(log.truth, log.odometry.time_us)[0]
    from_start = Rigid(*true[0, [2, 0, 1]].tolist()).inverse()
    poses = from_start.poses(true)
    poses[:, 2] = np.unwrap(poses[:, 2])
    sizes = _Sizes(log) if way.rounds and log.sightings.range_scale_sd is not None else None
    scales: list[NDArray[np.float64]] = [np.ones(0 if sizes is None else sizes.count)]
    steps: list[NDArray[np.float64]] = []
    found, beacons_m = poses, None
    while True:  # the joint optimum by turns: poses and places, then sizes
        smoother = Smoother(params)
        _add_steps(smoother, log, poses)
        told = log if sizes is None else sizes.without(scales[-1])
        _add_sightings(smoother, told, params, from_start, way, place_sd_m)
        smoother.set_out_from(found, beacons_m)
        smoother.solve()
        found, beacons_m = smoother.poses, smoother.beacons
        if sizes is None or len(scales) > way.rounds:
            return np.hypot(*(found[:, :2] - poses[:, :2]).T)
        steps.append(sizes.likeliest(found, beacons_m) - scales[-1])
        scales.append(_extrapolated(scales, steps))


def _extrapolated(
    points: list[NDArray[np.float64]], steps: list[NDArray[np.float64]], memory: int = 5
) -> NDArray[np.float64]:
    """Where a repetition that goes from points[k] to points[k] + steps[k] ends, by Anderson's mixing."""
    along = np.column_stack([np.zeros_like(points[-1]), *np.diff(points[-memory:], axis=0)])
    change = np.column_stack([np.zeros_like(steps[-1]), *np.diff(steps[-memory:], axis=0)])
    share = np.linalg.lstsq(change, steps[-1], rcond=1e-9)[0]
    return points[-1] + steps[-1] - (along + change) @ share


class _Sizes:
    """By what the distances are too long of each beacon and kind that it is taken for: `count` factors."""

    def __init__(self, log: Log) -> None:
        seen = log.sightings
        assert log.beacons is not None
        assert seen.range_sd_m is not None and seen.range_scale_sd is not None
        numbers = {one: number for number, one in enumerate(log.beacons.beacon_id.tolist())}
        kinds = np.zeros(len(seen.time_us)) if seen.beacon_class is None else seen.beacon_class
        self._log, self._range_sd_m, self._scale_sd = log, seen.range_sd_m, seen.range_scale_sd
        self._poses = np.array([_step(log, row) for row in range(len(seen.time_us))], dtype=np.intp)
        self._of: list[tuple[int, NDArray[np.intp]]] = []
        for beacon, number in numbers.items():
            of_beacon = (seen.beacon_id == beacon) & np.isfinite(seen.range_m)
            for kind in np.unique(kinds[of_beacon]):
                self._of.append((number, np.flatnonzero(of_beacon & (kinds == kind))))
        self.count = len(self._of)

    def without(self, scales: NDArray[np.float64]) -> Log:
        """The log with distances of the right sizes, of which nothing is in doubt."""
        factor = np.ones(len(self._range_sd_m))
        for scale, (_, rows) in zip(scales, self._of, strict=True):
            factor[rows] = scale
        seen = self._log.sightings
        right = replace(
            seen, range_m=seen.range_m / factor, range_sd_m=self._range_sd_m / factor, range_scale_sd=None
        )
        return replace(self._log, sightings=right)

    def likeliest(self, poses: NDArray[np.float64], beacons_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """The factors that fit best if all is where it is said to be, and each is 1 but for its doubt."""
        scales = np.ones(self.count)
        for k, (number, rows) in enumerate(self._of):
            distance_m = np.hypot(*(beacons_m[number] - poses[self._poses[rows], :2]).T)
            weight = 1 / np.maximum(self._range_sd_m[rows], 1e-6) ** 2
            prior = 1 / np.maximum(np.median(self._scale_sd[rows]), 1e-3) ** 2
            fits = prior + np.sum(weight * distance_m * self._log.sightings.range_m[rows])
            scales[k] = fits / (prior + np.sum(weight * distance_m**2))
        return scales


def _step(log: Log, row: int) -> int:
    """The pose that a sighting was taken from."""
    return int(np.argmin(np.abs(log.odometry.time_us - log.sightings.time_us[row])))


def _add_steps(smoother: Smoother, log: Log, poses: NDArray[np.float64]) -> None:
    odometry = log.odometry
    gaps_s = np.diff(odometry.time_us, prepend=odometry.time_us[0]) * 1e-6
    gyros = (one[-len(gaps_s) + 1 :] for one in gyro_rates(log))  # the first row leads to the first pose
    moves = zip(gaps_s[1:], odometry.a[1:], odometry.b[1:], poses[1:], *gyros, strict=True)
    for dt_s, left_m, right_m, pose, *gyro in moves:
        x_m, y_m, theta_rad = pose.tolist()
        smoother.add_step(dt_s, left_m, right_m, (x_m, y_m, theta_rad), *gyro)


def _add_sightings(
    smoother: Smoother,
    log: Log,
    params: Mapping[str, Number],
    from_start: Rigid,
    way: Way,
    place_sd_m: float,
) -> None:
    assert log.beacons is not None
    places_m = from_start.points(np.column_stack([log.beacons.x_m, log.beacons.y_m])).tolist()
    number = {
        one: smoother.add_beacon(x_m, y_m, place_sd_m)
        for one, (x_m, y_m) in zip(log.beacons.beacon_id.tolist(), places_m, strict=True)
    }
    for row, seen in enumerate(log.sightings.beacon_id.tolist()):
        if seen in number:
            bearing_rad, range_m, *sds = _told(log.sightings, row, params)
            distance_m = range_m if way.has_range else math.nan
            smoother.add_sighting(
                _step(log, row), number[seen], bearing_rad, distance_m, *(way.factor * sd for sd in sds)
            )


def _told(seen: Sightings, row: int, params: Mapping[str, Number]) -> tuple[float, float, float, float]:
    """Direction, distance, and their standard deviations: the sighting's own, or by the parameters."""
    range_m, sd_rad, sd_m = float(seen.range_m[row]), float(params["bearing_sd_rad"]), math.nan
    if seen.bearing_sd_rad is not None and seen.bearing_sd_rad[row] > 0:
        sd_rad = float(seen.bearing_sd_rad[row])
    if not math.isnan(range_m):
        own_m = 0.0 if seen.range_sd_m is None else float(seen.range_sd_m[row])
        scale = 0.0 if seen.range_scale_sd is None else float(seen.range_scale_sd[row])
        sd_m = math.hypot(own_m, scale * range_m) if own_m > 0 else float(range_sd_m(params, range_m))
    return float(seen.bearing_rad[row]), range_m, sd_rad, sd_m


def with_true_sizes(log: Log) -> Log:
    """The log with the distances to each beacon right in the median."""
    assert log.truth is not None and log.beacons is not None
    seen, range_m = log.sightings, log.sightings.range_m.copy()
    at_m = truth_at(log.truth, seen.time_us)[0][:, :2]
    places = zip(log.beacons.beacon_id, log.beacons.x_m, log.beacons.y_m, strict=True)
    for beacon, x_m, y_m in places:
        rows = (seen.beacon_id == beacon) & np.isfinite(range_m)
        if rows.any():
            true_m = np.hypot(x_m - at_m[rows, 0], y_m - at_m[rows, 1])
            range_m[rows] /= np.median(range_m[rows] / true_m)
    return replace(log, sightings=replace(seen, range_m=range_m, range_scale_sd=None))


RANGED_WAYS = {name: way for name, way in WAYS.items() if way.has_range}


def at_moments_m(
    log: Log, options: RunOptions, params: Mapping[str, Number], moments: int
) -> NDArray[np.float64]:
    """How far off the MAP of what was told until then is, by each way to believe it with distances, and the
    filter: (moments, ways + 1) m. NaN where the MAP of a part is not found.
    """
    found = evaluate(log, run_log(log, options), options, align=False)
    assert found is not None
    errors_m = np.full((moments, len(RANGED_WAYS) + 1), math.nan)
    for row, share in zip(errors_m, (np.arange(moments) + 0.5) / moments, strict=True):
        end = int(share * len(log.odometry.time_us))
        so_far = part(log, 0, end)
        try:
            maps_m = [best_errors_m(so_far, params, way, UNKNOWN_SD_M)[-1] for way in RANGED_WAYS.values()]
        except ArithmeticError:
            continue
        row[:] = *maps_m, found.error_m[end]
    return errors_m


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--sizes", action="store_true", help="distances to each beacon right in the median, by the truth"
    )
    parser.add_argument(
        "--moments", type=positive_count, metavar="N", help="without hindsight, so often in each drive"
    )


def main() -> int:
    """Measures and prints."""
    args = arguments(__doc__, range(1000, 1020), _add_arguments)
    scenario, rig, store = load_scenario(args.scenario), load_rig(args.rig), CameraStore(args.store)
    options = RunOptions(sensor="camera", association="known", sigma_mps=args.sigma, observation="distance")
    errors_m: list[NDArray[np.float64]] = []
    for count, seed in enumerate(args.seeds, 1):
        log = camera_log(scenario, seed, args.sigma, None, rig, store, TOLD_THRESHOLD)
        params = Slam.defaults() | core_params(options, log)
        log = with_true_sizes(log) if args.sizes else log
        errors_m.append(
            at_moments_m(log, options, params, args.moments)
            if args.moments
            else np.array([[best_errors_m(log, params, way, UNKNOWN_SD_M).mean() for way in WAYS.values()]])
        )
        print(f"{count} of {len(args.seeds)} drives", flush=True)
    seeds = f"seeds {args.seeds.start}:{args.seeds.stop}"
    sizes = ", sizes" if args.sizes else ""
    print(f"{args.scenario}, {rig.name}, {seeds}, sigma {args.sigma}; told identities{sizes}")
    if args.moments:
        lost = int(np.isnan(np.array(errors_m)[:, :, 0]).sum())
        print(f"without hindsight, {args.moments} moments of each drive; of {lost} the MAP was not found")
    names = (*RANGED_WAYS, "the filter") if args.moments else (*WAYS,)
    means_m = np.array([np.nanmean(one, axis=0) for one in errors_m])
    for name, column in zip(names, means_m.T, strict=True):
        print(f"{name}: {100 * column.mean():.1f} cm, worst drive {100 * column.max():.0f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
