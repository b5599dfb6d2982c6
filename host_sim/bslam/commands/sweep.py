"""`bslam sweep`: a grid of runs, and a table with one line a combination."""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Sequence
from pathlib import Path

from bslam.commands.arguments import add_batch_options, add_filter_options, add_sensor_options
from bslam.commands.grid import grid_jobs
from bslam.commands.report import HEADINGS, finish, mean_row, table_of
from bslam.experiment.batch import Outcome, run_batch
from bslam.experiment.output import write_atomically

SUMMARY = "run every combination of sigmas, observations, filters and associations"
EXAMPLES = """examples:
  bslam sweep paper_room --sigma 0.3,0.6,1.0 --filter standard,invariant --seeds 0:10
  bslam sweep pairs --association known,known:0.05,nearest,mahalanobis --seeds 0:5
  bslam sweep paper_room --observation distance,direction --set bearing_sd_rad=0.02

Options with lists take values with commas between. sweep.txt has the means of each combination over its
seeds."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name, or path of a TOML file")
    add_sensor_options(parser)
    add_filter_options(parser, lists=("observation", "association", "filter", "sigma"))
    add_batch_options(parser, "sweep", pictures=0)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    result = run_batch(grid_jobs(arguments, arguments.sigma), arguments.out, arguments.jobs)
    text = combinations(result.outcomes)
    write_atomically(Path(arguments.out) / "sweep.txt", text + "\n")
    return finish(result, arguments.out, text)


def combinations(outcomes: Sequence[Outcome]) -> str:
    """Means over the seeds, one line a combination."""

    def combination(outcome: Outcome) -> tuple[str, ...]:
        entry = outcome.entry
        return tuple(str(entry[word]) for word in ("sigma_mps", "observation", "filter", "association"))

    rows = [["means over seeds", *HEADINGS]]
    for words, group in itertools.groupby(outcomes, combination):
        sigma, observation, filter_name, association = words
        name = f"sigma {sigma}  {observation}  {filter_name}  {association}"
        rows.append(mean_row(name, [outcome.entry for outcome in group]))
    return table_of(rows)
