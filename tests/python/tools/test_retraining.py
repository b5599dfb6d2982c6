"""docs/RETRAIN.md walked from one end to the other, with the detector that comes with bslam: twenty pictures,
training, and `bslam look` at new pictures of the same room."""

import re

import numpy as np
import pytest

from bslam.cli import main
from bslam.datasets.labels import read_folder
from tools.training import example_pictures, train_beacons

WORLD = 3


@pytest.fixture(scope="module")
def walked(tmp_path_factory):
    """Folders of the pictures: those trained on, and new ones; and the header."""
    root = tmp_path_factory.mktemp("walk")
    example_pictures.take(root / "old", WORLD, 20, seed=0, least=3)
    example_pictures.take(root / "new", WORLD, 20, seed=1, least=1)
    header = root / "my_beacons.h"
    assert train_beacons.main([str(root / "old"), "--rig", "three60", "--out", str(header)]) == 0
    return root / "old", root / "new", header


def test_names_on_pictures_left_out_are_right(walked):
    """Things of other rooms, of which there are more than a user will ever meet, are counted apart."""
    note = re.search(r"// figures: (.*?)\n// [a-z]", walked[2].read_text(), re.DOTALL)[1]
    note = " ".join(note.replace("//", " ").split())
    right, objects, wrong, named = map(
        int, re.search(r"(\d+) of (\d+) objects recognised, (\d+) of (\d+) names wrong", note).groups()
    )
    assert named >= right > 0.8 * objects and wrong <= 0.1 * named
    assert re.search(r"and \d+ of 64 things of other rooms", note)


def test_look_names_objects_of_new_pictures(walked, tmp_path, capsys):
    old, new, header = walked
    model = str(header.with_suffix(".json"))
    assert main(["look", str(new), "--rig", "three60", "--model", model, "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    (counts,) = re.findall(r"by what came of them: (.*)", printed)
    assert sum(map(int, re.findall(r"\d+", counts))) == 20
    parts = re.split(r"(?m)^\d+_(1_\d+)\.png: .*\n", printed)[1:]
    known = {one.name for one in read_folder(old).objects}
    pictures = read_folder(new).pictures
    there = {one.path.stem: {label.name for label in one.labels} for one in pictures}
    right = [
        name in there[picture]
        for picture, said in zip(parts[::2], parts[1::2], strict=True)
        for name in re.findall(r"(?m)^  (.+?): .* recognised with ", said)
    ]
    assert len(parts) == 2 * 20
    of_known = sum(len(names & known) for names in there.values())
    assert len(right) >= 0.4 * of_known and np.mean(right) >= 0.85
