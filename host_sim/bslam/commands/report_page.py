"""`bslam report`: the paper's tables and figures, association and real logs on one page."""

from __future__ import annotations

import argparse
import datetime
import importlib.metadata
import itertools
import platform
import shlex
import statistics
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import joblib
import numpy as np

from bslam.commands import compare, replay, run, sweep, tables
from bslam.commands.arguments import positive_count, seeds_range, whole_number
from bslam.commands.drawing import draw
from bslam.commands.report import verdict
from bslam.datasets.datasets import VARIABLE, data_root
from bslam.errors import did_you_mean
from bslam.evaluation.consistency import BELOW_95, half_interval_95
from bslam.runs.batch import BatchResult, Job, run_batch
from bslam.runs.output import write_atomically
from bslam.runs.sources import MrclamSource, ScenarioSource
from bslam.runs.sweep import beside_known, code_digest, compare_with_known
from bslam.runs.tables import (
    BEST_TO_WORST,
    PAPER_ROOM,
    STATISTICS,
    TITLES,
    Cell,
    figure_of,
    heading,
    heads,
    paper_figure,
    runs_a_cell,
    section_title,
    with_paper,
)
from bslam.view.report import Picture, Section, Table, render
from bslam.world.simulate import load_scenario

SUMMARY = "one HTML page: the paper's tables and figures, the bound, association, real logs"
EXAMPLES = """examples:
  bslam report
  bslam report --seeds 2000:2030 --bound-seeds 4 --out out/fresh
  bslam report --parts tables,figure3

Writes report.html, which holds its pictures and needs no network; each part shows the command that makes it.
tables: Tables I to III and Figures 6 to 9; bound: what the exact causal MAP makes of the same drives;
figure3: a map made by a distance threshold and one made by looks; association: look-alikes side by side;
real: the MRCLAM logs, where they are at hand."""
REAL_SETS: Final = ("MRCLAM_Dataset1", "MRCLAM_Dataset2", "MRCLAM_Dataset6")
_FIGURE3_SEED: Final = 2
_STOPPED: Final = "Stopped: this page lacks what was not finished then."
_WORDS: Final = (
    "Errors are distances of the estimated from the true position. What follows a plus-minus is half of the "
    "95 % interval of a mean over runs, from five runs on. NEES is that of the pose: 3 is consistent. Lost "
    "means: the error was above 2 m in the last 1000 steps, or not finite. Failed means: lost; or off, for "
    "5 s above 1 m and 3 times known association's error; or the map is not one to one; or NEES is above 20 "
    "over the last 50 s."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--scenario", default="paper_room", help="of tables and bound (default: paper_room)")
    parser.add_argument(
        "--seeds",
        type=seeds_range,
        default=range(1000, 1010),
        metavar="A:B",
        help="of the tables (default: 1000:1010); association takes the first half of them",
    )
    parser.add_argument(
        "--bound-seeds",
        type=positive_count,
        default=2,
        metavar="N",
        help="the bound is solved on the first N seeds, at 50 moments of each (default: 2)",
    )
    parser.add_argument(
        "--parts",
        type=_parts,
        default=list(_PARTS),
        metavar="PART,...",
        help=f"only these of {', '.join(_PARTS)} (default: all)",
    )
    parser.add_argument("--jobs", type=positive_count, default=joblib.cpu_count(), metavar="N")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out") / "report",
        metavar="DIR",
        help="where report.html and the files of all runs go (default: out/report)",
    )
    parser.add_argument("--pictures", type=whole_number, default=1, help=argparse.SUPPRESS)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    maker = _Maker(arguments)
    sections = []
    for name in arguments.parts:
        print(f"report: {name}", file=sys.stderr)
        sections.append(_PARTS[name](maker))
        if maker.interrupted:
            break
    path = arguments.out / "report.html"
    words = f"{_STOPPED} {_WORDS}" if maker.interrupted else _WORDS
    write_atomically(path, render("bslam: what it does", words, _about(arguments), sections))
    print(f"files in {arguments.out}: {path.name}, and a folder for each part")
    for line in maker.troubles:
        print(line, file=sys.stderr)
    return 1 if maker.troubles else 0


