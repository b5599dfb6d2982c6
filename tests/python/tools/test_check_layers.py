"""tools/checks/check_layers.py reports an include or import that goes the wrong way, and nothing else."""

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
    for layer in ("base", "math", "model", "ekf", "slam", "link"):
        write(tmp_path, f"firmware/bslam/{layer}/{layer}.h", "#include <stdint.h>\n")
    write(tmp_path, "firmware/bslam/bslam.h", '#include "bslam/slam/slam.h"\n')
    write(tmp_path, "firmware/bslam/ekf/ekf.c", '#include "bslam/ekf/ekf.h"\n#include "bslam/math/math.h"\n')
    write(tmp_path, "host_sim/bslam/core/raw.py", "from bslam.core import _core_float\n")
    write(tmp_path, "host_sim/bslam/core/slam.py", "from bslam.core import raw\nfrom . import errors\n")
    write(tmp_path, "host_sim/bslam/experiment/runner.py", "import numpy\nfrom bslam.world import arena\n")
    return tree_is_clean(tmp_path)


def tree_is_clean(root: Path) -> Path:
    assert check_layers.main(["--root", str(root)]) == 0
    return root


@pytest.mark.parametrize(
    ("path", "line", "complaint"),
    [
        ("math/up.c", '#include "bslam/ekf/ekf.h"', "math may not include ekf"),
        ("link/sideways.h", '#  include "bslam/model/model.h"', "link may not include model"),
        ("slam/link.c", '#include "bslam/link/link.h"', "slam may not include link"),
        ("slam/umbrella.c", '#include "bslam/bslam.h"', "slam may not include umbrella"),
        ("math/short.c", '#include "math.h"', "is not a full path"),
        ("math/missing.c", '#include "bslam/base/missing.h"', "does not exist"),
        ("math/heap.c", "#include <stdlib.h>", "<stdlib.h> is not on the list"),
        ("unheard_of/a.c", "", "no layer is called unheard_of"),
    ],
)
def test_main_bad_include_is_reported(
    tree: Path, capsys: pytest.CaptureFixture[str], path: str, line: str, complaint: str
) -> None:
    write(tree, f"firmware/bslam/{path}", line + "\n")
    assert check_layers.main(["--root", str(tree)]) == 1
    error = capsys.readouterr().err
    assert path in error
    assert complaint in error
    assert len(error.splitlines()) == 1


@pytest.mark.parametrize(
    ("path", "line", "complaint"),
    [
        ("core/slam.py", "from bslam.world.arena import Arena", "core may not import world"),
        ("core/slam.py", "from ..world import arena", "core may not import world"),
        ("world/arena.py", "import bslam.core.slam", "world may not import core"),
        ("world/arena.py", "from bslam import core", "world may not import core"),
        ("view/plots.py", "from bslam.core import slam", "view may not import core"),
        ("core/slam.py", "from bslam.core import _core_double", "touch cffi"),
        ("experiment/runner.py", "from cffi import FFI", "touch cffi"),
        ("unheard_of/a.py", "", "no part is called unheard_of"),
    ],
)
def test_main_bad_import_is_reported(
    tree: Path, capsys: pytest.CaptureFixture[str], path: str, line: str, complaint: str
) -> None:
    write(tree, f"host_sim/bslam/{path}", f'"""A docstring."""\n\n{line}\n')
    assert check_layers.main(["--root", str(tree)]) == 1
    error = capsys.readouterr().err
    assert path in error
    assert complaint in error
    assert len(error.splitlines()) == 1
