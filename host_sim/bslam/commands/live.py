"""`bslam live`: watch the filter at work in the browser."""

from __future__ import annotations

import argparse
import math
import os
from dataclasses import replace
from pathlib import Path

from bslam.commands.arguments import (
    add_filter_options,
    add_sensor_options,
    core_parameters,
    run_options,
    scenario_source,
    whole_number,
)
from bslam.commands.drawing import draw
from bslam.commands.replay import COLLECTIONS, log_sources
from bslam.commands.report import finish
from bslam.datasets.datasets import is_bag, line_to_type
from bslam.errors import BslamError
from bslam.log import Log
from bslam.moment import FAILED, FINISHED
from bslam.options import RunOptions
from bslam.recording.reader import SUFFIX
from bslam.rig import load_rig
from bslam.runs.batch import BatchResult, Job, Outcome, make_jobs, run_job, write_files
from bslam.runs.camera import unseen_log
from bslam.runs.eye import Eye
from bslam.runs.output import write_summary
from bslam.runs.player import Pace, Player
from bslam.runs.rerun import options_of
from bslam.runs.runner import Watcher
from bslam.runs.sources import CameraSource, RecordingSource, Source
from bslam.runs.stage import stage_of
from bslam.view.rerun_view import Scene, follow, open_stream
from bslam.world.simulate import load_scenario

