"""The learner from Python: its solver against scikit-learn's, and what it refuses."""

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.svm import LinearSVC

from bslam.core import CoreError
from bslam.core.appearance import SIGNATURE_SIZE, encode, rendered_seeds
from bslam.errors import BslamError
from internals import Learner, Solution, internals

REALS = pytest.mark.parametrize("real", ["float", "double"])
COST = 10.0
OWN, NEGATIVES = 16, 96


def signatures(random: np.random.Generator, count: int, objects: int) -> NDArray[np.float32]:
    """Roots of colour histograms of `objects` things, views of each in turn."""
    looks = random.dirichlet(np.full(SIGNATURE_SIZE, 0.15), objects)
    views = [random.dirichlet(40.0 * looks[i % objects] + 0.02) for i in range(count)]
    return np.sqrt(views).astype(np.float32)


def a_set(seed: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """One machine's own samples, and those of 12 others."""
    random = np.random.default_rng(seed)
    return signatures(random, 13 * OWN, 13)[: OWN + NEGATIVES], np.arange(OWN + NEGATIVES) % 13 == 0


@REALS
@pytest.mark.parametrize("seed", range(5))
def test_solver_weights_are_those_of_linear_svc(seed: int, real: str) -> None:
    samples, positive = a_set(seed)
    ours = Solution(samples, positive, cost=COST, tolerance=1e-4, real=real)
    theirs = LinearSVC(C=COST, loss="squared_hinge", dual=True, tol=1e-9, max_iter=10_000_000, random_state=0)
    theirs.fit(ours.features[:, :-1], positive)
    weights = np.append(theirs.coef_[0], theirs.intercept_)
    assert np.linalg.norm(ours.weights - weights) <= 1e-4 * np.linalg.norm(weights)
    assert np.array_equal(np.sign(ours.features @ ours.weights), np.sign(ours.features @ weights))


@REALS
def test_solver_looser_tolerance_takes_fewer_steps(real: str) -> None:
    samples, positive = a_set(0)
    steps = [Solution(samples, positive, cost=COST, tolerance=t, real=real).steps for t in (1.0, 1e-2, 1e-4)]
    assert steps == sorted(set(steps))


@REALS
def test_learner_tells_objects_apart(real: str) -> None:
    random = np.random.default_rng(1)
    views = signatures(random, 12 * 10, 12)
    learner = Learner(signatures(random, 20, 20), classifiers=12, real=real)
    machines = [learner.add() for _ in range(12)]
    for i in range(6 * 12):
        learner.show(machines[i % 12], views[i])
        learner.train()
    values = learner.decide(machines, views[6 * 12 :])
    assert np.array_equal(values.argmax(axis=1), np.arange(4 * 12) % 12)
    assert learner.samples(machines[0]) == 6
    assert learner.counters["kept"] == 6 * 12


def test_solver_8_bits_decide_as_float32_does() -> None:
    samples, positive = a_set(3)
    solutions = [Solution(samples, positive, cost=COST, tolerance=1e-4, real=r) for r in ("float", "double")]
    rounded, exact = (one.features @ one.weights for one in solutions)
    # Half a step, 0.004, in each of 71 features at random against weights of length |w|: 2.3e-3 |w|.
    assert np.abs(rounded - exact).max() < 4 * 2.3e-3 * np.linalg.norm(solutions[1].weights)


@pytest.mark.parametrize("shape", [(70,), (72,), (1, 71), ()])
def test_signature_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    learner = Learner()
    machine = learner.add()
    with pytest.raises(BslamError, match=r"shape .*; allowed: \(71,\)"):
        learner.show(machine, np.zeros(shape, np.float32))
    with pytest.raises(BslamError, match=r"shape .*; allowed: \(n, 71\)"):
        learner.decide([machine], np.zeros((*shape, 2), np.float32))


def test_signature_with_nan_is_refused_and_counted() -> None:
    learner = Learner()
    machine = learner.add()
    signature = np.zeros(SIGNATURE_SIZE, np.float32)
    signature[5] = np.nan
    with pytest.raises(CoreError, match="BSLAM_E_NOT_FINITE"):
        learner.show(machine, signature)
    assert learner.counters["refused_not_finite"] == 1
    assert learner.samples(machine) == 0


def test_wrong_handle_and_full_learner_are_refused() -> None:
    learner = Learner()
    with pytest.raises(CoreError, match="BSLAM_E_NO_BEACON"):
        learner.remove(0)
    handles = [learner.add() for _ in range(20)]
    assert handles == list(range(20))
    with pytest.raises(CoreError, match="BSLAM_E_MAP_FULL"):
        learner.add()


def test_too_many_seeds_are_refused() -> None:
    with pytest.raises(CoreError, match=r"129 seeds.*BSLAM_E_COUNT"):
        Learner(np.zeros((129, SIGNATURE_SIZE), np.float32))


def test_solver_more_samples_than_it_holds_are_refused() -> None:
    samples = np.zeros((OWN + NEGATIVES + 1, SIGNATURE_SIZE), np.float32)
    with pytest.raises(BslamError, match=r"113 signatures.*allowed: up to 112"):
        Solution(samples, np.zeros(len(samples), np.bool_), cost=COST, tolerance=0.1)


def test_rendered_seeds_all_differ():
    seeds = rendered_seeds()
    assert seeds.shape == (64, SIGNATURE_SIZE) and np.abs(seeds).max() <= 1.0
    assert len(np.unique(seeds, axis=0)) == 64


@REALS
def test_encode_gives_the_samples_of_the_c_library_to_the_bit(real: str) -> None:
    values = np.random.default_rng(4).uniform(-1.5, 1.5, (50, SIGNATURE_SIZE)).astype(np.float32)
    values[0] = np.float32(0.5) / np.float32(127)
    values[1, :6] = [0.0, -0.0, 1.0, -1.0, 1e12, -1e12]
    module = internals(real, 1)
    samples = module.ffi.new("bslam_sample_t[]", len(values))
    for row, sample in zip(values, samples, strict=True):
        status = module.lib.bslam_sample_encode(
            module.ffi.from_buffer("float[]", row), module.ffi.addressof(sample)
        )
        assert status == module.lib.BSLAM_OK
    assert encode(values, real).tobytes() == bytes(module.ffi.buffer(samples))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1.1e12])
def test_encode_refuses_what_is_no_number(value: float) -> None:
    values = np.zeros((3, SIGNATURE_SIZE), np.float32)
    values[1, 4] = value
    with pytest.raises(BslamError, match="signature 1 has a value that is no number"):
        encode(values)
