"""notebooks/ run from top to bottom, and hold no outputs."""

import base64
import importlib.util
import json
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[3] / "notebooks" / "run.py"
SPECIFICATION = importlib.util.spec_from_file_location("notebooks_run", SCRIPT)
assert SPECIFICATION is not None and SPECIFICATION.loader is not None
runner = importlib.util.module_from_spec(SPECIFICATION)
SPECIFICATION.loader.exec_module(runner)


@pytest.mark.parametrize("path", runner.NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_what_it_makes(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outputs = [one for cell in runner.executed(path)["cells"] for one in cell.get("outputs", ())]
    shown = [one["data"] for one in outputs if "data" in one]
    pictures = [base64.b64decode(one["image/png"]) for one in shown if "image/png" in one]
    assert pictures and all(one.startswith(b"\x89PNG") for one in pictures)
    assert any("image/png" not in one for one in shown), "a table"
    if path.stem == "your_own_log":
        text = "".join(one.get("text", "") for one in outputs)
        assert "my_drive: 0 findings" in text
        assert "found: mirrored bearings" in text
        assert "did you mean 'bearing_rad'?" in text


@pytest.mark.parametrize("path", runner.NOTEBOOKS, ids=lambda path: path.stem)
def test_no_output_is_kept_and_the_first_cell_says_how_to_open_it(path):
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["nbformat"] == 4
    code = [one for one in document["cells"] if one["cell_type"] == "code"]
    assert all(one["outputs"] == [] and one["execution_count"] is None for one in code)
    assert len({one["id"] for one in document["cells"]}) == len(document["cells"])
    assert "pip install pandas jupyterlab && .venv/bin/jupyter lab" in "".join(document["cells"][0]["source"])


def test_there_are_three():
    assert {path.stem for path in runner.NOTEBOOKS} == {
        "consistency",
        "your_own_algorithm",
        "your_own_log",
    }
