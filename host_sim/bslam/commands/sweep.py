"""`bslam sweep`: a grid of runs, thousands perhaps, and a table with one line a combination."""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import statistics
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final, NoReturn

from bslam.commands.arguments import (
    add_algorithm_options,
    add_batch_options,
    add_filter_options,
    add_sensor_options,
)
from bslam.commands.drawing import draw
from bslam.commands.grid import grid
from bslam.commands.helping import more_options
from bslam.commands.report import HEADINGS, mean_row, table_of, verdict
from bslam.errors import BslamError, pip_install
from bslam.evaluation.consistency import RUNS_FOR_INTERVAL, half_interval_95, share_interval_95
from bslam.evaluation.failure import is_exact
from bslam.options import RunOptions
from bslam.parsing.settings import check_keys, load_toml
from bslam.runs.batch import Job, make_jobs
from bslam.runs.cluster import cluster
from bslam.runs.contest import Guest, guest_jobs
from bslam.runs.methods import method_digest, own_method
from bslam.runs.output import write_atomically, write_summary
from bslam.runs.sources import Source
from bslam.runs.sweep import (
    PARQUET,
    STORE,
    Store,
    SweepResult,
    code_digest,
    forget,
    run_sweep,
    write_parquet,
)
from bslam.world.simulate import load_scenario

SUMMARY = "run every combination of scenarios, sigmas, observations, filters, associations, parameters"
EXAMPLES = """examples:
  bslam sweep paper_room --sigma 0.3,0.6,1.0 --filter standard,invariant --seeds 0:10
  bslam sweep pairs --association known,nearest,mahalanobis,svm --seeds 0:40
  bslam sweep gates.toml --jobs 8 --out out/gates
  bslam sweep paper_room --with my_slam:MySlam --seeds 0:100
  bslam sweep gates.toml --cluster tcp://10.0.0.1:8786 --no-files

A sweep file (TOML) holds the options by their names, with underscores, and lists for several values.

  scenarios = ["paper_room", "pairs"]
  seeds = "0:100"
  sigma = [0.3, 1.0]
  association = ["known", "mahalanobis"]
  set.gate_d2 = [9.0, 16.0]
which is 2 x 100 x 2 x 2 x 2 runs. with = ["my_slam:MySlam"] makes the same drives with an algorithm of your
own, too (docs/PLUGIN.md), each run in a process of its own.
Finished runs are kept in DIR/sweep.sqlite: after Ctrl-C, a crash or a power cut the same command makes those
that are missing. results.parquet has a row a run, sweep.txt the means
of each combination over its seeds, with 95 % intervals. / known: mean error relative to that of the run
with known association on the same drive, where --association names known, too. wrong %: of the sightings.
exact: maps that match the truth one to one within 0.5 m. failed: diverged; or 5 s above both 1 m and 3 x
known; or a map that is not exact; or NEES above 20 over the last 50 s. On a cluster every worker needs this
version of bslam and, without --no-files, the same DIR."""
_COLUMNS_MOST: Final = 110  # of a table's lines
_LISTS: Final = ("observation", "association", "filter", "sigma")
_FLAGS: Final = ("velocity_states", "known_map", "files")
_MANY: Final = ("with",)  # options that may be repeated
_WORDS: Final = ("seeds", "motion", "noise", "sensor", "rig", "real")
_KEYS: Final = dict.fromkeys(("scenarios", *_LISTS, *_WORDS, *_FLAGS, *_MANY, "set"))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "scenario", metavar="FILE", help="a sweep file; or a scenario, by name or path of a TOML file"
    )
    add_restart_option(parser)
    more_options(parser).add_argument(
        "--cluster", metavar="ADDRESS", help="a Dask scheduler whose workers make the runs, tcp://HOST:PORT"
    )
    _add_run_options(parser)


def add_restart_option(parser: argparse.ArgumentParser) -> None:
    """For a command that keeps its runs."""
    parser.add_argument(
        "--restart", action="store_true", help="throw away the runs that DIR keeps, and begin anew"
    )


def add_files_option(parser: argparse.ArgumentParser) -> None:
    """For a command with many runs."""
    parser.add_argument(
        "--files",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="trajectories and map of each run, about 0.7 MB (default: yes)",
    )


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    add_files_option(parser)
    add_algorithm_options(parser)
    add_sensor_options(parser)
    add_filter_options(parser, lists=_LISTS)
    add_batch_options(parser, "sweep", pictures=0)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    jobs, plan = jobs_and_plan(arguments)
    with contextlib.ExitStack() as stack:
        backend = stack.enter_context(cluster(arguments.cluster)) if arguments.cluster else None
        result = make_runs(arguments, jobs, plan, backend)
    text = combinations(result.all_entries) if result.all_entries else ""
    status = finish(result, arguments.out, "sweep.txt", text)
    if jobs_and_plan(arguments)[1] != plan:
        raise BslamError(f"{arguments.scenario}: was changed while its runs were made, which are of before")
    return status


