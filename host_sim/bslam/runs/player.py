"""A run that can be watched: paused, stepped, slowed down and hurried while the filter runs.

The filter runs in a thread of its own and waits there, between two steps, for as long as it is told to.
Whoever watches reads the newest `Moment`, an object that nobody changes any more.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.evaluation.align import Rigid, fit_rigid, wrap_angle
from bslam.evaluation.ledger import Ledger
from bslam.evaluation.truth import step_times_us, truth_at
from bslam.log import Log
from bslam.moment import FAILED, FINISHED, PAUSED, RUNNING, Course, Moment, Spot, Told
from bslam.runs.eye import Eye
from bslam.runs.runner import MAPPABLE, Watcher

_PUBLISH_S: Final = 0.03  # moments that follow each other sooner nobody sees
_ALIGN_S: Final = 1.0
_TOLD_KEPT: Final = 200


class StopRun(Exception):  # noqa: N818 like StopIteration, no error
    """The user has gone."""


class Pace:
    """When the next step may be taken: what the user says from any thread, and what the run waits for."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed  # so many times as fast as the robot drives; inf: as fast as it goes
        self.playing = False
        self._turn = threading.Condition()
        self.stopping = False
        self._due = 0
        self._anchor: tuple[float, float] | None = None  # clock and time of the log at which this pace began

    def play(self) -> None:
        """Go on by itself."""
        self._say(playing=True)

    def pause(self) -> None:
        """Stand still after the step that is under way."""
        self._say(playing=False)

    def step(self, steps: int = 1) -> None:
        """Go so many steps and stand still."""
        self._say(playing=False, steps=steps)

    def set_speed(self, speed: float) -> None:
        """So many times as fast as the robot drives; inf: as fast as it goes."""
        self._say(speed=speed)

    def stop(self) -> None:
        """The step that waits, or the next one, raises StopRun."""
        self._say(stopping=True)

    def _say(
        self,
        playing: bool | None = None,
        steps: int = 0,
        speed: float | None = None,
        stopping: bool = False,
    ) -> None:
        with self._turn:
            self.playing = self.playing if playing is None else playing
            self.speed = self.speed if speed is None else speed
            self.stopping = self.stopping or stopping
            self._due = self._due + steps if steps else 0
            self._anchor = None
            self._turn.notify_all()

    def wait(self, time_s: float, halting: Callable[[], None]) -> None:
        """Return when the step after `time_s`, time of the log, may be taken. Raises StopRun.

        halting: called before it waits for the user or for the clock.
        """
        with self._turn:
            while not self.stopping:
                if self._due:
                    self._due -= 1
                    return
                wait_s = self._wait_s(time_s) if self.playing else None
                if wait_s is not None and wait_s <= 0.0:
                    return
                halting()
                self._turn.wait(wait_s)
            raise StopRun

    def _wait_s(self, time_s: float) -> float:
        now_s = time.monotonic()
        if self._anchor is None:
            self._anchor = now_s, time_s
        began_s, from_s = self._anchor
        wait_s = began_s + (time_s - from_s) / self.speed - now_s
        if wait_s < -1.0:  # the machine is not so fast: no race to catch up when it is again
            self._anchor = None
        return wait_s


class Player:
    """One run over a log. It stands at the start until `pace` is told to play or to step.

    run: runs the filter over the log and tells the watcher it is given; in a thread of its own. pace: of this
    run, and of one after it. align: the truth has a frame of its own. eye: what it sees is shown.
    """

    def __init__(
        self,
        log: Log,
        run: Callable[[Watcher], None],
        pace: Pace,
        *,
        align: bool = False,
        eye: Eye | None = None,
    ) -> None:
        self.pace = pace
        self._run_it = run
        self._books = Books(log, align, eye)
        self._published_s, self._stale = 0.0, False
        self.moment = self._books.moment(PAUSED)
        self._thread = threading.Thread(target=self._run, name="player", daemon=True)

    def start(self) -> None:
        """Take the run up; it waits at its start."""
        self._thread.start()

    def stop(self) -> None:
        """End the run where it stands."""
        self.pace.stop()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        state, message = FINISHED, ""
        try:
            self._run_it(self)
        except StopRun:
            return
        except BslamError as error:
            state, message = FAILED, str(error)
        except Exception as error:  # whatever it is, the page says so and the command ends as it must
            state, message = FAILED, f"{type(error).__name__}: {error}"
        if state == FAILED and self.pace.stopping:
            return  # Ctrl-C also ends an emulator, which then fails
        self.moment = self._books.moment(state, message=message)

    def frame(
        self, time_us: int, true_id: Sequence[int], columns: Sequence[Any], accounts: Sequence[Any] | None
    ) -> None:
        """The filter has worked off a frame."""
        self._books.enter_frame(time_us, true_id, columns, accounts)

    def step(self, time_us: int, pose: tuple[float, float, float], slam: Any) -> None:
        """The filter has done a step; waits for the user, or for the clock."""
        self._books.enter_step(pose, slam)
        self._stale = True
        if time.monotonic() - self._published_s > _PUBLISH_S or self._books.at_end:
            self._publish()
        self.pace.wait((time_us - self._books.start_us) * 1e-6, self._publish)

    def _publish(self) -> None:
        state = RUNNING if self.pace.playing else PAUSED
        if self._stale or state != self.moment.state:
            if self._stale:
                self._books.read_map()
            self._published_s, self._stale = time.monotonic(), False
            self.moment = self._books.moment(state)


