"""The proofs as a whole: what is kept, what is run again, what the table says."""

import sys
from pathlib import Path

import pytest

from prove import Proof, is_enough, kept_result, main, print_table, proofs, run_all

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
