"""The UTIAS Multi-Robot Cooperative Localization and Mapping data set (MRCLAM) as logs.

Leung, Halpern, Barfoot, Liu, IJRR 30(8):969-974, 2011. Five two-wheeled robots, each with a camera that reads
the barcodes on 15 landmarks (subjects 6-20) and on the other robots (subjects 1-5). The files have traps;
each is dealt with where its file is read.
"""

from __future__ import annotations

import gzip
import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.log import Beacons, Log, Odometry, Robot, Sightings, Truth, wrap_rad
from bslam.parsing.csvtable import began_at, rows_text

ROBOTS: Final = 5
# Odometry is resampled to the frame rate of the paper: raw rows come every 10 ms, at times twice, at times
# not for 1.4 s.
STEP_US: Final = 40_000
# Best first: complete; the whole drive with times rebuilt from rounded ones; moments of rest with gaps of
# minutes.
_TRUTHS: Final = (("full", ""), ("rebuilt", "_rebuilt"), ("sparse", "_sparse"))
# Landmarks 11 and 17 as the original file of set 1 has them: their names are swapped there.
_SWAPPED: Final = {11: (3.15071999, 2.38294871), 17: (0.03596156, -2.84396626)}

# The base of these robots; the widest view in the recordings; the scatter about the truth: range sd 0.02 m +
# 0.035 r. An image's stamp is 20 to 40 ms late.
ROBOT: Final = Robot(
    wheelbase_m=0.258,
    wheel_speed_sigma_mps=0.0,  # odometry is a command: preset "commanded"
    step_us=STEP_US,
    field_of_view_rad=1.18,
    bearing_sigma_rad=0.02,
    range_sigma_fraction=0.035,
    range_sigma_scale_m=math.inf,
    range_sigma_floor_m=0.02,
    sighting_delay_us=30_000,
)


@dataclass(frozen=True)
class _Table:
    """Rows of numbers of one file."""

    path: Path
    rows: NDArray[np.float64]  # (n, columns)
    left_out: int = 0  # rows at the start

    def begun(self, notes: list[str]) -> _Table:
        """Without rows at the start that time then runs back over."""
        first = began_at(self.rows[:, 0])
        if first:
            back = f"time runs back to {self.rows[first, 0]:.3f} in data row {first + 1}"
            notes.append(f"{self.path}: left out {rows_text(first)} at the start: {back}")
        return _Table(self.path, self.rows[first:], first)

    def time_us(self) -> NDArray[np.int64]:
        """First column in microseconds. Raises BslamError where time falls."""
        times_us = np.rint(self.rows[:, 0] * 1e6).astype(np.int64)
        bad = np.flatnonzero(np.diff(times_us) < 0)
        if len(bad):
            row = int(bad[0]) + 1
            raise BslamError(
                f"{self.path}, data row {self.left_out + row + 1}: time {self.rows[row, 0]:.3f} does not "
                f"come after {self.rows[row - 1, 0]:.3f}; allowed: rows in order of time"
            )
        return times_us


def load_mrclam(directory: Path | str, robot: int) -> Log:
    """The log of robot 1 to 5. Frame of truth and beacons: the data set's own; times since 1970.

    Raises BslamError that names the file, the line, and what is allowed.
    """
    folder = Path(directory)
    if robot not in robots_in(folder):
        raise BslamError(f"{folder}: no robot {robot}; allowed: {_listed(robots_in(folder))}")
    subject_of, notes = _read_barcodes(folder), list[str]()
    kind, truth_path = best_truth(folder, robot)
    return Log(
        name=f"{folder.resolve().name}_robot{robot}",
        odometry=_read_odometry(folder, robot, notes),
        sightings=_read_sightings(folder, robot, subject_of, notes),
        truth=_read_truth(truth_path, notes) if kind != "none" else None,
        beacons=_read_landmarks(folder),
        robot=ROBOT,
        notes=tuple(notes),
    )


def robots_in(folder: Path) -> list[int]:
    """Numbers of the robots that have odometry in the folder. Raises BslamError if there is none."""
    found = [n for n in range(1, ROBOTS + 1) if _find(folder, f"Robot{n}_Odometry") is not None]
    if not found:
        raise BslamError(
            f"{folder}: no MRCLAM data set; allowed: a folder with Robot1_Odometry.dat (or .dat.gz) and so on"
        )
    return found


def best_truth(folder: Path, robot: int) -> tuple[str, Path]:
    """Kind ("full", "rebuilt", "sparse", "none") and file of the best ground truth that is there."""
    for kind, suffix in _TRUTHS:
        path = _find(folder, f"Robot{robot}_Groundtruth{suffix}")
        if path is not None:
            return kind, path
    return "none", folder


