"""bslam/modelfile.py: a model file's values are given as they stand there, or refused by key and value."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.modelfile import Document, load_document

TABLE = {
    "format": "bslam things",
    "version": 1,
    "notes": {"pictures": "20 of the kitchen"},
    "kinds": [{"name": "red box", "height_m": 0.7}, {"name": "T\u00fcr", "height_m": 2}],
    "bias": [0.100000001, -0.333333343, 1e-30],
    "order": [2, 0, 1],
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(TABLE), encoding="utf-8")
    return path


def read(path: Path) -> tuple[object, ...]:
    """All values of the file, each by what it may hold."""
    document = Document(path, load_document(path))
    document.equal("format", "bslam things")
    document.equal("version", 1)
    kinds = [(one.text("name"), one.number("height_m", 0.0, 10.0)) for one in document.children("kinds", 16)]
    bias, order = document.array("bias", 3), document.integers("order", 3, np.uint8)
    return document.mapping("notes"), kinds, document.whole("version", 0, 1), bias, order


def test_document_gives_back_what_was_written_to_the_bit(file: Path) -> None:
    notes, kinds, version, bias, order = read(file)
    assert (notes, kinds, version) == (TABLE["notes"], [("red box", 0.7), ("T\u00fcr", 2.0)], 1)
    wanted = np.array([0.1, -1 / 3, 1e-30], np.float32), np.array([2, 0, 1], np.uint8)
    for values, expected in zip((bias, order), wanted, strict=True):
        assert isinstance(values, np.ndarray) and values.dtype == expected.dtype
        assert values.tobytes() == expected.tobytes()


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.995])
def test_load_document_truncated_file_is_refused(file: Path, share: float) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    with pytest.raises(BslamError, match=r"mine\.json: not JSON, or cut short.*allowed: a whole"):
        load_document(file)


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity", "1e999"])
@pytest.mark.parametrize(("number", "key"), [("0.100000001", r"bias\[0\]"), ("0.7", r"kinds\[0\].height_m")])
def test_document_number_that_is_not_finite_is_refused(file: Path, word: str, number: str, key: str) -> None:
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace(number, word), encoding="utf-8")
    with pytest.raises(BslamError, match=rf"key {key}: -?(nan|inf) is not allowed; allowed: a number"):
        read(file)


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
        (put("format", value="bslam log"), "key format: 'bslam log' is .* allowed: 'bslam things'"),
        (put("version", value=2), "key version: 2 is not allowed; allowed: 1"),
        (put("version", value=True), "key version: True is not allowed"),
        (drop("version"), "key version: is missing; allowed: 1"),
        (drop("bias"), "key bias: is missing; allowed: a list of 3"),
        (put("bias", 1, value="1"), r"key bias\[1\]: '1' is not allowed; allowed: a number from"),
        (put("bias", 0, value=1e300), r"key bias\[0\]: 1e\+300 is not allowed"),
        (put("bias", 0, value=True), r"key bias\[0\]: True is not allowed"),
        (put("bias", 0, value=[0]), r"key bias\[0\]: \[0\] is not allowed; allowed: a number from"),
        (put("bias", value=[0, 0]), "key bias: '2 entries' is not allowed; allowed: a list of 3"),
        (put("bias", value=3), "key bias: 3 is not allowed; allowed: a list of 3"),
        (put("order", value=[0] * 4), "key order: '4 entries' is not allowed; allowed: a list of 3"),
        (put("order", 2, value=256), r"key order\[2\]: 256 is .* allowed: a whole number from 0 to 255"),
        (put("order", 2, value=1.0), r"key order\[2\]: 1.0 is .* allowed: a whole number"),
        (put("kinds", value=[]), "key kinds: .* allowed: a list of 1 to 16 tables"),
        (put("kinds", 1, value="door"), r"key kinds\[1\]: 'door' is not allowed; allowed: a table"),
        (put("kinds", 1, "name", value=""), r"key kinds\[1\]\.name: '' is not .* allowed: a name"),
        (put("kinds", 0, "height_m", value=-1), r"key kinds\[0\]\.height_m: -1 is not .* allowed: a number"),
        (put("kinds", 0, "height_m", value=None), r"key kinds\[0\]\.height_m: None is not allowed"),
        (put("notes", value=[]), r"key notes: \[\] is not allowed; allowed: a table"),
    ],
)
def test_document_bad_value_is_refused(file: Path, change: Callable[[Any], None], complaint: str) -> None:
    document = json.loads(file.read_text(encoding="utf-8"))
    change(document)
    file.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(BslamError, match=complaint) as caught:
        read(file)
    assert str(caught.value).startswith(str(file))


def test_load_document_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BslamError, match=r"none\.json: there is no such file"):
        load_document(tmp_path / "none.json")


def test_load_document_list_for_a_file_is_refused(file: Path) -> None:
    file.write_text("[1, 2]")
    with pytest.raises(BslamError, match="holds no table"):
        load_document(file)
