"""bslam detect: trained on some pictures it finds the same kind in others; what was trained runs."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from sklearn.svm import LinearSVC

from bslam.cli import main
from bslam.commands import detect
from bslam.core.scanner import Level, Scanner
from bslam.detect import linear
from bslam.detect.boxes import overlaps
from bslam.detect.examples import read_collection
from bslam.detect.train import alone, parts_of, train
from bslam.detect.windows import (
    Shape,
    blocks,
    halved,
    row_values,
    window_boxes,
    window_features,
    window_values,
)
from bslam.errors import BslamError
from bslam.scannerfile import LOWEST, read_scanner

from .pictures import picture, write_folder

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A folder with a model and what was said."""
    folder = tmp_path_factory.mktemp("trained")
    write_folder(folder / "learn", 16, 1, empty=4)
    assert main(["detect", "train", str(folder / "learn"), "--out", str(folder / "panels.json")]) == 0
    return folder


def test_without_scikit_learn_it_is_said_first_how_to_get_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "sklearn.svm", None)
    assert main(["detect", "train", "no_folder", "--out", "panels.json"]) == 2
    said = f"training needs scikit-learn; allowed: {sys.executable} -m pip install scikit-learn\n"
    assert capsys.readouterr().err.endswith(said)


def test_it_finds_the_same_kind_in_other_pictures(trained, capsys):
    write_folder(trained / "new", 20, 2, empty=10)
    assert main(["detect", "test", str(trained / "new"), "--model", str(trained / "panels.json")]) == 0
    said = capsys.readouterr().out
    assert "of 20 labelled by itself" in said and "in the 10 that show none" in said
    model = read_scanner(trained / "panels.json")
    scanner, rng = Scanner(model), np.random.default_rng(3)
    hits = false = 0
    for _ in range(30):
        frame, box = picture(rng)
        boxes = np.array([one.box for one in scanner.see(frame).items]).reshape(-1, 4)
        good = overlaps(boxes, np.array([box], float))[:, 0] >= 0.5
        hits += bool(good.any())
        false += int((~good).sum())
    assert hits >= 27 and false <= 5


def test_run_writes_boxes_in_the_pictures_own_pixels(trained, capsys):
    folder = write_folder(trained / "shown", 4, 5)
    out = trained / "out"
    words = ["detect", "run", str(folder), "--model", str(trained / "panels.json"), "--out", str(out)]
    assert main(words) == 0
    assert "beside labels: " in capsys.readouterr().out
    lines = (out / "boxes.csv").read_text().splitlines()
    assert lines[0] == "picture,class,score,left_px,top_px,right_px,bottom_px"
    labelled = {
        line.split(",")[0]: np.array([line.split(",")[2:6]], float)
        for line in (folder / "labels.csv").read_text().splitlines()[1:]
    }
    first = lines[1].split(",")
    assert overlaps(np.array([first[3:]], float), labelled[first[0]])[0, 0] >= 0.5
    assert (out / "contact_sheet.png").stat().st_size > 1000
    assert main([*words, "--all"]) == 0
    assert len((out / "boxes.csv").read_text().splitlines()) >= len(lines)


def test_scanner_in_c_decides_as_whole_numbers_in_numpy_do(trained):
    """Every window of some pictures: the best of the boxes that overlap, to the bit of the score."""
    model = read_scanner(trained / "panels.json")
    assert len(model.kinds) == 1
    rng = np.random.default_rng(7)
    compared = 0
    for _ in range(6):
        frame, _ = picture(rng)
        scanner = alone(model, 0)
        seen = scanner.see(frame).items
        wanted = reference(model, scanner.levels(frame), frame.shape)
        assert len(seen) == len(wanted) > 0
        for got, (score, box) in zip(seen, wanted, strict=True):
            assert got.score == score
            assert got.box == pytest.approx(box, abs=1e-3)
            compared += 1
    assert compared >= 6


