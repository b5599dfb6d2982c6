"""docs/C-API.md: its examples compile and run, its lists are those of the headers."""

import os
import re
import subprocess

import pytest

from docs.reading import ESTIMATOR, FIRMWARE, STRICT, block, blocks, column, output_of, read, section

TEXT = read("docs/C-API.md")
HEADERS = {path: path.read_text(encoding="utf-8") for path in FIRMWARE.rglob("*.h")}


def test_example_compiles_and_prints_what_is_said(tmp_path):
    assert output_of(blocks(TEXT, "c")[0], tmp_path) == block(TEXT, "text")


def test_command_that_stands_below_it_names_every_source():
    (patterns,) = re.findall(r"^    cc .* example.c (.*) -lm$", TEXT, re.MULTILINE)
    found = [str(path) for pattern in patterns.split() for path in FIRMWARE.parent.glob(pattern)]
    assert sorted(found) == sorted(ESTIMATOR)


def test_warm_restart_compiles(tmp_path):
    source = '#include "bslam/bslam.h"\n' + blocks(TEXT, "c")[1]
    (tmp_path / "wake.c").write_text(source, encoding="utf-8")
    command = [os.environ.get("CC", "cc"), *STRICT, "-Wno-unused-function", "-c", "wake.c"]
    subprocess.run(command, cwd=tmp_path, check=True)


def test_cxx_sighting_compiles_as_cxx_11(tmp_path):
    source = '#include "bslam/bslam.h"\nbslam_sighting_t door_of();\nbslam_sighting_t door_of()\n{\n'
    (tmp_path / "door.cpp").write_text(source + block(TEXT, "cpp") + "return door;\n}\n", encoding="utf-8")
    flags = ["-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{FIRMWARE}"]
    subprocess.run([os.environ.get("CXX", "g++"), *flags, "-c", "door.cpp"], cwd=tmp_path, check=True)


def test_statuses_are_all_listed():
    names = set(re.findall(r"\b(BSLAM_(?:OK|E_\w+))\b", HEADERS[FIRMWARE / "base" / "status.h"]))
    assert names == column(section(TEXT, "Statuses"))


def test_presets_are_all_listed():
    names = set(re.findall(r"\b(BSLAM_PRESET_\w+)\b", HEADERS[FIRMWARE / "bslam" / "settings.h"]))
    assert names - {"BSLAM_PRESET_COUNT"} == column(section(TEXT, "Settings"))


def test_sizes_are_those_of_the_configuration():
    text = read("firmware/bslam/config.h").split("what follows from these")[0] + read(
        "firmware/base/config.h"
    )
    defaults = dict(re.findall(r"^#define (BSLAM_\w+) (.+)$", text, re.MULTILINE))
    table = section(TEXT, "Sizes")
    assert {name for name in defaults if not name.endswith("_H")} == column(table)
    for name, value in defaults.items():
        if value.isdecimal():
            assert re.search(rf"^\| `{name}` \| {value} \|", table, re.MULTILINE), name


@pytest.mark.parametrize("name", sorted(set(re.findall(r"\b(bslam_\w+|BSLAM_\w+)\b", TEXT))))
def test_names_exist(name):
    assert any(re.search(rf"\b{name}\b", text) for text in HEADERS.values())