def make_runs(
    arguments: argparse.Namespace, jobs: Sequence[Job], plan: Mapping[str, str], backend: str | None = None
) -> SweepResult:
    """The runs of `jobs`, those that arguments.out keeps and those that it lacks. Raises BslamError."""
    if arguments.restart:
        forget(arguments.out)
    with Store(arguments.out, plan) as store:
        return run_sweep(jobs, store, arguments.out, arguments.jobs, backend)


def finish(result: SweepResult, out: Path, table: str, text: str, **more: Any) -> int:
    """Write and say what came of it; the exit status. Raises BslamError if an input was bad.

    `table` is the file of `text`, `more` what else summary.json says.
    """
    more |= {"interrupted": True} if result.missing else {}
    write_summary(out, result.all_entries, **more)
    files = ["summary.json", STORE]
    if text:
        write_atomically(out / table, text + "\n")
        files.insert(1, table)
        print(text)
    if result.all_entries:
        print(f"verdict: {verdict(result.all_entries)}")
    if result.entries:
        try:
            write_parquet(out / PARQUET, result.entries)
            files.insert(0, PARQUET)
        except ImportError as error:
            print(f"no {PARQUET}: {error}; {pip_install('pyarrow')}, and the same command writes it")
    if result.kept:
        print(f"{result.kept} of {len(result.entries)} runs were there already")
    print(f"files in {out}: {', '.join(files)}")
    for outcome in result.failed:
        print(f"{outcome.name} failed:\n{outcome.crash or outcome.bad_input}", file=sys.stderr)
    if result.missing:
        print(
            f"{result.stopped}: {result.missing} runs are missing; the same command makes them",
            file=sys.stderr,
        )
    bad_input = next((one.bad_input for one in result.failed if one.bad_input is not None), None)
    if bad_input is not None:
        raise BslamError(bad_input)
    return 1 if result.failed or result.missing else 0


def combinations(entries: Sequence[Mapping[str, Any]]) -> str:
    """Means over the seeds, and how sure the mean error is: above the table what all combinations share."""
    groups: dict[tuple[str, ...], list[Mapping[str, Any]]] = {}
    for entry in entries:
        words = [f"sigma {entry['sigma_mps']}", str(entry["observation"])]
        words.append(str(entry["method"] if "method" in entry else entry["filter"]))
        words += [str(entry["association"]), *_parameters(entry, entries)]
        groups.setdefault((str(entry["scenario"]), *words), []).append(entry)
    shared = [word for word in next(iter(groups)) if all(word in name for name in groups)]
    rows = [["", "runs", HEADINGS[0], "+- cm", "/ known", "wrong %", "exact", "failed", *HEADINGS[1:]]]
    for name, group in groups.items():
        own = "  ".join(word for word in name if word not in shared) or "all"
        first, mean, *rest = mean_row(own, [dict(entry) for entry in group])
        rows.append([first, str(len(group)), mean, _interval(group), *_quality(group), *rest])
    blocks = [table_of(block) for block in _blocks(rows)]
    return "\n\n".join([f"means over seeds of {', '.join(shared)}", *blocks, *_what_is_missing(rows)])


def _what_is_missing(rows: Sequence[Sequence[str]]) -> list[str]:
    """What to run for the columns that are empty: one text, or none."""
    notes = []
    if any(row[3] == "-" for row in rows):
        notes.append(f"+- cm, half of the 95 % interval, takes {RUNS_FOR_INTERVAL} seeds at least")
    if all(row[4] == "-" for row in rows[1:]):
        notes.append("/ known takes --association known and another one")
    return ["\n".join(notes)] if notes else []


def _blocks(rows: Sequence[Sequence[str]]) -> Iterator[list[list[str]]]:
    """The table in parts that a terminal holds, each with the names."""
    widths = [max(map(len, column)) + 2 for column in zip(*rows, strict=True)]
    first = 1
    while first < len(widths):
        after = first + 1
        while after < len(widths) and widths[0] - 2 + sum(widths[first : after + 1]) <= _COLUMNS_MOST:
            after += 1
        yield [[row[0], *row[first:after]] for row in rows]
        first = after


