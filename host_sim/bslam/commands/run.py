"""`bslam run`: simulate a scenario and run the filter on it."""

from __future__ import annotations

import argparse

from bslam.commands.arguments import add_batch_options, add_filter_options, run_options
from bslam.commands.drawing import draw
from bslam.commands.report import finish
from bslam.experiment.batch import make_jobs, run_batch
from bslam.experiment.options import SENSORS
from bslam.experiment.sources import ScenarioSource
from bslam.world.simulate import load_scenario

SUMMARY = "simulate a scenario and run the filter on it"
EXAMPLES = """examples:
  bslam run paper_room
  bslam run paper_room --seeds 0:20 --sigma 1.0 --observation direction
  bslam run pairs --association mahalanobis --set match_d2=9.2
  bslam run my_room.toml --filter standard --motion euler --record --out out/mine

SCENARIO is a name or the path of a TOML file; each run writes its trajectory, map and pictures into --out."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name, or path of a TOML file")
    parser.add_argument(
        "--sensor",
        choices=SENSORS,
        default="simulated",
        help="where sightings come from (default: simulated, from geometry)",
    )
    parser.add_argument(
        "--record", action="store_true", help="write each log as a folder NAME, too (see `replay csv`)"
    )
    add_filter_options(parser)
    add_batch_options(parser, "run")


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    wheels = load_scenario(arguments.scenario).wheels
    sigma_mps = wheels.sigma_mps if arguments.sigma is None else arguments.sigma
    noise = arguments.noise or wheels.noise
    options = [
        run_options(arguments, sigma_mps=sigma_mps, noise=noise, sensor=arguments.sensor, seed=seed)
        for seed in arguments.seeds
    ]
    sources = [ScenarioSource(arguments.scenario, seed, sigma_mps, noise) for seed in arguments.seeds]
    jobs = make_jobs(sources, options, draw, arguments.pictures, arguments.record)
    return finish(run_batch(jobs, arguments.out, arguments.jobs), arguments.out)
