"""Feed a log to the core in the order of time, and keep what it says."""

from __future__ import annotations

import base64
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bslam.core.builds import SIZE_CLASSES
from bslam.core.errors import CoreError
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.evaluation.ledger import Ledger, corrupt_identities
from bslam.evaluation.trace import MapBeacon, Trace
from bslam.evaluation.truth import starts_at_origin, step_times_us
from bslam.log import Log, Odometry, Sightings
from bslam.motion import PAUSE_US, unseen_sd
from bslam.options import BY_APPEARANCE, Number, RunOptions, core_params, odometry_lead_us
from bslam.recording import Recorder, RecordingWriter
from bslam.recording.aslog import start_of, true_poses
from bslam.runs.kept import read_blob
from bslam.runs.local_map import LocalMap
from bslam.target.remote import connect

SlamFactory = Callable[[Mapping[str, Number], int], Any]
_FROM_LOWER = [[0, 1, 3], [1, 2, 4], [3, 4, 5]]  # where entry (i, j) stands in xx, yx, yy, tx, ty, tt
MAPPABLE, SIGNATURE = 3, 7  # their places among the columns of a frame
START_POSE = (0.0, 0.0, 0.0)  # the map's origin is where the robot starts
FALSE_BEACONS_ROOM = 80


class Watcher(Protocol):
    """Is told what a run does while it does it; the run waits meanwhile, and ends with what it raises."""

    def frame(
        self, time_us: int, true_id: Sequence[int], columns: Sequence[Any], accounts: Sequence[Any] | None
    ) -> None:
        """The filter has worked off a frame (columns: `columns_for_filter`); accounts None: refused it."""

    def step(self, time_us: int, pose: tuple[float, float, float], slam: Any) -> None:
        """A row of the trace is done; `slam` may be asked anything."""


class FrameFeed(Protocol):
    """Frames of sightings in order of time, as the filter is to see them."""

    def waiting_before(self, until_us: int | None) -> bool:
        """There is one stamped before `until_us`; None: there is one."""

    def take(self) -> tuple[int, Sequence[int], list[Any]]:
        """Time, true identities, and the columns of the next frame, see `columns_for_filter`."""

    def gyro(self, row: int, time_us: int) -> tuple[float | None, float]:
        """What the gyro says with a row of odometry, rad/s (None: nothing), and that one's own noise (0: not
        said); asked before the row is fed."""


def run_log(
    log: Log,
    options: RunOptions,
    slam_factory: SlamFactory | None = None,
    watcher: Watcher | None = None,
    record: Path | None = None,
    frames: FrameFeed | None = None,
) -> Trace:
    """Run the filter over the log. Raises BslamError if the core does not accept the parameters.

    What the core refuses on the way (an impossible time stamp, say) is counted in `Trace.refusals` and the
    run goes on, as a robot would. `slam_factory` makes the filter from its parameters and the number of
    beacons to hold. `record` is the file of the recording to make. `frames` are taken in place of the log's
    sightings.
    """
    frames = frames or Frames(log.sightings, options, log.odometry)
    params, beacons = core_params(options, log), beacons_to_hold(log, options)
    if slam_factory is None and options.target != "host":
        if options.kept_map is not None:
            raise BslamError(f"--map {options.kept_map} with --target {options.target}: allowed is host")
        if options.real != "float":
            raise BslamError(f"--real {options.real} with --target {options.target}: allowed is float")
        with connect(
            options.target, params, beacons, fingerprints=record is not None, seeds=log.seeds
        ) as slam:
            return _run(slam, log, options, frames, watcher, record, slam.target_description)
    factory = slam_factory or partial(_make_slam, options, log)
    return _run(factory(params, beacons), log, options, frames, watcher, record)


def _run(
    slam: Any,
    log: Log,
    options: RunOptions,
    frames: FrameFeed,
    watcher: Watcher | None,
    record: Path | None,
    target: Callable[[], Mapping[str, Any]] | None = None,
) -> Trace:
    """`target` tells of what it runs on, if not here."""
    if record is None:
        return _Run(slam, log, options, frames, watcher).finish(target and target())
    params = slam.params if target is None else slam.host_params
    start = start_of(log, params, beacons_to_hold(log, options), options.real)
    start = replace(start, frozen=options.frozen, kept_map=_kept_text(options))
    with RecordingWriter(record, start) as writer:
        recorder = Recorder(slam, writer, true_poses(log))
        trace = _Run(recorder, log, options, frames, watcher).finish(target and target())
        recorder.finish()
    return trace


def _make_slam(options: RunOptions, log: Log, params: Mapping[str, Number], beacons_max: int) -> Any:
    most = SIZE_CLASSES[-1]
    slam = Slam(params, beacons_max=min(beacons_max, most), real=options.real, seeds=log.seeds)
    if options.kept_map is not None:
        slam.load_map(read_blob(Path(options.kept_map)), frozen=options.frozen)
    return LocalMap(slam, most) if beacons_max > most else slam


