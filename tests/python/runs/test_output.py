"""Files of a run."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.evaluation.metrics import evaluate
from bslam.evaluation.truth import step_times_us
from bslam.options import RunOptions
from bslam.runs.output import finite, map_csv, tum, write_atomically, write_run, write_summary


def refuse_constant(name):
    raise AssertionError(f"{name} in JSON")


def test_tum_has_eight_columns_and_time_as_in_the_log():
    text = tum(
        np.array([1_248_272_272_841_000, 40_000]), np.array([[1.5, -2.0, math.pi / 2], [0.0, 0.0, -3.0]])
    )
    rows = [[float(one) for one in line.split()] for line in text.splitlines()]
    assert text.startswith("1248272272.841000 ")
    assert text.splitlines()[1].startswith("0.040000 ")
    assert [len(row) for row in rows] == [8, 8]
    assert rows[0][1:4] == [1.5, -2.0, 0.0]
    assert rows[0][6:] == pytest.approx([math.sqrt(0.5)] * 2)
    assert 2.0 * math.atan2(rows[1][6], rows[1][7]) == pytest.approx(-3.0)


def test_map_csv_has_label_or_number_and_covariance(made):
    beacons = [made.map_beacon(10, 3, 3.0, 4.0, label=3), made.map_beacon(11, -1, 1.0, 0.0, confirmed=False)]
    rows = list(csv.DictReader(map_csv(made.trace(np.zeros((1, 3)), [0], beacons)).splitlines()))
    assert [row["beacon"] for row in rows] == ["3", "11"]
    assert [row["true_beacon"] for row in rows] == ["3", ""]
    assert [row["confirmed"] for row in rows] == ["1", "0"]
    assert float(rows[0]["range_m"]) == 5.0
    assert (float(rows[0]["var_x_m2"]), float(rows[0]["cov_xy_m2"]), float(rows[0]["var_y_m2"])) == (
        0.01,
        0.0,
        0.04,
    )


def test_summary_has_the_schema_and_only_finite_numbers(tmp_path):
    runs = [
        {
            "diverged": True,
            "nees_mean": np.float64("nan"),
            "error": {"max": math.inf, "min": 0.5},
            "steps": np.int64(3),
        }
    ]
    path = write_summary(tmp_path / "new" / "out", runs)
    content = json.loads(path.read_text(), parse_constant=refuse_constant)
    assert content == {"schema": 1, "runs": [{"diverged": True, "error": {"min": 0.5}, "steps": 3}]}


def test_finite_keeps_truth_values_and_texts():
    assert finite(
        {"a": True, "b": "x", "c": None, "d": [1, math.nan, np.float32(0.5)], "e": np.bool_(False)}
    ) == {
        "a": True,
        "b": "x",
        "d": [1, 0.5],
        "e": False,
    }


def test_write_run_replaces_what_was_there(made, tmp_path):
    log = made.circle_log(steps=5)
    poses = np.column_stack([log.truth.x_m, log.truth.y_m, log.truth.theta_rad])
    trace = made.trace(poses, step_times_us(log), [made.map_beacon(1, 3, 1.0, 1.0)])
    for suffix in (".map.csv", ".bslam"):  # this run has no map of its own to keep
        (tmp_path / f"x{suffix}").write_text("old")
    write_run(tmp_path, "x", trace, evaluate(log, trace, RunOptions()))
    estimate, truth = (np.loadtxt(tmp_path / f"x.{one}.tum") for one in ("estimate", "truth"))
    assert estimate.shape == truth.shape == (6, 8)
    assert np.allclose(estimate[:, 1:3], poses[:, :2], atol=1e-6)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.estimate.tum", "x.map.csv", "x.truth.tum"]
    assert "old" not in (tmp_path / "x.map.csv").read_text()


def test_a_run_that_saves_no_map_leaves_the_one_that_it_started_in(made, tmp_path, monkeypatch):
    log = made.circle_log(steps=5)
    poses = np.column_stack([log.truth.x_m, log.truth.y_m, log.truth.theta_rad])
    trace = made.trace(poses, step_times_us(log), [made.map_beacon(1, 3, 1.0, 1.0)])
    (tmp_path / "x.bslam").write_text("old")
    monkeypatch.chdir(tmp_path)
    evaluation = evaluate(log, trace, RunOptions())
    write_run(tmp_path, "x", trace, evaluation, Path("x.bslam"))
    assert (tmp_path / "x.bslam").read_text() == "old"
    write_run(tmp_path, "x", trace, evaluation, Path("another.bslam"))
    assert not (tmp_path / "x.bslam").exists()


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path):
    (tmp_path / "file").write_text("old")
    with pytest.raises(UnicodeEncodeError):
        write_atomically(tmp_path / "file", "\ud800")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "old"


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BslamError, match=r"file/summary\.json: cannot be written: .*; allowed: a directory"):
        write_summary(tmp_path / "file", [])
