"""How well sightings find their beacons: method x world x sigma over seeds, against known identity.

Prints, for each combination: wrong, missed, false-new and deferred sightings in per cent of all; runs whose
count of beacons is exact; the error of the map; the error of the position, and its ratio to that with known
identity on the same drives; diverged runs. Beside each mean its 95 % interval over the seeds (Student's t).

Two ablations of `svm` stand beside the methods: `untrained`, machines that are never trained
(learn_budget = 0), and `position`, the SVM step switched off (looks_weight = 0). A camera's sightings from a
lower score on serve where identity is known; `same` has known identity of those that the others get, and
`used` of those that `svm` has fused with some beacon, or begun one from: what it does without costs as much.
`alone` is `svm` without recovery: it does not notice when it is lost.
`--photographs`: simulated sightings whose signatures are of ETH-80's photographs, an object a beacon
(tools/training/eth80.py). `--classes`, of a camera's sightings: as `seen`, `none`, or `usual`, what the
beacon is called most often on the drive, with the distance that it would have had as that: what evidence over
frames could reach at best. `--score`: what the detector is less sure of is left out where identity is not
told. `--without-clutter`: without a camera's sightings of no beacon, which only the truth tells. `--set`
changes a parameter of `svm` and its ablations.
`--draws`: each drive as often, with the noise of its wheels' readings drawn anew while path and sightings
stay; means are over a drive's draws, then over drives, and of counts all runs count. Beneath the table stands
the ratio to known identity in each draw: how much of it is luck.
`--looks` prints how alike simulated signatures are to a camera's instead: top-1 of LinearSVC, C = 10, by
views a beacon, on the given worlds (the camera's: tools/measure_learner.py).
`.venv/bin/python tools/measure_association.py pairs lookalikes --sigma 0.6,1.0 --seeds 100:110`
"""

import argparse
import itertools
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from sklearn.svm import LinearSVC

from booked_run import BookedRun
from bslam.experiment.batch import make_jobs, run_batch
from bslam.experiment.camera import TOLD_THRESHOLD, UNTOLD_THRESHOLD, Threshold
from bslam.experiment.options import Number, RunOptions
from bslam.experiment.runner import run_log
from bslam.experiment.sources import CameraSource, ScenarioSource
from bslam.log import Log, Sightings
from bslam.world.kinds import KINDS
from bslam.world.simulate import load_scenario, simulate
from training.eth80 import PhotographedSource

ABLATIONS: dict[str, tuple[tuple[str, Number], ...]] = {
    "untrained": (("learn_budget", 0),),
    "position": (("looks_weight", 0.0),),
}
METHODS = ("known", "same", "nearest", "mahalanobis", "joint", "svm", *ABLATIONS)
ALONE = "alone"
TOLD = ("same", "used")  # known identity of a camera's sightings that other methods get
VIEWS = (1, 2, 4, 10)
TEST_VIEWS, FAR_M = 30, 6.5

CLASSES = ("seen", "none", "usual")

Entry = dict[str, Any]


@dataclass(frozen=True)
class ClassedSource(CameraSource):
    """A camera's drive with other classes than its detector's."""

    classes: str = "seen"
    clutter: bool = True

    def load(self) -> Log:
        log = super().load()
        if not self.clutter:
            log = replace(log, sightings=without_clutter(log.sightings))
        if self.classes == "none":
            return replace(log, sightings=replace(log.sightings, beacon_class=None))
        return replace(log, sightings=as_usual(log.sightings)) if self.classes == "usual" else log


class UsedRows(BookedRun):
    """Which of a log's sightings are fused with a beacon, or begin one."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[int] = []

    def enter(self, time_us: int, true_id: Sequence[int], accounts: Sequence[Any]) -> None:
        """Notes a frame."""
        del time_us, true_id
        self.rows += [
            row for row, one in enumerate(accounts, self.sightings) if one.result in ("matched", "new")
        ]


@dataclass(frozen=True)
class UsedSource(ClassedSource):
    """A camera's drive with the sightings of beacons that `svm` uses of it."""

    def load(self) -> Log:
        log, used = super().load(), UsedRows()
        run_log(log, options_of("svm", "camera", self.sigma_mps, self.seed), watcher=used)
        is_used = np.zeros(len(log.sightings.beacon_id), bool)
        is_used[used.rows] = True
        return replace(log, sightings=only(log.sightings, is_used & (log.sightings.beacon_id >= 0)))


def only(seen: Sightings, rows: NDArray[np.bool_]) -> Sightings:
    """Some of them."""
    columns = {one.name: getattr(seen, one.name) for one in fields(seen)}
    return replace(
        seen, **{name: column[rows] for name, column in columns.items() if isinstance(column, np.ndarray)}
    )


def without_clutter(seen: Sightings) -> Sightings:
    """Those that show a beacon."""
    return only(seen, seen.beacon_id >= 0)


