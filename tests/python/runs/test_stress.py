"""`bslam stress`: what its rows change, what it prints and keeps, and what it refuses."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bslam.cli import main
from bslam.core import Slam
from bslam.options import RunOptions
from bslam.runs import batch
from bslam.runs.runner import run_log
from bslam.runs.stress import ENCODERS_MPS, NOMINAL, ROWS, StressSource, row_figures
from bslam.world.scenario import SCENARIOS
from bslam.world.simulate import load_scenario, simulate, true_drive

QUICK = ("--jobs", "1", "--no-files")


def shortened(folder: Path, steps: int) -> str:
    """The paper's room as a file of its own."""
    text = (SCENARIOS / "paper_room.toml").read_text(encoding="utf-8")
    assert "steps = 5000" in text
    path = folder / "short.toml"
    path.write_text(text.replace("steps = 5000", f"steps = {steps}"), encoding="utf-8")
    return str(path)


@pytest.fixture
def room(tmp_path: Path) -> str:
    """60 s of it: the shortest in which every row has its place."""
    return shortened(tmp_path, 1500)


def summary(out: Path) -> dict:
    return json.loads((out / "summary.json").read_text())


def source(room: str, row: str, seed: int = 3) -> StressSource:
    return StressSource(room, seed, ROWS[row].sigma_mps or 0.3, "speedometer", row=row)


def test_nominal_row_is_the_scenario_to_the_bit(room: str) -> None:
    made, plain = source(room, NOMINAL).load(), simulate(load_scenario(room), 3, 0.3, "speedometer")
    np.testing.assert_array_equal(made.odometry.a, plain.odometry.a)
    np.testing.assert_array_equal(made.sightings.range_m, plain.sightings.range_m)


@pytest.mark.parametrize("row", [name for name in ROWS if name != NOMINAL])
def test_row_changes_the_drive_and_tells_the_filter_nothing(room: str, row: str) -> None:
    plain = simulate(load_scenario(room), 3, ROWS[row].sigma_mps or 0.3, "speedometer")
    log = source(room, row).load()
    assert log.robot == plain.robot
    pairs = [(log.odometry.a, plain.odometry.a), (log.odometry.b, plain.odometry.b)]
    pairs += [
        (log.odometry.time_us, plain.odometry.time_us),
        (log.sightings.time_us, plain.sightings.time_us),
    ]
    pairs += [(log.sightings.range_m, plain.sightings.range_m)]
    pairs += [(log.sightings.bearing_rad, plain.sightings.bearing_rad)]
    assert not all(np.array_equal(one, other) for one, other in pairs)


@pytest.mark.parametrize("length_m", [30, 100, 150])
def test_loop_comes_back_to_beacons_that_it_does_not_see_on_the_way(room: str, length_m: int) -> None:
    log = source(room, f"loop-{length_m}m").load()
    truth = log.truth
    assert truth is not None
    seen_s = np.unique(log.sightings.time_us) * 1e-6
    way_s = np.diff(seen_s).max()  # 1 m/s
    near_m = 2.0 * 13.0  # at both ends of the loop beacons are still, or again, within 6 m
    assert length_m - near_m < way_s < length_m or length_m == 30
    assert seen_s[-1] > truth.time_us[-1] * 1e-6 - 5.0
    begin, end = (int(one / 0.04) for one in (15.0, 15.0 + length_m))
    assert math.dist((truth.x_m[begin], truth.y_m[begin]), (truth.x_m[end], truth.y_m[end])) == pytest.approx(
        0.0, abs=0.1
    )
    way_m = np.hypot(np.diff(truth.x_m), np.diff(truth.y_m)).sum()
    assert way_m == pytest.approx(15.0 + length_m + 52.0, rel=0.01)


