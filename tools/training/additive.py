"""Additive machines (firmware/vision/built_in/classifiers/additive.h): expansion into tents, fit, bytes.

The objective is that of scikit-learn's LinearSVC(dual=False) on the scaled expansion: |w|²/2 + C x the sum of
squared hinge losses, the bias among the weights.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bslam.modelfile import AdditiveSvm
from tools.training.together import minimise

KNOTS = 9  # as BSLAM_KNOTS
GRID_KNOTS = (0, 3, 5, 8)
SHARE_ONE = 1 << 15  # as BSLAM_SHARE_ONE
KNOT_SHARES = np.linspace(0.01, 0.99, KNOTS)
KNOT_GAP = 1e-3
DEVIATION_MIN = 0.1
"""Of a tent: those that few samples reach are not blown up, so that they get little weight."""
PART = 20_000

Features = NDArray[np.floating]
Places = tuple[NDArray[np.int64], NDArray[np.float32]]


def place_knots(x: Features) -> NDArray[np.float32]:
    """Knots (features, KNOTS) at quantiles of samples (n, features), rising by KNOT_GAP at least."""
    knots = np.quantile(x, KNOT_SHARES, axis=0).T
    steps = np.arange(KNOTS) * KNOT_GAP
    return (np.maximum.accumulate(knots - steps, axis=1) + steps).astype(np.float32)


def locate(x: NDArray[np.floating], knots: NDArray[np.float32]) -> Places:
    """The lower knot of values (n,) and the share of the way to the next, in whole steps as in C."""
    knot = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
    share = (x - knots[knot]) / (knots[knot + 1] - knots[knot])
    steps = np.floor(np.clip(share, 0.0, 1.0).astype(np.float32) * SHARE_ONE + 0.5)
    return knot, (steps / SHARE_ONE).astype(np.float32)


def tents(places: Places, count: int) -> NDArray[np.float32]:
    """(n, count): how much each knot counts."""
    knot, share = places
    out = np.zeros((len(knot), count), np.float32)
    rows = np.arange(len(knot))
    out[rows, knot] = 1.0 - share
    out[rows, knot + 1] = share
    return out


def expand_tents(x: Features, knots: NDArray[np.float32], crossed: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Tents of samples (n, features), then the products of crossed pairs' coarse tents: (n, weights)."""
    single = [tents(locate(x[:, i], knots[i]), KNOTS) for i in range(len(knots))]
    coarse = [tents(_locate_coarse(x, knots, i), len(GRID_KNOTS)) for i in crossed.tolist()]
    grids = [(a[:, :, None] * b[:, None, :]).reshape(len(x), -1) for a, b in combinations(coarse, 2)]
    return np.hstack(single + grids)


def _locate_coarse(x: Features, knots: NDArray[np.float32], feature: int) -> Places:
    return locate(x[:, feature], knots[feature, list(GRID_KNOTS)])


def fit_additive(
    x: Features,
    targets: NDArray[np.bool_],
    knots: NDArray[np.float32],
    crossed: NDArray[np.uint8],
    cost: float,
    iterations: int,
) -> AdditiveSvm:
    """One machine, a row a column of `targets` (samples, rows), on samples (n, features); int8 weights."""
    phi = np.empty((len(x), weights_of(len(knots), len(crossed)) + 1), np.float32)
    for start in range(0, len(x), PART):
        phi[start : start + PART, :-1] = expand_tents(x[start : start + PART], knots, crossed)
    phi[:, -1] = 1.0
    mean = phi[:, :-1].mean(axis=0, dtype=np.float64)
    square = np.einsum("ij,ij->j", phi[:, :-1], phi[:, :-1]) / len(phi)
    scale = np.maximum(np.sqrt(np.maximum(square - mean**2, 0.0)), DEVIATION_MIN)
    phi[:, :-1] -= mean.astype(np.float32)
    phi[:, :-1] /= scale.astype(np.float32)
    solution = minimise(phi, targets, cost, iterations)
    weights = solution[:-1].T / scale
    byte_scale = np.maximum(np.abs(weights).max(axis=1), 1e-6) / 127.0
    return AdditiveSvm(
        knots,
        crossed,
        np.rint(weights / byte_scale[:, None]).astype(np.int8),
        byte_scale.astype(np.float32),
        (solution[-1] - weights @ mean).astype(np.float32),
    )


def decide_additive(machine: AdditiveSvm, x: Features) -> NDArray[np.float32]:
    """Decision values (n, rows)."""
    weights = machine.weights.astype(np.float32) * machine.byte_scale[:, None]
    out = np.empty((len(x), machine.rows), np.float32)
    for start in range(0, len(x), PART):
        phi = expand_tents(x[start : start + PART], machine.knots, machine.crossed)
        out[start : start + PART] = phi @ weights.T + machine.bias
    return out


def most_telling(machine: AdditiveSvm, x: Features, count: int) -> NDArray[np.uint8]:
    """The features whose curves move the decision values of samples (n, features) most."""
    moved = np.zeros(machine.features)
    for i in range(machine.features):
        bytes_of = machine.weights[:, i * KNOTS : (i + 1) * KNOTS].astype(np.float32)
        curves = tents(locate(x[:, i], machine.knots[i]), KNOTS) @ bytes_of.T
        values = curves * machine.byte_scale
        moved[i] = np.abs(values - values.mean(axis=0)).mean()
    return np.sort(np.argsort(-moved, kind="stable")[:count]).astype(np.uint8)


def weights_of(features: int, crossed: int) -> int:
    """As BSLAM_ADDITIVE_WEIGHTS."""
    return features * KNOTS + crossed * (crossed - 1) // 2 * len(GRID_KNOTS) ** 2
