"""`bslam console`: what a connected robot knows, and a recording of what it does."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bslam.commands.arguments import add_filter_options, run_options
from bslam.commands.report import table_of
from bslam.core.appearance import rendered_seeds
from bslam.core.errors import CoreError
from bslam.core.slam import BY_APPEARANCE
from bslam.errors import BslamError
from bslam.link.messages import Health, PoseReport
from bslam.log import Log
from bslam.recording import RecordingWriter
from bslam.recording.entries import Call, Counters, Frame, Gap, Map, Reading, Start, State
from bslam.recording.recorder import MAP_PERIOD_US
from bslam.runs.kept import read_blob
from bslam.runs.runner import run_log
from bslam.runs.sources import what_it_says
from bslam.target.lines import TARGET_KINDS, TargetError, no_such_target, open_line
from bslam.target.remote import RemoteSlam, Told
from bslam.world.simulate import load_scenario, simulate

SUMMARY = "show a connected robot's pose, map and counters; set its parameters; record it"
EXAMPLES = """examples:
  bslam console serial:/dev/ttyUSB0
  bslam console serial:/dev/ttyUSB0 --record drive.mcap --reset
  bslam console serial:/dev/ttyUSB0 --set wheelbase_m=0.31 --save --reset
  bslam console serial:/dev/ttyUSB0 --set-pose 1.5,0,1.57,0.1,0.05
  bslam console serial:/dev/ttyUSB0 --keep-map
  bslam console serial:/dev/ttyUSB0 --save-map flat.bslam
  bslam console serial:/dev/ttyUSB0 --reset --map flat.bslam --set-pose 1.5,0,1.57,0.1,0.05
  bslam console qemu:mps2_an386 --drive paper_room --record drive.mcap
  bslam console qemu:mps2_an386 --drive out/run/paper_room_seed0

