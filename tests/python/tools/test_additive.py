"""Additive machines: fitted as scikit-learn would, decided in C as in Python."""

import ctypes
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.svm import LinearSVC

from bslam.cheader import Header
from bslam.modelfile import AdditiveSvm
from tools.training.additive import (
    DEVIATION_MIN,
    KNOTS,
    decide_additive,
    expand_tents,
    fit_additive,
    most_telling,
    place_knots,
)
from tools.training.compiled import compile_library
from tools.training.detector_samples import recoloured
from tools.training.front_end import open_library

CROSSED = np.array([0, 1, 4], np.uint8)
COST = 0.05


def samples(seed: int, count: int = 1500) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Features (count, 6), and two targets that no linear machine tells: a product, and a band."""
    x = np.random.default_rng(seed).normal(size=(count, 6)).astype(np.float32)
    return x, np.column_stack([x[:, 0] * x[:, 1] > 0.1, np.abs(x[:, 3]) < 0.6])


@pytest.fixture(scope="module")
def machine() -> AdditiveSvm:
    x, targets = samples(0)
    return fit_additive(x, targets, place_knots(x), CROSSED, COST, 200)


def test_fit_decides_as_linear_svc_on_the_expansion(machine: AdditiveSvm) -> None:
    x, targets = samples(0)
    phi = expand_tents(x, machine.knots, CROSSED).astype(np.float64)
    scaled = (phi - phi.mean(axis=0)) / np.maximum(phi.std(axis=0), DEVIATION_MIN)
    values = decide_additive(machine, x)
    for row in range(2):
        svc = LinearSVC(C=COST, dual=False, tol=1e-6, max_iter=10_000).fit(scaled, targets[:, row])
        wanted = svc.decision_function(scaled)
        assert np.abs(values[:, row] - wanted).max() < 0.1  # weights of 8 bits, a hundred steps of L-BFGS
        assert np.mean((values[:, row] > 0) == (wanted > 0)) > 0.995


def test_a_band_and_a_product_are_told(machine: AdditiveSvm) -> None:
    x, targets = samples(1)
    right = ((decide_additive(machine, x) > 0) == targets).mean(axis=0)
    assert right[0] > 0.9
    assert right[1] > 0.9


def test_c_decides_as_python(machine: AdditiveSvm) -> None:
    library = open_library()
    keep: list[object] = []
    made = library.ffi.new("bslam_additive_t *", library.additive(machine, keep))
    assert library.lib.bslam_additive_check(made, machine.features) == library.lib.BSLAM_OK
    x = 1.5 * samples(2, 400)[0]
    wanted = decide_additive(machine, x)
    place = library.ffi.new("bslam_additive_place_t *")
    found = np.empty((len(x), machine.rows), np.float32)
    for sample, values in zip(x, found, strict=True):
        library.lib.bslam_additive_locate(made, library.floats(sample), place)
        library.lib.bslam_additive_decide(made, place, 0, machine.rows, library.floats(values))
    np.testing.assert_allclose(found, wanted, atol=1e-4)


def test_compiled_header_decides_as_python(machine: AdditiveSvm, tmp_path: Path) -> None:
    header = Header("MACHINE_H", ["vision/vision.h"], {})
    header.constant("bslam_additive_t", "machine", header.additive("kinds", machine))
    (tmp_path / "machine.h").write_text(header.text(), encoding="utf-8")
    library = compile_library(
        tmp_path,
        """#include "machine.h"
#include "vision/built_in/classifiers/additive.c"
void decide(const float *x, float *values);
void decide(const float *x, float *values)
{
    bslam_additive_place_t place;
    bslam_additive_locate(&machine, x, &place);
    bslam_additive_decide(&machine, &place, 0, machine.rows, values);
}
""",
    )
    x = samples(4, 200)[0]
    found = np.empty((len(x), machine.rows), np.float32)
    for sample, values in zip(x, found, strict=True):
        library.decide(ctypes.c_void_p(sample.ctypes.data), ctypes.c_void_p(values.ctypes.data))
    np.testing.assert_allclose(found, decide_additive(machine, x), atol=1e-4)


def test_knots_rise_even_where_a_feature_is_constant_or_has_two_values() -> None:
    x = np.zeros((50, 2))
    x[30:, 1] = 1.0
    knots = place_knots(x)
    assert knots.shape == (2, KNOTS)
    assert (np.diff(knots, axis=1) > 0).all()


def test_most_telling_features_are_those_that_decide(machine: AdditiveSvm) -> None:
    x, targets = samples(3)
    single = fit_additive(x, targets, place_knots(x), np.zeros(0, np.uint8), COST, 100)
    assert 3 in most_telling(single, x, 1)


def test_other_colours_are_the_same_for_a_seed_and_keep_the_order_of_light() -> None:
    grey = np.arange(32, dtype=np.uint16)
    ramp = (grey << 11 | grey << 6 | grey).reshape(4, 8)
    seen = [recoloured(ramp, seed) for seed in range(12)]
    assert np.array_equal(seen[3], recoloured(ramp, 3))
    assert len({one.tobytes() for one in seen}) > 6
    for one in seen:
        for channel in (one >> 11, one >> 5 & 63, one & 31):
            assert (np.diff(channel.ravel().astype(int)) >= 0).all()


def test_other_colours_exchange_channels() -> None:
    red = np.full((2, 2), 31 << 11, np.uint16)
    assert {int(recoloured(red, seed)[0, 0]) for seed in range(60)} == {31 << 11, 63 << 5, 31}
