"""`bslam calibrate`: odometry from one log, tried on another; a camera from pictures of a checkerboard."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from bslam.calibration.calibrate import Calibration, as_toml, calibrate
from bslam.commands.arguments import core_parameters
from bslam.commands.calibrate_camera import add_camera_arguments, execute_camera
from bslam.commands.drawing import draw
from bslam.commands.replay import log_sources
from bslam.commands.report import finish, table_of
from bslam.datasets.mrclam import ROBOTS
from bslam.errors import BslamError
from bslam.options import RunOptions
from bslam.runs.batch import Job, run_batch
from bslam.runs.output import write_atomically
from bslam.runs.sources import Source

SUMMARY = "odometry's scale and noise from a log with truth; a camera's lens and mounting from pictures"
EXAMPLES = """examples:
  bslam calibrate mrclam MRCLAM_Dataset6 --robot 1 --test MRCLAM_Dataset6 --test-robot 2
  bslam calibrate csv paper_room_700_sigma0.6 --test paper_room_701_sigma0.6
  bslam replay mrclam MRCLAM_Dataset6 --params out/calibrate/calibrated.toml
  bslam calibrate camera boards/ --lens pinhole --board 9x6 --square 0.025
  bslam calibrate camera boards/ --plumb plumb/ --board-height 0.31 --log drive/

Logs: writes calibrated.toml for --params; with --test, the other log is replayed before and after.
Camera: writes camera.toml, a rig of that one camera, with the same for the C core in a comment."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("kind", choices=("csv", "mrclam", "camera"), help="format of the logs, or: camera")
    parser.add_argument(
        "directory", metavar="DIR", help="log to calibrate with; camera: folder of checkerboard pictures"
    )
    parser.add_argument("--robot", type=int, choices=range(1, ROBOTS + 1), help="mrclam: its robot")
    parser.add_argument("--test", metavar="DIR", help="log to try the result on")
    parser.add_argument(
        "--test-robot", type=int, choices=range(1, ROBOTS + 1), help="mrclam: its robot (default: same)"
    )
    parser.add_argument(
        "--params", type=Path, metavar="FILE", help="core parameters before calibration, as TOML"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="a core parameter before it"
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/calibrate"),
        metavar="DIR",
        help="where files go (default: out/calibrate)",
    )
    add_camera_arguments(parser)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    if arguments.kind == "camera":
        return execute_camera(arguments)
    before = RunOptions(sensor="recorded", parameters=tuple(core_parameters(arguments).items()))
    source = _one_source(arguments.kind, arguments.directory, arguments.robot)
    calibration = calibrate(source.load())
    file = arguments.out / "calibrated.toml"
    write_atomically(file, as_toml(calibration, source.name))
    print(f"odometry of {source.name}, {calibration.windows} windows:")
    print(f"{_describe(calibration)}\nwritten: {file}")
    if arguments.test is None:
        return 0
    test = _one_source(arguments.kind, arguments.test, arguments.test_robot or arguments.robot)
    after = replace(before, parameters=tuple((dict(before.parameters) | calibration.parameters).items()))
    jobs = [
        Job(f"{test.name}_{word}", test, one, draw) for word, one in (("before", before), ("after", after))
    ]
    return finish(run_batch(jobs, arguments.out, processes=1), arguments.out, means=False)


def _one_source(kind: str, directory: str, robot: int | None) -> Source:
    sources = log_sources(kind, [directory], robot)
    if len(sources) != 1:
        raise BslamError(
            f"{directory}: {len(sources)} logs; allowed: one, with --robot 1 to {ROBOTS} for mrclam"
        )
    return sources[0]


def _describe(calibration: Calibration) -> str:
    rows = [
        [f"  {name}", f"{one.value:.4f}", f"+- {one.error:.4f}"] for name, one in calibration.scales.items()
    ]
    rows += [[f"  {name}", f"{value:.4f}", ""] for name, value in calibration.noise.items()]
    rows.append(["  ahead of the truth, s", f"{calibration.lead_us * 1e-6:.2f}", ""])
    return table_of(rows)
