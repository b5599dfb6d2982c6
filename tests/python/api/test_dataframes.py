"""`Log.from_dataframe`: what a table says is what the same csv file says, and so is what is wrong with it."""

import csv
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

from api.tables import DRIVE, ROBOT, columns
from bslam import BslamError, Log, Robot

LIBRARIES = [pd.DataFrame, pl.DataFrame, pa.table, pl.LazyFrame]


def made(kind: Callable[..., Any], tables: dict[str, dict[str, list[Any]]], robot: Any = ROBOT) -> Log:
    """The log of tables as dataframes of one library."""
    frames = {name: kind(one) for name, one in tables.items()}
    return Log.from_dataframe(frames.pop("odometry"), frames.pop("sightings"), robot=robot, **frames)


def assert_same(one: Any, other: Any) -> None:
    """Frozen dataclasses of arrays, to the bit."""
    for name in (field.name for field in fields(one)):
        a, b = getattr(one, name), getattr(other, name)
        if a is None or b is None or not isinstance(a, np.ndarray):
            assert a is b or a == b, name
        else:
            assert a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype == np.float64), name


@pytest.mark.parametrize("kind", LIBRARIES, ids=["pandas", "polars", "pyarrow", "polars, lazy"])
def test_a_log_of_tables_is_the_log(kind) -> None:
    log = made(kind, columns())
    for part in ("odometry", "sightings", "truth", "beacons"):
        assert_same(getattr(log, part), getattr(DRIVE, part))
    assert log.robot == Robot(**ROBOT)
    assert log.notes == () and log.name == "log"


def test_gaps_bools_floats_and_words_are_as_in_a_file() -> None:
    tables = columns()
    seen = {name: values[:4] for name, values in tables["sightings"].items()}
    frame = pd.DataFrame(seen | {"mappable": [True, False, True, True]})
    frame["beacon_id"] = pd.Series(["door", None, 7.0, "exit sign"], dtype=object)
    frame["range_m"] = [1.0, np.nan, 2.0, np.nan]
    frame["time_us"] = frame.time_us.astype(float)
    log = Log.from_dataframe(pd.DataFrame(tables["odometry"]), frame, robot=ROBOT)
    assert [log.identity(one) for one in log.sightings.beacon_id] == ["door", "", "7", "exit sign"]
    assert log.sightings.mappable.tolist() == [True, False, True, True]
    assert np.isnan(log.sightings.range_m).tolist() == [False, True, False, True]
    nullable = frame.assign(beacon_id=pd.array([1, None, 7, 2], dtype="Int64"))
    log = Log.from_dataframe(pd.DataFrame(tables["odometry"]), nullable, robot=ROBOT)
    assert log.sightings.beacon_id.tolist() == [1, -1, 7, 2]


def test_rows_written_twice_are_left_out_and_said() -> None:
    tables = columns()
    tables["odometry"] = {name: [one[0], *one] for name, one in tables["odometry"].items()}
    log = made(pd.DataFrame, tables)
    assert_same(log.odometry, DRIVE.odometry)
    assert log.notes == ("odometry: left out 1 row equal to one above, first row 1",)


BAD: list[tuple[str, str, Callable[[list[Any]], list[Any]], str]] = [
    ("odometry", "left_m", lambda v: [*v[:3], float("nan"), *v[4:]], "a number from -1e6 to 1e6"),
    ("odometry", "right_m", lambda v: [1e7, *v[1:]], "a number from -1e6 to 1e6"),
    ("odometry", "time_us", lambda v: [one + 0.5 for one in v], "an integer from 0 to 2^53, in microsec"),
    (
        "odometry",
        "time_us",
        lambda v: [one + 2**60 for one in v],
        "an integer from 0 to 2^53, in microseconds",
    ),
    ("odometry", "time_us", lambda v: v[::-1], "a value above that of the row before"),
    ("sightings", "bearing_rad", lambda v: [57.3 * one for one in v], "radians from -2 pi to 2 pi"),
    ("sightings", "range_m", lambda v: [-one for one in v], "a number above 0, at most 1e6, or empty"),
    ("sightings", "beacon_id", lambda v: [-1, *v[1:]], "or empty"),
    ("beacons", "beacon_id", lambda v: [v[1], *v[1:]], "an identity that no row above has"),
    ("truth", "x_m", lambda v: ["here", *v[1:]], "a number from -1e6 to 1e6"),
]


