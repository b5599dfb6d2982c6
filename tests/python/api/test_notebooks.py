"""notebooks/ run from top to bottom, and hold no outputs.

Their cells are plain Python, executed here one after another: a Jupyter kernel (ipykernel, pyzmq, IPython and
a dozen more pinned packages, 3 s to start each) would prove nothing else about them.
"""

import ast
import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[3] / "notebooks").glob("*.ipynb"))


def cells(path: Path, kind: str) -> list[str]:
    """The texts of one kind of cell."""
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["nbformat"] == 4
    return ["".join(one["source"]) for one in document["cells"] if one["cell_type"] == kind]


def show(source: str, names: dict[str, object]) -> object:
    """Run a cell; the value of its last line, which a notebook would show."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    if last is None:
        return None
    assert isinstance(last, ast.Expr)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_what_it_makes(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "notebook"}
    shown = [show(source, names) for source in cells(path, "code")]
    pictures = [one._repr_png_() for one in shown if hasattr(one, "_repr_png_")]
    assert pictures and all(one.startswith(b"\x89PNG") for one in pictures)
    if path.stem == "your_own_log":
        text = capsys.readouterr().out
        assert "my_drive: 0 findings" in text
        assert "found: mirrored bearings" in text
        assert "did you mean 'bearing_rad'?" in text


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_no_output_is_kept(path):
    document = json.loads(path.read_text(encoding="utf-8"))
    code = [one for one in document["cells"] if one["cell_type"] == "code"]
    assert all(one["outputs"] == [] and one["execution_count"] is None for one in code)
    assert len({one["id"] for one in document["cells"]}) == len(document["cells"])


def test_there_are_three():
    assert {path.stem for path in NOTEBOOKS} == {"consistency", "your_own_algorithm", "your_own_log"}