def reference(model, levels, shape):
    """Scores and boxes of what remains, surest first."""
    hits, most = [], [shape[1], shape[0]] * 2
    for window in model.windows:
        its = Shape(window.columns, window.rows, window.box_columns, window.box_rows)
        for level in levels:
            sums = window.bias + window_values(level, its, window.weights.astype(np.float32)).astype(np.int64)
            scores = np.float32(window.scale) * sums.astype(np.float32)
            good = np.flatnonzero(looked_at(window, its, level, scores) & (scores >= np.float32(LOWEST)))
            if not len(good):
                continue
            cells = blocks(window_features(level, its, good)).reshape(len(good), -1)
            edges = (
                cells @ window.edges.reshape(4, -1).T.astype(np.int64) * window.edge_scale + window.edge_bias
            )
            boxes = window_boxes(level, its)[good]
            sides = np.tile(boxes[:, 2:] - boxes[:, :2], 2)
            boxes = boxes + np.clip(edges, -0.4, 0.4) * sides
            within = np.clip(boxes, 0, most)
            shown = np.all(within[:, 2:] > within[:, :2], axis=1)
            hits += list(zip(scores[good][shown].tolist(), boxes[shown], strict=True))
    hits.sort(key=lambda hit: -hit[0])
    hits, found = hits[:128], []
    while hits:
        best, first = hits[0]
        same = [overlaps(first[None], box[None])[0, 0] >= 0.4 for _, box in hits]
        weights = [max(0.0, score - best + 1) for score, _ in hits]
        its = [(weight, box) for weight, (_, box), one in zip(weights, hits, same, strict=True) if one]
        mean = np.average([box for _, box in its], axis=0, weights=[one for one, _ in its])
        found.append((best, np.clip(mean, 0, most)))
        left = [hit for hit, one in zip(hits, same, strict=True) if not one]
        hits = [hit for hit in left if not hides(mean, hit[1])]
    return found[:16]


def hides(mean, box):
    """Whether a box is in the place of the mean, or one of the two is a part of the other."""
    sides = np.minimum(mean[2:], box[2:]) - np.maximum(mean[:2], box[:2])
    least = min(np.prod(one[2:] - one[:2]) for one in (mean, box))
    return overlaps(mean[None], box[None])[0, 0] >= 0.4 or np.prod(np.maximum(sides, 0)) >= 0.65 * least


def looked_at(window, its, level, scores):
    """Which windows the coarse one lets through, row by row; of four the first alone if far below."""
    passes = likely(window, its, level)
    if not len(passes):
        return passes
    columns = level.cells.shape[1] - its.columns + 1
    scores = scores.reshape(-1, columns)
    near = (scores[::2, ::2] >= np.float32(LOWEST) - 2).repeat(2, axis=0).repeat(2, axis=1)
    near = near[: len(scores), :columns]
    near[::2, ::2] = True
    return passes & near.ravel()


