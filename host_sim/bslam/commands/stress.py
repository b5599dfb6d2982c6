"""`bslam stress`: what it costs when something is not as the filter is told."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from bslam.commands.arguments import add_batch_options, add_filter_options, run_options
from bslam.commands.drawing import draw
from bslam.commands.report import table_of
from bslam.commands.sweep import add_files_option, add_restart_option, finish, make_runs
from bslam.errors import did_you_mean
from bslam.evaluation.consistency import BELOW_95
from bslam.options import RunOptions
from bslam.runs.batch import Job, make_jobs
from bslam.runs.output import write_atomically
from bslam.runs.sources import Says
from bslam.runs.stress import ENCODERS_MPS, NOMINAL, ROWS, RowFigures, StressSource, row_figures
from bslam.runs.sweep import SweepResult, code_digest
from bslam.view.stress import Line, draw_stress
from bslam.view.style import png
from bslam.world.simulate import load_scenario

SUMMARY = "what it costs when sensor, wheels or noise are not as the filter is told"
_TABLE: Final = "stress.txt"
_PICTURE: Final = "stress.png"
_ROWS_TEXT = "\n".join(f"  {name:15} {row.meaning}" for name, row in ROWS.items())
EXAMPLES = f"""examples:
  bslam stress paper_room
  bslam stress paper_room --seeds 100:140 --jobs 2 --no-files --out out/told_wrong
  bslam stress paper_room --rows slip,loop-100m --seeds 0:100 --no-velocity-states
  bslam stress my_room.toml --rows sensor-yaw,delay --sigma 0.05 --set gate_d2=0

Each row changes one thing of the scenario's truth and nothing of what the filter is told; {NOMINAL} changes
none, and runs beside the rows that are asked for. Identities are known unless --association says otherwise.

rows:
{_ROWS_TEXT}

Slips, loops and resume have the noise of real encoders, {ENCODERS_MPS} m/s, whatever --sigma says, and a
nominal row of their own. A loop is driven in an empty hall, with the scenario's robot and sensor; its last
50 s show whether it was closed. / nominal: mean error relative to the nominal row of the same sigma.
{BELOW_95}: share of steps with such a NEES, 95 % if consistent. lost: error above 2 m in the last 1000 steps,
with Wilson's 95 % interval of the share. failed: lost; or 5 s above 1 m; or a map that is not exact; or NEES
above 20 over the last 50 s. {_TABLE}, {_PICTURE} and summary.json hold the table.

