"""docs/TESTING.md names tests and files that exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
TESTING = (ROOT / "docs" / "TESTING.md").read_text(encoding="utf-8")
TESTS = "".join(
    path.read_text(encoding="utf-8")
    for suffix in ("c", "py")
    for path in sorted((ROOT / "tests").rglob(f"*.{suffix}"))
)


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:tests|tools)/[\w./]+)`", TESTING))))
def test_files_that_are_named_exist(path):
    assert (ROOT / path).exists()


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`(test_\w+)`", TESTING))))
def test_tests_that_are_named_exist(name):
    assert re.search(rf"(?:def|static void) {name}\(", TESTS)