def _kept_text(options: RunOptions) -> str | None:
    if options.kept_map is None:
        return None
    return base64.b64encode(read_blob(Path(options.kept_map))).decode()


def uses_appearance(options: RunOptions) -> bool:
    return options.association in BY_APPEARANCE


def beacons_to_hold(log: Log, options: RunOptions) -> int:
    """Beacons that there are, as far as the log tells, and room for false ones where identity is unknown."""
    sighted = log.sightings.beacon_id[log.sightings.mappable]
    sighted = np.unique(sighted[sighted >= 0])
    given = 0 if log.beacons is None else len(log.beacons.beacon_id)
    true_beacons, most = max(1, given, len(sighted)), SIZE_CLASSES[-1]
    is_known = options.association == "known" and options.kept_map is None
    if options.target != "host":
        return true_beacons if is_known else max(true_beacons, FALSE_BEACONS_ROOM)
    if is_known:  # and for competitors of one label
        room = true_beacons + (true_beacons - 1) // SIZE_CLASSES[0]
    elif given or len(sighted):
        room = max(true_beacons + true_beacons // 2, FALSE_BEACONS_ROOM)
    else:
        room = most
    return max(true_beacons, min(room, most))


class _Run:
    """One pass over a log; lists rather than small arrays inside, since the loop runs some thousand times."""

    def __init__(
        self, slam: Any, log: Log, options: RunOptions, frames: FrameFeed, watcher: Watcher | None
    ) -> None:
        self.slam, self.watcher = slam, watcher
        self.recorded = isinstance(slam, Recorder)
        self.frames, self.resume_sd = frames, options.resume_sd
        self.ledger = Ledger(lambda: [beacon.uid for beacon in slam.beacons()])
        if options.known_map:
            self._give_map(log)
        self.lead_us = odometry_lead_us(options, log)
        self.refusals: Counter[str] = Counter()
        self.poses: list[tuple[float, float, float]] = []
        self.covariances: list[tuple[float, ...]] = []  # lower triangles
        self.seen: list[bool] = []
        self.step_ns: list[int] = []
        self.times_us = step_times_us(log).tolist()
        self._run(log.odometry)

    def _give_map(self, log: Log) -> None:
        """Give the true beacons to the filter. Raises BslamError if their frame is not the start's."""
        if log.beacons is None:
            raise BslamError(f"{log.name}: --known-map: the log has no beacons.csv")
        if log.truth is not None and not starts_at_origin(log):
            raise BslamError(f"{log.name}: --known-map: its beacons are not in the frame of the start pose")
        columns = (log.beacons.beacon_id.tolist(), log.beacons.x_m.tolist(), log.beacons.y_m.tolist())
        for identity, x_m, y_m in zip(*columns, strict=True):
            self.slam.add_known_beacon(identity, x_m, y_m)
        for beacon in self.slam.beacons():
            self.ledger.know(beacon.uid, beacon.label)

    def _run(self, odometry: Odometry) -> None:
        """Feed everything, and keep what there is to say at each of the steps' times.

        A frame goes in after the odometry that covers it: what the robot did until then need not be guessed.
        """
        kind, times_us = odometry.kind, self.times_us
        number = np.int64 if kind == "ticks" else np.float64
        a, b = (one.astype(number).tolist() for one in (odometry.a, odometry.b))
        rows = list(zip(range(len(a)), odometry.time_us.tolist(), a, b, strict=True))
        if len(times_us) > len(rows):  # the start stands before the first row, which already moves
            self._start_clock(times_us[0])
        else:
            self._read(kind, *rows.pop(0))
        self._frames_until(times_us[0] if rows else None)
        self._keep(times_us[0])
        last_us, end_us = times_us[0], times_us[-1]
        for row in rows:
            time_us = row[1]
            if time_us - last_us > PAUSE_US:
                self._resume(last_us, time_us)
            last_us = time_us
            core_ns = self._read(kind, *row) + self._frames_until(None if time_us == end_us else time_us)
            self.step_ns.append(core_ns)
            self._keep(time_us)

    def _read(self, kind: str, row: int, time_us: int, a: float, b: float) -> int:
        """Feed a row of odometry, and what the gyro says with it; CPU time of the core, ns."""
        gyro = self.frames.gyro(row, time_us)
        began = self._clock()
        self._try(self.slam.odometry, kind, time_us, a, b, *gyro)
        return self._clock() - began

    def _start_clock(self, time_us: int) -> None:
        """An empty frame if none is at the start, or the core would not know how long the first row took.

        Frames from before the start would start the clock too early: they are refused here.
        """
        while self.frames.waiting_before(time_us):
            _, true_id, columns = self.frames.take()
            self.ledger.book_refused(true_id, columns[MAPPABLE])
            self.refusals["before_start"] += 1
        if not self.frames.waiting_before(time_us + 1):
            self._try(self.slam.sightings, time_us, [], [], [], [])

    def _resume(self, last_us: int, next_us: int) -> None:
        """Go on after an interruption, with a pose as doubtful as that makes it.

        No odometry will cover the frames in it: the first may be near enough to the last reading.
        """
        self._feed_frames(next_us - 1)
        self.slam.resume_odometry(*(self.resume_sd or unseen_sd(next_us - last_us)))
        self.refusals["interruption"] += 1

    def _frames_until(self, until_us: int | None) -> int:
        """Feed a row's frames, see `_feed_frames`; CPU time of the core, ns."""
        core_ns, seen = self._feed_frames(until_us)
        self.seen.append(seen)
        return core_ns

    def _feed_frames(self, until_us: int | None) -> tuple[int, bool]:
        """Feed the frames stamped up to `until_us` (None: all that are left); CPU time of the core, ns, and
        whether there was one.
        """
        clock, core_ns, frames = self._clock, 0, self.frames
        seen = False
        while frames.waiting_before(None if until_us is None else until_us + 1):
            seen = True
            time_us, true_id, columns = frames.take()
            if self.recorded:
                self.slam.true_id = true_id
            began = clock()
            accounts = self._try(self.slam.sightings, time_us, *columns)
            core_ns += clock() - began
            if accounts is None:
                self.ledger.book_refused(true_id, columns[MAPPABLE])
            else:
                self.ledger.book(true_id, columns[MAPPABLE], accounts)
            if self.watcher is not None:
                self.watcher.frame(time_us, true_id, columns, accounts)
        return core_ns, seen

    def _clock(self) -> int:
        """CPU time, ns, without what a recorder took."""
        return time.thread_time_ns() - (self.slam.noting_ns if self.recorded else 0)

    def _try(self, call: Callable[..., Any], *inputs: Any) -> Any:
        """The answer of the core; None, and a count, where it refuses the input and stays as it was."""
        try:
            return call(*inputs)
        except CoreError as refusal:
            self.refusals[refusal.status] += 1
            return None

    def _keep(self, time_us: int) -> None:
        slam = self.slam
        pose = None
        if self.lead_us:
            pose = self._pose_in_past(time_us - self.lead_us)
        self.poses.append(pose or slam.pose())
        self.covariances.append(slam.pose_covariance_lower())
        if self.watcher is not None:
            self.watcher.step(time_us, self.poses[-1], slam)

    def _pose_in_past(self, time_us: int) -> tuple[float, float, float] | None:
        """None before the history reaches back that far."""
        try:
            return self.slam.pose_at(time_us)
        except CoreError:
            return START_POSE if len(self.poses) < 2 else None

    def finish(self, target: Mapping[str, Any] | None = None) -> Trace:
        """The trace of the run; `target` is what it ran on, if not here."""
        rows = Rows(self.poses, self.covariances, self.seen)
        step_us = float(np.median(self.step_ns)) * 1e-3 if self.step_ns else 0.0
        return make_trace(self.slam, self.times_us, rows, self.ledger, self.refusals, target, step_us)


@dataclass
class Rows:
    """What a trace has a row of for each step, as lists."""

    poses: list[tuple[float, float, float]] = field(default_factory=list)
    covariances: list[tuple[float, ...]] = field(default_factory=list)  # lower triangles
    seen: list[bool] = field(default_factory=list)


def make_trace(
    slam: Any,
    times_us: Sequence[int],
    rows: Rows,
    ledger: Ledger,
    refusals: Mapping[str, int],
    target: Mapping[str, Any] | None,
    step_us_median: float = 0.0,
) -> Trace:
    """The trace of a run that has ended; `target` is what it ran on, if not here."""
    refused = Counter(refusals)
    kept_map = _saved_map(slam, refused)
    return Trace(
        time_us=np.array(times_us, dtype=np.int64),
        pose=np.array(rows.poses, dtype=np.float64),
        covariance=np.array(rows.covariances, dtype=np.float64)[:, _FROM_LOWER],
        seen=np.array(rows.seen, dtype=np.bool_),
        counts=ledger.counts(),
        beacons=tuple(_map_beacon(beacon, ledger) for beacon in slam.beacons()),
        parameters=_changed_parameters(slam),
        counters=dict(slam.counters()),
        refusals=dict(refused),
        target=dict(target or {}),
        step_us_median=step_us_median,
        kept_map=kept_map,
    )


def _saved_map(slam: Any, refusals: Counter[str]) -> bytes | None:
    """The map to keep; None where none can be saved: by a target, or, which is counted, of a drive so lost
    that its covariance is none. What was measured of the drive stands all the same."""
    try:
        return slam.save_map() if hasattr(slam, "save_map") else None
    except CoreError as refusal:
        refusals[refusal.status] += 1
        return None


def _changed_parameters(slam: Any) -> dict[str, Number]:
    defaults = slam.defaults()
    params = {name: _as_written(value) for name, value in slam.params.items()}
    return {name: value for name, value in params.items() if value != defaults[name]}


def _map_beacon(beacon: Any, ledger: Ledger) -> MapBeacon:
    return MapBeacon(
        uid=beacon.uid,
        label=beacon.label,
        true_id=ledger.identity(beacon.uid),
        x_m=beacon.x_m,
        y_m=beacon.y_m,
        covariance_m2=np.array(beacon.covariance_m2, dtype=np.float64),
        sightings=beacon.sightings,
        confirmed=beacon.confirmed,
        range_m=beacon.range_m,
        phi_rad=beacon.phi_rad,
    )


def _as_written(value: Number) -> Number:
    """Seven digits, since float32's nearest to 0.3 is not Python's; a whole number with all of its digits."""
    return value if isinstance(value, int) else float(f"{value:.7g}")


def gyro_of(odometry: Odometry) -> list[tuple[float | None, float]]:
    """What the gyro says with each row, see `FrameFeed.gyro`; empty: there is none."""
    if odometry.gyro_radps is None:
        return []
    rates_radps = [None if math.isnan(rate) else rate for rate in odometry.gyro_radps.tolist()]
    sds_radps = odometry.gyro_sd_radps
    own = [0.0] * len(rates_radps) if sds_radps is None else sds_radps.tolist()
    return list(zip(rates_radps, own, strict=True))


class Frames:
    """Sightings in frames of equal time, as the filter is to see them: without what it must not know."""

    def __init__(
        self,
        sightings: Sightings,
        options: RunOptions,
        odometry: Odometry | None = None,
    ) -> None:
        self._gyro = [] if odometry is None else gyro_of(odometry)
        times = sightings.time_us
        first = np.flatnonzero(np.diff(times, prepend=-1))
        self._bounds = [*first.tolist(), len(times)]
        self._time_us: list[int] = times[first].tolist()
        self._true_id: list[int] = sightings.beacon_id.tolist()
        self._columns = columns_for_filter(sightings, options)
        self._signature = sightings.signature if uses_appearance(options) else None
        self._class = None if sightings.beacon_class is None else sightings.beacon_class.tolist()
        self._score = None if sightings.score is None else sightings.score.tolist()
        self._next = 0

    def gyro(self, row: int, time_us: int) -> tuple[float | None, float]:
        """As `FrameFeed.gyro`: what the log says."""
        return self._gyro[row] if self._gyro else (None, 0.0)

    def waiting_before(self, until_us: int | None) -> bool:
        """As `FrameFeed.waiting_before`."""
        if self._next == len(self._time_us):
            return False
        return until_us is None or self._time_us[self._next] < until_us

    def take(self) -> tuple[int, Sequence[int], list[Any]]:
        """As `FrameFeed.take`."""
        frame = self._next
        rows = slice(self._bounds[frame], self._bounds[frame + 1])
        self._next = frame + 1
        columns: list[Any] = [column[rows] for column in self._columns]
        more = (self._signature, self._class, self._score)
        if any(one is not None for one in more):
            columns += [None] * (SIGNATURE - len(columns))
            columns += [None if one is None else one[rows] for one in more]
        return self._time_us[frame], self._true_id[rows], columns


def columns_for_filter(sightings: Sightings, options: RunOptions) -> list[list[Any]]:
    """bearing_rad, range_m, label, mappable of all sightings, with what the options hide hidden.

    And the noise, bearing_sd_rad, range_sd_m, range_scale_sd, of a detector that gives it.
    """
    nothing: NDArray[np.float64] = np.full(len(sightings.time_us), np.nan)
    range_m = sightings.range_m if options.observation == "distance" else nothing
    label = np.full(len(sightings.time_us), -1, dtype=np.int64)
    if options.association == "known":
        mappable_id = np.where(sightings.mappable, sightings.beacon_id, -1)
        label = corrupt_identities(mappable_id, options.wrong_identity_rate, options.seed)
    columns = [sightings.bearing_rad, range_m, label, sightings.mappable]
    noise = (sightings.bearing_sd_rad, sightings.range_sd_m, sightings.range_scale_sd)
    if any(one is not None for one in noise):
        columns += [np.zeros(len(label)) if one is None else one for one in noise]
    return [column.tolist() for column in columns]