class Books:
    """What there is to say of a run so far."""

    def __init__(self, log: Log, align: bool, eye: Eye | None) -> None:
        times_us = step_times_us(log)
        rows = len(times_us)
        self.start_us = int(times_us[0])
        self._time_s = (times_us - self.start_us).astype(np.float64) * 1e-6
        self._estimate, self._sd_m = np.full((rows, 3), np.nan), np.full(rows, np.nan)
        self._truth, self._error_m = np.full((rows, 3), np.nan), np.full(rows, np.nan)
        if log.truth is not None:
            self._truth, _ = truth_at(log.truth, times_us)
        self._beacons_m = np.empty((0, 2))
        if log.beacons is not None:
            self._beacons_m = np.column_stack([log.beacons.x_m, log.beacons.y_m])
        self._own_frame = (self._truth, self._beacons_m) if align else None
        self._aligned_s = 0.0
        self._slam: Any = None
        self._ledger = Ledger(lambda: [one.uid for one in self._slam.beacons()] if self._slam else [])
        self._beacons: tuple[Spot, ...] = ()
        self._covariance_m2 = np.zeros((2, 2))
        self._step = -1
        self._frame: tuple[Told, ...] = ()
        self._told: deque[Told] = deque(maxlen=_TOLD_KEPT)
        self._entered: list[Told] = []
        self._eye = eye

    def enter_frame(
        self, time_us: int, true_id: Sequence[int], columns: Sequence[Any], accounts: Sequence[Any] | None
    ) -> None:
        """A frame: its bearings and ranges are the first two columns."""
        time_s = (time_us - self.start_us) * 1e-6
        if accounts is None:
            wrong = [False] * len(true_id)
        else:
            wrong = self._ledger.book(true_id, columns[MAPPABLE], accounts)
        told = [
            _told(time_s, *row, None if accounts is None else accounts[index], wrong[index])
            for index, row in enumerate(zip(columns[0], columns[1], true_id, strict=True))
        ]
        self._entered += told
        self._told.extendleft(told)

    def enter_step(self, pose: tuple[float, float, float], slam: Any) -> None:
        """The step that these frames belong to."""
        self._step += 1
        row, self._slam = self._step, slam
        self._frame, self._entered = tuple(self._entered), []
        xx, yx, yy, *_ = slam.pose_covariance_lower()
        self._covariance_m2 = np.array([[xx, yx], [yx, yy]])
        self._estimate[row] = pose
        self._sd_m[row] = math.sqrt(max(xx + yy, 0.0))
        x_m, y_m, _ = self._truth[row]
        self._error_m[row] = math.hypot(pose[0] - x_m, pose[1] - y_m)

    @property
    def rows(self) -> int:
        """Steps, the start among them."""
        return len(self._time_s)

    @property
    def at_end(self) -> bool:
        """No step is left."""
        return self._step + 1 == len(self._time_s)

    def read_map(self) -> None:
        """Ask the filter for its map, which the run's own thread alone may."""
        self._beacons = tuple(_spot(one) for one in self._slam.beacons())

    def moment(self, state: str, message: str = "") -> Moment:
        """All of it."""
        if self._own_frame is not None and time.monotonic() - self._aligned_s > _ALIGN_S:
            self._align(*self._own_frame)
        rows = slice(0, self._step + 1)
        return Moment(
            state=state,
            step=max(self._step, 0),
            course=Course(
                self._time_s[rows],
                self._estimate[rows],
                self._sd_m[rows],
                self._truth[rows],
                self._error_m[rows],
            ),
            covariance_m2=self._covariance_m2,
            beacons=self._beacons,
            true_beacons_m=self._beacons_m,
            frame=self._frame,
            told=tuple(self._told),
            shown=None if self._eye is None else self._eye.shown(self._frame),
            message=message,
        )

    def _align(self, truth: NDArray[np.float64], beacons_m: NDArray[np.float64]) -> None:
        """Bring the truth to the estimate so far; new arrays, since the old ones are in moments."""
        self._aligned_s = time.monotonic()
        rows = np.flatnonzero(np.isfinite(truth[: self._step + 1, 0]))
        if len(rows) < 2:
            return
        to_map: Rigid = fit_rigid(truth[rows, :2], self._estimate[rows, :2])
        aligned = to_map.poses(np.nan_to_num(truth))
        self._truth = np.where(np.isfinite(truth), aligned, np.nan)
        self._truth[:, 2] = wrap_angle(self._truth[:, 2])
        self._beacons_m = to_map.points(beacons_m)
        away_m = self._estimate[:, :2] - self._truth[:, :2]
        self._error_m = np.hypot(away_m[:, 0], away_m[:, 1])


def _told(time_s: float, bearing_rad: float, range_m: float, true_id: int, account: Any, wrong: bool) -> Told:
    seen = (time_s, bearing_rad, range_m if math.isfinite(range_m) else None, true_id)
    if account is None:
        return Told(*seen, "refused", "frame", None, None, 0.0)
    rest = (account.result, account.reason, account.beacon_uid, account.test_ratio, account.weight)
    return Told(*seen, *rest, wrong=wrong)


def _spot(beacon: Any) -> Spot:
    place = (beacon.x_m, beacon.y_m, np.asarray(beacon.covariance_m2, dtype=np.float64))
    return Spot(beacon.uid, beacon.label, *place, beacon.sightings, beacon.confirmed)
