"""A log folder: what is written is read back, and whatever is wrong in one is named."""

import gzip
import math
import os
import time
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bslam.errors import BslamError
from bslam.log import (
    SIGHTING_NUMBERS,
    SIGNATURE_SIZE,
    Beacons,
    Log,
    Odometry,
    Robot,
    Sightings,
    Truth,
    first_steps,
    has_identities,
    wrap_rad,
)

ROBOT = Robot(
    wheelbase_m=0.4,
    wheel_speed_sigma_mps=0.3,
    step_us=40_000,
    field_of_view_rad=math.pi,
    bearing_sigma_rad=0.0136,
    range_sigma_fraction=0.02,
    range_sigma_scale_m=110.9,
)
ENCODERS = {"left_radius_m": 0.05, "right_radius_m": 0.051, "ticks_per_revolution": 1024, "counter_bits": 8}
ROBOT_TOML = (
    "wheelbase_m = 0.4\nwheel_speed_sigma_mps = 0.3\nstep_us = 40000\nfield_of_view_rad = 3.14\n"
    "bearing_sigma_rad = 0.0136\nrange_sigma_fraction = 0.02\nrange_sigma_scale_m = 110.9\n"
)
FILES = {
    "odometry.csv": "time_us,left_m,right_m\n40000,0.01,0.02\n80000,0.0,-0.01\n",
    "sightings.csv": "time_us,beacon_id,bearing_rad,range_m\n0,3,0.5,2.5\n40000,,-0.5,\n40000,4,1.0,3.0\n",
    "truth.csv": "time_us,x_m,y_m,theta_rad\n0,0,0,0\n40000,0.1,0.2,3.0\n",
    "beacons.csv": "beacon_id,x_m,y_m\n3,1.0,2.0\n4,-1.0,0.5\n",
    "robot.toml": ROBOT_TOML,
}


def a_log(
    *,
    kind: str = "wheels",
    robot: Robot = ROBOT,
    beacon_id: tuple[int, ...] = (3, -1, 4),
    range_m: float = 2.5,
) -> Log:
    return Log(
        name="a_log",
        odometry=Odometry(kind, np.array([40_000, 80_000]), np.array([1.0, 2.0]), np.array([3.0, 255.0])),
        sightings=Sightings(
            time_us=np.array([0, 40_000, 40_000]),
            beacon_id=np.array(beacon_id),
            bearing_rad=np.array([0.1, -0.2, math.pi]),
            range_m=np.array([1.0 / 3.0, math.nan, range_m]),
            mappable=np.array([True, False, True]),
        ),
        truth=Truth(
            np.array([0, 40_000]), np.array([0.0, 0.1]), np.array([0.0, 1e-17]), np.array([0.0, -3.0])
        ),
        beacons=Beacons(np.array([3, 4]), np.array([1.0, 2.0]), np.array([0.1, 0.2])),
        robot=robot,
    )


def assert_same_table(one: object, other: object) -> None:
    assert type(one) is type(other)
    if one is None:
        return
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_array_equal(a, b)
            assert a.dtype == b.dtype
        else:
            assert a == b


def assert_same_log(one: Log, other: Log) -> None:
    for name in ("odometry", "sightings", "truth", "beacons", "robot"):
        assert_same_table(getattr(one, name), getattr(other, name))


def write_files(folder: Path, **changed: str | None) -> Path:
    """A good log folder but for the files in `changed`, named with _ for . ; None leaves one out."""
    replaced = {
        name.replace("_csv", ".csv").replace("_toml", ".toml"): text for name, text in changed.items()
    }
    for name, text in {**FILES, **replaced}.items():
        if text is not None:
            (folder / name).write_text(text)
    return folder


@pytest.mark.parametrize("kind", ["wheels", "velocity", "ticks"])
def test_write_then_read_gives_the_same_log(tmp_path: Path, kind: str) -> None:
    log = a_log(kind=kind, robot=replace(ROBOT, **ENCODERS) if kind == "ticks" else ROBOT)
    log.write(tmp_path / "a_log")
    read = Log.read(tmp_path / "a_log")
    assert read.name == "a_log"
    assert_same_log(log, read)


