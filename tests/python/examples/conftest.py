"""Builds that several tests of examples/ use."""

from pathlib import Path

import pytest

from examples.building import ROOT, build_library, run


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The estimator with the sizes that it has by itself."""
    return build_library(tmp_path_factory.mktemp("library"))


@pytest.fixture(scope="session")
def sizes() -> dict[str, tuple[int, int]]:
    """Flash and RAM of each example that is cross-compiled, bytes, as `make examples` prints them."""
    printed = run("make", "--no-print-directory", "examples-built", folder=ROOT)
    assert printed.stderr == ""
    rows = [line.split() for line in printed.stdout.splitlines()]
    return {name: (int(flash), int(ram)) for name, flash, ram in rows}
