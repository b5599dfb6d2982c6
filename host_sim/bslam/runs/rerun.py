"""A recording once more: its inputs into the core on this computer or a target, its states held against them.

Nothing is sorted or chosen anew: the inputs go in as they went in then, with the parameters of then.
"""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bslam.core.errors import CoreError
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.evaluation.ledger import Ledger
from bslam.evaluation.trace import Trace
from bslam.evaluation.truth import step_times_us
from bslam.options import ASSOCIATIONS, FILTERS, MOTIONS, Number, RunOptions
from bslam.recording import Recording
from bslam.recording.aslog import as_log
from bslam.recording.entries import Call, Entry, Frame, Gap, Reading, State
from bslam.recording.recorder import FINGERPRINT_START
from bslam.runs.runner import Rows, Watcher, make_trace
from bslam.target.remote import connect


@dataclass
class Comparison:
    """How a rerun went against the recording."""

    states: int = 0  # compared
    different: int = 0
    first_us: int | None = None  # the robot's time of the first state that is not the same to the bit
    answers: int = 0  # inputs that are refused now and were not then, or the other way round
    lost: int = 0  # reports that the recording lacks
    fingerprint: int = field(default=FINGERPRINT_START)  # of all states now

    @property
    def same(self) -> bool:
        return not self.different and not self.answers


def options_of(recording: Recording, target: str, changes: Mapping[str, Number]) -> RunOptions:
    """In the words of the command line, how a rerun is made: with the parameters of then, and `changes`."""
    params = recording.start.params | dict(changes)
    frames = [one for one in recording.entries if isinstance(one, Frame)]
    ranged = any(range_m == range_m for frame in frames for range_m in frame.range_m)
    return RunOptions(
        observation="distance" if ranged or not frames else "direction",
        association=ASSOCIATIONS[int(params["association"])],
        filter=FILTERS[int(params["filter"])],
        motion=MOTIONS[int(params["motion"])],
        velocity_states=bool(params["velocity_states"]),
        sensor="recorded",
        target=target,
        real=recording.start.real,
        known_map=any(isinstance(one, Call) and one.name == "add_known_beacon" for one in recording.entries),
        parameters=tuple(params.items()),
    )


def rerun(
    recording: Recording, options: RunOptions, watcher: Watcher | None = None
) -> tuple[Trace, Comparison]:
    """The trace of the rerun, and how it compares. Raises BslamError."""
    start = recording.start
    params, room = dict(options.parameters), start.beacons_max
    if options.target == "host":
        slam = Slam(params, beacons_max=room, real=start.real, seeds=start.seeds)
        if start.kept_map is not None:
            slam.load_map(base64.b64decode(start.kept_map), frozen=start.frozen)
        return _Rerun(slam, recording, watcher).finish()
    if start.kept_map is not None:
        raise BslamError(
            f"{recording.path}: it begins in a kept map; with --target {options.target}: allowed is host"
        )
    if start.real != "float":
        raise BslamError(
            f"{recording.path}: real {start.real} with --target {options.target}: allowed is float"
        )
    with connect(options.target, params, room, fingerprints=True, seeds=start.seeds) as remote:
        return _Rerun(remote, recording, watcher).finish(remote.target_description)


class _Rerun:
    """One pass over a recording. Rows of its trace as the runner makes them: a row for each reading."""

    def __init__(self, slam: Any, recording: Recording, watcher: Watcher | None) -> None:
        self.slam, self.watcher = slam, watcher
        self.found = Comparison()
        self.refusals: Counter[str] = Counter()
        self.ledger = Ledger(lambda: [beacon.uid for beacon in slam.beacons()])
        log = as_log(recording)
        self.times_us = step_times_us(log).tolist()
        self.rows = Rows()
        if len(self.times_us) > len(log.odometry.time_us):  # the start stands before the first reading
            self.rows.seen.append(False)
        for entry in recording.entries:
            self._take(entry)
        self._end_row()

    def _take(self, entry: Entry) -> None:
        if isinstance(entry, Reading):
            self._take_reading(entry)
        elif isinstance(entry, Frame):
            self._take_frame(entry)
        elif isinstance(entry, Call):
            self._answer(entry, self._try(entry.name, *entry.arguments, **entry.words)[1])
        elif isinstance(entry, State):
            self._compare(entry)
        elif isinstance(entry, Gap):
            self.found.lost += entry.lost

    def _take_reading(self, reading: Reading) -> None:
        if reading.refused is None:
            self._end_row()
            self.rows.seen.append(False)
        gyro = (reading.gyro_radps, reading.gyro_sd_radps)
        _, refused = self._try("odometry", reading.kind, reading.time_us, reading.a, reading.b, *gyro)
        self._chain()
        self._answer(reading, refused)

    def _take_frame(self, frame: Frame) -> None:
        if self.rows.seen:
            self.rows.seen[-1] = self.rows.seen[-1] or bool(frame.label)
        columns = (frame.bearing_rad, frame.range_m, frame.label, frame.mappable)
        noise = (frame.bearing_sd_rad, frame.range_sd_m, frame.range_scale_sd)
        accounts, refused = self._try(
            "sightings", frame.time_us, *columns, *noise, frame.signature, frame.beacon_class, frame.score
        )
        true_id = frame.label if frame.true_id is None else frame.true_id
        if accounts is None:
            self.ledger.book_refused(true_id, frame.mappable)
        else:
            self.ledger.book(true_id, frame.mappable, accounts)
        if self.watcher is not None:
            self.watcher.frame(frame.time_us, true_id, columns, accounts)
        self._chain()
        self._answer(frame, refused)

    def _try(self, name: str, *inputs: Any, **words: bool) -> tuple[Any, str | None]:
        """The answer of the core; None, and why, where it refuses the input."""
        try:
            return getattr(self.slam, name)(*inputs, **words), None
        except CoreError as refusal:
            self.refusals[refusal.status] += 1
            return None, refusal.status

    def _chain(self) -> None:
        self.found.fingerprint = self.slam.fingerprint(self.found.fingerprint)

    def _answer(self, entry: Reading | Frame | Call, refused: str | None) -> None:
        self.found.answers += refused != entry.refused

    def _compare(self, then: State) -> None:
        now = (tuple(self.slam.pose()), tuple(self.slam.pose_covariance_lower()))
        same = now == (tuple(then.pose), tuple(then.covariance))
        if then.fingerprint is not None:
            same = same and then.fingerprint == self.found.fingerprint
        self.found.states += 1
        if not same:
            self.found.different += 1
            if self.found.first_us is None:
                self.found.first_us = then.time_us

    def _end_row(self) -> None:
        """After all that belongs to the row."""
        if len(self.rows.poses) < len(self.rows.seen):
            self.rows.poses.append(self.slam.pose())
            self.rows.covariances.append(self.slam.pose_covariance_lower())
            if self.watcher is not None:
                row = len(self.rows.poses) - 1
                self.watcher.step(self.times_us[row], self.rows.poses[row], self.slam)

    def finish(self, target: Callable[[], Mapping[str, Any]] | None = None) -> tuple[Trace, Comparison]:
        """What it left behind; `target` tells of what it ran on, if not here."""
        on = target() if target else None
        return make_trace(self.slam, self.times_us, self.rows, self.ledger, self.refusals, on), self.found
