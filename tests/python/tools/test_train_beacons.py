"""tools/training/train_beacons.py: from a folder of pictures to a header that compiles and recognises."""

import csv
import ctypes
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from bslam.datasets.labels import COLUMNS, read_folder
from bslam.datasets.pictures import camera_for, load_picture
from bslam.modelfile import read_recogniser
from tools.blind import blind_model
from tools.training import example_pictures, samples, train_beacons
from tools.training.compiled import FIRMWARE, CompiledSvm
from tools.training.front_end import FrontEnd
from tools.training.truth import overlaps

SIGNATURE = 71
WORLD = 1


@pytest.fixture(scope="module", autouse=True)
def blind():
    """A detector that finds nothing stands in for the trained one."""
    patch = pytest.MonkeyPatch()
    model = blind_model()
    patch.setattr(samples, "FrontEnd", lambda cameras, _: FrontEnd(cameras, model))
    yield
    patch.undo()


@pytest.fixture(scope="module")
def user(tmp_path_factory):
    """A user's folder of twenty pictures, and what the training made of it."""
    folder = tmp_path_factory.mktemp("pictures")
    example_pictures.take(folder, WORLD, 20, seed=0)
    out = tmp_path_factory.mktemp("models")
    assert train_beacons.main([str(folder), "--out", str(out / "my_beacons.h")]) == 0
    return folder, out


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    """Fourteen pictures, taken once."""
    folder = tmp_path_factory.mktemp("taken")
    return folder, example_pictures.take(folder, WORLD, 14, seed=3)


@pytest.fixture
def rows(taken, tmp_path):
    """The rows of a labels file; its pictures are copied to tmp_path."""
    shutil.copytree(taken[0], tmp_path, dirs_exist_ok=True)
    return taken[1]