def test_write_then_read_without_truth_map_and_ranges_gives_the_same_log(tmp_path: Path) -> None:
    log = a_log()
    no_range = replace(log.sightings, range_m=np.full(3, math.nan), mappable=np.ones(3, dtype=np.bool_))
    log = replace(log, truth=None, beacons=None, sightings=no_range)
    log.write(tmp_path)
    assert (tmp_path / "sightings.csv").read_text().startswith("time_us,beacon_id,bearing_rad\n")
    assert_same_log(log, Log.read(tmp_path))


def test_write_then_read_keeps_the_noise_and_the_score_that_the_detector_gives(tmp_path: Path) -> None:
    log = a_log()
    values = ([0.01, 0.0, 0.02], [0.1, 0.0, 1.0 / 3.0], [0.07, 0.0, 1.0], [1.3, 0.0, -0.1])
    noise = {name: np.array(column) for name, column in zip(SIGHTING_NUMBERS, values, strict=True)}
    log = replace(log, sightings=replace(log.sightings, **noise))
    log.write(tmp_path)
    assert_same_log(log, Log.read(tmp_path))


def test_write_then_read_keeps_the_gyro_and_where_it_said_nothing(tmp_path: Path) -> None:
    log = a_log()
    log = replace(log, odometry=replace(log.odometry, gyro_radps=np.array([1.0 / 3.0, math.nan])))
    log.write(tmp_path)
    assert_same_log(log, Log.read(tmp_path))
    assert first_steps(log, 1).odometry.gyro_radps == pytest.approx([1.0 / 3.0])
    log = replace(log, odometry=replace(log.odometry, gyro_sd_radps=np.array([0.125, 0.0])))
    log.write(tmp_path)
    assert_same_log(log, Log.read(tmp_path))
    assert first_steps(log, 1).odometry.gyro_sd_radps == pytest.approx([0.125])


finite = st.floats(-1e6, 1e6)


@settings(max_examples=50)
@given(
    travel=st.lists(st.tuples(finite, finite), min_size=1, max_size=20),
    sightings=st.lists(
        st.tuples(
            st.integers(-1, 2**31 - 1),
            st.floats(-math.pi, math.pi, exclude_min=True),
            st.one_of(st.just(math.nan), st.floats(0.0, 1e6, exclude_min=True)),
            st.booleans(),
        ),
        max_size=20,
    ),
)
def test_write_then_read_keeps_every_bit(tmp_path_factory: pytest.TempPathFactory, travel, sightings) -> None:
    folder = tmp_path_factory.mktemp("log")
    time_us = np.arange(1, len(travel) + 1)
    columns = list(zip(*sightings, strict=True)) or [(), (), (), ()]
    log = Log(
        name=folder.name,
        odometry=Odometry("wheels", time_us, *np.array(travel, dtype=np.float64).T),
        sightings=Sightings(
            time_us=np.arange(len(sightings), dtype=np.int64),
            beacon_id=np.array(columns[0], dtype=np.int64),
            bearing_rad=np.array(columns[1], dtype=np.float64),
            range_m=np.array(columns[2], dtype=np.float64),
            mappable=np.array(columns[3], dtype=np.bool_),
        ),
        truth=None,
        beacons=None,
        robot=ROBOT,
    )
    log.write(folder)
    assert_same_log(log, Log.read(folder))


def test_write_replaces_what_was_there(tmp_path: Path) -> None:
    for name in ("odometry.csv.gz", "truth.csv.gz", "truth.csv"):
        (tmp_path / name).write_text("old")
    replace(a_log(), truth=None).write(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "beacons.csv",
        "odometry.csv",
        "robot.toml",
        "sightings.csv",
    ]


def test_write_to_a_place_that_is_a_file_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BslamError, match="cannot write the log there"):
        a_log().write(tmp_path / "file")


