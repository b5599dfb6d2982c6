"""What a recording is made of, and each entry as JSON. Numbers come back as they were, to the last bit.

An input (Reading, Frame, Call) is followed by the State that it led to. Frame of all poses: the map's, whose
origin is the start pose. Times are the robot's own, in us.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.appearance import SIGNATURE_SIZE
from bslam.core.slam import Account, Beacon
from bslam.log import ODOMETRY_COLUMNS, SIGHTING_NUMBERS

Json = dict[str, Any]
Pose = tuple[float, float, float]
"""x_m, y_m, theta_rad."""
Argument = int | float | bytes
"""Of a call; bytes, which a kept map is, stand in the file as base64."""


@dataclass(frozen=True)
class Start:
    """The robot at the start of the recording: at the origin of an empty map, or anywhere in a kept one."""

    name: str
    params: dict[str, int | float]  # all of them
    beacons_max: int  # the map has room for
    seeds: NDArray[np.float32] | None = None  # (k, 71) signatures of what is no beacon
    robot: str | None = None  # the text of robot.toml, where the log has one
    true_beacons: tuple[tuple[int, float, float], ...] = ()  # beacon_id, x_m, y_m, where somebody knows them
    words: tuple[str, ...] = ()  # what a beacon_id stands for where identities are words
    real: str = "float"  # the core's scalar type
    kept_map: str | None = None  # the map that it starts in, in base64; None: an empty one
    frozen: bool = False  # that map stays as it is
    about: Json = field(default_factory=dict)  # of the target: image, build


@dataclass(frozen=True)
class Reading:
    """Odometry: the arguments of `Slam.odometry`. refused: the status of a core that did not take it."""

    kind: str
    time_us: int
    a: int | float
    b: int | float
    gyro_radps: float | None = None
    gyro_sd_radps: float = 0.0
    refused: str | None = None


@dataclass(frozen=True)
class Frame:
    """What one image shows: the arguments of `Slam.sightings`, and what became of each sighting."""

    time_us: int
    bearing_rad: list[float]
    range_m: list[float]  # NaN: none
    label: list[int]
    mappable: list[bool]
    bearing_sd_rad: list[float] | None = None
    range_sd_m: list[float] | None = None
    range_scale_sd: list[float] | None = None
    signature: NDArray[np.float32] | None = None  # (m, 71)
    beacon_class: list[int] | None = None
    score: list[float] | None = None
    true_id: list[int] | None = None  # beacon_id of each, -1: of none; None: nobody knows
    accounts: list[Account] | None = None  # None: the frame was refused
    refused: str | None = None


@dataclass(frozen=True)
class Call:
    """Another input: the name of a method of `Slam` and its arguments."""

    name: str
    arguments: tuple[Argument, ...]
    refused: str | None = None
    words: dict[str, bool] = field(default_factory=dict)  # arguments by name


@dataclass(frozen=True)
class State:
    """Where the robot stands now. fingerprint: of all states so far, chained."""

    time_us: int
    pose: Pose
    covariance: tuple[float, ...]  # xx, yx, yy, tx, ty, tt in m2, m rad, rad2
    fingerprint: int | None = None


@dataclass(frozen=True)
class Map:
    """All beacons as they stand now."""

    beacons: list[Beacon]


@dataclass(frozen=True)
class Counters:
    """The core's own counters, by name."""

    counts: dict[str, int]


@dataclass(frozen=True)
class TruePose:
    """Where the robot really was, where somebody knows it; heading NaN: not known."""

    time_us: int
    pose: Pose


@dataclass(frozen=True)
class Gap:
    """So many reports of the robot's own inputs were lost on the line: from here on no replay is exact."""

    lost: int


Entry = Start | Reading | Frame | Call | State | Map | Counters | TruePose | Gap

# ---- to JSON and back --------------------------------------------------------------------------------------


def _start_to(one: Start) -> Json:
    return asdict(one) | {"seeds": _text(one.seeds)}


def _start_from(content: Json) -> Start:
    true_beacons = tuple((int(i), float(x), float(y)) for i, x, y in content["true_beacons"])
    seeds, words = _signatures(content["seeds"]), tuple(content.get("words", ()))
    return Start(**content | {"seeds": seeds, "true_beacons": true_beacons, "words": words})


def _reading_to(one: Reading) -> Json:
    a_name, b_name = ODOMETRY_COLUMNS[one.kind]
    words = {"time_us": one.time_us, "kind": one.kind, a_name: one.a, b_name: one.b}
    gyro = {"gyro_radps": one.gyro_radps, "gyro_sd_radps": one.gyro_sd_radps}
    return words | gyro | {"refused": one.refused}


def _reading_from(content: Json) -> Reading:
    a, b = (content[name] for name in ODOMETRY_COLUMNS[content["kind"]])
    gyro = (content["gyro_radps"], content["gyro_sd_radps"])
    return Reading(content["kind"], content["time_us"], a, b, *gyro, content["refused"])