SUMMARY = "watch the filter at work in the browser: pause it, step it, see why each sighting was taken"
EXAMPLES = """examples:
  bslam live paper_room
  bslam live paper_room --seed 3 --observation direction --speed 4
  bslam live paper_room --sensor camera
  bslam live out/run/paper_room_seed0.mcap
  bslam live mrclam MRCLAM_Dataset6 --robot 3 --speed 16
  bslam live paper_room --target qemu:mps2_an386
  bslam live csv my_drive --rerun        (pip install rerun-sdk)
  ssh -L 5006:127.0.0.1:5006 HOST bslam live paper_room     then open http://127.0.0.1:5006/ here

The page is served to this machine alone, and needs no network. A run that comes to its end leaves in --out
what `bslam run` leaves. Ctrl-C ends it."""
PORT = 5006


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "words",
        nargs="+",
        metavar="SCENARIO",
        help=f"name, or path of a TOML file; or a record: FILE.mcap, {{{','.join(COLLECTIONS)}}} DIR",
    )
    parser.add_argument("--robot", type=int, help="mrclam: whose log")
    add_sensor_options(parser)
    add_filter_options(parser)
    group = parser.add_argument_group("page")
    group.add_argument(
        "--port", type=_port, default=PORT, metavar="N", help=f"default: {PORT}; 0: any that is free"
    )
    group.add_argument("--no-browser", action="store_true", help="print the address, open nothing")
    group.add_argument(
        "--speed",
        type=_speed,
        default=1.0,
        metavar="TIMES",
        help="times as fast as the robot drives; inf: as fast as it goes (default: 1)",
    )
    group.add_argument(
        "--rerun",
        nargs="?",
        const="viewer",
        metavar="FILE.rrd",
        help="in Rerun's viewer, or into a file for it, in place of the page",
    )
    group.add_argument("--paused", action="store_true", help="wait at the start for Play or Step")
    group.add_argument("--seed", type=whole_number, default=0, metavar="N", help="default: 0")
    group.add_argument(
        "--out",
        type=Path,
        default=Path("out") / "live",
        metavar="DIR",
        help="where files go; what is there is replaced (default: out/live)",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    if arguments.rerun is not None:
        return _follow_in_rerun(arguments)
    from bslam.view.live import Page  # here: it takes a second, which no other command need wait
    from bslam.view.serve import has_screen, serve

    job = _job(arguments)
    show = _Show(job, arguments.out.absolute(), arguments.speed)

    def open_page(document) -> None:  # type: ignore[no-untyped-def]
        Page(document, show.stage, lambda: show.player.moment, show.pace, show.start)
        # Not before a browser has all of the page: whoever watches sees the first step.
        document.on_event("document_ready", lambda _event: begin())

    def begin() -> None:
        if not arguments.paused and not show.opened:
            show.pace.play()
        show.opened = True

    def say(url: str) -> None:
        print(f"watch it at {url}; Ctrl-C ends it", flush=True)
        if not has_screen():
            port = url.rstrip("/").rpartition(":")[2]
            print(f"from another machine: ssh -L {port}:127.0.0.1:{port} {os.uname().nodename}", flush=True)
        show.start()

    try:
        serve(open_page, arguments.port, say, browse=not arguments.no_browser)
    except KeyboardInterrupt:
        pass
    finally:
        show.player.stop()
    return show.end()


def _follow_in_rerun(arguments: argparse.Namespace) -> int:
    """The same run, followed by Rerun's viewer; it has no buttons for the run."""
    show = _Show(_job(arguments), arguments.out.absolute(), arguments.speed)
    stream = open_stream(arguments.rerun)  # last: a file of that name is emptied
    show.start()
    show.pace.play()
    try:
        follow(Scene(show.stage, stream), lambda: show.player.moment)
    except KeyboardInterrupt:
        pass
    finally:
        show.player.stop()
        stream.disconnect()
    return show.end(None if arguments.rerun == "viewer" else arguments.rerun)


class _Show:
    """The run behind the page, and what it leaves."""

    def __init__(self, job: Job, out: Path, speed: float) -> None:
        self._job, self._out = job, out
        self._log, self._eye = _open(job)
        self.stage = stage_of(job, self._log)
        self.opened = False
        self._outcome: Outcome | None = None
        self.pace = Pace(speed)
        self.player = self._new_player()

    def _new_player(self) -> Player:
        return Player(self._log, self._run, self.pace, align=self.stage.aligned, eye=self._eye)

    def start(self) -> None:
        """Take the run up; one that has ended, from its start."""
        if self.player.moment.state == FINISHED:
            self._log, self._eye = _open(self._job)
            self.player = self._new_player()
        self.player.start()

    def _run(self, watcher: Watcher) -> None:
        """All of it, and its files; in the player's thread."""
        trace, more = run_job(self._job, self._log, self._out, watcher, self._eye)
        log = self._log if self._eye is None else replace(self._log, sightings=self._eye.sightings())
        self._outcome = write_files(self._job, self._out, log, trace, more)
        write_summary(self._out, [self._outcome.entry])

    def end(self, followed_in: str | None = None) -> int:
        """Say how it ended; the exit status. Raises BslamError if the run failed.

        followed_in: a file that has what was seen of it.
        """
        moment = self.player.moment
        if moment.state == FAILED:
            raise BslamError(moment.message)
        if self._outcome is None:
            left = "nothing was written" if followed_in is None else f"{followed_in} ends there"
            print(f"stopped at step {moment.step} of {self.stage.steps}: {left}")
            return 1
        return finish(BatchResult((self._outcome,), interrupted=False), self._out)


def _job(arguments: argparse.Namespace) -> Job:
    source, options = _what(arguments)
    return make_jobs([source], [options], draw, pictures=1)[0]


def _what(arguments: argparse.Namespace) -> tuple[Source, RunOptions]:
    kind, *rest = arguments.words
    if kind in COLLECTIONS:
        sources = log_sources(kind, rest, arguments.robot)
        if len(sources) != 1:
            raise BslamError(f"{kind}: {len(sources)} logs; allowed: one DIR, and --robot N with mrclam")
        says = sources[0].says
        return sources[0], run_options(arguments, says=says, sensor="recorded", seed=arguments.seed)
    if rest:
        raise BslamError(
            f"'{rest[0]}' after {kind}; allowed: one SCENARIO or FILE.mcap, or {{csv,mrclam}} DIR"
        )
    if kind.endswith(SUFFIX):
        recording = RecordingSource(Path(kind))
        return recording, options_of(recording.recording(), arguments.target, core_parameters(arguments))
    if Path(kind).is_dir() or is_bag(Path(kind)):
        allowed = f"SCENARIO, FILE{SUFFIX}, or {{{','.join(COLLECTIONS)}}} DIR"
        raise BslamError(f"'{kind}' is no scenario; allowed: {allowed}{line_to_type('live', kind)}")
    wheels = load_scenario(kind).wheels
    noise = arguments.noise or wheels.noise
    sigma_mps = wheels.sigma_mps if arguments.sigma is None else arguments.sigma
    arguments.scenario = kind
    source = scenario_source(arguments, arguments.seed, sigma_mps, noise)
    return source, run_options(arguments, sigma_mps=sigma_mps, noise=noise, seed=arguments.seed)


def _open(job: Job) -> tuple[Log, Eye | None]:
    """The log; of a drive that cameras watch without its sightings, and the eye that makes them."""
    source = job.source
    if not isinstance(source, CameraSource):
        return source.load(), None
    scenario, rig = load_scenario(source.scenario), load_rig(source.rig)
    chosen = source.threshold, source.scanner()
    log, glances = unseen_log(scenario, source.seed, source.sigma_mps, source.noise, rig, *chosen)
    return log, Eye(log, job.options, glances)


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: a whole number up to 65535")
    return int(text)


def _speed(text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not speed > 0.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: a number above 0, or inf")
    return speed
