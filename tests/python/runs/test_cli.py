"""The command line as a user meets it."""

import json
import os
import re
import subprocess
import sys
from importlib.metadata import version

import numpy as np
import pytest

from bslam.cli import COMMANDS, main
from bslam.core import Slam


@pytest.fixture
def log_folder(made, tmp_path):
    folder = tmp_path / "drive"
    made.circle_log(60, seed=1).write(folder)
    return folder


def last_line(capsys):
    return capsys.readouterr().err.strip().splitlines()[-1]


def status_of(words):
    """Exit status, whether argparse exits or main returns."""
    try:
        return main(words)
    except SystemExit as error:
        return error.code


def runs(out):
    return json.loads((out / "summary.json").read_text())["runs"]


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["fly"], ["'fly'", "allowed: run, replay"]),
        (["run"], ["SCENARIO"]),
        (["run", "nowhere"], ["'nowhere'", "paper_room"]),
        (["run", "paper_room", "--observation", "x"], ["--observation", "'x'", "distance, direction"]),
        (["run", "paper_room", "--association", "look"], ["--association", "'look'", "known", "nearest"]),
        (["run", "paper_room", "--association", "known:7"], ["--association", "'7'", "0 to 1"]),
        (["run", "paper_room", "--filter", "x"], ["--filter", "'x'", "standard, invariant, smoother"]),
        (["run", "paper_room", "--motion", "x"], ["--motion", "'x'", "euler"]),
        (["run", "paper_room", "--noise", "x"], ["--noise", "'x'", "speedometer"]),
        (["run", "paper_room", "--sensor", "lidar"], ["--sensor", "'lidar'", "simulated"]),
        (["run", "paper_room", "--sensor", "camera", "--rig", "none"], ["'none'", "three60"]),
        (["run", "paper_room", "--rig", "wide90"], ["rig 'wide90'", "did you mean", "wide180"]),
        (["run", "paper_room", "--rig", "wide180"], ["--rig wide180", "with --sensor camera"]),
        (["live", "paper_room", "--rig", "wide180"], ["--rig wide180", "with --sensor camera"]),
        (["run", "paper_room", "--target", "qemu:m4"], ["--target", "'qemu:m4'", "host"]),
        (["run", "paper_room", "--sigma", "-1"], ["--sigma", "'-1'", "from 0"]),
        (["run", "paper_room", "--sigma", "inf"], ["--sigma", "'inf'", "from 0"]),
        (["run", "paper_room", "--seeds", "5"], ["--seeds", "'5'", "A:B"]),
        (["run", "paper_room", "--seeds", "5:5"], ["--seeds", "'5:5'", "A < B"]),
        (["run", "paper_room", "--jobs", "0"], ["--jobs", "'0'", "from 1"]),
        (["run", "paper_room", "--set", "bearing_sd=1"], ["--set", "'bearing_sd'", "bearing_sd_rad"]),
        (["run", "paper_room", "--set", "bearing_sd_rad"], ["--set", "bearing_sd_rad", "KEY=VALUE"]),
        (["run", "paper_room", "--set", "bearing_sd_rad=x"], ["--set", "'x'", "finite number"]),
        (["run", "paper_room", "--set", "bearing_sd_rad=nan"], ["--set", "'nan'", "finite number"]),
        (["run", "paper_room", "--set", "bearing_sd_rad=-2"], ["bearing_sd_rad", "-2", "from 0.0001"]),
        (["run", "paper_room", "--params", "no.toml"], ["--params", "no.toml", "TOML"]),
        (["run", "paper_room", "--colour"], ["--colour"]),
        (["replay", "rosbag", "x"], ["'rosbag'", "csv", "mrclam"]),
        (["replay", "csv", "/no/such/log"], ["/no/such/log", "allowed"]),
        (["replay", "csv", "x", "--robot", "1"], ["--robot", "mrclam"]),
        (["replay", "mrclam", "/no/such/set", "--robot", "9"], ["--robot", "9", "1, 2, 3, 4, 5"]),
        (["tables", "--filter", "standard,x"], ["--filter", "'x'", "standard, invariant"]),
        (["sweep", "paper_room", "--filter", "standard,x"], ["--filter", "'x'", "standard, invariant"]),
        (["live", "paper_room", "pairs"], ["'pairs' after paper_room", "one SCENARIO"]),
        (["live", "csv", "/no/such/log"], ["/no/such/log", "allowed"]),
        (["live", "paper_room", "--speed", "0"], ["--speed", "'0'", "above 0, or inf"]),
        (["live", "paper_room", "--port", "70000"], ["--port", "'70000'", "65535"]),
        (["calibrate", "csv", "/no/such/log"], ["/no/such/log", "allowed"]),
    ],
)  # fmt: skip
def test_bad_input_exits_2_and_the_last_line_says_what_and_what_is_allowed(
    words, parts, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert status_of(words) == 2
    line = last_line(capsys)
    for part in parts:
        assert part in line


def test_a_data_directory_that_does_not_exist_is_named(capsys, monkeypatch):
    monkeypatch.setenv("BSLAM_DATA", "/no/such/data")
    assert status_of(["replay", "mrclam", "MRCLAM_Dataset1"]) == 2
    assert "BSLAM_DATA: '/no/such/data' is not a directory" in last_line(capsys)


def test_a_path_needs_no_data_directory(log_folder, tmp_path, monkeypatch):
    monkeypatch.setenv("BSLAM_DATA", "/no/such/data")
    assert status_of(["replay", "csv", str(log_folder), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 0


def test_a_set_that_the_data_directory_does_not_have_is_named_with_those_it_has(
    capsys, monkeypatch, tmp_path
):
    (tmp_path / "mrclam" / "MRCLAM_Dataset3").mkdir(parents=True)
    monkeypatch.setenv("BSLAM_DATA", str(tmp_path))
    assert status_of(["replay", "mrclam", "MRCLAM_Dataset1"]) == 2
    line = last_line(capsys)
    assert "MRCLAM_Dataset1: no such directory" in line
    assert line.endswith("MRCLAM_Dataset3")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["replay", "my_drive"], "did you mean: bslam replay csv my_drive"),
        (["replay", "my_driv"], "did you mean: bslam replay csv my_drive"),
        (["replay", "csv", "my_driv"], "did you mean 'my_drive'?"),
        (["live", "my_drive"], "did you mean: bslam live csv my_drive"),
        (["check", "my_drvie"], "did you mean: bslam check csv my_drive"),
        (["replay", "my_bag"], "did you mean: bslam import ros2 my_bag"),
        (["check", "my_bag"], "did you mean: bslam import ros2 my_bag"),
        (["import", "my_bag"], "did you mean: bslam import ros2 my_bag"),
        (["live", "my_bag"], "did you mean: bslam import ros2 my_bag"),
        (["replay", "my_bag/my_bag.db3"], "did you mean: bslam import ros2 my_bag/my_bag.db3"),
        (["replay", "csv", "my_bag"], "my_bag"),
        (["replay", "csv", "elsewhere/x"], "robot.toml"),
    ],
)
def test_a_folder_that_is_said_otherwise_is_met_with_the_line_to_type(
    words, said, tmp_path, monkeypatch, capsys
):
    for file in ("my_drive/odometry.csv", "my_bag/metadata.yaml", "my_bag/my_bag.db3"):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).touch()
    monkeypatch.chdir(tmp_path)
    assert status_of(words) == 2
    line = last_line(capsys)
    assert line.endswith(said) and "allowed: " in line and "BSLAM_DATA" not in line


