"""Mutants: what is changed, what they are called, and when what is known of one still holds."""

import json
from pathlib import Path

import pytest

from tools.proofs import mutants
from tools.proofs.mutants import LAYERS, Results, changes, main, mutants_of

SOURCE = """// a < b stays, and so does "x + y"
static bool is_less(int a, int b)
{
    if (f(a) < b) {
        go("1 + 1", a);
        c -= a > 0 ? -a : b;
    }
    return a + 1 == b && d * BSLAM_R(0.5) > 0;
}
"""


@pytest.fixture
def core(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A core of one source."""
    monkeypatch.setattr(mutants, "CORE", tmp_path / "firmware")
    monkeypatch.setattr(mutants, "TESTS", tmp_path / "tests")
    monkeypatch.setattr(mutants, "KNOWN", tmp_path / "out/results.jsonl")
    (tmp_path / "firmware/link").mkdir(parents=True)
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests/mutants.toml").write_text("same = []\n")
    (tmp_path / "firmware/link/less.c").write_text(SOURCE)
    return tmp_path


def test_each_operator_changes_its_place_and_what_is_no_code_stays(core: Path) -> None:
    found = {one.key.removeprefix("link/less.c: ") for one in mutants_of("link")}
    assert {
        "if (f(a) < b) { => if (f(a) <= b) {",
        "if (f(a) < b) { => if (!(f(a) < b)) {",
        'go("1 + 1", a); => ;',
        "c -= a > 0 ? -a : b; => c -= a > 0 ? b : -a;",
        "c -= a > 0 ? -a : b; => c -= a > 0 ? a : b;",
        "c -= a > 0 ? -a : b; => c += a > 0 ? -a : b;",
        "return a + 1 == b && d * BSLAM_R(0.5) > 0; => return a - 1 == b && d * BSLAM_R(0.5) > 0;",
        "return a + 1 == b && d * BSLAM_R(0.5) > 0; => return a + 1 == b || d * BSLAM_R(0.5) > 0;",
        "return a + 1 == b && d * BSLAM_R(0.5) > 0; => return a + 1 == b && d * (2 * BSLAM_R(0.5)) > 0;",
        "return a + 1 == b && d * BSLAM_R(0.5) > 0; => return a + (1 + 1) == b && d * BSLAM_R(0.5) > 0;",
    } <= found
    assert any(key.endswith("{ return 0;") for key in found)
    assert not any("a <= b stays" in key or "x - y" in key or "1 - 1" in key for key in found)


def test_a_mutant_keeps_its_name_and_place_in_the_sample_when_lines_are_added(core: Path) -> None:
    before = [one.key for one in mutants_of("link")]
    (core / "firmware/link/less.c").write_text("\n\n" + SOURCE + "\nint g;\n")
    assert [one.key for one in mutants_of("link")] == before


def test_the_same_change_twice_in_a_file_has_two_names(core: Path) -> None:
    (core / "firmware/link/less.c").write_text(SOURCE + SOURCE)
    keys = [one.key for one in mutants_of("link")]
    assert len(set(keys)) == len(keys)


def test_what_is_known_holds_until_the_file_changes_and_of_survivors_until_anything_does(core: Path) -> None:
    killed, survivor = mutants_of("link")[:2]
    (core / "out").mkdir()
    results = Results()
    results.add(killed, "link/test_less")
    results.add(survivor, "survived")
    assert (Results().of(killed), Results().of(survivor)) == ("link/test_less", "survived")
    (core / "tests/test_less.c").write_text("more")
    assert (Results().of(killed), Results().of(survivor)) == ("link/test_less", "unknown")
    (core / "firmware/link/less.c").write_text("//\n" + SOURCE)
    assert Results().of(killed) == "unknown"


@pytest.mark.parametrize(("survivors", "status"), [(0, 0), (1, 1)])
def test_a_goal_is_missed_by_one_survivor_and_a_verdict_takes_it_out(
    core: Path, survivors: int, status: int, capsys: pytest.CaptureFixture[str]
) -> None:
    (core / "out").mkdir()
    results, all_of = Results(), mutants_of("link")
    for number, mutant in enumerate(all_of):
        results.add(mutant, "survived" if number < survivors else "link/test_less")
    assert main(["--list", "--layers", "link", "--sample", "9"]) == status
    assert f"mutants: {9 - survivors} of 9 killed" in capsys.readouterr().out
    entry = f"[[same]]\nmutant = '''{all_of[0].key}'''\nreason = 'none'\n"
    (core / "tests/mutants.toml").write_text(entry)
    assert main(["--list", "--layers", "link", "--sample", "9"]) == 0
    (core / "tests/mutants.toml").write_text(entry.replace("link/less.c", "link/more.c"))
    assert main(["--list"]) == 2
    assert "link/more.c" in capsys.readouterr().err


def test_every_verdict_of_the_project_is_a_mutants() -> None:
    assert main(["--list", "--sample", "7"]) in (0, 1)
    assert all(mutants_of(layer) for layer in LAYERS)


def test_a_condition_is_negated_up_to_its_bracket() -> None:
    text = "    if (a(b) && (c)) {\n"
    assert (7, 20, "(!(a(b) && (c)))") in set(changes(text))


def test_a_result_is_a_line_of_json(core: Path) -> None:
    (core / "out").mkdir()
    Results().add(mutants_of("link")[0], "same")
    [line] = mutants.KNOWN.read_text().splitlines()
    assert json.loads(line)[2] == "same"
