"""Messages of the link: payloads to values and back. `firmware/robot/session.h` is the other side."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

ANSWER = 0x80
"""The answer to message m has type m | ANSWER."""


class Message(IntEnum):
    """What the host sends."""

    HELLO = 0x01
    RESET = 0x02
    ODOMETRY = 0x03
    SIGHTINGS = 0x04
    RESUME = 0x05
    KNOWN_BEACON = 0x06
    REMOVE_BEACON = 0x07
    PARAM_SET = 0x08
    PARAM_GET = 0x09
    POSE_AT = 0x0A
    MAP = 0x0B
    COUNTERS = 0x0C
    SIGNATURES = 0x0D
    SEEDS = 0x0E
    STATE = 0x0F
    PARAM_SAVE = 0x10
    CAMERA = 0x11
    IMAGE = 0x12
    PIXELS = 0x13
    LOOK = 0x14
    SEEN = 0x15
    SET_POSE = 0x16
    HEALTH = 0x17
    MAP_READ = 0x18
    MAP_WRITE = 0x19
    MAP_LOAD = 0x1A
    MAP_SAVE = 0x1B


class Report(IntEnum):
    """What the robot sends of itself."""

    READY = 0x40
    POSE = 0x41
    SIGHTED = 0x42
    LOOKED = 0x43


LINK_STATUSES = {
    0x40: "NO_SESSION",
    0x41: "TYPE",
    0x42: "LENGTH",
    0x43: "STORE",
}
"""Statuses that are the link's own; below are the library's."""
NO_DETAIL = 255

_HELLO = struct.Struct("<IB")
_HEALTH = struct.Struct("<BBBq7I")
_INFO = struct.Struct("<I3B6HI20s")
_PAIR = struct.Struct("<ff")
_KNOWN_BEACON = struct.Struct("<iff")
_UID = struct.Struct("<I")
_PARAM_ID = struct.Struct("<H")
_PARAM = struct.Struct("<Hf")
_REPORT = struct.Struct("<BIIBff")
_CAMERA = struct.Struct("<BBHH9fB")
_SEEN = struct.Struct("<6fiBB")
_LOOKED = struct.Struct("<4B")
_VALUE = struct.Struct("<f")
_PLACE = struct.Struct("<I")
_POSE_AT = struct.Struct("<B3f")
_STEP = struct.Struct("<9fQI")
_ACCOUNT = struct.Struct("<BBBIff")
_BEACON = struct.Struct("<IiBBBI7f")
_SIGHTING = np.dtype(
    [
        ("bearing_rad", "<f4"),
        ("range_m", "<f4"),
        ("bearing_sd_rad", "<f4"),
        ("range_sd_m", "<f4"),
        ("range_scale_sd", "<f4"),
        ("score", "<f4"),
        ("label", "<i4"),
        ("beacon_class", "u1"),
        ("flags", "u1"),
    ]
)
_REALS = ("bearing_sd_rad", "range_sd_m", "range_scale_sd", "score")
_SOURCES = {"wheels": 0, "ticks": 1, "velocity": 2}
_NOT_MAPPABLE = 255
_SIGNATURE_BYTES = 4 * 71


def float32(value: float) -> bytes:
    """A number as C would convert it: rounded to nearest, infinite where it is too large."""
    with np.errstate(over="ignore"):
        return np.float32(value).astype("<f4").tobytes()


def hello(session: int, *, fingerprints: bool = False, as_it_is: bool = False) -> bytes:
    """as_it_is: the robot goes on with the parameters and the map that it has."""
    return _HELLO.pack(session, fingerprints | as_it_is << 2)


def odometry(
    kind: str, a: float, b: float, gyro_radps: float | None = None, gyro_sd_radps: float = 0.0
) -> bytes:
    """A reading; raises struct.error for counters that are no 32-bit numbers."""
    values = struct.pack("<II", int(a), int(b)) if kind == "ticks" else float32(a) + float32(b)
    has_gyro = gyro_radps is not None
    return (
        bytes((_SOURCES[kind], int(has_gyro))) + values + float32(gyro_radps or 0.0) + float32(gyro_sd_radps)
    )


def payload_max(sightings_max: int) -> int:
    """Bytes of the longest payload of an image that takes so many sightings (BSLAM_LINK_PAYLOAD_MAX)."""
    return 16 + 30 * max(sightings_max, 16)


def signatures_a_frame(sightings_max: int) -> int:
    """How many signatures a payload of that image has room for."""
    return (payload_max(sightings_max) - 2) // _SIGNATURE_BYTES


def signatures(first: int, part: NDArray[np.float32]) -> bytes:
    """SIGNATURES or SEEDS from number `first` on, (n, features)."""
    return bytes((first, len(part))) + part.astype("<f4").tobytes()


def sightings(
    rows: Sequence[tuple[float, float, int, int, float, float, float, float]], signed: bool, most: int
) -> bytes:
    """Rows as `bslam.core.raw.Library.sightings` takes them; of more than `most` only the number counts.

    signed: the signatures of all have been sent.
    """
    count, rows = len(rows), rows[:most]
    table = np.zeros(len(rows), dtype=_SIGHTING)
    if rows:
        bearing_rad, range_m, label, beacon_class, *reals = zip(*rows, strict=True)
        with np.errstate(over="ignore"):
            has_range = ~np.isnan(np.array(range_m, dtype=np.float64))
            table["bearing_rad"] = bearing_rad
            table["range_m"] = np.where(has_range, range_m, 0.0)
            for name, values in zip(_REALS, reals, strict=True):
                table[name] = values
        table["label"] = label
        table["beacon_class"] = beacon_class
        table["flags"] = has_range | signed << 1
    return bytes((min(count, 255),)) + table.tobytes()


@dataclass(frozen=True)
class CameraRecord:
    """A camera as the robot wants it, bslam_camera_t; lens 0 pinhole, 1 equidistant."""

    lens: int
    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    k1: float
    k2: float
    yaw_rad: float
    pitch_rad: float
    z_m: float
    zoom: int


def camera(index: int, record: CameraRecord) -> bytes:
    return _CAMERA.pack(index, *astuple(record))


def image(index: int, rgb565: bool) -> bytes:
    return bytes((index, 0 if rgb565 else 1))


def resume(position_sd_m: float, heading_sd_rad: float) -> bytes:
    return float32(position_sd_m) + float32(heading_sd_rad)


def set_pose(x_m: float, y_m: float, theta_rad: float, position_sd_m: float, heading_sd_rad: float) -> bytes:
    return b"".join(map(float32, (x_m, y_m, theta_rad, position_sd_m, heading_sd_rad)))


def known_beacon(label: int, x_m: float, y_m: float) -> bytes:
    return struct.pack("<i", label) + float32(x_m) + float32(y_m)


def remove_beacon(uid: int) -> bytes:
    return _UID.pack(uid)


def map_read(at: int) -> bytes:
    return _PLACE.pack(at)


def map_write(at: int, part: bytes) -> bytes:
    return _PLACE.pack(at) + part


def map_load(size: int, frozen: bool) -> bytes:
    return _PLACE.pack(size) + bytes((frozen,))


def map_bytes_a_frame(sightings_max: int) -> int:
    """How many bytes of a map a payload of that image has room for."""
    return payload_max(sightings_max) - _PLACE.size


def param_set(number: int, value: float) -> bytes:
    return _PARAM_ID.pack(number) + float32(value)


def param_get(number: int) -> bytes:
    return _PARAM_ID.pack(number)


@dataclass(frozen=True)
class Info:
    """What an image says of itself."""

    session: int
    version: str
    build_id: str
    beacons_max: int
    rays_max: int
    sightings_max: int
    history_max: int
    params_count: int
    params_crc: int
    ticks_hz: int


def read_info(body: bytes) -> Info:
    values = _INFO.unpack(body)
    version = ".".join(map(str, values[1:4]))
    return Info(values[0], version, values[11].hex(), *values[4:11])


@dataclass(frozen=True)
class Step:
    """Where the robot stands after a step: pose, lower triangle of its covariance, fingerprint, ticks."""

    pose: tuple[float, float, float]
    covariance: tuple[float, ...]
    fingerprint: int
    ticks: int


def read_step(body: bytes) -> Step:
    values = _STEP.unpack_from(body)
    return Step((values[0], values[1], values[2]), tuple(values[3:9]), values[9], values[10])


@dataclass(frozen=True)
class RawAccount:
    """An account in the library's numbers."""

    outcome: int
    reason: int
    has_beacon: bool
    beacon_uid: int
    test_ratio: float
    weight: float


