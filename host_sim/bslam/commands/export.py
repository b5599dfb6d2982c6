"""`bslam export`: a recording or a log folder in another format."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bslam.errors import BslamError
from bslam.log import Log
from bslam.options import RunOptions
from bslam.recording import Recording, load
from bslam.recording.aslog import as_log
from bslam.recording.entries import State, TruePose
from bslam.recording.reader import SUFFIX
from bslam.runs.output import tum, write_atomically
from bslam.runs.runner import run_log
from bslam.runs.sources import options_for, what_it_says

SUMMARY = "write a recording or a log in another format: tum, csv, mcap"
EXAMPLES = """examples:
  bslam export drive.mcap --format tum
  bslam export drive.mcap --format csv --out logs
  bslam export out/run/paper_room_seed0 --format mcap

tum: NAME.estimate.tum, and NAME.truth.tum if the truth is known, from a recording: TUM format.
csv: the folder NAME with the inputs of a recording, for `bslam replay csv` and for any other program.
mcap: NAME.mcap from a log folder: the drive is run with the default options, and recorded. Foxglove,
Lichtblick and PlotJuggler open it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("logs", nargs="+", metavar="LOG", type=Path, help=f"FILE{SUFFIX}, or a log folder")
    parser.add_argument("--format", required=True, choices=sorted(_FORMATS), help="what to write")
    parser.add_argument(
        "--out", type=Path, default=Path("out/export"), metavar="DIR", help="default: out/export"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    write = _FORMATS[arguments.format]
    written = [path for log in arguments.logs for path in write(log, arguments.out)]
    print(f"files in {arguments.out}: {', '.join(path.name for path in written)}")
    return 0


def _recording(path: Path, form: str) -> Recording:
    if path.suffix != SUFFIX:
        raise BslamError(f"{path}: allowed with --format {form}: a recording, FILE{SUFFIX}")
    recording = load(path)
    if not recording.complete:
        print(f"{path}: it was cut short; what there is of it is exported")
    return recording


def _to_tum(path: Path, out: Path) -> list[Path]:
    recording = _recording(path, "tum")
    written = []
    for kind, name in ((State, "estimate"), (TruePose, "truth")):
        # Of one time the last state counts: that after the image, not that after the odometry before it.
        at = {one.time_us: one.pose for one in recording.entries if isinstance(one, kind)}
        if at:
            written.append(out / f"{path.stem}.{name}.tum")
            write_atomically(written[-1], tum(np.array(list(at)), np.array(list(at.values()))))
    return written


def _to_csv(path: Path, out: Path) -> list[Path]:
    folder = out / path.stem
    as_log(_recording(path, "csv")).write(folder)
    return [folder]


def _to_mcap(path: Path, out: Path) -> list[Path]:
    if not path.is_dir():
        raise BslamError(f"{path}: allowed with --format mcap: a log folder")
    log = Log.read(path)
    file = out / f"{log.name}{SUFFIX}"
    run_log(log, _default_options(log), record=file)
    return [file]


def _default_options(log: Log) -> RunOptions:
    return options_for(what_it_says(log), {"sensor": "recorded"})


_FORMATS: dict[str, Callable[[Path, Path], list[Path]]] = {"tum": _to_tum, "csv": _to_csv, "mcap": _to_mcap}
