"""From which side a beacon is seen again, against those that it might be taken for.

Around each beacon are the core's sectors; known are those from which it was seen so far, by the true poses.
Each time that a beacon comes into view, after a second at least without a sighting of it, it is asked how
many sectors lie between the robot's and the nearest known one: for that beacon, if it was seen before
(`own`), and for each other that was, is not in view, and stands in the same direction to DIRECTION_RAD and,
where there is a distance, is as far off to a fifth (`other`). Prints both and the log odds of own against
other, for beacons known from one sector and from more. What side_low and side_high are chosen by (MATH
equation 47).
`.venv/bin/python tools/measure_sides.py building20 lookalikes --seeds 100:104`
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.core.slam import library
from bslam.experiment.camera import UNTOLD_THRESHOLD
from bslam.experiment.sources import CameraSource, ScenarioSource
from bslam.experiment.truth import truth_at
from bslam.log import Log

SECTORS = len(library("float", 20).ffi.new("bslam_look_t *").seen_from)
APART_MAX = 4  # and more
OUT_OF_VIEW_US = 1_000_000
DIRECTION_RAD, DISTANCE_SHARE = 0.15, 0.2

Counts = NDArray[
    np.int64
]  # (2, 2, APART_MAX + 1): known from one sector or more; own, other; sectors between


class Sides:
    """From where a drive's beacons were seen, and how they come into view."""

    def __init__(self, place: NDArray[np.float64]) -> None:
        self.place = place  # (n, 2)
        self.known: list[set[int]] = [set() for _ in place]
        self.last_us = np.full(len(place), -1, np.int64)
        self.counts: Counts = np.zeros((2, 2, APART_MAX + 1), np.int64)

    def see(self, beacon: int, time_us: int, robot: NDArray[np.float64], has_range: bool) -> None:
        """A sighting, in order of time; `robot` (2,) is where it truly was."""
        offset = self.place - robot
        direction_rad, range_m = np.arctan2(offset[:, 1], offset[:, 0]), np.hypot(offset[:, 0], offset[:, 1])
        sector = ((direction_rad / (2 * np.pi) + 0.5) * SECTORS).astype(int) % SECTORS
        away = (self.last_us < 0) | (time_us - self.last_us > OUT_OF_VIEW_US)
        if away[beacon]:
            turned_rad = np.abs(np.angle(np.exp(1j * (direction_rad - direction_rad[beacon]))))
            fits = turned_rad < DIRECTION_RAD
            if has_range:
                fits &= np.abs(range_m / range_m[beacon] - 1) < DISTANCE_SHARE
            for one in np.flatnonzero(away & (self.last_us >= 0) & fits).tolist():
                apart = min(sectors_between(known, int(sector[one])) for known in self.known[one])
                group = self.counts[min(len(self.known[one]), 2) - 1]
                group[0 if one == beacon else 1, min(apart, APART_MAX)] += 1
        self.last_us[beacon] = time_us
        self.known[beacon].add(int(sector[beacon]))


def sectors_between(one: int, other: int) -> int:
    """The shorter way round."""
    return min((one - other) % SECTORS, (other - one) % SECTORS)


def count_sides(log: Log) -> Counts:
    """How a drive's beacons come into view."""
    assert log.truth is not None and log.beacons is not None
    seen, row_of = log.sightings, {one: row for row, one in enumerate(log.beacons.beacon_id.tolist())}
    sides = Sides(np.column_stack([log.beacons.x_m, log.beacons.y_m]))
    poses, _ = truth_at(log.truth, seen.time_us)
    rows = zip(seen.beacon_id.tolist(), seen.time_us.tolist(), poses[:, :2], seen.range_m, strict=True)
    for beacon, time_us, robot, range_m in rows:
        if beacon in row_of:
            sides.see(row_of[beacon], time_us, robot, not np.isnan(range_m))
    return sides.counts


def log_odds(counts: Counts) -> list[float]:
    """Of own against other (2, k), with half a case more of each."""
    own, other = (counts + 0.5) / (counts + 0.5).sum(axis=1, keepdims=True)
    return [float(one) for one in np.log(own / other)]


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("worlds", nargs="+", help="scenarios")
    parser.add_argument(
        "--seeds", type=lambda text: range(*map(int, text.split(":"))), default=range(100, 104)
    )
    parser.add_argument("--sensor", choices=("simulated", "camera"), default="simulated")
    parser.add_argument("--rig", default="three60")
    parser.add_argument("--store", type=Path, default=Path("out") / "camera", metavar="DIR")
    return parser.parse_args(argv)


def source_of(arguments: argparse.Namespace, world: str, seed: int) -> ScenarioSource:
    """Where a drive comes from; sides are by true poses, so that the wheels' noise is nothing to them."""
    drive = (world, seed, 0.6, "speedometer")
    if arguments.sensor == "camera":
        return CameraSource(*drive, arguments.rig, arguments.store, UNTOLD_THRESHOLD)
    return ScenarioSource(*drive)


def main(argv: Sequence[str] | None = None) -> int:
    arguments = parse(argv)
    heads = [*map(str, range(APART_MAX)), f"{APART_MAX} to {SECTORS // 2}"]
    for world in arguments.worlds:
        drives = [count_sides(source_of(arguments, world, seed).load()) for seed in arguments.seeds]
        print(f"\n{world}, {arguments.sensor}, seeds {arguments.seeds}\n")
        print("| known from | sectors between: " + " | ".join(heads) + " |")
        print("|---|" + "---|" * len(heads))
        for name, counts in zip(("one sector", "more"), np.sum(drives, axis=0), strict=True):
            cells = zip(counts[0], counts[1], log_odds(counts), strict=True)
            print(f"| {name} | " + " | ".join(f"{a}, {b}: {odds:.1f}" for a, b, odds in cells) + " |")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
