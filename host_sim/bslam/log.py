"""A log: what a robot recorded on one drive, and the folder format it is kept in.

A log is data only. It comes out of the simulator, a data set or a folder, and goes into the replay; nobody
changes it on the way. Times are integer microseconds, lengths metres, angles radians in (-pi, pi], axes as in
REP-103 (x forward, y left, counter-clockwise positive).
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

import bslam  # the front door, whose check and run are methods of a log, too
from bslam.errors import BslamError
from bslam.parsing.csvtable import Column, Table, is_count, read_table, table_of_texts
from bslam.parsing.identities import BEACON_ID, IDENTITY, read_identities
from bslam.parsing.settings import (
    FIELD_OF_VIEW,
    Rule,
    integer,
    load_toml,
    number,
    one_of,
    parse_table,
    setting,
)

if TYPE_CHECKING:
    from narwhals.typing import IntoFrame

ODOMETRY_COLUMNS = {
    "wheels": ("left_m", "right_m"),
    "ticks": ("left_ticks", "right_ticks"),
    "velocity": ("v_mps", "omega_radps"),
}
GYRO = "gyro_radps"
"""Column of odometry that a robot without a gyro leaves out."""
GYRO_SD = "gyro_sd_radps"
"""Column of odometry that a gyro which does not know how well it tells leaves out."""
SIGHTING_NUMBERS = ("bearing_sd_rad", "range_sd_m", "range_scale_sd", "score")
"""Columns of sightings that a detector may leave out."""
CLASS = "beacon_class"
"""Column of sightings that a detector may leave out: the kind of beacon."""
SIGNATURE_SIZE = 71
"""Values of a signature: how a sighting looks (firmware/vision/built_in/measurement/signature.h)."""
SIGNATURES = "signatures.npy"
"""The file of a log folder that holds them, one a row of sightings.csv."""
SEEDS = "seeds.npy"
"""The file that holds signatures of things that are no beacon."""
SEEDS_MAX = 128
FILES = (
    *(f"{stem}.csv{end}" for stem in ("odometry", "sightings", "truth", "beacons") for end in ("", ".gz")),
    *(SIGNATURES, SEEDS, "robot.toml"),
)
"""All that a log folder may hold."""
TICK_KEYS = ("left_radius_m", "right_radius_m", "ticks_per_revolution", "counter_bits")


@dataclass(frozen=True)
class Odometry:
    """What the wheels said; `time_us` rises strictly.

    kind "wheels": a, b = left, right wheel travel since the row before (first row: since the start, a step
    earlier), m.
    kind "ticks": a, b = left, right encoder counter values; the first row is the counters' starting point.
    kind "velocity": a, b = forward speed m/s and turning rate rad/s, held over the interval that ENDS at
    time_us.
    """

    kind: str
    time_us: NDArray[np.int64]  # (n,)
    a: NDArray[np.float64]  # (n,)
    b: NDArray[np.float64]  # (n,)
    gyro_radps: NDArray[np.float64] | None = (
        None  # (n,) mean turn rate over the same interval; NaN: not told there; None: no gyro
    )
    gyro_sd_radps: NDArray[np.float64] | None = None  # (n,) its own noise; 0, None: gyro_sigma_radps


@dataclass(frozen=True)
class Sightings:
    """Beacons seen, in order of time; rows of equal `time_us` belong to one image."""

    time_us: NDArray[np.int64]  # (m,)
    beacon_id: NDArray[np.int64]  # (m,) -1: identity not known
    bearing_rad: NDArray[np.float64]  # (m,) from the sensor's forward axis
    range_m: NDArray[np.float64]  # (m,) NaN: no range
    mappable: NDArray[np.bool_]  # (m,) False: the detector says it is a moving thing
    bearing_sd_rad: NDArray[np.float64] | None = (
        None  # (m,) noise as the detector gives it; 0, None: it does not
    )
    range_sd_m: NDArray[np.float64] | None = None  # (m,)
    range_scale_sd: NDArray[np.float64] | None = (
        None  # (m,) by what part all distances of the thing err alike; 0, None: as robot.toml
    )
    signature: NDArray[np.float32] | None = None  # (m, SIGNATURE_SIZE) how each looks; None: nobody knows
    beacon_class: NDArray[np.int64] | None = (
        None  # (m,) the detector's kind of beacon, 1 to 254; 0, None: it has none
    )
    score: NDArray[np.float64] | None = (
        None  # (m,) how sure the detector is that each is a beacon; 0, None: it does not say
    )


@dataclass(frozen=True)
class Truth:
    """True poses. Frame: the start pose's (simulation), or one of its own, the room's say."""

    time_us: NDArray[np.int64]  # (k,)
    x_m: NDArray[np.float64]  # (k,)
    y_m: NDArray[np.float64]  # (k,)
    theta_rad: NDArray[np.float64]  # (k,) NaN: nobody knows the heading


@dataclass(frozen=True)
class Beacons:
    """True beacon positions, in the frame of the truth; every identity once."""

    beacon_id: NDArray[np.int64]  # (b,)
    x_m: NDArray[np.float64]  # (b,)
    y_m: NDArray[np.float64]  # (b,)


WHEEL_NOISES = ("speedometer", "actuation")
"""What errs: the reading, or the motion against the reading."""

# What the core takes, so that whoever writes robot.toml or a scenario hears of a bad value in its words.
WHEELBASE_M = number(1e-3, 10.0)
WHEEL_RADIUS_M = number(1e-4, 10.0)
WHEEL_SPEED_SIGMA_MPS = number(0.0, 100.0)
GYRO_SIGMA_RADPS = number(1e-6, 100.0)
BEARING_SIGMA_RAD = number(0.0, 3.2)
RANGE_SIGMA_FLOOR_M = number(0.0, 100.0)
RANGE_SIGMA_FRACTION = number(0.0, 10.0)
RANGE_SIGMA_SCALE_M = Rule("a number from 0.1, or inf", float, lambda value: value >= 0.1)
SENSOR_OFFSET_M = number(-100.0, 100.0)
SENSOR_YAW_RAD = number(-3.2, 3.2)
SIGHTING_DELAY_US = integer(0, 10_000_000)
CORRELATION_M = number(0.0, 100.0)
SCALE_SD = number(0.0, 1.0)
CORE_SETTINGS = Rule(
    "a table of the core's settings, each a number",
    dict,
    lambda table: all(isinstance(one, (int, float)) and math.isfinite(one) for one in table.values()),
    lambda table: tuple(table.items()),
)


@dataclass(frozen=True)
class Robot:
    """Geometry and noise of the robot that recorded the log; the keys of `robot.toml`.

    The sd of a range r is sqrt(floor^2 + (fraction r)^2 + (r^2 / scale)^2). A sighting stamped t was taken at
    t - sighting_delay_us by a sensor at (sensor_x_m, sensor_y_m, sensor_yaw_rad) on the robot.
    The four keys of the encoders must be there in a log with tick odometry. `wheel_noise` says what the sigma
    of the wheels' speed is of: the reading of a wheel that moves as told, or the motion of one that jitters.
    A sensor without noise may be described so: the filter is told a little (`options.core_params`).
    `settings`, the table [settings] of robot.toml, holds what the other keys cannot say.
    """

    wheelbase_m: float = setting(WHEELBASE_M)
    wheel_speed_sigma_mps: float = setting(WHEEL_SPEED_SIGMA_MPS)  # each wheel, each step, independent
    step_us: int = setting(integer(1))  # nominal time from one odometry row to the next
    field_of_view_rad: float = setting(FIELD_OF_VIEW)
    bearing_sigma_rad: float = setting(BEARING_SIGMA_RAD)
    range_sigma_fraction: float = setting(RANGE_SIGMA_FRACTION)
    range_sigma_scale_m: float = setting(RANGE_SIGMA_SCALE_M)
    range_sigma_floor_m: float = setting(RANGE_SIGMA_FLOOR_M, 0.0)
    sensor_x_m: float = setting(SENSOR_OFFSET_M, 0.0)
    sensor_y_m: float = setting(SENSOR_OFFSET_M, 0.0)
    sensor_yaw_rad: float = setting(SENSOR_YAW_RAD, 0.0)
    sighting_delay_us: int = setting(SIGHTING_DELAY_US, 0)
    sighting_correlation_m: float = setting(CORRELATION_M, 0.0)  # way over which a beacon's errors stay alike
    sighting_scale_sd: float = setting(SCALE_SD, 0.0)  # all distances of a beacon too long by this part
    left_radius_m: float | None = setting(WHEEL_RADIUS_M, None)
    right_radius_m: float | None = setting(WHEEL_RADIUS_M, None)
    ticks_per_revolution: int | None = setting(integer(1, 10_000_000), None)
    counter_bits: int | None = setting(integer(2, 32), None)
    wheel_noise: str = setting(one_of(*WHEEL_NOISES), "speedometer")
    gyro_sigma_radps: float = setting(GYRO_SIGMA_RADPS, 0.02)  # each reading, independent
    settings: tuple[tuple[str, int | float], ...] = setting(CORE_SETTINGS, ())  # of the core, as is


@dataclass(frozen=True, repr=False)
class Log:
    """One drive. `truth` and `beacons` (the true map) are there only if somebody knows them.

    From a folder (`Log.read`), from tables (`Log.from_dataframe`), or from arrays.
    """

    name: str
    odometry: Odometry
    sightings: Sightings
    truth: Truth | None
    beacons: Beacons | None
    robot: Robot
    seeds: NDArray[np.float32] | None = (
        None  # (k, SIGNATURE_SIZE) signatures of what is no beacon, for machines
    )
    words: tuple[str, ...] = ()  # what a beacon_id stands for where identities are words
    notes: tuple[str, ...] = ()  # what was left out when it was read, and why

    def __repr__(self) -> str:
        time_us, seen = self.odometry.time_us, self.sightings.beacon_id
        beacons = len(np.unique(seen[seen >= 0]))
        seconds = 1e-6 * float(time_us[-1] - time_us[0]) if len(time_us) else 0.0
        return (
            f"Log {self.name!r}: {len(time_us)} odometry rows, {len(seen)} sightings of {beacons} beacons, "
            f"{seconds:.1f} s, truth: {'no' if self.truth is None else 'yes'}"
        )

    def identity(self, number: int) -> str:
        """The identity as the log has it; none: empty."""
        return "" if number < 0 else self.words[number] if number < len(self.words) else str(number)

    @classmethod
    def read(cls, path: str | Path) -> Log:
        """Read a log folder (`odometry.csv`, `sightings.csv`, `robot.toml`; optional `truth.csv`,
        `beacons.csv`, `signatures.npy`, `seeds.npy`), see docs/LOG-FORMAT.md.

        Each .csv may be a .csv.gz. Raises BslamError that names the file, the line and column or key, the
        value and what is allowed there.
        """
        folder = Path(path)
        if not folder.is_dir():
            needs = "a log is a folder with odometry.csv, sightings.csv, robot.toml"
            raise BslamError(f"{folder}: no such folder; {needs}")
        robot, seeds = _read_robot(folder / "robot.toml"), folder / SEEDS
        log = _log_of(folder.resolve().name, _tables_in(folder), robot, folder / SIGNATURES)
        return replace(log, seeds=_read_seeds(seeds))

    def write(self, path: str | Path) -> None:
        """Write the log as a folder that `read` reads back to the last bit; files there are replaced.

        Raises BslamError if the folder cannot be written.
        """
        _write(self, Path(path))

    @classmethod
    def from_dataframe(
        cls,
        odometry: IntoFrame,
        sightings: IntoFrame,
        *,
        robot: Robot | Mapping[str, Any] | str | Path,
        truth: IntoFrame | None = None,
        beacons: IntoFrame | None = None,
        name: str = "log",
    ) -> Log:
        """A log from dataframes of pandas, polars, pyarrow or another library that narwhals knows.

        Columns, units and rules are those of the files (docs/LOG-FORMAT.md); rows in order of time, an index
        counts for nothing, a missing value (None, NaN) is an empty field.

        odometry: time_us, and left_m, right_m (m since the row before), or left_ticks, right_ticks, or v_mps,
        omega_radps; perhaps gyro_radps. sightings: time_us (us), bearing_rad (left positive), and what is
        known of beacon_id, range_m (m), mappable, ... truth: time_us, x_m, y_m, perhaps theta_rad. beacons:
        beacon_id, x_m, y_m. robot: geometry and noise, whose wheelbase nobody can guess: a `Robot`, a mapping
        with its keys, or the path of a robot.toml.

        Raises BslamError that names table, row (from 0) and column, the value and what is allowed there.
        """
        frames = {"odometry": odometry, "sightings": sightings, "truth": truth, "beacons": beacons}
        return _log_of(name, _tables_of(frames), _robot_of(robot))

    def check(self) -> bslam.Report:
        """What `bslam check` says of the log: signs, units, delay, scales, noise, identities, stamps.

        It prints as the command does; `findings` are the parts.
        """
        return bslam.check(self)

    def run(
        self, algorithm: Callable[..., bslam.Algorithm] | None = None, **words: Unpack[bslam.RunWords]
    ) -> bslam.Run:
        """Run the filter over the log, as `bslam replay csv` does with options of these names.

        algorithm: a class of your own (docs/PLUGIN.md) to run in its place, without the options that are of
        the filter alone. Raises BslamError for what is no option, or no value of one.
        """
        return bslam.run(self, algorithm, **words)


def first_steps(log: Log, steps: int) -> Log:
    """The beginning of a log: so many rows of odometry, and the sightings until the last of them."""
    kept = slice(0, steps)
    odometry = replace(
        log.odometry,
        time_us=log.odometry.time_us[kept],
        a=log.odometry.a[kept],
        b=log.odometry.b[kept],
        gyro_radps=None if log.odometry.gyro_radps is None else log.odometry.gyro_radps[kept],
        gyro_sd_radps=None if log.odometry.gyro_sd_radps is None else log.odometry.gyro_sd_radps[kept],
    )
    seen = log.sightings.time_us <= odometry.time_us[-1]
    columns = {one.name: getattr(log.sightings, one.name) for one in fields(log.sightings)}
    cut: Any = {name: None if column is None else column[seen] for name, column in columns.items()}
    return replace(log, odometry=odometry, sightings=replace(log.sightings, **cut))


def has_identities(log: Log) -> bool:
    """Whether somebody says of at least one sighting whose it is."""
    return bool((log.sightings.beacon_id >= 0).any())


def wrap_rad(angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angles in (-pi, pi]; those already there are kept to the last bit."""
    outside = (angle_rad <= -math.pi) | (angle_rad > math.pi)
    return np.where(outside, math.pi - np.mod(math.pi - angle_rad, 2.0 * math.pi), angle_rad)


