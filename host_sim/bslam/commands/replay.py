"""`bslam replay`: run the filter on recorded logs."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from bslam.commands.arguments import (
    add_align_option,
    add_batch_options,
    add_filter_options,
    core_parameters,
    run_options,
)
from bslam.commands.drawing import draw
from bslam.commands.report import finish
from bslam.datasets.datasets import find_directory, is_bag, line_to_type
from bslam.datasets.mrclam import ROBOTS, robots_in
from bslam.errors import BslamError
from bslam.recording.reader import SUFFIX
from bslam.runs.batch import Job, make_jobs, run_batch
from bslam.runs.rerun import options_of
from bslam.runs.sources import DlrSource, FolderSource, MrclamSource, RecordingSource, Source

SUMMARY = "run the filter on recorded logs"
EXAMPLES = """examples:
  bslam replay out/run/paper_room_seed0.mcap
  bslam replay drive.mcap --target qemu:mps2_an386
  bslam replay csv out/run/paper_room_seed0
  bslam replay csv recordings/* --filter standard --out out/standard
  bslam replay csv my_drive --align rigid --preset real-wheels
  bslam replay mrclam MRCLAM_Dataset6 --robot 3
  bslam replay mrclam MRCLAM_Dataset1 MRCLAM_Dataset6 --set huber_d=3
  bslam replay dlr dlr_spatial_cognition --association known

A recording (.mcap) runs again as it ran: its own inputs in their order with its own parameters, and every
state is held against the recorded one; exit status 1 if a bit differs. With --set or --params it runs
otherwise, and nothing is compared.

csv: DIR is a folder with odometry.csv, sightings.csv, robot.toml and, if known, truth.csv and beacons.csv.
mrclam: DIR is a set of the UTIAS Multi-Robot Cooperative Localization and Mapping data; all robots without
--robot.
dlr: DIR is the DLR Spatial Cognition data set, held against its least-squares solution.
A DIR that is no path is looked for in the directory named by BSLAM_DATA, else in ../shared/data."""
COLLECTIONS = {"csv": "paper_room", "mrclam": "mrclam", "dlr": ""}  # folders of the data directory
_OF_THE_RECORDING = (
    "observation",
    "association",
    "filter",
    "presets",
    "sigma",
    "motion",
    "velocity_states",
    "noise",
)
"""Options that a recording has decided."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "logs", nargs="+", metavar="LOG", help="recordings; or csv DIR..., one log each; or mrclam DIR..."
    )
    parser.add_argument(
        "--robot", type=int, choices=range(1, ROBOTS + 1), help="mrclam: one robot (default: all)"
    )
    add_align_option(parser)
    add_filter_options(parser)
    add_batch_options(parser, "replay")
    parser.set_defaults(defaults={name: parser.get_default(name) for name in _OF_THE_RECORDING})


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    first, *rest = arguments.logs
    if first in COLLECTIONS:
        if not rest:
            raise BslamError(f"{first}: no DIR; allowed: bslam replay {first} DIR...")
        return _replay_logs(arguments, first, rest)
    return _replay_recordings(arguments, arguments.logs)


def _replay_logs(arguments: argparse.Namespace, kind: str, directories: list[str]) -> int:
    return finish(
        run_batch(jobs_of(arguments, kind, directories), arguments.out, arguments.jobs), arguments.out
    )


def jobs_of(arguments: argparse.Namespace, kind: str, directories: list[str]) -> list[Job]:
    """A run for each log and seed. Raises BslamError."""
    logs = log_sources(kind, directories, arguments.robot)
    pairs = [
        (source, run_options(arguments, says=says, sensor="recorded", seed=seed))
        for source in logs
        for says in [source.says]
        for seed in arguments.seeds
    ]
    return make_jobs([source for source, _ in pairs], [one for _, one in pairs], draw, arguments.pictures)


def _replay_recordings(arguments: argparse.Namespace, paths: list[str]) -> int:
    for path in paths:
        if not path.endswith(SUFFIX):
            allowed = f"csv DIR, mrclam DIR, dlr DIR, or recordings, FILE{SUFFIX}"
            raise BslamError(f"'{path}': allowed: {allowed}{line_to_type('replay', path)}")
    for name, default in arguments.defaults.items():
        if getattr(arguments, name) != default:
            option = "--preset" if name == "presets" else f"--{name.replace('_', '-')}"
            raise BslamError(f"{option}: a recording runs with its own parameters; allowed: --set KEY=VALUE")
    changes = core_parameters(arguments)
    sources = [RecordingSource(Path(path)) for path in paths]
    options = [
        replace(options_of(source.recording(), arguments.target, changes), align=arguments.align)
        for source in sources
    ]
    jobs = make_jobs(sources, options, draw, arguments.pictures)
    result = run_batch(jobs, arguments.out, arguments.jobs)
    status = finish(result, arguments.out)
    if changes:
        return status
    same = [_say_how_it_compares(entry) for entry in (outcome.entry for outcome in result.outcomes)]
    return status if all(same) else 1


def _say_how_it_compares(entry: dict[str, Any]) -> bool:
    """Whether the rerun is the recorded run to the bit."""
    found = entry.get("recording")
    if found is None:
        return False
    same = not found["different"] and not found["answers"]
    said = f"all {found['states']} states are the recorded ones to the bit" if same else _difference(found)
    lost = f"; the recording lacks {found['lost']} reports" if found["lost"] else ""
    print(f"{entry['name']}: {said}, fingerprint {found['fingerprint']:016x}{lost}")
    return same


def _difference(found: dict[str, Any]) -> str:
    if found["first_us"] is None:
        return f"{found['answers']} inputs are refused now and were not, or the other way round"
    return (
        f"{found['different']} of {found['states']} states differ, from {found['first_us'] * 1e-6:.6f} s on"
    )


def log_sources(kind: str, directories: list[str], robot: int | None) -> list[Source]:
    """The logs that the words of a command line name. Raises BslamError."""
    if robot is not None and kind != "mrclam":
        raise BslamError(f"--robot {robot}: a {kind} log is of one robot; allowed: --robot with mrclam")
    folders = [find_directory(name, COLLECTIONS[kind]) for name in directories]
    if kind == "csv":
        for folder in filter(is_bag, folders):
            raise BslamError(
                f"{folder}: no odometry.csv; allowed: a log{line_to_type('replay', str(folder))}"
            )
        return [FolderSource(folder) for folder in folders]
    if kind == "dlr":
        return [DlrSource(folder) for folder in folders]
    return [MrclamSource(folder, number) for folder in folders for number in _robots(folder, robot)]


def _robots(folder: Path, robot: int | None) -> list[int]:
    there = robots_in(folder)
    if robot is None:
        return there
    if robot not in there:
        raise BslamError(f"{folder}: no robot {robot}; allowed: {', '.join(map(str, there))}")
    return [robot]
