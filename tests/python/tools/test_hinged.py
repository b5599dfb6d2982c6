"""Hinged machines and the closer look: fitted as scikit-learn would, decided in C as in Python, the same both
ways round."""

import ctypes
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.svm import LinearSVC

from bslam.cheader import Header
from bslam.modelfile import HingedSvm
from tools.training.closer import mirrored
from tools.training.compiled import compile_library
from tools.training.front_end import open_library
from tools.training.hinged import DEVIATION_MIN, decide_hinged, expand_hinges, fit_hinged

COST = 0.05
WIDTH_PX, HEIGHT_PX = 320, 240


def samples(seed: int, count: int = 1500) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Bytes (count, 6), and three targets: one that a linear machine tells, two that it does not."""
    x = np.random.default_rng(seed).integers(0, 256, (count, 6)).astype(np.uint8)
    far = np.abs(x[:, 3].astype(int) - 128) > 64
    return x, np.column_stack([x[:, 0] > x[:, 1], far, ~far])


@pytest.fixture(scope="module")
def machine() -> HingedSvm:
    x, targets = samples(0)
    return fit_hinged(x, targets, COST, 200)


def test_fit_decides_as_linear_svc_on_the_expansion(machine: HingedSvm) -> None:
    x, targets = samples(0)
    phi = expand_hinges(x, machine.knots).astype(np.float64)
    scaled = (phi - phi.mean(axis=0)) / np.maximum(phi.std(axis=0), DEVIATION_MIN)
    values = decide_hinged(machine, x)
    for row in range(3):
        svc = LinearSVC(C=COST, dual=False, tol=1e-6, max_iter=10_000).fit(scaled, targets[:, row])
        wanted = svc.decision_function(scaled)
        # Half a step of 8 bits in each weight, and two hundred steps of L-BFGS, which end before the minimum.
        rounding = 0.5 * machine.byte_scale[row] * np.abs(phi - phi.mean(axis=0)).sum(axis=1)
        assert (np.abs(values[:, row] - wanted) < rounding + 0.02).all()
        assert np.mean((values[:, row] > 0) == (wanted > 0)) > 0.98


def test_what_is_far_from_the_middle_either_way_is_told(machine: HingedSvm) -> None:
    x, targets = samples(1)
    assert ((decide_hinged(machine, x) > 0) == targets).mean(axis=0).min() > 0.95


def test_c_decides_as_python(machine: HingedSvm) -> None:
    library = open_library()
    keep: list[object] = []
    made = library.ffi.new("bslam_hinged_t *", library.hinged(machine, keep))
    assert library.lib.bslam_hinged_check(made, machine.features) == library.lib.BSLAM_OK
    x = samples(2, 400)[0]
    found = np.empty((len(x), machine.rows), np.float32)
    for sample, values in zip(x, found, strict=True):
        library.lib.bslam_hinged_decide(made, library.bytes(sample), library.floats(values))
    np.testing.assert_allclose(found, decide_hinged(machine, x), rtol=1e-6, atol=1e-6)


def test_compiled_header_decides_as_python(machine: HingedSvm, tmp_path: Path) -> None:
    header = Header("MACHINE_H", ["vision/vision.h"], {})
    header.constant("bslam_hinged_t", "machine", header.hinged("close", machine))
    (tmp_path / "machine.h").write_text(header.text(), encoding="utf-8")
    library = compile_library(
        tmp_path,
        '#include "machine.h"\n#include "vision/built_in/classifiers/hinged.c"\n'
        "void decide(const uint8_t *x, float *values);\n"
        "void decide(const uint8_t *x, float *values) { bslam_hinged_decide(&machine, x, values); }\n",
    )
    x = samples(3, 100)[0]
    found = np.empty((len(x), machine.rows), np.float32)
    for sample, values in zip(x, found, strict=True):
        library.decide(ctypes.c_void_p(sample.ctypes.data), ctypes.c_void_p(values.ctypes.data))
    np.testing.assert_allclose(found, decide_hinged(machine, x), rtol=1e-6, atol=1e-6)


def pixels_of(half: NDArray[np.uint16], box: tuple[float, float, float, float]) -> NDArray[np.uint8]:
    """What the pixels of a box in a half-resolution copy tell."""
    library = open_library()
    pixels = library.ffi.cast("uint16_t *", half.ctypes.data)
    frame = library.new_filled("bslam_frame_t", width_px=WIDTH_PX, height_px=HEIGHT_PX, half=pixels)
    sides = dict(zip(("left_px", "top_px", "right_px", "bottom_px"), box, strict=True))
    told = np.zeros(library.lib.BSLAM_CLOSE_FEATURES, np.uint8)
    library.lib.bslam_patch_features(frame, library.new_filled("bslam_box_t", **sides), library.bytes(told))
    return told


@pytest.mark.parametrize("seed", range(5))
def test_mirrored_is_what_is_told_of_the_mirror_image(seed: int) -> None:
    random = np.random.default_rng(seed)
    half = np.repeat(np.repeat(random.integers(0, 1 << 16, (30, 40)), 4, axis=0), 4, axis=1).astype(np.uint16)
    left, right = sorted(random.uniform(40, 280, 2))
    # Places between pixels fall the one way here and the other there: none of these is one.
    box = (left + 0.013, 60.3, right + 5.017, 150.2)
    other = (WIDTH_PX - 1 - box[2], box[1], WIDTH_PX - 1 - box[0], box[3])
    told, of_mirror = pixels_of(half, box), pixels_of(np.ascontiguousarray(half[:, ::-1]), other)
    np.testing.assert_array_equal(mirrored(told[None])[0], of_mirror)
    assert (told != of_mirror).any()