def test_people_hide_beacons_and_walk_where_a_robot_could(room: str) -> None:
    made = source(room, "people").world()
    ghosts = replace(made, movers=tuple(replace(one, hides=False) for one in made.movers))
    assert len(made.movers) == 4
    for mover in made.movers:
        path = np.array(mover.path)
        assert made.arena.path_clearance(path[:-1], path[1:]).min() > 0.3
    assert true_drive(made, 3).others_m.shape[1] == 4
    shown, all_there = (len(simulate(one, 3).sightings.time_us) for one in (made, ghosts))
    assert 0.5 < shown / all_there < 0.99


def test_resume_row_tells_the_filter_its_own_doubt(room: str) -> None:
    told = []

    class Telltale(Slam):
        def resume_odometry(self, position_sd_m: float, heading_sd_rad: float) -> None:
            told.append((position_sd_m, heading_sd_rad))
            super().resume_odometry(position_sd_m, heading_sd_rad)

    log = source(room, "resume").load()
    assert ROWS["resume"].resume_sd == (1.0, 1.0)
    for resume_sd in ((1.0, 1.0), None):
        own = RunOptions(sigma_mps=ENCODERS_MPS, resume_sd=resume_sd)
        run_log(log, own, lambda params, beacons: Telltale(params, beacons_max=beacons))
    assert told[:3] == [(1.0, 1.0)] * 3
    assert [sd_rad for _, sd_rad in told[3:]] == [3.0] * 3


def entry(row: str, sigma_mps: float, error_m: float, *, lost: bool = False) -> dict:
    return {
        "row": row,
        "sigma_mps": sigma_mps,
        "position_error_m": {"mean": error_m},
        "position_error_last_50s_m": 2.0 * error_m,
        "nees_mean": 3.0 + error_m,
        "nees_inside_95": 0.9,
        "diverged": lost,
        "failed": lost,
    }


def test_row_figures_are_means_against_the_nominal_of_the_same_sigma() -> None:
    entries = [entry(NOMINAL, 0.3, 0.05), entry(NOMINAL, 0.05, 0.02), entry("delay", 0.3, 0.1)]
    entries += [entry("delay", 0.3, 0.2, lost=True), entry("slip", 0.05, 0.08), entry("loop-30m", 0.05, 1.0)]
    entries += [{"row": "delay", "sigma_mps": 0.3, "diverged": True, "failed": True, "error": "crash"}]
    first, _, delay, slip, loop = row_figures(entries)
    assert (first.row, first.to_nominal, first.lost) == (NOMINAL, 1.0, 0)
    assert (delay.runs, delay.lost, delay.failed) == (3, 2, 2)
    assert delay.error_cm == pytest.approx((10.0, 20.0))
    assert (delay.mean_cm, delay.last_50s_cm, delay.to_nominal) == pytest.approx((15.0, 30.0, 3.0))
    assert (delay.mean_nees, delay.inside_95) == pytest.approx((3.15, 0.9))
    # Wilson's interval of 2 in 3.
    assert delay.lost_interval == pytest.approx((0.2077, 0.9385), abs=1e-4)
    assert slip.to_nominal == pytest.approx(4.0)
    assert (loop.to_nominal, loop.failed) == (None, None)


