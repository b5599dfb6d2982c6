"""Linear and quadratic support vector machines fitted by scikit-learn, in the form that the C core takes.

A quadratic machine is a linear one on the features and their products in pairs (`expand`, in the order of
firmware/vision/built_in/classifiers/svm.h). Features are standardised for the fit; offset and scale are
folded into the weights, so the C core needs neither. Quadratic weights that shall become bytes want features
of about unit range to begin with: one byte scale serves a row.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import average_precision_score
from sklearn.model_selection import LeaveOneGroupOut, StratifiedGroupKFold
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import LinearSVC

from bslam.errors import BslamError
from bslam.modelfile import Svm

COSTS = (0.01, 0.1, 1.0, 10.0)
"""Values of the SVM's C that cross-validation chooses from."""

FOLDS = 5

Matrix = NDArray[np.floating]
Score = Callable[[NDArray[np.bool_], Matrix], float]


@dataclass(frozen=True)
class Machine:
    """Fitted machines, a row each: scikit-learn's own, and the same as the C core takes them."""

    pipelines: tuple[Pipeline, ...]
    svm: Svm
    cost: float

    def decide(self, x: Matrix) -> Matrix:
        """scikit-learn's decision values, (samples, rows) float64."""
        phi = expand(x, self.svm.quadratic)
        return np.stack([pipeline.decision_function(phi) for pipeline in self.pipelines], axis=1)


def expand(x: Matrix, quadratic: bool) -> Matrix:
    """x (samples, n), followed if quadratic by x_i x_j for i <= j: row by row of the upper triangle."""
    x = np.asarray(x, dtype=np.float64)
    if not quadratic:
        return x
    first, second = np.triu_indices(x.shape[1])
    return np.hstack([x, x[:, first] * x[:, second]])


def one_vs_rest(labels: Sequence[int] | NDArray[np.integer], classes: int) -> NDArray[np.bool_]:
    """Targets (samples, classes) of labels 0 to classes - 1; any other label belongs to none of them."""
    return np.asarray(labels)[:, None] == np.arange(classes)[None, :]


def mean_average_precision(targets: NDArray[np.bool_], values: Matrix) -> float:
    """Mean over the rows that have both kinds of sample; what cross-validation maximises."""
    mixed = [row for row in range(targets.shape[1]) if 0 < targets[:, row].sum() < len(targets)]
    return float(np.mean([average_precision_score(targets[:, row], values[:, row]) for row in mixed]))


def fit(
    x: Matrix, targets: NDArray[np.bool_], cost: float, quadratic: bool = False, balanced: bool = False
) -> Machine:
    """One machine a column of `targets` (samples, rows), on x (samples, features).

    `balanced` weighs the two sides of each row alike, however many samples they have. Raises BslamError if a
    row has samples of one side only, or a feature is not finite.
    """
    _check(x, targets)
    phi = expand(x, quadratic)
    scaler = StandardScaler()
    scaled = scaler.fit_transform(phi)
    machines = [
        LinearSVC(
            C=cost,
            dual=False,  # no random order of samples: the same weights each time
            max_iter=20000,
            class_weight="balanced" if balanced else None,
        ).fit(scaled, column)
        for column in targets.T
    ]
    weights = np.stack([machine.coef_[0] / scaler.scale_ for machine in machines])
    bias = np.array([machine.intercept_[0] for machine in machines]) - weights @ scaler.mean_
    svm = Svm(x.shape[1], quadratic, weights.astype(np.float32), bias.astype(np.float32))
    return Machine(tuple(make_pipeline(scaler, machine) for machine in machines), svm, cost)


def choose_cost(
    x: Matrix,
    targets: NDArray[np.bool_],
    quadratic: bool = False,
    balanced: bool = False,
    groups: NDArray[np.integer] | None = None,
    costs: Sequence[float] = COSTS,
    score: Score = mean_average_precision,
) -> tuple[float, Matrix]:
    """The cost of best score, and the decision values (samples, rows) that it gives samples left out.

    Samples of one group (frames of one world, boxes of one picture) are left out together.
    """
    trials = {cost: held_out_values(x, targets, cost, quadratic, balanced, groups) for cost in sorted(costs)}
    # Of equals the one nearest to 1: an extreme one wants a reason.
    best = max(trials, key=lambda cost: (score(targets, trials[cost]), -abs(math.log(cost))))
    return best, trials[best]


def held_out_values(
    x: Matrix,
    targets: NDArray[np.bool_],
    cost: float,
    quadratic: bool = False,
    balanced: bool = False,
    groups: NDArray[np.integer] | None = None,
) -> Matrix:
    """Decision values (samples, rows), each by machines fitted without the sample's fold."""
    values = np.empty(targets.shape)
    for train, test in _folds(targets, groups):
        machine = fit(x[train], targets[train], cost, quadratic, balanced)
        values[test] = machine.decide(x[test])
    return values


def quantised(svm: Svm) -> Svm:
    """The machine with 8-bit weights: byte * scale, a scale a row, the largest weight at 127."""
    scale = np.abs(svm.weights).max(axis=1).astype(np.float32) / np.float32(127)
    divisor = np.where(scale > 0, scale, np.float32(1))
    weights = np.rint(svm.weights / divisor[:, None]).astype(np.int8)
    return Svm(svm.features, svm.quadratic, weights, svm.bias, scale)


def _folds(
    targets: NDArray[np.bool_], groups: NDArray[np.integer] | None
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Five, each with its share of every kind of sample (of every combination of targets).

    Where a kind is in fewer groups than that, each group in turn: what is left then still has every kind.
    """
    kinds = np.unique(targets, axis=0, return_inverse=True)[1]
    groups = np.arange(len(targets)) if groups is None else groups
    # Samples of no class may be missing in a fold.
    wanted = [kind for kind in range(kinds.max() + 1) if targets[kinds == kind][0].any()]
    occurrences = [len(np.unique(groups[kinds == kind])) for kind in wanted]
    if min(occurrences) < 2:
        rows = np.flatnonzero(targets[kinds == wanted[int(np.argmin(occurrences))]][0]).tolist()
        raise BslamError(
            f"samples of classes {rows} are all in one group; allowed: at least two groups of each"
        )
    if min(occurrences) < FOLDS:
        return LeaveOneGroupOut().split(targets, kinds, groups)
    return StratifiedGroupKFold(FOLDS, shuffle=True, random_state=0).split(targets, kinds, groups)


def _check(x: Matrix, targets: NDArray[np.bool_]) -> None:
    if not np.isfinite(x).all():
        row, column = np.argwhere(~np.isfinite(x))[0]
        raise BslamError(
            f"training sample {row}, feature {column}: {x[row, column]}; allowed: finite numbers"
        )
    counts = targets.sum(axis=0)
    for row, count in enumerate(counts):
        if not 0 < count < len(targets):
            allowed = "at least one that belongs and one that does not"
            raise BslamError(
                f"class {row}: {count} of {len(targets)} samples belong to it; allowed: {allowed}"
            )