def as_usual(seen: Sightings) -> Sightings:
    """With each beacon called what it is called most often, and distances for that height."""
    assert seen.beacon_class is not None and seen.range_sd_m is not None
    usual = seen.beacon_class.copy()
    for beacon in np.unique(seen.beacon_id[seen.beacon_id >= 0]):
        rows = seen.beacon_id == beacon
        usual[rows] = np.bincount(seen.beacon_class[rows]).argmax()
    height_m = np.array([1.0, *(kind.height_m for kind in KINDS.values())])
    factor = height_m[usual] / height_m[seen.beacon_class]
    return replace(
        seen, beacon_class=usual, range_m=seen.range_m * factor, range_sd_m=seen.range_sd_m * factor
    )


def options_of(
    method: str, sensor: str, sigma_mps: float | None, seed: int, changes: Sequence[tuple[str, Number]] = ()
) -> RunOptions:
    """One run of a method; an ablation is `svm` with a parameter changed. `changes`: others, of `svm`."""
    is_svm = method in ABLATIONS or method == ALONE
    association = "svm" if is_svm else "known" if method in TOLD else method
    return RunOptions(
        association=association,
        sensor=sensor,
        sigma_mps=sigma_mps,
        noise="speedometer",
        seed=seed,
        parameters=(*ABLATIONS.get(method, ()), *(changes if association == "svm" else ())),
        recovery=None if method == "svm" else "off",
    )


def source_of(
    arguments: argparse.Namespace, world: str, seed: int, sigma_mps: float, method: str, draw: int
) -> ScenarioSource:
    """Where the sightings come from."""
    drive = (world, seed, sigma_mps, "speedometer")
    if arguments.photographs:
        return PhotographedSource(*drive, noise_draw=draw)
    if arguments.sensor == "camera":
        threshold = TOLD_THRESHOLD if method == "known" else Threshold(arguments.score, arguments.score)
        source = UsedSource if method == "used" else ClassedSource
        rig, store, classes = arguments.rig, arguments.store, arguments.classes
        return source(*drive, rig, store, threshold, classes, arguments.clutter, noise_draw=draw)
    return ScenarioSource(*drive, noise_draw=draw)


def run_all(arguments: argparse.Namespace, draw: int) -> dict[tuple[str, float, str], list[Entry]]:
    """The summaries of every combination in one draw, in the order of the seeds.

    Ends the program with what went wrong if a run failed, or was interrupted.
    """
    grid = list(itertools.product(arguments.worlds, arguments.sigma, arguments.methods))
    sources: list[ScenarioSource] = []
    options: list[RunOptions] = []
    for (world, sigma_mps, method), seed in itertools.product(grid, arguments.seeds):
        sources.append(source_of(arguments, world, seed, sigma_mps, method, draw))
        options.append(options_of(method, arguments.sensor, sigma_mps, seed, arguments.changes))
    out = arguments.out / f"draw{draw}" if arguments.draws > 1 else arguments.out
    result = run_batch(make_jobs(sources, options, None, 0), out, arguments.jobs)
    failed = [f"{one.name}: {one.entry['error']}" for one in result.outcomes if one.failed]
    if failed or result.interrupted:
        sys.exit("\n".join(failed) or "interrupted")
    entries = [outcome.entry for outcome in result.outcomes]
    seeds = len(arguments.seeds)
    return {key: entries[seeds * i : seeds * (i + 1)] for i, key in enumerate(grid)}


def interval(values: Sequence[float]) -> str:
    """Mean and half the width of its 95 % interval."""
    mean = float(np.mean(values))
    if len(values) < 2:
        return f"{mean:.3g}"
    half = float(stats.t.ppf(0.975, len(values) - 1)) * float(np.std(values, ddof=1)) / math.sqrt(len(values))
    return f"{mean:.3g} ± {half:.2g}"


def ratios(entries: list[Entry], known: list[Entry]) -> list[float]:
    """How many times as far off as with known identity each run is."""
    errors_m = ([one["position_error_m"]["mean"] for one in runs] for runs in (entries, known))
    return [error_m / known_m for error_m, known_m in zip(*errors_m, strict=True)]


def row(name: str, draws: list[list[Entry]], known: list[list[Entry]] | None) -> str:
    """A line of the table: each draw's runs, of the same drives."""
    entries = list(itertools.chain(*draws))

    def over_drives(values: Sequence[float]) -> str:
        return interval(np.reshape(values, (len(draws), -1)).mean(axis=0).tolist())

    def share(key: str) -> str:
        return over_drives([100.0 * one[key] / max(one["sightings"], 1) for one in entries])

    errors_m = [one["position_error_m"]["mean"] for one in entries]
    ratio = "-" if known is None else over_drives(ratios(entries, list(itertools.chain(*known))))
    exact = sum(one["beacons_mapped"] == one["beacons_true"] for one in entries)
    mapped = float(np.mean([one["beacons_mapped"] for one in entries]))
    cells = [
        name,
        *(share(key) for key in ("wrong_associations", "missed", "false_new", "deferred")),
        f"{exact} of {len(entries)} ({mapped:.1f})",
        over_drives([100.0 * one["map_rmse_m"] for one in entries]),
        over_drives([100.0 * error_m for error_m in errors_m]),
        ratio,
        str(sum(one["diverged"] for one in entries)),
    ]
    return "| " + " | ".join(cells) + " |"


