"""What the READMEs of examples/ say is so: figures, lines, links, the table of all."""

import re
from pathlib import Path

import pytest

from examples.building import EXAMPLES

CODE = {".c", ".h", ".ino", ".py"}  # build files, linker scripts and start-up code are none
NAMES = sorted(path.parent.name for path in EXAMPLES.glob("*/README.md"))
LINES_MAX = 119
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
    rows = re.findall(r"^\| \[(\w+)\]\((\w+)\) \|.*\| ([\d,]+) \| ([\d,]+) \| [^|]+ \|$", text, re.MULTILINE)
    assert all(name == folder for name, folder, *_ in rows)
    return {name: (int(flash.replace(",", "")), int(ram.replace(",", ""))) for name, _, flash, ram in rows}


def test_the_table_lists_every_example_with_the_figures_of_its_readme() -> None:
    assert len(NAMES) == 7
    texts = {name: (EXAMPLES / name / "README.md").read_text(encoding="utf-8") for name in NAMES}
    assert table() == {name: figures_of(text) for name, text in texts.items()}


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short(name: str) -> None:
    lines = [
        line
        for path in code_files(name)
        for line in path.read_text(encoding="utf-8").splitlines()
        if line.strip() and not line.lstrip().startswith(("//", "#!", "# "))
    ]
    assert 0 < len(lines) <= LINES_MAX


def test_figures_are_those_that_make_prints(sizes: dict[str, tuple[int, int]]) -> None:
    assert set(sizes) == set(NAMES) - {"live_robot"}  # tests/python/target looks at that one
    for name, measured in sizes.items():
        assert table()[name] == pytest.approx(measured, rel=TOLERANCE), name


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
