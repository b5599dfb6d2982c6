"""Hinged machines (firmware/vision/built_in/classifiers/hinged.h): their expansion, their fit, their bytes.

The objective is that of scikit-learn's LinearSVC(dual=False) on the scaled expansion: |w|²/2 + C x the sum of
squared hinge losses, the bias among the weights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bslam.modelfile import HingedSvm
from tools.training.together import minimise

DEVIATION_MIN = 4.0
"""Of a byte: what hardly ever changes is not blown up."""
PART = 20_000


def expand_hinges(x: NDArray[np.uint8], knots: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Bytes (n, features), and by how much they exceed their knots: (n, 2 features), in turn."""
    out = np.empty((len(x), len(knots), 2), np.float32)
    out[:, :, 0] = x
    np.maximum(out[:, :, 0] - knots.astype(np.float32), 0.0, out=out[:, :, 1])
    return out.reshape(len(x), -1)


def fit_hinged(x: NDArray[np.uint8], targets: NDArray[np.bool_], cost: float, iterations: int) -> HingedSvm:
    """One machine, a row a column of `targets` (samples, rows), on samples (n, features); int8 weights. Knots
    are the medians."""
    knots = np.rint(np.median(x, axis=0)).astype(np.uint8)
    phi = np.ones((len(x), 2 * len(knots) + 1), np.float32)
    for start in range(0, len(x), PART):
        phi[start : start + PART, :-1] = expand_hinges(x[start : start + PART], knots)
    mean = phi[:, :-1].mean(axis=0, dtype=np.float64)
    square = np.einsum("ij,ij->j", phi[:, :-1], phi[:, :-1], dtype=np.float64) / len(phi)
    scale = np.maximum(np.sqrt(np.maximum(square - mean**2, 0.0)), DEVIATION_MIN)
    phi[:, :-1] -= mean.astype(np.float32)
    phi[:, :-1] /= scale.astype(np.float32)
    solution = minimise(phi, targets, cost, iterations)
    weights = solution[:-1].T / scale
    byte_scale = np.maximum(np.abs(weights).max(axis=1), 1e-9) / 127.0
    rounded = np.rint(weights / byte_scale[:, None])
    bias = solution[-1] - (rounded * byte_scale[:, None]) @ mean  # so that rounding shifts no mean
    return HingedSvm(
        knots,
        rounded.reshape(len(weights), -1, 2).astype(np.int8),
        byte_scale.astype(np.float32),
        bias.astype(np.float32),
    )


def decide_hinged(machine: HingedSvm, x: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Decision values (n, rows): the sums are whole numbers as in C."""
    weights = machine.weights.reshape(machine.rows, -1).astype(np.float64).T
    out = np.empty((len(x), machine.rows), np.float32)
    for start in range(0, len(x), PART):
        sums = expand_hinges(x[start : start + PART], machine.knots).astype(np.float64) @ weights
        out[start : start + PART] = machine.bias + machine.byte_scale * sums.astype(np.float32)
    return out
