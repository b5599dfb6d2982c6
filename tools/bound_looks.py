"""How near to known identity's position association comes with machines that know the truth.

Runs `known`, `svm`, and `svm` with other machines in place of its own, all else as it is. `taught`: a
LinearSVC for each look, trained while the robot drives, with the true identities of all sightings so far: as
much as linear machines can know by then. The others are told by the truth, and sure: `alike` of each sighting
which look it has, so that beacons with one look are left to position; `told` which beacon it shows. What is
no beacon, or has the signature of a sighting of another look, is left to the machines of the run. A beacon of
the map is taken for what most of its sightings showed so far. `untried` is `told` with nothing on trial,
`unspoilt` that without clutter, too. So `alike` is what any machines could reach at best, and `told` what
they could if nothing looked like anything else; what is missing then is what waits, what begins, and what is
missed. Without a camera nothing is on trial: no `untried`.
`--draws`: each drive as often, with the noise of its wheels' readings drawn anew.
`.venv/bin/python tools/bound_looks.py lookalikes --sensor camera --seeds 2000:2020 --draws 4`
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.commands.arguments import seeds_range
from bslam.experiment.camera import TOLD_THRESHOLD, UNTOLD_THRESHOLD
from bslam.experiment.ledger import CLUTTER
from bslam.experiment.runner import run_log
from bslam.experiment.sources import CameraSource, ScenarioSource
from bslam.experiment.trace import Trace
from bslam.experiment.truth import truth_at
from bslam.log import Log
from bslam.world.scenario import load_scenario
from measure_association import draw_count, interval, options_of, without_clutter
from told_machines import SureSlam, TaughtSlam

METHODS = ("known", "svm", "taught", "alike", "told")
UNTRIED = ("untried", "unspoilt")  # of a camera, besides
NO_TRIALS = (("trust_sum", 0.0), ("trust_first_sum", 0.0))


def looks_of(world: str, alike: bool) -> dict[int, int]:
    """Which look each beacon of a world has: `alike` that of the one whose looks it shares, else its own."""
    return {
        one.beacon_id: one.looks_like if alike and one.looks_like is not None else one.beacon_id
        for one in load_scenario(world).arena.beacons
        if one.beacon_id != CLUTTER
    }


@dataclass(frozen=True)
class Drive:
    """A drive, and how it is run. rig and store: the camera's, if that is the sensor."""

    world: str
    seed: int
    sigma_mps: float
    sensor: str
    rig: str
    store: Path
    draw: int
    method: str

    def load(self) -> Log:
        """As the method gets it."""
        drive = (self.world, self.seed, self.sigma_mps, "speedometer")
        if self.sensor != "camera":
            return ScenarioSource(*drive, noise_draw=self.draw).load()
        threshold = TOLD_THRESHOLD if self.method == "known" else UNTOLD_THRESHOLD
        log = CameraSource(*drive, self.rig, self.store, threshold, noise_draw=self.draw).load()
        is_unspoilt = self.method == "unspoilt"
        return replace(log, sightings=without_clutter(log.sightings)) if is_unspoilt else log


def run(drive: Drive) -> tuple[float, float]:
    """Mean position error, m, and what was matched with another beacon, % of all sightings."""
    log = drive.load()
    trace = run_by(log, drive)
    assert log.truth is not None
    true_pose, _ = truth_at(log.truth, trace.time_us)
    off_m: NDArray[np.float64] = np.hypot(*(trace.pose - true_pose)[:, :2].T)
    return float(off_m.mean()), 100.0 * trace.counts.wrong_associations / trace.counts.sightings


def run_by(log: Log, drive: Drive) -> Trace:
    """A drive by its method."""
    if drive.method in ("known", "svm"):
        return run_log(log, options_of(drive.method, drive.sensor, drive.sigma_mps, drive.seed))
    robot = TaughtSlam if drive.method == "taught" else SureSlam
    look_of = looks_of(drive.world, drive.method in ("taught", "alike"))
    changes = NO_TRIALS if drive.method in UNTRIED else ()
    return run_log(
        log,
        options_of("svm", drive.sensor, drive.sigma_mps, drive.seed, changes),
        slam_factory=lambda params, beacons: robot(
            look_of, log, params=params, beacons_max=beacons, recovery=True
        ),
    )


def row(name: str, error_m: NDArray[np.float64], wrong: NDArray[np.float64], known_m: Any) -> str:
    """A line of the table, of (draws, drives): means are over a drive's draws, then over drives."""
    ratio = error_m / known_m
    cells = [
        name,
        interval(wrong.mean(axis=0).tolist()),
        interval((100.0 * error_m).mean(axis=0).tolist()),
        interval(ratio.mean(axis=0).tolist()),
        f"{np.median(ratio):.3g}",
        ", ".join(f"{one:.3g}" for one in ratio.mean(axis=1)),
    ]
    return "| " + " | ".join(cells) + " |"


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("world")
    parser.add_argument("--sigma", type=float, default=0.6, metavar="M/S")
    parser.add_argument("--seeds", type=seeds_range, default=range(100, 104), metavar="A:B")
    parser.add_argument("--draws", type=draw_count, default=1, help="of the wheels' noise, of each drive")
    parser.add_argument("--sensor", choices=("simulated", "camera"), default="simulated")
    parser.add_argument("--rig", default="three60")
    parser.add_argument("--store", type=Path, default=Path("out") / "camera", metavar="DIR")
    parser.add_argument("--jobs", type=int, default=1)
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    words = parse(argv)
    print("| method | wrong % | position cm | against known | median | in each draw |")
    print("|---|---|---|---|---|---|")
    known_m: NDArray[np.float64] | None = None
    with ProcessPoolExecutor(words.jobs) as pool:
        for method in (*METHODS, *(UNTRIED if words.sensor == "camera" else ())):
            drives = [
                Drive(words.world, seed, words.sigma, words.sensor, words.rig, words.store, draw, method)
                for draw, seed in product(range(words.draws), words.seeds)
            ]
            shape = (2, words.draws, len(words.seeds))
            error_m, wrong = np.array(list(pool.map(run, drives))).T.reshape(shape)
            known_m = error_m if known_m is None else known_m
            print(row(method, error_m, wrong, known_m), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
