"""tools/checks/check_layers.py reports an include, import or call that goes the wrong way, nothing else."""

import subprocess
from pathlib import Path

import pytest

from tools.checks import check_layers


def write(root: Path, path: str, text: str) -> None:
    target = root / path
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text, encoding="utf-8")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small repository in which every layer is respected."""
    estimator = ("bslam/linalg", "bslam/model", "bslam/ekf", "bslam/slam")
    for layer in ("base", *estimator, "link", "vision", "vision/built_in"):
        name = layer.split("/")[-1]
        write(tmp_path, f"firmware/{layer}/{name}.h", "#include <stdint.h>\n")
    write(tmp_path, "firmware/bslam/bslam.h", '#include "base/base.h"\n')
    write(tmp_path, "firmware/bslam/instance.h", '#include "bslam/slam/slam.h"\n')
    write(
        tmp_path, "firmware/bslam/ekf/ekf.c", '#include "bslam/bslam.h"\n#include "bslam/linalg/linalg.h"\n'
    )
    write(tmp_path, "firmware/robot/robot.c", '#include <stdio.h>\n#include "bslam/bslam.h"\n')
    write(tmp_path, "firmware/bench/cost.c", '#include "bslam/instance.h"\n')
    write(tmp_path, "host_sim/bslam/core/raw.py", "from bslam.core import _core_float\n")
    write(tmp_path, "host_sim/bslam/core/slam.py", "from bslam.core import raw\nfrom . import errors\n")
    write(tmp_path, "host_sim/bslam/runs/runner.py", "import numpy\nfrom bslam.world import arena\n")
    return tree_is_clean(tmp_path)


def tree_is_clean(root: Path) -> Path:
    assert check_layers.main(["--root", str(root)]) == 0
    return root


def findings(root: Path, capsys: pytest.CaptureFixture[str], *options: str) -> list[str]:
    """What is complained of, and that the exit status says so."""
    status = check_layers.main(["--root", str(root), *options])
    lines = capsys.readouterr().err.splitlines()
    assert status == (1 if lines else 0)
    return lines


@pytest.mark.parametrize(
    ("path", "line", "complaint"),
    [
        ("bslam/linalg/up.c", '#include "bslam/ekf/ekf.h"', "bslam/linalg may not include bslam/ekf/ekf.h"),
        ("link/sideways.h", '#  include "bslam/model/model.h"', "link may not include bslam/model/model.h"),
        ("bslam/slam/link.c", '#include "link/link.h"', "bslam/slam may not include link/link.h"),
        ("bslam/slam/whole.c", '#include "bslam/instance.h"', "bslam/slam may not include bslam/instance.h"),
        ("bslam/vision.c", '#include "vision/vision.h"', "bslam may not include vision/vision.h"),
        ("vision/map.c", '#include "bslam/bslam.h"', "vision may not include bslam/bslam.h"),
        ("vision/scan/a.c", '#include "vision/built_in/built_in.h"', "vision/scan may not include"),
        ("vision/camera/a.c", '#include "vision/built_in/built_in.h"', "vision/camera may not include"),
        ("robot/inside.c", '#include "bslam/ekf/ekf.h"', "robot may not include bslam/ekf/ekf.h"),
        ("port/board/up.c", '#include "bslam/instance.h"', "port may not include bslam/instance.h"),
        ("bslam/model/short.c", '#include "model.h"', "is not a full path"),
        ("bslam/model/missing.c", '#include "base/missing.h"', "does not exist"),
        ("bslam/model/heap.c", "#include <stdlib.h>", "<stdlib.h> is not on the list"),
        ("unheard_of/a.c", "", "no layer is called unheard_of"),
        ("bslam/unheard_of/a.c", "", "no layer is called bslam/unheard_of"),
    ],
)
def test_main_bad_include_is_reported(
    tree: Path, capsys: pytest.CaptureFixture[str], path: str, line: str, complaint: str
) -> None:
    write(tree, f"firmware/{path}", line + "\n")
    [finding] = findings(tree, capsys)
    assert path in finding
    assert complaint in finding


@pytest.mark.parametrize(
    ("path", "line", "complaint"),
    [
        ("core/slam.py", "from bslam.world.arena import Arena", "core may not import world"),
        ("core/slam.py", "from ..world import arena", "core may not import world"),
        ("world/arena.py", "import bslam.core.slam", "world may not import core"),
        ("world/arena.py", "from bslam import core", "world may not import core"),
        ("view/plots.py", "from bslam.core import slam", "view may not import core"),
        ("options.py", "from bslam.runs import runner", "options may not import runs"),
        ("evaluation/metrics.py", "from bslam.runs import runner", "evaluation may not import runs"),
        ("datasets/mrclam.py", "from bslam.evaluation import metrics", "datasets may not import evaluation"),
        ("core/slam.py", "from bslam.core import _core_double", "touch cffi"),
        ("runs/runner.py", "from cffi import FFI", "touch cffi"),
        ("unheard_of/a.py", "", "no part is called unheard_of"),
    ],
)
def test_main_bad_import_is_reported(
    tree: Path, capsys: pytest.CaptureFixture[str], path: str, line: str, complaint: str
) -> None:
    write(tree, f"host_sim/bslam/{path}", f'"""A docstring."""\n\n{line}\n')
    [finding] = findings(tree, capsys)
    assert path in finding
    assert complaint in finding


@pytest.mark.parametrize("table", [check_layers.C_MAY_INCLUDE, check_layers.PYTHON_MAY_IMPORT])
def test_table_has_no_circle(table: dict[str, frozenset[str]]) -> None:
    """A library's own folder stands on what is below; headers that are named one by one are at the bottom."""
    assert check_layers.circles({layer: below & set(table) - {layer} for layer, below in table.items()}) == []


