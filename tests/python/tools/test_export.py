"""bslam/cheader.py: headers that compile and decide as scikit-learn does."""

import ctypes
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bslam import cheader as export
from bslam.core.scanner import NOTHING
from bslam.core.vision import BeaconModel
from bslam.errors import BslamError
from bslam.scannerfile import ScannerModel
from tools.training import fit
from tools.training.built_in import built_in_detector
from tools.training.compiled import (
    TOLERANCE,
    CompiledSvm,
    compile_library,
    worst_byte_difference,
    worst_difference,
)
from tools.training.detector_export import beacons_header
from tools.training.detector_samples import CLASSES
from tools.training.train_detector import HEADER, note_of


def samples(features: int, seed: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Random data of uneven offsets and scales, and three rows of targets, the first two overlapping."""
    random = np.random.default_rng(seed)
    x = random.standard_normal((600, features)) * random.uniform(0.1, 3, features) + random.uniform(-1, 1)
    direction = random.standard_normal((features, 3))
    noise = random.standard_normal((600, 3))
    return x.astype(np.float32), x @ direction + noise > [0, 1, 2]


def compiled(svm: fit.Svm) -> CompiledSvm:
    """`svm` by way of its header."""
    header = export.Header("MACHINE_H", ["vision/vision.h"], {})
    header.constant("bslam_svm_t", "machine", header.svm("table", svm))
    return CompiledSvm(header.text(), "machine")


@pytest.mark.parametrize(("features", "quadratic"), [(71, False), (60, True), (1, True)])
def test_header_float_decides_as_scikit_learn_on_every_sample(features: int, quadratic: bool) -> None:
    x, targets = samples(features, seed=1)
    machine = fit.fit(x[:400], targets[:400], 0.01, quadratic)
    library = compiled(machine.svm)
    assert library.check(features) == 0 and library.check(features + 1) != 0
    assert library.weights().tobytes() == machine.svm.weights.tobytes()
    assert worst_difference(library, x, machine.decide(x)) <= TOLERANCE
    # Half as many digits in the header would show.
    coarse = replace(machine.svm, weights=machine.svm.weights.astype(np.float16).astype(np.float32))
    assert worst_difference(compiled(coarse), x, machine.decide(x)) > TOLERANCE


def test_header_bytes_decide_as_the_quantised_machine() -> None:
    x, targets = samples(20, seed=2)
    machine = fit.fit(x, targets, 1.0, quadratic=True)
    small = fit.quantised(machine.svm)
    assert small.byte_scale is not None
    library = compiled(small)
    wanted = fit.expand(x, True) @ library.weights().T.astype(np.float64) + small.bias
    assert worst_byte_difference(library, x, wanted) <= 1.5
    assert np.mean((library.decide(x) > 0) == (machine.decide(x) > 0)) > 0.97


@pytest.mark.parametrize("lens", ["pinhole", "wide"])
@pytest.mark.parametrize("part", ["cell", "screen", "fusion"])
def test_machines_that_come_with_the_library_decide_by_their_tables(lens: str, part: str) -> None:
    machine = CompiledSvm('#include "models/beacons.h"\n', f"bslam_beacons_model.{lens}.{part}")
    assert machine.check(machine.features) == 0
    x = np.random.default_rng(5).standard_normal((200, machine.features)).astype(np.float32)
    zero = machine.decide(np.zeros((1, machine.features), np.float32))
    wanted = fit.expand(x, machine.quadratic) @ machine.weights().T.astype(np.float64) + zero
    assert worst_difference(machine, x, wanted) <= TOLERANCE


def scanner(seed: int = 3) -> ScannerModel:
    """What finds nothing, but with random weights and with names that C does not take as they are."""
    window = NOTHING.windows[0]
    random = np.random.default_rng(seed)
    weights = random.integers(-127, 128, window.weights.shape, dtype=np.int8)
    names = {'red "box"': 0.6, "T\u00fcr ??/": 2.0, "c\\d": 0.0}
    kinds = tuple(replace(NOTHING.kinds[0], name=name, height_m=size) for name, size in names.items())
    return ScannerModel(kinds, (replace(window, weights=weights),), {"training set": "random " * 40})


def test_scanner_header_twice_gives_the_same_bytes() -> None:
    assert export.scanner_header(scanner(), "mine") == export.scanner_header(scanner(), "mine")


def test_scanner_header_comment_tells_models_apart() -> None:
    first, second = (export.scanner_header(scanner(seed), "mine") for seed in (3, 4))
    digest = [line for line in first.splitlines() if line.startswith("// weights: sha256 ")]
    assert len(digest) == 1 and digest[0] not in second
    assert "// training set: random random" in first
    assert max(map(len, first.splitlines())) <= export.COLUMNS


def test_scanner_header_compiles_and_keeps_names_and_numbers(tmp_path: Path) -> None:
    one = scanner()
    export.write_header(tmp_path / "mine.h", export.scanner_header(one, "mine"))
    library = compile_library(
        tmp_path,
        '#include "mine.h"\n'
        "const char *name(int i);\nfloat height(int i);\nint weight(int i);\n"
        "const char *name(int i) { return bslam_mine.kinds[i].name; }\n"
        "float height(int i) { return bslam_mine.kinds[i].height_m; }\n"
        "int weight(int i) { return bslam_mine.windows[0].weights[i]; }\n",
    )
    library.name.restype = ctypes.c_char_p
    library.height.restype = ctypes.c_float
    for index, wanted in enumerate(one.kinds):
        assert library.name(index).decode() == wanted.name
        assert library.height(index) == np.float32(wanted.height_m)
    weights = one.windows[0].weights.ravel().tolist()
    assert [library.weight(index) for index in range(len(weights))] == weights


@pytest.mark.parametrize("name", ["Mine", "9lives", "my-beacons", "", "a b"])
def test_scanner_header_name_that_c_does_not_allow_is_refused(name: str) -> None:
    with pytest.raises(BslamError, match=r"name is not allowed; allowed: small letters"):
        export.scanner_header(scanner(), name)


@pytest.mark.parametrize("value", [1.0, -2.0, 0.1, 1e-7, -3.4e38, 1e20, 123456.789, 0.0, np.pi])
def test_c_float_gives_the_float_back(value: float) -> None:
    text = export.c_float(value)
    assert text.endswith("f") and ("." in text or "e" in text)
    assert np.float32(float(text[:-1])) == np.float32(value)


def test_built_in_detectors_read_back_are_the_header_to_the_byte() -> None:
    model = BeaconModel(CLASSES, built_in_detector("pinhole"), built_in_detector("wide"))
    written = HEADER.read_text(encoding="utf-8").split("#ifndef")[1]
    assert beacons_header(model, {}).split("#ifndef")[1] == written
    assert "recall" in note_of(HEADER, "wide")
