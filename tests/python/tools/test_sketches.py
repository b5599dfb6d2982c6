"""How users build: their compiler, language, sizes and flags against the library's."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
FIRMWARE = ROOT / "firmware"
SKETCHES = ROOT / "tests" / "sketches"
CXX = ("g++", "clang++-19")
PUBLIC_HEADERS = ("bslam/bslam.h", "link/crc16.h", "link/frame.h", "link/parser.h", "vision/vision.h")
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
CC = ("cc", "-std=c11", "-ffp-contract=off", f"-I{FIRMWARE}")


def run(*command: object, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(word) for word in command], cwd=folder, capture_output=True, text=True, check=False
    )


def sources_of(library: str) -> list[Path]:
    return sorted(path for folder in ("base", library) for path in (FIRMWARE / folder).rglob("*.c"))


def build(library: str, folder: Path, *flags: str) -> Path:
    """A flat archive of a library's objects."""
    sources = sources_of(library)
    compiled = run(*CC, *flags, "-c", *sources, folder=folder)
    assert compiled.returncode == 0, compiled.stderr
    objects = sorted(folder.glob("*.o"))
    assert len(objects) == len(sources)  # else two have one name
    archive = folder / f"lib{library}.a"
    assert run("ar", "rcs", archive, *objects, folder=folder).returncode == 0
    return archive


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The estimator with the sizes that it has by itself."""
    return build("bslam", tmp_path_factory.mktemp("library"))


@pytest.fixture(scope="module")
def vision(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The vision library."""
    return build("vision", tmp_path_factory.mktemp("vision"))


