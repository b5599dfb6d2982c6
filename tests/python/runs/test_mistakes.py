"""Mistakes of new users, each met by one line that says what, where, what is allowed, and the nearest name.

From the command line nothing is run and nothing written; a slip in a log is named by `bslam check`.
"""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bslam.cli import main
from bslam.core import Slam
from bslam.core.raw import library
from bslam.core.vision import FrontEnd
from bslam.errors import BslamError, did_you_mean
from bslam.log import Log
from bslam.logcheck.check import check_log
from bslam.rig import load_rig
from logcheck.drives import made_up, with_odometry, with_sightings

ROOT = Path(__file__).resolve().parents[3]
SCENARIO = ROOT / "host_sim/bslam/scenarios/figure3.toml"
MODEL = ROOT / "firmware/models/own_room.json"
LOG = made_up(seconds=30.0)


def line_of(words, capsys):
    """The one line on stderr of a command that ends with 2."""
    try:
        status = main(words)
    except SystemExit as error:
        status = error.code
    written = capsys.readouterr()
    assert status == 2
    assert written.out == ""
    (line,) = written.err.splitlines()
    assert line.startswith(f"bslam {words[0]}: error: ")
    return line


@pytest.mark.parametrize(
    ("words", "allowed", "near"),
    [
        ("run paper_room --set bearing_sd_rat=1", "range_sd_fraction", "bearing_sd_rad"),
        ("rnu paper_room", "run, replay", "run"),
        ("run paper_room --obsevation direction", "--association", "--observation"),
        ("run paper_room --obsevation=direction", "--association", "--observation"),
        ("run paper_rom", "pairs, paper_room", "paper_room"),
        ("run mine.toml", "diameter_m, wheelbase_m", "wheelbase_m"),
        ("run paper_room --preset papr", "real-wheels, paper", "paper"),
        ("run paper_room --association svn", "known:RATE", "svm"),
        ("run paper_room --motion eulr", "euler, arc", "euler"),
        ("run paper_room --target /dev/ttyUSB0", "serial:DEVICE", "serial:/dev/ttyUSB0"),
        ("console COM3", "serial:DEVICE", "serial:COM3"),
        ("run paper_room --target qemu:mps2_an38", "qemu:microbit", "qemu:mps2_an386"),
        ("scenario shw mine.toml", "new, check, show", "show"),
        ("stress paper_room --rows slps", "delay", "slip"),
        ("compare paper_room --only bslm", "dead_reckoning", "bslam"),
    ],
)
def test_misspelt_word_gets_what_is_allowed_and_the_nearest_one(
    words, allowed, near, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    text = SCENARIO.read_text().replace("wheelbase_m", "wheelbas_m")
    (tmp_path / "mine.toml").write_text(text)
    line = line_of(words.split(), capsys)
    assert "; allowed: " in line
    assert allowed in line.split("; allowed: ")[1]
    assert line.endswith(f"; did you mean '{near}'?")
    assert [one.name for one in tmp_path.iterdir()] == ["mine.toml"]


def test_word_that_is_like_none_gets_no_guess(capsys):
    assert did_you_mean("zebra", ("run", "replay")) == ""
    assert line_of(["zebra"], capsys).endswith("faults, params")


def test_word_too_many_is_named(capsys):
    line = line_of(["run", "paper_room", "pairs"], capsys)
    assert "'pairs' is one word too many; `bslam run --help`" in line


@pytest.mark.parametrize(
    ("text", "allowed"),
    [("bearing_sd_rad=50", "a number from 0.0001 to 3.2"), ("filter=1.5", "a whole number from 0 to 2")],
)
def test_parameter_beyond_its_range_is_refused_before_anything_is_written(
    text, allowed, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    name, value = text.split("=")
    line = line_of(["run", "paper_room", "--set", text], capsys)
    assert line.endswith(f"--set: parameter {name} = {value}; allowed: {allowed}")
    (tmp_path / "mine.toml").write_text(text.replace("=", " = "))
    line = line_of(["run", "paper_room", "--params", "mine.toml"], capsys)
    assert line.endswith(f"--params mine.toml: parameter {name} = {value}; allowed: {allowed}")
    assert [one.name for one in tmp_path.iterdir()] == ["mine.toml"]


def test_log_without_identities_names_the_methods_that_need_none(capsys, tmp_path):
    log = with_sightings(LOG, beacon_id=np.full(len(LOG.sightings.time_us), -1))
    log.write(tmp_path / "log")
    words = ["--association", "known", "--pictures", "0", "--jobs", "1", "--out", str(tmp_path / "out")]
    assert main(["replay", "csv", str(tmp_path / "log"), *words]) == 1
    needs_none = "log: no sighting has an identity: --association mahalanobis, joint or nearest needs none\n"
    assert needs_none in "".join(capsys.readouterr())


def test_log_without_sightings_says_that_odometry_is_alone() -> None:
    nothing = {name: None if one is None else one[:0] for name, one in vars(LOG.sightings).items()}
    assert "nothing but odometry tells where" in str(with_sightings(LOG, **nothing).run())


def in_nanoseconds(log: Log) -> Log:
    """Both tables, as ROS stamps them."""
    late = with_sightings(log, time_us=1000 * log.sightings.time_us)
    return with_odometry(late, time_us=1000 * log.odometry.time_us)


@pytest.mark.parametrize(
    ("slip", "what", "mend"),
    [
        (
            lambda log: with_sightings(log, range_m=1e3 * log.sightings.range_m),
            "sightings.csv: range_m is in millimetres",
            "multiply range_m by 0.001",
        ),
        (
            lambda log: with_odometry(log, a=1e3 * log.odometry.a, b=1e3 * log.odometry.b),
            "odometry: left_m and right_m are in millimetres",
            "multiply left_m and right_m by 0.001",
        ),
        (
            lambda log: with_sightings(log, bearing_rad=np.degrees(log.sightings.bearing_rad)),
            "sightings.csv: bearing_rad is in degrees",
            "multiply bearing_rad of sightings.csv by pi/180 = 0.0174533",
        ),
        (
            lambda log: with_sightings(log, bearing_rad=-log.sightings.bearing_rad),
            "bearings are mirrored",
            "multiply bearing_rad of sightings.csv by -1",
        ),
        (
            lambda log: with_odometry(log, a=log.odometry.b, b=log.odometry.a),
            "left and right wheel are swapped",
            "exchange the columns left_m and right_m",
        ),
        (
            in_nanoseconds,
            "odometry.csv: time_us is in nanoseconds",
            "multiply time_us of odometry.csv by 0.001",
        ),
    ],
)
def test_slip_in_a_log_is_named_with_what_mends_it(slip, what, mend, capsys, tmp_path):
    slip(LOG).write(tmp_path / "log")
    assert main(["check", str(tmp_path / "log"), "--out", str(tmp_path / "out")]) == 1
    said = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert any(line.startswith("found: ") and line.endswith(what) for line in said)
    assert f"mend: {mend}" in said


def test_degrees_are_refused_by_the_reader_with_the_factor(capsys, tmp_path):
    log = with_sightings(LOG, bearing_rad=np.degrees(LOG.sightings.bearing_rad))
    log.write(tmp_path / "log")
    assert main(["replay", "csv", str(tmp_path / "log"), "--jobs", "1", "--out", str(tmp_path / "out")]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert "sightings.csv, line 2, column bearing_rad: " in line
    assert "allowed: radians from -2 pi to 2 pi, which are degrees times pi/180" in line


@pytest.mark.parametrize(
    ("slip", "said"),
    [
        (
            lambda log: with_sightings(log, bearing_rad=-log.sightings.bearing_rad),
            "sightings gated; `bslam check` tells a log's slips",
        ),
        (in_nanoseconds, "in refused frames; `bslam check` tells a log's slips"),
        (
            lambda log: with_sightings(log, range_m=1e3 * log.sightings.range_m),
            "half of the distances are above 100 m: `bslam check` tells a log in millimetres",
        ),
    ],
)
def test_replay_of_a_log_with_a_slip_leads_to_the_check(slip, said, capsys, tmp_path):
    slip(LOG).write(tmp_path / "log")
    words = ["--pictures", "0", "--jobs", "1", "--out", str(tmp_path / "out")]
    main(["replay", "csv", str(tmp_path / "log"), *words])
    assert said in "".join(capsys.readouterr())


def message_of(call):
    """What a call is refused with: one line."""
    with pytest.raises(BslamError) as refused:
        call()
    (line,) = str(refused.value).splitlines()
    return line


def test_unequal_lists_are_named_with_the_length_that_is_allowed():
    line = message_of(lambda: Slam().sightings(1000, [0.1, 0.2], [2.0], [7, 8], [True, True]))
    assert "range_m" in line and "allowed: 2" in line


def test_whole_floats_are_labels_and_others_are_named():
    slam = Slam()
    slam.odometry("wheels", 0, 0.0, 0.0)
    (account,) = slam.sightings(1000, [0.1], [2.0], [7.0], [True])
    assert account.result == "new"
    line = message_of(lambda: slam.sightings(2000, [0.1], [2.0], [7.5], [True]))
    assert "sighting 0: label 7.5" in line and "a whole number" in line


def test_misspelt_setting_in_python_is_named():
    line = message_of(lambda: Slam({"wheelbas_m": 0.3}))
    assert "'wheelbas_m' does not exist" in line and "wheelbase_m" in line
    line = message_of(lambda: Slam({"wheelbase_m": 300.0}))
    assert "wheelbase_m = 300" in line and "0.001 to 10" in line


def test_picture_of_another_shape_is_named_with_those_that_are_allowed():
    (camera, *_) = load_rig("three60").cameras
    line = message_of(lambda: FrontEnd([camera]).see(np.zeros((480, 640, 3), np.uint8)))
    assert "shape (480, 640, 3)" in line
    assert "(240, 320, 3) uint8, or (240, 320) uint16" in line


def test_model_of_another_version_is_named(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    document = json.loads(MODEL.read_text())
    Path("other.json").write_text(json.dumps(document | {"version": document["version"] + 1}))
    shutil.copytree(ROOT / "docs/img/scenarios", "pictures")
    line = line_of(["detect", "run", "pictures", "--model", "other.json"], capsys)
    version = document["version"]
    assert f"other.json, key version: {version + 1} is not allowed; allowed: {version}" in line


def test_sizes_that_differ_are_refused_and_nothing_is_written():
    raw = library("float", 20)
    lib, ffi = raw.lib, raw.ffi
    settings, robot, bad = ffi.new("bslam_settings_t *"), ffi.new("bslam_t *"), ffi.new("int *", -1)
    lib.bslam_settings_preset(settings, lib.BSLAM_PRESET_REAL_WHEELS)
    size, sizes = ffi.sizeof("bslam_t"), lib.BSLAM_SIZES_HASH
    for wrong in ((size - 8, sizes), (size, sizes ^ 1)):
        status = lib.bslam_init_sized(robot, *wrong, settings, bad)
        assert raw.text(lib.bslam_status_name(status)) == "BSLAM_E_SIZE"
        assert bytes(ffi.buffer(robot)) == bytes(size)
    assert lib.bslam_init_sized(robot, size, sizes, settings, bad) == lib.BSLAM_OK


def test_a_log_as_it_should_be_has_none_of_these():
    assert [one for one in check_log(replace(LOG, name="good")).findings if not one.is_note] == []