A robot with encoders of its own drives by itself, and is watched; nothing that it knows is changed but by
--set, --save, --reset, --map and --set-pose. --drive feeds it with a scenario's odometry and sightings, or a
log folder's, from the start. A recording that begins with --reset or --drive runs again with `bslam replay`
to the same bits. Ctrl-C ends it."""
_DRAW_S = 1.0
_LISTEN_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("robot", metavar="TARGET", type=_target, help="qemu:BOARD or serial:DEVICE")
    group = parser.add_argument_group("robot")
    group.add_argument("--save", action="store_true", help="the robot keeps its parameters over a restart")
    group.add_argument(
        "--reset", action="store_true", help="start over at the origin with an empty map and what --set says"
    )
    group.add_argument(
        "--set-pose",
        type=_pose,
        metavar="X,Y,HEADING,SD,SD",
        help="tell it where it is in its map: m, m, rad, and how sure that is: m, rad",
    )
    group.add_argument("--keep-map", action="store_true", help="the robot keeps its map over a restart")
    group.add_argument("--save-map", type=Path, metavar="FILE", help="write its map as it is, FILE.bslam")
    group.add_argument("--drive", metavar="LOG", help="feed it: a scenario, or a log folder")
    group.add_argument("--seed", type=int, default=0, metavar="N", help="of the scenario (default: 0)")
    group = parser.add_argument_group("console")
    group.add_argument("--record", type=Path, metavar="FILE", help="write a recording, FILE.mcap")
    group.add_argument("--seconds", type=float, default=math.inf, metavar="S", help="end after so long")
    add_filter_options(parser, folded=True)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    if arguments.target != "host":
        raise BslamError("--target: the console's robot is its first argument")
    try:
        return _drive(arguments) if arguments.drive else _watch(arguments)
    except TargetError as error:
        print(f"bslam console: {error}", file=sys.stderr)
        return 1


# ---- a robot that is fed -----------------------------------------------------------------------------------


def _drive(arguments: argparse.Namespace) -> int:
    folder = Path(arguments.drive)
    log = Log.read(folder) if folder.is_dir() else simulate(load_scenario(arguments.drive), arguments.seed)
    arguments.target = arguments.robot
    options = run_options(arguments, says=what_it_says(log), sensor="recorded", seed=arguments.seed)
    screen = _Screen(f"{arguments.robot}, driven by {log.name}")
    _Driven(screen, log, options).run(arguments.record, arguments.seconds)
    return 0


class _Driven:
    """A run that is shown on the way."""

    def __init__(self, screen: _Screen, log: Log, options: Any) -> None:
        self._screen, self._log, self._options = screen, log, options
        self._end_s = math.inf

    def run(self, record: Path | None, seconds: float) -> None:
        self._end_s = time.monotonic() + seconds
        try:
            trace = run_log(self._log, self._options, watcher=self, record=record)
        except _Enough:
            return
        self._screen.last(f"image {trace.target.get('image', '-')}, {trace.steps} steps")

    def frame(self, *_: Any) -> None:
        """Nothing: a step tells all."""

    def step(self, time_us: int, _pose: Any, slam: Any) -> None:
        """A row of the run is done."""
        self._screen.draw(slam, time_us)
        if time.monotonic() > self._end_s:
            raise _Enough


class _Enough(Exception):  # noqa: N818
    """The time that the user gave is over."""


# ---- a robot that drives by itself -------------------------------------------------------------------------


def _watch(arguments: argparse.Namespace) -> int:
    line = open_line(arguments.robot)
    try:
        slam = RemoteSlam(line, None, 1, fingerprints=arguments.record is not None)
        _change(slam, arguments)
        screen = _Screen(f"{arguments.robot}, bslam {slam.info.version}, build {slam.info.build_id[:12]}")
        if arguments.record is None:
            _follow(slam, screen, None, arguments)
        else:
            learns = slam.params["association"] in BY_APPEARANCE
            seeds = rendered_seeds() if learns else None  # what a robot with cameras starts from
            start = Start(arguments.record.stem, slam.host_params, slam.info.beacons_max, seeds)
            start.about.update(slam.target_description())
            with RecordingWriter(arguments.record, start) as writer:
                if not arguments.reset:
                    _note_what_went_before(slam, writer)
                _follow(slam, screen, writer, arguments)
            print(f"recorded in {arguments.record}")
    finally:
        line.close()
    return 0


def _change(slam: RemoteSlam, arguments: argparse.Namespace) -> None:
    """What the command line asks to be changed before the robot is watched."""
    for text in arguments.set:
        key, equals, value = text.partition("=")
        if not equals or key not in slam.params:
            raise BslamError(f"--set {text}: allowed: KEY=VALUE with a KEY of `bslam params --all`")
        try:
            slam.set_param(key, float(value))
        except ValueError:
            raise BslamError(f"--set {text}: '{value}' is not allowed; allowed: a number") from None
        print(f"{key} = {slam.params[key]:g}, in force after a reset")
    if arguments.save:
        slam.save_params()
        print("the robot keeps its parameters")
    if arguments.keep_map:
        slam.keep_map()
        print("the robot keeps its map")
    if arguments.save_map is not None:
        arguments.save_map.write_bytes(slam.save_map())
        print(f"its map is in {arguments.save_map}")
    if arguments.reset:
        slam.reset()
    if arguments.map is not None:
        _load_map(slam, arguments.map, arguments.frozen)


def _load_map(slam: RemoteSlam, path: Path, frozen: bool) -> None:
    try:
        slam.load_map(read_blob(path), frozen=frozen)
    except CoreError as error:
        raise BslamError(f"{path}: the robot does not take it: {error}") from None
    print(f"it goes on in {path}, at a place unknown")


def _note_what_went_before(slam: RemoteSlam, writer: RecordingWriter) -> None:
    readings = slam.counters()["odometry"]
    if readings:
        writer.put(Gap(readings))
        print(
            f"the robot has {readings} readings behind it: its replay will not be exact; --reset starts over"
        )


def _follow(
    slam: RemoteSlam, screen: _Screen, writer: RecordingWriter | None, arguments: argparse.Namespace
) -> None:
    """Show, and write down, what the robot reports, until Ctrl-C or the end of the time."""
    watch = _Watch(slam, writer)
    if arguments.set_pose is not None:
        watch.set_pose(arguments.set_pose)
    end_s = time.monotonic() + arguments.seconds
    try:
        while time.monotonic() < end_s:
            watch.listen()
            if screen.is_due():
                slam.update()
                screen.draw(slam, watch.time_us)
    except KeyboardInterrupt:
        pass
    watch.end()
    screen.draw(slam, watch.time_us, now=True)


class _Watch:
    """A robot's reports into a recording."""

    def __init__(self, slam: RemoteSlam, writer: RecordingWriter | None) -> None:
        self._slam, self._writer = slam, writer
        self._lost = slam.reports_lost
        self._map_us = -MAP_PERIOD_US
        self.time_us = 0

    def set_pose(self, pose: tuple[float, ...]) -> None:
        """Tell the robot where it is."""
        self._slam.set_pose(*pose)
        self.listen(None)  # what it reported before it heard that
        if self._writer is not None:
            self._writer.put(Call("set_pose", pose))

    def listen(self, timeout_s: float | None = _LISTEN_S) -> None:
        """Take what has come."""
        reports = self._slam.reports(timeout_s)
        if self._writer is None:
            self.time_us = reports[-1].time_us if reports else self.time_us
            return
        if self._slam.reports_lost > self._lost:
            self._writer.put(Gap(self._slam.reports_lost - self._lost))
            self._lost = self._slam.reports_lost
        for told in reports:
            self._writer.put(_input_of(told))
            step = told.report.step
            self._writer.put(State(told.time_us, step.pose, step.covariance, step.fingerprint))
            self.time_us = told.time_us
        if self.time_us - self._map_us >= MAP_PERIOD_US:
            self._map_us = self.time_us
            self._note_map()

    def end(self) -> None:
        """Note the last map."""
        if self._writer is not None:
            self._note_map()

    def _note_map(self) -> None:
        assert self._writer is not None
        self._writer.put(Map(self._slam.beacons()))
        self._writer.put(Counters(self._slam.counters()))


