"""Runs the notebooks, and writes them with what they print and draw: `python notebooks/run.py out/notebooks`.

Their cells are plain Python, executed one after another: a Jupyter kernel (ipykernel, pyzmq, IPython and a
dozen more packages, 3 s to start each) would show nothing else.
"""

import ast
import base64
import io
import json
import sys
from contextlib import chdir, redirect_stdout
from pathlib import Path
from typing import Any

NOTEBOOKS = sorted(Path(__file__).resolve().parent.glob("*.ipynb"))


def outputs(source: str, names: dict[str, object]) -> list[dict[str, Any]]:
    """Run a cell; what it prints and the value of its last line, as a notebook keeps them."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    value = None
    with redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, "cell", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    kept: list[dict[str, Any]] = []
    if printed.getvalue():
        kept.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue()})
    if value is not None:
        data = {"text/plain": repr(value)}
        if hasattr(value, "_repr_png_"):
            data["image/png"] = base64.b64encode(value._repr_png_()).decode()
        kept.append({"output_type": "display_data", "metadata": {}, "data": data})
    return kept


def executed(path: Path) -> dict[str, Any]:
    """The notebook with its outputs; files that its cells write land in the current folder."""
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    names: dict[str, object] = {"__name__": "notebook"}
    for cell in document["cells"]:
        if cell["cell_type"] == "code":
            cell["outputs"] = outputs("".join(cell["source"]), names)
    return document


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    with chdir(folder):
        for notebook in NOTEBOOKS:
            Path(notebook.name).write_text(json.dumps(executed(notebook)), encoding="utf-8")
