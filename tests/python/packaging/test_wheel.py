"""The package as its users get it: the sdist, the wheel made of it, and commands in an empty environment.

Compiled once and at -O0: what is tried is the way there. What the compiler does at -O3 all other tests try.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
WHEEL_BYTES_MAX = 6_000_000
LONGEST_S = 500.0
NOT_IN_GIT = (".*", "build", "dist", "out", "*.so", "*.egg-info", "__pycache__")


def call(*words: str | Path, cwd: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """A program that knows nothing of this tree, nor of a home: PATH and what is given are its variables."""
    return subprocess.run(
        [str(word) for word in words],
        cwd=cwd,
        env={"PATH": os.defpath, "PYTHONDONTWRITEBYTECODE": "1", **variables},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=LONGEST_S,
    )


def hook(name: str, cwd: Path, out: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """A build as pip calls it: build_sdist or build_wheel."""
    code = f"from setuptools import build_meta; build_meta.{name}({str(out)!r})"
    return call(sys.executable, "-P", "-c", code, cwd=cwd, **variables)


def names_in(wheel: Path) -> list[str]:
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder outside the tree; its path has a space."""
    return tmp_path_factory.mktemp("a user's folder")


@pytest.fixture(scope="module")
def source(here: Path) -> Path:
    """The sdist of a copy of this tree, unpacked."""
    shutil.copytree(ROOT, here / "tree", ignore=shutil.ignore_patterns(*NOT_IN_GIT))
    made = hook("build_sdist", here / "tree", here)
    assert made.returncode == 0, made.stderr
    (archive,) = here.glob("*.tar.gz")
    subprocess.run(["tar", "-xzf", archive, "-C", here], check=True)
    shutil.rmtree(here / "tree")  # what is made of the sdist finds nothing beside it
    return here / archive.name.removesuffix(".tar.gz")


@pytest.fixture(scope="module")
def wheel(here: Path, source: Path) -> Path:
    made = hook("build_wheel", source, here, BSLAM_CFLAGS="-O0")
    assert made.returncode == 0, made.stderr
    (path,) = here.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def programs(here: Path, wheel: Path) -> Path:
    """The folder of programs of an environment that has the wheel, and finds what bslam needs in this one."""
    venv.create(here / "environment")
    python = here / "environment" / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python]
    made = call(*pip, "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=here)
    assert made.returncode == 0, made.stderr
    (site_packages,) = (here / "environment").glob("lib/python*/site-packages")
    # A path in a .pth file is only looked into: the editable install there stays unknown here.
    (site_packages / "needs.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return python.parent


def test_the_sdist_has_the_c_sources_and_no_tests(source: Path) -> None:
    libraries = ("firmware/base", "firmware/bslam", "firmware/vision", "host_sim/bslam/world/camera")
    for folder in libraries:
        files = {path.relative_to(ROOT) for path in (ROOT / folder).rglob("*.[ch]")}
        assert files and all((source / path).is_file() for path in files)
    assert (source / "firmware/models/beacons.h").is_file()
    top = {"LICENSE", "MANIFEST.in", "PKG-INFO", "README.md", "THIRD-PARTY.md", "firmware", "host_sim"}
    assert {path.name for path in source.iterdir()} == top | {"pyproject.toml", "setup.cfg", "setup.py"}


def test_without_a_compiler_the_last_line_says_so(here: Path, source: Path) -> None:
    made = hook("build_wheel", source, here, CC="no-such-compiler")
    assert made.returncode != 0
    last = made.stderr.splitlines()[-1]
    assert last.startswith(
        "error: bslam needs a C compiler, gcc or clang, and 'no-such-compiler' is not here"
    )
    assert not list(here.glob("*.whl"))


def test_the_wheel_is_small_serves_every_python_and_holds_the_package_only(wheel: Path) -> None:
    assert wheel.stat().st_size <= WHEEL_BYTES_MAX
    assert "-cp311-abi3-" in wheel.name
    names = names_in(wheel)
    folders = {name.split("/")[0] for name in names}
    assert "bslam" in folders and all(one.startswith("bslam-") for one in folders - {"bslam"})
    known = {".py", ".typed", ".so", ".toml", ".json", ".npy", ".cpp"}
    assert {Path(name).suffix for name in names if name.startswith("bslam/")} == known
    assert sum(name.endswith(".abi3.so") for name in names) == 8
    data = {Path(name).name for name in names if name.endswith((".npy", ".json"))}
    assert data == {"seeds.npy", "scenario.schema.json"}


def test_an_empty_environment_drives_and_replays(here: Path, programs: Path) -> None:
    before = sorted(path for path in programs.parent.rglob("*"))
    drive = ["run", "paper_room", "--seeds", "0:1", "--record", "--out", "a drive"]
    made = call(programs / "bslam", *drive, cwd=here)
    assert made.returncode == 0, made.stderr
    assert "paper_room_seed0" in made.stdout
    log = "a drive/paper_room_seed0"
    made = call(programs / "bslam", "replay", "csv", log, "--out", "again", cwd=here)
    assert made.returncode == 0, made.stderr
    ours, again = ((here / out / "paper_room_seed0.map.csv").read_text() for out in ("a drive", "again"))
    assert len(ours.splitlines()) > 5 and again == ours
    assert sorted(path for path in programs.parent.rglob("*")) == before  # it may be read-only


def test_every_extension_loads_and_the_ray_caster_only_when_used(here: Path, programs: Path) -> None:
    code = """
import sys
import bslam.cli
from bslam.core import raw
assert sys.prefix in bslam.__file__
assert "bslam.world.camera._render" not in sys.modules
sizes = {raw.library(real, size).beacons_max for real in raw.REALS for size in raw.SIZE_CLASSES}
assert len(sizes) == 3 and len(raw.vision_library().sources) == 64
from bslam.world.camera import raw as ray_caster
assert len(ray_caster.SOURCES) == 64
"""
    made = call(programs / "python", "-c", code, cwd=here)
    assert made.returncode == 0, made.stderr


def test_what_takes_a_clone_says_so_in_a_line(here: Path, programs: Path) -> None:
    made = call(programs / "bslam", "console", "qemu:microbit", cwd=here)
    assert made.returncode == 2
    assert "qemu:BOARD (in a clone of bslam, where `make firmware` builds" in made.stderr.splitlines()[-1]
