"""docs/PLUGIN.md and docs/DETECTOR.md: their code runs and does what they say."""

import json
import re

import pytest

from bslam.cli import main
from bslam.runs.methods import shipped_methods
from docs.reading import FIRMWARE, block, output_of, read

PLUGIN, DETECTOR = read("docs/PLUGIN.md"), read("docs/DETECTOR.md")
HEADERS = "".join(path.read_text(encoding="utf-8") for path in FIRMWARE.rglob("*.h"))


def test_lines_are_an_algorithm_that_works(tmp_path, monkeypatch):
    """On two of the twenty drives; on the second one without cross-covariance it got lost."""
    source = block(PLUGIN, "python")
    lines = len(source.splitlines())
    assert f"## {lines} lines" in PLUGIN and f"[{lines} lines](docs/PLUGIN.md)" in read("README.md")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_slam.py").write_text(source)
    commands = re.findall(r"bslam (compare .* --with my_slam:MySlam.*)$", PLUGIN, re.MULTILINE)
    words = (
        commands[1].replace("--only bslam --seeds 0:20", "--only bslam,dead_reckoning --seeds 0:2").split()
    )
    assert words[: len(commands[0].split())] == commands[0].split()
    assert main([*words, "--jobs", "2"]) == 0
    table = json.loads((tmp_path / "out" / "compare" / "compare.json").read_text())["methods"]
    error_m = {line["method"]: line["position_error_mean_m"] for line in table}
    assert error_m["bslam"] < error_m["MySlam"] < 0.08 < error_m["dead_reckoning"]
    runs = json.loads((tmp_path / "out" / "compare" / "summary.json").read_text())["runs"]
    assert all(one["nees_mean"] < 8.0 for one in runs if "MySlam" in one["name"])


def test_algorithms_that_come_along_are_all_listed():
    listed = re.split(r"^## ", PLUGIN, flags=re.MULTILINE)[-1]
    names = set(re.findall(r"^\| `(\w+)` \|", listed, re.MULTILINE))
    assert names == {method.name for method in shipped_methods(25)}


def test_detector_example_compiles_and_prints_what_is_said(tmp_path):
    assert output_of(block(DETECTOR, "c"), tmp_path) == block(DETECTOR, "text")


@pytest.mark.parametrize("name", re.findall(r"`(BSLAM_\w+|bslam_\w+)`", DETECTOR))
def test_names_of_the_core_exist(name):
    assert re.search(rf"\b{name}\b", HEADERS)
