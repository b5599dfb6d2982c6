"""`bslam check` from outside, and what it says of files that the strict reader refuses."""

import json
import re
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest

from bslam.cli import main
from bslam.log import Log, Robot
from logcheck.drives import made_up, with_sightings

DOCS = Path(__file__).resolve().parents[3] / "docs"
STARRED = r"`(\w+)` \\\*"


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "drive"
    made_up(seconds=40.0).write(path)
    return path


def check(tmp_path, *words):
    out = tmp_path / "out"
    status = main(["check", *map(str, words), "--out", str(out)])
    return status, json.loads((out / "summary.json").read_text())["logs"], out


def edit(path, change):
    """Rewrite the rows below the header, each a list of texts."""
    head, *lines = path.read_text().splitlines()
    rows = change([line.split(",") for line in lines], head.split(","))
    path.write_text("\n".join([head, *(",".join(row) for row in rows)]) + "\n")


def scale(column, factor, whole=False):
    def change(rows, head):
        place = head.index(column)
        for row in rows:
            value = factor * float(row[place])
            row[place] = str(round(value)) if whole else repr(value)
        return rows

    return change


def test_check_a_good_folder_exits_0_and_writes_the_summary(folder, tmp_path, capsys):
    status, (entry,), out = check(tmp_path, folder)
    assert status == 0
    assert entry["name"] == "drive" and entry["findings"] == [] and entry["not_tested"] == []
    assert set(entry["estimates"]) == {"way", "turn", "bend", "yaw", "delay"}
    assert "drive: 0 findings" in capsys.readouterr().out
    assert [path.name for path in out.iterdir()] == ["summary.json"]


def test_check_leaves_no_picture_of_an_earlier_check(folder, tmp_path):
    turned = tmp_path / "turned"
    log = made_up(seconds=40.0)
    with_sightings(log, bearing_rad=-log.sightings.bearing_rad).write(turned)
    _, _, out = check(tmp_path, turned)
    (out / "mine.1.png").write_bytes(b"")
    assert (out / "turned.1.png").exists()
    check(tmp_path, folder)
    assert sorted(path.name for path in out.iterdir()) == ["mine.1.png", "summary.json"]


def test_check_a_finding_exits_1_with_a_picture_and_what_mends_it(folder, tmp_path, capsys):
    log = made_up(seconds=40.0)
    with_sightings(log, bearing_rad=-log.sightings.bearing_rad).write(folder)
    status, (entry,), out = check(tmp_path, "csv", folder)
    assert status == 1
    (found,) = entry["findings"]
    assert found["kind"] == "mirrored bearings"
    assert (out / found["picture"]).read_bytes().startswith(b"\x89PNG")
    said = capsys.readouterr().out
    assert "bearings are mirrored" in said and "multiply bearing_rad of sightings.csv by -1" in said


def test_check_says_how_a_mend_is_applied_and_tests_again_with_it(folder, tmp_path, capsys):
    log = made_up(seconds=40.0)
    with_sightings(log, time_us=log.sightings.time_us + 300_000).write(folder)
    _, (entry,), _ = check(tmp_path, folder)
    said = capsys.readouterr().out
    assert "options of `bslam replay csv DIR`" in said and "under [settings] of robot.toml" in said
    (found,) = entry["findings"]
    assert check(tmp_path, folder, *found["mend"].split())[0] == 0
    assert "replay" not in capsys.readouterr().out
    robot = folder / "robot.toml"
    robot.write_text(f"{robot.read_text()}\n[settings]\n{found['mend'].removeprefix('--set ')}\n")
    assert check(tmp_path, folder)[0] == 0


def test_check_a_setting_that_it_does_not_look_at_is_refused(folder, capsys):
    assert main(["check", str(folder), "--set", "gate_d2=9"]) == 2
    assert "allowed: forward_scale, turn_scale, sighting_delay_us" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["check"], ["replay", "csv"]])
def test_check_and_replay_refuse_sightings_that_wait_for_odometry_as_robot_toml_does(command, folder, capsys):
    assert main([*command, str(folder), "--set", "sighting_delay_us=-50000"]) == 2
    said = capsys.readouterr().err
    assert "add 50000 to time_us of sightings.csv" in said and "allowed: an integer from 0" in said


def test_check_several_logs_in_one_go(folder, tmp_path):
    other = tmp_path / "other"
    made_up(1, seconds=40.0).write(other)
    assert [entry["name"] for entry in check(tmp_path, folder, other)[1]] == ["drive", "other"]