def test_stress_runs_its_rows_and_leaves_table_picture_and_entries(
    room: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    rows = ["loop-30m", "slip", "range-scale"]
    words = ["--rows", ",".join(rows), "--seeds", "5:7", "--out", str(out)]
    assert main(["stress", room, *words, *QUICK]) == 0
    said = capsys.readouterr().out
    runs, rows = summary(out)["runs"], summary(out)["rows"]
    made = [(NOMINAL, 0.3), (NOMINAL, ENCODERS_MPS), ("range-scale", 0.3)]
    made += [("slip", ENCODERS_MPS), ("loop-30m", ENCODERS_MPS)]
    assert [(one["row"], one["sigma_mps"], one["runs"]) for one in rows] == [(*one, 2) for one in made]
    assert sorted((one["row"], one["sigma_mps"], one["seed"]) for one in runs) == sorted(
        (*one, seed) for one in made for seed in (5, 6)
    )
    assert len({one["name"] for one in runs}) == len(runs)
    assert {(one["scenario"], one["association"]) for one in runs} == {("short", "known")}
    table = (out / "stress.txt").read_text()
    assert table.strip() in said
    for row, line in zip(rows, table.splitlines()[1:], strict=False):
        assert line.startswith(row["row"])
        assert f"{100 * row['position_error_mean_m']:.1f}" in line.split()
    by_row = {one["row"]: one for one in rows if one["sigma_mps"] == 0.3}
    ratio = by_row["range-scale"]["position_error_mean_m"] / by_row[NOMINAL]["position_error_mean_m"]
    assert by_row["range-scale"]["ratio_to_nominal"] == pytest.approx(ratio)
    assert by_row["range-scale"]["nees_mean"] > by_row[NOMINAL]["nees_mean"]
    assert (out / "stress.png").read_bytes().startswith(b"\x89PNG")


def test_stress_nominal_is_what_run_says(room: str, tmp_path: Path) -> None:
    words = ["--seeds", "7:9", "--jobs", "1", "--no-velocity-states", "--set", "gate_d2=20"]
    stressed = ["--rows", f"{NOMINAL},misses", "--sigma", "0.6", "--files", "--out", str(tmp_path / "a")]
    assert main(["stress", room, *words, *stressed]) == 0
    plain = ["--association", "known", "--sigma", "0.6", "--pictures", "0", "--out", str(tmp_path / "b")]
    assert main(["run", room, *words, *plain]) == 0
    runs = [one for one in summary(tmp_path / "a")["runs"] if one["row"] == NOMINAL]
    assert [one["position_error_m"] for one in runs] == [
        one["position_error_m"] for one in summary(tmp_path / "b")["runs"]
    ]
    assert all(one["parameters"]["gate_d2"] == 20 for one in runs)
    for one in summary(tmp_path / "a")["runs"]:
        assert (tmp_path / "a" / f"{one['name']}.estimate.tum").is_file()


def test_stress_that_is_stopped_keeps_what_is_finished(
    room: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["stress", room, "--rows", "delay", "--seeds", "0:2", "--out", str(tmp_path / "out"), *QUICK]
    execute, made = batch.execute, []

    def stopped_at_the_third(job: batch.Job, out: Path) -> batch.Outcome:
        made.append(job.name)
        if len(made) == 3:
            raise KeyboardInterrupt
        return execute(job, out)

    monkeypatch.setattr(batch, "execute", stopped_at_the_third)
    assert main(words) == 1
    kept = summary(tmp_path / "out")
    assert kept["interrupted"] is True
    assert [one["row"] for one in kept["runs"]] == [NOMINAL, NOMINAL]
    assert "2 runs are missing" in capsys.readouterr().err
    assert main(words) == 0
    assert made[3:] == made[2:3] + [name for name in made[3:] if name != made[2]]
    assert len(made) == 5
    assert [one["row"] for one in summary(tmp_path / "out")["runs"]] == [NOMINAL] * 2 + ["delay"] * 2
    assert "2 of 4 runs were there already" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("steps", "words", "parts"),
    [
        (750, ["--rows", "slip,skid"], ["argument --rows", "'skid' does not exist", "slip"]),
        (500, ["--rows", "gaps"], ["short, row gaps, [gaps]", "(6, 2.0, 2.0)", "5 s at most"]),
        (500, ["--rows", "misses", "--sigma", "-1"], ["argument --sigma", "'-1'"]),
    ],
)
def test_stress_refuses_by_name_and_runs_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], steps: int, words: list[str], parts: list[str]
) -> None:
    out = tmp_path / "out"
    try:
        status = main(["stress", shortened(tmp_path, steps), "--out", str(out), *QUICK, *words])
    except SystemExit as error:
        status = int(error.code or 0)
    assert status == 2
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert all(part in last for part in (*parts, "allowed"))
    assert not out.exists()


def test_help_names_every_row(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["stress", "--help-all"])
    said = capsys.readouterr().out
    assert ended.value.code == 0
    assert "bslam stress paper_room" in said
    for name, row in ROWS.items():
        assert f"{name:15} {row.meaning}" in said
