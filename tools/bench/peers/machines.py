"""Support vector machines beside LIBLINEAR and m2cgen: the same signatures, of rendered beacons."""

from __future__ import annotations

import importlib
import importlib.util
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.svm import LinearSVC

from bslam import cheader as export
from tools.bench.peers.programs import BUILD, INCLUDE, OPTIMISED, ROOT, SOURCES
from tools.training import fit
from tools.training.looks import Views, rendered

SCENARIO, WORLD, FRAMES = "building20", 11, 1500
OWN, NEGATIVES = 16, 96  # samples of a set: as many as a training on the robot takes
COST = 10.0
M4F = ["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]


@dataclass(frozen=True)
class Task:
    """Sets to train on, one an object, and tests: rows of (label, signature)."""

    sets: list[tuple[NDArray[np.int64], NDArray[np.float32]]]
    tests: tuple[NDArray[np.int64], NDArray[np.float32]]

    def text(self) -> str:
        """As the programs read it."""
        return f"{len(self.sets)} {COST}\n" + "".join(_text(*one) for one in [*self.sets, self.tests])


@dataclass(frozen=True)
class Result:
    """What a program took: ns and instructions of a training and of a decision; share of tests named rightly.

    flash_bytes: on a Cortex-M4F, decision and weights; None where that does not run there.
    """

    train_ns: int
    decide_ns: int
    train_instructions: int
    decide_instructions: int
    right: float
    flash_bytes: int | None


@dataclass(frozen=True)
class Entrant:
    """One program. sources: C files and flags for a task; package: how it is installed, None: not at all."""

    name: str
    package: str | None
    is_here: Callable[[], bool]
    sources: Callable[[Task], list[str]]
    libraries: tuple[str, ...] = ("-lm",)
    trains: bool = False


def make_task() -> Task:
    """Rendered beacons: OWN views of each against NEGATIVES of all others; what is left are the tests."""
    views = rendered(SCENARIO, WORLD, FRAMES, least=2 * OWN)
    random = np.random.default_rng(0)
    own = [random.permutation(np.flatnonzero(views.objects == one)) for one in range(views.object_count)]
    train = [rows[:OWN] for rows in own]
    sets = []
    for one, rows in enumerate(train):
        others = random.permutation(np.concatenate([*train[:one], *train[one + 1 :]]))[:NEGATIVES]
        labels = np.concatenate([np.ones(len(rows), np.int64), -np.ones(len(others), np.int64)])
        order = random.permutation(len(labels))
        sets.append((labels[order], views.signatures[np.concatenate([rows, others])[order]]))
    return Task(sets, _rows(views, np.concatenate([rows[OWN:] for rows in own])))


def _rows(views: Views, rows: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    return views.objects[rows], views.signatures[rows]


def _text(labels: NDArray[np.int64], signatures: NDArray[np.float32]) -> str:
    lines = [str(len(labels))]
    for label, row in zip(labels.tolist(), signatures.tolist(), strict=True):
        lines.append(f"{label} " + " ".join(f"{value:.7g}" for value in row))
    return "\n".join(lines) + "\n"


def measure(entrant: Entrant, task: Task, rounds: int) -> Result:
    """Times are the least of the rounds; counts by callgrind."""
    sources, text = entrant.sources(task), task.text()
    program = _built(sources, entrant.libraries)
    runs = np.array([_output([program], text).split() for _ in range(rounds)], np.int64)
    tests = len(task.tests[0])
    train = _count(program, text, "svm_train") // len(task.sets) if entrant.trains else 0
    decide = _count(program, text, "svm_decide") // tests
    best_ns = runs[:, :2].min(axis=0)
    flash = None if entrant.trains else _flash(sources)
    return Result(int(best_ns[0]), int(best_ns[1]), train, decide, float(runs[0, 2] / tests), flash)


def _built(sources: Sequence[str], libraries: Sequence[str]) -> Path:
    program = BUILD / "svm"
    words = ["-std=gnu11", *OPTIMISED, str(SOURCES / "svm.c"), *sources, *libraries, "-o", str(program)]
    subprocess.run(["cc", *words], check=True)
    return program


def _output(command: Sequence[str | Path], text: str) -> str:
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"bench: {command[-1]} failed:\n{done.stderr}")
    return done.stdout + done.stderr


def _count(program: Path, text: str, function: str) -> int:
    """Instructions of all calls of it."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    said = _output([*command, f"--toggle-collect={function}", program], text)
    collected = re.search(r"Collected\s*:\s*(\d+)", said)
    assert collected is not None, said
    return int(collected[1])


def _flash(sources: Sequence[str]) -> int | None:
    """Bytes of code and constants on a Cortex-M4F, without the C library's; None without its compiler."""
    if shutil.which("arm-none-eabi-gcc") is None:
        return None
    flags, made, total = [word for word in sources if word.startswith("-")], BUILD / "m4f.o", 0
    for source in (word for word in sources if not word.startswith("-")):
        words = ["-std=c11", "-Os", *M4F, *flags, "-c", source, "-o", str(made)]
        subprocess.run(["arm-none-eabi-gcc", *words], check=True)
        total += int(_output(["arm-none-eabi-size", made], "").split("\n")[1].split()[0])
    return total


def _on_robot(_task: Task) -> list[str]:
    core = [str(ROOT / f"firmware/bslam/appearance/{name}.c") for name in ("solver", "sample")]
    return [str(SOURCES / "svm_bslam.c"), *core, f"-I{ROOT / 'firmware'}"]


def _liblinear(_task: Task) -> list[str]:
    return [str(SOURCES / "svm_liblinear.c")]


def _header(task: Task, *, small: bool) -> list[str]:
    x, labels = _all(task)
    svm = fit.fit(x, fit.one_vs_rest(labels, len(task.sets)), COST).svm
    header = export.Header("MACHINE_H", ["vision/vision.h"], {})
    header.constant("bslam_svm_t", "machine", header.svm("table", fit.quantised(svm) if small else svm))
    core = str(ROOT / "firmware/vision/built_in/classifiers/svm.c")
    return [*_compiled_in(header.text()), core, f"-I{ROOT / 'firmware'}"]


def _m2cgen(task: Task) -> list[str]:
    m2cgen = importlib.import_module("m2cgen")
    x, labels = _all(task)
    code = m2cgen.export_to_c(LinearSVC(C=COST, dual=False, max_iter=20000).fit(x, labels))
    return [*_compiled_in(code), "-DM2CGEN"]


def _compiled_in(header: str) -> list[str]:
    path = BUILD / "machine.h"
    path.write_text(header, encoding="utf-8")
    return [str(SOURCES / "svm_compiled.c"), f'-DMACHINE_HEADER="{path}"']


def _all(task: Task) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Every object's own samples, and whose they are."""
    own = [signatures[labels > 0] for labels, signatures in task.sets]
    return np.concatenate(own), np.repeat(np.arange(len(own)), [len(one) for one in own])


ENTRANTS = (
    Entrant("bslam, learned on the robot", None, lambda: True, _on_robot, trains=True),
    Entrant(
        "LIBLINEAR",
        "apt-get install liblinear-dev",
        (INCLUDE / "linear.h").is_file,
        _liblinear,
        ("-llinear", "-lm"),
        trains=True,
    ),
    Entrant("bslam, header, float", None, lambda: True, lambda task: _header(task, small=False)),
    Entrant("bslam, header, bytes", None, lambda: True, lambda task: _header(task, small=True)),
    Entrant("m2cgen", "pip install m2cgen", lambda: importlib.util.find_spec("m2cgen") is not None, _m2cgen),
)
