"""The proofs as a whole: what is kept, what is run again, what the table says."""

import signal
import sys
import threading
from pathlib import Path

import pytest

from tools.proofs import prove
from tools.proofs.prove import Proof, is_enough, kept_result, main, minutes_of, print_table, proofs, run_all

LONG = "import time; time.sleep(600)"
COUNT = "import pathlib; f = pathlib.Path('{}'); f.write_text((f.read_text() if f.exists() else '') + 'x'); "


def proof(tmp_path: Path, name: str, says: str, status: int = 0) -> Proof:
    """One that prints something, and leaves a mark each time it runs."""
    code = COUNT.format(tmp_path / f"{name}.ran") + f"print({says!r}); raise SystemExit({status})"
    return Proof(name, f"title of {name}", "goal", r"reached: (.*)", [sys.executable, "-c", code], 1)


def runs(tmp_path: Path, name: str) -> int:
    return len((tmp_path / f"{name}.ran").read_text())


def test_an_interrupted_proof_goes_on_and_the_table_has_all(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good, bad = proof(tmp_path, "good", "reached: 7"), proof(tmp_path, "bad", "reached: 3", status=1)
    run_all([good], tmp_path, "sources", again=False)
    assert not print_table(run_all([good, bad], tmp_path, "sources", again=False))
    said = capsys.readouterr()
    assert runs(tmp_path, "good") == 1
    assert "good: kept from before" in said.err
    assert "bad: about 1 min of 1 min left" in said.err
    assert [line.split()[0] for line in said.out.splitlines()] == ["yes", "NO", "proof:"]
    assert said.out.endswith("1 of 2 goals reached; not: bad\n")


def test_proofs_of_one_core_run_beside_each_other(tmp_path: Path) -> None:
    """Each waits until the other has begun."""

    def meeting(name: str, other: str) -> Proof:
        code = f"""if True:
            import pathlib, time
            here = pathlib.Path({str(tmp_path)!r})
            (here / {name!r}).touch()
            until = time.monotonic() + 20
            while not (here / {other!r}).exists() and time.monotonic() < until:
                time.sleep(0.01)
            print("reached:", (here / {other!r}).exists())
        """
        return Proof(name, name, "goal", r"reached: (.*)", [sys.executable, "-c", code], 1)

    results = run_all([meeting("a", "b"), meeting("b", "a")], tmp_path, "sources", again=False)
    assert [(one.name, result.figure) for one, result in results] == [("a", "True"), ("b", "True")]


def test_proofs_that_ask_for_it_run_alone_in_their_order_after_the_others(tmp_path: Path) -> None:
    log = tmp_path / "log"

    def noting(name: str, minutes: float, alone: bool) -> Proof:
        code = f"""if True:
            import time
            for what in ("begin", "end"):
                with open({str(log)!r}, "a") as file:
                    print(what, {name!r}, file=file)
                time.sleep(0.1)
            print("reached: 1")
        """
        return Proof(name, name, "goal", r"reached: (.*)", [sys.executable, "-c", code], minutes, alone=alone)

    chosen = [noting("a", 1, True), noting("b", 9, True), noting("beside", 1, False)]
    results = run_all(chosen, tmp_path, "sources", again=False)
    assert [one.name for one, _ in results] == ["a", "b", "beside"]
    order = [f"{what} {name}" for name in ("beside", "a", "b") for what in ("begin", "end")]
    assert log.read_text().splitlines() == order


def test_the_time_of_all_is_that_of_two_lanes_and_then_of_those_that_run_alone(tmp_path: Path) -> None:
    one = proof(tmp_path, "one", "")
    assert minutes_of([one._replace(minutes=minutes) for minutes in (1, 5, 2, 2)]) == 5
    assert minutes_of([one._replace(minutes=3), one._replace(minutes=4, alone=True)]) == 7


def test_stopped_all_ends_and_what_had_not_ended_is_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    long = Proof("long", "long", "goal", r"reached: (.*)", [sys.executable, "-c", LONG], 9)
    quick, later = proof(tmp_path, "quick", "reached: 7"), long._replace(name="later", minutes=0.5)
    say = prove.say

    def say_and_stop(text: str) -> None:
        say(text)
        if "later" in text:  # the last of three to begin, in the place of the quick one
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)

    monkeypatch.setattr(prove, "say", say_and_stop)
    with pytest.raises(KeyboardInterrupt):
        run_all([long, quick, later], tmp_path, "sources", again=False)
    monkeypatch.undo()
    assert kept_result(tmp_path, long, "sources") is None
    rest = [quick, proof(tmp_path, "long", "reached: 7"), proof(tmp_path, "later", "reached: 7")]
    assert print_table(run_all(rest, tmp_path, "sources", again=False))
    assert runs(tmp_path, "quick") == runs(tmp_path, "long") == runs(tmp_path, "later") == 1


def test_what_was_proved_on_other_sources_or_otherwise_is_not_proved(tmp_path: Path) -> None:
    one = proof(tmp_path, "one", "reached: 7")
    run_all([one], tmp_path, "before", again=False)
    assert kept_result(tmp_path, one, "before") is not None
    assert kept_result(tmp_path, one, "after") is None
    assert kept_result(tmp_path, one._replace(command=["true"]), "before") is None
    run_all([one], tmp_path, "before", again=True)
    assert runs(tmp_path, "one") == 2


def test_a_proof_without_its_figure_is_missed_and_tried_again(tmp_path: Path) -> None:
    mute = proof(tmp_path, "mute", "nothing")
    for times in (1, 2):
        [(_, result)] = run_all([mute], tmp_path, "sources", again=False)
        assert result[:2] == (False, "not measured")
        assert runs(tmp_path, "mute") == times


@pytest.mark.parametrize(("near", "enough"), [(59, True), (58, False)])
def test_a_share_is_judged_where_the_program_does_not(near: int, enough: bool) -> None:
    camera = next(one for one in proofs() if one.name == "restart_camera")
    assert is_enough(camera, 0, f"two beacons in view: {near} near, 1 off, 0 lost of 60") is enough


def test_the_list_has_every_part_and_runs_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list", "--quick"]) == 0
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert listed == [*(one.name for one in proofs()), "all"]


def test_an_unknown_part_is_named_with_those_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["--only", "soka"])
    assert stopped.value.code == 2
    assert "soka" in capsys.readouterr().err