def _input_of(told: Told) -> Reading | Frame:
    """What the filter was given."""
    report, time_us = told.report, told.time_us
    if isinstance(report, PoseReport):
        ticks, gyro = (report.left_ticks, report.right_ticks), (report.gyro_radps, report.gyro_sd_radps)
        return Reading("ticks", time_us, *ticks, *gyro, told.refused)
    seen, silent = told.seen, [-1] * len(told.seen)
    signatures = [one.signature for one in seen if one.signature is not None]
    return Frame(
        time_us,
        [one.bearing_rad for one in seen],
        [one.range_m for one in seen],
        silent,
        [True] * len(seen),
        [one.bearing_sd_rad for one in seen],
        [one.range_sd_m for one in seen],
        [one.range_scale_sd for one in seen],
        np.stack(signatures) if signatures else None,
        [one.beacon_class for one in seen],
        [one.score for one in seen],
        accounts=told.accounts if told.refused is None else None,
        refused=told.refused,
    )


# ---- what is shown -----------------------------------------------------------------------------------------


class _Screen:
    """A terminal is drawn anew each second; elsewhere each drawing is a paragraph."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._next_s = time.monotonic()

    def is_due(self) -> bool:
        """The next drawing's time has come."""
        return time.monotonic() >= self._next_s

    def draw(self, slam: Any, time_us: int, now: bool = False) -> None:
        """Show the robot, if it is time."""
        if not now and not self.is_due():
            return
        self._next_s = time.monotonic() + _DRAW_S
        if sys.stdout.isatty():
            print("\x1b[H\x1b[J", end="")
        print(f"{self._title}\n{describe(slam, time_us)}\n", flush=True)

    def last(self, text: str) -> None:
        """A line at the end."""
        print(text)


def describe(slam: Any, time_us: int) -> str:
    """A robot's pose, map and counters in some lines."""
    x_m, y_m, theta_rad = slam.pose()
    xx, _, yy, _, _, tt = slam.pose_covariance_lower()
    sd_cm, sd_deg = 100.0 * math.sqrt(max(xx + yy, 0.0)), math.degrees(math.sqrt(max(tt, 0.0)))
    lines = [
        f"time      {time_us * 1e-6:.3f} s",
        f"pose      x {x_m:.3f} m, y {y_m:.3f} m, heading {math.degrees(theta_rad):.1f} deg "
        f"(sd {sd_cm:.1f} cm, {sd_deg:.1f} deg)",
    ]
    if hasattr(slam, "health"):
        lines.append(f"health    {_health_text(slam.health())}")
    counts = ", ".join(f"{name} {count}" for name, count in slam.counters().items() if count)
    return "\n".join([*lines, f"counters  {counts or 'all 0'}", _map_text(slam.beacons())])


def _health_text(health: Health) -> str:
    """How the robot is doing, and the last thing that went wrong."""
    watched = [name for name, on in (("recovery", health.recovers), ("guard", health.guards)) if on]
    text = f"{health.state} ({' and '.join(watched) or 'nothing'} on)"
    if health.trouble != "none":
        text += f"; last trouble: {health.trouble} at {health.trouble_us * 1e-6:.3f} s"
    return text


def _map_text(beacons: Sequence[Any]) -> str:
    if not beacons:
        return "map       empty"
    rows = [["beacon", "x m", "y m", "sd cm", "sightings", ""]]
    for one in beacons:
        sd_cm = 100.0 * math.sqrt(max(one.covariance_m2[0][0] + one.covariance_m2[1][1], 0.0))
        name = str(one.label if one.label >= 0 else one.uid)
        sure = "" if one.confirmed else "tentative"
        rows.append([name, f"{one.x_m:.3f}", f"{one.y_m:.3f}", f"{sd_cm:.1f}", str(one.sightings), sure])
    return table_of(rows)


def _pose(text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 5:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: five numbers, commas between")
    return numbers


def _target(text: str) -> str:
    kind, _, name = text.partition(":")
    if kind not in TARGET_KINDS or not name:
        raise argparse.ArgumentTypeError(no_such_target(text))
    return text
