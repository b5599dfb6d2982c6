"""Checks that includes and imports go down the layers, never up or sideways.

C: a file of firmware/bslam/<layer>/ may include its own layer and those listed for it, by full path, and
a few libc headers that need neither heap nor I/O. Python: host_sim/bslam/<part>/ the same, and nothing but a
raw layer touches cffi.

Exit status 0: all is well. 1: what is wrong, one finding a line.
"""

import argparse
import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

BASE = frozenset({"base"})
MATH = BASE | {"math"}
BELOW_SLAM = MATH | {"odometry", "model", "svm", "ekf", "smoother", "vision", "association"}
C_MAY_INCLUDE: dict[str, frozenset[str]] = {
    "base": frozenset(),
    "math": BASE,
    "odometry": MATH,
    "model": MATH,
    "svm": MATH,
    "link": MATH,
    "ekf": MATH | {"model"},
    "smoother": MATH | {"model", "ekf"},
    "vision": MATH | {"model", "svm"},
    "association": MATH | {"model", "svm", "ekf"},
    "slam": BELOW_SLAM,
    "store": BELOW_SLAM | {"link", "slam"},
    "recovery": BELOW_SLAM | {"slam"},
    # bslam.h itself, the umbrella: for users of the library, so nothing inside may include it.
    "umbrella": BELOW_SLAM | {"link", "slam", "store", "recovery"},
}
LIBC_HEADERS = frozenset(
    {"assert.h", "float.h", "limits.h", "math.h", "stdbool.h", "stddef.h", "stdint.h", "string.h"}
    # Of the compiler: instructions of cores as functions, where there are any (math/bytes.h).
    | {"arm_acle.h", "emmintrin.h"}
)

LOG = frozenset({"errors", "parsing", "log"})
PYTHON_MAY_IMPORT: dict[str, frozenset[str]] = {
    "errors": frozenset(),
    "parsing": frozenset({"errors"}),
    "log": LOG,
    "moment": frozenset(),
    "rig": frozenset({"errors", "parsing"}),
    "modelfile": frozenset({"errors"}),
    "motion": frozenset(),
    "maps": frozenset({"errors"}),
    "core": frozenset({"errors", "modelfile", "rig"}),
    "world": LOG | {"rig", "motion"},
    "algorithms": LOG | {"core", "motion"},
    "link": frozenset({"errors"}),
    "target": frozenset({"errors", "core", "link"}),
    "recording": LOG | {"core"},
    "experiment": LOG
    | {"moment", "rig", "modelfile", "core", "world", "link", "target", "recording", "algorithms", "maps"},
    "view": LOG | {"moment"},
}
# The command line ties the parts together and may import them all.
PYTHON_TOP = frozenset({"cli", "commands", "__main__", "__init__"})
RAW_LAYERS = frozenset({"core/build.py", "core/raw.py", "world/camera/build.py", "world/camera/raw.py"})
EXTENSIONS = re.compile(r"bslam\.(core|world\.camera)\._[a-z]")

INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]')


def c_layer(path: Path) -> str:
    """The layer of a file, given relative to firmware/bslam: "math/trig.h" is in math."""
    return path.parts[0] if len(path.parts) > 1 else "umbrella"


def c_fault(root: Path, layer: str, quote: str, included: str) -> str | None:
    """What is wrong with one include line of a file in `layer`, or None."""
    if quote == "<":
        if included in LIBC_HEADERS:
            return None
        return f"<{included}> is not on the list: {', '.join(sorted(LIBC_HEADERS))}"
    if not included.startswith("bslam/"):
        return f'"{included}" is not a full path, "bslam/<layer>/<file>.h"'
    inner = Path(included).relative_to("bslam")
    if not (root / inner).is_file():
        return f'"{included}" does not exist'
    target = c_layer(inner)
    if target == layer or target in C_MAY_INCLUDE[layer]:
        return None
    return f"{layer} may not include {target}; allowed: {', '.join(sorted(C_MAY_INCLUDE[layer])) or 'none'}"


def c_findings(root: Path) -> Iterator[str]:
    """Every bad include below `root`, the folder firmware/bslam."""
    for path in sorted(root.rglob("*.[ch]")):
        layer = c_layer(path.relative_to(root))
        if layer not in C_MAY_INCLUDE:
            yield f"{path}: no layer is called {layer}; allowed: {', '.join(sorted(C_MAY_INCLUDE))}"
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            match = INCLUDE.match(line)
            fault = match and c_fault(root, layer, match[1], match[2])
            if fault:
                yield f"{path}:{number}: {fault}"


def imported_names(tree: ast.Module, package: list[str]) -> Iterator[tuple[int, str]]:
    """Line and dotted name of everything a module imports; `package` is where relative imports start."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*start, *([node.module] if node.module else [])])
            for alias in node.names:
                yield node.lineno, f"{module}.{alias.name}"


def python_fault(part: str, relative: str, name: str) -> str | None:
    """What is wrong with importing `name` in the file `relative` of `part`, or None."""
    words = name.split(".")
    if words[0] == "cffi" or EXTENSIONS.match(name):
        return None if relative in RAW_LAYERS else f"{name}: only {', '.join(sorted(RAW_LAYERS))} touch cffi"
    if words[0] != "bslam" or part in PYTHON_TOP or len(words) == 1:
        return None
    target = words[1]
    if target == part or target in PYTHON_MAY_IMPORT[part] or target.startswith("__"):
        return None
    allowed = ", ".join(sorted(PYTHON_MAY_IMPORT[part])) or "none"
    return f"{part} may not import {target}; allowed: {allowed}"


def python_findings(root: Path) -> Iterator[str]:
    """Every bad import below `root`, the folder host_sim/bslam."""
    for path in sorted(root.rglob("*.py")):
        relative = path.relative_to(root)
        part = relative.parts[0].removesuffix(".py")
        if part not in PYTHON_MAY_IMPORT and part not in PYTHON_TOP:
            yield f"{path}: no part is called {part}; allowed: {', '.join(sorted(PYTHON_MAY_IMPORT))}"
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
        package = ["bslam", *relative.parts[:-1]]
        faults = {
            f"{path}:{line}: {fault}"
            for line, name in imported_names(tree, package)
            if (fault := python_fault(part, relative.as_posix(), name))
        }
        yield from sorted(faults)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=Path, default=Path(), help="the repository (default: here)")
    root: Path = parser.parse_args(argv).root
    findings = [*c_findings(root / "firmware/bslam"), *python_findings(root / "host_sim/bslam")]
    for finding in findings:
        print(finding, file=sys.stderr)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
