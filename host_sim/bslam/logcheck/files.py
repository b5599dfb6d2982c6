"""The files of a folder as they stand, before the strict reader: stamps, and directions in degrees.

What is found is put right in a copy, so that the rest of the log can be tested, too.
"""

from __future__ import annotations

import csv
import gzip
import re
import shutil
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.logcheck import plausible
from bslam.logcheck.drive import Floats
from bslam.logcheck.finding import Curve, Finding, Picture
from bslam.parsing.settings import load_toml

_STEMS: Final = ("odometry", "sightings", "truth")
_GAP_S: Final = 1.0  # without odometry
_GAP_ROWS: Final = 8
_TIME_UNITS: Final = {1e3: "milliseconds", 1e6: "seconds", 1e-3: "nanoseconds"}  # by what makes them us
_ROWS_US: Final = (500.0, 4e6)  # from row to row of any odometry
_DEGREES_SHARE: Final = 0.1  # of values beyond a full turn
_SAME_UNIT: Final = 30.0  # an interval that is less than so many times off is of the same unit


@dataclass
class _Table:
    """A file: the names of its columns, and its fields as texts (rows, columns)."""

    path: Path
    names: list[str]
    fields: NDArray[Any]

    def column(self, name: str) -> Floats:
        """Its numbers; NaN where there is none."""
        return np.array([_number(text) for text in self.fields[:, self.names.index(name)].tolist()])

    def multiply(self, name: str, factor: float) -> None:
        """The numbers of a column; stamps stay whole."""
        values = (factor * self.column(name)).tolist()
        is_stamp = name == "time_us"
        self.fields[:, self.names.index(name)] = [repr(round(one) if is_stamp else one) for one in values]

    def write(self) -> None:
        """Where it was read."""
        with gzip.open(self.path, "wt") if self.path.suffix == ".gz" else self.path.open("w") as file:
            csv.writer(file, lineterminator="\n").writerows([self.names, *self.fields.tolist()])


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def _read(path: Path) -> _Table | None:
    """A file of rows with stamps; None for another one: the strict reader says best what is wrong there."""
    try:
        with gzip.open(path, "rt") if path.suffix == ".gz" else path.open() as file:
            names, *rows = list(csv.reader(file)) or [[]]
    except (OSError, EOFError, UnicodeDecodeError, csv.Error, zlib.error):
        return None
    names = [name.strip() for name in names]
    if "time_us" not in names or len(rows) < 2 or any(len(row) != len(names) for row in rows):
        return None
    table = _Table(path, names, np.array(rows, dtype=object))
    return table if np.isfinite(table.column("time_us")).all() else None


def check_files(folder: Path, copy: Path) -> list[Finding]:
    """Findings of the files; with any, `copy` holds the folder with these put right. Raises BslamError."""
    shutil.copytree(folder, copy)
    findings: list[Finding] = []
    span_us = np.empty(0)  # of odometry
    for path in (copy / f"{stem}{suffix}" for stem in _STEMS for suffix in (".csv", ".csv.gz")):
        table = _read(path) if path.is_file() else None
        if table is None:
            continue
        is_odometry = path.name.startswith("odometry")
        if is_odometry:
            found = _unit_of_odometry(table, copy / "robot.toml")
        else:
            found = _unit_by_span(table, span_us) if len(span_us) else []
        found += _stamps(table, is_odometry) + _angles(table)
        if is_odometry:
            span_us = table.column("time_us")[[0, -1]]
        if found:
            table.write()
        findings += found
    if findings:  # a signature a row, which may be gone
        (copy / "signatures.npy").unlink(missing_ok=True)
    return findings


def _unit_of_odometry(table: _Table, robot: Path) -> list[Finding]:
    """By the step that is told; the strict reader says where it is missing."""
    told = load_toml(robot).get("step_us") if robot.is_file() else None
    if not isinstance(told, int) or told <= 0:
        return []
    return _unit_of_step(table, told, robot) or _unit_by_interval(table, told)


def _angles(table: _Table) -> list[Finding]:
    found = _degrees(table) if "bearing_rad" in table.names else []
    pose = ("x_m", "y_m", "theta_rad")
    if set(pose) <= set(table.names):
        found += plausible.headings(*map(table.column, pose))
    return found


def _unit_of_step(table: _Table, step_us: int, robot: Path) -> list[Finding]:
    """A step that no robot has, while the stamps are as far apart as another unit would make it."""
    interval = float(np.median(np.diff(np.unique(table.column("time_us")))))
    fitting = [one for one in _TIME_UNITS if 0.3 < one * step_us / interval < 3.0]
    if not _ROWS_US[0] <= interval <= _ROWS_US[1] or _ROWS_US[0] <= step_us <= _ROWS_US[1] or not fitting:
        return []
    whole_us = round(fitting[0] * step_us)
    robot.write_text(re.sub(r"(?m)^(\s*step_us\s*=).*$", rf"\1 {whole_us}", robot.read_text()))
    what = f"robot.toml: step_us is in {_TIME_UNITS[fitting[0]]}"
    sure = f"step_us = {step_us}, and stamps of odometry are {interval:g} us apart"
    return [Finding("stamps", what, sure, f"step_us = {whole_us} in robot.toml", {"factor": fitting[0]})]


