"""The DLR Spatial Cognition data set as a log: 505 m through an office floor, circles on the ground.

Kurlbaum, Frese, 2009. `map.circles` (or .gz) holds steps of odometry, each followed by the circles that were
seen after it; `LS_result_*.mat` is the global least-squares solution, the only reference there is. The file's
robot looks along -Y with X to its right, so its angles grow clockwise; here x is forward and y left. It has
no times: a step counts as half a second, at which 505 m take half an hour.
"""

from __future__ import annotations

import gzip
import math
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.log import Beacons, Log, Odometry, Robot, Sightings, Truth, wrap_rad

STEP_US: Final = 500_000
_MAP: Final = ("map.circles", "map.circles.gz")
_SOLUTION: Final = "LS_result_*.mat"
_STEP_FIELDS, _LANDMARK_FIELDS = 11, 8  # at least, with the first word
_POSE, _LANDMARK = 1, 2  # kinds of rows in the solution

# Its wheelbase plays no part: noise is of the way and the turn. The sightings carry their own.
ROBOT: Final = Robot(
    wheelbase_m=0.5,
    wheel_speed_sigma_mps=0.0,
    step_us=STEP_US // 3,
    field_of_view_rad=math.pi,
    bearing_sigma_rad=0.02,
    range_sigma_fraction=0.02,
    range_sigma_scale_m=math.inf,
    range_sigma_floor_m=0.04,
    wheel_noise="actuation",
    # What the file says of each step's noise, as it grows with travel. Sightings err by up to many times what
    # it says, and a gate refuses too many of them.
    settings=(("forward_sd_per_sqrt_m", 0.0095), ("turn_sd_per_sqrt_m", 0.041), ("gate_d2", 0)),
)


def load_dlr(directory: Path | str) -> Log:
    """The log; truth and beacons are the least-squares solution, where it is there.

    Raises BslamError that names the file, the line, and what is allowed.
    """
    folder = Path(directory)
    path = _find_map(folder)
    steps, seen = _read_map(path)
    truth, beacons = _read_solution(folder, len(steps))
    return Log(
        name=folder.resolve().name,
        odometry=_odometry(np.array(steps)),
        sightings=_sightings(seen),
        truth=truth,
        beacons=beacons,
        robot=ROBOT,
    )


def _find_map(folder: Path) -> Path:
    for name in _MAP:
        if (folder / name).is_file():
            return folder / name
    raise BslamError(f"{folder}: no DLR data set; allowed: a folder with {' or '.join(_MAP)}")


def _open(path: Path) -> IO[str]:
    if path.suffix == ".gz":
        return gzip.open(path, "rt", encoding="utf-8", errors="replace")
    return path.open(encoding="utf-8", errors="replace")


def _read_map(path: Path) -> tuple[list[list[float]], list[list[float]]]:
    """Steps (dX, dY, dPhi), and sightings (step, pX, pY, cXX, cXY, cYY, identity)."""
    steps: list[list[float]] = []
    seen: list[list[float]] = []
    try:
        with _open(path) as file:
            for number, line in enumerate(file, start=1):
                words = line.split("#")[0].split()
                if words:
                    _read_line(words, steps, seen, f"{path}, line {number}: {line.strip()!r}")
    except (OSError, EOFError) as error:
        raise BslamError(f"{path}: cannot be read: {error}; allowed: text, plain or gzipped") from error
    if not steps:
        raise BslamError(f"{path}: holds no STEP; allowed: at least one")
    return steps, seen


def _read_line(words: list[str], steps: list[list[float]], seen: list[list[float]], where: str) -> None:
    try:
        if words[0] == "STEP" and len(words) >= _STEP_FIELDS:
            steps.append(_finite(words[2:5]))
            return
        if words[0].startswith("LANDMARK") and len(words) >= _LANDMARK_FIELDS and steps:
            x, y, _, cxx, cxy, cyy, identity = _finite(words[1:8])
            seen.append([len(steps), x, y, cxx, cxy, cyy, identity])
            return
    except ValueError:
        pass
    raise BslamError(
        f"{where}; allowed: STEP with an image and 9 numbers, or LANDMARK after one with 7 and up"
    )


def _finite(words: list[str]) -> list[float]:
    values = [float(word) for word in words]
    if not all(map(math.isfinite, values)):
        raise ValueError
    return values


def _odometry(steps: NDArray[np.float64]) -> Odometry:
    """Each step as a turn, a straight way and a turn: it may also go sideways, which no single arc does."""
    ahead_m, left_m, turn_rad = -steps[:, 1], -steps[:, 0], -steps[:, 2]
    back = np.where(ahead_m < 0.0, -1.0, 1.0)
    travelled_m = back * np.hypot(ahead_m, left_m)
    first_rad = np.arctan2(back * left_m, back * ahead_m)
    half_base_m = 0.5 * ROBOT.wheelbase_m
    turns_m = half_base_m * np.column_stack([first_rad, np.zeros(len(steps)), turn_rad - first_rad])
    ways_m = np.column_stack([np.zeros(len(steps)), travelled_m, np.zeros(len(steps))])
    end_us = STEP_US * np.arange(1, len(steps) + 1, dtype=np.int64)
    time_us = end_us[:, np.newaxis] - np.array([2, 1, 0]) * (STEP_US // 3)
    return Odometry("wheels", time_us.ravel(), (ways_m - turns_m).ravel(), (ways_m + turns_m).ravel())


def _sightings(rows: list[list[float]]) -> Sightings:
    """Directions and distances with the noise of each; a circle without identity is something else."""
    step, x, y, cxx, cxy, cyy, identity = np.array(rows, dtype=np.float64).reshape(-1, 7).T
    forward, left = -y, -x
    range_m = np.hypot(forward, left)
    ux, uy = x / range_m, y / range_m
    along = cxx * ux**2 + 2.0 * cxy * ux * uy + cyy * uy**2
    across = cxx * uy**2 - 2.0 * cxy * ux * uy + cyy * ux**2
    return Sightings(
        time_us=STEP_US * step.astype(np.int64),
        beacon_id=identity.astype(np.int64),
        bearing_rad=np.arctan2(left, forward),
        range_m=range_m,
        mappable=identity >= 0,
        bearing_sd_rad=np.sqrt(across) / range_m,
        range_sd_m=np.sqrt(along),
    )


def _read_solution(folder: Path, steps: int) -> tuple[Truth | None, Beacons | None]:
    """The least-squares poses at the steps' ends, and the landmarks; None if it is not there."""
    found = sorted(folder.glob(_SOLUTION))
    if not found:
        return None, None
    from scipy.io import loadmat  # only here is a file of MATLAB's read

    try:
        table: Any = loadmat(found[0])["Xstate_LS"]
        value, kind, index = np.asarray(table, dtype=np.float64).T
        poses = value[kind == _POSE].reshape(-1, 3)[:steps]
        landmarks, identity = value[kind == _LANDMARK].reshape(-1, 2), index[kind == _LANDMARK][::2]
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise BslamError(f"{found[0]}: {error}; allowed: Xstate_LS, rows of value, kind, index") from error
    time_us = STEP_US * np.arange(len(poses) + 1, dtype=np.int64)
    whole = np.concatenate([np.zeros((1, 3)), poses])
    truth = Truth(time_us, -whole[:, 1], -whole[:, 0], wrap_rad(-whole[:, 2]))
    return truth, Beacons(identity.astype(np.int64), -landmarks[:, 1], -landmarks[:, 0])
