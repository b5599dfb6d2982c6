"""bslam/modelfile.py: a model file gives its recogniser back to the bit, or is refused whole."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.modelfile import BeaconClass, Recogniser, Svm, read_recogniser, recogniser_text, write_recogniser

FEATURES = 7


@pytest.fixture
def recogniser() -> Recogniser:
    random = np.random.default_rng(1)
    weights = (random.standard_normal((3, FEATURES)) * 10.0 ** random.uniform(-9, 9, (3, FEATURES))).astype(
        np.float32
    )
    objects = (BeaconClass("red box", 0.3), BeaconClass("Tür", 2.0, 0.05), BeaconClass("poster"))
    svm = Svm(FEATURES, False, weights, np.array([0.1, -1 / 3, 1e-30], dtype=np.float32))
    return Recogniser(svm, objects, 0.1, {"pictures": "20 of the kitchen"})


@pytest.fixture
def file(tmp_path: Path, recogniser: Recogniser) -> Path:
    path = tmp_path / "new folder/mine.json"
    write_recogniser(path, recogniser)
    return path


def test_read_recogniser_gives_back_what_was_written_to_the_bit(file: Path, recogniser: Recogniser) -> None:
    back = read_recogniser(file, FEATURES)
    assert back.svm.weights.tobytes() == recogniser.svm.weights.tobytes()
    assert back.svm.bias.tobytes() == recogniser.svm.bias.tobytes()
    assert back.svm.weights.dtype == np.float32 and back.svm.rows == 3
    assert back.objects == recogniser.objects and back.notes == recogniser.notes
    assert back.reject_margin == np.float32(0.1)
    assert recogniser_text(back) == file.read_text(encoding="utf-8")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.995])
def test_read_recogniser_truncated_file_is_refused(file: Path, share: float) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    with pytest.raises(BslamError, match=r"mine\.json: not JSON, or cut short.*allowed: a whole"):
        read_recogniser(file, FEATURES)


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_read_recogniser_number_that_is_not_finite_is_refused(file: Path, word: str) -> None:
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("0.100000001,", f"{word},"), encoding="utf-8")
    with pytest.raises(
        BslamError, match=r"key (bias\[0\]|reject_margin): -?(nan|inf) is not allowed; allowed: a"
    ):
        read_recogniser(file, FEATURES)


def put(*keys: str | int, value: object) -> Callable[[Any], None]:
    def change(document: Any) -> None:
        for key in keys[:-1]:
            document = document[key]
        document[keys[-1]] = value

    return change


def drop(key: str) -> Callable[[Any], None]:
    return lambda document: document.pop(key)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (
            put("format", value="bslam log"),
            "key format: 'bslam log' is .* allowed: 'bslam recogniser'",
        ),
        (put("version", value=2), "key version: 2 is not allowed; allowed: 1"),
        (put("version", value=True), "key version: True is not allowed"),
        (drop("version"), "key version: is missing; allowed: 1"),
        (put("features", value=71), "key features: 71 is not allowed; allowed: 7"),
        (drop("weights"), "key weights: is missing"),
        (
            put("weights", value=[[0] * FEATURES] * 2),
            "key weights: '2 entries' is .* allowed: a list of 3",
        ),
        (
            put("weights", 2, value=[0] * 6),
            r"key weights\[2\]: '6 entries' is .* allowed: a list of 7",
        ),
        (
            put("weights", 1, 3, value="1"),
            r"key weights\[1\]\[3\]: '1' is .* allowed: a number from",
        ),
        (put("weights", 0, 0, value=1e300), r"key weights\[0\]\[0\]: 1e\+300 is not allowed"),
        (put("weights", 0, 0, value=True), r"key weights\[0\]\[0\]: True is not allowed"),
        (put("bias", value=[0, 0]), "key bias: '2 entries' is not allowed; allowed: a list of 3"),
        (put("bias", value=3), "key bias: 3 is not allowed; allowed: a list of 3"),
        (put("reject_margin", value=None), "key reject_margin: None is not allowed; allowed: a number"),
        (put("objects", value=[]), "key objects: .* allowed: a list of 1 to 255 tables"),
        (put("objects", 1, value="door"), r"key objects\[1\]: 'door' is not allowed; allowed: a table"),
        (put("objects", 1, "name", value=""), r"key objects\[1\]\.name: '' is not .* allowed: a name"),
        (
            put("objects", 0, "height_m", value=-1),
            r"key objects\[0\]\.height_m: -1 is not .* allowed: a",
        ),
        (put("notes", value=[]), r"key notes: \[\] is not allowed; allowed: a table"),
    ],
)
def test_read_recogniser_bad_value_is_refused(
    file: Path, change: Callable[[Any], None], complaint: str
) -> None:
    document = json.loads(file.read_text(encoding="utf-8"))
    change(document)
    file.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(BslamError, match=complaint) as caught:
        read_recogniser(file, FEATURES)
    assert str(caught.value).startswith(str(file))


def test_read_recogniser_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BslamError, match=r"none\.json: cannot be read"):
        read_recogniser(tmp_path / "none.json", FEATURES)


def test_read_recogniser_list_for_a_file_is_refused(file: Path) -> None:
    file.write_text("[1, 2]")
    with pytest.raises(BslamError, match="holds no table"):
        read_recogniser(file, FEATURES)


def test_recogniser_text_of_bytes_is_a_mistake(recogniser: Recogniser) -> None:
    svm = recogniser.svm
    small = Svm(FEATURES, False, svm.weights.astype(np.int8), svm.bias, np.ones(3, np.float32))
    with pytest.raises(ValueError, match="float weights"):
        recogniser_text(Recogniser(small, recogniser.objects, 0.0))