@dataclass(frozen=True)
class PoseReport:
    """A reading of the robot's own encoders: what became of it, the counters, and where it led."""

    status: int
    left_ticks: int
    right_ticks: int
    gyro_radps: float | None  # what its gyro, or its cameras, told with it
    gyro_sd_radps: float  # by what that errs; 0: as the parameter says
    step: Step


def read_pose_report(payload: bytes) -> PoseReport:
    status, left_ticks, right_ticks, flags, rate_radps, sd_radps = _REPORT.unpack_from(payload)
    gyro_radps = rate_radps if flags & 1 else None
    step = read_step(payload[_REPORT.size :])
    return PoseReport(status, left_ticks, right_ticks, gyro_radps, sd_radps, step)


def read_look(body: bytes) -> tuple[list[RawAccount], int, int]:
    """An answer to LOOK without its step: accounts, bslam_vision_reason_t, how many were seen."""
    return read_accounts(body[:-2]), body[-2], body[-1]


@dataclass(frozen=True)
class Seen:
    """A sighting that the robot itself took from a picture."""

    bearing_rad: float
    range_m: float  # NaN: none
    bearing_sd_rad: float
    range_sd_m: float
    range_scale_sd: float
    score: float
    beacon_class: int
    signature: NDArray[np.float32] | None  # (71,)


