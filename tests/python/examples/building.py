"""What the tests of examples/ share: the library for this computer, programs, and what a README says."""

import math
import os
import re
import subprocess
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES, FIRMWARE = ROOT / "examples", ROOT / "firmware"
STUBS = Path(__file__).parent / "stubs"
STRICT = ("-Wall", "-Wextra", "-Werror")


def run(*words: object, folder: Path, expect: int = 0, said: str = "") -> subprocess.CompletedProcess[str]:
    """A command that is to end with this status; `said` on its standard input."""
    command = [str(word) for word in words]
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    done = subprocess.run(
        command, cwd=folder, env=environment, input=said, capture_output=True, text=True, check=False
    )
    assert done.returncode == expect, f"{command}\n{done.stdout}\n{done.stderr}"
    return done


def build_library(folder: Path, sizes: Iterable[str] = ()) -> Path:
    """The estimator for this computer, with sizes as in "BSLAM_BEACONS_MAX=20"."""
    sources = [path for part in ("base", "bslam") for path in sorted((FIRMWARE / part).rglob("*.c"))]
    defines = [f"-D{size}" for size in sizes]
    run("cc", "-std=c11", "-ffp-contract=off", *defines, f"-I{FIRMWARE}", "-c", *sources, folder=folder)
    run("ar", "rcs", "libbslam.a", *sorted(folder.glob("*.o")), folder=folder)
    return folder / "libbslam.a"


def command_of(example: str, start: str) -> str:
    """The one command in an example's README that begins so."""
    text = (EXAMPLES / example / "README.md").read_text(encoding="utf-8").replace("\\\n", " ")
    (found,) = re.findall(rf"^    ({re.escape(start)}.*)$", text, re.MULTILINE)
    return found


def build_as_its_readme_says(example: str, library: Path, folder: Path) -> Path:
    """A desktop program by its README's command, but with the library that is built already."""
    command = command_of(example, "cc ")
    sources = re.search(r"\$\(find [^)]*\)", command)
    assert sources is not None
    listed = run("sh", "-c", f"printf '%s\\n' {sources[0]}", folder=EXAMPLES / example).stdout.split()
    parts = (FIRMWARE / "base", FIRMWARE / "bslam")
    assert {(EXAMPLES / example / path).resolve() for path in listed} == {
        path for part in parts for path in part.rglob("*.c")
    }
    program = folder / example
    words = command.replace(sources[0], str(library)).replace(f"-o {example}", f"-o {program}").split()
    run(*words, *STRICT, folder=EXAMPLES / example)
    return program


def drive_end(seconds: float) -> tuple[float, float, float]:
    """Where the drive of stubs/drive.h is then."""
    turned_rad = 0.3 / 0.8 * seconds
    return 0.8 * math.sin(turned_rad), 0.8 * (1 - math.cos(turned_rad)), turned_rad
