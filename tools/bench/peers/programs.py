"""The programs under test: what each needs, how it is built, and one run of it over a drive."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
SOURCES = ROOT / "tests/bench/peers"
BUILD = ROOT / "build/bench/peers"
ESTIMATOR = sorted(path for part in ("base", "bslam") for path in (ROOT / "firmware" / part).rglob("*.c"))
"""The library's own files."""
INCLUDE = Path("/usr/include")
OPTIMISED = ["-O2", "-g", "-ffp-contract=off"]  # the same for all
MRPT_PARTS = ("slam", "obs", "bayes", "poses", "math", "rtti", "system", "serialization", "core")


@dataclass(frozen=True)
class Program:
    """One entrant. build: makes the program for a map of so many beacons. words: of its command line.

    by_distance: more words where nobody tells identities; None: it cannot do without.
    """

    name: str
    package: str | None  # Debian's that it needs; None: nothing
    is_here: Callable[[], bool]
    build: Callable[[int], Path]
    words: tuple[str, ...] = ()
    by_distance: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Run:
    """What a run over a drive took: CPU time of a measured step, and what came of it."""

    step_ns: float
    error_m: float
    landmarks: int
    kept_bytes: int


def run(program: Path, words: Sequence[str], drive: str, limit_s: float | None = None) -> Run:
    """One run. Raises SystemExit with what the program said, if it failed; TimeoutExpired after limit_s."""
    done = subprocess.run([program, *words], input=drive, capture_output=True, text=True, timeout=limit_s)
    if done.returncode != 0:
        raise SystemExit(f"bench: {program.name} {' '.join(words)} failed:\n{done.stderr}")
    steps, took_ns, error_m, landmarks, kept_bytes = done.stdout.split()
    return Run(int(took_ns) / int(steps), float(error_m), int(landmarks), int(kept_bytes))


def instructions(program: Path, words: Sequence[str], drive: str, measured: int) -> int:
    """Of a measured step, as callgrind counts them; mapping runs uncounted."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--instr-atstart=no"]
    command += ["--toggle-collect=peer_step", str(program), *words]
    done = subprocess.run(command, input=drive, capture_output=True, text=True)
    collected = re.search(r"Collected\s*:\s*(\d+)", done.stderr)
    if done.returncode != 0 or collected is None:
        raise SystemExit(f"bench: {program.name} {' '.join(words)} under valgrind failed:\n{done.stderr}")
    return int(collected[1]) // measured


def core(beacons: int) -> Path:
    """The core for a map of that many beacons."""
    sources = [SOURCES / "peer_bslam.c", *ESTIMATOR]
    words = [*OPTIMISED, f"-I{ROOT / 'firmware'}", f"-DBSLAM_BEACONS_MAX={beacons}", "-DBSLAM_RAYS_MAX=0"]
    return _compiled(["cc", "-std=c11"], f"bslam_{beacons}", sources, words, ["-lm"])


def eigen(_beacons: int) -> Path:
    """The textbook filter."""
    words = [*OPTIMISED, f"-I{INCLUDE / 'eigen3'}"]
    return _compiled(["c++", "-std=c++17"], "eigen", [SOURCES / "peer_eigen.cpp"], words, [])


def mrpt(_beacons: int) -> Path:
    """MRPT's filter, from Debian's library."""
    folders = [INCLUDE / "eigen3", *sorted((INCLUDE / "mrpt").glob("*/include"))]
    words = [*OPTIMISED, *(f"-I{folder}" for folder in folders)]
    libraries = [f"-lmrpt-{part}" for part in MRPT_PARTS]
    return _compiled(["c++", "-std=c++17"], "mrpt", [SOURCES / "peer_mrpt.cpp"], words, libraries)


def _compiled(
    compiler: list[str], name: str, sources: Sequence[Path], words: Sequence[str], libraries: Sequence[str]
) -> Path:
    """The program; anew only where a source is newer."""
    BUILD.mkdir(parents=True, exist_ok=True)
    frame, program = BUILD / "drive.o", BUILD / name
    shared = [SOURCES / "drive.c", SOURCES / "peer.h"]
    if _is_older(frame, shared):
        command = ["cc", "-std=gnu11", *OPTIMISED, "-c", str(shared[0]), "-o", str(frame)]
        subprocess.run(command, check=True)
    if _is_older(program, [*sources, *(ROOT / "firmware/bslam").rglob("*.h"), frame]):
        command = [*compiler, *words, *map(str, sources), str(frame), *libraries, "-o", str(program)]
        subprocess.run(command, check=True)
    return program


def _is_older(made: Path, sources: Sequence[Path]) -> bool:
    return not made.is_file() or made.stat().st_mtime < max(one.stat().st_mtime for one in sources)


def _has_mrpt() -> bool:
    return (INCLUDE / "mrpt/slam").is_dir() and _has_eigen()


def _has_eigen() -> bool:
    return (INCLUDE / "eigen3").is_dir()


CORE = Program("bslam", None, lambda: True, core, (), ("association=2",))
PEERS = (
    Program("MRPT, Davison", "libmrpt-slam-dev", _has_mrpt, mrpt, ("davison",), ()),
    Program("MRPT, default", "libmrpt-slam-dev", _has_mrpt, mrpt, ("naive",), ()),
    Program("textbook, Eigen float", "libeigen3-dev", _has_eigen, eigen),
)