def test_read_takes_gzip_any_column_order_crlf_and_a_byte_order_mark(tmp_path: Path) -> None:
    write_files(tmp_path, odometry_csv=None)
    text = "\ufeffright_m,time_us,left_m\r\n0.02,40000,0.01\r\n"
    (tmp_path / "odometry.csv.gz").write_bytes(gzip.compress(text.encode()))
    odometry = Log.read(tmp_path).odometry
    assert (odometry.kind, odometry.time_us.tolist()) == ("wheels", [40_000])
    assert (odometry.a.tolist(), odometry.b.tolist()) == ([0.01], [0.02])


def test_read_takes_an_empty_identity_and_range(tmp_path: Path) -> None:
    sightings = Log.read(write_files(tmp_path)).sightings
    assert sightings.beacon_id.tolist() == [3, -1, 4]
    np.testing.assert_array_equal(sightings.range_m, [2.5, math.nan, 3.0])
    assert sightings.mappable.all()


def test_read_wraps_angles(tmp_path: Path) -> None:
    truth_csv = "time_us,x_m,y_m,theta_rad\n0,0,0,7\n"
    truth = Log.read(write_files(tmp_path, truth_csv=truth_csv)).truth
    assert truth is not None
    assert truth.theta_rad.tolist() == pytest.approx([7.0 - 2.0 * math.pi])


def test_rows_that_a_logger_wrote_twice_are_left_out_and_noted(tmp_path: Path) -> None:
    write_files(
        tmp_path,
        odometry_csv="time_us,left_m,right_m\n40000,0.01,0.02\n40000,0.01,0.02\n80000,0.0,0.0\n80000,0.0,0.0\n",
        sightings_csv="time_us,beacon_id,bearing_rad\n0,3,0.5\n0,4,0.5\n0,3,0.5\n9,3,0.5\n",
        truth_csv="time_us,x_m,y_m\n0,0,0\n0,0,0\n9,1,1\n",
        beacons_csv="beacon_id,x_m,y_m\n3,1,2\n4,1,2\n3,1,2\n",
    )
    log = Log.read(tmp_path)
    assert log.odometry.time_us.tolist() == [40_000, 80_000]
    assert log.sightings.beacon_id.tolist() == [3, 4, 3]
    assert log.truth is not None and log.truth.x_m.tolist() == [0.0, 1.0]
    assert log.beacons is not None and log.beacons.beacon_id.tolist() == [3, 4]
    assert log.notes == (
        f"{tmp_path}/odometry.csv: left out 2 rows equal to one above, first line 3",
        f"{tmp_path}/sightings.csv: left out 1 row equal to one above, first line 4",
        f"{tmp_path}/beacons.csv: left out 1 row equal to one above, first line 4",
        f"{tmp_path}/truth.csv: left out 1 row equal to one above, first line 3",
    )


def test_a_head_that_is_later_than_what_follows_is_left_out_and_noted(tmp_path: Path) -> None:
    head = "900,1,0\n800,1,0\n"
    write_files(
        tmp_path,
        odometry_csv=f"time_us,v_mps,omega_radps\n{head}10,2,0\n20,3,0\n",
        sightings_csv=f"time_us,beacon_id,bearing_rad\n{head}15,2,0\n",
        truth_csv=f"time_us,x_m,y_m\n{head}10,2,0\n",
    )
    np.save(tmp_path / "signatures.npy", np.arange(3 * SIGNATURE_SIZE, dtype=np.float32).reshape(3, -1))
    log = Log.read(tmp_path)
    assert log.odometry.a.tolist() == [2.0, 3.0]
    assert log.sightings.beacon_id.tolist() == [2]
    assert log.sightings.signature is not None and log.sightings.signature[0, 0] == 2 * SIGNATURE_SIZE
    assert log.truth is not None and log.truth.x_m.tolist() == [2.0]
    assert log.notes[0] == (
        f"{tmp_path}/odometry.csv: left out 2 rows at the start: time runs back to line 4, time_us 10"
    )
    assert len(log.notes) == 3
    long_head = "".join(f"{900 + k},1,0\n" for k in range(20))
    write_files(tmp_path, odometry_csv=f"time_us,v_mps,omega_radps\n{long_head}10,2,0\n")
    with pytest.raises(BslamError, match=r"odometry\.csv, line 22, column time_us: '10'"):
        Log.read(tmp_path)


