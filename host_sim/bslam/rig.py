"""The cameras on a robot: their lenses, where they sit, and in which order they take pictures.

Pixel (0, 0) is the upper left one, its centre at (0, 0), as in OpenCV. Axes of a camera before its pitch: x
forward, y left, z up. Errors name the file, the key, the value and what is allowed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from bslam.errors import BslamError
from bslam.parsing.settings import (
    ANY,
    POSITIVE,
    Rule,
    check_keys,
    find_toml,
    integer,
    load_toml,
    number,
    one_of,
    parse_table,
    setting,
    toml_names,
)

LENS_KINDS = ("pinhole", "equidistant")
SIDE_PX_MAX = 2048
_FOLDER = Path(__file__).resolve().parent / "rigs"

_PITCH_RAD = Rule("between -1.2 and 1.2 (positive looks down)", float, lambda value: -1.2 <= value <= 1.2)


@dataclass(frozen=True)
class Lens:
    """How directions become pixels; every field is checked when a Lens is made (BslamError).

    With x, y, z the direction in the camera's frame (pitch included):
    "pinhole": m = (-y/x, -z/x), r = |m|; pixel = c + f m (1 + k1 r^2 + k2 r^4).
    "equidistant": theta = angle to the x axis, m = theta (-y, -z)/|(y, z)|; pixel = c + f m (1 + k1 theta^2 +
    k2 theta^4). Its picture is black beyond theta = 90 degrees.
    """

    kind: str = setting(one_of(*LENS_KINDS))
    width_px: int = setting(integer(16, SIDE_PX_MAX))
    height_px: int = setting(integer(16, SIDE_PX_MAX))
    fx_px: float = setting(POSITIVE)
    fy_px: float = setting(POSITIVE)
    cx_px: float = setting(ANY)
    cy_px: float = setting(ANY)
    k1: float = setting(number(-1.0, 1.0), 0.0)
    k2: float = setting(number(-1.0, 1.0), 0.0)

    def __post_init__(self) -> None:
        _check_fields(self, "lens")


@dataclass(frozen=True)
class Camera:
    """A lens and its place on the robot; pitch_rad positive looks down. Checked when made (BslamError).

    zoom: the front end looks at a pixel as so many, across and down (bslam_camera_t).
    """

    lens: Lens
    x_m: float = setting(ANY, 0.0)
    y_m: float = setting(ANY, 0.0)
    z_m: float = setting(POSITIVE, 0.5)
    yaw_rad: float = setting(number(-math.pi, math.pi), 0.0)
    pitch_rad: float = setting(_PITCH_RAD, 0.0)
    zoom: int = setting(integer(1, 2), 1)

    def __post_init__(self) -> None:
        _check_fields(self, "camera")


@dataclass(frozen=True)
class Pan:
    """A unit that turns the cameras about the vertical: how far to each side, and how fast."""

    reach_rad: float = setting(number(0.0, math.pi))
    speed_radps: float = setting(POSITIVE)

    def step(self, angle_rad: float, wanted_rad: float, seconds: float) -> float:
        """The angle after `seconds` on the way from angle_rad to wanted_rad, kept within reach."""
        goal_rad = max(-self.reach_rad, min(self.reach_rad, wanted_rad))
        most_rad = self.speed_radps * seconds
        return angle_rad + max(-most_rad, min(most_rad, goal_rad - angle_rad))

    def sweep(self, time_s: float) -> float:
        """The angle at a time when nothing is sought: to and fro over the reach, from the middle at 0."""
        phase = self.speed_radps * time_s / self.reach_rad if self.reach_rad > 0.0 else 0.0
        turn = math.fmod(phase + 1.0, 4.0)
        return self.reach_rad * (turn - 1.0 if turn <= 2.0 else 3.0 - turn)


@dataclass(frozen=True)
class Rig:
    """Cameras that take pictures in turn, one frame a step."""

    name: str
    cameras: tuple[Camera, ...]
    pan: Pan | None


def _check_fields(table: Any, where: str) -> None:
    """Every field against the rule it was made with."""
    for one in fields(table):
        if "rule" in one.metadata:
            one.metadata["rule"].convert(getattr(table, one.name), f"{where}, {one.name}")


@dataclass(frozen=True)
class _CameraTable:
    """A camera of a rig file: a lens that all share, and its own place."""

    x_m: float = setting(ANY, 0.0)
    y_m: float = setting(ANY, 0.0)
    z_m: float = setting(POSITIVE, 0.5)
    yaw_deg: float = setting(number(-180.0, 180.0), 0.0)
    pitch_deg: float = setting(number(-68.0, 68.0), 0.0)
    zoom: int = setting(integer(1, 2), 1)


@dataclass(frozen=True)
class _PanTable:
    reach_deg: float = setting(number(0.0, 180.0))
    speed_deg_per_s: float = setting(POSITIVE)


def rig_names() -> list[str]:
    """Names of the rigs that come with the package."""
    return toml_names(_FOLDER)


def load_rig(name_or_path: str | Path) -> Rig:
    """A rig by its name or from a path that ends in .toml; BslamError if it is missing or wrong."""
    path = find_toml("rig", name_or_path, _FOLDER)
    return _parse_rig(load_toml(path), path)


def _parse_rig(document: Mapping[str, Any], path: Path) -> Rig:
    check_keys(document, {"lens": Lens, "cameras": _CameraTable, "pan": _PanTable}, str(path))
    lens = parse_table(Lens, _table(document, "lens", path), f"{path}, [lens]")
    tables = document.get("cameras")
    if not isinstance(tables, list) or not tables or not all(isinstance(one, dict) for one in tables):
        raise BslamError(f"{path}, key cameras: {tables!r} is not allowed; allowed: tables, at least one")
    places = [parse_table(_CameraTable, one, f"{path}, cameras[{index}]") for index, one in enumerate(tables)]
    pan = None
    if "pan" in document:
        table = parse_table(_PanTable, _table(document, "pan", path), f"{path}, [pan]")
        pan = Pan(math.radians(table.reach_deg), math.radians(table.speed_deg_per_s))
    return Rig(path.stem, tuple(_camera(lens, place) for place in places), pan)


def _table(document: Mapping[str, Any], key: str, path: Path) -> Mapping[str, Any]:
    table = document.get(key)
    if not isinstance(table, dict):
        raise BslamError(f"{path}, key {key}: {table!r} is not allowed; allowed: a table [{key}]")
    return table


def _camera(lens: Lens, place: _CameraTable) -> Camera:
    yaw_rad, pitch_rad = math.radians(place.yaw_deg), math.radians(place.pitch_deg)
    return Camera(lens, place.x_m, place.y_m, place.z_m, yaw_rad, pitch_rad, place.zoom)