def test_check_a_recording_is_a_log_too(folder, tmp_path):
    assert main(["export", str(folder), "--format", "mcap", "--out", str(tmp_path)]) == 0
    status, (entry,), _ = check(tmp_path, tmp_path / "drive.mcap")
    assert status == 0 and entry["estimates"]["turn"]["value"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("words", [["nowhere"], ["csv"], ["csv", "nowhere"], ["nowhere.mcap"]])
def test_check_bad_input_exits_2_and_says_what_is_allowed(words, tmp_path, capsys):
    assert main(["check", *words, "--out", str(tmp_path)]) == 2
    assert "allowed:" in capsys.readouterr().err.splitlines()[-1]


def test_check_a_broken_file_exits_2_with_its_own_name(folder, tmp_path, capsys):
    edit(folder / "odometry.csv", lambda rows, _: [[rows[0][0], "x", rows[0][2]], *rows[1:]])
    assert main(["check", str(folder), "--out", str(tmp_path / "out")]) == 2
    assert f"{folder / 'odometry.csv'}, line 2" in capsys.readouterr().err


def test_check_a_log_without_a_robot_says_what_that_holds_and_where_one_to_copy_is(folder, tmp_path, capsys):
    robot = folder / "robot.toml"
    text = (DOCS / "LOG-FORMAT.md").read_text(encoding="utf-8")
    robot.unlink()
    assert main(["check", str(folder), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert f"{folder}: robot.toml is missing; allowed: lines of KEY = VALUE with wheelbase_m, " in said
    (example,) = re.findall(
        r"^```toml\n(.*?)^```$", text.partition("## Your own robot's log")[2], re.M | re.S
    )
    required = {key for row in re.findall(r"^\| (`.*?) \|", text, re.M) for key in re.findall(STARRED, row)}
    assert required == {one.name for one in fields(Robot) if one.default is MISSING}
    assert all(key in said and key in example for key in required)
    robot.write_text(example)
    Log.read(folder)


SLIPS = {
    "degrees": ("sightings.csv", scale("bearing_rad", 180.0 / np.pi), "bearing_rad is in degrees"),
    "milliseconds": ("sightings.csv", scale("time_us", 1e-3, True), "time_us is in milliseconds"),
    "seconds": ("odometry.csv", scale("time_us", 1e-6), "time_us is in seconds"),
    "repeated": ("odometry.csv", lambda rows, _: [*rows[:300], *rows[297:]], "3 of 1003 rows come again"),
    "backward": ("sightings.csv", lambda rows, _: [*rows[300:], *rows[:300]], "run back in time"),
    "gap": ("odometry.csv", lambda rows, _: [*rows[:500], *rows[600:]], "1 gaps, 4.0 s without odometry"),
}


@pytest.mark.parametrize("name", SLIPS)
def test_check_slips_of_single_files_are_named_and_the_rest_is_tested(name, folder, tmp_path):
    file, change, what = SLIPS[name]
    edit(folder / file, change)
    before = (folder / file).read_bytes()
    status, (entry,), _ = check(tmp_path, folder)
    assert status == 1
    assert what in entry["findings"][0]["what"]
    assert all(one["kind"] in ("stamps", "degrees") for one in entry["findings"])
    assert entry["estimates"]["turn"]["value"] == pytest.approx(1.0, abs=0.05)
    assert (folder / file).read_bytes() == before  # the log itself stays as it is


def test_check_both_files_in_milliseconds_are_named(folder, tmp_path):
    for file in ("odometry.csv", "sightings.csv"):
        edit(folder / file, scale("time_us", 1e-3, True))
    _, (entry,), _ = check(tmp_path, folder)
    assert [one["mend"] for one in entry["findings"]] == [
        "multiply time_us of odometry.csv by 1000",
        "multiply time_us of sightings.csv by 1000",
    ]


def write_mrclam(folder, bearing):
    """The drive as a set of that collection: robot 1, barcodes 10 to 17 on landmarks 6 to 13."""
    log = made_up(kind="velocity")
    folder.mkdir()
    o, s, b = log.odometry, log.sightings, log.beacons
    columns = {
        "Robot1_Odometry": (1e-6 * o.time_us, np.append(o.a[1:], 0.0), np.append(o.b[1:], 0.0)),
        "Robot1_Measurement": (1e-6 * s.time_us, s.beacon_id + 10, s.range_m, bearing * s.bearing_rad),
        "Barcodes": (np.arange(6, 14), np.arange(10, 18)),
        "Landmark_Groundtruth": (b.beacon_id + 6, b.x_m, b.y_m, 0 * b.x_m, 0 * b.x_m),
    }
    for name, values in columns.items():
        np.savetxt(folder / f"{name}.dat", np.column_stack(values), fmt="%.12g")


@pytest.mark.parametrize("words", [["mrclam"], []])
def test_check_a_set_of_mrclam_is_read_as_replay_reads_it(words, tmp_path):
    write_mrclam(tmp_path / "set", bearing=-1.0)
    status, (entry,), _ = check(tmp_path, *words, tmp_path / "set", "--robot", "1")
    assert status == 1
    assert entry["name"] == "set_robot1"
    assert "mirrored bearings" in [one["kind"] for one in entry["findings"]]