def read_seen(body: bytes) -> Seen:
    """The sighting that follows the first byte of an answer to SEEN, or of SIGHTED."""
    bearing_rad, range_m, sd_rad, sd_m, scale_sd, score, _, kind, flags = _SEEN.unpack_from(body, 1)
    has_range, signed = bool(flags & 1), bool(flags & 2)
    looks = np.frombuffer(body[1 + _SEEN.size :], "<f4").astype(np.float32)
    if looks.shape != ((_SIGNATURE_BYTES // 4) * signed,):
        raise struct.error(f"a sighting of {len(body)} bytes")
    range_m = range_m if has_range else math.nan
    return Seen(bearing_rad, range_m, sd_rad, sd_m, scale_sd, score, kind, looks if signed else None)


@dataclass(frozen=True)
class LookReport:
    """A picture of the robot's own camera: what became of it, how many things it shows, and where it led."""

    status: int
    camera: int
    reason: int  # bslam_vision_reason_t
    count: int
    step: Step
    accounts: list[RawAccount]


def read_look_report(payload: bytes) -> LookReport:
    status, camera_index, reason, count = _LOOKED.unpack_from(payload)
    body = payload[_LOOKED.size :]
    return LookReport(status, camera_index, reason, count, read_step(body), read_accounts(body))


def read_accounts(body: bytes) -> list[RawAccount]:
    """The accounts that follow a step."""
    count = body[_STEP.size]
    records = body[_STEP.size + 1 :]
    if len(records) != count * _ACCOUNT.size:
        raise struct.error(f"{count} accounts in {len(records)} bytes")
    return [
        RawAccount(outcome, reason, bool(flags & 1), uid, ratio, weight)
        for outcome, reason, flags, uid, ratio, weight in _ACCOUNT.iter_unpack(records)
    ]


def read_value(body: bytes) -> float:
    """A parameter's value."""
    return float(_VALUE.unpack(body)[0])


def read_pose_at(body: bytes) -> tuple[int, tuple[float, float, float]]:
    """Status and pose."""
    status, x_m, y_m, theta_rad = _POSE_AT.unpack(body)
    return status, (x_m, y_m, theta_rad)


@dataclass(frozen=True)
class RawBeacon:
    """A beacon of the map in the library's numbers; covariance xx, xy, yy."""

    uid: int
    label: int
    kind: int
    confirmed: bool
    beacon_class: int
    sightings: int
    x_m: float
    y_m: float
    covariance: tuple[float, float, float]
    range_m: float
    phi_rad: float


def read_beacons(body: bytes) -> tuple[int, list[RawBeacon]]:
    """How many the map has in all, and this part of them."""
    total, count = body[0], body[1]
    records = body[2:]
    if len(records) != count * _BEACON.size:
        raise struct.error(f"{count} beacons in {len(records)} bytes")
    part = [
        RawBeacon(uid, label, kind, bool(flags & 1), group, seen, x, y, (xx, xy, yy), range_m, phi_rad)
        for uid, label, kind, flags, group, seen, x, y, xx, xy, yy, range_m, phi_rad in _BEACON.iter_unpack(
            records
        )
    ]
    return total, part


STATES = ("following", "doubting", "lost")
"""`bslam_recovery_state_t`."""
STARTS = (
    "what it knew is lost",
    "it is somewhere in the map that it kept",
    "it goes on with what it knew",
)
"""`session_start_t`."""
TROUBLES = ("none", "lost", "found", "corrupt", "insane", "restarted")
"""`watch_trouble_t`."""


def read_start(payload: bytes) -> str:
    """Of READY: what the robot has."""
    return STARTS[payload[1]]


@dataclass(frozen=True)
class Health:
    """What went wrong so far on a robot. trouble: the last one; a RESET begins `insane` anew."""

    recovers: bool
    guards: bool
    state: str
    trouble: str
    trouble_us: int
    contradicting: int
    withheld: int
    lost: int
    found: int
    corrupt: int
    restored: int
    insane: int


def read_health(body: bytes) -> Health:
    flags, state, trouble, *rest = _HEALTH.unpack(body)
    return Health(bool(flags & 1), bool(flags & 2), STATES[state], TROUBLES[trouble], *rest)


def read_map_part(body: bytes) -> tuple[int, bytes]:
    """Of MAP_READ: bytes of the whole map, and those that came."""
    return _PLACE.unpack_from(body)[0], body[_PLACE.size :]


def read_counters(body: bytes) -> list[int]:
    """All counters in a row: the library's, the parser's, messages repeated and replayed."""
    return [value for (value,) in struct.iter_unpack("<I", body)]
