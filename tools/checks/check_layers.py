"""Checks that includes, imports and calls go down the layers, never up, sideways or in a circle.

C: a file of firmware/<layer>/ may include its own layer and what is listed for it, by full path. A library
takes a few libc headers that need neither heap nor I/O, and no two files of it have one name. With objects of
a host build, also that no C files call each other in a circle: what an object defines and needs, nm says.
Python: host_sim/bslam/<part>/ the same, and nothing but a raw layer touches cffi.

Exit status 0: all is well. 1: what is wrong, one finding a line.
"""

import argparse
import ast
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Set
from pathlib import Path

# Layers are folders of the firmware, from the lowest up: "base", "bslam/ekf". What stands in a library's own
# folder, its public header and what implements it, is a layer, too: "bslam". A single header may be listed.
HEADERS = frozenset({"bslam/bslam.h", "bslam/config.h", "bslam/settings.h", "bslam/settings_internal.h"})
SETTINGS = HEADERS | {"base"}
MODEL = SETTINGS | {"bslam/linalg", "bslam/model"}
EKF = MODEL | {"bslam/ekf"}
ASSOCIATION = EKF | {"bslam/appearance", "bslam/association"}
SLAM = ASSOCIATION | {"bslam/smoother", "bslam/slam"}
VISION = frozenset(
    {"base", "vision/config.h", "vision/frame.h", "vision/model.h", "vision/size.h", "vision/vision.h"}
)
PIXELS = VISION | {"vision/camera", "vision/pixels"}
# The chain for built-in kinds, which not every build has: the scanner and what it stands on do without it.
BUILT_IN = PIXELS | {"vision/built_in/pixels"}
DETECTION = BUILT_IN | {"vision/built_in/classifiers", "vision/built_in/detection"}
MEASURED = DETECTION | {"vision/built_in/measurement"}
C_MAY_INCLUDE: dict[str, frozenset[str]] = {
    "base": frozenset(),
    "bslam": SLAM | {"bslam/recovery", "bslam/store"},
    "bslam/linalg": SETTINGS,
    "bslam/model": MODEL,
    "bslam/appearance": MODEL,
    "bslam/ekf": MODEL,
    "bslam/smoother": EKF,
    "bslam/association": ASSOCIATION,
    "bslam/slam": SLAM,
    "bslam/store": SLAM,
    "bslam/recovery": SLAM,
    "vision": MEASURED | {"vision/built_in", "vision/built_in/gyro", "vision/scan"},
    "vision/camera": VISION,
    "vision/pixels": PIXELS,
    "vision/scan": PIXELS,
    "vision/built_in": MEASURED,
    "vision/built_in/pixels": BUILT_IN,
    "vision/built_in/classifiers": PIXELS,
    "vision/built_in/detection": DETECTION,
    "vision/built_in/measurement": PIXELS,
    "vision/built_in/gyro": MEASURED | {"vision/built_in"},
    "link": frozenset({"base"}),
    "models": frozenset({"bslam/bslam.h", "vision/vision.h"}),
    "port": frozenset({"base", "bslam/bslam.h", "vision/vision.h"}),
    # A user's program as any other: public headers, and of base what they are made of.
    "robot": frozenset({"base", "bslam/bslam.h", "vision/vision.h", "link", "models", "port"}),
}
C_LIBRARIES = ("base", "bslam", "vision", "link")
# Programs that measure; they may include anything.
C_FREE = frozenset({"bench"})
LIBC_HEADERS = frozenset(
    {"assert.h", "float.h", "limits.h", "math.h", "stdbool.h", "stddef.h", "stdint.h", "string.h"}
    # Of the compiler: instructions of cores as functions, where there are any (vision/pixels/bytes.h).
    | {"arm_acle.h", "emmintrin.h"}
)

LOG = frozenset({"errors", "parsing", "log"})
OPTIONS = LOG | {"core", "datasets", "options"}
EVALUATION = OPTIONS | {"evaluation"}
RUNS = EVALUATION | {
    "algorithms",
    "maps",
    "moment",
    "recording",
    "rig",
    "runs",
    "scannerfile",
    "target",
    "world",
}
PYTHON_MAY_IMPORT: dict[str, frozenset[str]] = {
    "errors": frozenset(),
    "parsing": frozenset({"errors"}),
    "log": LOG,
    "moment": frozenset(),
    "rig": frozenset({"errors", "parsing"}),
    "modelfile": frozenset({"errors"}),
    "scannerfile": frozenset({"errors", "modelfile"}),
    "cheader": frozenset({"errors", "modelfile", "scannerfile"}),
    "motion": frozenset(),
    "maps": frozenset({"errors"}),
    "core": frozenset({"errors", "modelfile", "rig", "scannerfile"}),
    "world": LOG | {"rig", "motion"},
    "algorithms": LOG | {"core", "motion"},
    "link": frozenset({"errors"}),
    "target": frozenset({"errors", "core", "link"}),
    "recording": LOG | {"core"},
    "datasets": LOG | {"modelfile", "rig"},
    "ros2": LOG | {"motion"},
    "options": OPTIONS,
    "evaluation": EVALUATION,
    "calibration": EVALUATION | {"rig", "world"},
    "logcheck": EVALUATION | {"logcheck", "view"},
    "runs": RUNS | {"motion"},
    "faults": RUNS | {"link"},
    "view": LOG | {"moment"},
    "detect": LOG | {"core", "datasets", "rig", "scannerfile", "view"},
}
# The command line ties the parts together and may import them all; so does what the package offers its users.
PYTHON_TOP = frozenset({"api", "cli", "commands", "__main__", "__init__"})
RAW_LAYERS = frozenset({"core/raw.py", "world/camera/raw.py"})
EXTENSIONS = re.compile(r"bslam\.(core|world\.camera)\._[a-z]")

INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]')

Uses = dict[str, dict[str, set[str]]]
"""By file the files it calls, and the names that it calls there."""


# ---- C: includes -------------------------------------------------------------------------------------------


def c_layer(path: Path) -> str:
    """The layer of a file, given relative to firmware: its folder; outside of the libraries the first one."""
    return path.parent.as_posix() if path.parts[0] in C_LIBRARIES else path.parts[0]


def c_fault(root: Path, layer: str, quote: str, included: str) -> str | None:
    """What is wrong with one include line of a file in `layer`, or None."""
    if quote == "<":
        if included in LIBC_HEADERS or layer.split("/")[0] not in C_LIBRARIES:
            return None
        return f"<{included}> is not on the list: {', '.join(sorted(LIBC_HEADERS))}"
    inner = Path(included)
    if len(inner.parts) == 1 or ".." in inner.parts:
        return f'"{included}" is not a full path, "<layer>/<file>.h"'
    if not (root / inner).is_file():
        return f'"{included}" does not exist'
    allowed = C_MAY_INCLUDE[layer]
    target = c_layer(inner)
    if target == layer or target in allowed or included in allowed:
        return None
    return f"{layer} may not include {included}; allowed: {', '.join(sorted(allowed)) or 'none'}"


def c_findings(root: Path) -> Iterator[str]:
    """Every bad include below `root`, the folder firmware."""
    for path in sorted(root.rglob("*.[ch]")):
        layer = c_layer(path.relative_to(root))
        if layer in C_FREE:
            continue
        if layer not in C_MAY_INCLUDE:
            yield f"{path}: no layer is called {layer}; allowed: {', '.join(sorted(C_MAY_INCLUDE))}"
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            match = INCLUDE.match(line)
            fault = match and c_fault(root, layer, match[1], match[2])
            if fault:
                yield f"{path}:{number}: {fault}"


def name_findings(root: Path) -> Iterator[str]:
    """Files of one name in a library; what it is archived with, base, counts for C files."""
    for library in C_LIBRARIES:
        found: dict[str, Path] = {}
        besides = [] if library == "base" else sorted((root / "base").rglob("*.c"))
        for path in [*besides, *sorted((root / library).rglob("*.[ch]"))]:
            first = found.setdefault(path.name, path)
            if first != path:
                yield f"{path}: {first} has the same name"


# ---- C: calls ----------------------------------------------------------------------------------------------


def read_uses(listing: str) -> Uses:
    """Who needs what of whom, from the output of `nm --portability --extern-only` for several objects."""
    defined: dict[str, str] = {}
    needed: dict[str, set[str]] = defaultdict(set)
    file = ""
    for line in listing.splitlines():
        if line.endswith(":"):
            file = line.rstrip(":")
            needed[file] = set()
        elif line:
            name, kind = line.split()[:2]
            if kind in "Uw":
                needed[file].add(name)
            else:
                defined[name] = file
    uses: Uses = {file: defaultdict(set) for file in needed}
    for file, names in needed.items():
        for name in names & set(defined):
            uses[file][defined[name]].add(name)
    return uses


def circles(uses: Mapping[str, Set[str] | dict[str, set[str]]]) -> list[list[str]]:
    """The sets of two or more that each reach all others: strongly connected components (Tarjan)."""
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    waiting: list[str] = []
    found: list[list[str]] = []

    def visit(one: str) -> None:
        order[one] = lowest[one] = len(order)
        waiting.append(one)
        for other in sorted(uses.get(one, ())):
            if other not in order:
                visit(other)
            if other in waiting:
                lowest[one] = min(lowest[one], lowest[other])
        if lowest[one] == order[one]:
            at = waiting.index(one)
            if len(waiting) > at + 1:
                found.append(sorted(waiting[at:]))
            del waiting[at:]

    for one in sorted(uses):
        if one not in order:
            visit(one)
    return found


def call_findings(root: Path, objects: list[Path]) -> Iterator[str]:
    """Circles of calls between files below `root`, the folder firmware; library files without an object."""
    sources = {}
    for path in objects:
        inner = path.as_posix().partition("firmware/")[2]
        source = root / Path(inner).with_suffix(".c")
        if source.is_file():
            sources[path.as_posix()] = source.as_posix()
    for library in C_LIBRARIES:
        missing = {path.as_posix() for path in (root / library).rglob("*.c")} - set(sources.values())
        yield from (f"{path}: there is no object of it" for path in sorted(missing))
    command = ["nm", "--portability", "--extern-only", *sources, "/dev/null"]  # two files: then it heads each
    listing = subprocess.run(command, check=False, capture_output=True, text=True).stdout
    uses = read_uses(listing)
    for circle in circles(uses):
        calls = [
            f"{Path(sources[one]).name} calls {', '.join(sorted(names))} of {Path(sources[other]).name}"
            for one in circle
            for other, names in sorted(uses[one].items())
            if other in circle and other != one
        ]
        yield f"{', '.join(sources[one] for one in circle)}: a circle of calls: {'; '.join(calls)}"


# ---- Python ------------------------------------------------------------------------------------------------


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
    parser.add_argument(
        "--objects", type=Path, nargs="*", help="objects of a host build, for circles of calls"
    )
    options = parser.parse_args(argv)
    firmware = options.root / "firmware"
    findings = [*c_findings(firmware), *name_findings(firmware)]
    if options.objects is not None:
        findings += call_findings(firmware, options.objects)
    findings += python_findings(options.root / "host_sim/bslam")
    for finding in findings:
        print(finding, file=sys.stderr)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