def print_draws(of_method: dict[str, list[list[Entry]]], known: list[list[Entry]]) -> None:
    """Each method's ratio to known identity in each draw, in the mean over the drives."""
    print()
    for method, draws in of_method.items():
        means = [float(np.mean(ratios(*pair))) for pair in zip(draws, known, strict=True)]
        print(f"{method}, against known in each draw: " + ", ".join(f"{one:.3g}" for one in means))


def print_looks(worlds: Sequence[str], seeds: Sequence[int]) -> None:
    """Top-1 by views of each beacon, nearer than FAR_M."""
    print("| world, beacons | " + " | ".join(f"{views} views" for views in VIEWS) + " |")
    for world, seed in itertools.product(worlds, seeds):
        sightings = simulate(load_scenario(world), seed).sightings
        assert sightings.signature is not None
        near = sightings.range_m < FAR_M
        signature, beacon = sightings.signature[near], sightings.beacon_id[near]
        there = [one for one in np.unique(beacon) if np.sum(beacon == one) >= 2 * TEST_VIEWS]
        random, shares = np.random.default_rng(seed), []
        for views in VIEWS:
            drawn = [random.permutation(np.flatnonzero(beacon == one)) for one in there]
            train = np.concatenate([one[:views] for one in drawn])
            test = np.concatenate([one[views : views + TEST_VIEWS] for one in drawn])
            machines = LinearSVC(C=10.0, dual=False).fit(signature[train], beacon[train])
            shares.append(float(np.mean(machines.predict(signature[test]) == beacon[test])))
        cells = " | ".join(f"{100.0 * one:.1f}" for one in shares)
        print(f"| {world} seed {seed}, {len(there)} | {cells} |")


def change(text: str) -> tuple[str, Number]:
    """A parameter and its value."""
    name, _, value = text.partition("=")
    return name, float(value) if "." in value else int(value)


def draw_count(text: str) -> int:
    """How many, one at least."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: a whole number from 1")
    return int(text)


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("worlds", nargs="+", help="scenarios")
    parser.add_argument("--methods", type=lambda text: text.split(","), default=list(METHODS))
    parser.add_argument("--sigma", type=lambda text: [float(one) for one in text.split(",")], default=[0.6])
    parser.add_argument(
        "--seeds", type=lambda text: range(*map(int, text.split(":"))), default=range(100, 104)
    )
    parser.add_argument("--sensor", choices=("simulated", "camera"), default="simulated")
    parser.add_argument("--rig", default="three60")
    parser.add_argument("--store", type=Path, default=Path("out") / "camera", metavar="DIR")
    parser.add_argument("--score", type=float, default=UNTOLD_THRESHOLD.whole, help="a camera's, at least")
    parser.add_argument("--draws", type=draw_count, default=1, help="of the wheels' noise, of each drive")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out") / "association")
    parser.add_argument("--looks", action="store_true")
    parser.add_argument("--photographs", action="store_true")
    parser.add_argument("--classes", choices=CLASSES, default="seen")
    parser.add_argument("--without-clutter", dest="clutter", action="store_false")
    parser.add_argument(
        "--set", dest="changes", action="append", default=[], type=change, metavar="NAME=VALUE"
    )
    arguments = parser.parse_args(argv)
    allowed = (*METHODS, ALONE, *(("used",) if arguments.sensor == "camera" else ()))
    unknown = set(arguments.methods) - set(allowed)
    if unknown:
        parser.error(f"methods {', '.join(sorted(unknown))}; allowed: {', '.join(allowed)}")
    return arguments


def main(argv: Sequence[str] | None = None) -> int:
    arguments = parse(argv)
    if arguments.looks:
        print_looks(arguments.worlds, arguments.seeds)
        return 0
    tables = [run_all(arguments, draw) for draw in range(arguments.draws)]
    for world, sigma_mps in itertools.product(arguments.worlds, arguments.sigma):
        print(f"\n{world}, {arguments.sensor}, sigma {sigma_mps:g}, seeds {arguments.seeds}\n")
        print(
            "| method | wrong % | missed % | false-new % | deferred % | exact count (mean) | map cm ", end=""
        )
        print("| position cm | against known | lost |\n|---|---|---|---|---|---|---|---|---|---|")
        of_method = {name: [one[world, sigma_mps, name] for one in tables] for name in arguments.methods}
        known = of_method.get("known")
        for method, runs in of_method.items():
            print(row(method, runs, known))
        if known is not None and arguments.draws > 1:
            print_draws(of_method, known)
    return 0


if __name__ == "__main__":
    sys.exit(main())
