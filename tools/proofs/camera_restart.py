"""Switched on in a kept map, at a place that nobody knows, with cameras: how soon it is found again.

Of each drive a map is kept after 3000 steps, with identity by looks; then the robot is switched on in that
map three times, further on in the drive. Looked at five seconds of driving after power-on, and five seconds
after the first frame that shows two beacons of the map:

    near       within 0.2 m
    off        within 1 m
    elsewhere  a metre or more off
    lost       it says that it has no pose

The error is that against the truth, and that in the map's own frame: the kept map's confirmed beacons that
stand within a metre of the true ones are laid on these first, as a robot that goes by its map needs no other
frame. A frame is that of one camera. What is not near in the map's frame, five seconds after two beacons, is
told with what there was to go by.

Takes drives as `bslam tables --sensor camera` keeps them (out/camera; rendered if they are not there, a
minute each), --jobs drives at a time:

    python -m tools.proofs.camera_restart --seeds 1000:1020 --jobs 2
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Collection
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.commands.arguments import CAMERA_STORE, seeds_range
from bslam.evaluation.align import Rigid, fit_rigid
from bslam.evaluation.metrics import map_pairs
from bslam.evaluation.trace import Trace
from bslam.evaluation.truth import truth_at
from bslam.log import Log, Sightings
from bslam.maps.blob import SUFFIX
from bslam.options import RunOptions
from bslam.rig import load_rig
from bslam.runs.camera import CameraStore, camera_log
from bslam.runs.runner import run_log
from bslam.world.simulate import load_scenario

SCENARIO, RIG, SIGMA_MPS = "paper_room", "three60", 0.6
KEPT_AFTER = 3000  # steps
SWITCHED_ON_AT = (3200, 3800, 4400)  # steps
DRIVEN_US = 5_000_000
NEAR_M, ELSEWHERE_M = 0.2, 1.0
NEEDED = 2  # beacons of the map in one frame
OUTCOMES = ("near", "off", "elsewhere", "lost")
SINCE = ("power-on", "two beacons in view")


@dataclass(frozen=True)
class Restart:
    """One robot that was switched on in a kept map."""

    time_us: NDArray[np.int64]  # (k,) of the steps
    lost: NDArray[np.bool_]  # (k,)
    error_m: NDArray[np.float64]  # (k,)
    aligned_m: NDArray[np.float64]  # (k,) in the frame of the map
    power_us: int
    view_us: int | None  # the first frame with two beacons of the map
    views: Counter[int]  # frames that show each of these until five seconds after that
    map_text: str

    def why(self) -> str:
        """What there was to go by."""
        found = np.flatnonzero(~self.lost)
        found_s = f"{(self.time_us[found[0]] - self.power_us) * 1e-6:.1f} s" if len(found) else "never"
        view_s = "never" if self.view_us is None else f"{(self.view_us - self.power_us) * 1e-6:.1f} s"
        views = ", ".join(f"{one} in {count}" for one, count in sorted(self.views.items()))
        return f"first a pose {found_s}, two in view {view_s}; {self.map_text}; frames: beacon {views}"

    def outcome(self, since_us: int | None, aligned: bool) -> str:
        """One of OUTCOMES, five seconds of driving after a time, or at the drive's end if that is sooner.

        None: that time never came, so at the drive's end.
        """
        last = len(self.time_us) - 1
        at = last if since_us is None else min(int(np.searchsorted(self.time_us, since_us + DRIVEN_US)), last)
        if self.lost[at]:
            return "lost"
        error_m = (self.aligned_m if aligned else self.error_m)[at]
        if error_m <= NEAR_M:
            return "near"
        return "off" if error_m < ELSEWHERE_M else "elsewhere"


def in_view_us(seen: Sightings, mapped: Collection[int], since_us: int) -> int | None:
    """When a frame first shows so many different beacons of a map; None: it never does."""
    rows = (seen.time_us >= since_us) & np.isin(seen.beacon_id, list(mapped))
    pairs = np.unique(np.stack([seen.time_us[rows], seen.beacon_id[rows]]), axis=1)
    times_us, counts = np.unique(pairs[0], return_counts=True)
    enough = times_us[counts >= NEEDED]
    return int(enough[0]) if len(enough) else None


def part(log: Log, first: int, end: int | None) -> Log:
    """These steps of a drive, with what is seen meanwhile."""
    odometry, seen = log.odometry, log.sightings
    begin_us, last_us = odometry.time_us[first], odometry.time_us[first:end][-1]
    steps = np.arange(len(odometry.time_us))[first:end]
    shown = np.flatnonzero((seen.time_us >= begin_us) & (seen.time_us <= last_us))
    return replace(log, odometry=_rows(odometry, steps), sightings=_rows(seen, shown))


def _rows(table: Any, rows: NDArray[np.int64]) -> Any:
    """A dataclass of columns with these rows alone."""
    columns = {name: one[rows] for name, one in vars(table).items() if isinstance(one, np.ndarray)}
    return replace(table, **columns)


class _Losses:
    """Notes at each step whether the robot says that it is lost."""

    def __init__(self) -> None:
        self.lost: list[bool] = []

    def frame(self, *_: Any) -> None:
        """A frame tells nothing of it."""

    def step(self, _time_us: int, _pose: tuple[float, float, float], slam: Any) -> None:
        """After each step."""
        self.lost.append(slam.is_lost)


@dataclass(frozen=True)
class Kept:
    """A map that is kept, and what it is judged by."""

    path: Path
    to_truth: Rigid  # from its own frame
    mapped: set[int]  # the beacons in it
    text: str


def keep(log: Log, options: RunOptions, folder: Path) -> Kept:
    """Keeps a map of the first steps of a drive."""
    start = part(log, 0, KEPT_AFTER)
    kept = run_log(start, options)
    assert kept.kept_map is not None
    path = folder / f"kept{SUFFIX}"
    path.write_bytes(kept.kept_map)
    mapped_m, true_m = map_pairs(start, kept)
    right = np.hypot(*(mapped_m - true_m).T) < ELSEWHERE_M
    confirmed = [one.true_id for one in kept.beacons if one.confirmed]
    mapped = {one for one in confirmed if one is not None and one >= 0}
    text = f"map of {len(confirmed)}, {len(mapped)} beacons in it, {right.sum()} within a metre"
    return Kept(path, fit_rigid(mapped_m[right], true_m[right]), mapped, text)


def restarts(log: Log, options: RunOptions, kept: Kept) -> list[Restart]:
    """Each robot that is switched on in a kept map."""
    options = replace(options, kept_map=str(kept.path))
    robots = []
    for first in SWITCHED_ON_AT:
        rest, losses = part(log, first, None), _Losses()
        robots.append(_restart(rest, run_log(rest, options, watcher=losses), losses, kept))
    return robots


def _restart(log: Log, trace: Trace, losses: _Losses, kept: Kept) -> Restart:
    """One that drives this part of a log, of a trace that ends with it."""
    assert log.truth is not None
    steps = slice(len(trace.time_us) - len(log.odometry.time_us), None)
    time_us, place_m = trace.time_us[steps], trace.pose[steps, :2]
    true_m = truth_at(log.truth, time_us)[0][:, :2]
    error_m, aligned_m = (np.hypot(*(one - true_m).T) for one in (place_m, kept.to_truth.points(place_m)))
    seen, power_us = log.sightings, int(log.odometry.time_us[0])
    view_us = in_view_us(seen, kept.mapped, power_us)
    until_us = time_us[-1] if view_us is None else view_us + DRIVEN_US
    views = Counter(
        seen.beacon_id[(seen.time_us <= until_us) & np.isin(seen.beacon_id, list(kept.mapped))].tolist()
    )
    lost = np.array(losses.lost)[steps]
    return Restart(time_us, lost, error_m, aligned_m, power_us, view_us, views, kept.text)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--seeds", type=seeds_range, default=range(1000, 1020), metavar="A:B", help="default: 1000:1020"
    )
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="drives at a time (default: 1)")
    return parser.parse_args()


Counts = dict[tuple[str, bool], Counter[str]]


def count_drive(seed: int) -> tuple[Counts, list[str]]:
    """The outcomes of one drive's robots, and a line about each that is not near."""
    options = RunOptions(association="both", sigma_mps=SIGMA_MPS, recovery="carried")
    log = camera_log(load_scenario(SCENARIO), seed, SIGMA_MPS, None, load_rig(RIG), CameraStore(CAMERA_STORE))
    counts: Counts = {(since, aligned): Counter() for since in SINCE for aligned in (False, True)}
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        kept = keep(log, options, Path(folder))
        robots = restarts(log, options, kept)
    for first, robot in zip(SWITCHED_ON_AT, robots, strict=True):
        for since, since_us in zip(SINCE, (robot.power_us, robot.view_us), strict=True):
            for aligned in (False, True):
                counts[since, aligned][robot.outcome(since_us, aligned)] += 1
        outcome = robot.outcome(robot.view_us, True)
        if outcome != "near":
            lines.append(f"seed {seed}, step {first}: {outcome}; {robot.why()}")
    return counts, lines


def main() -> int:
    """Measures and prints."""
    args = _arguments()
    counts: Counts = {(since, aligned): Counter() for since in SINCE for aligned in (False, True)}
    with ProcessPoolExecutor(args.jobs) as pool:
        drives = pool.map(count_drive, args.seeds)
        for number, (of_drive, lines) in enumerate(drives, 1):
            for key, count in of_drive.items():
                counts[key] += count
            print(*lines, f"{number} of {len(args.seeds)} drives", sep="\n", flush=True)
    print(f"{SCENARIO}, {RIG}, seeds {args.seeds.start}:{args.seeds.stop}, sigma {SIGMA_MPS}")
    for (since, aligned), count in counts.items():
        figures = ", ".join(f"{count[one]} {one}" for one in OUTCOMES)
        frame = "in the map's frame" if aligned else "against the truth"
        print(f"5 s after {since}, {frame}: {figures} of {count.total()}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
