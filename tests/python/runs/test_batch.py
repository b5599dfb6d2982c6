"""Many runs: names, failures, interruption."""

import json
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.log import Log
from bslam.options import RunOptions
from bslam.runs import batch
from bslam.runs.batch import Job, make_jobs, run_batch, run_names
from bslam.runs.sources import CameraSource, FolderSource, MrclamSource, ScenarioSource


@dataclass(frozen=True)
class LogSource:
    """A log at hand, or an error to raise in its place."""

    log: Log | BaseException
    name: str = "made"
    align: bool = False
    truth_kind: str = "simulated"
    shared: str | None = None  # what is prepared once for all that share it
    prepared: list[str] = field(default_factory=list)

    def prepare(self):
        self.prepared.append(self.shared)
        if isinstance(self.log, BaseException):
            raise self.log

    def load(self):
        if isinstance(self.log, BaseException):
            raise self.log
        return self.log

    def walls_m(self):
        return np.empty((0, 4))


def summary(out):
    return json.loads((out / "summary.json").read_text())


def test_one_run_leaves_its_files_and_an_entry(made, tmp_path):
    drawn = []
    job = Job(
        "a",
        LogSource(made.circle_log(20)),
        RunOptions(),
        lambda *inputs: drawn.append(inputs[1]),
        record=True,
    )
    result = run_batch([job], tmp_path, processes=1)
    assert result.ok
    assert drawn == ["a"]
    names = {path.name for path in tmp_path.iterdir()}
    tables = {"a.estimate.tum", "a.truth.tum", "a.map.csv"}
    assert names == {"a", "a.mcap", "a.bslam", *tables, "summary.json"}
    (entry,) = summary(tmp_path)["runs"]
    assert (entry["name"], entry["scenario"], entry["truth"], entry["diverged"]) == (
        "a",
        "made",
        "simulated",
        False,
    )
    assert len(result.outcomes[0].time_s) == len(result.outcomes[0].error_m) == 21


def test_what_runs_share_is_prepared_once_before_them(made, tmp_path):
    prepared = []
    sources = [
        LogSource(made.circle_log(20), shared=name, prepared=prepared) for name in ("a", "a", "b", None)
    ]
    result = run_batch(
        [Job(str(i), one, RunOptions()) for i, one in enumerate(sources)], tmp_path, processes=1
    )
    assert result.ok
    assert prepared == ["a", "b"]


@pytest.mark.parametrize("failure", [BslamError("no"), ZeroDivisionError("oh")])
def test_a_preparation_that_fails_fails_its_run_alone(made, tmp_path, failure):
    good, bad = LogSource(made.circle_log(20), shared="good"), LogSource(failure, shared="bad")
    jobs = [Job("good", good, RunOptions()), Job("bad", bad, RunOptions())]
    result = run_batch(jobs, tmp_path, processes=1)
    assert [outcome.failed for outcome in result.outcomes] == [False, True]


@pytest.mark.parametrize(
    ("failure", "is_input"),
    [(BslamError("file x: bad; allowed: good"), True), (ZeroDivisionError("oh"), False)],
)
def test_a_failed_run_is_a_diverged_entry_and_the_others_go_on(made, tmp_path, failure, is_input):
    log = made.circle_log(20)
    jobs = [Job("bad", LogSource(failure), RunOptions()), Job("good", LogSource(log), RunOptions())]
    result = run_batch(jobs, tmp_path, processes=1)
    assert not result.ok
    bad, good = summary(tmp_path)["runs"]
    assert bad["diverged"] is True
    assert str(failure) in bad["error"]
    assert (bad["filter"], bad["observation"]) == ("invariant", "distance")
    assert good["diverged"] is False
    assert (result.bad_input is not None) == is_input


def test_several_processes_give_the_same_as_one(made, tmp_path):
    folders = []
    for seed in range(2):
        folders.append(tmp_path / f"log{seed}")
        made.circle_log(30, seed=seed).write(folders[-1])
    jobs = make_jobs([FolderSource(one) for one in folders], [RunOptions()] * 2, None, 0)
    entries = []
    for processes in (1, 2):
        assert run_batch(jobs, tmp_path / "out", processes).ok
        entries.append([entry | {"step_us_median": 0.0} for entry in summary(tmp_path / "out")["runs"]])
    assert entries[0] == entries[1]


