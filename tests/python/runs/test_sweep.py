"""`bslam sweep`: what it makes, what it keeps through kills, full disks and failures, and what it refuses."""

import json
import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from distributed import LocalCluster
from joblib.externals.loky import get_reusable_executor

from bslam.cli import main
from bslam.errors import BslamError
from bslam.runs.sweep import Store, compare_with_known, forget
from tools.proofs import kill_sweep

STILL = """
class Still:
    def reset(self, seed): self.seed = seed
    def odometry(self, time_us, left_m, right_m): pass
    def observe(self, time_us, sightings): pass
    def pose(self): return 0.0, 0.0, 0.0
    def map(self): return []
"""


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    """2 seeds x 2 sigmas x 2 gates of a short drive."""
    kill_sweep.write_sweep(tmp_path, 2)
    short = tmp_path / "short.toml"
    lines = [f'scenarios = ["{short}"]', 'seeds = "0:2"', "sigma = [0.3, 1.0]", "files = false"]
    return write(tmp_path / "grid.toml", *lines, 'association = "known"', "set.gate_d2 = [9.0, 16.0]")


def sweep_into(out: Path, sweep: Path, *words: str) -> int:
    return main(["sweep", str(sweep), "--out", str(out), "--jobs", "1", *words])


def runs(out: Path) -> list[dict]:
    return json.loads((out / "summary.json").read_text())["runs"]