# ---- languages ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("compiler", CXX)
@pytest.mark.parametrize("standard", [11, 14, 17, 20])
def test_public_headers_are_cxx(tmp_path: Path, compiler: str, standard: int) -> None:
    units = []
    for header in PUBLIC_HEADERS:
        units.append(tmp_path / f"{header.replace('/', '_')}.cpp")
        units[-1].write_text(f'#include "{header}"\n', encoding="utf-8")
    command = (compiler, f"-std=c++{standard}", *WARNINGS, f"-I{FIRMWARE}", "-fsyntax-only", *units)
    done = run(*command, folder=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("compiler", ["cc", "clang-19"])
def test_public_headers_are_plain_c11(tmp_path: Path, compiler: str) -> None:
    text = "".join(f'#include "{header}"\n' for header in (*PUBLIC_HEADERS, *PUBLIC_HEADERS))
    unit = tmp_path / "unit.c"
    unit.write_text(text, encoding="utf-8")
    done = run(compiler, "-std=c11", *WARNINGS, f"-I{FIRMWARE}", "-fsyntax-only", unit, folder=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("compiler", CXX)
def test_sketch_in_cxx_links_with_the_library_and_runs(tmp_path: Path, library: Path, compiler: str) -> None:
    flags = ("-std=c++11", *WARNINGS, f"-I{FIRMWARE}")
    linked = run(
        compiler, *flags, SKETCHES / "estimator.cpp", library, "-lm", "-o", "sketch", folder=tmp_path
    )
    assert linked.returncode == 0, linked.stderr
    ran = run("./sketch", folder=tmp_path)
    assert ran.returncode == 0, ran.stdout
    assert ran.stdout.startswith("driven 2.00 m, estimated 2.0")


@pytest.mark.parametrize("compiler", CXX)
def test_vision_sketch_in_cxx_sees_the_cabinet(tmp_path: Path, vision: Path, compiler: str) -> None:
    flags = ("-std=c++11", *WARNINGS, f"-I{FIRMWARE}")
    linked = run(
        compiler, *flags, SKETCHES / "vision_sketch.cpp", vision, "-lm", "-o", "sketch", folder=tmp_path
    )
    assert linked.returncode == 0, linked.stderr
    ran = run("./sketch", folder=tmp_path)
    assert ran.returncode == 0, ran.stdout
    assert "cabinet at 4.9" in ran.stdout


def test_vision_sketch_in_c_tells_the_turn(tmp_path: Path, vision: Path) -> None:
    linked = link(tmp_path, "vision_sketch.c", vision, *WARNINGS)
    assert linked.returncode == 0, linked.stderr
    ran = run("./sketch", folder=tmp_path)
    assert ran.returncode == 0, ran.stdout


# ---- sizes -------------------------------------------------------------------------------------------------


def link(folder: Path, sketch: str, library: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    return run(*CC, "-O1", *flags, SKETCHES / sketch, library, "-lm", "-o", "sketch", folder=folder)


OTHER_SIZES = [
    "-DBSLAM_BEACONS_MAX=6",
    "-DBSLAM_BEACONS_MAX=50",
    "-DBSLAM_RAYS_MAX=0",
    "-DBSLAM_HISTORY_MAX=15",
    "-DBSLAM_SIGHTINGS_MAX=17",
    "-DBSLAM_RECOVERY=0",
    "-DBSLAM_GUARD=0",
    "-DBSLAM_GUARD=2",
    "-DBSLAM_APPEARANCE=1",
    "-DBSLAM_SMOOTHER=1",
]


@pytest.mark.parametrize("flag", OTHER_SIZES)
def test_application_of_other_sizes_is_refused(tmp_path: Path, library: Path, flag: str) -> None:
    linked = link(tmp_path, "other_sizes.c", library, flag)
    assert linked.returncode == 0, linked.stderr
    ran = run("./sketch", folder=tmp_path)
    assert ran.returncode == 0, ran.stdout
    assert "BSLAM_E_SIZE, 0 bytes" in ran.stdout


OTHER_VISION_SIZES = [
    "-DBSLAM_IMAGE_WIDTH_MAX=160",
    "-DBSLAM_IMAGE_HEIGHT_MAX=480",
    "-DBSLAM_CAMERAS_MAX=1",
    "-DBSLAM_PROPOSALS_MAX=64",
    "-DBSLAM_CANDIDATES_MAX=8",
    "-DBSLAM_VISION_TURNS=0",
]


@pytest.mark.parametrize("flag", OTHER_VISION_SIZES)
def test_application_of_other_vision_sizes_is_refused(tmp_path: Path, vision: Path, flag: str) -> None:
    linked = link(tmp_path, "vision_other_sizes.c", vision, flag)
    assert linked.returncode == 0, linked.stderr
    ran = run("./sketch", folder=tmp_path)
    assert ran.returncode == 0, ran.stdout
    assert "BSLAM_E_SIZE, BSLAM_E_SIZE, 0 bytes" in ran.stdout


def test_application_of_the_same_sizes_is_not_refused(tmp_path: Path, library: Path) -> None:
    assert link(tmp_path, "other_sizes.c", library, "-DBSLAM_BEACONS_MAX=20").returncode == 0
    assert run("./sketch", folder=tmp_path).stdout.startswith("BSLAM_OK")


def test_application_of_the_other_scalar_type_does_not_link(tmp_path: Path, library: Path) -> None:
    linked = link(tmp_path, "other_sizes.c", library, "-DBSLAM_REAL_DOUBLE=1")
    assert linked.returncode != 0
    assert "undefined reference to `bslam_init_double'" in linked.stderr
    source = FIRMWARE / "bslam/bslam.c"
    assert run(*CC, "-DBSLAM_REAL_DOUBLE=1", "-c", source, folder=tmp_path).returncode == 0
    linked = link(tmp_path, "other_sizes.c", tmp_path / "bslam.o")
    assert "undefined reference to `bslam_init_sized'" in linked.stderr


def test_application_of_the_other_scalar_type_does_not_link_with_vision(tmp_path: Path, vision: Path) -> None:
    linked = link(tmp_path, "vision_other_sizes.c", vision, "-DBSLAM_REAL_DOUBLE=1")
    assert linked.returncode != 0
    for name in ("bslam_vision_init_double", "bslam_visual_gyro_init_double"):
        assert f"undefined reference to `{name}'" in linked.stderr


# ---- flags -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", ["-O0", "-O3"])
def test_no_number_is_taken_that_is_none(tmp_path: Path, library: Path, level: str) -> None:
    assert link(tmp_path, "not_a_number.c", library, level).returncode == 0
    ran = run("./sketch", folder=tmp_path)
    assert ran.returncode == 0, ran.stdout


@pytest.mark.parametrize("flag", ["-ffast-math", "-ffinite-math-only", "-Ofast"])
@pytest.mark.parametrize("source", ["bslam/bslam.c", "vision/vision.c"])
def test_flag_that_assumes_away_nan_stops_with_the_reason(tmp_path: Path, flag: str, source: str) -> None:
    stopped = run(*CC, flag, "-fsyntax-only", FIRMWARE / source, folder=tmp_path)
    assert stopped.returncode != 0
    assert "#error" in stopped.stderr and "do without them" in stopped.stderr


@pytest.mark.parametrize("source", ["bslam/bslam.c", "vision/vision.c"])
def test_int_of_16_bits_stops_with_the_reason(tmp_path: Path, source: str) -> None:
    (tmp_path / "limits.h").write_text("#define INT_MAX 32767\n", encoding="utf-8")
    stopped = run(*CC, f"-I{tmp_path}", "-fsyntax-only", FIRMWARE / source, folder=tmp_path)
    assert stopped.returncode != 0
    assert "needs an int of 32 bits" in stopped.stderr


@pytest.mark.parametrize("name", ["bslam", "vision", "link"])
def test_flat_archive_of_a_library_links_by_itself(
    tmp_path: Path, library: Path, vision: Path, name: str
) -> None:
    archive = {"bslam": library, "vision": vision}.get(name) or build(name, tmp_path)
    (tmp_path / "main.c").write_text("int main(void) { return 0; }\n", encoding="utf-8")
    whole = ("-Wl,--whole-archive", archive, "-Wl,--no-whole-archive")
    linked = run("cc", "main.c", *whole, "-lm", folder=tmp_path)
    assert linked.returncode == 0, linked.stderr


# ---- what an instance takes --------------------------------------------------------------------------------

BSLAM_SIZES = [
    "",
    "-DBSLAM_BEACONS_MAX=1 -DBSLAM_RECOVERY=0 -DBSLAM_GUARD=0",
    "-DBSLAM_BEACONS_MAX=6 -DBSLAM_SIGHTINGS_MAX=1 -DBSLAM_HISTORY_MAX=1",
    "-DBSLAM_BEACONS_MAX=6 -DBSLAM_RAYS_MAX=0 -DBSLAM_GUARD=2",
    "-DBSLAM_BEACONS_MAX=50 -DBSLAM_GUARD=2 -DBSLAM_APPEARANCE=1",
    "-DBSLAM_BEACONS_MAX=20 -DBSLAM_APPEARANCE=1 -DBSLAM_SAMPLES_PER_CLASSIFIER=7",
    "-DBSLAM_BEACONS_MAX=6 -DBSLAM_APPEARANCE=1 -DBSLAM_SAMPLES_PER_CLASSIFIER=2",
    "-DBSLAM_BEACONS_MAX=20 -DBSLAM_SMOOTHER=1",
    "-DBSLAM_BEACONS_MAX=7 -DBSLAM_SMOOTHER=1 -DBSLAM_SMOOTHER_NODES_MAX=41",
    "-DBSLAM_BEACONS_MAX=80 -DBSLAM_RAYS_MAX=80 -DBSLAM_SIGHTINGS_MAX=96 -DBSLAM_HISTORY_MAX=128 "
    "-DBSLAM_GUARD=2 -DBSLAM_APPEARANCE=1 -DBSLAM_SMOOTHER=1",
    "-DBSLAM_BEACONS_MAX=250 -DBSLAM_SIGHTINGS_MAX=250",
]
VISION_SIZES = [
    "",
    "-DBSLAM_CAMERAS_MAX=1",
    "-DBSLAM_CAMERAS_MAX=1 -DBSLAM_IMAGE_WIDTH_MAX=160 -DBSLAM_IMAGE_HEIGHT_MAX=120 -DBSLAM_VISION_TURNS=0",
    "-DBSLAM_IMAGE_WIDTH_MAX=640 -DBSLAM_IMAGE_HEIGHT_MAX=480 -DBSLAM_PROPOSALS_MAX=240",
    "-DBSLAM_CANDIDATES_MAX=64 -DBSLAM_PROPOSALS_MAX=8",
    "-DBSLAM_CAMERAS_MAX=1 -DBSLAM_VISION_BUILT_IN=0",
]
PROBE = """#include "{0}/instance.h"
_Static_assert(sizeof({1}_instance_t) <= sizeof({1}_t), "an instance fits");
_Static_assert(sizeof({1}_t) - sizeof({1}_instance_t) <= sizeof({1}_t) / 50, "and wastes 2 % at most");
"""


@pytest.mark.parametrize("compiler", ["cc", "arm-none-eabi-gcc -mcpu=cortex-m4"])
@pytest.mark.parametrize("real", ["-DBSLAM_REAL_DOUBLE=0", "-DBSLAM_REAL_DOUBLE=1"])
@pytest.mark.parametrize(
    ("folder", "name", "matrix"),
    [("bslam", "bslam", BSLAM_SIZES), ("vision", "bslam_vision", VISION_SIZES)],
)
def test_instance_is_hardly_larger_than_what_stands_in_it(
    tmp_path: Path, compiler: str, real: str, folder: str, name: str, matrix: list[str]
) -> None:
    (tmp_path / "probe.c").write_text(PROBE.format(folder, name), encoding="utf-8")
    for sizes in matrix:
        flags = (*compiler.split(), "-std=c11", f"-I{FIRMWARE}", real, *sizes.split())
        done = run(*flags, "-fsyntax-only", "probe.c", folder=tmp_path)
        assert done.returncode == 0, f"{sizes}: {done.stderr}"


# ---- what users include -----------------------------------------------------------------------------------

PUBLIC = ("bslam/bslam.h", "vision/vision.h")


def included(path: Path) -> set[str]:
    """Headers of the libraries that a text includes, or names in quotes as one that a compiler reads."""
    text = path.read_text(encoding="utf-8")
    names = re.findall(r'["<]((?:base|bslam|vision)/[\w/]+\.h)[">]', text)
    return {f"{path.name}: {name}" for name in names if name not in PUBLIC}


@pytest.mark.parametrize(
    ("folder", "pattern"),
    [
        (ROOT, "README.md"),
        (ROOT / "docs", "*.md"),
        (SKETCHES, "*.c*"),
        (ROOT / "tests/bench", "link_core.c"),
        (ROOT / "host_sim", "**/*.py"),
    ],
)
def test_users_examples_and_bindings_include_public_headers_only(folder: Path, pattern: str) -> None:
    files = sorted(folder.glob(pattern))
    assert files
    assert set().union(*map(included, files)) == set()
