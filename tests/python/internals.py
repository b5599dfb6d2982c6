"""Machines that learn on the robot, and their solver, as classes over the C library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.raw import Library, library
from bslam.errors import BslamError

Floats = NDArray[np.float32]

SIGNATURE_SIZE = 71
"""Values of a signature."""

_SEEDS = Path(__file__).with_name("seeds.npy")  # tools/training/make_seeds.py writes it
_SEED_STEPS = 127  # of 1, as firmware/bslam/appearance/sample.h stores them


class Learner:
    """A machine a beacon, which tells it from the others by its signature: one instance of the C learner.

    seeds: (n, 71) signatures of things that are no beacon here. machines: how many it must hold. real:
    "float", samples of 8 bits as on the target, or "double", float32 samples. Raises BslamError for another
    shape of seeds, CoreError if they are too many or not finite.
    """

    def __init__(self, seeds: Floats | None = None, *, machines: int = 20, real: str = "float") -> None:
        self._raw = library(real, machines)
        self._lib, self._ffi = self._raw.lib, self._raw.ffi
        self._learner = self._ffi.new("bslam_learner_t *")
        self._seeds = encode(self._raw, np.empty((0, SIGNATURE_SIZE), np.float32) if seeds is None else seeds)
        status = self._lib.bslam_learner_init(self._learner, self._seeds, len(self._seeds))
        self._raw.ensure(status, f"{len(self._seeds)} seeds")

    def add(self) -> int:
        """A new machine's handle. Raises CoreError if there is no room."""
        machine = self._ffi.new("int32_t *")
        self._raw.ensure(self._lib.bslam_learner_add(self._learner, machine), "another machine")
        return machine[0]

    def remove(self, machine: int) -> None:
        """Forgets a machine. Raises CoreError if there is none."""
        self._raw.ensure(self._lib.bslam_learner_remove(self._learner, machine), f"machine {machine}")

    def show(self, machine: int, signature: Floats) -> None:
        """Gives a machine a signature (71,) of its beacon to learn from.

        Raises CoreError if there is no such machine or the signature is not finite, BslamError for another
        shape.
        """
        if np.shape(signature) != (SIGNATURE_SIZE,):
            raise BslamError(f"signature of shape {np.shape(signature)}; allowed: ({SIGNATURE_SIZE},)")
        values = np.ascontiguousarray(signature, np.float32)
        status = self._lib.bslam_learner_show(self._learner, machine, _floats(self._ffi, values))
        self._raw.ensure(status, f"a signature for machine {machine}")

    def work(self, budget: int) -> bool:
        """At most `budget` pieces of training; True if work is left."""
        return self._lib.bslam_learner_work(self._learner, budget)

    def train(self) -> None:
        """Works until nothing is left to do."""
        while self.work(1000):
            pass

    def decide(self, machines: list[int], signatures: Floats) -> Floats:
        """Decision values (signatures, machines) of signatures (n, 71).

        Raises CoreError if there is no such machine or a signature is not finite, BslamError for another
        shape.
        """
        samples = encode(self._raw, signatures)
        values = np.empty((len(samples), len(machines)), np.float32)
        value = self._ffi.new("float *")
        for column, machine in enumerate(machines):
            for row in range(len(samples)):
                status = self._lib.bslam_learner_decide(self._learner, machine, samples + row, value)
                self._raw.ensure(status, f"machine {machine}")
                values[row, column] = value[0]
        return values

    def samples(self, machine: int) -> int:
        """How many samples a machine keeps; 0 if there is no such machine."""
        return self._lib.bslam_learner_samples(self._learner, machine)

    @property
    def counters(self) -> dict[str, int]:
        """What happened so far, by the C counters' names."""
        return self._raw.fields(self._learner.counters, "bslam_learner_counters_t")


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
        raw = library(real, 1)
        rows_max = len(raw.ffi.new("bslam_solver_t *").rows)
        if np.shape(positive) != (len(signatures),) or len(signatures) > rows_max:
            sizes = f"{len(signatures)} signatures with labels of shape {np.shape(positive)}"
            raise BslamError(f"{sizes}; allowed: up to {rows_max}, a label each")
        stored = encode(raw, signatures)
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


def encode(raw: Library, signatures: Floats) -> Any:
    """Signatures (n, 71) as a C array of samples.

    Raises BslamError for another shape, CoreError for one that is not finite.
    """
    if np.ndim(signatures) != 2 or np.shape(signatures)[1] != SIGNATURE_SIZE:
        raise BslamError(f"signatures of shape {np.shape(signatures)}; allowed: (n, {SIGNATURE_SIZE})")
    values = np.ascontiguousarray(signatures, np.float32)
    samples = raw.ffi.new("bslam_sample_t[]", len(values))
    for row in range(len(values)):
        status = raw.lib.bslam_sample_encode(_floats(raw.ffi, values[row]), samples + row)
        raw.ensure(status, f"signature {row}")
    return samples


def _floats(ffi: Any, values: Floats) -> Any:
    """The numbers of a C-contiguous array, good as long as it is."""
    return ffi.from_buffer("float[]", values)


def rendered_seeds() -> Floats:
    """Signatures (n, 71) of rendered beacons that are nobody's: what a robot with cameras starts from."""
    return np.load(_SEEDS).astype(np.float32) / np.float32(_SEED_STEPS)