def test_identities_that_are_words_are_kept_as_they_are(tmp_path: Path) -> None:
    write_files(
        tmp_path,
        sightings_csv='time_us,beacon_id,bearing_rad\n0,exit sign,0\n0,"door, left",1\n5, ,1\n9,7.0,0\n',
        beacons_csv="beacon_id,x_m,y_m\nexit sign,1,2\nTür,3,4\n7,0,0\n",
    )
    log = Log.read(tmp_path)
    assert [log.identity(one) for one in log.sightings.beacon_id.tolist()] == [
        "exit sign",
        "door, left",
        "",
        "7",
    ]
    assert log.beacons is not None
    assert [log.identity(one) for one in log.beacons.beacon_id.tolist()] == ["exit sign", "Tür", "7"]
    log.write(tmp_path / "again")
    again = Log.read(tmp_path / "again")
    assert_same_log(log, again)
    assert again.words == log.words
    # Numbers stay the numbers that they are.
    assert Log.read(write_files(tmp_path / "again")).words == ()


@pytest.mark.parametrize("text", ["nan", "-3", "2.5", "1e99", "inf", "x" * 65, "bell\a"])
def test_an_identity_that_is_neither_a_number_nor_a_word_is_refused(tmp_path: Path, text: str) -> None:
    write_files(tmp_path, sightings_csv=f"time_us,beacon_id,bearing_rad\n0,3,0\n0,{text},0\n")
    with pytest.raises(BslamError, match=r"sightings\.csv, line 3, column beacon_id: .*a word of up to 64"):
        Log.read(tmp_path)


def test_one_identity_at_two_places_is_refused(tmp_path: Path) -> None:
    write_files(tmp_path, beacons_csv="beacon_id,x_m,y_m\ndoor,0,0\nsign,0,0\ndoor,0,1\n")
    with pytest.raises(
        BslamError, match=r"line 4, column beacon_id: 'door'.*an identity that no row above has"
    ):
        Log.read(tmp_path)


def test_a_log_without_the_column_of_identities_has_none(tmp_path: Path) -> None:
    write_files(tmp_path, sightings_csv="bearing_rad,time_us\n0.5,0\n")
    log = Log.read(tmp_path)
    assert log.sightings.beacon_id.tolist() == [-1]
    assert not has_identities(log)


@pytest.mark.parametrize(
    "text", ["time_us,x_m,y_m\n0,1,2\n9,3,4\n", "theta_rad,time_us,x_m,y_m\n1,0,1,2\n,9,3,4\n"]
)
def test_a_truth_may_lack_headings(tmp_path: Path, text: str) -> None:
    log = Log.read(write_files(tmp_path, truth_csv=text))
    assert log.truth is not None and log.truth.x_m.tolist() == [1.0, 3.0]
    assert math.isnan(log.truth.theta_rad[1])
    log.write(tmp_path / "again")
    assert_same_log(log, Log.read(tmp_path / "again"))


def test_a_sighting_of_range_alone_is_refused_by_name(tmp_path: Path) -> None:
    write_files(tmp_path, sightings_csv="time_us,beacon_id,bearing_rad,range_m\n0,3,0.1,2\n5,3,,2\n")
    with pytest.raises(
        BslamError, match=r"line 3, column bearing_rad: ''.*a sighting of range alone cannot be"
    ):
        Log.read(tmp_path)


