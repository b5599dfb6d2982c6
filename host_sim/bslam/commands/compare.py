"""`bslam compare`: several algorithms on the same drives, side by side."""

from __future__ import annotations

import argparse
import importlib.metadata
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bslam.commands.arguments import (
    add_algorithm_options,
    add_batch_options,
    add_filter_options,
    add_sensor_options,
    positive_count,
    run_options,
    scenario_source,
)
from bslam.commands.report import table_of
from bslam.datasets.datasets import near_folder
from bslam.errors import BslamError, did_you_mean
from bslam.options import RunOptions
from bslam.runs.contest import ContestResult, hold_contest, make_bouts, means
from bslam.runs.methods import BOUND, Method, own_method, shipped_methods
from bslam.runs.output import write_atomically, write_json, write_summary
from bslam.runs.sources import FolderSource, Source
from bslam.view.comparison import Contender, draw_comparison
from bslam.view.style import png
from bslam.world.simulate import load_scenario, scenario_names

SUMMARY = "several SLAM algorithms on the same drives, yours among them"
EXAMPLES = """examples:
  bslam compare paper_room --seeds 0:2
  bslam compare paper_room --with my_slam:MySlam
  bslam compare paper_room --with my_slam.py:MySlam --only bslam,map --sigma 0.6 --seeds 0:8
  bslam compare out/run/paper_room_seed0 --association known
  bslam compare recordings/* --with my_slam:MySlam

SCENARIO is a name or the path of a TOML file; or log folders, which `bslam run --record` leaves, a drive
each, of which --seeds only changes what is drawn: identities of known:RATE, and what reset(seed) draws.

--with names a class by module (found from the working directory, or installed) or by file; docs/PLUGIN.md
says what it must offer. Without --only all that are installed run: bslam, dead_reckoning, map (the exact
causal MAP, the bound), isam2 (GTSAM), mrpt.
The table's ratio is to the map at the steps at which that is solved. compare.json has the table, summary.json
the runs, compare.png the errors over time."""

PICTURE = "compare.png"
_NAMED = 3
TOLD = (BOUND, "isam2")
"""Those that cannot do without identities."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "drives", nargs="+", metavar="SCENARIO", help="name, or path of a TOML file; or log folders"
    )
    group = add_algorithm_options(parser)
    group.add_argument("--only", metavar="NAME,...", help="of those that come with bslam, only these")
    group.add_argument(
        "--map-every",
        type=positive_count,
        default=25,
        metavar="N",
        help="solve the exact MAP every N steps (25)",
    )
    add_sensor_options(parser)
    add_filter_options(parser)
    add_batch_options(parser, "compare", pictures=1)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    for word, unset in (("target", "host"), ("known_map", False)):
        if getattr(arguments, word) != unset:
            option = f"--{word.replace('_', '-')}"
            raise BslamError(f"{option}: not where algorithms are compared; allowed: with run and replay")
    methods, options, result, lines = compare(arguments)
    files = _write(arguments, result, methods, lines)
    _print_table(arguments, lines, options[0])
    print(f"files in {arguments.out}: {', '.join(files)}, NAME.estimate.tum, NAME.map.csv")
    _say_failures(result)
    return 1 if result.interrupted or any(line["failed"] for line in lines) else 0


def compare(
    arguments: argparse.Namespace,
) -> tuple[list[Method], list[RunOptions], ContestResult, list[dict[str, Any]]]:
    """The algorithms, the drives' options, what came of it, and a line for each algorithm."""
    sources, options = _drives(arguments)
    methods = _methods(arguments, options[0].observation)
    for method in methods:
        method.prepare()
    for source in {source.shared: source for source in sources if source.shared is not None}.values():
        source.prepare()
    bouts = make_bouts(methods, sources, options)
    result = hold_contest(bouts, arguments.out, arguments.jobs, arguments.call_limit)
    return methods, options, result, means(result, methods, BOUND, arguments.map_every)


