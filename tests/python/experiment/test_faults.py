"""Every promise of docs/FAULTS.md is kept, and not kept without what protects from the fault."""

import json
import re
from pathlib import Path

import pytest

from bslam.cli import main
from bslam.commands.faults import all_faults

FAULTS = all_faults(1, cut_every=61)
# A drive of 200 s each, some with two or three runs: one of each kind here, the rest in `make proof`.
SLOW = {
    "no kidnapping",
    "look-alike beacons",
    "restart in a kept map",
    "restart by directions alone",
    "40 % outlier sightings",
    "bump",
}
QUICK = [one for one in FAULTS if one.name not in SLOW]


@pytest.mark.parametrize("fault", QUICK, ids=[one.name for one in QUICK])
def test_the_promise_is_kept(fault):
    measured = fault.inject(True)
    assert measured.kept, measured.text


@pytest.mark.parametrize("fault", QUICK, ids=[one.name for one in QUICK])
def test_without_its_protection_it_is_not(fault):
    measured = fault.inject(False)
    assert not measured.kept, measured.text


def test_every_fault_has_a_row_in_the_document_and_every_row_a_fault():
    text = (Path(__file__).parents[3] / "docs" / "FAULTS.md").read_text(encoding="utf-8")
    table = text.split("Not injected by the command")[0]
    rows = re.findall(r"^\| (?!fault \||-)([^|]+) \|", table, re.MULTILINE)
    assert {name.strip() for row in rows for name in row.split(";")} == {one.name for one in FAULTS}


def test_command_writes_what_it_measured_and_says_how_many(tmp_path, capsys):
    assert main(["faults", "--only", "dt ", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "3 of 3 as promised"
    written = json.loads((tmp_path / "faults.json").read_text())
    assert [one["kept"] for one in written["faults"]] == [True] * 3
    assert main(["faults", "--only", "dt ", "--unprotected", "--out", str(tmp_path)]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "0 of 3 as promised"


def test_a_fault_that_does_not_exist_is_said(tmp_path, capsys):
    assert main(["faults", "--only", "rain", "--out", str(tmp_path)]) == 2
    assert "rain" in capsys.readouterr().err
