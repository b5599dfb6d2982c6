"""`make help` lists what scripts and people rely on."""

import os
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[3]
PROMISED = ["setup", "run", "test", "lint", "format", "firmware", "sizes", "unit", "pytest", "proof", "bench",
            "tables", "clean"]  # fmt: skip


def make(*arguments: str) -> subprocess.CompletedProcess[str]:
    """A make of its own, although `make test` may be running this."""
    environment = {
        name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL")
    }
    command = ["make", *arguments]
    return subprocess.run(
        command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def listed() -> set[str]:
    return {line.split()[1] for line in make("help").stdout.splitlines()}


@pytest.mark.parametrize("target", PROMISED)
def test_help_promised_target_is_listed(listed: set[str], target: str) -> None:
    assert target in listed


def test_run_says_beforehand_what_may_fail() -> None:
    lines = make("--dry-run", "run").stdout.splitlines()
    said = next(number for number, line in enumerate(lines) if "five things" in line)
    assert "FAILED by map" in lines[said + 1] and "detect run" in lines[said + 2]


def test_firmware_unknown_target_names_the_allowed_ones() -> None:
    result = make("firmware", "TARGET=avr")
    assert result.returncode == 2
    assert "TARGET is avr; allowed: m0plus m33 m4f m4f_whole m55 m7 rv32" in result.stderr


def test_package_forgets_what_was_built_before() -> None:
    *_, forget, build, _ = make("--dry-run", "package").stdout.splitlines()
    assert forget.startswith("rm -rf build/lib* build/bdist*") and "bdist_wheel" in build


def test_sizes_are_of_the_beacons_asked_for_also_before_setup() -> None:
    result = make("sizes", "BEACONS=1 12", "VENV=nowhere")
    assert result.returncode == 0, result.stderr
    rows = [line.split()[0] for line in result.stdout.splitlines() if line[:1] == " "]
    assert rows == 4 * ["beacons", "1", "12"]


@pytest.mark.parametrize("target", ["firmware", "examples", "packages", "amalgamation"])
def test_what_needs_no_python_package_is_built_before_setup(target: str) -> None:
    result = make("--dry-run", "--always-make", target, "VENV=nowhere")
    assert result.returncode == 0 and "python3 -m tools." in result.stdout
    assert "nowhere" not in result.stdout
