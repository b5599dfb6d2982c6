"""tools/setup.sh on machines that lack something: what it says first, what it would run, how it ends.

Such a machine is made of a PATH that holds a few programs only. The script ends before it touches the tree.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "tools/setup.sh"


def add_program(machine: Path, name: str, script: str) -> None:
    program = machine / name
    program.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    program.chmod(0o755)


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """A folder of programs: a shell, this Python, and neither compiler nor apt-get."""
    for name in ("cat", "dirname", "head", "sh"):
        (tmp_path / name).symlink_to(str(shutil.which(name)))
    (tmp_path / "python3").symlink_to(os.path.realpath(sys.executable))
    add_program(tmp_path, "id", "echo 0")
    return tmp_path


def setup(machine: Path, part: str = "test", **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {"PATH": str(machine), "HOME": str(machine), **variables}
    return subprocess.run(
        [str(SCRIPT), part],
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


def test_setup_no_install_prints_the_command_and_exits_2(machine: Path) -> None:
    result = setup(machine, NO_INSTALL="1")
    first, command = result.stderr.splitlines()
    assert result.returncode == 2
    assert first.startswith("setup: missing: gcc for the C compiler")
    assert command == (
        "setup: install with: apt-get install -y --no-install-recommends"
        " gcc libc6-dev pkg-config libcmocka-dev gcc-arm-none-eabi libnewlib-arm-none-eabi"
        " cmake qemu-system-arm chromium-headless-shell valgrind g++ clang-19 lld-19"
    )


def test_setup_run_asks_for_the_compiler_only(machine: Path) -> None:
    result = setup(machine, "run", NO_INSTALL="1")
    assert result.returncode == 2
    assert result.stderr.endswith("--no-install-recommends gcc libc6-dev\n")


def test_setup_without_python_says_so_first(machine: Path) -> None:
    (machine / "python3").unlink()
    result = setup(machine, NO_INSTALL="1")
    assert result.returncode == 2
    assert result.stderr.startswith("setup: missing: python3")
    assert "apt-get install -y --no-install-recommends python3 python3-venv python3-dev gcc" in result.stderr


def test_setup_old_python_is_named_first(machine: Path) -> None:
    (machine / "python3").unlink()
    add_program(machine, "python3", 'case $1 in --version) echo "Python 3.9.2" ;; *) exit 1 ;; esac')
    result = setup(machine)
    assert result.returncode == 2
    assert result.stderr.startswith("setup: no Python 3.11 or newer on PATH (python3 is Python 3.9.2)")


def test_setup_without_apt_get_prints_the_command(machine: Path) -> None:
    result = setup(machine, "run")
    assert result.returncode == 2
    assert "(no apt-get here)" in result.stderr.splitlines()[0]
    assert "apt-get install -y --no-install-recommends gcc libc6-dev" in result.stderr


def test_setup_neither_root_nor_sudo_prints_the_command_with_sudo(machine: Path) -> None:
    add_program(machine, "id", "echo 1000")
    add_program(machine, "apt-get", "exit 0")
    result = setup(machine, "run")
    assert result.returncode == 2
    assert "install with: sudo apt-get install -y --no-install-recommends gcc libc6-dev" in result.stderr


def test_setup_apt_get_that_fails_is_reported_with_its_output(machine: Path) -> None:
    add_program(machine, "apt-get", 'echo "$DEBIAN_FRONTEND: apt-get $*"; exit 100')
    result = setup(machine, "run")
    assert result.returncode == 2
    assert result.stdout.splitlines() == [
        "setup: installing with apt-get, which may take minutes: gcc for the C compiler, libc6-dev for the C"
        " headers"
    ]
    assert result.stderr.startswith("setup: apt-get could not install: gcc libc6-dev")
    assert "noninteractive: apt-get -qq update" in result.stderr
    assert "noninteractive: apt-get install -y --no-install-recommends -qq gcc libc6-dev" in result.stderr


def test_setup_unknown_part_names_the_allowed_ones(machine: Path) -> None:
    result = setup(machine, "everything")
    assert result.returncode == 2
    assert result.stderr == "setup: unknown part 'everything'; allowed: run, test, bench, proof\n"
