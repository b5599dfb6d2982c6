"""How honest an estimator is where directions tell little: NEES of pose and beacons over drives.

The robot stands, turns on the spot, or drives at a beacon that is dead ahead, so that nothing tells how far
away beacons are. Its wheels jitter as the paper's do. A consistent filter has a pose NEES of 3 and a beacon
NEES of 2; its own doubt of a distance stands beside the error.
"""

import argparse
import math
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bslam.core import Slam
from bslam.experiment.defaults import DIRECTION_ONLY
from bslam.experiment.options import FILTERS
from bslam.motion import move_on_arc

STEP_US = 40_000
BASELINE_M = 0.4
BEARING_SD_RAD = 0.78 * math.pi / 180.0
# Where a beacon of unknown distance may be: a factor of e^0.5 about 4.5 m.
RANGE_M, RANGE_LN_SD = 4.5, 0.5
STEP_M = 0.004

Array = NDArray[np.float64]


class Way(NamedTuple):
    """How the wheels truly go at each step, in m, and how many beacons stand around, or dead ahead."""

    wheels_m: tuple[float, float]
    beacons: int
    is_ahead: bool = False


WAYS: Final = {
    "stands": Way((0.0, 0.0), 4),
    "turns": Way((-STEP_M, STEP_M), 4),
    "drives at a beacon": Way((STEP_M, STEP_M), 1, is_ahead=True),
}


class Ended(NamedTuple):
    """How a drive ended. Of beacons the means over them; distances in m."""

    pose_nees: float
    beacon_nees: float
    doubt_m: float
    error_m: float
    definiteness: float  # least over all covariances of smallest by largest eigenvalue


def places(way: Way, steps: int, random: np.random.Generator) -> Array:
    """(n, 2): where the beacons are, in m. One ahead is not reached."""
    range_m = RANGE_M * np.exp(RANGE_LN_SD * random.standard_normal(way.beacons))
    if way.is_ahead:
        return np.column_stack([range_m + STEP_M * steps, np.zeros(way.beacons)])
    direction_rad = random.uniform(-math.pi, math.pi, way.beacons)
    return range_m[:, None] * np.column_stack([np.cos(direction_rad), np.sin(direction_rad)])


def nees(error: Array, covariance: Array) -> float:
    return float(error @ np.linalg.solve(covariance, error))


def drive(filter_name: str, way: Way, seed: int, steps: int, sigma_mps: float) -> Ended:
    """One drive of so many steps."""
    random = np.random.default_rng(seed)
    place_m = places(way, steps, random)
    params = {
        "filter": FILTERS.index(filter_name),
        "velocity_states": 1,
        "left_speed_sd_mps": sigma_mps,
        "right_speed_sd_mps": sigma_mps,
        "wheelbase_m": BASELINE_M,
        "bearing_sd_rad": BEARING_SD_RAD,
    }
    slam = Slam(params | DIRECTION_ONLY.get(filter_name, {}), beacons_max=6)
    pose, count = (0.0, 0.0, 0.0), len(place_m)
    for step in range(steps):
        if step:
            pose = move_on_arc(pose, *way.wheels_m, BASELINE_M)
            read_m = np.array(way.wheels_m) + sigma_mps * STEP_US * 1e-6 * random.standard_normal(2)
            slam.odometry("wheels", step * STEP_US, *read_m.tolist())
        ray = place_m - np.array(pose[:2])
        bearing = np.arctan2(ray[:, 1], ray[:, 0]) - pose[2] + BEARING_SD_RAD * random.standard_normal(count)
        seen = [math.remainder(one, math.tau) for one in bearing.tolist()]
        slam.sightings(step * STEP_US, seen, [math.nan] * count, list(range(count)), [True] * count)
    return _end(slam, np.array(pose), place_m)


def _end(slam: Slam, pose: Array, place_m: Array) -> Ended:
    error = np.array(slam.pose()) - pose
    error[2] = math.remainder(error[2], math.tau)
    beacons = slam.beacons()
    covariances = [slam.pose_covariance(), *(one.covariance for one in beacons)]
    off_m = [np.array([one.x_m, one.y_m]) - place_m[one.label] for one in beacons]
    along = [place_m[one.label] / np.hypot(*place_m[one.label]) for one in beacons]
    doubt_m = [math.sqrt(u @ one.covariance @ u) for u, one in zip(along, beacons, strict=True)]
    return Ended(
        nees(error, covariances[0]),
        float(np.mean([nees(*pair) for pair in zip(off_m, covariances[1:], strict=True)])),
        float(np.mean(doubt_m)),
        float(np.mean([abs(u @ off) for u, off in zip(along, off_m, strict=True)])),
        float(min(np.divide(*np.linalg.eigvalsh(one)[[0, -1]]) for one in covariances)),
    )


def table(
    filters: list[str], seeds: range, steps: int, sigma_mps: float, show: Callable[[str], None]
) -> None:
    """A line for each way and filter."""
    show("| robot | filter | pose NEES | beacon NEES, median drive | distance: own doubt, error, m |")
    show("|---|---|---|---|---|")
    for name, way in WAYS.items():
        for filter_name in filters:
            ended = [drive(filter_name, way, seed, steps, sigma_mps) for seed in seeds]
            pose, beacon, doubt_m, error_m, _ = np.array(ended).T
            means = f"{np.mean(pose):.2f} | {np.mean(beacon):.3g}, {np.median(beacon):.3g}"
            show(f"| {name} | {filter_name} | {means} | {np.median(doubt_m):.2f}, {np.median(error_m):.2f} |")


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "--filters", nargs="+", choices=FILTERS, default=["invariant", "similarity", "smoother"]
    )
    parser.add_argument("--seeds", type=int, default=20, help="drives of each (default: 20)")
    parser.add_argument("--steps", type=int, default=600, help="of 40 ms (default: 600)")
    parser.add_argument("--sigma", type=float, default=0.3, help="of the wheels' speed, m/s (default: 0.3)")
    options = parser.parse_args(argv)
    table(
        options.filters,
        range(options.seeds),
        options.steps,
        options.sigma,
        lambda line: print(line, flush=True),
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