def _frame_to(one: Frame) -> Json:
    rows: list[Json] = []
    for i, bearing_rad in enumerate(one.bearing_rad):
        row: Json = {"bearing_rad": bearing_rad, "range_m": _number_or_none(one.range_m[i])}
        row |= {"label": one.label[i], "mappable": bool(one.mappable[i])}
        for name in SIGHTING_NUMBERS:
            told = getattr(one, name)
            row |= {} if told is None else {name: told[i]}
        if one.true_id is not None:
            row["true_id"] = one.true_id[i]
        if one.signature is not None:
            row["signature"] = _text(one.signature[i])
        if one.beacon_class is not None:
            row["beacon_class"] = one.beacon_class[i]
        if one.accounts is not None:
            row["account"] = asdict(one.accounts[i])
        rows.append(row)
    numbers = [name for name in SIGHTING_NUMBERS if getattr(one, name) is not None]
    words = {"signed": one.signature is not None, "numbers": numbers}
    return {"time_us": one.time_us, "refused": one.refused, **words, "sightings": rows}


def _frame_from(content: Json) -> Frame:
    rows = content["sightings"]
    range_m = [math.nan if row["range_m"] is None else row["range_m"] for row in rows]
    identified, classed = (bool(rows) and name in rows[0] for name in ("true_id", "beacon_class"))
    return Frame(
        content["time_us"],
        _column(rows, "bearing_rad"),
        range_m,
        _column(rows, "label"),
        _column(rows, "mappable"),
        signature=_stacked(_column(rows, "signature")) if content["signed"] else None,
        beacon_class=_column(rows, "beacon_class") if classed else None,
        true_id=_column(rows, "true_id") if identified else None,
        accounts=None if content["refused"] else [Account(**one) for one in _column(rows, "account")],
        refused=content["refused"],
        **{name: _column(rows, name) for name in content["numbers"]},
    )


def _column(rows: list[Json], name: str) -> list[Any]:
    return [row[name] for row in rows]


def _call_to(one: Call) -> Json:
    arguments = [base64.b64encode(a).decode() if isinstance(a, bytes) else a for a in one.arguments]
    return {"name": one.name, "arguments": arguments, "refused": one.refused, "words": one.words}


def _call_from(content: Json) -> Call:
    arguments = tuple(base64.b64decode(a) if isinstance(a, str) else a for a in content["arguments"])
    return Call(content["name"], arguments, content["refused"], content.get("words", {}))


def _state_to(one: State) -> Json:
    x_m, y_m, theta_rad = one.pose
    chain = None if one.fingerprint is None else f"{one.fingerprint:016x}"
    pose = {"x_m": x_m, "y_m": y_m, "theta_rad": theta_rad}
    return {"time_us": one.time_us, **pose, "covariance": list(one.covariance), "fingerprint": chain}


def _state_from(content: Json) -> State:
    chain = None if content["fingerprint"] is None else int(content["fingerprint"], 16)
    return State(content["time_us"], _pose(content), tuple(content["covariance"]), chain)


def _map_to(one: Map) -> Json:
    rows = []
    for beacon in one.beacons:
        words = dict(vars(beacon))
        rows.append(words | {"covariance": words.pop("covariance_m2").tolist()})
    return {"beacons": rows}


def _map_from(content: Json) -> Map:
    rows = [dict(row) for row in content["beacons"]]
    return Map([Beacon(covariance_m2=np.array(row.pop("covariance")), **row) for row in rows])


def _true_pose_to(one: TruePose) -> Json:
    x_m, y_m, theta_rad = one.pose
    return {"time_us": one.time_us, "x_m": x_m, "y_m": y_m, "theta_rad": _number_or_none(theta_rad)}


def _true_pose_from(content: Json) -> TruePose:
    x_m, y_m, theta_rad = _pose(content)
    return TruePose(content["time_us"], (x_m, y_m, math.nan if theta_rad is None else theta_rad))


def _pose(content: Json) -> Pose:
    return content["x_m"], content["y_m"], content["theta_rad"]


def _text(values: NDArray[np.float32] | None) -> str | None:
    return None if values is None else base64.b64encode(values.astype("<f4").tobytes()).decode()


def _signatures(text: str | None) -> NDArray[np.float32] | None:
    if text is None:
        return None
    return np.frombuffer(base64.b64decode(text), "<f4").astype(np.float32).reshape(-1, SIGNATURE_SIZE)


def _stacked(texts: list[str]) -> NDArray[np.float32]:
    made = np.empty((len(texts), SIGNATURE_SIZE), np.float32)
    for i, text in enumerate(texts):
        made[i] = _signatures(text)
    return made


def _number_or_none(value: float) -> float | None:
    return None if math.isnan(value) else value


@dataclass(frozen=True)
class Format:
    """How a kind of entry stands in the file."""

    topic: str
    schema: str
    write: Callable[[Any], Json]
    read: Callable[[Json], Entry]


FORMATS: dict[type, Format] = {
    Start: Format("/start", "bslam.Start", _start_to, _start_from),
    Reading: Format("/odometry", "bslam.Odometry", _reading_to, _reading_from),
    Frame: Format("/sightings", "bslam.Sightings", _frame_to, _frame_from),
    Call: Format("/call", "bslam.Call", _call_to, _call_from),
    State: Format("/state", "bslam.State", _state_to, _state_from),
    Map: Format("/map", "bslam.Map", _map_to, _map_from),
    Counters: Format("/counters", "bslam.Counters", lambda one: one.counts, Counters),
    TruePose: Format("/truth", "bslam.TruePose", _true_pose_to, _true_pose_from),
    Gap: Format("/gap", "bslam.Gap", asdict, lambda content: Gap(**content)),
}