class _Maker:
    """Makes the runs of one part after the other: by the words of a command, which the page shows."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        self.scenario: str = arguments.scenario
        self.seeds: range = arguments.seeds
        self.bound_seeds: range = self.seeds[: arguments.bound_seeds]
        self.out: Path = arguments.out
        self.troubles: list[str] = []
        self.interrupted = False
        self._processes: int = arguments.jobs

    def parse(self, command: ModuleType, words: Sequence[str], part: str) -> argparse.Namespace:
        """The options of a command; its files go into a folder of the report's own."""
        parser = argparse.ArgumentParser(prog=words[0])
        command.add_arguments(parser)
        own = ["--out", str(self.out / part), "--jobs", str(self._processes)]
        return parser.parse_intermixed_args([*words[1:], *own])

    def run(self, jobs: Sequence[Job], part: str) -> BatchResult:
        """Run them, and note what failed."""
        result = run_batch(jobs, self.out / part, self._processes)
        self.note(result.outcomes, result.interrupted)
        return result

    def worst(self, jobs: Sequence[Job], result: BatchResult, part: str) -> list[Picture]:
        """Map and error of the run with the greatest mean error, made once more; how to do that by hand."""
        error_m = {
            one.name: one.entry["position_error_m"]["mean"]
            for one in result.outcomes
            if "position_error_m" in one.entry
        }
        if not error_m or self.interrupted:
            return []
        job = max((one for one in jobs if one.name in error_m), key=lambda one: error_m[one.name])
        folder = f"{part}/worst"
        again = self.run([replace(job, draw=draw, files=False)], folder)
        words = _line(_again(job))
        found = [
            self.picture(job, again, folder, what, f"Worst run, {what}: {words}") for what in ("map", "error")
        ]
        return [*itertools.chain.from_iterable(found)]

    def picture(self, job: Job, result: BatchResult, part: str, what: str, caption: str) -> list[Picture]:
        """What was drawn of a job; none of an earlier report where this time it failed, or was not made."""
        path = self.out / part / f"{job.name}.{what}.png"
        is_made = any(one.name == job.name and not one.failed for one in result.outcomes)
        return [Picture(path.read_bytes(), caption)] if is_made and path.is_file() else []

    def note(self, outcomes: Sequence[Any], interrupted: bool) -> None:
        """What the exit status must tell."""
        self.troubles += [f"{one.name} failed: {one.entry['error']}" for one in outcomes if one.failed]
        self.interrupted = self.interrupted or interrupted
        if interrupted:
            self.troubles.append("stopped: the page holds what was finished")


def _again(job: Job) -> list[str]:
    """The words that make a run of a scenario, or of a log, alone."""
    source, options = job.source, job.options
    if isinstance(source, MrclamSource):
        return ["replay", "mrclam", source.directory.name, "--robot", str(source.robot)]
    assert isinstance(source, ScenarioSource)
    words = ["run", source.scenario, *_seed_words(range(source.seed, source.seed + 1))]
    words += ["--sigma", str(source.sigma_mps), "--observation", options.observation]
    return [*words, "--filter", options.filter, "--association", options.association]


def _line(words: Sequence[str]) -> str:
    return shlex.join(["bslam", *words])


def _seed_words(seeds: range) -> list[str]:
    return ["--seeds", f"{seeds.start}:{seeds.stop}"]


