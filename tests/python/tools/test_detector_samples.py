"""What detectors are trained on: which frames and boxes of a rendered world are taken."""

from pathlib import Path

import numpy as np
import pytest

from tools.training.detector_samples import RECOLOURED, BoxSamples, gather_boxes
from tools.training.render_set import FRAMES_A_WORLD, render_set
from tools.training.truth import NOTHING

SEED = 1


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("worlds")
    render_set(path, "pinhole", "train", [SEED], 1)
    return path


def boxes(folder: Path, nothing_step: int) -> BoxSamples:
    return gather_boxes(folder, "pinhole", "train", [SEED], None, 1, nothing_step)


def test_each_frame_is_looked_at_once_every_second_one_in_other_colours(folder: Path) -> None:
    found = boxes(folder, 1)
    plain = found.world == SEED
    assert (found.world[~plain] == SEED + RECOLOURED).all()
    assert set(found.frame[plain]) <= set(range(1, FRAMES_A_WORLD, 2))
    assert set(found.frame[~plain]) <= set(range(0, FRAMES_A_WORLD, 2))
    assert len(set(found.frame)) > 20


def test_boxes_of_nothing_are_thinned_and_no_others(folder: Path) -> None:
    found, thinned = boxes(folder, 1), boxes(folder, 3)
    there = found.label != NOTHING
    assert 0 < there.sum() < len(there)
    assert np.array_equal(found.features[there], thinned.features[thinned.label != NOTHING])
    nothing, left = (~there).sum(), (thinned.label == NOTHING).sum()
    assert left == pytest.approx(nothing / 3, rel=0.15)