def likely(window, its, level):
    """Which windows the coarse one lets through, row by row."""
    rows, columns = level.cells.shape[0] - its.rows + 1, level.cells.shape[1] - its.columns + 1
    if rows < 1 or columns < 1:
        return np.empty(0, bool)
    half = Level(halved(level.cells), 2 * level.cell_px)
    sums = row_values(half, its.halved, window.coarse.astype(np.float32))[:, window.order].astype(np.int64)
    passes = (window.coarse_bias + np.cumsum(sums, axis=1) >= window.floors).all(axis=1)
    passes = passes.reshape((rows + 1) // 2, -1).repeat(2, axis=0).repeat(2, axis=1)
    return passes[:rows, :columns].ravel()


def test_header_holds_what_the_file_holds(trained, tmp_path):
    """Compiled with the library, it finds in a picture what the file's model finds, to the bit."""
    frame, _ = picture(np.random.default_rng(9))
    frame.tofile(tmp_path / "frame.rgb")
    (tmp_path / "main.c").write_text(
        """#include <stdio.h>
#include "vision/vision.h"
#include "panels.h"
static bslam_scanner_t scanner;
int main(int count, char **words)
{
    static unsigned char row[3 * 320];
    FILE *file = fopen(words[count - 1], "rb");
    if (bslam_scanner_init(&scanner, &bslam_panels) != BSLAM_OK ||
        bslam_scanner_begin(&scanner, BSLAM_PIXELS_RGB888, 320, 240) != BSLAM_OK) {
        return 1;
    }
    for (int i = 0; i < 240; i++) {
        if (fread(row, 3, 320, file) != 320 || bslam_scanner_row(&scanner, row) != BSLAM_OK) {
            return 2;
        }
    }
    const bslam_detections_t *found = bslam_scanner_end(&scanner);
    for (int i = 0; i < found->count; i++) {
        printf("%.9g %.9g\\n", (double)found->items[i].score, (double)found->items[i].box.left_px);
    }
    return 0;
}
"""
    )
    sources = [str(one) for part in ("base", "vision") for one in (ROOT / "firmware" / part).rglob("*.c")]
    program = tmp_path / "main"
    flags = ["-std=c11", "-O2", "-ffp-contract=off", f"-I{ROOT / 'firmware'}", f"-I{trained}"]
    subprocess.run(["cc", *flags, str(tmp_path / "main.c"), *sources, "-lm", "-o", str(program)], check=True)
    said = subprocess.run(
        [program, tmp_path / "frame.rgb"], check=True, capture_output=True, text=True
    ).stdout
    wanted = Scanner(read_scanner(trained / "panels.json")).see(frame).items
    assert len(wanted) > 0
    assert said.splitlines() == [
        f"{np.float32(one.score):.9g} {np.float32(one.box[0] - 0.5):.9g}" for one in wanted
    ]


def test_whole_weights_decide_as_scikit_learn_does(monkeypatch):
    """Within half a step of every weight times the cells' sum."""
    rng = np.random.default_rng(11)
    machines = []

    class Kept(LinearSVC):
        def fit(self, *arguments):
            machines.append(self)
            return super().fit(*arguments)

    monkeypatch.setattr("sklearn.svm.LinearSVC", Kept)
    examples = rng.integers(0, 256, (40, 6, 5, 8), dtype=np.uint8)
    negatives = rng.integers(0, 256, (300, 6, 5, 8), dtype=np.uint8)
    examples[..., 1] //= 4
    weights, bias = linear.fit_linear(examples, negatives)
    both = np.concatenate([examples, negatives])
    mean = (both.reshape(len(both), -1).astype(np.float32) / 128).mean(axis=0)
    theirs = machines[0].decision_function(both.reshape(len(both), -1) / 128 - mean)
    ours = np.einsum("nrck,rck->n", both.astype(np.float64), weights) + bias
    assert ours == pytest.approx(theirs, abs=1e-3)
    tables, whole_bias, scale = linear.quantised(weights, bias)
    whole = np.einsum("nrck,rck->n", both.astype(np.int64), tables.astype(np.int64))
    steps = both.reshape(len(both), -1).sum(axis=1) + 1
    assert np.all(np.abs(scale * (whole + whole_bias) - ours) <= scale * steps / 2)


def test_each_part_shows_the_class_whatever_the_pictures_are_called(tmp_path):
    write_folder(tmp_path / "all", 12, 1, empty=20)  # the empty ones stand behind the others
    collection = read_collection([tmp_path / "all"])
    parts = parts_of(collection)
    shown = [part for part, one in zip(parts, collection.examples, strict=True) if len(one.of("panel"))]
    assert sorted(shown) == sorted([0, 1, 2, 3] * 3) and sorted(parts) == sorted([0, 1, 2, 3] * 8)


def test_folder_without_any_box_is_an_example_of_none(tmp_path):
    write_folder(tmp_path / "with", 8, 1)
    write_folder(tmp_path / "without", 0, 2, empty=3)
    assert len(read_collection([tmp_path / "with", tmp_path / "without"]).examples) == 11
    with pytest.raises(BslamError, match="no box in it"):
        read_collection([tmp_path / "without"])


def test_things_too_small_and_names_that_are_none_in_c_are_refused_before_training(tmp_path, capsys):
    folder = write_folder(tmp_path / "small", 8, 1)
    text = (folder / "labels.csv").read_text().splitlines()
    small = [f"{line.split(',')[0]},panel,10,10,22,30,," for line in text[1:]]
    (folder / "labels.csv").write_text("\n".join([text[0], *small]) + "\n")
    assert main(["detect", "train", str(folder), "--out", str(tmp_path / "m.json")]) == 2
    assert "8 of 8 boxes have less than 400 square pixels" in capsys.readouterr().err
    assert main(["detect", "train", str(folder), "--out", str(tmp_path / "My-Things.json")]) == 2
    assert "the name is not allowed" in capsys.readouterr().err


def test_class_in_too_few_pictures_is_refused(tmp_path, capsys):
    write_folder(tmp_path / "few", 5, 1)
    assert main(["detect", "train", str(tmp_path / "few"), "--out", str(tmp_path / "m.json")]) == 2
    assert "class 'panel' is in 5 pictures; allowed: 8 at least" in capsys.readouterr().err
    assert not (tmp_path / "m.json").exists()


def test_model_that_finds_less_than_half_is_not_written_unless_asked_for(tmp_path, capsys, monkeypatch):
    folder = write_folder(tmp_path / "blind", 10, 1)
    text = (folder / "labels.csv").read_text().splitlines()
    rng = np.random.default_rng(0)
    moved = [text[0]]
    for line in text[1:]:  # boxes where nothing is, in small pictures, which take less time
        name, kind, *_ = line.split(",")
        Image.open(folder / name).reduce(2).save(folder / name)
        left, top = rng.integers(0, 130), rng.integers(0, 70)
        moved.append(f"{name},{kind},{left},{top},{left + 25},{top + 50},,")
    (folder / "labels.csv").write_text("\n".join(moved) + "\n")
    words = ["detect", "train", str(folder), "--out", str(tmp_path / "m.json")]
    steps = []

    def once(*arguments):
        """The same training for both commands."""
        steps.extend([] if steps else train(*arguments))
        return steps

    monkeypatch.setattr(detect, "train", once)
    assert main(words) == 1
    assert "nothing written: 'panel' is found by itself in less than half" in capsys.readouterr().out
    assert not (tmp_path / "m.json").exists() and not (tmp_path / "m.h").exists()
    assert main([*words, "--anyway"]) == 0
    assert (tmp_path / "m.json").exists() and (tmp_path / "m.h").exists() and (tmp_path / "m.html").exists()


def test_pictures_of_any_shape(trained, tmp_path):
    folder = tmp_path / "shapes"
    folder.mkdir()
    for index, size in enumerate([(240, 320), (1000, 300), (37, 41), (640, 480), (300, 400)]):
        Image.new("RGB" if index % 2 else "L", size, 90 if index % 2 == 0 else (90, 10, 200)).save(
            folder / f"{index}.png"
        )
    words = [
        "detect",
        "run",
        str(folder),
        "--model",
        str(trained / "panels.json"),
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(words) == 0
    assert (tmp_path / "out" / "boxes.csv").read_text().count("\n") == 1


def test_missing_or_wrong_inputs_are_named(trained, tmp_path, capsys):
    learn = str(trained / "learn")
    for words, said in (
        (["train", learn], "detect train: --out is missing; allowed: a file to be written, MODEL.json"),
        (
            ["train", learn, "--out", "m.json", "--classes", "tree"],
            "class 'tree' is in no folder; allowed: panel",
        ),
        (["test", learn], "--model is missing"),
        (["run", learn, learn, "--model", str(trained / "panels.json")], "2 sources; allowed: one"),
        (["run", str(tmp_path), "--model", str(trained / "panels.json")], "no picture in it"),
    ):
        assert main(["detect", *words]) == 2
        assert said in capsys.readouterr().err
    collection = read_collection([trained / "learn"])
    assert collection.heights_m == {"panel": 0.5}


@pytest.mark.parametrize("action", ["train", "test", "run"])
def test_a_rig_where_nothing_asks_for_one_is_refused(tmp_path, capsys, action):
    assert main(["detect", action, str(tmp_path), "--rig", "three60"]) != 0
    assert "--rig three60: pictures need none" in capsys.readouterr().err
