"""What the READMEs of examples/ say is so: figures, lines, links, the table of all."""

import re
from pathlib import Path

import pytest

from examples.building import EXAMPLES, ROOT

CODE = {".c", ".h", ".ino", ".py"}  # build files, linker scripts and start-up code are none
NAMES = sorted(path.parent.name for path in EXAMPLES.glob("*/README.md"))
LINES_MAX = dict.fromkeys(NAMES, 119) | {"ros2_node": 150}
ON_BOARDS = [name for name in NAMES if name != "ros2_node"]  # a node of Python has no flash
TOLERANCE = 0.05


def code_files(example: str) -> list[Path]:
    found = (EXAMPLES / example).rglob("*")
    return [path for path in found if path.suffix in CODE and "build" not in path.relative_to(EXAMPLES).parts]


def figures_of(text: str) -> tuple[int, int]:
    """Flash and RAM, bytes."""
    (pair,) = re.findall(r"[Ff]lash ([\d,]+) bytes, RAM ([\d,]+) bytes", text)
    flash, ram = (int(one.replace(",", "")) for one in pair)
    return flash, ram


def table() -> dict[str, tuple[int, int]]:
    """Of examples/README.md."""
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \[(\w+)\]\((\w+)\) \|.*\| (\S+) \| (\S+) \| [^|]+ \|$", text, re.MULTILINE)
    assert all(name == folder for name, folder, *_ in rows)
    assert sorted(name for name, *_ in rows) == NAMES
    assert [row[2:] for row in rows if row[0] not in ON_BOARDS] == [("-", "-")]
    return {
        name: (int(flash.replace(",", "")), int(ram.replace(",", "")))
        for name, _, flash, ram in rows
        if name in ON_BOARDS
    }


def test_the_table_lists_every_example_with_the_figures_of_its_readme() -> None:
    assert len(NAMES) == 8
    texts = {name: (EXAMPLES / name / "README.md").read_text(encoding="utf-8") for name in ON_BOARDS}
    assert table() == {name: figures_of(text) for name, text in texts.items()}


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short(name: str) -> None:
    lines = [
        line
        for path in code_files(name)
        for line in path.read_text(encoding="utf-8").splitlines()
        if line.strip() and not line.lstrip().startswith(("//", "#!", "# "))
    ]
    assert 0 < len(lines) <= LINES_MAX[name]


def test_figures_are_those_that_make_prints(sizes: dict[str, tuple[int, int]]) -> None:
    assert set(sizes) == set(ON_BOARDS) - {"live_robot"}  # tests/python/target looks at that one
    for name, measured in sizes.items():
        assert table()[name] == pytest.approx(measured, rel=TOLERANCE), name


def test_what_a_step_takes_without_a_floating_point_unit_is_as_sizes_has_it() -> None:
    sizes = (ROOT / "docs/SIZES.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `step` \| (6|20) \| (\d+) \| (\d+) \|", sizes, re.MULTILINE)
    without = {beacons: f"{int(m0) / 1e6:.1f}" for beacons, m0, _ in rows}
    with_one = {beacons: f"{round(int(m4f), -3):,}" for beacons, _, m4f in rows}
    text = " ".join((EXAMPLES / "arduino/README.md").read_text(encoding="utf-8").split())
    assert f"with 20 beacons takes {without['20']} million instructions" in text
    assert f"with 6 beacons {without['6']} million" in text and "-DBSLAM_BEACONS_MAX=6" in text
    assert f"An M4F needs {with_one['20']} for 20 beacons" in text


@pytest.mark.parametrize("path", sorted(EXAMPLES.rglob("README.md")), ids=lambda path: path.parent.name)
def test_links_lead_to_files(path: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)", path.read_text(encoding="utf-8")):
        assert (path.parent / target).exists(), target


def test_examples_include_the_public_headers_only() -> None:
    headers = [
        header
        for path in EXAMPLES.rglob("*")
        if path.suffix in CODE - {".py"}
        for header in re.findall(
            r'#include ["<]((?:\w+/)*bslam[\w/]*\.h|(?:base|vision)/\S+)[">]', path.read_text()
        )
    ]
    assert len(headers) == 5 and set(headers) == {"bslam/bslam.h", "bslam.h"}
