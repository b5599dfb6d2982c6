"""The images in QEMU: the same bits as here on every core, the same instructions at every run."""

import re
import shutil
import subprocess

import pytest

from bslam.errors import BslamError
from bslam.log import first_steps
from bslam.options import RunOptions
from bslam.runs.runner import run_log
from bslam.target.lines import ROOT, TargetError, boards_here, emulator_of, qemu_machines
from bslam.world.simulate import load_scenario, simulate
from tools.proofs import run_image, same_bits

STEPS = 120


@pytest.fixture(scope="module")
def log():
    return first_steps(simulate(load_scenario("paper_room"), 5), STEPS)


@pytest.fixture(scope="module")
def host(log):
    """What the cores are compared with, of each way to run; more of them in tools/proofs/same_bits.py."""
    return {words: same_bits.fingerprints(log, RunOptions(**dict(words))) for words in WAYS}


SMALL = ("stm32f405", "stm32f405_seeing", "stm32f405_scanning", "microbit")
BOARDS = [
    pytest.param(
        board,
        marks=pytest.mark.skipif(
            board not in boards_here(), reason=f"not shown here: no image or no {emulator_of(board)}"
        ),
    )
    for board in sorted(qemu_machines())
]
DIRECTION = (("association", "known"), ("observation", "direction"))
WAYS = ((("association", "svm"),), (*DIRECTION, ("filter", "smoother")), DIRECTION)


@pytest.mark.parametrize("board", BOARDS)
def test_every_state_is_that_of_the_host(log, host, board):
    ways = WAYS[2:] if board in SMALL else WAYS  # for the others they have no room
    for words in ways:
        there = same_bits.fingerprints(log, RunOptions(**dict(words), target=f"qemu:{board}"))
        assert len(there) == len(host[words]) > STEPS
        assert same_bits.first_difference(host[words], there) is None
        assert len(set(there)) == len(there)


@pytest.mark.parametrize("board", BOARDS)
def test_the_self_test_passes_on_the_board(board):
    ended = run_image.run_image(board, "selftest")
    assert ended.status == 0, ended.output
    lines = ended.output.strip().splitlines()
    assert lines[0] == "TAP version 14"
    assert lines[1] == f"1..{len(lines) - 2}"
    assert all(line.startswith(f"ok {number} - ") for number, line in enumerate(lines[2:], start=1))


def test_a_board_that_is_too_small_is_refused(log):
    with pytest.raises(BslamError, match="room for 80 beacons, the image has 20"):
        run_log(log, RunOptions(association="mahalanobis", target="qemu:stm32f405"))


def test_a_board_without_a_smoother_says_so(log):
    with pytest.raises(TargetError, match="filter = 2: the image is built with BSLAM_SMOOTHER=0"):
        run_log(log, RunOptions(filter="smoother", target="qemu:stm32f405"))


def test_a_run_names_its_image_and_counts_the_same_instructions_twice(log):
    short = first_steps(log, 40)
    runs = [run_log(short, RunOptions(target="qemu:mps2_an386")) for _ in range(2)]
    one, other = (run.target for run in runs)
    # The timer's own interrupt may fall into a step or between two.
    assert one.pop("instructions") == pytest.approx(other.pop("instructions"), rel=2e-4)
    assert one == other
    assert one["image"] == "mps2_an386/robot.elf"
    assert len(one["image_sha256"]) == 64
    assert len(one["build_id"]) == 40


def test_an_image_that_does_not_fit_is_refused_by_the_linker(tmp_path):
    """The STM32F405's objects, and a stack as large as its RAM."""
    build = ROOT / "build" / "stm32f405"
    sources = [path.relative_to(build).with_suffix(".c") for path in build.rglob("*.o")]
    there = [source for source in sources if (ROOT / source).is_file() and source.stem != "selftest"]
    robot = [str(build / source.with_suffix(".o")) for source in there]
    core = ["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
    script = ["-T", "firmware/port/stm32f405/memory.ld", "-Wl,--defsym=STACK=0x20000"]
    command = ["arm-none-eabi-gcc", *core, "-nostartfiles", "--specs=nano.specs", *script, *robot, "-lm"]
    done = subprocess.run(
        [*command, "-o", str(tmp_path / "x.elf")], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert re.search(r"region `RAM' overflowed by \d+ bytes", done.stderr), done.stderr


def test_without_its_tools_risc_v_says_what_to_install(tmp_path):
    """PATH has all that make needs and no compiler for RISC-V."""
    for tool in ("sh", "bash", "make", "sed", "awk", "cc", "pkg-config", "mkdir", "cat"):
        found = shutil.which(tool)
        if found:
            (tmp_path / tool).symlink_to(found)
    for target in ("rv32", "riscv_virt"):
        command = ["make", "--no-print-directory", "firmware", f"TARGET={target}"]
        environment = {"PATH": str(tmp_path), "HOME": str(tmp_path)}
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, env=environment)
        assert done.returncode == 2
        assert "apt-get install gcc-riscv64-unknown-elf" in done.stderr


def test_only_boards_of_other_cores_may_be_missing(monkeypatch):
    """A missing qemu-system-arm skips nothing: its boards stay in the list, and their tests fail."""
    monkeypatch.setenv("PATH", "/nowhere")
    assert boards_here() == [one for one in sorted(qemu_machines()) if emulator_of(one) == "qemu-system-arm"]
