"""From a recording to a log, the inputs alone, and from a log to what a recording begins with."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from bslam.core.slam import BY_APPEARANCE
from bslam.errors import BslamError
from bslam.log import SIGHTING_NUMBERS, TICK_KEYS, Beacons, Log, Odometry, Robot, Sightings, Truth, robot_text
from bslam.parsing.settings import parse_table
from bslam.recording.entries import Frame, Reading, Start, TruePose
from bslam.recording.reader import Recording


def as_log(recording: Recording) -> Log:
    """The log of a recording, without the readings that the core refused.

    Raises BslamError if it has no odometry, more than one kind of it, or stamps that do not rise.
    """
    entries = recording.entries
    odometry = _odometry(
        recording, [one for one in entries if isinstance(one, Reading) and one.refused is None]
    )
    truth = [one for one in entries if isinstance(one, TruePose)]
    beacons = recording.start.true_beacons
    return Log(
        name=recording.start.name,
        odometry=odometry,
        sightings=_sightings([one for one in entries if isinstance(one, Frame)]),
        truth=_truth(truth) if truth else None,
        beacons=_beacons(beacons) if beacons else None,
        robot=_robot(recording.start, odometry),
        seeds=recording.start.seeds,
        words=recording.start.words,
        notes=() if recording.complete else (f"{recording.path}: it was cut short; its end is missing",),
    )


def start_of(log: Log, params: Mapping[str, int | float], beacons_max: int, real: str) -> Start:
    """The start of a recording of a run over the log."""
    known: tuple[tuple[int, float, float], ...] = ()
    if log.beacons is not None:
        columns = (log.beacons.beacon_id.tolist(), log.beacons.x_m.tolist(), log.beacons.y_m.tolist())
        known = tuple(zip(*columns, strict=True))
    return Start(
        name=log.name,
        params=dict(params),
        beacons_max=beacons_max,
        seeds=log.seeds if params["association"] in BY_APPEARANCE else None,
        robot=robot_text(log.robot),
        true_beacons=known,
        words=log.words,
        real=real,
    )


def true_poses(log: Log) -> Iterator[TruePose]:
    """The log's truth, in order of time."""
    if log.truth is not None:
        truth = log.truth
        columns = (truth.time_us.tolist(), truth.x_m.tolist(), truth.y_m.tolist(), truth.theta_rad.tolist())
        for time_us, x_m, y_m, theta_rad in zip(*columns, strict=True):
            yield TruePose(time_us, (x_m, y_m, theta_rad))


def _odometry(recording: Recording, readings: list[Reading]) -> Odometry:
    kinds = sorted({one.kind for one in readings})
    if len(kinds) != 1:
        said = ", ".join(kinds) or "none"
        raise BslamError(f"{recording.path}: odometry of kind {said}; allowed: one kind all along")
    time_us = np.array([one.time_us for one in readings], dtype=np.int64)
    if (np.diff(time_us) <= 0).any():
        place = int(np.flatnonzero(np.diff(time_us) <= 0)[0]) + 1
        raise BslamError(f"{recording.path}: odometry at {time_us[place]} us: allowed: after the one before")
    a, b = (np.array([getattr(one, name) for one in readings], dtype=np.float64) for name in "ab")
    gyro_radps = np.array([one.gyro_radps for one in readings], dtype=np.float64)  # None becomes NaN
    if np.isnan(gyro_radps).all():
        return Odometry(kinds[0], time_us, a, b)
    gyro_sd_radps = np.array([one.gyro_sd_radps for one in readings], dtype=np.float64)
    return Odometry(kinds[0], time_us, a, b, gyro_radps, gyro_sd_radps if gyro_sd_radps.any() else None)


def _sightings(frames: list[Frame]) -> Sightings:
    frames = sorted((one for one in frames if one.bearing_rad), key=lambda one: one.time_us)

    def column(name: str, kind: Any) -> Any:
        return np.array([value for frame in frames for value in getattr(frame, name)], dtype=kind)

    def told(name: str) -> bool:
        return bool(frames) and all(getattr(frame, name) is not None for frame in frames)

    numbers = {name: column(name, np.float64) for name in SIGHTING_NUMBERS if told(name)}
    return Sightings(
        time_us=np.repeat(
            np.array([frame.time_us for frame in frames], dtype=np.int64),
            np.array([len(frame.bearing_rad) for frame in frames], dtype=np.int64),
        ),
        beacon_id=np.array([one for frame in frames for one in _identities(frame)], dtype=np.int64),
        bearing_rad=column("bearing_rad", np.float64),
        range_m=column("range_m", np.float64),
        mappable=column("mappable", np.bool_),
        signature=np.concatenate([frame.signature for frame in frames]) if told("signature") else None,
        beacon_class=column("beacon_class", np.int64) if told("beacon_class") else None,
        **numbers,
    )


def _identities(frame: Frame) -> list[int]:
    return [max(one, -1) for one in (frame.label if frame.true_id is None else frame.true_id)]


def _truth(poses: list[TruePose]) -> Truth:
    time_us = np.array([one.time_us for one in poses], dtype=np.int64)
    return Truth(time_us, *np.array([one.pose for one in poses], dtype=np.float64).T)


def _beacons(rows: tuple[tuple[int, float, float], ...]) -> Beacons:
    identity, x_m, y_m = zip(*rows, strict=True)
    return Beacons(np.array(identity, dtype=np.int64), np.array(x_m), np.array(y_m))


def _robot(start: Start, odometry: Odometry) -> Robot:
    """As the recording has it; else what the filter was told, which is all that is known."""
    if start.robot is not None:
        return parse_table(Robot, tomllib.loads(start.robot), "the recording's robot")
    params = start.params
    step_us = float(np.median(np.diff(odometry.time_us))) if len(odometry.time_us) > 1 else 1.0
    per_m = params["range_sd_per_m"]
    ticks: dict[str, Any] = {key: params[key] for key in TICK_KEYS} if odometry.kind == "ticks" else {}
    return Robot(
        wheelbase_m=params["wheelbase_m"],
        wheel_speed_sigma_mps=params["left_speed_sd_mps"],
        step_us=max(1, round(step_us)),
        field_of_view_rad=2.0 * math.pi,
        bearing_sigma_rad=params["bearing_sd_rad"],
        range_sigma_fraction=params["range_sd_fraction"],
        range_sigma_scale_m=1.0 / per_m if per_m > 0 else math.inf,
        range_sigma_floor_m=params["range_sd_floor_m"],
        sensor_x_m=params["mount_x_m"],
        sensor_y_m=params["mount_y_m"],
        sensor_yaw_rad=params["mount_yaw_rad"],
        sighting_delay_us=int(params["sighting_delay_us"]),
        sighting_correlation_m=max(params["correlation_m"], 0.0),
        wheel_noise="speedometer" if params["velocity_states"] else "actuation",
        **ticks,
    )