def _methods(arguments: argparse.Namespace, observation: str) -> list[Method]:
    """Those that come with bslam, all or as --only says, and then the user's. Raises BslamError."""
    shipped = shipped_methods(arguments.map_every)
    for one in shipped:
        if one.name in arguments.own:
            what = "comes with bslam; allowed: --only" if one.is_here else "is not installed; allowed:"
            raise BslamError(f"--with {one.name}: {what} {one.name if one.is_here else one.install}")
    chosen = _possible(shipped, observation) if arguments.only is None else _named(shipped, arguments.only)
    for text in arguments.own:
        own = own_method(text)
        if any(other.name == own.name for other in chosen):
            raise BslamError(f"--with {text}: {own.name} is there already; allowed: a name of its own")
        chosen.append(own)
    return chosen


def _possible(shipped: Sequence[Method], observation: str) -> list[Method]:
    """Those that are installed and can do with what is seen."""
    reasons = {one.name: _why_not(one, observation) for one in shipped}
    for name, reason in reasons.items():
        if reason:
            print(f"left out: {name} ({reason})", file=sys.stderr)
    return [one for one in shipped if not reasons[one.name]]


def _why_not(method: Method, observation: str) -> str:
    if not method.is_here:
        return f"not installed: {method.install}"
    if method.only_with not in (None, observation):
        return f"only with --observation {method.only_with}"
    return ""


def _named(shipped: Sequence[Method], only: str) -> list[Method]:
    by_name = {one.name: one for one in shipped}
    chosen = []
    for name in (word.strip() for word in only.split(",")):
        if name not in by_name:
            allowed = f"allowed: {', '.join(by_name)}{did_you_mean(name, by_name)}"
            raise BslamError(f"--only {name}: there is no such algorithm; {allowed}")
        if not by_name[name].is_here:
            raise BslamError(f"--only {name}: is not installed; allowed: {by_name[name].install}")
        chosen.append(by_name[name])
    return chosen


def _drives(arguments: argparse.Namespace) -> tuple[list[Source], list[RunOptions]]:
    if all(Path(word).is_dir() for word in arguments.drives):
        return _logs(arguments, [Path(word).absolute() for word in arguments.drives])
    arguments.scenario = _scenario(arguments.drives)
    wheels = load_scenario(arguments.scenario).wheels
    sigma_mps = wheels.sigma_mps if arguments.sigma is None else arguments.sigma
    noise = arguments.noise or wheels.noise
    options = [
        run_options(arguments, sigma_mps=sigma_mps, noise=noise, seed=seed) for seed in arguments.seeds
    ]
    return [scenario_source(arguments, seed, sigma_mps, noise) for seed in arguments.seeds], options


def _logs(arguments: argparse.Namespace, folders: Sequence[Path]) -> tuple[list[Source], list[RunOptions]]:
    names = [folder.resolve().name for folder in folders]
    for row, folder in enumerate(folders):
        if names[row] in names[:row]:
            raise BslamError(f"{folder}: another log has its name; allowed: folders of different names")
    pairs = [
        (source, run_options(arguments, says=says, sensor="recorded", seed=seed))
        for source in map(FolderSource, folders)
        for says in [source.says]
        for seed in arguments.seeds
    ]
    return [source for source, _ in pairs], [one for _, one in pairs]


def _scenario(words: Sequence[str]) -> str:
    """The one word, which is no folder. Raises BslamError for several, and for a folder that is not there."""
    odd = next(word for word in words if not Path(word).is_dir())
    named = odd in scenario_names() or odd.endswith(".toml")
    near = None if named or Path(odd).exists() else near_folder(odd)
    if len(words) > 1 or near is not None:
        said = f"; did you mean {str(near)!r}?" if near else ""
        raise BslamError(f"{odd}: is no log folder; allowed: paths of log folders, or one SCENARIO{said}")
    return odd


