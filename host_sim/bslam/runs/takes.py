"""A run as a number of moments, for a film of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from bslam.log import Log
from bslam.moment import RUNNING, Moment
from bslam.runs.player import Books


class Takes:
    """Watches a run (see `runner.Watcher`) and keeps `count` moments of it, evenly apart.

    The last step's is among them. A moment's frame is the newest since the one before. The truth must be in
    the frame of the map.
    """

    def __init__(self, log: Log, count: int) -> None:
        self.moments: list[Moment] = []
        self._books = Books(log, align=False, eye=None)
        self._count, self._step = count, 0
        self._last_s = 0.0  # time of the moment before

    def frame(
        self, time_us: int, true_id: Sequence[int], columns: Sequence[Any], accounts: Sequence[Any] | None
    ) -> None:
        """As `runner.Watcher`."""
        self._books.enter_frame(time_us, true_id, columns, accounts)

    def step(self, time_us: int, pose: tuple[float, float, float], slam: Any) -> None:
        """As `runner.Watcher`."""
        self._books.enter_step(pose, slam)
        self._step += 1
        rows = self._books.rows
        if self._step * self._count // rows > (self._step - 1) * self._count // rows:
            self._books.read_map()
            moment = self._books.moment(RUNNING)
            newest = [one for one in moment.told if one.time_s == moment.told[0].time_s > self._last_s]
            self._last_s = (time_us - self._books.start_us) * 1e-6
            self.moments.append(replace(moment, frame=tuple(newest)))
