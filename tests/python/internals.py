"""The firmware's insides for tests: extensions from headers that are not the product's, in build/internals.

That of the estimator has the sizes of the product's own (`bslam.core.build`), so it reads what stands in a
`Slam`.
"""

from __future__ import annotations

import fcntl
import importlib.util
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core import CoreError, Slam
from bslam.core.appearance import SIGNATURE_SIZE, encode
from bslam.core.builds import SIZE_CLASSES
from bslam.errors import BslamError
from bslam_build import FIRMWARE_DIR, SOURCES, Extension, build, estimator, macros_of

Floats = NDArray[np.float32]
HEADER = "bslam/internal.h"
FOLDER = Path(__file__).resolve().parents[2] / "build" / "internals"


@cache
def internals(real: str, beacons_max: int) -> Any:
    """The estimator's insides: a module with `ffi` and `lib`, the smallest build of so many beacons."""
    size = next(one for one in SIZE_CLASSES if one >= beacons_max)
    return _loaded(estimator(f"_internals_{real}_{size}", real, size, HEADER, declares=""))


@cache
def link_library() -> Any:
    """The link's parser, as a module with `ffi` and `lib`."""
    macros = macros_of("float", SIZE_CLASSES[0])
    return _loaded(Extension("_link", FIRMWARE_DIR, SOURCES["link"], "link/parser.h", macros=macros))


def _loaded(extension: Extension) -> Any:
    """Its module; built where it is not there, or older than its sources."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    name = extension.name
    with (FOLDER / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another process of these tests may be at it
        path = build(extension, FOLDER)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def module_of(slam: Slam) -> Any:
    """The one that reads an instance."""
    return internals(slam._raw.real, slam._raw.beacons_max)


def inside(slam: Slam) -> Any:
    """What stands in it, as bslam_instance_t *."""
    ffi = module_of(slam).ffi
    address = int(slam._ffi.cast("uintptr_t", slam._robot))
    return ffi.cast("bslam_instance_t *", address)


def _ensure(module: Any, status: int, message: str) -> None:
    """Raises CoreError unless status is BSLAM_OK."""
    if status != module.lib.BSLAM_OK:
        raise CoreError(module.ffi.string(module.lib.bslam_status_name(status)).decode(), message)


def _samples(module: Any, signatures: Floats, real: str) -> Any:
    """Signatures (n, 71) as a C array."""
    encoded = encode(signatures, real)
    array = module.ffi.new("bslam_sample_t[]", len(encoded))
    module.ffi.buffer(array)[:] = encoded.tobytes()
    return array


class Learner:
    """A classifier a beacon, which tells it from the others by its signature: one C learner.

    seeds: (n, 71) signatures of things that are no beacon here. classifiers: how many it must hold. real:
    "float", samples of 8 bits as on the target, or "double", float32 samples. Raises BslamError for another
    shape of seeds, CoreError if they are too many or not finite.
    """

    def __init__(self, seeds: Floats | None = None, *, classifiers: int = 20, real: str = "float") -> None:
        self._real, self._module = real, internals(real, classifiers)
        self._lib, self._ffi = self._module.lib, self._module.ffi
        self._learner = self._ffi.new("bslam_learner_t *")
        nothing = np.empty((0, SIGNATURE_SIZE), np.float32)
        self._seeds = _samples(self._module, nothing if seeds is None else seeds, real)
        status = self._lib.bslam_learner_init(self._learner, self._seeds, len(self._seeds))
        self._ensure(status, f"{len(self._seeds)} seeds")

    def _ensure(self, status: int, message: str) -> None:
        _ensure(self._module, status, message)

    def add(self) -> int:
        """A new classifier's handle. Raises CoreError if there is no room."""
        classifier = self._ffi.new("int32_t *")
        self._ensure(self._lib.bslam_learner_add(self._learner, classifier), "another classifier")
        return classifier[0]

    def remove(self, classifier: int) -> None:
        """Forgets a classifier. Raises CoreError if there is none."""
        self._ensure(self._lib.bslam_learner_remove(self._learner, classifier), f"classifier {classifier}")

    def show(self, classifier: int, signature: Floats) -> None:
        """Gives a classifier a signature (71,) of its beacon to learn from.

        Raises CoreError if there is no such classifier or the signature is not finite, BslamError for another
        shape.
        """
        if np.shape(signature) != (SIGNATURE_SIZE,):
            raise BslamError(f"signature of shape {np.shape(signature)}; allowed: ({SIGNATURE_SIZE},)")
        values = np.ascontiguousarray(signature, np.float32)
        status = self._lib.bslam_learner_show(
            self._learner, classifier, self._ffi.from_buffer("float[]", values)
        )
        self._ensure(status, f"a signature for classifier {classifier}")

    def work(self, budget: int) -> bool:
        """At most `budget` pieces of training; True if work is left."""
        return self._lib.bslam_learner_work(self._learner, budget)

    def train(self) -> None:
        """Works until nothing is left to do."""
        while self.work(1000):
            pass

    def decide(self, classifiers: list[int], signatures: Floats) -> Floats:
        """Decision values (signatures, classifiers) of signatures (n, 71)."""
        samples = _samples(self._module, signatures, self._real)
        values = np.empty((len(samples), len(classifiers)), np.float32)
        for column, classifier in enumerate(classifiers):
            weights = self._ffi.addressof(self._learner.classifiers[classifier], "weights")
            for row in range(len(samples)):
                values[row, column] = self._lib.bslam_sample_decide(weights, samples + row)
        return values

    def samples(self, classifier: int) -> int:
        """How many samples a classifier keeps; 0 if there is no such classifier."""
        return self._lib.bslam_learner_samples(self._learner, classifier)

    @property
    def counters(self) -> dict[str, int]:
        """What happened so far, by the C counters' names."""
        counters = self._learner.counters
        return {name: getattr(counters, name) for name, _ in self._ffi.typeof(counters).fields}