def _unit_by_interval(table: _Table, step_us: int) -> list[Finding]:
    """Odometry whose rows are not step_us apart, but would be in another unit."""
    interval = float(np.median(np.diff(np.unique(table.column("time_us")))))
    if 1.0 / _SAME_UNIT < interval / step_us < _SAME_UNIT:
        return []
    sure = f"stamps are {interval:g} apart, and robot.toml has step_us = {step_us}"
    return _other_unit(table, sure, [one for one in _TIME_UNITS if 0.3 < one * interval / step_us < 3.0])


def _unit_by_span(table: _Table, span_us: Floats) -> list[Finding]:
    """Stamps outside of the odometry's, or all within a moment of them, but not so in another unit."""
    time = table.column("time_us")
    if _share(time, span_us) > 0.01:
        return []
    sure = f"stamps end at {time[-1]:.16g}, those of odometry at {span_us[1]:.16g}"
    return _other_unit(table, sure, [one for one in _TIME_UNITS if _share(one * time, span_us) > 0.2])


def _other_unit(table: _Table, sure: str, fitting: list[float]) -> list[Finding]:
    if not fitting:
        return []
    factor, file = fitting[0], table.path.name
    table.multiply("time_us", factor)
    what, mend = f"{file}: time_us is in {_TIME_UNITS[factor]}", f"multiply time_us of {file} by {factor:g}"
    return [Finding("stamps", what, sure, mend, {"factor": factor})]


def _share(time: Floats, span: Floats) -> float:
    """Of the span that stamps cover, if most of them lie in it."""
    room = 0.05 * np.ptp(span)
    inside = (time >= span[0] - room) & (time <= span[1] + room)
    return float(np.ptp(time[inside]) / np.ptp(span)) if inside.mean() > 0.7 and np.ptp(span) > 0.0 else 0.0


def _stamps(table: _Table, is_odometry: bool) -> list[Finding]:
    """Rows that come again, run back, or are missing."""
    time, file = table.column("time_us"), table.path.name
    repeated = np.ones(len(time), dtype=bool)
    repeated[np.unique(np.array([",".join(row) for row in table.fields.tolist()]), return_index=True)[1]] = (
        False
    )
    if is_odometry:
        repeated |= np.append(False, np.diff(time) == 0.0)
    back = np.append(False, np.diff(time) < 0.0)
    findings = []
    for rows, word, mend in (
        (repeated, "come again", f"delete the repeated rows of {file}"),
        (back, "run back in time", f"sort {file} by time_us, or cut it where the clock begins again"),
    ):
        if rows.any():
            first = f"the first in line {int(np.argmax(rows)) + 2}"
            what = f"{file}: {int(rows.sum())} of {len(time)} rows {word}"
            findings.append(Finding("stamps", what, first, mend, {"rows": int(rows.sum())}, _picture(time)))
    if findings:
        order = np.argsort(time, kind="stable")
        table.fields = table.fields[order[~repeated[order]]]
    return findings + (_gaps(table) if is_odometry else [])


def _gaps(table: _Table) -> list[Finding]:
    time_s = 1e-6 * table.column("time_us")
    interval_s = np.diff(time_s)
    gaps = (
        interval_s > max(_GAP_S, _GAP_ROWS * float(np.median(interval_s)))
        if len(interval_s)
        else interval_s > 0
    )
    if not gaps.any():
        return []
    longest = int(np.argmax(interval_s))
    what = f"{table.path.name}: {int(gaps.sum())} gaps, {interval_s[gaps].sum():.1f} s without odometry"
    sure = (
        f"the longest is {interval_s[longest]:.1f} s before line {longest + 3}; "
        f"rows are {np.median(interval_s):.3f} s apart"
    )
    mend = "cut the log there; or let the logger keep every row"
    return [Finding("stamps", what, sure, mend, {"gaps": int(gaps.sum())}, _picture(time_s))]


def _picture(time: Floats) -> Picture:
    return Picture("row", "stamp, from the first", [Curve("stamps", np.arange(len(time)), time - time[0])])


def _degrees(table: _Table) -> list[Finding]:
    values = table.column("bearing_rad")
    if not are_degrees(values):
        return []
    table.multiply("bearing_rad", np.pi / 180.0)
    return [degrees_finding(values, table.path.name)]


def are_degrees(values: Floats) -> bool:
    """Whether so many are beyond a full turn that they cannot be single errors."""
    return len(values) > 0 and float(np.mean(np.abs(values) > 2.0 * np.pi)) > _DEGREES_SHARE


def degrees_finding(values: Floats, file: str) -> Finding:
    """Directions beyond a full turn either way."""
    beyond = int(np.sum(np.abs(values) > 2.0 * np.pi))
    return Finding(
        "degrees",
        f"{file}: bearing_rad is in degrees",
        f"{beyond} of {len(values)} values are beyond 2 pi; the largest is {np.abs(values).max():.1f}",
        f"multiply bearing_rad of {file} by pi/180 = 0.0174533",
        {"factor": np.pi / 180.0},
        Picture("row", "bearing_rad", [Curve("values", np.arange(len(values)), values)]),
    )