def test_settings_of_the_core_stand_in_a_table_of_robot_toml(tmp_path: Path) -> None:
    write_files(tmp_path, robot_toml=ROBOT_TOML + "[settings]\ngate_d2 = 0\nturn_sd_per_sqrt_m = 0.04\n")
    log = Log.read(tmp_path)
    assert log.robot.settings == (("gate_d2", 0), ("turn_sd_per_sqrt_m", 0.04))
    log.write(tmp_path / "again")
    assert_same_log(log, Log.read(tmp_path / "again"))
    write_files(tmp_path, robot_toml=ROBOT_TOML + "[settings]\ngate_d2 = 'none'\n")
    with pytest.raises(
        BslamError, match=r"robot\.toml, key settings: .*a table of the core's settings, each a"
    ):
        Log.read(tmp_path)


def test_a_file_that_unpacks_to_more_than_there_is_room_for_is_refused(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("bslam.parsing.csvtable.BYTES_MAX", 1 << 20)
    write_files(tmp_path, odometry_csv=None)
    (tmp_path / "odometry.csv.gz").write_bytes(gzip.compress(b"0" * (2 << 20)))
    with pytest.raises(
        BslamError, match=r"odometry\.csv\.gz: it holds more than 1 MB of text; allowed: at most"
    ):
        Log.read(tmp_path)


@given(st.floats(-100.0, 100.0))
def test_wrap_rad_gives_the_same_direction_in_range(angle_rad: float) -> None:
    wrapped = float(wrap_rad(np.array([angle_rad]))[0])
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle_rad) == pytest.approx(1.0)
    if -math.pi < angle_rad <= math.pi:
        assert wrapped == angle_rad


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        # what is missing or doubled
        ({"odometry_csv": None}, r"odometry\.csv is missing; a log needs odometry\.csv or odometry\.csv\.gz"),
        ({"sightings_csv": None}, r"sightings\.csv is missing"),
        ({"robot_toml": None}, r"robot\.toml is missing; .* with wheelbase_m, .*; docs/LOG-FORMAT\.md"),
        # columns
        (
            {"odometry_csv": "time_us,left_m\n1,2\n"},
            r"odometry\.csv, line 1: columns 'time_us,left_m' .*allowed: time_us,left_m,right_m or ",
        ),
        ({"odometry_csv": ""}, r"odometry\.csv: is empty; allowed: columns time_us,left_m,right_m or "),
        (
            {"odometry_csv": "time_us,left_m,right_m,left_m\n"},
            r"odometry\.csv, line 1.*'left_m' is there twice$",
        ),
        (
            {"odometry_csv": "time_us,left_m,right_m,foo,yaw\n"},
            r"csv, line 1: .*; not one of them: 'foo', 'yaw'$",
        ),
        ({"odometry_csv": ",time_us,left_m,right_m\n"}, r"column 1 has no name: of pandas\? .*index=False"),
        (
            {"odometry_csv": "time_us;left_m;right_m\n1;0,5;0,5\n"},
            r"commas separate columns, not ';', and 0\.5 is written with a point$",
        ),
        (
            {"sightings_csv": "time_us,beacon_id,range_m\n"},
            r"sightings\.csv, line 1.*perhaps beacon_id,range_m,mappable.*a sighting of range alone cannot",
        ),
        # rows
        ({"odometry_csv": "time_us,left_m,right_m\n"}, r"odometry\.csv: no rows below the header"),
        (
            {"odometry_csv": "time_us,left_m,right_m\n1,2,3\n2,3\n"},
            r"odometry\.csv, line 3: '2,3' has 2 fields.* 3",
        ),
        ({"odometry_csv": "time_us,left_m,right_m\n1,2,3\n\n"}, r"odometry\.csv, line 3: '' has 1 fields"),
        # fields
        (
            {"odometry_csv": "time_us,left_m,right_m\n1,2,3\n2,x,3\n"},
            r"odometry\.csv, line 3, column left_m: 'x' is not allowed; allowed: a number from -1e6 to 1e6",
        ),
        ({"odometry_csv": "time_us,left_m,right_m\n1,2,nan\n"}, r"line 2, column right_m: 'nan'"),
        ({"odometry_csv": "time_us,left_m,right_m\n1,inf,2\n"}, r"line 2, column left_m: 'inf'"),
        ({"odometry_csv": "time_us,left_m,right_m\n1,,2\n"}, r"line 2, column left_m: ''"),
        (
            {"odometry_csv": "time_us,left_m,right_m\n1.5,1,2\n"},
            r"line 2, column time_us: '1.5'.*an integer from 0",
        ),
        ({"odometry_csv": "time_us,left_m,right_m\n-1,1,2\n"}, r"line 2, column time_us: '-1'"),
        ({"sightings_csv": "time_us,beacon_id,bearing_rad\n0,-1,0\n"}, r"column beacon_id: '-1'.*or empty"),
        (
            {"sightings_csv": "time_us,beacon_id,bearing_rad\n0,3000000000,0\n"},
            r"sightings\.csv, line 2, column beacon_id: '3000000000'.*an integer from 0 to 2147483647",
        ),
        ({"beacons_csv": "beacon_id,x_m,y_m\n2147483648,0,0\n"}, r"beacon_id: '2147483648'.*2147483647"),
        (
            {"truth_csv": "time_us,x_m,y_m,theta_rad\n"},
            r"truth\.csv: no rows below the header; allowed: .*one",
        ),
        (
            {"truth_csv": "time_us,x_m,y_m,theta_rad\n0,1e300,0,0\n"},
            r"truth\.csv, line 2, column x_m: '1e300'.*from -1e6 to 1e6",
        ),
        (
            {"odometry_csv": "time_us,v_mps,omega_radps\n0,0,-1000001\n"},
            r"column omega_radps: '-1000001'.*from -1e6 to 1e6",
        ),
        (
            {"sightings_csv": "time_us,beacon_id,bearing_rad,range_m\n0,1,0,1e9\n"},
            r"column range_m: '1e9'.*at most 1e6",
        ),
        ({"sightings_csv": "time_us,beacon_id,bearing_rad\n0,1,45\n"}, r"column bearing_rad: '45'.*radians"),
        (
            {"sightings_csv": "time_us,beacon_id,bearing_rad,range_m\n0,1,0,0\n"},
            r"column range_m: '0'.*above 0",
        ),
        ({"sightings_csv": "time_us,beacon_id,bearing_rad,range_m\n0,1,0,nan\n"}, r"column range_m: 'nan'"),
        (
            {"sightings_csv": "time_us,beacon_id,bearing_rad,mappable\n0,1,0,2\n"},
            r"column mappable: '2'.*0 or 1",
        ),
        (
            {"sightings_csv": "time_us,beacon_id,bearing_rad,bearing_sd_rad\n0,1,0,-0.1\n"},
            r"column bearing_sd_rad: '-0.1'.*0 or radians from 1e-5",
        ),
        (
            {"sightings_csv": "time_us,beacon_id,bearing_rad,range_sd_m\n0,1,0,nan\n"},
            r"column range_sd_m: 'nan'.*0 or a number from 0.001",
        ),
        (
            {"beacons_csv": "beacon_id,x_m,y_m\n1,0,0\n1,1,1\n"},
            r"beacons\.csv, line 3, column beacon_id: '1'",
        ),
        ({"beacons_csv": "beacon_id,x_m,y_m\n,0,0\n"}, r"beacons\.csv, line 2, column beacon_id: ''"),
        # order
        ({"odometry_csv": "time_us,left_m,right_m\n5,0,0\n5,0,1\n"}, r"line 3, column time_us: '5'.*above"),
        (
            {"odometry_csv": "time_us,left_m,right_m\n5,0,0\n5,0,0\n9,0,0\n8,0,0\n"},
            r"line 5, column time_us: '8'.*above",
        ),
        (
            {"sightings_csv": "time_us,beacon_id,bearing_rad\n5,1,0\n7,1,0\n6,1,0\n"},
            r"line 4, column time_us: '6'",
        ),
        (
            {"truth_csv": "time_us,x_m,y_m,theta_rad\n5,0,0,0\n5,0,0,1\n"},
            r"truth\.csv, line 3, column time_us",
        ),
        # ticks
        (
            {"odometry_csv": "time_us,left_ticks,right_ticks\n5,0,0\n"},
            r"odometry\.csv: ticks need left_radius_m",
        ),
        (
            {
                "odometry_csv": "time_us,left_ticks,right_ticks\n5,0,256\n",
                "robot_toml": ROBOT_TOML + "".join(f"{key} = {value}\n" for key, value in ENCODERS.items()),
            },
            r"odometry\.csv, line 2, column right_ticks: '256'.*from 0 to 255",
        ),
        # robot.toml
        ({"robot_toml": "wheelbase_m ="}, r"robot\.toml: not TOML"),
        (
            {"robot_toml": ROBOT_TOML + "wheel_base = 1\n"},
            r"robot\.toml, key wheel_base: no such key; .*wheelbase_m",
        ),
        ({"robot_toml": ROBOT_TOML.replace("step_us", "# ")}, r"robot\.toml, key step_us: is missing"),
        (
            {"robot_toml": ROBOT_TOML.replace("40000", "0.04")},
            r"key step_us: 0\.04 is not .*an integer from 1",
        ),
        (
            {"robot_toml": ROBOT_TOML.replace("= 0.4", "= 40")},
            r"robot\.toml, key wheelbase_m: 40 is not allowed; allowed: a number from 0\.001 to 10",
        ),
        ({"robot_toml": ROBOT_TOML.replace("= 0.4", "= true")}, r"key wheelbase_m: True is not allowed"),
        ({"robot_toml": ROBOT_TOML.replace("= 0.4", "= nan")}, r"key wheelbase_m: nan is not allowed"),
        (
            {"robot_toml": ROBOT_TOML.replace("= 0.4", "= " + "9" * 400)},
            r"key wheelbase_m: 9+ is not allowed",
        ),
        ({"robot_toml": ROBOT_TOML.replace("3.14", "180")}, r"key field_of_view_rad: 180 is not .*full turn"),
        (
            {"robot_toml": ROBOT_TOML + "counter_bits = 16\n"},
            r"key left_radius_m: is missing; allowed: all of",
        ),
    ],
)
def test_read_of_a_bad_folder_names_the_place(
    tmp_path: Path, changed: dict[str, str | None], expected: str
) -> None:
    with pytest.raises(BslamError, match=expected):
        Log.read(write_files(tmp_path, **changed))


