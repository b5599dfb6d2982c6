"""`log.check()`, `log.run()` and `bslam.plot()` are what the commands say of the same log."""

import json
from dataclasses import replace

import numpy as np
import pytest

import bslam
from api.tables import DRIVE
from bslam import BslamError, Log, Slam
from bslam.cli import main

TOLD_WRONG = replace(DRIVE, sightings=replace(DRIVE.sightings, bearing_rad=-DRIVE.sightings.bearing_rad))


def test_check_prints_what_the_command_does(tmp_path, capsys) -> None:
    folder = tmp_path / DRIVE.name
    TOLD_WRONG.write(folder)
    assert main(["check", str(folder), "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().out
    report = TOLD_WRONG.check()
    assert said.startswith(f"{report}\n")
    assert [one.kind for one in report.findings] == ["mirrored bearings"]


def test_check_tests_stamps_as_of_files() -> None:
    nanoseconds = replace(
        DRIVE,
        odometry=replace(DRIVE.odometry, time_us=1000 * DRIVE.odometry.time_us),
        sightings=replace(DRIVE.sightings, time_us=1000 * DRIVE.sightings.time_us),
        truth=None,
    )
    assert any("time_us is in nanoseconds" in one.what for one in nanoseconds.check().findings)


def test_check_of_arrays_that_cannot_be_names_the_log() -> None:
    broken = replace(DRIVE, odometry=replace(DRIVE.odometry, a=np.full_like(DRIVE.odometry.a, np.inf)))
    with pytest.raises(BslamError, match=f"^{DRIVE.name}/odometry.csv, line 2, column left_m: 'inf'"):
        broken.check()


@pytest.mark.parametrize(
    ("words", "options"),
    [
        ({}, []),
        ({"association": "known:0.1", "seed": 2, "filter": "standard"}, ["--association", "known:0.1"]),
        ({"observation": "direction"}, ["--observation", "direction"]),
        (
            {"association": "known", "parameters": {"gate_d2": 9.0}},
            ["--association=known", "--set=gate_d2=9"],
        ),
    ],
)
def test_run_is_the_commands(words, options, tmp_path) -> None:
    DRIVE.write(tmp_path / "drive")
    if "filter" in words:
        options = [*options, "--filter", words["filter"], "--seeds", "2:3"]
    assert (
        main(["replay", "csv", str(tmp_path / "drive"), *options, "--pictures", "0", "--out", str(tmp_path)])
        == 0
    )
    (entry,) = json.loads((tmp_path / "summary.json").read_text())["runs"]
    summary = json.loads(json.dumps(Log.read(tmp_path / "drive").run(**words).summary))
    for own in ("name", "truth", "step_us_median"):
        summary.pop(own, None)
        entry.pop(own, None)
    assert summary == entry


def test_a_run_says_what_the_filter_made() -> None:
    run = DRIVE.run(association="known")
    assert run.trace.pose.shape == (run.trace.steps + 1, 3) and run.errors is not None
    assert DRIVE.name in str(run) and "mean cm" in str(run)
    blind = replace(DRIVE, truth=None, beacons=None).run()
    assert blind.errors is None and "position_error_m" not in blind.summary


def test_a_notebook_shows_a_line_of_a_log_and_the_table_of_a_run() -> None:
    seen = len(DRIVE.sightings.time_us)
    said = f"Log 'paper_room_seed3': 300 odometry rows, {seen} sightings of 6 beacons, 12.0 s, truth: yes"
    assert repr(DRIVE) == said
    run = DRIVE.run(association="known")
    assert repr(run) == str(run)
    assert repr(Slam({"wheelbase_m": 0.3})) == "Slam at x 0 m, y 0 m, theta 0 rad, 0 beacons"


class Standstill:
    """An algorithm that sees nothing."""

    def reset(self, seed):
        """Nothing."""

    def odometry(self, time_us, left_m, right_m):
        """Nothing."""

    def observe(self, time_us, sightings):
        """Nothing."""

    def pose(self):
        return 0.0, 0.0, 0.0

    def map(self):
        return []


def test_an_algorithm_of_ones_own_is_judged_alike() -> None:
    run = DRIVE.run(Standstill, association="known")
    assert run.errors is not None and DRIVE.truth is not None
    far_m = np.hypot(*run.errors.truth[1:, :2].T)
    np.testing.assert_allclose(run.errors.error_m[1:], far_m)
    named = DRIVE.run(type("Named", (Standstill,), {"needs_identity": True}), association="mahalanobis")
    assert named.summary["association"] == "known"
    with pytest.raises(BslamError, match="Half has no observe, map; allowed: a class as in"):
        DRIVE.run(type("Half", (), {"reset": 0, "odometry": 0, "pose": 0}))
    for one, said in ((Standstill(), "of type Standstill"), ("mine:Standstill", "'mine:Standstill'")):
        with pytest.raises(BslamError, match=rf"^algorithm {said}: is no class; allowed: the class itself"):
            DRIVE.run(one)


@pytest.mark.parametrize(
    "words",
    [
        {"filter": "smoother"},
        {"known_map": True},
        {"kept_map": "a.bslam"},
        {"frozen": True},
        {"recovery": "carried"},
        {"target": "qemu:m33"},
    ],
)
def test_an_algorithm_is_not_told_what_is_of_the_filter(words) -> None:
    (word,) = words
    with pytest.raises(BslamError, match=f"option '{word}' is of the filter alone; allowed .*: observation"):
        DRIVE.run(Standstill, **words)


def test_none_is_as_left_out() -> None:
    words = dict.fromkeys(bslam.RunWords.__annotations__)
    assert DRIVE.run(Standstill, **words).options == DRIVE.run(Standstill).options


def test_plot_shows_path_map_ellipses_error_and_nees() -> None:
    figure = bslam.plot(DRIVE.run(association="known"))
    room, error, nees = figure.axes
    named = room.get_legend_handles_labels()[1]
    assert named[:2] == ["true path", "estimated path"] and "mapped beacon, 2 sigma" in named
    assert len(room.patches) > 0  # the ellipses
    assert error.get_ylabel() == "position error, cm" and nees.get_ylabel() == "NEES of the pose"
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_plot_without_truth_shows_the_whole_map() -> None:
    run = replace(DRIVE, truth=None, beacons=None).run()
    (room,) = bslam.plot(run).axes
    (left, right), (low, high) = room.get_xlim(), room.get_ylim()
    assert all(left < one.x_m < right and low < one.y_m < high for one in run.trace.beacons if one.confirmed)
    with pytest.raises(BslamError, match="plot of Log; allowed: a Run"):
        bslam.plot(DRIVE)  # type: ignore[arg-type]
