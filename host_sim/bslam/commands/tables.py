"""`bslam tables`: the paper's Tables I to III and Fig. 6 to 9, over several seeds."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from bslam.commands.arguments import add_batch_options, add_filter_options, add_sensor_options
from bslam.commands.grid import Filters, grid_jobs
from bslam.commands.report import finish, table_of
from bslam.evaluation.consistency import BELOW_95, nees_band_95
from bslam.evaluation.metrics import WINDOW_S
from bslam.options import OBSERVATIONS
from bslam.runs.batch import Job, Outcome, run_batch
from bslam.runs.output import write_atomically, write_json
from bslam.runs.tables import (
    NAMES,
    OBSERVATION_TITLES,
    SIGMAS_MPS,
    STATISTICS,
    Cell,
    heading,
    make_cell,
    markdown,
    runs_a_cell,
)
from bslam.view.series import Series, draw_cells
from bslam.view.style import png

Key = tuple[float, str, str]
"""Sigma in m/s, observation and filter of a cell."""

BEST_FILTERS: Final[Filters] = {
    "distance": ["invariant"],
    "direction": ["invariant", "smoother"],
}
"""Those worth a column, by observation."""

SUMMARY = "the paper's Tables I to III and Fig. 6 to 9, with this estimator's figures beside"
EXAMPLES = """examples:
  bslam tables
  bslam tables --seeds 100:120 --jobs 2 --out out/fresh
  bslam tables --filter standard --no-velocity-states --motion euler --out out/as_printed
  bslam tables --sigma 0.3 --observation distance --seeds 0:3
  bslam tables --observation direction --filter invariant,smoother --association known

Without --filter there is a column for each estimator that is worth one: the invariant filter, and in
direction only the smoother beside it.

Writes tables.md, tables.json, sigmaX.png (errors and NEES over time) and the files of every run."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "--scenario", default="paper_room", help="name, or path of a TOML file (default: paper_room)"
    )
    add_sensor_options(parser)
    add_filter_options(parser, lists=("observation", "filter", "sigma"))
    parser.set_defaults(sigma=list(SIGMAS_MPS), observation=list(OBSERVATIONS))
    add_batch_options(parser, "tables", seeds="0:10", pictures=1)


def table_jobs(arguments: argparse.Namespace) -> list[Job]:
    """The runs of the tables."""
    return grid_jobs(arguments, arguments.sigma, BEST_FILTERS)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    jobs = table_jobs(arguments)
    result = run_batch(jobs, arguments.out, arguments.jobs)
    by_cell = group(jobs, result.outcomes)
    cells = cells_of(jobs, by_cell)
    pictures = {
        sigma_mps: _draw_sigma(arguments.out, sigma_mps, by_cell)
        for sigma_mps in {c.sigma_mps for c in cells}
    }
    room = f"{jobs[0].name}.map.png" if arguments.pictures > 0 else None
    association, scenario = jobs[0].options.association, jobs[0].source.name
    title = f"{heading(scenario)}: association {association}, {runs_a_cell(len(arguments.seeds))}"
    write_atomically(arguments.out / "tables.md", markdown(cells, title, pictures, room))
    write_json(arguments.out / "tables.json", {"schema": 1, "cells": [cell.as_json() for cell in cells]})
    return finish(result, arguments.out, table_of(_rows(cells, association)), more="tables.md, tables.json")


def cells_of(jobs: Sequence[Job], by_cell: dict[Key, list[Outcome]]) -> list[Cell]:
    """The cells that have a figure."""
    made = (make_cell(jobs[0].source.name, *key, outcomes) for key, outcomes in by_cell.items())
    return [cell for cell in made if cell is not None]


def group(jobs: Sequence[Job], outcomes: Sequence[Outcome]) -> dict[Key, list[Outcome]]:
    """Outcomes by sigma, observation and filter, in the order of the jobs."""
    cell_of = {
        job.name: (float(job.options.sigma_mps or 0.0), job.options.observation, job.options.filter)
        for job in jobs
    }
    by_cell: dict[Key, list[Outcome]] = {}
    for outcome in outcomes:
        by_cell.setdefault(cell_of[outcome.name], []).append(outcome)
    return by_cell


def _draw_sigma(out: Path, sigma_mps: float, by_cell: dict[Key, list[Outcome]]) -> str:
    """Write the picture of a sigma; the name of the file."""
    name = f"sigma{sigma_mps:g}.png"
    write_atomically(out / name, picture(sigma_mps, by_cell))
    return name


def picture(sigma_mps: float, by_cell: dict[Key, list[Outcome]]) -> bytes:
    """All cells of one sigma over time, as PNG."""
    cells = []
    for (sigma, observation, filter_name), outcomes in by_cell.items():
        runs = [one for one in outcomes if len(one.time_s)]
        if sigma == sigma_mps and runs:
            error_m, nees = np.array([one.error_m for one in runs]), np.array([one.nees for one in runs])
            title = f"{OBSERVATION_TITLES[observation]}: {NAMES[filter_name]}"
            cells.append(Series(title, runs[0].time_s, error_m, nees, nees_band_95(len(runs)), WINDOW_S))
    return png(draw_cells(f"Position error and NEES, sigma = {sigma_mps:g} m/s", cells))


def _rows(cells: Sequence[Cell], association: str) -> list[list[str]]:
    """What is printed: paper / here, or here alone."""
    what = f"cm, {association}" + (": paper / here" if any(cell.paper_cm for cell in cells) else "")
    rows = [[what, *STATISTICS, "first 50 s", "last 50 s", "bound", "NEES", BELOW_95, "lost"]]
    for cell in cells:
        paper = {name: f"{value:g} / " for name, value in (cell.paper_cm or {}).items()}
        pairs = [f"{paper.get(name, '')}{cell.error_cm[name]:.2f}" for name in STATISTICS]
        rest = [f"{cell.first_50s_cm:.2f}", f"{cell.last_50s_cm:.2f}"]
        rest += ["-" if cell.bound_cm is None else f"{cell.bound_cm:.2f}", f"{cell.nees_mean:.2f}"]
        rest += [f"{100 * cell.nees_inside_95:.1f} %", f"{cell.lost}/{cell.runs}"]
        rows.append([f"sigma {cell.sigma_mps:g} {cell.observation}, {cell.filter}", *pairs, *rest])
    return rows