def test_read_of_no_folder_says_what_a_log_is(tmp_path: Path) -> None:
    with pytest.raises(BslamError, match="no such folder; a log is a folder with"):
        Log.read(tmp_path / "nothing")


def test_read_of_a_table_that_is_there_twice_says_so(tmp_path: Path) -> None:
    write_files(tmp_path)
    (tmp_path / "truth.csv.gz").write_bytes(b"")
    with pytest.raises(BslamError, match=r"both truth\.csv and truth\.csv\.gz"):
        Log.read(tmp_path)


def test_read_of_a_table_named_in_capitals_says_so(tmp_path: Path) -> None:
    write_files(tmp_path)
    (tmp_path / "truth.csv").rename(tmp_path / "Truth.CSV")
    with pytest.raises(BslamError, match=r"Truth\.CSV: is no name of a log's file; allowed: truth\.csv$"):
        Log.read(tmp_path)


def test_read_of_a_link_to_a_table_that_is_gone_says_so(tmp_path: Path) -> None:
    write_files(tmp_path)
    (tmp_path / "truth.csv").unlink()
    (tmp_path / "truth.csv").symlink_to(tmp_path / "gone.csv")
    with pytest.raises(BslamError, match=r"truth\.csv: is no file; allowed: a file, or none of that name$"):
        Log.read(tmp_path)


