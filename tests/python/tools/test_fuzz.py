"""The ledger of fuzzing: what counts for which goal, and what is never run."""

import signal
import sys
import threading
import time
from pathlib import Path

import pytest

from tools.proofs import fuzz
from tools.proofs.fuzz import FILLER, GOAL_ALL, GOAL_EACH, TARGETS, Slice, main, missing


def slices(sources: str, executions: int, crashes: int = 0) -> list[Slice]:
    """One of each target."""
    return [Slice("when", "commit", sources, name, 1, executions, 60, crashes) for name in TARGETS]


@pytest.fixture(autouse=True)
def ledger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz, "LEDGER", tmp_path / "ledger.csv")
    monkeypatch.setattr(fuzz, "source_hash", lambda: "now")


def test_a_million_on_a_target_counts_on_the_sources_as_they_are_only() -> None:
    assert missing(slices("before", GOAL_EACH), "map") == GOAL_EACH
    assert missing(slices("before", GOAL_EACH) + slices("now", 400_000), "map") == GOAL_EACH - 400_000
    assert missing(slices("now", 2 * GOAL_EACH), "map") == 0


def test_the_filler_makes_up_what_the_others_leave_of_the_sum() -> None:
    others = (len(TARGETS) - 1) * GOAL_EACH
    assert missing([], FILLER) == GOAL_ALL - others
    done = slices("before", GOAL_EACH)
    assert missing(done, FILLER) == GOAL_ALL - others - len(TARGETS) * GOAL_EACH
    assert missing([*done, done[0]._replace(executions=GOAL_ALL)], FILLER) == GOAL_EACH


@pytest.mark.parametrize(("sources", "status"), [("before", 0), ("now", 1)])
def test_a_crash_counts_until_the_sources_are_others(
    sources: str, status: int, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = slices("now", GOAL_ALL)
    lines[0] = lines[0]._replace(sources=sources, crashes=1, executions=0)
    for line in [*lines, lines[1]._replace(target=lines[0].target)]:
        fuzz.write_down(line)
    assert main(["--table"]) == status
    assert f"{status} crashes ({1 - status} on earlier sources)" in capsys.readouterr().out


def test_programs_of_other_sources_are_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(fuzz, "BUILT_OF", tmp_path / "sources")
    for built_of in (None, "before"):
        if built_of is not None:
            fuzz.BUILT_OF.write_text(built_of)
        assert main(["--seconds", "1"]) == 2
        assert "`make fuzz` does it" in capsys.readouterr().err


def test_each_target_runs_here_though_its_goal_was_met_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = []

    def run(target: str, seed: int, seconds: int, runs: int) -> Slice:
        ran.append((target, seconds))
        line = Slice("when", "commit", "now", target, seed, 7, seconds, 0)
        fuzz.write_down(line)
        return line

    monkeypatch.setattr(fuzz, "run_slice", run)
    monkeypatch.setattr(fuzz, "BUILT_OF", tmp_path / "sources")
    fuzz.BUILT_OF.write_text("now")
    for line in slices("now", GOAL_ALL):
        fuzz.write_down(line)
    assert main([]) == 0
    assert ran == []
    assert "0 of them now, 0 crashes" in capsys.readouterr().out
    assert main(["--each", "5"]) == 0
    assert ran == [(target, 5) for target in TARGETS]
    assert f"{7 * len(TARGETS)} of them now, 0 crashes" in capsys.readouterr().out


def test_two_at_a_time_share_what_is_missing_and_make_no_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    both = threading.Barrier(2)
    ran = []

    def run(target: str, seed: int, seconds: int, runs: int) -> Slice:
        ran.append((target, runs, seed))
        both.wait(20)  # a second one is under way
        line = Slice("when", "commit", "now", target, seed, runs, 1, 0)
        with fuzz.LOCK:
            fuzz.write_down(line)
        return line

    monkeypatch.setattr(fuzz, "run_slice", run)
    monkeypatch.setattr(fuzz, "BUILT_OF", tmp_path / "sources")
    fuzz.BUILT_OF.write_text("now")
    assert main(["--jobs", "2"]) == 0
    made = {target: [runs for name, runs, _ in ran if name == target] for target in TARGETS}
    others = (len(TARGETS) - 1) * GOAL_EACH
    assert made.pop(FILLER) == [(GOAL_ALL - others) // 2] * 2
    assert all(runs == [GOAL_EACH // 2] * 2 for runs in made.values())
    assert len({seed for *_, seed in ran}) == len(ran)
    assert "0 crashes" in capsys.readouterr().out


def test_a_crash_ends_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def run(target: str, seed: int, seconds: int, runs: int) -> Slice:
        line = Slice("when", "commit", "now", target, seed, 5, 1, 1)
        with fuzz.LOCK:
            fuzz.write_down(line)
        return line

    monkeypatch.setattr(fuzz, "run_slice", run)
    monkeypatch.setattr(fuzz, "BUILT_OF", tmp_path / "sources")
    fuzz.BUILT_OF.write_text("now")
    assert main(["--jobs", "2"]) == 1
    assert len(fuzz.read_ledger()) <= 2
    assert "crashes (0 on earlier sources)" in capsys.readouterr().out


def test_a_slice_that_is_stopped_is_not_written_down(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop_what_runs() -> None:
        while not fuzz.RUNNING:
            time.sleep(0.01)
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)

    script = tmp_path / "link"
    script.write_text(f"#!{sys.executable}\nimport time\ntime.sleep(20)\n")
    script.chmod(0o755)
    monkeypatch.setattr(fuzz, "PROGRAMS", tmp_path)
    monkeypatch.setattr(fuzz, "OUT", tmp_path / "out")
    monkeypatch.setattr(fuzz, "BUILT_OF", tmp_path / "sources")
    monkeypatch.setattr(fuzz, "unpack", lambda target: None)
    fuzz.BUILT_OF.write_text("now")
    threading.Thread(target=stop_what_runs, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        main(["--targets", "link"])
    assert fuzz.read_ledger() == []


@pytest.mark.parametrize(("alone", "crashes"), [(0, 0), (70, 1)])
def test_an_input_that_took_long_once_is_a_crash_if_it_does_again(
    alone: int, crashes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fuzz, "PROGRAMS", tmp_path)
    monkeypatch.setattr(fuzz, "OUT", tmp_path / "out")
    monkeypatch.setattr(fuzz, "BUILT_OF", tmp_path / "sources")
    monkeypatch.setattr(fuzz, "STOP", threading.Event())
    fuzz.BUILT_OF.write_text("now")
    given_up = tmp_path / "map-timeout-0"
    given_up.write_bytes(b"input")
    program = tmp_path / "map"
    program.write_text(
        f"""#!/bin/sh
for last; do :; done
if [ "$last" = {given_up} ]; then exit {alone}; fi
echo "Test unit written to {given_up}" >&2
echo "==1== ERROR: libFuzzer: timeout after 11 seconds" >&2
exit 70
"""
    )
    program.chmod(0o755)
    assert fuzz.run_slice("map", 1, 1, 1).crashes == crashes
    assert given_up.exists() == bool(crashes)