class Solution:
    """What the C solver makes of one set.

    features (n, 72): the samples as it sees them, rounded, with the constant 1. weights (72,): the last is
    the bias. alphas (n,): the dual variables. steps: how many it took.
    """

    def __init__(
        self,
        signatures: Floats,
        positive: NDArray[np.bool_],
        *,
        cost: float,
        tolerance: float,
        steps_max: int = 10_000_000,
        real: str = "float",
    ) -> None:
        """Solves for signatures (n, 71), of which `positive` (n,) are the beacon's own.

        Raises BslamError for other shapes, or for more samples than the solver holds; CoreError for a
        signature that is not finite.
        """
        raw = internals(real, 1)
        rows_max = len(raw.ffi.new("bslam_solver_t *").rows)
        if np.shape(positive) != (len(signatures),) or len(signatures) > rows_max:
            sizes = f"{len(signatures)} signatures with labels of shape {np.shape(positive)}"
            raise BslamError(f"{sizes}; allowed: up to {rows_max}, a label each")
        stored = _samples(raw, signatures, real)
        samples = raw.ffi.new("bslam_samples_t *", {"own": stored, "own_count": len(stored)})
        solver = raw.ffi.new("bslam_solver_t *")
        raw.lib.bslam_solver_begin(solver, cost, tolerance, True)
        for row, is_positive in enumerate(positive.tolist()):
            raw.lib.bslam_solver_add(solver, samples, row, is_positive, 0.0)
        self.steps: int = raw.lib.bslam_solver_run(solver, samples, steps_max)
        unit = 1.0 if real == "double" else 1.0 / 127.0
        used = SIGNATURE_SIZE + 1
        self.features = unit * np.array([list(one.q)[:used] for one in stored])
        self.weights = np.array(list(solver.weights)[:used]) / unit
        self.alphas = np.array([solver.rows[row].alpha for row in range(len(stored))])