@pytest.mark.parametrize(
    "content", [b"", b"not gzip", gzip.compress(b"time_us")[:-3], gzip.compress(b"\xff\xfe")]
)
def test_read_of_a_broken_gzip_file_names_it(tmp_path: Path, content: bytes) -> None:
    write_files(tmp_path, odometry_csv=None)
    (tmp_path / "odometry.csv.gz").write_bytes(content)
    with pytest.raises(BslamError, match=r"odometry\.csv\.gz(: cannot be read|, line 1|: is empty)"):
        Log.read(tmp_path)


def test_read_of_a_robot_toml_that_is_not_utf8_names_it(tmp_path: Path) -> None:
    (write_files(tmp_path) / "robot.toml").write_bytes(b"# m\xe8tres\n")
    with pytest.raises(BslamError, match=r"robot\.toml: cannot be read: .*allowed: a UTF-8 text file"):
        Log.read(tmp_path)


def reference_logs() -> list[Path]:
    data = Path(os.environ.get("BSLAM_DATA", Path(__file__).parents[3] / "shared" / "data"))
    return sorted((data / "paper_room").glob("paper_room_*"))


def test_read_of_the_reference_logs_is_complete_and_quick() -> None:
    logs = reference_logs()
    if not logs:
        pytest.skip("no reference logs: set BSLAM_DATA to a directory that has paper_room/")
    begin_s = time.process_time()
    read = [Log.read(path) for path in logs]
    assert (time.process_time() - begin_s) / len(logs) < 0.5  # a run has two seconds for everything
    for log in read:
        assert log.odometry.kind == "wheels"
        assert len(log.odometry.time_us) == 5000
        assert log.truth is not None
        assert len(log.truth.time_us) == 5001
        assert log.beacons is not None
        assert log.beacons.beacon_id.tolist() == [0, 1, 2, 3, 4, 5]
        assert log.sightings.time_us[0] == 0