def _quality(group: Sequence[Mapping[str, Any]]) -> list[str]:
    """Error relative to known association, wrong %, exact maps, failed runs."""
    ratios = [one["ratio_to_known"] for one in group if "ratio_to_known" in one]
    half = half_interval_95(ratios)
    ratio = f"{statistics.fmean(ratios):.2f}" if ratios else "-"
    wrong = [
        100.0 * one["wrong_associations"] / one["sightings"]
        for one in group
        if "wrong_associations" in one and one["sightings"] > 0
    ]
    maps = [one["map_one_to_one"] for one in group if "map_one_to_one" in one]
    failed = sum(bool(one["failed"]) for one in group)
    low, high = share_interval_95(failed, len(group))
    return [
        ratio if half is None else f"{ratio} +- {half:.2f}",
        f"{statistics.fmean(wrong):.2f}" if wrong else "-",
        f"{sum(map(is_exact, maps))} of {len(maps)}" if maps else "-",
        f"{failed} of {len(group)}, {100.0 * low:.0f}-{100.0 * high:.0f} %",
    ]


def _parameters(entry: Mapping[str, Any], entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Those that differ from run to run, but for what the other words say already."""
    own = entry.get("parameters", {})
    ours = [one["parameters"] for one in entries if one.get("parameters")]  # a user's own has none
    told = ("association", "filter", "left_speed_sd_mps", "right_speed_sd_mps")
    return [
        f"{key} {own[key]}"
        for key in sorted(own)
        if key not in told and len({one.get(key) for one in ours}) > 1
    ]


def _interval(group: Sequence[Mapping[str, Any]]) -> str:
    """Half of the 95 % interval of the mean error."""
    half_m = half_interval_95([one["position_error_m"]["mean"] for one in group if "position_error_m" in one])
    return "-" if half_m is None else f"{100.0 * half_m:.2f}"


# --- What is to be run ------------------------------------------------------------------------------------


def jobs_and_plan(arguments: argparse.Namespace) -> tuple[list[Job], dict[str, str]]:
    """The runs, and what decides them. Raises BslamError."""
    path = Path(arguments.scenario)
    if path.suffix == ".toml" and path.is_file() and "scenarios" in (content := load_toml(path)):
        grids = list(_of_file(path, content))
        words = {key: json.dumps(value, sort_keys=True) for key, value in content.items()}
    else:
        grids = [arguments]
        words = {key: str(getattr(arguments, key)) for key in (*_LISTS, *_WORDS, *_FLAGS, "set")}
    sources: list[Source] = []
    options: list[RunOptions] = []
    for one in grids:
        if Path(one.scenario).is_file():
            one.scenario = str(Path(one.scenario).absolute())  # workers may have another working directory
        more_sources, more_options = grid(one, one.sigma)
        sources += more_sources
        options += more_options
    jobs = make_jobs(sources, options, draw, arguments.pictures)
    if not grids[0].files:
        jobs = [replace(one, files=False) for one in jobs]
    methods = [own_method(text) for text in grids[0].own]
    words |= {f"with {one.where}": method_digest(one) for one in methods}
    guests = [guest_jobs(jobs, Guest(one, grids[0].call_limit)) for one in methods]
    jobs += itertools.chain.from_iterable(guests)
    worlds = {f"scenario {one.scenario}": json.dumps(asdict(load_scenario(one.scenario))) for one in grids}
    return jobs, words | worlds | {"bslam": code_digest()}


class _FileParser(argparse.ArgumentParser):
    """Says what is wrong with a file's content instead of ending the program."""

    def __init__(self, path: Path) -> None:
        super().__init__(allow_abbrev=False, add_help=False)
        self._path = path

    def error(self, message: str) -> NoReturn:
        raise BslamError(f"{self._path}: {message.removeprefix('argument --')}")


def _of_file(path: Path, content: Mapping[str, Any]) -> list[argparse.Namespace]:
    """A grid for each scenario and combination of parameters. Raises BslamError."""
    check_keys(content, _KEYS, str(path))
    parser = _FileParser(path)
    _add_run_options(parser)
    words = [word for key, value in content.items() for word in _words(key, value)]
    axes = {key: _listed(value) for key, value in content.get("set", {}).items()}
    grids = []
    for scenario in _listed(content["scenarios"]):
        for values in itertools.product(*axes.values()):
            settings = [f"--set={key}={value}" for key, value in zip(axes, values, strict=True)]
            one = parser.parse_args([*words, *settings])
            one.scenario = str(scenario)
            grids.append(one)
    return grids


def _words(key: str, value: Any) -> list[str]:
    """A key of the file as on the command line."""
    option = key.replace("_", "-")
    if key in ("scenarios", "set"):
        return []
    if key in _MANY:
        return [f"--{option}={one}" for one in _listed(value)]
    if key in _FLAGS and isinstance(value, bool):
        return [f"--{option}" if value else f"--no-{option}"] if key != "known_map" or value else []
    return [f"--{option}={','.join(str(one) for one in _listed(value))}"]


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]
