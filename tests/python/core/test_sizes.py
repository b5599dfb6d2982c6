"""The library in sizes that nobody would choose: built and driven at its limits, under the sanitizers."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
UNIT = ROOT / "tests" / "unit"
SOURCES = [
    UNIT / "bslam" / "slam" / "test_slam_limits.c",
    UNIT / "support.c",
    UNIT / "plain_settings.c",
    *(path for name in ("base", "bslam") for path in sorted((ROOT / "firmware" / name).rglob("*.c"))),
]
FLAGS = ["-std=c11", "-ffp-contract=off", "-O0", "-Wall", "-Wextra", "-Werror", "-Wno-unused-parameter"]
ALL = {"BSLAM_APPEARANCE": 1, "BSLAM_SMOOTHER": 1, "BSLAM_GUARD": 2}
SANITIZE = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def compiled(program: Path, **sizes: int) -> subprocess.CompletedProcess[str]:
    """The test program with these sizes."""
    defines = [f"-D{name}={value}" for name, value in (ALL | sizes).items()]
    includes = [f"-I{ROOT / 'firmware'}", f"-I{UNIT}"]
    command = [os.environ.get("CC", "cc"), *FLAGS, *SANITIZE, *defines, *includes, *map(str, SOURCES)]
    command += ["-lcmocka", "-lm", "-o", str(program)]
    return subprocess.run(command, check=False, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("beacons", "rays", "sightings", "history", "real_double", "steps"),
    [
        (1, 0, 1, 1, 0, 300),
        (1, 1, 1, 2, 1, 300),
        (2, 1, 3, 1, 0, 300),
        (3, 0, 250, 16, 0, 100),
        (250, 250, 40, 1024, 0, 6),
    ],
)
def test_limits_hold_in_any_size(
    tmp_path: Path, beacons: int, rays: int, sightings: int, history: int, real_double: int, steps: int
) -> None:
    program = tmp_path / "limits"
    built = compiled(
        program,
        BSLAM_BEACONS_MAX=beacons,
        BSLAM_RAYS_MAX=rays,
        BSLAM_SIGHTINGS_MAX=sightings,
        BSLAM_HISTORY_MAX=history,
        BSLAM_REAL_DOUBLE=real_double,
        UNIT_LIMITS_STEPS=steps,
    )
    assert built.returncode == 0, built.stderr
    result = subprocess.run([program], check=False, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("BSLAM_BEACONS_MAX", 0),
        ("BSLAM_BEACONS_MAX", 251),
        ("BSLAM_RAYS_MAX", 21),
        ("BSLAM_RAYS_MAX", -1),
        ("BSLAM_SIGHTINGS_MAX", 0),
        ("BSLAM_SIGHTINGS_MAX", 251),
        ("BSLAM_HISTORY_MAX", 0),
        ("BSLAM_HISTORY_MAX", 1025),
        ("BSLAM_RECOVERY", 2),
        ("BSLAM_GUARD", 3),
        ("BSLAM_APPEARANCE", 2),
        ("BSLAM_SAMPLES_PER_CLASSIFIER", 1),
        ("BSLAM_SAMPLES_PER_CLASSIFIER", 65),
        ("BSLAM_SMOOTHER", 2),
        ("BSLAM_SMOOTHER_NODES_MAX", 7),
        ("BSLAM_SMOOTHER_NODES_MAX", 10001),
        ("BSLAM_SETTING_MEANINGS", 2),
        ("BSLAM_REAL_DOUBLE", 2),
    ],
)
def test_size_out_of_range_does_not_compile_and_says_what_is_allowed(name: str, value: int) -> None:
    header = ROOT / "firmware" / "bslam" / "bslam.h"
    command = [os.environ.get("CC", "cc"), "-fsyntax-only", f"-I{ROOT / 'firmware'}", f"-D{name}={value}"]
    result = subprocess.run([*command, str(header)], check=False, capture_output=True, text=True)
    assert result.returncode != 0
    assert f'"{name} is ' in result.stderr
