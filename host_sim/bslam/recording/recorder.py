"""A pipeline that writes down all that goes in and comes out."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.errors import CoreError
from bslam.core.slam import Account
from bslam.recording.entries import Argument, Call, Counters, Frame, Map, Pose, Reading, State, TruePose
from bslam.recording.writer import RecordingWriter

FINGERPRINT_START = 0xCBF29CE484222325
"""BSLAM_FINGERPRINT_START."""
MAP_PERIOD_US = 1_000_000


class Recorder:
    """A `Slam` or `RemoteSlam` with a recording: the same calls, each noted with its answer.

    truth: true poses in order of time, noted as the robot gets there. Close the writer after `finish`.
    """

    def __init__(self, slam: Any, writer: RecordingWriter, truth: Iterable[TruePose] = ()) -> None:
        self._slam, self._writer = slam, writer
        self.true_id: list[int] | None = None  # of the next frame's sightings, where the caller knows
        self.noting_ns = 0  # CPU time of this class itself
        self._truth = iter(truth)
        self._next_true = next(self._truth, None)
        self._chain = FINGERPRINT_START
        self._time_us = 0
        self._map_us: int | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._slam, name)

    def odometry(
        self,
        kind: str,
        time_us: int,
        a: float,
        b: float,
        gyro_radps: float | None = None,
        gyro_sd_radps: float = 0.0,
    ) -> None:
        """As `Slam.odometry`."""
        inputs = (kind, time_us, a, b, gyro_radps, gyro_sd_radps)
        _, refusal = self._attempt("odometry", *inputs)
        self._end_step(Reading(*inputs, _status(refusal)), refusal)

    def sightings(
        self,
        time_us: int,
        bearing_rad: list[float],
        range_m: list[float],
        label: list[int],
        mappable: list[bool],
        bearing_sd_rad: list[float] | None = None,
        range_sd_m: list[float] | None = None,
        range_scale_sd: list[float] | None = None,
        signature: NDArray[np.float32] | None = None,
        beacon_class: list[int] | None = None,
        score: list[float] | None = None,
    ) -> list[Account]:
        """As `Slam.sightings`."""
        noise = (bearing_sd_rad, range_sd_m, range_scale_sd)
        inputs = (time_us, bearing_rad, range_m, label, mappable, *noise, signature, beacon_class, score)
        accounts, refusal = self._attempt("sightings", *inputs)
        self._end_step(Frame(*inputs, self.true_id, accounts, _status(refusal)), refusal)
        return list(accounts)

    def resume_odometry(self, *arguments: float) -> None:
        """As `Slam.resume_odometry`."""
        self._call("resume_odometry", *arguments)

    def set_pose(self, *arguments: float) -> None:
        """As `Slam.set_pose`."""
        self._call("set_pose", *arguments)

    def load_map(self, blob: bytes, *, frozen: bool = False) -> None:
        """As `Slam.load_map`."""
        self._call("load_map", blob, frozen=frozen)

    def lose_pose(self) -> None:
        """As `Slam.lose_pose`."""
        self._call("lose_pose")

    def add_known_beacon(self, *arguments: float) -> None:
        """As `Slam.add_known_beacon`."""
        self._call("add_known_beacon", *arguments)

    def remove_beacon(self, *arguments: int) -> None:
        """As `Slam.remove_beacon`."""
        self._call("remove_beacon", *arguments)

    def finish(self) -> None:
        """Note the map and the counters at the end."""
        self._note_map()

    def _call(self, name: str, *arguments: Argument, **words: bool) -> None:
        _, refusal = self._attempt(name, *arguments, **words)
        self._writer.put(Call(name, arguments, _status(refusal), words))
        if refusal is not None:
            raise refusal

    def _attempt(self, name: str, *inputs: Any, **words: bool) -> tuple[Any, CoreError | None]:
        try:
            return getattr(self._slam, name)(*inputs, **words), None
        except CoreError as error:
            return None, error

    def _end_step(self, step: Reading | Frame, refusal: CoreError | None) -> None:
        began = time.thread_time_ns()
        self._writer.put(step)
        self._note_state(step.time_us)
        self.noting_ns += time.thread_time_ns() - began
        if refusal is not None:
            raise refusal

    def _note_state(self, time_us: int) -> None:
        self._time_us = max(time_us, self._time_us)
        self._chain = self._slam.fingerprint(self._chain)
        pose: Pose = self._slam.pose()
        covariance = self._slam.pose_covariance_lower()
        self._writer.put(State(self._time_us, pose, covariance, self._chain))
        while self._next_true is not None and self._next_true.time_us <= self._time_us:
            self._writer.put(self._next_true)
            self._next_true = next(self._truth, None)
        if self._map_us is None or self._time_us - self._map_us >= MAP_PERIOD_US:
            self._note_map()

    def _note_map(self) -> None:
        self._map_us = self._time_us
        self._writer.put(Map(self._slam.beacons()))
        self._writer.put(Counters(dict(self._slam.counters())))


def _status(refusal: CoreError | None) -> str | None:
    return None if refusal is None else refusal.status
