"""`bslam run --record`, `bslam replay FILE.mcap` and `bslam export` from outside."""

import json
from pathlib import Path

import pytest

import bslam
from bslam.cli import main
from bslam.log import first_steps
from bslam.recording import load
from bslam.recording.entries import State
from bslam.runs import sources
from bslam.world.simulate import load_scenario, simulate

NAME = "short"
ROOM = Path(bslam.__file__).parent / "scenarios" / "paper_room.toml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / NAME
    first_steps(simulate(load_scenario("paper_room"), 4), 80).write(path)
    return path


@pytest.fixture(scope="module")
def recording(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("mcap")
    assert main(["export", str(folder), "--format", "mcap", "--out", str(out)]) == 0
    return out / f"{NAME}.mcap"


def replay(recording, out, *options):
    status = main(["replay", str(recording), "--pictures", "0", "--out", str(out), *options])
    (entry,) = json.loads((out / "summary.json").read_text())["runs"]
    return status, entry


@pytest.mark.parametrize("target", ["host", "qemu:mps2_an386"])
def test_a_recording_replays_to_the_same_bits_here_and_on_a_board(recording, tmp_path, capsys, target):
    status, entry = replay(recording, tmp_path, "--target", target)
    assert status == 0
    assert "states are the recorded ones to the bit" in capsys.readouterr().out
    assert entry["recording"]["different"] == 0
    assert entry["target"] == target
    assert entry["steps"] == 80
    assert entry["wrong_associations"] == 0
    made = {path.suffix for path in tmp_path.iterdir()}
    assert made - {".bslam"} == {".json", ".tum", ".csv"}  # a host keeps the map as well


def test_with_other_parameters_nothing_is_compared(recording, tmp_path, capsys):
    status, entry = replay(recording, tmp_path, "--set", "gate_d2=9")
    assert status == 0
    assert "to the bit" not in capsys.readouterr().out
    assert entry["parameters"]["gate_d2"] == 9


def test_a_state_that_differs_is_exit_status_1(recording, tmp_path, capsys, monkeypatch):
    whole = load(recording)
    states = [i for i, one in enumerate(whole.entries) if isinstance(one, State)]
    moved = State(**{**vars(whole.entries[states[9]]), "pose": (9.0, 9.0, 0.0)})
    entries = (*whole.entries[: states[9]], moved, *whole.entries[states[9] + 1 :])
    monkeypatch.setattr(sources, "load", lambda path: type(whole)(path, whole.start, entries, True))
    status, _ = replay(recording, tmp_path)
    assert status == 1
    assert f"1 of {len(states)} states differ" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["short"], "or recordings, FILE.mcap"),
        (["csv"], "no DIR"),
        (["nothing.mcap"], "cannot be read"),
        (["RECORDING", "--filter", "standard"], "--filter: a recording runs with its own"),
        (["RECORDING", "--velocity-states"], "--velocity-states: a recording"),
    ],
)
def test_what_cannot_be_replayed_is_bad_input(recording, tmp_path, capsys, words, says):
    words = [str(recording) if word == "RECORDING" else word for word in words]
    assert main(["replay", *words, "--out", str(tmp_path)]) == 2
    assert says in capsys.readouterr().err.splitlines()[-1]


def test_run_records_and_the_recording_tells_of_the_run(tmp_path):
    scenario = tmp_path / "brief.toml"
    scenario.write_text(ROOM.read_text().replace("steps = 5000", "steps = 60"))
    words = ["run", str(scenario), "--record", "--pictures", "0", "--out", str(tmp_path / "out")]
    assert main(words) == 0
    made = tmp_path / "out" / "brief_seed0.mcap"
    status, entry = replay(made, tmp_path / "again")
    assert status == 0
    for end in ("estimate.tum", "truth.tum", "map.csv"):
        name = f"brief_seed0.{end}"
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()
    (first,) = json.loads((tmp_path / "out" / "summary.json").read_text())["runs"]
    for key in ("position_error_m", "nees_mean", "map_rmse_m", "sightings", "counters", "parameters"):
        assert entry.get(key) == first.get(key), key


def test_export_to_tum_and_back_to_a_folder(recording, folder, tmp_path, capsys):
    assert main(["export", str(recording), "--format", "tum", "--out", str(tmp_path)]) == 0
    rows = (tmp_path / f"{NAME}.estimate.tum").read_text().splitlines()
    assert len(rows) == 81 and all(len(row.split()) == 8 for row in rows)
    assert main(["export", str(recording), "--format", "csv", "--out", str(tmp_path)]) == 0
    for name in ("odometry.csv", "sightings.csv", "signatures.npy", "robot.toml", "beacons.csv"):
        assert (tmp_path / NAME / name).read_bytes() == (folder / name).read_bytes(), name
    assert main(["export", str(folder), "--format", "tum", "--out", str(tmp_path)]) == 2
    assert "allowed with --format tum: a recording" in capsys.readouterr().err
    assert main(["export", str(recording), "--format", "mcap", "--out", str(tmp_path)]) == 2