@pytest.mark.parametrize(("table", "column", "change", "allowed"), BAD)
def test_what_is_wrong_is_said_as_of_a_file(table, column, change, allowed, tmp_path) -> None:
    """The same words, but for the place: a row from 0 in place of a line, whose header is line 1."""
    tables = columns()
    tables[table][column] = change(tables[table][column])
    with pytest.raises(BslamError) as of_tables:
        made(pd.DataFrame, tables)
    message = str(of_tables.value)
    assert message.startswith(f"{table}, row ") and f"column {column}: " in message and allowed in message
    DRIVE.write(tmp_path)
    with (tmp_path / f"{table}.csv").open("w", newline="") as file:
        rows = zip(*tables[table].values(), strict=True)
        texts = [["" if one != one else one for one in row] for row in rows]
        csv.writer(file).writerows([list(tables[table]), *texts])
    with pytest.raises(BslamError) as of_files:
        Log.read(tmp_path)
    row = int(message.split("row ")[1].split(",")[0])
    as_of_file = message.replace("a missing value (None, NaN)", "''")
    as_of_file = as_of_file.replace(f"{table}, row {row}", f"{table}.csv, line {row + 2}")
    assert str(of_files.value) == f"{tmp_path}/{as_of_file}"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda o, s: Log.from_dataframe(o, s.rename(columns={"bearing_rad": "bearing"}), robot=ROBOT),
            r"^sightings: columns 'time_us,.*' are not allowed; .*; did you mean 'bearing_rad'\?$",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s.assign(image=1), robot=ROBOT),
            "sightings: columns .*; not one of them: 'image'",
        ),
        (lambda o, s: Log.from_dataframe(o[:0], s, robot=ROBOT), "odometry: no rows below the header"),
        (
            lambda o, s: Log.from_dataframe(None, s, robot=ROBOT),
            "odometry: NoneType: .*allowed: a dataframe",
        ),
        (
            lambda o, s: Log.from_dataframe(o, {"time_us": [1]}, robot=ROBOT),
            r"sightings: dict: .*allowed: a .*, as pandas\.DataFrame\(sightings\)$",
        ),
        (
            lambda o, s: Log.from_dataframe(o.set_index("time_us"), s, robot=ROBOT),
            r"^odometry: time_us is the dataframe's index; allowed: a column, which reset_index\(\) makes",
        ),
        (
            lambda o, s: Log.from_dataframe(
                o, s, robot=ROBOT, truth=pd.DataFrame(columns=["time_us", "x_m", "y_m"])
            ),
            "^truth: no rows below the header; allowed: at least one, or truth=None$",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s, robot={}),
            "robot, key wheelbase_m: is missing; .*missing: w",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s, robot=ROBOT | {"wheel_base_m": 0.3}),
            r"robot, key wheel_base_m: no such key; .*; did you mean 'wheelbase_m'\?",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s, robot=ROBOT | {"wheel_noise": "actuaton"}),
            r"robot, key wheel_noise: 'actuaton' is not allowed; .*; did you mean 'actuation'\?",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s, robot=replace(DRIVE.robot, wheelbase_m=300.0)),
            "robot, key wheelbase_m: 300.0 is not allowed; allowed: a number from 0.001 to 10",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s, robot=0.3),
            "robot 0.3: allowed: a Robot, a mapping of its",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s, robot="no.toml"),
            "no.toml is missing; allowed: lines of KEY = VALUE",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s, robot=ROBOT | {1: 2}),
            "robot, key 1: no such key; allowed: w",
        ),
        (
            lambda o, s: Log.from_dataframe(pd.DataFrame(o.to_numpy()), s, robot=ROBOT),
            "odometry: column label 0 is not allowed; allowed: texts$",
        ),
        (
            lambda o, s: Log.from_dataframe(o, s.assign(beacon_id=[b"a"] * len(s)), robot=ROBOT),
            "sightings, row 0, column beacon_id: b'a' is not allowed; allowed: a number, a text, or missing$",
        ),
        (
            lambda o, s: Log.from_dataframe(
                o, pl.from_pandas(s.assign(beacon_id=[[1]] * len(s))), robot=ROBOT
            ),
            r"sightings, row 0, column beacon_id: \[1\] is not allowed; ",
        ),
        (
            lambda o, s: Log.from_dataframe(pd.concat({"a": o}, axis=1), s, robot=ROBOT),
            r"odometry: column label \('a', 'time_us'\) is not allowed; allowed: texts$",
        ),
        (
            lambda o, s: Log.from_dataframe(pd.concat([o, o], axis=1), s, robot=ROBOT),
            "odometry: DataFrame: .*'left_m' 2 times.*; allowed: a dataframe",
        ),
        (
            lambda o, s: Log.from_dataframe(pl.from_pandas(o).lazy().select("nope"), s, robot=ROBOT),
            'odometry: LazyFrame: .*"nope".*; allowed: a dataframe',
        ),
    ],
)
def test_what_cannot_be_a_log_is_named(call, message) -> None:
    tables = columns()
    with pytest.raises(BslamError, match=message) as refusal:
        call(pd.DataFrame(tables["odometry"]), pd.DataFrame(tables["sightings"]))
    assert "\n" not in str(refusal.value)


def test_robot_may_be_of_any_kind(tmp_path) -> None:
    DRIVE.write(tmp_path)
    settings = {"gate_d2": np.float64(9.0)}
    for robot in (DRIVE.robot, tmp_path / "robot.toml", str(tmp_path / "robot.toml")):
        assert made(pl.DataFrame, columns(), robot).robot == DRIVE.robot
    told = ROBOT | {"step_us": np.int64(40_000), "settings": settings}
    of_numpy = made(pl.DataFrame, columns(), told).robot
    assert of_numpy == Robot(**ROBOT, settings=(("gate_d2", 9.0),)) and type(of_numpy.step_us) is int
