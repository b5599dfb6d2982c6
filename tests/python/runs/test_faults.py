"""Every promise of docs/FAULTS.md is kept, and not kept without what protects from the fault."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from bslam.cli import main
from bslam.commands import faults as faults_command
from bslam.commands.faults import all_faults
from bslam.errors import BslamError
from bslam.faults import device
from bslam.faults.model import FAULT_MODEL, missing_parts

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


TEXT = (Path(__file__).parents[3] / "docs" / "FAULTS.md").read_text(encoding="utf-8")
NAMES = {one.name for one in FAULTS}


def test_every_fault_has_a_row_in_the_document_and_every_row_a_fault():
    table = TEXT.split("## What is promised")[1].split("Not injected by the command")[0]
    rows = re.findall(r"^\| (?!fault \||-)([^|]+) \|", table, re.MULTILINE)
    assert {name.strip() for row in rows for name in row.split(";")} == NAMES


def test_every_part_of_the_fault_model_is_injected_and_every_fault_is_of_it():
    assert missing_parts(FAULTS) == []
    named = [name for parts in FAULT_MODEL.values() for names in parts.values() for name in names]
    assert sorted(named) == sorted(NAMES)
    without = [one for one in FAULTS if one.name != "image: black"]
    assert missing_parts(without) == ["images: black"]


def test_the_document_shows_the_fault_model():
    table = TEXT.split("## The fault model")[1].split("## ")[0]
    shown = re.findall(r"^\| (?!fault \||-)([^|]*) \| ([^|]+) \| ([^|]+) \|$", table, re.MULTILINE)
    row, found = "", []
    for title, part, names in shown:
        row = title or row
        found.append((row, part, tuple(names.split("; "))))
    assert found == [(row, *item) for row, parts in FAULT_MODEL.items() for item in parts.items()]


def test_what_cannot_be_injected_and_what_is_missing_are_not_as_promised(tmp_path, capsys, monkeypatch):
    def gone(_protected):
        raise BslamError("no tools for it")

    good = next(one for one in FAULTS if one.name == "dt zero")
    faults = [good, replace(good, name="dt negative", inject=gone)]
    monkeypatch.setattr(faults_command, "all_faults", lambda _seeds: faults)
    assert main(["faults", "--out", str(tmp_path)]) == 1
    printed = capsys.readouterr().out
    parts = sum(len(parts) for parts in FAULT_MODEL.values())
    assert printed.splitlines()[-1] == f"1 of {2 + parts - 1} as promised"
    assert "no tools for it" in printed and "images: black: injected by nothing" in printed
    assert len(json.loads((tmp_path / "faults.json").read_text())["missing"]) == parts - 1


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


def test_faults_of_the_firmware_take_a_clone_and_say_so_before_anything_runs(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(device, "ROOT", tmp_path)
    assert main(["faults", "--only", "line", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert "line: message twice, line: replay: the firmware's sources are not here; allowed: " in said.err
    assert "in a clone of bslam" in said.err and said.out == "" and not (tmp_path / "out").exists()
    assert main(["faults", "--only", "dt zero", "--out", str(tmp_path / "out")]) == 0
