"""README, docs/PYTHON.md, LOG-FORMAT.md, TUNING.md and CLI.md: examples run, lists are complete."""

import contextlib
import io
import json
import re
import shlex
from dataclasses import fields

import pytest

from bslam.cli import COMMANDS, main
from bslam.core import Slam
from bslam.evaluation.trace import Trace
from bslam.log import GYRO, GYRO_SD, ODOMETRY_COLUMNS, SIGHTING_NUMBERS, Robot
from bslam.recording.entries import FORMATS
from bslam.world.scenario import scenario_names
from docs.reading import blocks, column, read, section

CLI, LOGS, PYTHON, TUNING = (read(f"docs/{name}.md") for name in ("CLI", "LOG-FORMAT", "PYTHON", "TUNING"))


@pytest.mark.parametrize("document", ["README.md", "docs/PYTHON.md", "docs/LOG-FORMAT.md", "docs/TUNING.md"])
def test_examples_run(document, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = read(document)
    for source in blocks(text, "python"):
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(source, document, "exec"), {})
    for command in "".join(blocks(text, "sh")).splitlines():
        program, *words = shlex.split(command)
        assert program == "bslam"
        assert main(words) == 0, command
    for summary in tmp_path.glob("out/*/summary.json"):
        check_summary(summary)


def check_summary(summary):
    """Its keys are listed; a made-up drive is one that the filter can follow."""
    for entry in json.loads(summary.read_text())["runs"]:
        assert set(entry) <= column(section(CLI, "What a run leaves"))
        if entry["scenario"] == "my_robot":
            assert entry["refused_inputs"] == 0
            assert entry["rejected"] == 0
            assert entry["beacons_mapped"] == 2
            assert entry["velocity_states"] is False


def test_commands_are_all_listed():
    assert {word.split()[1] for word in column(section(CLI, "Commands"))} == set(COMMANDS)


def test_examples_of_commands_are_of_that_command():
    for row in re.findall(r"^\| (`bslam .*)$", section(CLI, "Commands"), re.MULTILINE):
        command, _, example, *_ = row.split("|")
        assert command.strip(" `") == " ".join(example.strip(" `").split()[:2])


def test_scenarios_are_all_listed():
    (line,) = re.findall(r"^Scenarios: (.*)$", CLI, re.MULTILINE)
    assert set(re.findall(r"`(\w+)`", line)) == set(scenario_names())


def test_options_of_a_run_are_all_listed(capsys):
    with pytest.raises(SystemExit):
        main(["run", "--help-all"])
    known = set(re.findall(r"(--[a-z-]+)", capsys.readouterr().out)) - {
        "--help",
        "--help-all",
        "--record",
        "--film",
        "--all",  # of `bslam params`
    }
    assert set(re.findall(r"(--[a-z-]+)", " ".join(column(section(CLI, "Options of a run"))))) == known


def test_columns_and_keys_of_a_log_are_all_listed():
    odometry = {name for names in ODOMETRY_COLUMNS.values() for name in names}
    listed = column(LOGS, 1)
    assert {*odometry, GYRO, GYRO_SD, *SIGHTING_NUMBERS, "beacon_class", "mappable", "range_m"} <= listed
    assert {one.name for one in fields(Robot)} <= column(LOGS)


def test_topics_of_a_recording_are_all_listed():
    topics = {form.topic for form in FORMATS.values()} | {"/pose", "/true_pose", "/scene"}
    assert topics == column(section(LOGS, "A recording is one file"))


def test_what_a_trace_has_is_listed():
    assert column(section(PYTHON, "A trace")) <= {one.name for one in fields(Trace)}


def test_methods_exist():
    names = {word.split("(")[0] for word in column(section(PYTHON, "One robot"))}
    methods = {name for name in names if not name.endswith("=")}
    assert all(hasattr(Slam, name.removeprefix("Slam.")) for name in methods)