def with_looks(log: Log) -> Log:
    """Signatures, one a sighting, and two seeds."""
    random = np.random.default_rng(5)
    signature = random.random((len(log.sightings.time_us), SIGNATURE_SIZE)).astype(np.float32)
    seeds = random.random((2, SIGNATURE_SIZE)).astype(np.float32)
    return replace(log, sightings=replace(log.sightings, signature=signature), seeds=seeds)


def test_signatures_and_seeds_are_kept_to_the_bit(tmp_path: Path) -> None:
    log = with_looks(a_log())
    log.write(tmp_path)
    back = Log.read(tmp_path)
    np.testing.assert_array_equal(back.sightings.signature, log.sightings.signature)
    np.testing.assert_array_equal(back.seeds, log.seeds)
    a_log().write(tmp_path)  # a log without takes them away
    assert Log.read(tmp_path).sightings.signature is None
    assert Log.read(tmp_path).seeds is None


@pytest.mark.parametrize(
    ("name", "allowed"), [("signatures.npy", "as many rows"), ("seeds.npy", "k up to 128")]
)
@pytest.mark.parametrize("fault", ["rows", "columns", "dtype", "nan", "inf", "text", "pickle"])
def test_looks_that_are_not_what_they_should_be_are_refused(
    tmp_path: Path, name: str, allowed: str, fault: str
) -> None:
    log = with_looks(a_log())
    log.write(tmp_path)
    good = np.load(tmp_path / name)
    bad: object = {
        "rows": np.ones((200, SIGNATURE_SIZE), np.float32),
        "columns": good[:, 1:],
        "dtype": good.astype(np.float64),
        "nan": np.where(np.arange(SIGNATURE_SIZE) == 3, np.float32(np.nan), good),
        "inf": np.where(np.arange(SIGNATURE_SIZE) == 70, np.float32(np.inf), good),
        "text": None,
        "pickle": np.array([{}], dtype=object),
    }[fault]
    if bad is None:
        (tmp_path / name).write_text("no numbers")
    else:
        np.save(tmp_path / name, bad)
    with pytest.raises(BslamError, match=name) as refusal:
        Log.read(tmp_path)
    assert ("finite" if fault in ("nan", "inf") else allowed) in str(refusal.value)