def _tables(maker: _Maker) -> Section:
    """Tables I to III, Figures 6 to 9, NEES."""
    words = ["tables", "--scenario", maker.scenario, "--association", "known", *_seed_words(maker.seeds)]
    options = maker.parse(tables, words, "tables")
    jobs = tables.table_jobs(options)
    result = maker.run(jobs, "tables")
    by_cell = tables.group(jobs, result.outcomes)
    cells, scenario = tables.cells_of(jobs, by_cell), jobs[0].source.name
    sigmas = sorted({cell.sigma_mps for cell in cells})
    pictures = maker.worst(jobs, result, "tables")
    figure = "Figure 6: " if scenario == PAPER_ROOM else ""
    caption = f"{figure}path, map and ellipses of {jobs[0].name}"
    pictures += maker.picture(jobs[0], result, "tables", "map", caption)
    for sigma_mps in sigmas:
        caption = f"{figure_of(scenario, sigma_mps)}error and NEES over time, sigma {sigma_mps:g} m/s"
        pictures.append(Picture(tables.picture(sigma_mps, by_cell), caption))
    found = [_table_of_sigma([one for one in cells if one.sigma_mps == sigma_mps]) for sigma_mps in sigmas]
    what = f"{maker.scenario}, identity known, {runs_a_cell(len(maker.seeds))}; cm."
    what += " The paper shows one run a cell." if scenario == PAPER_ROOM else ""
    said = verdict([one.entry for one in result.outcomes])
    return Section(heading(scenario), [_line(words)], what, found, pictures, said)


def _table_of_sigma(cells: Sequence[Cell]) -> Table:
    rows = [["", *heads(cells)]]
    for name in STATISTICS:
        row = [TITLES[name]]
        for cell, is_after_paper in with_paper(cells):
            row += [paper_figure(cell, name)] if is_after_paper else []
            half = cell.mean_half_95_cm if name == "mean" else None
            row.append(f"{cell.error_cm[name]:.2f}" + ("" if half is None else f" ± {half:.2f}"))
        rows.append(row)
    more: dict[str, Callable[[Cell], str]] = {
        BEST_TO_WORST: lambda c: f"{c.mean_low_cm:.2f} to {c.mean_high_cm:.2f}",
        "First, last 50 s": lambda c: f"{c.first_50s_cm:.2f}, {c.last_50s_cm:.2f}",
        "Bound: Jacobians at the truth": lambda c: "-" if c.bound_cm is None else f"{c.bound_cm:.2f}",
        "Odometry alone": lambda c: f"{c.dead_reckoning_cm:.0f}",
        "NEES": lambda c: f"{c.nees_mean:.2f}",
        f"NEES {BELOW_95}, of steps": lambda c: f"{100.0 * c.nees_inside_95:.1f} %",
        "Runs lost": lambda c: f"{c.lost} of {c.runs}",
    }
    if all(cell.runs == 1 for cell in cells):
        del more[BEST_TO_WORST]
    for title, text in more.items():
        row = [title]
        for cell, is_after_paper in with_paper(cells):
            row += ["", text(cell)] if is_after_paper else [text(cell)]
        rows.append(row)
    return Table(rows, section_title(cells))


