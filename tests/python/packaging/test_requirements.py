"""What bslam stands on: pins, their hashes, their licences and the package's own bounds speak of the same."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[3]
LISTS = ("requirements", "requirements-test")
UNPINNED = {"jupyterlab", "rerun-sdk"}  # viewers, which no test opens


def pins(name: str) -> dict[str, str]:
    """By library, in pip's spelling, the version in a file of the root."""
    text = (ROOT / f"{name}.txt").read_text(encoding="utf-8")
    found = re.findall(r"^([\w.-]+)==([^\s;]+)", text, re.MULTILINE)
    return {canonicalize_name(library): version for library, version in found}


def licences() -> dict[str, str]:
    """By library what THIRD-PARTY.md says."""
    text = (ROOT / "THIRD-PARTY.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    return {
        canonicalize_name(one): row[1] for row in rows if row[1] != "licence" for one in row[0].split(", ")
    }


@pytest.mark.parametrize("name", LISTS)
def test_every_pin_has_its_hashes(name: str) -> None:
    locked = pins(f"{name}.lock")
    assert pins(name).items() <= locked.items(), "`make lock` writes the hashes anew"
    elsewhere = {**pins("requirements"), **pins("requirements-test"), "colorama": locked["colorama"]}
    assert locked.items() <= elsewhere.items(), "pin what is new in requirements*.txt, too"
    text = (ROOT / f"{name}.lock.txt").read_text(encoding="utf-8")
    assert all("--hash=sha256:" in entry for entry in re.split(r"^(?=\w)", text, flags=re.MULTILINE)[1:])


def test_every_library_has_its_licence_in_the_notice() -> None:
    told = licences()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = [Requirement(one).name for more in project["optional-dependencies"].values() for one in more]
    needed = {*pins("requirements"), *map(canonicalize_name, extras)}
    assert needed - set(told) == set(), "without a row in THIRD-PARTY.md"
    assert set(told) - needed == set(), "rows of what nothing needs"
    for library in needed:
        try:
            own = metadata(library).get("License-Expression")
        except PackageNotFoundError:  # an extra of other machines
            continue
        assert own in (None, told[library]), library


def test_the_pins_are_within_the_bounds_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = [one for more in project["optional-dependencies"].values() for one in more]
    every = {**pins("requirements-test"), **pins("requirements")}
    for wanted in map(Requirement, [*project["dependencies"], *extras]):
        if wanted.name not in UNPINNED:
            assert wanted.specifier.contains(every[canonicalize_name(wanted.name)]), wanted
