"""The robot on FreeRTOS: built and run where the kernel's sources are at hand, FREERTOS_KERNEL=PATH."""

import os
import subprocess

import pytest

from bslam.cli import main
from bslam.rig import load_rig
from bslam.target.lines import ROOT
from tools.proofs.make_film import make_film, smaller

KERNEL = os.environ.get("FREERTOS_KERNEL", "")


def make_rtos(*words):
    command = ["make", "--no-print-directory", "rtos", *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["FREERTOS_KERNEL="], "git clone"),
        (["FREERTOS_KERNEL=/nowhere"], "'/nowhere' is no FreeRTOS kernel"),
    ],
)
def test_without_the_kernel_it_says_where_to_get_it(words, says):
    done = make_rtos(*words)
    assert done.returncode == 2
    assert says in done.stderr


@pytest.mark.skipif(
    not KERNEL,
    reason="no FreeRTOS kernel, and no package has one: git clone --branch V11.2.0 --depth 1"
    " https://github.com/FreeRTOS/FreeRTOS-Kernel ../FreeRTOS-Kernel, then"
    " FREERTOS_KERNEL=../FreeRTOS-Kernel make test",
)
def test_on_freertos_the_robot_drives_sees_and_replays_to_the_same_bits(tmp_path, capsys):
    built = make_rtos(f"FREERTOS_KERNEL={KERNEL}")
    assert built.returncode == 0, built.stderr
    make_film(tmp_path / "turn", "paper_room", 0, smaller(load_rig("three60").cameras[1], 2), 4, 24)
    path = tmp_path / "drive.mcap"
    target = f"qemu:mps2_an386/robot_rtos:{tmp_path}/turn"
    assert main(["console", target, "--reset", "--record", str(path), "--seconds", "3"]) == 0
    said = capsys.readouterr().out
    assert "refused" not in said and "frames" in said
    assert main(["replay", str(path), "--pictures", "0", "--out", str(tmp_path / "out")]) == 0
    assert "states are the recorded ones to the bit" in capsys.readouterr().out