def test_ctrl_c_keeps_what_is_finished(made, tmp_path, monkeypatch):
    jobs = make_jobs([LogSource(made.circle_log(5))] * 3, [RunOptions(seed=k) for k in range(3)], None, 0)

    def execute(job, out, real=batch.execute):
        if job.options.seed == 1:
            raise KeyboardInterrupt
        return real(job, out)

    monkeypatch.setattr(batch, "execute", execute)
    result = run_batch(jobs, tmp_path, processes=1)
    assert result.interrupted
    assert not result.ok
    content = summary(tmp_path)
    assert content["interrupted"] is True
    assert [entry["seed"] for entry in content["runs"]] == [0]


def test_a_process_that_dies_fails_what_is_not_finished_and_keeps_the_rest(made, tmp_path, monkeypatch):
    jobs = make_jobs([LogSource(made.circle_log(5))] * 3, [RunOptions(seed=k) for k in range(3)], None, 0)

    def one_and_then_none(jobs, out, processes):
        yield 1, batch.execute(jobs[1], out)
        raise BrokenExecutor

    monkeypatch.setattr(batch, "outcomes_of", one_and_then_none)
    result = run_batch(jobs, tmp_path, processes=2)
    assert not result.ok
    assert result.bad_input is None
    entries = summary(tmp_path)["runs"]
    assert [entry["diverged"] for entry in entries] == [True, False, True]
    assert "a process died" in entries[0]["error"]


def test_names_tell_runs_apart_by_what_differs():
    plain = RunOptions(sigma_mps=0.3)
    room = ScenarioSource("some/where/room.toml", 0, 0.3, "speedometer")
    assert run_names([room], [plain]) == ["room_seed0"]
    several = [plain, replace(plain, seed=1), replace(plain, sigma_mps=0.6, observation="direction")]
    assert run_names([room] * 3, several) == [
        "room_seed0_sigma0.3_distance",
        "room_seed1_sigma0.3_distance",
        "room_seed0_sigma0.6_direction",
    ]
    wrong = replace(plain, wrong_identity_rate=0.05)
    assert run_names([room] * 2, [plain, wrong]) == ["room_seed0_known", "room_seed0_known0.05"]
    changed = replace(plain, recovery="carried", parameters=(("doubt_us", 0),))
    names = ["room_seed0_recoverycarried_doubt_us0", "room_seed0"]
    assert run_names([room] * 2, [changed, plain]) == names
    assert run_names([room] * 2, [plain, changed]) == names[::-1]


def test_draws_of_wheels_that_only_read_wrong_share_what_cameras_see():
    def shared(noise, draw):
        return CameraSource("paper_room", 0, 0.3, noise, "three60", Path("out"), noise_draw=draw).shared

    assert shared("speedometer", 0) == shared("speedometer", 2)
    assert shared("actuation", 0) != shared("actuation", 2)


def test_names_of_logs_are_their_folders_and_stay_apart():
    logs = [FolderSource(Path("/a/log")), FolderSource(Path("/b/log")), MrclamSource(Path("/c/Set1"), 2)]
    assert run_names(logs, [RunOptions()] * 3) == ["log", "log-2", "Set1_robot2"]
    assert run_names(logs[:1] * 2, [RunOptions(), RunOptions(seed=1)]) == ["log_seed0", "log_seed1"]
    numbered = [FolderSource(Path("/a/log-2")), *logs[:2]]
    assert run_names(numbered, [RunOptions()] * 3) == ["log-2", "log", "log-3"]


def test_only_the_first_runs_are_drawn(made):
    jobs = make_jobs([LogSource(made.circle_log(1))] * 3, [RunOptions(seed=k) for k in range(3)], print, 2)
    assert [job.draw is not None for job in jobs] == [True, True, False]
