"""Frames to look at: of a simulated drive, a folder of pictures, a video."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bslam.datasets.pictures import SUFFIXES, camera_for, load_picture, scale_picture
from bslam.errors import BslamError, pip_install
from bslam.rig import Camera, Rig
from bslam.world.scenario import Scenario
from bslam.world.simulate import true_drive

try:
    import cv2
except ImportError:  # an extra
    cv2 = None  # type: ignore[assignment]

VIDEOS: Final = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".mjpeg", ".mpg")
_LEARNING_US: Final = 200_000  # between frames that are looked at, shown or not: the room is learned from all


@dataclass(frozen=True)
class Shot:
    """A frame for one of the source's cameras. Those not shown are there for the front end to learn from."""

    name: str
    rgb: NDArray[np.uint8]  # (h, w, 3)
    camera: int
    moved: bool
    shown: bool
    identity: NDArray[np.int16] | None = None  # of a simulated frame: the beacon that a pixel shows


@dataclass(frozen=True)
class Source:
    """Where frames come from: its cameras, and what of what is measured cannot be trusted."""

    cameras: tuple[Camera, ...]
    shots: Iterator[Shot]
    caution: str = ""


def simulated(scenario: Scenario, seed: int, rig: Rig, frames: int, every_s: float) -> Source:
    """A drive through the scenario, the cameras in turn; a frame is shown `every_s` seconds.

    BslamError if the drive is shorter than that.
    """
    duration_s = scenario.steps * scenario.step_us * 1e-6
    if duration_s < every_s:
        raise BslamError(f"{scenario.name}: lasts {duration_s:g} s; allowed: an --every up to that")
    return Source(rig.cameras, _drive_shots(scenario, seed, rig, frames, every_s))


def _drive_shots(scenario: Scenario, seed: int, rig: Rig, frames: int, every_s: float) -> Iterator[Shot]:
    from bslam.world.camera import Renderer, dress  # here: most commands need no ray caster

    path = true_drive(scenario, seed)
    scene = dress(scenario, seed)
    renderers = [Renderer(scene, camera, [seed, index]) for index, camera in enumerate(rig.cameras)]
    stride = max(1, _LEARNING_US // scenario.step_us)
    poses = np.stack([path.x_m, path.y_m, path.theta_rad], axis=1)[::stride].tolist()
    between = max(1, round(every_s * 1e6 / (stride * scenario.step_us)))
    last: dict[int, list[float]] = {}
    for index, pose in enumerate(poses[: frames * between]):
        camera = index % len(rig.cameras)
        time_s = index * stride * scenario.step_us * 1e-6
        others_m = path.others_m[index * stride]
        picture = renderers[camera].render((pose[0], pose[1], pose[2]), time_s, movers_m=others_m)
        moved = last.get(camera) != pose
        last[camera] = pose
        shown = index % between == between - 1
        yield Shot(f"{time_s:.1f} s, camera {camera}", picture.rgb, camera, moved, shown, picture.identity)


def folder(path: Path, rig: Rig | None) -> Source:
    """The pictures of a folder in the order of their names, taken for one room: looked at twice, shown then.

    `rig`: its first camera took them; without one a stand-in, 60 degrees wide. BslamError if there is none,
    one cannot be read, or their sizes differ from the camera's or from each other.
    """
    paths = sorted(one for one in path.iterdir() if one.suffix.lower() in SUFFIXES)
    if not paths:
        raise BslamError(f"{path}: no picture in it; allowed: files named {', '.join(SUFFIXES)}")
    camera = _camera_of(rig)
    if camera is None:
        camera = camera_for(*load_picture(paths[0]).size_px)
    return Source((camera,), _picture_shots(paths, camera), _caution(rig))


def _picture_shots(paths: list[Path], camera: Camera) -> Iterator[Shot]:
    for shown in (False, True):
        for path in paths:
            yield Shot(path.stem, load_picture(path, camera).rgb, 0, True, shown)


def video(path: Path, rig: Rig | None, frames: int, every_s: float) -> Source:
    """A video file; a frame is shown `every_s` seconds.

    BslamError if it cannot be read, or OpenCV is missing.
    """
    if cv2 is None:
        raise BslamError(
            f"{path}: a video needs OpenCV; allowed: {pip_install('opencv-python-headless')}, or pictures"
        )
    reader = cv2.VideoCapture(str(path))
    good, first = reader.read()
    if not good:
        raise BslamError(f"{path}: cannot be read as a video; allowed: a file that OpenCV reads")
    rate_hz = reader.get(cv2.CAP_PROP_FPS) or 25.0
    camera = _camera_of(rig) or camera_for(*scale_picture(_as_picture(first), str(path)).size_px)
    return Source((camera,), _video_shots(path, camera, rate_hz, frames, every_s), _caution(rig))


def _video_shots(path: Path, camera: Camera, rate_hz: float, frames: int, every_s: float) -> Iterator[Shot]:
    reader = cv2.VideoCapture(str(path))
    stride = max(1, round(rate_hz * _LEARNING_US * 1e-6))
    between = max(1, round(every_s * rate_hz / stride))
    for index in range(frames * between * stride):
        if not reader.grab():
            return
        if index % stride == 0:
            rgb = scale_picture(_as_picture(reader.retrieve()[1]), str(path), camera).rgb
            shown = (index // stride) % between == between - 1
            yield Shot(f"{index / rate_hz:.1f} s", rgb, 0, True, shown)


def _as_picture(bgr: NDArray[Any]) -> Image.Image:
    return Image.fromarray(np.ascontiguousarray(bgr[:, :, ::-1], dtype=np.uint8))


def _camera_of(rig: Rig | None) -> Camera | None:
    return None if rig is None else rig.cameras[0]


def _caution(rig: Rig | None) -> str:
    if rig is not None:
        return ""
    return "no --rig: directions and distances are those of a camera 60 degrees wide, 0.5 m above the floor"
