"""MRPT's range-bearing EKF-SLAM, by a small program that is compiled against the installed library."""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.algorithms.noise import NO_GYRO, measured_motion, range_sd_m
from bslam.algorithms.protocol import Landmark, Setup, Sighting
from bslam.errors import BslamError
from bslam.motion import Pose, move_on_arc

_SOURCE: Final = Path(__file__).with_name("mrpt_ekf.cpp")
_INCLUDE: Final = Path("/usr/include")
_PARTS: Final = ("slam", "obs", "maps", "bayes", "poses", "math", "rtti", "system", "serialization", "core")


def prepare() -> Path:
    """The program, compiled now unless it is there already. Raises BslamError if it cannot be.

    Kept in the user's cache, under a name that holds what it was made of.
    """
    folders = [_INCLUDE / "eigen3", *sorted((_INCLUDE / "mrpt").glob("*/include"))]
    flags = ["-std=c++17", "-O2", *(f"-I{folder}" for folder in folders)]
    libraries = [f"-lmrpt-{part}" for part in _PARTS]
    digest = hashlib.sha256(_SOURCE.read_bytes() + repr((flags, libraries)).encode()).hexdigest()[:12]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "bslam"
    program = cache / f"mrpt_ekf_{digest}"
    if program.is_file():
        return program
    cache.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=cache) as folder:
        made = Path(folder) / "mrpt_ekf"
        command = [os.environ.get("CXX", "c++"), *flags, str(_SOURCE), "-o", str(made), *libraries]
        try:
            done = subprocess.run(command, capture_output=True, text=True)
        except FileNotFoundError:
            raise BslamError(f"mrpt: there is no {command[0]}; allowed: apt-get install g++") from None
        if done.returncode != 0:
            allowed = "allowed: what Debian's libmrpt-slam-dev 2.5 has"
            raise BslamError(
                f"mrpt: {_SOURCE} does not compile here; {allowed}; it said: {done.stderr[-500:]}"
            )
        os.replace(made, program)
    return program


class MrptEkf:
    """`CRangeBearingKFSLAM2D` in its fastest form, "Davison", the class behind MRPT's kf-slam.

    It has no model of inertia. It knows one sd for all distances, and is told that of a step's mean distance.
    Without identities it finds the nearest landmark in Mahalanobis' distance.
    """

    def __init__(self, setup: Setup) -> None:
        self._p, self._identities = setup.parameters, setup.identities
        if setup.observation != "distance":
            raise BslamError("mrpt: has no sightings without a distance; allowed: --observation distance")
        self._program: subprocess.Popen[str] | None = None

    def reset(self, seed: int) -> None:
        """See `Algorithm`. Nothing inside is random."""
        self._program = subprocess.Popen(
            [str(prepare())], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        p = self._p
        self._write([p["bearing_sd_rad"], p["mount_x_m"], p["mount_y_m"], p["mount_yaw_rad"]])
        self._time_us: int | None = None
        self._gyro = NO_GYRO
        self._move: list[float] = [0.0] * 10  # whether there is one, the move, its covariance
        self._seen: list[Sighting] = []
        self._pose: Pose = (0.0, 0.0, 0.0)
        self._covariance = np.zeros((3, 3))

    def gyro(self, time_us: int, rate_radps: float, sd_radps: float) -> None:
        """See `Gyroscopic`."""
        self._gyro = (rate_radps, sd_radps)

    def odometry(self, time_us: int, left_m: float, right_m: float) -> None:
        """See `Algorithm`."""
        assert self._time_us is not None
        p, dt_s = self._p, (time_us - self._time_us) * 1e-6
        (travelled_m, turn_rad), covariance = measured_motion(p, dt_s, left_m, right_m, *self._gyro)
        half_turn_m = 0.5 * turn_rad * p["wheelbase_m"]
        end = move_on_arc(
            (0.0, 0.0, 0.0), travelled_m - half_turn_m, travelled_m + half_turn_m, p["wheelbase_m"]
        )
        c, s = math.cos(0.5 * turn_rad), math.sin(0.5 * turn_rad)
        by_read = np.array([[c, -0.5 * travelled_m * s], [s, 0.5 * travelled_m * c], [0.0, 1.0]])
        spread = by_read @ covariance @ by_read.T
        self._move = [1.0, *end, *spread[np.triu_indices(3)].tolist()]
        self._time_us, self._gyro = time_us, NO_GYRO

    def observe(self, time_us: int, sightings: Sequence[Sighting]) -> None:
        """See `Algorithm`."""
        if self._time_us is None:
            self._time_us = time_us
        self._seen += [one for one in sightings if one.mappable and one.range_m is not None]

    def pose(self) -> Pose:
        """See `Algorithm`. Does the step."""
        ranges_m = [one.range_m for one in self._seen if one.range_m is not None]
        sd_m = float(range_sd_m(self._p, np.mean(ranges_m))) if ranges_m else 1.0
        rows = [(-1 if one.label is None else one.label, one.bearing_rad, one.range_m) for one in self._seen]
        answer = self._ask(["s", *self._move, sd_m, len(rows), *(value for row in rows for value in row)])
        self._move, self._seen = [0.0] * 10, []
        self._pose = (answer[0], answer[1], answer[2])
        self._covariance = np.array(answer[3:]).reshape(3, 3)
        return self._pose

    def pose_covariance(self) -> NDArray[np.float64]:
        """See `Algorithm`."""
        return self._covariance

    def map(self) -> Sequence[Landmark]:
        """See `Algorithm`. Ends the program."""
        _, *values = self._ask(["m"])
        self._end()
        labels, xs, ys = values[0::3], values[1::3], values[2::3]
        return [  # it numbers what nobody names
            Landmark(x_m, y_m, int(label) if self._identities else None)
            for label, x_m, y_m in zip(labels, xs, ys, strict=True)
        ]

    def _ask(self, words: Iterable[object]) -> list[float]:
        self._write(words)
        assert self._program is not None and self._program.stdout is not None
        answer = self._program.stdout.readline().split()
        if not answer:
            raise BslamError(f"mrpt: its program ended with {self._end()}")
        return [float(one) for one in answer]

    def _write(self, words: Iterable[object]) -> None:
        assert self._program is not None and self._program.stdin is not None
        try:
            self._program.stdin.write(" ".join(map(str, words)) + "\n")
            self._program.stdin.flush()
        except BrokenPipeError:
            raise BslamError(f"mrpt: its program ended with {self._end()}") from None

    def _end(self) -> int:
        assert self._program is not None
        with contextlib.suppress(BrokenPipeError):
            self._program.communicate()
        return self._program.wait()