@pytest.mark.parametrize("other", ["bslam/model/ekf.c", "base/ekf.c"])
def test_main_two_files_of_one_name_in_a_library_are_reported(
    tree: Path, capsys: pytest.CaptureFixture[str], other: str
) -> None:
    write(tree, f"firmware/{other}", "")
    [finding] = findings(tree, capsys)
    assert finding.endswith("has the same name")
    assert "ekf/ekf.c" in finding


def test_main_one_name_in_two_libraries_is_fine(tree: Path) -> None:
    write(tree, "firmware/vision/ekf.c", "")
    tree_is_clean(tree)


def compiled(root: Path) -> list[str]:
    """The option that names the objects of all libraries' files."""
    sources = [path for name in check_layers.C_LIBRARIES for path in (root / "firmware" / name).rglob("*.c")]
    objects = []
    for source in sources:
        target = root / "build" / source.relative_to(root).with_suffix(".o")
        target.parent.mkdir(parents=True, exist_ok=True)
        command = ["cc", f"-I{root}/firmware", "-c", str(source), "-o", str(target)]
        subprocess.run(command, check=True)
        objects.append(str(target))
    return ["--objects", *objects]


CALLS = "int {0}(int); int {1}(int); int {0}(int a) {{ return {1}(a); }}\n"


def test_main_calls_that_go_down_are_fine(tree: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tree, "firmware/bslam/ekf/up.c", CALLS.format("up", "down"))
    write(tree, "firmware/bslam/ekf/down.c", "int down(int); int down(int a) { return a; }\n")
    assert findings(tree, capsys, *compiled(tree)) == []


def test_main_circle_of_calls_is_named_with_every_file(
    tree: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tree, "firmware/bslam/ekf/one.c", CALLS.format("one", "two"))
    write(tree, "firmware/bslam/ekf/two.c", CALLS.format("two", "three"))
    write(tree, "firmware/bslam/ekf/three.c", CALLS.format("three", "one"))
    write(tree, "firmware/bslam/slam/four.c", CALLS.format("four", "one"))
    [finding] = findings(tree, capsys, *compiled(tree))
    assert "one.c calls two of two.c" in finding
    assert "three.c calls one of one.c" in finding
    assert "four.c" not in finding


def test_main_call_through_a_table_counts(tree: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = "int go(int); int leaf(int); int (*const table[])(int) = {go}; int leaf(int a) { return a; }\n"
    write(tree, "firmware/link/table.c", table)
    write(tree, "firmware/link/go.c", CALLS.format("go", "leaf"))
    [finding] = findings(tree, capsys, *compiled(tree))
    assert "table.c calls go of go.c" in finding


def test_main_file_without_an_object_is_reported(tree: Path, capsys: pytest.CaptureFixture[str]) -> None:
    objects = compiled(tree)
    write(tree, "firmware/bslam/ekf/late.c", "")
    [finding] = findings(tree, capsys, *objects)
    assert "late.c: there is no object of it" in finding