Finished runs are kept as `bslam sweep` keeps them: after Ctrl-C the same command makes those that are
missing."""
_HEADINGS: Final = (
    "sigma",
    "runs",
    "cm",
    "/ nominal",
    "last 50 s",
    "NEES",
    f"{BELOW_95}, %",
    "lost",
    "failed",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name, or path of a TOML file")
    parser.add_argument(
        "--rows", type=_rows, default=list(ROWS), metavar="ROW,...", help="which rows (default: all)"
    )
    add_restart_option(parser)
    add_files_option(parser)
    add_filter_options(parser)
    add_batch_options(parser, "stress", seeds="0:12", pictures=0)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    if Path(arguments.scenario).is_file():
        arguments.scenario = str(Path(arguments.scenario).absolute())  # workers may be elsewhere
    jobs = jobs_of(arguments)
    result = make_runs(arguments, jobs, _plan(arguments, jobs))
    _name_rows(result, jobs)
    entries = result.all_entries
    rows = sorted(row_figures(entries), key=lambda one: list(ROWS).index(one.row))
    text = ""
    if rows:
        write_atomically(arguments.out / _PICTURE, png(_picture(arguments, rows)))
        text = f"{table(rows)}\n{_presets(entries)}\npicture: {_PICTURE}"
    return finish(result, arguments.out, _TABLE, text, rows=[one.as_json() for one in rows])


def jobs_of(arguments: argparse.Namespace) -> list[Job]:
    """A run for each row and seed, those of a nominal row for each sigma first. Raises BslamError."""
    wheels = load_scenario(arguments.scenario).wheels
    asked_mps = wheels.sigma_mps if arguments.sigma is None else arguments.sigma
    noise = arguments.noise or wheels.noise
    rows = [(name, ROWS[name].sigma_mps or asked_mps) for name in arguments.rows if name != NOMINAL]
    compared = [sigma_mps for name, sigma_mps in rows if not ROWS[name].elsewhere]
    nominal = dict.fromkeys([asked_mps] * (NOMINAL in arguments.rows) + compared)
    sources: list[StressSource] = []
    options: list[RunOptions] = []
    for name, sigma_mps in [*((NOMINAL, one) for one in nominal), *rows]:
        for seed in arguments.seeds:
            sources.append(StressSource(arguments.scenario, seed, sigma_mps, noise, row=name))
            told = {"sigma_mps": sigma_mps, "noise": noise, "resume_sd": ROWS[name].resume_sd}
            options.append(run_options(arguments, says=Says(), seed=seed, **told))
        sources[-1].world()  # what cannot be is said before anything is run
    jobs = make_jobs(sources, options, draw, arguments.pictures)
    return [replace(one, files=arguments.files) for one in jobs]


def _plan(arguments: argparse.Namespace, jobs: Sequence[Job]) -> dict[str, str]:
    """What decides the runs."""
    options = {key: str(value) for key, value in asdict(jobs[0].options).items()}
    world = json.dumps(asdict(load_scenario(arguments.scenario)))
    words = {"rows": ",".join(arguments.rows), "seeds": str(arguments.seeds), **options}
    return words | {
        "files": str(arguments.files),
        f"scenario {arguments.scenario}": world,
        "bslam": code_digest(),
    }


def _name_rows(result: SweepResult, jobs: Sequence[Job]) -> None:
    """Says of each entry which row of which scenario it is."""
    sources = {job.name: job.source for job in jobs}
    for entry in result.all_entries:
        source = sources[entry["name"]]
        assert isinstance(source, StressSource)
        entry |= {"scenario": Path(source.scenario).stem, "row": source.row}


def table(rows: Sequence[RowFigures]) -> str:
    """One line a row."""
    return table_of([["row", *_HEADINGS], *(_line(one) for one in rows)])


def _line(one: RowFigures) -> list[str]:
    low, high = one.lost_interval
    lost = f"{one.lost} of {one.runs}, {100.0 * low:.0f}-{100.0 * high:.0f} %"
    return [
        f"{one.row:15} {ROWS[one.row].meaning}",
        f"{one.sigma_mps:g}",
        str(one.runs),
        _figure(one.mean_cm, ".1f"),
        _figure(one.to_nominal, ".2f"),
        _figure(one.last_50s_cm, ".1f"),
        _figure(one.mean_nees, ".1f"),
        _figure(100.0 * one.inside_95, ".1f"),
        lost,
        "-" if one.failed is None else str(one.failed),
    ]


def _figure(value: float | None, form: str) -> str:
    if value is None or not math.isfinite(value):
        return "-"
    return format(value, form) if value < 1e5 else f"{value:.0e}"


def _presets(entries: Sequence[dict[str, Any]]) -> str:
    """A line with those that the runs started from."""
    presets = dict.fromkeys(", ".join(entry.get("presets", ())) for entry in entries)
    return f"presets: {'; '.join(filter(None, presets))}"


def _picture(arguments: argparse.Namespace, rows: Sequence[RowFigures]) -> Any:
    lines = [
        Line(
            f"{ROWS[one.row].meaning}, {one.sigma_mps:g} m/s",
            one.error_cm,
            one.nees,
            one.lost / one.runs,
            one.lost_interval,
        )
        for one in rows
    ]
    title = (
        f"{Path(arguments.scenario).stem}, {len(arguments.seeds)} drives a row: a dot a run, a bar their mean"
    )
    return draw_stress(title, lines)


def _rows(text: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in ROWS:
            allowed = f"allowed: {', '.join(ROWS)}{did_you_mean(name, ROWS)}"
            raise argparse.ArgumentTypeError(f"'{name}' does not exist; {allowed}")
    return [name for name in ROWS if name in names]
