"""A film: what encoders and camera of an emulated board's robot measure. firmware/port/film.h plays it."""

from __future__ import annotations

import struct
from dataclasses import astuple
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.link.messages import CameraRecord

_MAGIC = 0x4D4C4946
_HEAD = struct.Struct("<4I")
_CAMERA = struct.Struct("<iii9fi")  # as bslam_camera_t has it
_STEP = np.dtype([("left_ticks", "<u2"), ("right_ticks", "<u2"), ("picture", "<u4"), ("gyro_radps", "<f4")])
_NO_CAMERA = bytes(_CAMERA.size)


def write_film(
    path: Path,
    step_us: int,
    ticks: NDArray[np.int64],
    camera: CameraRecord | None = None,
    pictures: NDArray[np.uint16] | None = None,
    picture_every: int = 1,
    gyro_radps: NDArray[np.float64] | None = None,
) -> None:
    """Write a film that goes round and round: let it end where it begins.

    ticks (k, 2): how far left and right encoder turn at each reading, step_us apart. pictures (m, height,
    width) RGB565: what `camera` takes at the first reading and every `picture_every` readings, m times.
    gyro_radps (k,): what a gyro tells of each reading's interval; None: there is none.
    """
    steps = np.zeros(len(ticks), _STEP)
    steps["left_ticks"], steps["right_ticks"] = (ticks % (1 << 16)).T
    frames = np.empty(0, "<u2") if pictures is None else pictures.astype("<u2")
    steps["picture"][: len(frames) * picture_every : picture_every] = np.arange(1, len(frames) + 1)
    steps["gyro_radps"] = np.nan if gyro_radps is None else gyro_radps
    head = _HEAD.pack(_MAGIC, step_us, len(steps), len(frames))
    lens = _NO_CAMERA if camera is None else _CAMERA.pack(*astuple(camera))
    path.write_bytes(head + lens + steps.tobytes() + frames.tobytes())
