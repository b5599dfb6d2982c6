"""scannerfile.py: a model file is read back to the bit, or refused with key, value and what is allowed."""

import json

import numpy as np
import pytest

from bslam.core.scanner import Scanner
from bslam.errors import BslamError
from bslam.scannerfile import Kind, ScannerModel, Window, read_scanner, scanner_text, write_scanner


def model():
    rng = np.random.default_rng(0)
    window = Window(
        kind=0,
        box_columns=2.5,
        box_rows=float(np.float32(3.1)),
        weights=rng.integers(-127, 128, (6, 4, 8), dtype=np.int8),
        scale=float(np.float32(0.00123)),
        bias=-71,
        coarse=rng.integers(-127, 128, (3, 2, 8), dtype=np.int8),
        coarse_bias=12,
        order=rng.permutation(3).astype(np.uint8),
        floors=rng.integers(-(2**31), 2**31, 3).astype(np.int32),
        edges=rng.integers(-127, 128, (4, 3, 2, 8), dtype=np.int8),
        edge_scale=rng.random(4, dtype=np.float32),
        edge_bias=rng.random(4, dtype=np.float32),
    )
    kind = Kind('Türschild "A"', 0.25, 0.75, 0.5, 2.0, -1.0, 0.0625, 0.125)
    return ScannerModel((kind,), (window,), {"trained by": "a test"})


def test_a_file_gives_the_model_back_to_the_bit(tmp_path):
    write_scanner(tmp_path / "m.json", model())
    assert scanner_text(read_scanner(tmp_path / "m.json")) == scanner_text(model())
    Scanner(read_scanner(tmp_path / "m.json"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.update(version=1), "key version: 1 is not allowed; allowed: 3"),
        (lambda d: d.update(format="bslam log"), "key format"),
        (lambda d: d.update(channels=10), "key channels: 10 is not allowed; allowed: 8"),
        (lambda d: d.pop("windows"), "key windows: is missing"),
        (lambda d: d["windows"][0]["weights"].pop(), "key windows[0].weights: '191 entries' is not allowed"),
        (
            lambda d: d["windows"][0]["weights"].__setitem__(3, 128),
            "windows[0].weights[3]: 128 is not allowed",
        ),
        (
            lambda d: d["windows"][0]["weights"].__setitem__(3, 1.5),
            "windows[0].weights[3]: 1.5 is not allowed",
        ),
        (lambda d: d["windows"][0].update(order=[0, 0, 1]), "windows[0].order: allowed: each row once"),
        (lambda d: d["windows"][0].update(rows=5), "windows[0].rows: 5; allowed: an even number"),
        (lambda d: d["windows"][0].update(columns=21), "windows[0].columns: 21 is not allowed"),
        (lambda d: d["windows"][0].update(kind=1), "windows[0].kind: 1 is not allowed"),
        (lambda d: d["kinds"][0].update(threshold=float("nan")), "kinds[0].threshold: nan is not allowed"),
        (lambda d: d["kinds"][0].update(name=""), "kinds[0].name"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, change, said):
    document = json.loads(scanner_text(model()))
    change(document)
    (tmp_path / "m.json").write_text(json.dumps(document))
    with pytest.raises(BslamError) as caught:
        read_scanner(tmp_path / "m.json")
    assert said in str(caught.value)


def test_file_that_is_cut_short_is_refused(tmp_path):
    (tmp_path / "m.json").write_text(scanner_text(model())[:500])
    with pytest.raises(BslamError, match="not JSON, or cut short"):
        read_scanner(tmp_path / "m.json")
