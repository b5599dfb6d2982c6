"""tools/bench/peers: other people's detectors on the pictures that the scanner is trained on."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from bslam.datasets.pictures import Scaled
from bslam.detect.boxes import Found
from bslam.detect.examples import Collection, Example
from tools.bench.peers import finders, pictures

KIND = "plate"
BOX = np.array([60.0, 40.0, 132.0, 100.0])


def example(number):
    """A dark plate with a bright cross on noise, each time elsewhere; every fourth picture is without."""
    rng = np.random.default_rng(number)
    frame = rng.integers(90, 160, (160, 200, 3), dtype=np.uint8)
    left, top = (int(rng.integers(0, most)) for most in (120, 90))
    frame[top : top + 60, left : left + 72] = 20
    frame[top + 25 : top + 35, left : left + 72] = frame[top : top + 60, left + 31 : left + 41] = 240
    box = np.array([[left, top, left + 72, top + 60]], float)
    if number % 4 == 3:
        frame, box = frame[:, ::-1] // 2 + frame[::-1] // 2, np.empty((0, 4))
        frame = np.ascontiguousarray(np.sort(frame, axis=1))
    return Example(f"{number}", frame, {KIND: box}, Scaled(frame, 1.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def examples():
    return [example(number) for number in range(12)]


class Shades:
    """In place of OpenCV's HOG where it is not installed: cells' brightness about its mean, at one size."""

    def __init__(self, size, *_blocks):
        self.size = size

    def getDescriptorSize(self):  # noqa: N802
        return self.size[0] * self.size[1] // 64

    def compute(self, picture):
        cells = picture.mean(axis=2).reshape(self.size[1] // 8, 8, self.size[0] // 8, 8).mean(axis=(1, 3))
        return ((cells - cells.mean()) / 255.0).astype(np.float32).ravel()

    def setSVMDetector(self, weights):  # noqa: N802
        self.weights = weights

    def detectMultiScale(self, frame, hitThreshold, **_settings):  # noqa: N802, N803
        found, scores = [], []
        width, height = (int(side * 1.35) // 8 * 8 for side in self.size)
        for top in range(0, frame.shape[0] - height, 6):
            for left in range(0, frame.shape[1] - width, 6):
                part = finders.cv2.resize(frame[top : top + height, left : left + width], self.size)
                score = float(self.compute(part) @ self.weights[:-1] + self.weights[-1])
                if score > hitThreshold:
                    found.append((left, top, width, height))
                    scores.append(score)
        return found, np.array(scores)


@pytest.fixture(scope="module")
def hog(examples):
    pytest.importorskip("cv2")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(finders, "CLUTTER", 1)
        patch.setattr(finders, "ROUNDS", 1)
        if not pictures.HOG.is_here():
            patch.setattr(finders.cv2, "HOGDescriptor", Shades, raising=False)
        yield finders.fit_hog(examples[:8], KIND, np.random.default_rng(0))


def test_hog_finds_what_it_was_trained_on_in_new_pictures(hog, examples):
    found = [Found(*hog.find(one.frame), one.of(KIND)) for one in examples[8:]]
    row = pictures.accuracy_row("HOG", found, has_boxes=True)
    assert float(row[2]) >= 0.6 and len(row) == 1 + len(pictures.ACCURACY)
    products, ram_bytes = hog.cost(examples[0].frame)
    assert products > hog.flash_bytes > 0 and ram_bytes > examples[0].frame.size


def test_middle_rule_wants_one_middle_a_thing():
    middles = np.array([[96.0, 70.0] * 2, [90.0, 70.0] * 2, [10.0, 10.0] * 2])
    found = Found(middles, np.array([0.9, 0.8, 0.95]), BOX[None])
    row = pictures.accuracy_row("middles", [found], has_boxes=False)
    assert row == ["middles", *["—"] * 4, ".50", ".00", ".00"]
    right = replace(found, boxes=middles[:1], scores=found.scores[:1])
    assert pictures.accuracy_row("middles", [right], has_boxes=False)[5:] == ["1.00", "1.00", "1.00"]


def stand_in(examples, _kind, _rng):
    """Finds BOX everywhere."""
    assert len(examples) > 0
    return finders.Fitted(lambda _frame: (BOX[None], np.ones(1)), lambda _frame: (3_000_000, 2048), 1024)


def test_page_has_a_row_for_each_and_says_who_is_not_installed(examples, monkeypatch):
    own = [Found(one.of(KIND), np.ones(len(one.of(KIND))), one.of(KIND)) for one in examples]
    fitted = stand_in(examples, KIND, None)
    monkeypatch.setattr(pictures, "ROUNDS", 1)
    monkeypatch.setattr(pictures, "own_result", lambda _collection, _kind: (own, fitted))
    monkeypatch.setattr(pictures, "HOG", replace(pictures.HOG, is_here=lambda: True, fit=stand_in))
    monkeypatch.setattr(pictures, "NETWORK", replace(pictures.NETWORK, is_here=lambda: False))
    section = pictures.class_section(Collection(tuple(examples), {KIND: 0.0}), KIND)
    assert section.startswith("plate: 9 in 12 pictures, 4 parts")
    accuracy, cost = section.split("\n\n")[1:]
    assert "| bslam | 1.00 | 1.00 |" in accuracy
    assert "| network like FOMO, PyTorch: not installed: `pip install torch` | — |" in accuracy
    assert "| HOG, linear SVM, OpenCV | 3.0 M | 94 |" in cost and "| 2 KB | 1.0 KB |" in cost
    assert {line.count("|") for line in accuracy.splitlines()} == {2 + len(pictures.ACCURACY)}
    assert {line.count("|") for line in cost.splitlines()} == {2 + len(pictures.COST)}


def test_what_cannot_be_tried_is_said(tmp_path, capsys):
    with pytest.raises(SystemExit, match=r"there is no labels\.csv in it"):
        pictures.main([str(tmp_path)])
    one = example(0)
    Image.fromarray(one.frame).save(tmp_path / "a.png")
    head = "picture,class,left_px,top_px,right_px,bottom_px"
    (tmp_path / "labels.csv").write_text(f"{head}\na.png,plate,1,1,50,50\n", encoding="utf-8")
    assert pictures.main([str(tmp_path), "--out", str(tmp_path / "page.md")]) == 0
    assert "skipped: class 'plate' is in 1 pictures" in capsys.readouterr().err
    assert "skipped: class 'plate'" in (tmp_path / "page.md").read_text(encoding="utf-8")
