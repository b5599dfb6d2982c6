"""Many quadratic machines on the same samples, fitted together.

The objective is that of scikit-learn's LinearSVC(dual=False) on standardised features: |w|²/2 + C x the sum
of squared hinge losses, the bias among the weights. LIBLINEAR takes one row at a time and keeps each feature
with its index in 16 bytes; with thousands of products of features that takes an hour where a matrix product
for all rows at once takes minutes. tests/python/tools/test_together.py holds the two against each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bslam.modelfile import Svm
from tools.training.fit import Matrix

DEVIATION_MIN = 1e-6


def expand_and_scale(x: Matrix) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.float64]]:
    """Features and their products (samples, weights + 1) in float32, standardised, a last column of 1; and
    the means and deviations that were taken out."""
    samples, features = x.shape
    first, second = np.triu_indices(features)
    phi = np.empty((samples, features + len(first) + 1), np.float32)
    phi[:, :features] = x
    for column, (i, k) in enumerate(zip(first.tolist(), second.tolist(), strict=True)):
        np.multiply(phi[:, i], phi[:, k], out=phi[:, features + column])
    mean = phi[:, :-1].mean(axis=0, dtype=np.float64)
    deviation = np.maximum(phi[:, :-1].std(axis=0, dtype=np.float64), DEVIATION_MIN)
    phi[:, :-1] -= mean.astype(np.float32)
    phi[:, :-1] /= deviation.astype(np.float32)
    phi[:, -1] = 1.0
    return phi, mean, deviation


def minimise(
    phi: NDArray[np.float32], targets: NDArray[np.bool_], cost: float, iterations: int
) -> NDArray[np.float64]:
    """The weights (columns of phi, rows of targets) of the least objective, by L-BFGS."""
    sign = np.where(targets, 1.0, -1.0).astype(np.float32)
    shape = (phi.shape[1], sign.shape[1])

    def loss_and_gradient(flat: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        weights = flat.reshape(shape)
        short = np.maximum(1.0 - sign * (phi @ weights.astype(np.float32)), 0.0)
        loss = 0.5 * float(flat @ flat) + cost * float(np.square(short).sum(dtype=np.float64))
        gradient = weights - 2.0 * cost * (phi.T @ (sign * short)).astype(np.float64)
        return loss, gradient.ravel()

    options = {"maxiter": iterations, "maxfun": 2 * iterations, "maxcor": 20}
    start = np.zeros(shape[0] * shape[1])
    found = minimize(loss_and_gradient, start, jac=True, method="L-BFGS-B", options=options)
    return np.asarray(found.x).reshape(shape)


def fit_together(x: Matrix, targets: NDArray[np.bool_], cost: float, iterations: int = 60) -> Svm:
    """One quadratic machine a column of `targets` (samples, rows), on x (samples, features).

    Ends after `iterations` steps of L-BFGS, before the minimum where there are thousands of weights.
    """
    phi, mean, deviation = expand_and_scale(x)
    solution = minimise(phi, targets, cost, iterations)
    weights = solution[:-1].T / deviation
    bias = solution[-1] - weights @ mean
    return Svm(x.shape[1], True, weights.astype(np.float32), bias.astype(np.float32))