# --- writing ------------------------------------------------------------------------------------------------


def _write(log: Log, folder: Path) -> None:
    odometry, sightings = log.odometry, log.sightings
    number = int if odometry.kind == "ticks" else float
    a_name, b_name = ODOMETRY_COLUMNS[odometry.kind]
    gyro_radps = odometry.gyro_radps
    gyro = {} if gyro_radps is None else {GYRO: _texts_or_empty(gyro_radps)}
    if odometry.gyro_sd_radps is not None:
        gyro[GYRO_SD] = _texts(odometry.gyro_sd_radps, float)
    tables: dict[str, dict[str, list[str]] | None] = {
        "odometry": {
            "time_us": _texts(odometry.time_us, int),
            a_name: _texts(odometry.a, number),
            b_name: _texts(odometry.b, number),
            **gyro,
        },
        "sightings": _sightings_texts(log),
        "truth": None if log.truth is None else _truth_texts(log.truth),
        "beacons": None if log.beacons is None else _beacons_texts(log, log.beacons),
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            (folder / name).unlink(missing_ok=True)
        for stem, columns in tables.items():
            if columns is not None:
                _write_csv(folder / f"{stem}.csv", columns)
        for name, values in ((SIGNATURES, sightings.signature), (SEEDS, log.seeds)):
            if values is not None:
                np.save(folder / name, values, allow_pickle=False)
        (folder / "robot.toml").write_text(robot_text(log.robot), encoding="utf-8")
    except OSError as error:
        raise BslamError(f"{folder}: cannot write the log there: {error}") from error


def _texts(values: NDArray[Any], kind: Callable[[Any], Any]) -> list[str]:
    return [repr(kind(value)) for value in values.tolist()]


def _texts_or_empty(values: NDArray[np.float64]) -> list[str]:
    return ["" if math.isnan(one) else repr(one) for one in values.tolist()]


def _truth_texts(truth: Truth) -> dict[str, list[str]]:
    columns = {"time_us": _texts(truth.time_us, int), "x_m": _texts(truth.x_m, float)}
    columns["y_m"] = _texts(truth.y_m, float)
    if not np.isnan(truth.theta_rad).all():
        columns["theta_rad"] = _texts_or_empty(truth.theta_rad)
    return columns


def _beacons_texts(log: Log, beacons: Beacons) -> dict[str, list[str]]:
    columns = {BEACON_ID: [log.identity(one) for one in beacons.beacon_id.tolist()]}
    return columns | {"x_m": _texts(beacons.x_m, float), "y_m": _texts(beacons.y_m, float)}


def _sightings_texts(log: Log) -> dict[str, list[str]]:
    """Columns of sightings.csv; range_m, mappable and the noise only where they say something."""
    sightings = log.sightings
    columns = {
        "time_us": _texts(sightings.time_us, int),
        BEACON_ID: [log.identity(one) for one in sightings.beacon_id.tolist()],
        "bearing_rad": _texts(sightings.bearing_rad, float),
    }
    if not np.isnan(sightings.range_m).all():
        columns["range_m"] = _texts_or_empty(sightings.range_m)
    if not sightings.mappable.all():
        columns["mappable"] = _texts(sightings.mappable, int)
    for name in SIGHTING_NUMBERS:
        if getattr(sightings, name) is not None:
            columns[name] = _texts(getattr(sightings, name), float)
    if sightings.beacon_class is not None:
        columns[CLASS] = _texts(sightings.beacon_class, int)
    return columns


def _write_csv(path: Path, columns: dict[str, list[str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))


def robot_text(robot: Robot) -> str:
    """The text of a robot.toml."""
    keys = {key: value for key, value in asdict(robot).items() if key != "settings" and value is not None}
    lines = [f"{key} = {value!r}\n" for key, value in keys.items()]
    more = [f"{key} = {value!r}\n" for key, value in robot.settings]
    return "".join([*lines, "\n[settings]\n", *more] if more else lines)


# --- reading ------------------------------------------------------------------------------------------------

# In m, m/s or rad no robot comes near it; beyond it, figures would overflow.
_FARTHEST = 1e6
_LARGEST_FEATURE = 1e12  # as the core has it

_NO_RANGE_ALONE = "a sighting of range alone cannot be used"
_COUNT = Column("an integer from 0 to 2^53", is_count)
_TIME = Column("an integer from 0 to 2^53, in microseconds", is_count)
_NUMBER = Column("a number from -1e6 to 1e6", lambda values: np.abs(values) <= _FARTHEST)
_COLUMNS = {
    "time_us": _TIME,
    "left_m": _NUMBER,
    "right_m": _NUMBER,
    "left_ticks": _COUNT,
    "right_ticks": _COUNT,
    "v_mps": _NUMBER,
    "omega_radps": _NUMBER,
    GYRO: Column("a number from -1000 to 1000, or empty", lambda v: np.abs(v) <= 1000.0, empty=math.nan),
    GYRO_SD: Column("0 or a number from 1e-6 to 100", lambda v: (v == 0.0) | ((v >= 1e-6) & (v <= 100.0))),
    BEACON_ID: IDENTITY,
    "bearing_rad": Column(
        "radians from -2 pi to 2 pi, which are degrees times pi/180",
        lambda values: np.abs(values) <= 2.0 * math.pi,
        why=_NO_RANGE_ALONE,
    ),
    "range_m": Column(
        "a number above 0, at most 1e6, or empty", lambda v: (v > 0) & (v <= _FARTHEST), empty=math.nan
    ),
    "bearing_sd_rad": Column(
        "0 or radians from 1e-5 to pi", lambda v: (v == 0) | ((v >= 1e-5) & (v <= math.pi))
    ),
    "range_sd_m": Column("0 or a number from 0.001 to 1e4", lambda v: (v == 0) | ((v >= 1e-3) & (v <= 1e4))),
    "range_scale_sd": Column("a number from 0 to 1", lambda v: (v >= 0) & (v <= 1)),
    "score": _NUMBER,
    CLASS: Column("an integer from 0 to 254", lambda values: is_count(values) & (values <= 254)),
    "mappable": Column("0 or 1", lambda values: (values == 0) | (values == 1)),
    "x_m": _NUMBER,
    "y_m": _NUMBER,
    "theta_rad": Column("a number from -1e6 to 1e6, or empty", _NUMBER.holds, empty=math.nan),
}


def _find_csv(folder: Path, stem: str) -> Path | None:
    names = (f"{stem}.csv", f"{stem}.csv.gz")
    found = [folder / name for name in names if (folder / name).is_file()]
    if len(found) > 1:
        raise BslamError(f"{folder}: both {stem}.csv and {stem}.csv.gz are there; allowed: one of them")
    for path in [] if found else folder.iterdir():
        if path.name in names:
            raise BslamError(f"{path}: is no file; allowed: a file, or none of that name")
        if path.name.casefold() in names:
            raise BslamError(f"{path}: is no name of a log's file; allowed: {path.name.casefold()}")
    return found[0] if found else None


Tables = Callable[[str, Sequence[Mapping[str, Column]], Mapping[str, Column]], Table | None]
"""Gives the table of a name with the columns of one of some layouts, and perhaps others; None: not there."""


def _tables_in(folder: Path) -> Tables:
    """Of a log folder."""

    def read(
        stem: str, layouts: Sequence[Mapping[str, Column]], optional: Mapping[str, Column]
    ) -> Table | None:
        path = _find_csv(folder, stem)
        if path is None and stem in _NEEDED:
            raise BslamError(f"{folder}: {stem}.csv is missing; a log needs {stem}.csv or {stem}.csv.gz")
        return None if path is None else read_table(path, layouts, optional)

    return read


def _tables_of(frames: Mapping[str, Any]) -> Tables:
    """Of dataframes by name."""
    from bslam.parsing.frames import texts_of  # narwhals is wanted here alone

    def read(
        stem: str, layouts: Sequence[Mapping[str, Column]], optional: Mapping[str, Column]
    ) -> Table | None:
        frame = frames[stem]
        if frame is None and stem not in _NEEDED:
            return None
        texts = texts_of(stem, frame)
        for name in getattr(getattr(frame, "index", None), "names", ()):  # of pandas
            if name not in texts and any(name in one for one in (*layouts, optional)):
                allowed = "a column, which reset_index() makes of it"
                raise BslamError(f"{stem}: {name} is the dataframe's index; allowed: {allowed}")
        return table_of_texts(stem, texts, layouts, optional)

    return read


def _log_of(name: str, tables: Tables, robot: Robot, signatures: Path | None = None) -> Log:
    """The log of these tables. signatures: the file that holds them, if it is there."""
    notes: list[str] = []
    odometry = _odometry(tables, robot, notes)
    seen, signature = _sightings_table(tables, signatures, notes)
    placed = _beacons_table(tables, notes)
    identities = read_identities(seen, placed)
    truth = tables("truth", [_TRUTH], _columns("theta_rad"))
    return Log(
        name=name,
        odometry=odometry,
        sightings=_sightings(seen, identities.numbers(seen), signature),
        truth=None if truth is None else _truth(truth, notes),
        beacons=None if placed is None else _beacons(placed, identities.numbers(placed)),
        robot=robot,
        words=identities.words,
        notes=tuple(notes),
    )


def _columns(*names: str) -> dict[str, Column]:
    return {name: _COLUMNS[name] for name in names}


_NEEDED = ("odometry", "sightings")
_TRUTH = _columns("time_us", "x_m", "y_m")


def _odometry(tables: Tables, robot: Robot, notes: list[str]) -> Odometry:
    layouts = [_columns("time_us", *names) for names in ODOMETRY_COLUMNS.values()]
    table = tables("odometry", layouts, _columns(GYRO, GYRO_SD))
    assert table is not None
    table.require_rows("allowed: at least one")
    table = _in_order(table, notes, strict=True)
    kind, (a_name, b_name) = next(item for item in ODOMETRY_COLUMNS.items() if item[1][0] in table.values)
    if kind == "ticks":
        _require_tick_range(table, robot)
    a, b = table.values[a_name], table.values[b_name]
    gyro = (table.values.get(GYRO), table.values.get(GYRO_SD))
    return Odometry(kind, table.integers("time_us"), a, b, *gyro)


def _in_order(table: Table, notes: list[str], *, strict: bool) -> Table:
    """Without rows that a logger wrote twice, and a head that is later than what follows; else in order."""
    table = table.only(table.unrepeated(notes))
    table = table.only(table.begun("time_us", notes))
    table.require_order("time_us", strict=strict)
    return table


def _require_tick_range(table: Table, robot: Robot) -> None:
    if robot.counter_bits is None:
        raise BslamError(
            f"{table.origin.name}: ticks need {', '.join(TICK_KEYS)} in robot.toml; allowed: all four there"
        )
    highest = 2**robot.counter_bits - 1
    for name in ODOMETRY_COLUMNS["ticks"]:
        good = table.values[name] <= highest
        table.require(
            name, good, f"an integer from 0 to {highest} (robot.toml: {robot.counter_bits} counter_bits)"
        )


def _sightings_table(
    tables: Tables, signatures: Path | None, notes: list[str]
) -> tuple[Table, NDArray[np.float32] | None]:
    """The rows of sightings in order, and their signatures."""
    optional = _columns(BEACON_ID, "range_m", "mappable", *SIGHTING_NUMBERS, CLASS)
    table = tables("sightings", [_columns("time_us", "bearing_rad")], optional)
    assert table is not None
    signature = None if signatures is None else _read_signatures(signatures, table.rows)
    kept = table.unrepeated(notes) if signature is None else np.ones(table.rows, dtype=np.bool_)
    kept &= table.begun("time_us", notes)
    table = table.only(kept)
    table.require_order("time_us", strict=False)
    return table, None if signature is None else signature[kept]


def _sightings(
    table: Table, beacon_id: NDArray[np.int64], signature: NDArray[np.float32] | None
) -> Sightings:
    return Sightings(
        time_us=table.integers("time_us"),
        beacon_id=beacon_id,
        bearing_rad=wrap_rad(table.values["bearing_rad"]),
        range_m=table.values.get("range_m", np.full(table.rows, math.nan)),
        mappable=table.values.get("mappable", np.ones(table.rows)).astype(np.bool_),
        **{name: table.values.get(name) for name in SIGHTING_NUMBERS},
        signature=signature,
        beacon_class=table.integers(CLASS) if CLASS in table.values else None,
    )


def _read_signatures(path: Path, rows: int) -> NDArray[np.float32] | None:
    allowed = f"float32 of shape ({rows}, {SIGNATURE_SIZE}), as many rows as sightings.csv, or no such file"
    values = _read_looks(path, allowed)
    if values is not None and len(values) != rows:
        raise BslamError(f"{path}: shape {values.shape}; allowed: {allowed}")
    return values


def _read_seeds(path: Path) -> NDArray[np.float32] | None:
    allowed = f"float32 of shape (k, {SIGNATURE_SIZE}), k up to {SEEDS_MAX}, or no such file"
    values = _read_looks(path, allowed)
    if values is not None and len(values) > SEEDS_MAX:
        raise BslamError(f"{path}: shape {values.shape}; allowed: {allowed}")
    return values


def _read_looks(path: Path, allowed: str) -> NDArray[np.float32] | None:
    """Signatures (n, SIGNATURE_SIZE); None if there is no such file."""
    if not path.is_file():
        return None
    try:
        values = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise BslamError(f"{path}: cannot be read: {error}; allowed: {allowed}") from error
    if not isinstance(values, np.ndarray) or values.dtype != np.float32:
        raise BslamError(f"{path}: {getattr(values, 'dtype', 'no array')}; allowed: {allowed}")
    if values.ndim != 2 or values.shape[1] != SIGNATURE_SIZE:
        raise BslamError(f"{path}: shape {values.shape}; allowed: {allowed}")
    bad = ~(np.abs(values) <= _LARGEST_FEATURE)
    if bad.any():
        row, column = np.argwhere(bad)[0]
        where = f"row {row}, column {column}, counted from 0"
        raise BslamError(f"{path}: {values[row, column]} in {where}; allowed: finite, from -1e12 to 1e12")
    return values


def read_truth(path: Path, notes: list[str]) -> Truth:
    """True poses from a truth.csv or .csv.gz; what is left out goes into the notes.

    Raises BslamError that names the line and what is allowed.
    """
    return _truth(read_table(path, [_TRUTH], _columns("theta_rad")), notes)


def _truth(table: Table, notes: list[str]) -> Truth:
    none = "no such file" if table.origin.is_file else "truth=None"
    table.require_rows(f"allowed: at least one, or {none}")
    table = _in_order(table, notes, strict=True)
    theta_rad = table.values.get("theta_rad", np.full(table.rows, math.nan))
    return Truth(table.integers("time_us"), table.values["x_m"], table.values["y_m"], wrap_rad(theta_rad))


def _beacons_table(tables: Tables, notes: list[str]) -> Table | None:
    table = tables("beacons", [_columns(BEACON_ID, "x_m", "y_m")], {})
    return None if table is None else table.only(table.unrepeated(notes))


def _beacons(table: Table, beacon_id: NDArray[np.int64]) -> Beacons:
    first = np.isin(np.arange(table.rows), np.unique(beacon_id, return_index=True)[1])
    table.require(BEACON_ID, first, "an identity that no row above has")
    return Beacons(beacon_id, table.values["x_m"], table.values["y_m"])


def _read_robot(path: Path) -> Robot:
    if not path.is_file():
        needs = ", ".join(one.name for one in fields(Robot) if one.default is MISSING)
        example = "docs/LOG-FORMAT.md, 'Your own robot's log', has one to copy"
        raise BslamError(
            f"{path.parent}: {path.name} is missing; allowed: lines of KEY = VALUE with {needs}; {example}"
        )
    return _checked_robot(load_toml(path), str(path))


def _robot_of(robot: Robot | Mapping[str, Any] | str | Path) -> Robot:
    """What `Log.from_dataframe` takes for one."""
    if isinstance(robot, Robot):
        told = {key: value for key, value in vars(robot).items() if value is not None}
        return _robot_of(told | {"settings": dict(robot.settings)})
    if isinstance(robot, Mapping):
        return _checked_robot(robot, "robot")
    if isinstance(robot, (str, Path)):
        return _read_robot(Path(robot))
    raise BslamError(f"robot {robot!r}: allowed: a Robot, a mapping of its keys, the path of a robot.toml")


def _checked_robot(table: Mapping[str, object], where: str) -> Robot:
    robot = parse_table(Robot, table, where)
    encoder = {key: getattr(robot, key) for key in TICK_KEYS}
    missing = [key for key, value in encoder.items() if value is None]
    if missing and len(missing) < len(encoder):
        raise BslamError(
            f"{where}, key {missing[0]}: is missing; allowed: all of {', '.join(encoder)}, or none"
        )
    return robot
