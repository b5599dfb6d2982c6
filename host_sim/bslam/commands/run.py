"""`bslam run`: simulate a scenario and run the filter on it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

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
from bslam.runs.output import write_atomically
from bslam.runs.runner import run_log
from bslam.runs.stage import stage_of
from bslam.runs.takes import Takes
from bslam.view.film import SUFFIXES, film
from bslam.world.simulate import load_scenario

SUMMARY = "simulate a scenario and run the filter on it"
EXAMPLES = """examples:
  bslam run paper_room
  bslam run paper_room --seeds 0:20 --sigma 1.0 --observation direction
  bslam run pairs --association mahalanobis --set match_d2=9.2
  bslam run paper_room --sensor camera --rig wide180
  bslam run paper_room --observation direction --film drive.gif
  bslam run my_room.toml --filter standard --motion euler --record --out out/mine

SCENARIO is a name or the path of a TOML file; each run writes its trajectory, map and pictures into --out."""
_FILM_FRAMES: Final = 110  # nine seconds


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name, or path of a TOML file")
    parser.add_argument(
        "--record",
        action="store_true",
        help="keep the log as a folder NAME, the run as NAME.mcap (see `replay`)",
    )
    parser.add_argument(
        "--film", type=_film_path, metavar="FILE", help="an animated picture of the first run, .gif or .webp"
    )
    add_sensor_options(parser)
    add_filter_options(parser)
    add_batch_options(parser, "run")


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    jobs = jobs_of(arguments)
    result = run_batch(jobs, arguments.out, arguments.jobs)
    made = [] if result.interrupted else [one.name for one in result.outcomes if not one.failed]
    if arguments.film is not None and jobs[0].name in made:
        _make_film(jobs[0], arguments.film)
    return finish(result, arguments.out)


def _make_film(job: Job, path: Path) -> None:
    """Run it once more, and draw what it did."""
    log = job.source.load()
    takes = Takes(log, _FILM_FRAMES)
    run_log(log, job.options, watcher=takes)
    write_atomically(path, film(stage_of(job, log), takes.moments, path.suffix))
    print(f"film: {path}, {len(takes.moments)} frames")


def _film_path(text: str) -> Path:
    if Path(text).suffix not in SUFFIXES:
        allowed = ", ".join(f"FILE{suffix}" for suffix in SUFFIXES)
        raise argparse.ArgumentTypeError(f"'{text}' is no picture that moves; allowed: {allowed}")
    there = next(one for one in Path(text).absolute().parents if one.exists())
    if Path(text).is_dir() or not there.is_dir():
        raise argparse.ArgumentTypeError(f"'{text}' cannot be written; allowed: a file in a folder")
    return Path(text)


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
