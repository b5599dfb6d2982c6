"""Cameras that look while the filter runs: a step is rendered and looked at when the filter comes to it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bslam.core.vision import Candidate
from bslam.errors import BslamError
from bslam.log import Log, Sightings
from bslam.moment import Box, Shown, Told
from bslam.options import ASSOCIATIONS, RunOptions
from bslam.runs.camera import SEEN, TURNS, CameraDrive, Glance
from bslam.runs.compass import Compass
from bslam.runs.runner import Frames


class Eye:
    """The sightings of a drive, made one frame at a time (`runner.FrameFeed`); the last frame to look at.

    Raises BslamError for wrong identities at a rate: they are drawn for a drive as a whole.
    """

    def __init__(self, log: Log, options: RunOptions, glances: Iterator[Glance]) -> None:
        if options.wrong_identity_rate > 0.0:
            allowed = f"allowed here: {', '.join(ASSOCIATIONS)}"
            raise BslamError(
                f"--association {options.association_name}: needs all sightings first; {allowed}"
            )
        self._options, self._glances, self._step_us = options, glances, log.robot.step_us
        self._compass = Compass(log)
        self._seen_us = -self._step_us  # time of the last frame that was looked at
        self._frame: Frames | None = None  # the one that is to be taken
        self._glance: Glance | None = None
        self._rows: list[tuple[Any, ...]] = []

    def waiting_before(self, until_us: int | None) -> bool:
        """As `runner.FrameFeed`; looks until there is something, or until then."""
        while self._frame is None and (until_us is None or self._seen_us + self._step_us < until_us):
            glance = next(self._glances, None)
            if glance is None:
                return False
            self._glance, self._seen_us = glance, glance.step * self._step_us
            self._compass.take(glance.step, glance.camera, glance.turn)
            if glance.rows:
                self._rows += glance.rows
                self._frame = Frames(self._sightings(glance.rows), self._options)
        return self._frame is not None and self._frame.waiting_before(until_us)

    def gyro(self, row: int, time_us: int) -> tuple[float | None, float]:
        """As `runner.FrameFeed`: the frame of that time is looked at now."""
        self.waiting_before(time_us + 1)
        rate_radps = float(self._compass.rates_radps[row])
        return None if math.isnan(rate_radps) else rate_radps, float(self._compass.sds_radps[row])

    def take(self) -> tuple[int, Sequence[int], list[Any]]:
        """As `runner.FrameFeed`."""
        assert self._frame is not None
        frame, self._frame = self._frame, None
        return frame.take()

    def sightings(self) -> Sightings:
        """All that was seen so far."""
        return self._sightings(self._rows)

    def _sightings(self, rows: list[tuple[Any, ...]]) -> Sightings:
        drive = CameraDrive(np.empty((0, 3)), np.array(rows, dtype=SEEN), np.empty(0, TURNS))
        return drive.sightings(self._step_us)

    def shown(self, frame: Sequence[Told]) -> Shown | None:
        """The last picture; `frame`: what became of its sightings, if they have been told."""
        glance = self._glance
        if glance is None:
            return None
        told = [""] * len(glance.rows)
        if len(frame) == len(told):
            told = [one.verdict for one in frame]
        pairs = zip(glance.candidates, told, strict=True)
        boxes = [Box(one.outline, _lines(one), result) for one, result in pairs]
        return Shown(glance.rgb, boxes, f"camera {glance.camera}, {glance.step * self._step_us * 1e-6:.2f} s")


def _lines(candidate: Candidate) -> tuple[str, str]:
    assert candidate.bearing_rad is not None
    distance = "" if candidate.range_m is None else f"{candidate.range_m:.2f} m "
    return candidate.kind, f"{distance}{math.degrees(candidate.bearing_rad):+.1f}\u00b0"
