"""tools/training/export.py: headers that compile and decide as scikit-learn does."""

import ctypes
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.modelfile import BeaconClass, Recogniser
from tools.compiled import CompiledSvm, compile_library
from training import export, fit


def samples(features: int, seed: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Random data of uneven offsets and scales, and three rows of targets, the first two overlapping."""
    random = np.random.default_rng(seed)
    x = random.standard_normal((600, features)) * random.uniform(0.1, 3, features) + random.uniform(-1, 1)
    direction = random.standard_normal((features, 3))
    noise = random.standard_normal((600, 3))
    return x.astype(np.float32), x @ direction + noise > [0, 1, 2]


def compiled(folder: Path, svm: fit.Svm) -> CompiledSvm:
    """`svm` by way of its header."""
    header = export.Header("MACHINE_H", ["bslam/svm/svm.h"], {})
    header.constant("bslam_svm_t", "machine", header.svm("table", svm))
    export.write_header(folder / "machine.h", header.text())
    return CompiledSvm(folder, "machine.h", "machine")


@pytest.mark.parametrize(("features", "quadratic"), [(71, False), (60, True), (1, True)])
def test_header_float_decides_as_scikit_learn_on_every_sample(
    tmp_path: Path, features: int, quadratic: bool
) -> None:
    x, targets = samples(features, seed=1)
    machine = fit.fit(x[:400], targets[:400], 0.01, quadratic)
    library = compiled(tmp_path, machine.svm)
    assert library.check(features) == 0 and library.check(features + 1) != 0
    magnitude = 1.0 + fit.expand(np.abs(x), quadratic) @ np.abs(machine.svm.weights).T.astype(np.float64)
    difference = np.abs(library.decide(x, 3) - machine.decide(x))
    assert np.all(difference <= 1e-5 * magnitude)
    # Half as many digits in the header would show.
    coarse = machine.svm.weights.astype(np.float16).astype(np.float64)
    assert np.any(np.abs(fit.expand(x, quadratic) @ (coarse - machine.svm.weights).T) > 1e-5 * magnitude)


def test_header_bytes_decide_as_the_quantised_machine(tmp_path: Path) -> None:
    x, targets = samples(20, seed=2)
    machine = fit.fit(x, targets, 1.0, quadratic=True)
    small = fit.quantised(machine.svm)
    assert small.byte_scale is not None
    weights = small.weights.astype(np.float64) * small.byte_scale[:, None]
    magnitude = 1.0 + fit.expand(np.abs(x), True) @ np.abs(weights).T
    values = compiled(tmp_path, small).decide(x, 3)
    assert np.all(np.abs(values - (fit.expand(x, True) @ weights.T + small.bias)) <= 1e-5 * magnitude)
    assert np.mean((values > 0) == (machine.decide(x) > 0)) > 0.97


def recogniser(seed: int = 3) -> Recogniser:
    x, targets = samples(71, seed)
    objects = (BeaconClass('red "box"', 0.6), BeaconClass("T\u00fcr ??/", 2.0), BeaconClass("c\\d"))
    return Recogniser(fit.fit(x, targets, 1.0).svm, objects, 0.25, {"training set": "random " * 40})


def test_recogniser_header_twice_gives_the_same_bytes() -> None:
    assert export.recogniser_header(recogniser(), "mine") == export.recogniser_header(recogniser(), "mine")


def test_recogniser_header_comment_tells_models_apart() -> None:
    first, second = (export.recogniser_header(recogniser(seed), "mine") for seed in (3, 4))
    digest = [line for line in first.splitlines() if line.startswith("// weights: sha256 ")]
    assert len(digest) == 1 and digest[0] not in second
    assert "// training set: random random" in first
    assert max(map(len, first.splitlines())) <= export.COLUMNS


def test_recogniser_header_compiles_and_keeps_names_and_numbers(tmp_path: Path) -> None:
    one = recogniser()
    export.write_header(tmp_path / "mine.h", export.recogniser_header(one, "mine"))
    library = compile_library(
        tmp_path,
        '#include "mine.h"\n'
        "const char *name(int i);\nfloat height(int i);\nfloat margin(void);\n"
        "const char *name(int i) { return bslam_mine.objects[i].name; }\n"
        "float height(int i) { return bslam_mine.objects[i].height_m; }\n"
        "float margin(void) { return bslam_mine.reject_margin; }\n",
    )
    library.name.restype = ctypes.c_char_p
    library.height.restype = library.margin.restype = ctypes.c_float
    for index, wanted in enumerate(one.objects):
        assert library.name(index).decode() == wanted.name
        assert library.height(index) == np.float32(wanted.height_m)
    assert library.margin() == 0.25


@pytest.mark.parametrize("name", ["Mine", "9lives", "my-beacons", "", "a b"])
def test_recogniser_header_name_that_c_does_not_allow_is_refused(name: str) -> None:
    with pytest.raises(BslamError, match=r"name is not allowed; allowed: small letters"):
        export.recogniser_header(recogniser(), name)


@pytest.mark.parametrize("value", [1.0, -2.0, 0.1, 1e-7, -3.4e38, 1e20, 123456.789, 0.0, np.pi])
def test_c_float_gives_the_float_back(value: float) -> None:
    text = export.c_float(value)
    assert text.endswith("f") and ("." in text or "e" in text)
    assert np.float32(float(text[:-1])) == np.float32(value)
