"""docs/API.md: its examples run, its lists are complete, its table of parameters is the C table."""

import contextlib
import io
import json
import os
import re
import shlex
import subprocess
from dataclasses import fields
from pathlib import Path

import pytest

from bslam.cli import COMMANDS, main
from bslam.core.raw import library
from bslam.log import Robot
from tools.checks import params_doc

ROOT = Path(__file__).resolve().parents[3]
API = (ROOT / "docs" / "API.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", API, re.MULTILINE | re.DOTALL)


def section(title):
    """The text below a heading, up to the next one of its level or above."""
    level = re.search(rf"^(#+) {re.escape(title)}$", API, re.MULTILINE)
    return re.split(rf"^#{{1,{len(level[1])}}} ", API[level.end() :], maxsplit=1, flags=re.MULTILINE)[0]


def first_column(text):
    """Every `word` in the first column of the tables in a text."""
    rows = re.findall(r"^\|([^|]*)\|", text, re.MULTILINE)
    return {word for row in rows for word in re.findall(r"`([^`]+)`", row)}


def test_parameters_table_is_that_of_the_c_headers():
    stands = API.split(params_doc.BEGIN)[1].split(params_doc.END)[0]
    assert stands.strip() == params_doc.table().strip(), "run `make docs`"


def test_parameters_table_is_put_between_the_markers(tmp_path, capsys):
    file = tmp_path / "doc.md"
    file.write_text(f"above\n{params_doc.BEGIN}\nstale\n{params_doc.END}\nbelow\n")
    assert params_doc.main(["--into", str(file)]) == 0
    once = file.read_text()
    assert once.startswith("above\n")
    assert once.endswith("\nbelow\n")
    assert params_doc.table() in once
    assert "stale" not in once
    assert params_doc.main(["--into", str(file)]) == 0
    assert file.read_text() == once


def test_parameters_table_without_markers_is_refused(tmp_path, capsys):
    file = tmp_path / "doc.md"
    file.write_text("nothing here\n")
    assert params_doc.main(["--into", str(file)]) == 1
    assert "doc.md" in capsys.readouterr().err
    assert file.read_text() == "nothing here\n"


def test_c_example_compiles_and_prints_what_is_said(tmp_path):
    (source,) = blocks("c")
    (expected,) = blocks("text")
    (tmp_path / "example.c").write_text(source)
    core = sorted(map(str, (ROOT / "firmware" / "bslam").glob("*/*.c")))
    flags = ["-std=c11", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", f"-I{ROOT / 'firmware'}"]
    command = [os.environ.get("CC", "cc"), *flags, "example.c", *core, "-lm", "-o", "example"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run(["./example"], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert done.stdout == expected


def test_python_examples_run_and_then_the_commands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for source in blocks("python"):
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(source, "API.md", "exec"), {})
    commands = [line for block in blocks("sh") for line in block.splitlines()]
    assert len(commands) >= 5
    for command in commands:
        program, *words = shlex.split(command)
        assert program == "bslam"
        assert main(words) == 0, command
    check_my_robot(tmp_path / "out" / "my_robot" / "summary.json")
    check_summary_keys(tmp_path / "out" / "tuned" / "summary.json")


def check_my_robot(summary):
    """The made-up recording is one that the filter can follow."""
    (entry,) = json.loads(summary.read_text())["runs"]
    assert entry["refused_inputs"] == 0
    assert entry["rejected"] == 0
    assert entry["beacons_mapped"] == 2
    assert entry["velocity_states"] is False


def check_summary_keys(summary):
    (entry,) = json.loads(summary.read_text())["runs"]
    assert set(entry) <= first_column(section("Output files"))


def test_statuses_are_all_listed():
    raw = library("float", 1)
    names = {raw.text(raw.lib.bslam_status_name(status)) for status in range(raw.lib.BSLAM_STATUS_COUNT)}
    assert names == first_column(section("Refusals"))


def test_outcomes_and_reasons_are_all_listed():
    raw, text = library("float", 1), section("What became of a sighting")
    for type_name, prefix in (("bslam_outcome_t", "BSLAM_OUTCOME_"), ("bslam_reason_t", "BSLAM_REASON_")):
        for name in set(raw.enum_names(type_name, prefix).values()) - {"count"}:
            words = name.replace("_", " ")
            assert re.search(rf"^\| {words} \||^\|[^|]*\| {words} \|", text, re.MULTILINE), name


def test_sizes_are_those_of_the_configuration():
    config = (ROOT / "firmware" / "bslam" / "base" / "config.h").read_text(encoding="utf-8")
    defaults = dict(re.findall(r"^#define (BSLAM_\w+) (.+)$", config, re.MULTILINE))
    table = section("Memory")
    assert set(defaults) - {"BSLAM_BASE_CONFIG_H"} == first_column(table) - {"macro"}
    for name, value in defaults.items():
        if value.isdecimal():
            assert re.search(rf"^\| `{name}` \| {value} \|", table, re.MULTILINE), name


def test_commands_are_all_listed():
    listed = {word.split()[1] for word in first_column(section("The command line"))}
    assert listed == set(COMMANDS)


def test_keys_of_robot_toml_are_all_listed():
    assert {one.name for one in fields(Robot)} <= first_column(section("A log is a folder"))


@pytest.mark.parametrize("name", re.findall(r"`(bslam_(?:slam|params|pose)_\w+)`", API))
def test_functions_that_are_named_exist(name):
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "firmware" / "bslam").rglob("*.h"))
    assert re.search(rf"\b{name}\b", text)
