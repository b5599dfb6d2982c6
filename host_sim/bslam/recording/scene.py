"""What viewers draw: poses and beacons in the messages that Foxglove defines, for which it has panels."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bslam.core.slam import Beacon
from bslam.recording.entries import Json, Pose

FRAME = "map"
"""The name of the frame whose origin is the start pose."""
POSE_SCHEMA = "foxglove.PoseInFrame"
SCENE_SCHEMA = "foxglove.SceneUpdate"
SIGMAS = 2.4477
"""An ellipse of so many standard deviations holds a beacon with 95 %."""
_LEAST_SIZE_M = 0.05
_HEIGHT_M = 0.5
_CONFIRMED = {"r": 0.1, "g": 0.45, "b": 0.85, "a": 0.7}
_TENTATIVE = {"r": 0.6, "g": 0.6, "b": 0.6, "a": 0.5}
_WHITE = {"r": 1.0, "g": 1.0, "b": 1.0, "a": 1.0}
_NOTHING: dict[str, list[Any]] = {
    name: [] for name in ("metadata", "arrows", "cubes", "spheres", "lines", "triangles", "models")
}


def pose_in_frame(log_ns: int, pose: Pose) -> Json:
    """foxglove.PoseInFrame; it has no word for a heading that nobody knows, which is drawn as 0."""
    x_m, y_m, theta_rad = pose
    heading_rad = 0.0 if math.isnan(theta_rad) else theta_rad
    return {"timestamp": _time(log_ns), "frame_id": FRAME, "pose": _pose(x_m, y_m, 0.0, heading_rad)}


def map_scene(log_ns: int, beacons: list[Beacon]) -> Json:
    """foxglove.SceneUpdate that replaces the scene: a beacon is a cylinder as wide as its place is unsure."""
    everything = {"timestamp": _time(log_ns), "type": 1, "id": ""}
    return {"deletions": [everything], "entities": [_entity(log_ns, one) for one in beacons]}


def _entity(log_ns: int, beacon: Beacon) -> Json:
    variance, axes = np.linalg.eigh(beacon.covariance_m2)
    sd_m = np.sqrt(np.maximum(variance, 0.0))
    width_m = [max(2.0 * SIGMAS * float(one), _LEAST_SIZE_M) for one in sd_m]
    direction_rad = math.atan2(axes[1, 0], axes[0, 0])
    cylinder = {
        "pose": _pose(beacon.x_m, beacon.y_m, 0.5 * _HEIGHT_M, direction_rad),
        "size": {"x": width_m[0], "y": width_m[1], "z": _HEIGHT_M},
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": _CONFIRMED if beacon.confirmed else _TENTATIVE,
    }
    text = {
        "pose": _pose(beacon.x_m, beacon.y_m, 1.3 * _HEIGHT_M, 0.0),
        "billboard": True,
        "font_size": 14.0,
        "scale_invariant": True,
        "color": _WHITE,
        "text": str(beacon.label if beacon.label >= 0 else beacon.uid),
    }
    words: Json = {"timestamp": _time(log_ns), "frame_id": FRAME, "id": str(beacon.uid)}
    words |= {"lifetime": {"sec": 0, "nsec": 0}, "frame_locked": False}
    return {**words, **_NOTHING, "cylinders": [cylinder], "texts": [text]}


def _time(log_ns: int) -> Json:
    return {"sec": log_ns // 1_000_000_000, "nsec": log_ns % 1_000_000_000}


def _pose(x_m: float, y_m: float, z_m: float, yaw_rad: float) -> Json:
    half = 0.5 * yaw_rad
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}
    return {"position": {"x": x_m, "y": y_m, "z": z_m}, "orientation": turn}
