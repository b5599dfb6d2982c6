"""A linear SVM over cells, by scikit-learn."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError, pip_install

_COST: Final = 0.01
_UNIT: Final = 128.0  # of a cell's values


def linear_svc() -> Any:
    """The class that is fitted, of an extra that takes seconds to load. BslamError if it is missing."""
    try:
        from sklearn.svm import LinearSVC
    except ImportError:
        raise BslamError(f"training needs scikit-learn; allowed: {pip_install('scikit-learn')}") from None
    return LinearSVC


def fit_linear(
    examples: NDArray[np.uint8], negatives: NDArray[np.uint8]
) -> tuple[NDArray[np.float32], float]:
    """Weights (rows, columns, CHANNELS) for cells, and bias. BslamError if scikit-learn is missing."""
    both = np.concatenate([examples, negatives])
    x = both.reshape(len(both), -1).astype(np.float32) / _UNIT
    y = np.concatenate([np.ones(len(examples)), -np.ones(len(negatives))])
    mean = x.mean(axis=0)
    weight = max(1.0, len(negatives) / len(examples) / 3.0)
    machine = linear_svc()(C=_COST, class_weight={1: weight, -1: 1.0}, tol=1e-2, dual=False)
    weights = machine.fit(x - mean, y).coef_[0]
    bias = float(machine.intercept_[0] - weights @ mean)
    return (weights / _UNIT).reshape(examples.shape[1:]).astype(np.float32), bias


def quantised(weights: NDArray[np.float32], bias: float) -> tuple[NDArray[np.int8], int, float]:
    """Weights and bias as whole numbers, and what one of them stands for."""
    scale = float(np.float32(np.abs(weights).max() / 127.0))
    return np.rint(weights / scale).astype(np.int8), round(bias / scale), scale