def write_labels(folder, rows):
    with (folder / "labels.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])


class Compiled:
    """The recogniser of a header, compiled with the C core as the firmware compiles it."""

    def __init__(self, header: Path, folder: Path) -> None:
        source = folder / "recognise.c"
        source.write_text(
            f'#include "vision/classifiers/recogniser.h"\n#include "{header}"\n'
            "int check(void);\nint recognise(const float *s, float *margin);\nconst char *name(int i);\n"
            "int check(void) { return (int)bslam_recogniser_check(&bslam_my_beacons); }\n"
            "int recognise(const float *s, float *margin)\n"
            "{ return bslam_recognise(&bslam_my_beacons, s, margin); }\n"
            "const char *name(int i) { return bslam_my_beacons.objects[i].name; }\n"
        )
        flags = ["-std=c11", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion"]
        parts = [FIRMWARE / "vision/classifiers/svm.c", FIRMWARE / "vision/classifiers/recogniser.c"]
        out = folder / "recognise.so"
        command = [os.environ.get("CC", "cc"), *flags, f"-I{FIRMWARE}", "-shared", "-fPIC"]
        subprocess.run([*command, str(source), *map(str, parts), "-lm", "-o", str(out)], check=True)
        self._library = ctypes.CDLL(str(out))
        self._library.name.restype = ctypes.c_char_p

    def check(self) -> int:
        return self._library.check()

    def recognise(self, signature: np.ndarray) -> str | None:
        pointer = np.ascontiguousarray(signature, np.float32).ctypes.data_as(ctypes.c_void_p)
        index = self._library.recognise(pointer, ctypes.byref(ctypes.c_float()))
        return self._library.name(index).decode() if index >= 0 else None


def boxes_of(folder):
    """(name, signature) of every box in a folder of pictures, by a front end that knows the room."""
    pictures = read_folder(folder).pictures
    frames = [load_picture(picture.path) for picture in pictures]
    front_end = samples.FrontEnd([camera_for(*frames[0].size_px)], None)
    for frame in frames:
        front_end.see(frame.rgb)
    for picture, frame in zip(pictures, frames, strict=True):
        front_end.see(frame.rgb)
        for label in picture.labels:
            yield label.name, front_end.signature(samples._in_frame(frame, label))


def test_twenty_pictures_give_a_header_that_compiles_and_recognises(user, tmp_path):
    folder, out = user
    known = {one.name for one in read_folder(folder).objects}
    library = Compiled(out / "my_beacons.h", tmp_path)
    assert library.check() == 0
    example_pictures.take(tmp_path / "new", WORLD, 25, seed=1)
    answers = [(name, library.recognise(signature)) for name, signature in boxes_of(tmp_path / "new")]
    of_known = [(name, answer) for name, answer in answers if name in known]
    assert len(of_known) > 25
    named = [(name, answer) for name, answer in of_known if answer is not None]
    assert np.mean([name == answer for name, answer in named]) > 0.9
    assert len(named) > 0.8 * len(of_known)


def test_model_file_recognises_as_the_header(user, tmp_path):
    folder, out = user
    library = Compiled(out / "my_beacons.h", tmp_path)
    recogniser = read_recogniser(out / "my_beacons.json", SIGNATURE)
    for _, signature in boxes_of(folder):
        values = recogniser.svm.weights.astype(np.float64) @ signature + recogniser.svm.bias
        best = int(values.argmax())
        wanted = recogniser.objects[best].name if values[best] >= recogniser.reject_margin else None
        assert library.recognise(signature) == wanted


def test_front_end_with_the_model_file_names_what_it_finds(user, tmp_path):
    _, out = user
    example_pictures.take(tmp_path, WORLD, 60, seed=1)
    folder = read_folder(tmp_path)
    frames = [load_picture(picture.path) for picture in folder.pictures]
    recogniser = read_recogniser(out / "my_beacons.json", SIGNATURE)
    front_end = FrontEnd([camera_for(*frames[0].size_px)], recogniser=recogniser)
    for frame in frames:
        front_end.see(frame.rgb)
    right = []
    for picture, frame in zip(folder.pictures, frames, strict=True):
        boxes = np.array([samples._in_frame(frame, label) for label in picture.labels])
        for one in front_end.see(frame.rgb).candidates:
            share = overlaps(np.array([one.outline]), boxes)[0] if len(boxes) else np.zeros(1)
            if one.object is not None and share.max() > 0.5:
                right.append(one.object == picture.labels[int(share.argmax())].name)
                assert one.object_margin >= recogniser.reject_margin
    assert len(right) >= 8 and np.mean(right) > 0.85


def test_header_that_decides_otherwise_than_scikit_learn_is_not_let_through(user):
    folder, out = user
    x = samples.collect(read_folder(folder)).signatures
    header = (out / "my_beacons.h").read_text()
    values = CompiledSvm(header, "bslam_my_beacons.svm").decide(x)
    same, other = (SimpleNamespace(decide=lambda x, off=off: values + off) for off in (0.0, 1e-2))
    train_beacons.check_header(header, "bslam_my_beacons.svm", x, same)
    with pytest.raises(AssertionError, match=r"the header is off by .*; allowed: 1e-05"):
        train_beacons.check_header(header, "bslam_my_beacons.svm", x, other)


def test_training_leaves_a_picture_of_the_confusion_and_says_where_it_comes_from(user):
    _, out = user
    with Image.open(out / "my_beacons.png") as picture:
        assert min(picture.size) > 300
    text = (out / "my_beacons.h").read_text()
    assert "// training set: 20 pictures" in text and "sha256" in text and "// figures: on pictures" in text


def test_training_twice_gives_the_same_files(user, tmp_path):
    folder, out = user
    assert train_beacons.main([str(folder), "--out", str(tmp_path / "my_beacons.h")]) == 0
    for suffix in (".h", ".json", ".png"):
        name = f"my_beacons{suffix}"
        assert (tmp_path / name).read_bytes() == (out / name).read_bytes()


def test_other_things_are_rejected(tmp_path):
    """Two of the objects are the user's, the others' boxes stand for what the detector finds besides."""
    rows = example_pictures.take(tmp_path, WORLD, 30, seed=2)
    seen_in = {row[1]: len({one[0] for one in rows if one[1] == row[1]}) for row in rows if row[1]}
    write_labels(tmp_path, [row for row in rows if seen_in.get(row[1], 0) >= 2])
    folder = read_folder(tmp_path)
    collected = samples.collect(folder)
    mine = sorted(range(len(folder.objects)), key=lambda i: -seen_in[folder.objects[i].name])[:2]
    labels = np.select([collected.labels == one for one in mine], [0, 1], samples.NONE)
    objects = tuple(folder.objects[one] for one in mine)
    counts = train_beacons.train(
        replace(folder, objects=objects), replace(collected, labels=labels), precision=0.9
    )[2]
    assert counts[2].sum() > 20 and counts[2, 2] > 0.9 * counts[2].sum()
    assert counts[3].sum() >= 64
    assert counts[0, 0] + counts[1, 1] > 0.8 * counts[:2].sum()


def test_one_object_alone_is_told_from_the_generic_seeds(rows, tmp_path):
    names = [row[1] for row in rows]
    most = max(set(names) - {""}, key=names.count)
    write_labels(tmp_path, [row for row in rows if row[1] == most])
    folder = read_folder(tmp_path)
    counts = train_beacons.train(folder, samples.collect(folder), precision=0.9)[2]
    assert counts[0, 0] >= 0.8 * counts[0].sum()
    assert counts[2].sum() >= 64 and counts[2, 1] >= 0.9 * counts[2].sum()


# --- what is refused ----------------------------------------------------------------------------------------


def refusal(folder, capsys, *words):
    """What the command says, having written nothing."""
    out = folder / "out/my_beacons.h"
    assert train_beacons.main([str(folder), "--out", str(out), *words]) == 2
    assert not out.parent.exists()
    return capsys.readouterr().err


def test_missing_picture_is_refused(rows, tmp_path, capsys):
    (tmp_path / rows[0][0]).unlink()
    error = refusal(tmp_path, capsys)
    assert f"line 2, column picture: '{rows[0][0]}' is not allowed" in error


def test_class_of_one_picture_is_refused(rows, tmp_path, capsys):
    write_labels(tmp_path, [*rows, [rows[0][0], "lamp", "10", "10", "60", "60", "", ""]])
    error = refusal(tmp_path, capsys)
    assert "class '" in error and "allowed: at least 2 pictures of each class" in error


def test_class_without_any_signature_is_refused(rows, tmp_path, capsys):
    tiny = [[row[0], "dot", "100", "100", "102", "102", "", ""] for row in rows[:3]]
    write_labels(tmp_path, tiny)
    assert "class 'dot': 3 boxes give signatures in 0 pictures" in refusal(tmp_path, capsys)


def test_objects_that_cannot_be_told_apart_are_refused(rows, tmp_path, capsys):
    rows = [row for row in rows if row[1]]
    random = np.random.default_rng(1)
    write_labels(tmp_path, [[row[0], random.choice(list("abcd")), *row[2:6], "", ""] for row in rows])
    assert re.search(
        r"only \d+ of \d+ objects get their own name; allowed: at least half", refusal(tmp_path, capsys)
    )


@pytest.mark.parametrize(
    ("right", "precision", "least", "margin"),
    [
        ("rrrrr", 0.9, 1, 0.0),  # nothing to reject: the machine's own boundary
        ("rrrrw", 0.9, 1, 1.5),
        ("rrwrr", 0.9, 1, 3.5),
        ("rrwrr", 0.8, 1, 0.0),
        ("rrwrr", 0.9, 3, 0.0),  # not reached: as good as it gets with three right ones
        ("wrrww", 0.9, 2, 2.5),
        ("wwwwr", 0.9, 2, None),
    ],
)
def test_reject_margin_by_hand(right, precision, least, margin):
    scores = np.array([5.0, 4.0, 3.0, 2.0, 1.0])
    flags = np.array([letter == "r" for letter in right])
    alike = np.ones(5)
    assert train_beacons.reject_margin(scores, flags, precision, least, alike) == margin
    shuffled = np.array([2, 0, 4, 1, 3])
    assert train_beacons.reject_margin(scores[shuffled], flags[shuffled], precision, least, alike) == margin


def test_reject_margin_counts_samples_by_weight():
    scores, right = np.array([5.0, 4.0, 3.0, 2.0]), np.array([True, False, True, True])
    margins = [
        train_beacons.reject_margin(scores, right, 0.8, 1, np.array([1.0, weight, 1.0, 1.0]))
        for weight in (1.0, 0.5)
    ]
    assert margins == [4.5, 0.0]  # 3 of 4 are too few; 3 of 3.5 suffice


def test_pictures_of_another_camera_are_refused(rows, tmp_path, capsys):
    Image.new("RGB", (400, 200)).save(tmp_path / rows[0][0])
    write_labels(tmp_path, [[rows[0][0], *[""] * 7], *(row for row in rows if row[0] != rows[0][0])])
    error = refusal(tmp_path, capsys, "--rig", "wide180")
    assert f"{rows[0][0]}: is 400x200; allowed: 320x240, its camera's frame" in error
    assert "rig 'nowhere': there is no such rig" in refusal(tmp_path, capsys, "--rig", "nowhere")


@pytest.mark.parametrize(
    "words", [["--out", "My.h"], ["--out", "a.txt"], ["--precision", "0.2"], ["--precision", "x"]]
)
def test_bad_option_is_refused(tmp_path, capsys, words):
    with pytest.raises(SystemExit) as stop:
        train_beacons.main([str(tmp_path), *words])
    assert stop.value.code == 2
    assert "is not allowed; allowed: " in capsys.readouterr().err
