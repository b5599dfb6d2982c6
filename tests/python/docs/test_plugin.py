"""docs/PLUGIN.md and docs/DETECTOR.md: their code runs and does what they say."""

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

from bslam.cli import main
from bslam.runs.methods import shipped_methods

ROOT = Path(__file__).resolve().parents[3]
PLUGIN = (ROOT / "docs" / "PLUGIN.md").read_text(encoding="utf-8")
DETECTOR = (ROOT / "docs" / "DETECTOR.md").read_text(encoding="utf-8")


def block(text, language):
    (found,) = re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return found


def test_forty_lines_are_an_algorithm_that_works(tmp_path, monkeypatch, capsys):
    source = block(PLUGIN, "python")
    code = [line for line in source.splitlines() if line.strip()]
    assert len(code) <= 45, "forty lines, give or take the imports"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_slam.py").write_text(source)
    words = re.search(r"bslam (compare .* --with my_slam:MySlam)$", PLUGIN, re.MULTILINE)[1].split()
    assert main([*words, "--only", "bslam,dead_reckoning", "--jobs", "2"]) == 0
    table = json.loads((tmp_path / "out" / "compare" / "compare.json").read_text())["methods"]
    error_m = {line["method"]: line["position_error_mean_m"] for line in table}
    assert error_m["MySlam"] < 0.15
    assert error_m["bslam"] < error_m["MySlam"] < error_m["dead_reckoning"]


def test_algorithms_that_come_along_are_all_listed():
    listed = re.split(r"^## ", PLUGIN, flags=re.MULTILINE)[-1]
    names = set(re.findall(r"^\| `(\w+)` \|", listed, re.MULTILINE))
    assert names == {method.name for method in shipped_methods(25)}


def test_detector_example_compiles_and_prints_what_is_said(tmp_path):
    (tmp_path / "example.c").write_text(block(DETECTOR, "c"))
    core = sorted(map(str, (ROOT / "firmware" / "bslam").glob("*/*.c")))
    flags = ["-std=c11", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", f"-I{ROOT / 'firmware'}"]
    command = [os.environ.get("CC", "cc"), *flags, "example.c", *core, "-lm", "-o", "example"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run(["./example"], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert done.stdout == block(DETECTOR, "text")


@pytest.mark.parametrize("name", re.findall(r"`(BSLAM_\w+|bslam_\w+)`", DETECTOR))
def test_names_of_the_core_exist(name):
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "firmware" / "bslam").rglob("*.h"))
    assert re.search(rf"\b{name}\b", text)
