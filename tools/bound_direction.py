"""What can be known at each moment of a drive in direction only, without its truth to linearise at.

The bound that `bslam tables` prints is a Kalman filter linearised at the truth: it need not know which of all
maps that fit is the true one. Beside it stand here, at moments of the same drives,

    core      the core's smoother
    MAP       the poses and beacons that fit all readings until then best, exactly, in double, by code that
              shares nothing with the core (bslam.algorithms.smoother). It sets out from the true way and map,
              so that it need not find them.
    mean      with --mean: the mean of all ways and maps by their probability, which has the least squared
              error that there is. So many maps are drawn about the MAP, each with the way that fits it best,
              and weighted by how well they fit.

Their errors are distances of the newest place from the true one. All are told identities, and all guess a
beacon's first distance as the core does (MATH "A new beacon"), but the bound, which has a guess of its own.

    .venv/bin/python tools/bound_direction.py --seeds 1000:1060 --sigma 0.3
    .venv/bin/python tools/bound_direction.py --seeds 1000:1010 --sigma 0.3 --every 5 --until 40 --mean 300
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bslam.algorithms.posterior import posterior_mean
from bslam.algorithms.smoother import Smoother
from bslam.commands.arguments import seeds_range
from bslam.core.slam import Slam
from bslam.experiment.bound import bound
from bslam.experiment.options import Number, RunOptions, core_params
from bslam.experiment.runner import run_log
from bslam.experiment.truth import step_times_us, truth_at
from bslam.log import Log
from bslam.world.simulate import load_scenario, simulate

Array = NDArray[np.float64]

FIRST_RANGE_LN = (1.55, 0.5)
"""As firmware/bslam/smoother/cycle.c has it."""
EARLY_S = 40.0
"""Until then the drives' errors differ most."""


@dataclass(frozen=True)
class Moment:
    """How far off each is at a moment, m; `mean_m` and its standard deviation are NaN unless asked for."""

    time_s: float
    bound_m: float
    core_m: float
    map_m: float
    mean_m: float
    mean_sd_m: float


def moments(log: Log, options: RunOptions, times_s: Array, drawn: int) -> list[Moment]:
    """Of one drive. `drawn`: maps for the mean, 0 without. Without those at which the MAP does not settle."""
    assert log.truth is not None
    params = Slam.defaults() | core_params(options, log)
    time_us = step_times_us(log)
    true = truth_at(log.truth, time_us)[0]
    bound_m = np.hypot(*bound(log, time_us, true)[0][:, :2].T)
    core_m = np.hypot(*(run_log(log, options).pose - true)[:, :2].T)
    found = []
    for time_s in times_s.tolist():
        steps = int(np.searchsorted(time_us, round(1e6 * time_s), "right"))
        try:
            place, mean, sd_m = _best(log, time_us[:steps], true[:steps], params, drawn)
        except ArithmeticError:
            continue
        off_m = [float(np.hypot(*(one - true[steps - 1, :2]))) for one in (place, mean)]
        found.append(Moment(time_s, bound_m[steps - 1], core_m[steps - 1], off_m[0], off_m[1], sd_m))
    return found


def _best(
    log: Log, time_us: NDArray[np.int64], true: Array, params: Mapping[str, Number], drawn: int
) -> tuple[Array, Array, float]:
    """At the last of the steps: the place by the MAP (2,), by the mean (2,), and the latter's doubt, m."""
    assert log.beacons is not None
    smoother = Smoother(params, FIRST_RANGE_LN)
    poses = np.column_stack([true[:, :2], np.unwrap(true[:, 2])])
    gaps_us = np.diff(time_us).tolist()
    wheels = zip(gaps_us, log.odometry.a.tolist(), log.odometry.b.tolist(), poses[1:].tolist(), strict=False)
    for gap_us, left_m, right_m, (x_m, y_m, theta_rad) in wheels:
        smoother.add_step(1e-6 * gap_us, left_m, right_m, (x_m, y_m, theta_rad))
    at_m = np.column_stack([log.beacons.x_m, log.beacons.y_m])
    places = dict(zip(log.beacons.beacon_id.tolist(), at_m, strict=True))
    number: dict[int, int] = {}
    steps = np.searchsorted(time_us, log.sightings.time_us).tolist()
    seen = zip(steps, log.sightings.beacon_id.tolist(), log.sightings.bearing_rad.tolist(), strict=True)
    for step, beacon, bearing_rad in seen:
        if beacon in places and step < len(time_us):
            smoother.add_sighting(step, number.setdefault(beacon, len(number)), bearing_rad, np.nan)
    smoother.set_out_from(poses, np.array([places[beacon] for beacon in number]).reshape(-1, 2))
    smoother.solve()
    best = smoother.poses[-1, :2].copy()
    if drawn == 0:
        return best, np.full(2, np.nan), np.nan
    mean, covariance, _ = posterior_mean(smoother, drawn, np.random.default_rng(len(true)))
    return best, mean[:2], float(np.sqrt(np.trace(covariance[:2, :2])))


def _print_row(name: str, found: list[Moment]) -> None:
    if not found:
        return
    bound_m, core_m, map_m, mean_m, sd_m = np.array(
        [[one.bound_m, one.core_m, one.map_m, one.mean_m, one.mean_sd_m] for one in found]
    ).mean(axis=0)
    text = f"{name:14} bound {100 * bound_m:5.1f} cm"
    for title, error_m in (("core", core_m), ("MAP", map_m), ("mean", mean_m)):
        if np.isfinite(error_m):
            text += f"   {title} {100 * error_m:5.1f}, {error_m / bound_m:.2f} x"
    print(text + (f"   its own doubt {100 * sd_m:.1f}" if np.isfinite(sd_m) else ""))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenario", default="paper_room", help="name or TOML file (default: paper_room)")
    parser.add_argument("--seeds", type=seeds_range, default=range(1000, 1060), metavar="A:B")
    parser.add_argument("--sigma", type=float, default=0.3, metavar="M/S", help="the wheels' (default: 0.3)")
    parser.add_argument("--every", type=float, default=10.0, metavar="S", help="a moment each (default: 10)")
    parser.add_argument("--until", type=float, default=np.inf, metavar="S", help="default: the drive's end")
    parser.add_argument("--mean", type=int, default=0, metavar="N", help="maps to draw (default: no mean)")
    return parser.parse_args()


def main() -> int:
    """Measures and prints."""
    args = _arguments()
    scenario = load_scenario(args.scenario)
    found: list[Moment] = []
    asked = 0
    for count, seed in enumerate(args.seeds, 1):
        log = simulate(scenario, seed, args.sigma)
        options = RunOptions(observation="direction", association="known", filter="smoother", seed=seed)
        end_s = min(args.until, 1e-6 * float(log.odometry.time_us[-1]))
        times_s = np.arange(args.every, end_s + 1e-6, args.every)
        found += moments(log, options, times_s, args.mean)
        asked += len(times_s)
        print(f"{count} of {len(args.seeds)} drives", end="\r", flush=True)
    seeds = f"seeds {args.seeds.start}:{args.seeds.stop}"
    print(f"{args.scenario}, {seeds}, sigma {args.sigma}, every {args.every:g} s")
    _print_row(f"to {EARLY_S:g} s", [one for one in found if one.time_s <= EARLY_S])
    _print_row("later", [one for one in found if one.time_s > EARLY_S])
    _print_row("all", found)
    if len(found) < asked:
        print(f"left out: {asked - len(found)} of {asked} moments, at which the MAP did not settle")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