def last_line(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().err.splitlines()[-1]


def test_sweep_file_makes_every_combination_and_a_table(
    sweep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert sweep_into(out, sweep) == 0
    made = [(run["seed"], run["sigma_mps"], run["parameters"]["gate_d2"]) for run in runs(out)]
    assert sorted(made) == [
        (seed, sigma, gate) for seed in (0, 1) for sigma in (0.3, 1.0) for gate in (9, 16)
    ]
    assert len({run["name"] for run in runs(out)}) == 8
    text = (out / "sweep.txt").read_text()
    assert text.strip() in capsys.readouterr().out
    for words in ("sigma 0.3", "sigma 1.0"):
        for gate in ("gate_d2 9.0", "gate_d2 16.0"):
            assert len([line for line in text.splitlines() if words in line and gate in line]) == 2
    assert max(map(len, text.splitlines())) <= 110
    assert text.splitlines()[0].endswith("distance, invariant, known")
    assert "takes 5 seeds" in text and "takes --association known" in text
    table = pq.read_table(out / "results.parquet")
    assert table["name"].to_pylist() == [run["name"] for run in runs(out)]
    means = [run["position_error_m"]["mean"] for run in runs(out)]
    assert table["position_error_m.mean"].to_pylist() == means
    assert sorted(path.name for path in out.iterdir()) == [
        "results.parquet", "summary.json", "sweep.sqlite", "sweep.txt"
    ]  # fmt: skip


def test_sweep_holds_other_associations_against_known_on_the_same_drive(sweep: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    sweep.write_text(sweep.read_text().replace('"known"', '["known", "mahalanobis"]'))
    assert sweep_into(out, sweep) == 0
    made = {(run["association"], run["seed"], run["sigma_mps"], run["parameters"]["gate_d2"]): run
            for run in runs(out)}  # fmt: skip
    assert len(made) == 16
    for (association, *drive), run in made.items():
        known = made["known", *drive]["position_error_m"]["mean"]
        ratio = None if association == "known" else run["position_error_m"]["mean"] / known
        assert run.get("ratio_to_known") == (ratio if ratio is None else pytest.approx(ratio))
        assert run["failed"] is (run["failed_by"] != [])
    _, table, *more, notes = (out / "sweep.txt").read_text().strip().split("\n\n")
    first, *lines = table.splitlines()
    assert all(word in first for word in ("/ known", "wrong %", "exact", "failed"))
    assert all(len(part.splitlines()) == 1 + 8 for part in (table, *more))
    assert not any(" +- " in line for line in lines)  # of two runs
    assert "/ known" not in notes
    before = runs(out)
    assert sweep_into(out, sweep) == 0  # from what is kept
    assert runs(out) == before


def test_compare_with_known_forgives_what_known_does_too() -> None:
    time_s = np.arange(0.0, 20.0, 0.1)
    entry = {"position_error_m": {"mean": 1.5}, "failed_by": ["off"], "failed": True}
    known = {"position_error_m": {"mean": 0.6}}
    compare_with_known(entry, known, *(np.stack([time_s, 0 * time_s + off]) for off in (1.5, 0.6)))
    assert entry == {
        "position_error_m": {"mean": 1.5},
        "failed_by": [],
        "failed": False,
        "ratio_to_known": 2.5,
    }
    compare_with_known(entry, known, *(np.stack([time_s, 0 * time_s + off]) for off in (1.5, 0.4)))
    assert entry["failed_by"] == ["off"] and entry["failed"] is True


def test_sweep_killed_in_the_middle_loses_nothing_and_counts_nothing_twice(tmp_path: Path) -> None:
    said = kill_sweep.prove(tmp_path, runs=40, kills=1, jobs=1)
    assert said.endswith("then 40 of 40, each once and as in one go")


def test_sweep_that_was_changed_half_way_is_named(
    sweep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "finish", lambda _: None)  # as if it had been stopped
        assert sweep_into(out, sweep) == 0
    sweep.write_text(sweep.read_text().replace("0:2", "0:3"))
    assert sweep_into(out, sweep) == 2
    line = last_line(capsys)
    assert (
        'seeds was "0:2" and is "0:3" now; allowed: the sweep as it was, another --out, or --restart' in line
    )
    assert sweep_into(out, sweep, "--restart") == 0
    assert len(runs(out)) == 12
    sweep.write_text(sweep.read_text().replace("0:3", "0:1"))
    assert sweep_into(out, sweep) == 0  # a finished sweep makes way for another one
    assert len(runs(out)) == 4


def test_sweep_scenario_that_was_changed_half_way_is_named(
    sweep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, short = tmp_path / "out", tmp_path / "short.toml"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "finish", lambda _: None)
        assert sweep_into(out, sweep) == 0
    short.write_text(short.read_text().replace("speed_mps = 0.4", "speed_mps = 0.5"))
    assert sweep_into(out, sweep) == 2
    assert f"another sweep: scenario {short}, driving, speed_mps was 0.4 and is 0.5 now;" in last_line(capsys)


def test_sweep_on_a_full_disk_keeps_what_was_written(sweep: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "bslam", "sweep", str(sweep), "--out", str(out), "--jobs", "1"]

    def no_room() -> None:  # no file may grow beyond this: the store's header and a few runs
        resource.setrlimit(resource.RLIMIT_FSIZE, (24_000, 24_000))

    result = subprocess.run(command, preexec_fn=no_room, capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert "sweep.sqlite: " in (line := result.stderr.splitlines()[-1])
    assert line.endswith("what it holds is kept; allowed: the same command again, which goes on")
    before = kill_sweep.kept(out)
    assert 0 < before < 8
    assert sweep_into(out, sweep) == 0
    assert len({run["name"] for run in runs(out)}) == len(runs(out)) == 8


def test_sweep_goes_on_past_a_run_that_fails_and_tries_it_again(
    sweep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    good = sweep.read_text()
    bad = good.replace("set.gate_d2 = [9.0, 16.0]", "set.scale_states = [0, 1]")  # not beside velocity states
    sweep.write_text(bad)
    assert sweep_into(out, sweep) == 2
    assert "scale_states" in last_line(capsys)
    failed = [run for run in runs(out) if "error" in run]
    assert len(runs(out)) == 8 and len(failed) == 4 and all(run["diverged"] for run in failed)
    assert kill_sweep.kept(out) == 4


def test_sweep_with_an_algorithm_makes_its_runs_once_and_names_what_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kill_sweep.write_sweep(tmp_path, 2)
    get_reusable_executor().shutdown(wait=True)  # processes of another test, which stay in its folder
    monkeypatch.chdir(tmp_path)
    module = write(tmp_path / "mine_of_sweep.py", STILL)
    lines = ['scenarios = ["short.toml"]', 'seeds = "0:2"', 'association = "known"', "files = false"]
    lines += ['filter = ["standard", "invariant"]', 'with = ["mine_of_sweep:Still"]']
    sweep, out = write(tmp_path / "grid.toml", *lines), tmp_path / "out"
    assert sweep_into(out, sweep, "--jobs", "2") == 0  # whose processes have processes of their own
    found = {run["name"]: run.get("method", run.get("filter")) for run in runs(out)}
    assert sorted(found.values()) == ["Still", "Still", "invariant", "invariant", "standard", "standard"]
    lines = [line for line in (out / "sweep.txt").read_text().splitlines() if line.startswith("Still ")]
    assert len(lines) == 2  # its row, in both parts of the table
    write(module, STILL.replace("return 0.0, 0.0", "return 1.0 / (self.seed - 1), 0.0"))
    capsys.readouterr()
    assert sweep_into(out, sweep) == 1  # a finished sweep gives way to another version's
    told, said = capsys.readouterr()
    assert "  1 FAILED\n" in told and "error (1)" in told
    assert "Still failed" in said and "ZeroDivisionError" in said and "mine_of_sweep.py" in said
    assert sum("error" in run for run in runs(out)) == 1 and len(runs(out)) == 6


def test_sweep_on_a_dask_cluster_makes_the_same_runs(
    sweep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert sweep_into(tmp_path / "here", sweep) == 0
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        assert sweep_into(tmp_path / "there", sweep, "--cluster", cluster.scheduler_address) == 0
    here, there = (kill_sweep.entries_of(tmp_path / place) for place in ("here", "there"))
    assert here == there
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler  # this process is no worker
    assert sweep_into(tmp_path / "none", sweep, "--cluster", "tcp://127.0.0.1:9") == 2
    assert "--cluster tcp://127.0.0.1:9: " in last_line(capsys)


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("sigmas = [0.3]", "key sigmas: no such key; allowed: scenarios, "),
        ("sigma = [0.3, -1]", "sigma: '-1' is not allowed; allowed: "),
        ('filter = "kalman"', "filter: 'kalman' does not exist; allowed: standard, invariant"),
        ("set.gate = [1.0]", "parameter 'gate' does not exist"),
        ("sigma = ", "not TOML"),
    ],
)
def test_sweep_bad_file_is_named(
    line: str, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "bad.toml", 'scenarios = ["paper_room"]', line)
    assert sweep_into(tmp_path / "out", path) == 2
    assert named in last_line(capsys)


def test_store_two_at_a_time_are_refused(tmp_path: Path) -> None:
    with (
        Store(tmp_path, {"seeds": "0:1"}),
        pytest.raises(BslamError, match="another process is at work on this sweep"),
    ):
        Store(tmp_path, {"seeds": "0:1"})
    forget(tmp_path)
    assert list(tmp_path.iterdir()) == []