def _read_odometry(folder: Path, robot: int, notes: list[str]) -> Odometry:
    """Rows at a steady rate. A command holds from its row until the next one, however far or near that is.

    The held command is integrated exactly and divided by the step, so that equal stamps, pauses and jitter of
    the recording leave nothing behind. The first row only marks the start.
    """
    table = _read_table(_require(folder, f"Robot{robot}_Odometry"), 3).begun(notes)
    times_us = table.time_us()
    start_us = int(times_us[0])
    steps = int(times_us[-1] - start_us) // STEP_US
    grid_us = STEP_US * np.arange(steps + 1, dtype=np.int64)
    mean = np.zeros((steps + 1, 2))
    for column in (0, 1):
        held_us = np.concatenate([[0.0], np.cumsum(table.rows[:-1, 1 + column] * np.diff(times_us))])
        mean[1:, column] = np.diff(np.interp(grid_us, times_us - start_us, held_us)) / STEP_US
    return Odometry("velocity", start_us + grid_us, mean[:, 0], mean[:, 1])


def _read_sightings(folder: Path, robot: int, subject_of: dict[int, int], notes: list[str]) -> Sightings:
    """The file holds barcodes, whatever its header says; rows of one stamp are one image.

    Other robots are not mappable. A barcode in no table is a decoding error: something was seen there, but
    not what. It keeps no identity, so known association refuses it, and stays mappable, as 15 of the 19
    things that carry a barcode are landmarks: for unknown association it is one more sighting to decide
    about, and a wrong decision counts.
    """
    table = _read_table(_require(folder, f"Robot{robot}_Measurement"), 4).begun(notes)
    subject = np.array([subject_of.get(int(code), -1) for code in table.rows[:, 1]], dtype=np.int64)
    return Sightings(
        time_us=table.time_us(),
        beacon_id=subject,
        bearing_rad=wrap_rad(table.rows[:, 3]),
        range_m=table.rows[:, 2],
        mappable=(subject > ROBOTS) | (subject < 0),
    )


def _read_barcodes(folder: Path) -> dict[int, int]:
    """Barcode -> subject. Looked up once, by set: some barcodes are subject numbers too, and sets differ."""
    table = _read_table(_require(folder, "Barcodes"), 2)
    return {int(code): int(subject) for subject, code in table.rows}


def _read_landmarks(folder: Path) -> Beacons:
    """Landmarks, with the two names put right that set 1 has swapped."""
    rows = _read_table(_require(folder, "Landmark_Groundtruth"), 5).rows
    subject = rows[:, 0].astype(np.int64)
    place = dict(zip(subject.tolist(), rows[:, 1:3].tolist(), strict=True))
    is_original_set_1 = all(
        number in place and math.dist(place[number], original) < 1e-3 for number, original in _SWAPPED.items()
    )
    if is_original_set_1:
        subject = np.where(subject == 11, 17, np.where(subject == 17, 11, subject))
    return Beacons(subject, rows[:, 1], rows[:, 2])


def _read_truth(path: Path, notes: list[str]) -> Truth:
    """True poses; of rows with one stamp, the first."""
    table = _read_table(path, 4).begun(notes)
    times_us = table.time_us()
    first = np.diff(times_us, prepend=-1) > 0
    if not first.all():
        notes.append(f"{path}: left out {rows_text(int((~first).sum()))} stamped as the row above")
    _, x_m, y_m, theta_rad = table.rows[first, :4].T
    return Truth(times_us[first], x_m, y_m, wrap_rad(theta_rad))


def _find(folder: Path, stem: str) -> Path | None:
    for path in (folder / f"{stem}.dat", folder / f"{stem}.dat.gz"):
        if path.is_file():
            return path
    return None


def _require(folder: Path, stem: str) -> Path:
    path = _find(folder, stem)
    if path is None:
        raise BslamError(f"{folder}: {stem}.dat is missing; an MRCLAM data set has it, plain or as .dat.gz")
    return path


def _read_table(path: Path, columns: int) -> _Table:
    """At least `columns` finite numbers a line; `#` begins a comment."""
    try:
        with _open(path) as file, warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an empty file, which is an error here
            rows = np.loadtxt(file, ndmin=2, usecols=range(columns))
        if len(rows) and np.isfinite(rows).all():
            return _Table(path, rows)
    except (ValueError, IndexError):
        pass  # the line is looked for below
    except (OSError, EOFError) as error:
        raise BslamError(f"{path}: cannot be read: {error}; allowed: text, plain or gzipped") from error
    raise _first_bad_line(path, columns)


def _open(path: Path) -> IO[str]:
    """For reading; what is no UTF-8 becomes something that is no number either."""
    if path.suffix == ".gz":
        return gzip.open(path, "rt", encoding="utf-8", errors="replace")
    return path.open(encoding="utf-8", errors="replace")


def _first_bad_line(path: Path, columns: int) -> BslamError:
    """The error for the first line that is not `columns` finite numbers."""
    with _open(path) as file:
        for number, line in enumerate(file, start=1):
            fields = line.split("#")[0].split()
            if fields and not (len(fields) >= columns and all(map(_is_finite, fields[:columns]))):
                return BslamError(
                    f"{path}, line {number}: {line.strip()!r}; allowed: {columns} finite numbers"
                )
    return BslamError(f"{path}: holds no data; allowed: lines of {columns} numbers")


def _is_finite(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _listed(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers))