def _bound(maker: _Maker) -> Section:
    """The exact causal MAP on the same drives, at some moments of them; distance observations."""
    steps = load_scenario(maker.scenario).steps
    every = max(1, steps // 50)
    commands = []
    ratios: list[float] = []
    rows = [["mean error, cm, at the same steps", "bslam", "the bound", "bslam / bound"]]
    for sigma in ("0.3", "0.6", "1.0"):
        words = ["compare", maker.scenario, "--only", "bslam,map", "--association", "known"]
        words += [
            "--sigma",
            sigma,
            "--map-every",
            str(every),
            "--pictures",
            "0",
            *_seed_words(maker.bound_seeds),
        ]
        _, _, result, lines = compare.compare(maker.parse(compare, words, f"bound/{sigma}"))
        maker.note([outcome for _, outcome in result.outcomes], result.interrupted)
        if maker.interrupted:
            break
        commands.append(_line(words))
        own, bound = ({line["method"]: line for line in lines}[name] for name in ("bslam", "map"))
        figures = [_cm(own.get("on_bound_steps_m")), _cm(bound.get("on_bound_steps_m"))]
        ratio = own.get("ratio_to_bound")
        ratios += [] if ratio is None else [ratio]
        rows.append([f"sigma {sigma} m/s", *figures, "-" if ratio is None else f"{ratio:.3f}"])
    what = (
        "What can be had at all: at each of these moments the exact maximum a posteriori of the whole drive "
        "until then, under the filter's own model and with identities given. A filter may be ahead of it by "
        f"chance on so few drives: {len(maker.bound_seeds)}, at every {every}th step. For directions alone "
        "it has no solution while a beacon was seen from one place only, so there is none here."
    )
    said = f"at worst {max(ratios):.2f} times the error that can be had at all" if ratios else "not solved"
    return Section("The bound", commands, what, [Table(rows)], verdict=said)


def _cm(value_m: float | None) -> str:
    return "-" if value_m is None else f"{100.0 * value_m:.2f}"


def _figure3(maker: _Maker) -> Section:
    """A threshold and the machines on one drive."""
    commands, pictures, rows, said = [], [], [_HEADS], []
    for method in ("nearest", "svm"):
        words = ["run", "figure3", *_seed_words(range(_FIGURE3_SEED, _FIGURE3_SEED + 1))]
        words += ["--association", method]
        part = f"figure3/{method}"
        jobs = run.jobs_of(maker.parse(run, words, part))
        result = maker.run(jobs, part)
        if maker.interrupted:
            break
        commands.append(_line(words))
        entries = [one.entry for one in result.outcomes]
        rows.append(_figures(method, entries))
        said.append(f"{method}: {verdict(entries)}")
        pictures += maker.picture(jobs[0], result, part, "map", f"Figure 3: {method}")
    what = "The nearest beacon within a threshold makes false beacons round true ones; appearance does not."
    return Section("Figure 3: false beacons", commands, what, [Table(rows)], pictures, ". ".join(said))


def _association(maker: _Maker) -> Section:
    """Every method on the room with pairs of beacons that stand close together."""
    seeds = maker.seeds[: max(1, len(maker.seeds) // 2)]
    words = ["sweep", "pairs", "--sigma", "1.0", "--association", "known,nearest,mahalanobis,joint,svm"]
    words += [*_seed_words(seeds), "--no-files"]
    jobs, _ = sweep.jobs_and_plan(maker.parse(sweep, words, "association"))
    result = maker.run(jobs, "association")
    _compare(jobs, result)
    groups: dict[str, list[dict[str, Any]]] = {}
    for outcome in result.outcomes:
        groups.setdefault(outcome.entry["association"], []).append(outcome.entry)
    rows = [_HEADS, *(_figures(name, group) for name, group in groups.items())]
    what = (
        "Twelve beacons in six close pairs. Known: identities are given, the best that association can do. "
        f"{len(seeds)} runs each."
    )
    said = ". ".join(f"{name}: {verdict(group)}" for name, group in groups.items())
    pictures = maker.worst(jobs, result, "association")
    return Section("Association", [_line(words)], what, [Table(rows)], pictures, said)


def _compare(jobs: Sequence[Job], result: BatchResult) -> None:
    """Judge the runs beside known association, as the command that the page shows does."""
    made = {one.name: one for one in result.outcomes}
    for name, known in beside_known(jobs).items():
        if name in made and known in made:
            own, other = made[name], made[known]
            series = [np.stack([one.time_s, one.error_m], dtype=np.float64) for one in (own, other)]
            compare_with_known(own.entry, other.entry, *series)


_HEADS: Final = [
    "", "mean error, cm", "wrong", "missed", "false new", "deferred", "beacons mapped", "of", "lost"
]  # fmt: skip


def _figures(name: str, entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """A row: means over the runs that have figures; shares are of all sightings."""
    good = [one for one in entries if "position_error_m" in one]
    if not good:
        return [name, *("-" for _ in _HEADS[1:])]
    sightings = sum(one["sightings"] for one in good)

    def share(key: str) -> str:
        return f"{100.0 * sum(one[key] for one in good) / sightings:.2f} %" if sightings else "-"

    def mean(key: str) -> str:
        values = [one[key] for one in good if key in one]
        return f"{statistics.fmean(values):.4g}" if values else "-"

    counts = [share(key) for key in ("wrong_associations", "missed", "false_new", "deferred")]
    lost = sum(bool(one["diverged"]) for one in good)
    return [name, _mean_error(good), *counts, mean("beacons_mapped"), mean("beacons_true"), str(lost)]


def _mean_error(entries: Sequence[Mapping[str, Any]]) -> str:
    errors_m = [one["position_error_m"]["mean"] for one in entries]
    half_m = half_interval_95(errors_m)
    return f"{100.0 * statistics.fmean(errors_m):.1f}" + (
        "" if half_m is None else f" ± {100.0 * half_m:.1f}"
    )


def _real(maker: _Maker) -> Section:
    """The MRCLAM logs."""
    words = ["replay", "mrclam", *REAL_SETS]
    root = data_root()
    there = [name for name in REAL_SETS if root is not None and (root / "mrclam" / name).is_dir()]
    title, commands = "Real logs", [_line(words)]
    if len(there) < len(REAL_SETS):
        missing = ", ".join(name for name in REAL_SETS if name not in there)
        why = f"Not here: {missing} of the UTIAS MRCLAM data are not at hand; {VARIABLE} names their place."
        return Section(title, commands, why, verdict="not run")
    jobs = replay.jobs_of(maker.parse(replay, words, "real"), "mrclam", there)
    result = maker.run(jobs, "real")
    rows = [["log", "truth", "position RMSE, cm", "odometry alone", "map RMSE, cm", "mapped", "of", "NEES"]]
    for outcome in result.outcomes:
        entry = outcome.entry
        if "position_error_m" not in entry:
            rows.append([outcome.name, *("-" for _ in rows[0][1:])])
            continue
        row = [outcome.name, str(entry["truth"]), _cm(entry["position_error_m"]["rmse"])]
        row += [_cm(entry.get("dead_reckoning_error_m")), _cm(entry.get("map_rmse_m"))]
        row += [
            str(entry["beacons_mapped"]),
            str(entry["beacons_true"]),
            f"{entry.get('nees_mean', 0.0):.1f}",
        ]
        rows.append(row)
    maps_m = [one.entry["map_rmse_m"] for one in result.outcomes if "map_rmse_m" in one.entry]
    what = f"{len(jobs)} logs of five robots, identity known, after rigid alignment."
    if maps_m:
        what += f" Map: median {_cm(statistics.median(maps_m))} cm, worst {_cm(max(maps_m))} cm."
    pictures = maker.worst(jobs, result, "real")
    said = verdict([one.entry for one in result.outcomes])
    return Section(title, commands, what, [Table(rows)], pictures, said)


_PARTS: Final[dict[str, Callable[[_Maker], Section]]] = {
    "tables": _tables,
    "bound": _bound,
    "figure3": _figure3,
    "association": _association,
    "real": _real,
}


def _parts(text: str) -> list[str]:
    names = [word.strip() for word in text.split(",")]
    for name in names:
        if name not in _PARTS:
            allowed = f"allowed: {', '.join(_PARTS)}{did_you_mean(name, _PARTS)}"
            raise argparse.ArgumentTypeError(f"'{name}' is no part; {allowed}")
    return names


def _about(arguments: argparse.Namespace) -> Table:
    seeds, bound = arguments.seeds, arguments.seeds[: arguments.bound_seeds]
    words = ["report", "--scenario", arguments.scenario, *_seed_words(seeds)]
    words += ["--bound-seeds", str(arguments.bound_seeds), "--parts", ",".join(arguments.parts)]
    rows = [
        ["This page", ""],
        ["made on", f"{datetime.date.today():%Y-%m-%d}, {platform.machine()}, {platform.system()}"],
        ["bslam", f"{importlib.metadata.version('bslam')}, digest of its code {code_digest()}"],
        ["Python, NumPy", f"{platform.python_version()}, {importlib.metadata.version('numpy')}"],
        ["seeds", f"{seeds.start} to {seeds.stop - 1}; of the bound {bound.start} to {bound.stop - 1}"],
        ["made by", _line(words)],
    ]
    return Table(rows)
