"""`bslam run`: simulate a scenario and run the filter on it."""

from __future__ import annotations

import argparse

from bslam.commands.arguments import (
    add_batch_options,
    add_filter_options,
    add_sensor_options,
    run_options,
    scenario_source,
)
from bslam.commands.drawing import draw
from bslam.commands.report import finish
from bslam.runs.batch import Job, make_jobs, run_batch
from bslam.world.simulate import load_scenario

SUMMARY = "simulate a scenario and run the filter on it"
EXAMPLES = """examples:
  bslam run paper_room
  bslam run paper_room --seeds 0:20 --sigma 1.0 --observation direction
  bslam run pairs --association mahalanobis --set match_d2=9.2
  bslam run paper_room --sensor camera --rig wide180
  bslam run my_room.toml --filter standard --motion euler --record --out out/mine

SCENARIO is a name or the path of a TOML file; each run writes its trajectory, map and pictures into --out."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name, or path of a TOML file")
    parser.add_argument(
        "--record",
        action="store_true",
        help="keep the log as a folder NAME, the run as NAME.mcap (see `replay`)",
    )
    add_sensor_options(parser)
    add_filter_options(parser)
    add_batch_options(parser, "run")


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    return finish(run_batch(jobs_of(arguments), arguments.out, arguments.jobs), arguments.out)


def jobs_of(arguments: argparse.Namespace) -> list[Job]:
    """A run for each seed. Raises BslamError."""
    wheels = load_scenario(arguments.scenario).wheels
    sigma_mps = wheels.sigma_mps if arguments.sigma is None else arguments.sigma
    noise = arguments.noise or wheels.noise
    options = [
        run_options(arguments, sigma_mps=sigma_mps, noise=noise, seed=seed) for seed in arguments.seeds
    ]
    sources = [scenario_source(arguments, seed, sigma_mps, noise) for seed in arguments.seeds]
    return make_jobs(sources, options, draw, arguments.pictures, arguments.record)