def _write(
    arguments: argparse.Namespace,
    result: ContestResult,
    methods: Sequence[Method],
    lines: Sequence[dict[str, Any]],
) -> list[str]:
    """The files of all runs; their names."""
    out, drives = arguments.out, " ".join(arguments.drives)
    more = {"interrupted": True} if result.interrupted else {}
    write_summary(out, [outcome.entry for _, outcome in result.outcomes], **more)
    about = {
        "scenario": drives,
        "seeds": [arguments.seeds.start, arguments.seeds.stop],
        "bound": BOUND,
        "bound_every_steps": arguments.map_every,
        "versions": _versions(methods),
    }
    write_json(out / "compare.json", {"schema": 1, **about, "methods": list(lines), **more})
    picture = out / PICTURE
    picture.unlink(missing_ok=True)  # of an earlier run
    files = ["compare.json", "summary.json"]
    if arguments.pictures > 0 and (shown := _contenders(result, methods, arguments.map_every)):
        count = len(arguments.drives) * len(arguments.seeds)
        names = ", ".join(Path(word).stem for word in arguments.drives[:_NAMED])
        title = f"{names}{', ...' if len(arguments.drives) > _NAMED else ''}"
        title += f", {f'mean of {count} drives' if count > 1 else '1 drive'}"
        write_atomically(picture, png(draw_comparison(title, shown)))
        files.insert(1, PICTURE)
    return files


def _versions(methods: Sequence[Method]) -> dict[str, str]:
    packages = {"bslam", "numpy", "scipy", *(package for one in methods for package in one.needs)}
    return {package: importlib.metadata.version(package) for package in sorted(packages)}


def _contenders(result: ContestResult, methods: Sequence[Method], every: int) -> list[Contender]:
    """What the picture shows, of drives of one length; the bound at the steps at which it is solved."""
    shown = []
    for method in methods:
        runs = [one for bout, one in result.outcomes if bout.method.name == method.name and len(one.error_m)]
        if len({len(one.error_m) for one in runs}) == 1:
            rows = slice(None, None, every if method.name == BOUND else 1)
            errors = np.array([one.error_m[rows] for one in runs])
            if np.isfinite(errors[:, 1:]).any():
                dashed = method.name == BOUND
                shown.append(Contender(method.name, runs[0].time_s[rows], errors, dashed))
    return shown


def _print_table(arguments: argparse.Namespace, lines: Sequence[dict[str, Any]], options: RunOptions) -> None:
    every = arguments.map_every
    rows = [["algorithm", "mean cm", "max cm", "last 50 s", f"every {every}th", "/ map", "NEES", "map cm"]]
    rows[0] += ["mapped", "of", "wrong", "us/step", ""]
    rows += [_row(line) for line in lines]
    print(table_of(rows))
    bounds_m = [line["bound_error_m"] for line in lines if "bound_error_m" in line]
    if bounds_m:
        print(f"bound, a filter linearised at the truth: {100.0 * bounds_m[0]:.2f} cm")
    told = [line["method"] for line in lines if line["method"] in TOLD]
    if options.association != "known" and told:
        print(f"association {options.association}: {' and '.join(told)}: given the identities")


def _say_failures(result: ContestResult) -> None:
    for bout, outcome in result.outcomes:
        if outcome.failed:
            print(f"{bout.job.name} failed: {outcome.entry['error']}", file=sys.stderr)
            if outcome.crash is not None and "\n" in outcome.crash:
                print(outcome.crash, file=sys.stderr)
    if result.interrupted:
        print("stopped: what was finished is kept", file=sys.stderr)


def _row(line: dict[str, Any]) -> list[str]:
    def cm(key: str) -> str:
        return f"{100.0 * line[key]:.2f}" if key in line else "-"

    def number(key: str, form: str) -> str:
        return format(line[key], form) if key in line else "-"

    troubles = [f"{line[word]} {word.upper()}" for word in ("failed", "lost") if line[word]]
    return [
        line["method"],
        cm("position_error_mean_m"),
        cm("position_error_max_m"),
        cm("position_error_last_50s_m"),
        cm("on_bound_steps_m"),
        number("ratio_to_bound", ".3f"),
        number("nees_mean", ".2f"),
        cm("map_rmse_m"),
        number("beacons_mapped", ".4g"),
        number("beacons_true", ".4g"),
        number("wrong_associations", ".4g"),
        number("step_us_median", ".0f"),
        ", ".join(troubles),
    ]
