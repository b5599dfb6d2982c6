"""The package's own build: when an extension is made anew, what it is called, and what it replaces."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from typing import Any

import pytest
import setuptools

import bslam_build
from bslam_build import Extension, build, shipped

ROOT = Path(__file__).resolve().parents[3]


def test_extensions_are_made_anew_where_their_sizes_change() -> None:
    assert all(str(ROOT / "host_sim/bslam/core/builds.py") in one.depends for one in shipped())


@pytest.mark.parametrize("is_abi3", [True, False])
def test_the_wheel_is_tagged_for_every_python_where_its_extensions_are(
    is_abi3: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: dict[str, Any] = {}
    monkeypatch.setattr(bslam_build, "IS_ABI3", is_abi3)
    monkeypatch.setattr(setuptools, "setup", lambda **words: told.update(words))
    monkeypatch.setattr(sys, "path", [*sys.path])
    runpy.run_path(str(ROOT / "setup.py"))
    assert {one.py_limited_api for one in told["ext_modules"]} == {is_abi3}
    assert ("bdist_wheel" in told["options"]) == is_abi3


def test_an_extension_for_one_python_does_not_hide_the_new_one(tmp_path: Path) -> None:
    for name in ("tiny.h", "_tiny.cpython-311-any.so", "_tiny_2.cpython-311-any.so", "_tiny.abi3.so"):
        (tmp_path / name).touch()
    assert build(Extension("_tiny", tmp_path, ["."], "tiny.h"), tmp_path) == tmp_path / "_tiny.abi3.so"
    assert {one.name for one in tmp_path.glob("*.so")} == {"_tiny_2.cpython-311-any.so", "_tiny.abi3.so"}
