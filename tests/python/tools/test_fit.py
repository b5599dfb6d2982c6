"""tools/training/fit.py: machines as the C core takes them, cross-validation, weights of bytes."""

import numpy as np
import pytest
from numpy.typing import NDArray

from bslam.errors import BslamError
from tools.training import fit


def blobs(classes: int, samples: int, seed: int) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Clouds about points in five dimensions, of very different scales and offsets."""
    random = np.random.default_rng(seed)
    labels = random.integers(0, classes, samples)
    centres = 3.0 * random.standard_normal((classes, 5))
    x = centres[labels] + random.standard_normal((samples, 5))
    return (x * [1, 10, 0.1, 3, 100] + [0, 5, 1, -2, 300]).astype(np.float32), labels


def rings(samples: int, seed: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Points in a disc and round it: no line parts them, a circle does."""
    random = np.random.default_rng(seed)
    x = random.uniform(-1, 1, (samples, 2)).astype(np.float32)
    return x, (np.hypot(*x.T) < 0.7)[:, None]


def decide_by_definition(svm: fit.Svm, x: NDArray[np.float32]) -> NDArray[np.float64]:
    scale = 1.0 if svm.byte_scale is None else svm.byte_scale[:, None].astype(np.float64)
    return fit.expand(x, svm.quadratic) @ (svm.weights * scale).T + svm.bias


def test_expand_order_is_that_of_the_c_core() -> None:
    expanded = fit.expand(np.array([[2.0, 3.0, 5.0]]), quadratic=True)
    assert expanded.tolist() == [[2, 3, 5, 4, 6, 10, 9, 15, 25]]
    assert fit.expand(np.array([[2.0, 3.0]]), quadratic=False).tolist() == [[2, 3]]


@pytest.mark.parametrize("quadratic", [False, True])
def test_fit_folded_weights_decide_as_scikit_learn(quadratic: bool) -> None:
    x, labels = blobs(4, 300, seed=1)
    machine = fit.fit(x, fit.one_vs_rest(labels, 4), cost=1.0, quadratic=quadratic)
    wanted = machine.decide(x)
    magnitude = 1.0 + fit.expand(np.abs(x), quadratic) @ np.abs(machine.svm.weights).T
    assert np.all(np.abs(decide_by_definition(machine.svm, x) - wanted) <= 1e-6 * magnitude)
    assert np.mean(wanted.argmax(axis=1) == labels) > 0.95


def test_fit_quadratic_parts_what_no_line_does() -> None:
    x, inside = rings(600, seed=2)
    linear = fit.fit(x, inside, 10.0).decide(x)
    quadratic = fit.fit(x, inside, 10.0, quadratic=True).decide(x)
    assert np.mean((linear > 0) == inside) < 0.75
    assert np.mean((quadratic > 0) == inside) > 0.97


def test_fit_constant_feature_gets_no_weight() -> None:
    x, labels = blobs(2, 100, seed=3)
    x[:, 2] = 7.0
    machine = fit.fit(x, fit.one_vs_rest(labels, 1), cost=1.0)
    assert machine.svm.weights[0, 2] == 0.0


def test_fit_twice_gives_the_same_bits() -> None:
    x, labels = blobs(3, 200, seed=4)
    first, second = (fit.fit(x, fit.one_vs_rest(labels, 3), 1.0, quadratic=True).svm for _ in range(2))
    assert first.weights.tobytes() == second.weights.tobytes()
    assert first.bias.tobytes() == second.bias.tobytes()


@pytest.mark.parametrize(
    ("labels", "complaint"),
    [([0, 2, 0, 2], "class 1: 0 of 4 samples"), ([0, 0, 0, 0], "class 0: 4 of 4 samples")],
)
def test_fit_class_without_samples_is_refused(labels: list[int], complaint: str) -> None:
    x = np.arange(8.0).reshape(4, 2)
    with pytest.raises(BslamError, match=complaint):
        fit.fit(x, fit.one_vs_rest(labels, 2), 1.0)


def test_fit_feature_that_is_not_finite_is_refused() -> None:
    x, labels = blobs(2, 50, seed=5)
    x[7, 3] = np.nan
    with pytest.raises(BslamError, match="training sample 7, feature 3: nan"):
        fit.fit(x, fit.one_vs_rest(labels, 1), 1.0)


def test_choose_cost_leaves_groups_out_together() -> None:
    """Every sample of a group is one copy: seen in training, it would be known by heart."""
    random = np.random.default_rng(6)
    groups = np.repeat(np.arange(20), 10)
    x = random.standard_normal((20, 40))[groups] + 1e-3 * random.standard_normal((200, 40))
    labels = random.integers(0, 2, 20)[groups]  # nothing to learn
    targets = fit.one_vs_rest(labels, 1)
    apart = fit.choose_cost(x, targets)[1]
    together = fit.choose_cost(x, targets, groups=groups)[1]
    assert np.mean((apart > 0) == targets) > 0.95
    assert np.mean((together > 0) == targets) < 0.75


def test_choose_cost_class_in_one_group_only_is_refused() -> None:
    x, labels = blobs(2, 40, seed=7)
    groups = np.where(labels == 0, 0, np.arange(40) % 4 + 1)
    with pytest.raises(BslamError, match=r"classes \[0\] are all in one group"):
        fit.choose_cost(x, fit.one_vs_rest(labels, 2), groups=groups)


def test_choose_cost_samples_of_no_class_may_be_in_one_group() -> None:
    x, labels = blobs(3, 60, seed=10)
    groups = np.where(labels == 2, 0, np.arange(60) % 4)
    held_out = fit.choose_cost(x, fit.one_vs_rest(labels, 2), groups=groups)[1]
    known = labels < 2  # the others are all in the group that is left out
    assert np.mean((held_out > 0)[known] == fit.one_vs_rest(labels, 2)[known]) > 0.9


def test_quantised_weights_are_within_half_a_step() -> None:
    x, labels = blobs(3, 200, seed=9)
    svm = fit.fit(x, fit.one_vs_rest(labels, 3), 1.0).svm
    small = fit.quantised(svm)
    assert small.weights.dtype == np.int8 and small.byte_scale is not None
    error = np.abs(small.weights * small.byte_scale[:, None] - svm.weights)
    assert np.all(error <= 0.5001 * small.byte_scale[:, None])
    assert np.all(np.abs(small.weights).max(axis=1) == 127)