def test_ctrl_c_during_the_imports_is_one_line(tmp_path):
    (tmp_path / "scipy.py").write_text("raise KeyboardInterrupt")
    made = subprocess.run(
        [sys.executable, "-m", "bslam", "--version"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (made.returncode, made.stdout, made.stderr) == (1, "", "bslam: stopped\n")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_with_an_example(name, capsys):
    assert status_of([name, "--help"]) == 0
    text = capsys.readouterr().out
    assert "examples:" in text
    assert f"bslam {name}" in text.split("examples:")[1]
    assert "None" not in text.splitlines()[0]
    assert len(text.splitlines()) <= 49
    assert max(map(len, text.splitlines())) <= 100


@pytest.mark.parametrize("name", ["run", "replay", "compare", "sweep", "stress", "tables", "live", "console"])
def test_options_that_help_only_names_are_explained_on_demand(name, capsys):
    assert status_of([name, "--help"]) == 0
    text = capsys.readouterr().out
    (named,) = re.findall(r"more options, explained by --help-all:\n((?:--.*\n)+)", text)
    assert {"--motion", "--target", "--recovery"} <= set(re.findall(r"--[a-z-]+", named))
    assert status_of([name, "--help-all"]) == 0
    explained = set(re.findall(r"^  (--[a-z-]+)", capsys.readouterr().out, re.MULTILINE))
    assert set(re.findall(r"--[a-z-]+", named)) <= explained


def test_the_overview_lists_every_command(capsys):
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(f"  {name}" in text for name in COMMANDS)
    assert main([]) == 2


def test_the_version_is_that_of_the_package(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"bslam {version('bslam')}\n"


def test_replay_with_options_in_any_order(log_folder, made, tmp_path, capsys):
    other = tmp_path / "other"
    made.circle_log(40).write(other)
    out = tmp_path / "out"
    words = [
        "replay",
        "--filter",
        "standard",
        "csv",
        str(log_folder),
        "--out",
        str(out),
        str(other),
        "--pictures",
        "1",
    ]
    assert main([*words, "--set", "gate_d2=0", "--jobs", "1"]) == 0
    first, second = runs(out)
    assert (first["name"], second["name"]) == ("drive", "other")
    assert first["filter"] == "standard"
    assert first["sensor"] == "recorded"
    assert first["parameters"]["gate_d2"] == 0
    names = {path.name for path in out.iterdir()}
    assert {
        "drive.map.png",
        "drive.error.png",
        "drive.estimate.tum",
        "other.map.csv",
        "summary.json",
    } <= names
    assert "other.map.png" not in names
    text = capsys.readouterr().out
    assert "mean of 2" in text
    assert str(out) in text


def test_run_records_a_log_that_replays_to_the_same(tmp_path):
    out, again = tmp_path / "run", tmp_path / "again"
    assert (
        main(["run", "paper_room", "--seeds", "3:4", "--record", "--pictures", "0", "--out", str(out)]) == 0
    )
    folder = out / "paper_room_seed3"
    assert main(["replay", "csv", str(folder), "--pictures", "0", "--out", str(again)]) == 0
    (first,), (second,) = runs(out), runs(again)
    assert first["position_error_m"] == second["position_error_m"]
    assert (first["scenario"], first["seed"], first["sigma_mps"], first["steps"]) == (
        "paper_room",
        3,
        0.3,
        5000,
    )
    estimate = np.loadtxt(out / "paper_room_seed3.estimate.tum")
    assert estimate.shape == (5001, 8)


def test_a_parameter_file_is_used_and_set_wins(log_folder, tmp_path):
    (tmp_path / "mine.toml").write_text("gate_d2 = 9\nhuber_d = 2.5\n")
    words = ["replay", "csv", str(log_folder), "--params", str(tmp_path / "mine.toml"), "--set", "gate_d2=16"]
    assert main([*words, "--pictures", "0", "--out", str(tmp_path / "out")]) == 0
    (entry,) = runs(tmp_path / "out")
    assert (entry["parameters"]["gate_d2"], entry["parameters"]["huber_d"]) == (16, 2.5)


def test_tables_writes_the_paper_s_figures_beside_ours(tmp_path):
    out = tmp_path / "tables"
    assert (
        main(
            [
                "tables",
                "--seeds",
                "0:2",
                "--sigma",
                "0.6",
                "--jobs",
                "1",
                "--pictures",
                "0",
                "--out",
                str(out),
            ]
        )
        == 0
    )
    text = (out / "tables.md").read_text()
    assert "| Mean error | 10.11 |" in text
    assert text.startswith("# Tables I to III, Figures 6 to 9: association both, 2 runs a cell")
    assert "## Table II" in text and "best to worst" in text
    cells = json.loads((out / "tables.json").read_text())["cells"]
    directions = [("direction", name) for name in ("invariant", "smoother")]
    assert [(cell["observation"], cell["filter"]) for cell in cells] == [
        ("distance", "invariant"),
        *directions,
    ]
    assert len({cell["bound_cm"] for cell in cells[1:]}) == 1, "the drives are the same"
    assert "Direction only: paper | Direction only: invariant filter | Direction only: smoother" in text
    assert "| Mean error of the bound: Jacobians at the truth | | - | |" in text
    assert cells[0]["paper_cm"]["mean"] == 10.11
    own = [entry["position_error_m"]["mean"] for entry in runs(out) if entry["observation"] == "distance"]
    assert cells[0]["error_cm"]["mean"] == pytest.approx(100.0 * np.mean(own))
    assert (out / "sigma0.6.png").read_bytes().startswith(b"\x89PNG")
    assert len(runs(out)) == 6


def test_tables_of_another_room_are_not_the_paper_s(tmp_path, capsys):
    words = ["tables", "--scenario", "pairs", "--sigma", "1.0", "--observation", "distance", "--seeds", "0:1"]
    assert main([*words, "--jobs", "1", "--pictures", "0", "--out", str(tmp_path)]) == 0
    text, said = (tmp_path / "tables.md").read_text(), capsys.readouterr().out
    assert text.startswith("# Tables of pairs: association both, 1 run a cell")
    assert "## sigma 1 m/s" in text and "| cm | Distance observation: invariant filter |" in text
    assert "best to worst" not in text and "paper" not in text
    assert said.startswith("cm, both  ") and "below 7.815" in said
    (cell,) = json.loads((tmp_path / "tables.json").read_text())["cells"]
    assert cell["scenario"] == "pairs" and "paper_cm" not in cell


def test_sweep_runs_every_combination(tmp_path, capsys):
    out = tmp_path / "sweep"
    words = ["sweep", "paper_room", "--filter", "standard,invariant", "--association", "known,known:0.1"]
    assert main([*words, "--jobs", "1", "--out", str(out)]) == 0
    combinations = [(entry["filter"], entry["association"]) for entry in runs(out)]
    assert combinations == [
        ("standard", "known"), ("standard", "known:0.1"), ("invariant", "known"), ("invariant", "known:0.1")
    ]  # fmt: skip
    assert (out / "sweep.txt").read_text().strip() in capsys.readouterr().out


def test_calibrate_writes_parameters_and_tries_them(made, tmp_path, capsys):
    for name, seed in (("first", 1), ("second", 2)):
        made.circle_log(2000, seed=seed).write(tmp_path / name)
    out = tmp_path / "out"
    words = [
        "calibrate",
        "csv",
        str(tmp_path / "first"),
        "--test",
        str(tmp_path / "second"),
        "--out",
        str(out),
    ]
    assert main(words) == 0
    assert "forward_scale = " in (out / "calibrated.toml").read_text()
    assert [entry["name"] for entry in runs(out)] == ["second_before", "second_after"]
    assert "forward_scale" in runs(out)[1]["parameters"]
    assert "ahead of the truth" in capsys.readouterr().out
    again = [
        "replay",
        "csv",
        str(tmp_path / "second"),
        "--params",
        str(out / "calibrated.toml"),
        "--pictures",
        "0",
    ]
    assert main([*again, "--out", str(tmp_path / "again")]) == 0


def test_params_lists_every_parameter_with_default_and_meaning(capsys):
    assert main(["params"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [lines[0], lines[1].split()] == ["settings", ["default", "allowed", "meaning"]]
    assert any(line.startswith("bearing_sd_rad") and "noise of the direction" in line for line in lines)
    names = [one.name for one in Slam.parameters() if one.group != "tuning"]
    assert [line.split()[0] for line in lines if " to " in line[:70]] == names
    assert lines[-1].startswith("`bslam params --all` lists ")
    assert main(["params", "--all"]) == 0
    assert "doubt_nats" in capsys.readouterr().out


def test_set_names_the_nearest_settings_and_keys_of_the_robots_file(capsys):
    instead = {
        "range_sd": "parameter 'range_sd' does not exist; allowed: range_",
        "sighting_scale_sd": "sighting_scale_sd is a key of robot.toml; allowed: ",
    }
    for name, message in instead.items():
        assert main(["run", "figure3", "--set", f"{name}=1"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert message in line
        assert len(line) < 200


def test_preset_is_asked_for_printed_and_kept(tmp_path, capsys):
    run = ["run", "figure3", "--pictures", "0", "--association", "known", "--out", str(tmp_path)]
    assert main(run) == 0
    assert "presets: paper\n" in capsys.readouterr().out
    assert main([*run, "--preset", "real-wheels", "--preset", "camera"]) == 0
    assert "presets: real-wheels, camera\n" in capsys.readouterr().out
    (entry,) = runs(tmp_path)
    assert entry["presets"] == ["real-wheels", "camera"]
    assert entry["parameters"]["huber_d"] == 1.0
    assert not entry["velocity_states"]
    with pytest.raises(SystemExit):
        main([*run, "--preset", "wheels"])
    allowed = "allowed: real-wheels, paper, commanded, camera, bearing-only"
    assert f"'wheels' does not exist; {allowed}" in capsys.readouterr().err


def test_a_broken_log_exits_2_after_the_others_ran(log_folder, made, tmp_path, capsys):
    broken = tmp_path / "broken"
    made.circle_log(5).write(broken)
    (broken / "odometry.csv").write_text("time_us,left_m,right_m\n40000,x,0\n")
    out = tmp_path / "out"
    assert (
        main(
            [
                "replay",
                "csv",
                str(broken),
                str(log_folder),
                "--out",
                str(out),
                "--pictures",
                "0",
                "--jobs",
                "1",
            ]
        )
        == 2
    )
    written = capsys.readouterr()
    assert "odometry.csv, line 2" in written.err.strip().splitlines()[-1]
    assert "summary.json, NAME.estimate.tum" in written.out
    assert [entry["diverged"] for entry in runs(out)] == [True, False]
    assert status_of(["replay", "csv", str(broken), "--out", str(out)]) == 2
    assert f"files in {out}: summary.json\n" in capsys.readouterr().out


def test_what_a_command_does_is_no_command_but_named(capsys):
    for word, command in {"train": "detect train", "new": "scenario new"}.items():
        assert main([word, "x"]) == 2
        assert capsys.readouterr().err.endswith(f"; did you mean `bslam {command}`?\n")
    assert main(["--help-all"]) == 0
    assert "--help-all with every option" in capsys.readouterr().out


def test_a_reader_that_goes_away_leaves_no_traceback():
    words = [sys.executable, "-m", "bslam", "params"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stderr is not None
        program.stdout.close()
        assert program.stderr.read() == ""
    assert program.returncode == 1


def test_the_module_runs_as_a_program():
    done = subprocess.run(
        [sys.executable, "-m", "bslam", "nothing"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "'nothing' does not exist; allowed: run" in done.stderr


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "invariant"),
        (["--observation", "direction"], "smoother"),
        (["--observation", "direction", "--known-map"], "invariant"),
    ],
)
def test_direction_only_has_the_smoother_unless_the_map_is_known(log_folder, tmp_path, words, expected):
    out = tmp_path / "out"
    assert main(["replay", "csv", str(log_folder), "--pictures", "0", "--out", str(out), *words]) == 0
    assert runs(out)[0]["filter"] == expected
