"""`--target` on the command line: the files of a run on a board are those of the host's run."""

import json

import pytest

from bslam.cli import main
from bslam.log import first_steps
from bslam.world.simulate import load_scenario, simulate


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "short"
    first_steps(simulate(load_scenario("paper_room"), 2), 80).write(path)
    return path


def replay(folder, out, *options):
    assert main(["replay", "csv", str(folder), "--pictures", "0", "--out", str(out), *options]) == 0
    (entry,) = json.loads((out / "summary.json").read_text())["runs"]
    files = {path.name: path.read_bytes() for path in out.iterdir() if path.name != "summary.json"}
    return entry, files


@pytest.mark.parametrize("association", ["known", "svm"])
def test_a_replay_on_a_board_writes_what_the_host_writes(folder, tmp_path, association):
    way = ("--association", association)
    here, files_here = replay(folder, tmp_path / "host", *way)
    there, files_there = replay(folder, tmp_path / "board", *way, "--target", "qemu:mps2_an386")
    assert "short.bslam" in files_here
    assert files_here == files_there
    image = there.pop("target_image")
    assert image["image"] == "mps2_an386/robot.elf"
    assert there.pop("target") == "qemu:mps2_an386"
    assert here.pop("target") == "host"
    here.pop("step_us_median")
    assert here == there


@pytest.mark.parametrize("target", ["qemu:nowhere", "qemu:", "fax:1", "qemu"])
def test_a_target_that_does_not_exist_is_bad_input(folder, tmp_path, capsys, target):
    words = ["replay", "csv", str(folder), "--out", str(tmp_path), "--target", target]
    try:
        status = main(words)
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert "allowed: host, qemu:microbit, qemu:mps2_an385" in capsys.readouterr().err.splitlines()[-1]


def test_double_on_a_target_is_bad_input(folder, tmp_path, capsys):
    words = ["replay", "csv", str(folder), "--out", str(tmp_path), "--real", "double"]
    assert main([*words, "--target", "qemu:mps2_an386"]) == 2
    assert "--real double" in capsys.readouterr().err.splitlines()[-1]
