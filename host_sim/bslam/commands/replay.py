"""`bslam replay`: run the filter on recorded logs."""

from __future__ import annotations

import argparse
from pathlib import Path

from bslam.commands.arguments import add_batch_options, add_filter_options, run_options
from bslam.commands.drawing import draw
from bslam.commands.report import finish
from bslam.errors import BslamError
from bslam.experiment.batch import make_jobs, run_batch
from bslam.experiment.datasets import find_directory
from bslam.experiment.mrclam import ROBOTS, robots_in
from bslam.experiment.sources import FolderSource, MrclamSource, Source

SUMMARY = "run the filter on recorded logs"
EXAMPLES = """examples:
  bslam replay csv out/run/paper_room_seed0
  bslam replay csv recordings/* --filter standard --out out/standard
  bslam replay mrclam MRCLAM_Dataset6 --robot 3
  bslam replay mrclam MRCLAM_Dataset1 MRCLAM_Dataset6 --set huber_d=3

csv: DIR is a folder with odometry.csv, sightings.csv, robot.toml and, if known, truth.csv and beacons.csv.
mrclam: DIR is a set of the UTIAS Multi-Robot Cooperative Localization and Mapping data; all robots without
--robot; figures after rigid alignment.
A DIR that is no path is looked for in the directory named by BSLAM_DATA, else in ../shared/data."""
COLLECTIONS = {"csv": "paper_room", "mrclam": "mrclam"}  # folders of the data directory


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("kind", choices=tuple(COLLECTIONS), help="format of the logs")
    parser.add_argument(
        "directories", nargs="+", metavar="DIR", help="one log (csv) or one data set (mrclam) each"
    )
    parser.add_argument(
        "--robot", type=int, choices=range(1, ROBOTS + 1), help="mrclam: one robot (default: all)"
    )
    add_filter_options(parser)
    add_batch_options(parser, "replay")


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    logs = log_sources(arguments.kind, arguments.directories, arguments.robot)
    pairs = [
        (source, run_options(arguments, has_looks=source.has_looks, sensor="recorded", seed=seed))
        for source in logs
        for seed in arguments.seeds
    ]
    jobs = make_jobs([source for source, _ in pairs], [one for _, one in pairs], draw, arguments.pictures)
    return finish(run_batch(jobs, arguments.out, arguments.jobs), arguments.out)


def log_sources(kind: str, directories: list[str], robot: int | None) -> list[Source]:
    """The logs that the words of a command line name. Raises BslamError."""
    if robot is not None and kind != "mrclam":
        raise BslamError(f"--robot {robot}: a {kind} log is of one robot; allowed: --robot with mrclam")
    folders = [find_directory(name, COLLECTIONS[kind]) for name in directories]
    if kind == "csv":
        return [FolderSource(folder) for folder in folders]
    return [MrclamSource(folder, number) for folder in folders for number in _robots(folder, robot)]


def _robots(folder: Path, robot: int | None) -> list[int]:
    there = robots_in(folder)
    if robot is None:
        return there
    if robot not in there:
        raise BslamError(f"{folder}: no robot {robot}; allowed: {', '.join(map(str, there))}")
    return [robot]
