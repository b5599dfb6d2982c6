"""Other classifiers on the detector's boxes: what they are told, what counts as found; objects by size."""

import numpy as np
import pytest

import measure_bound
from bslam.core.vision import feature_counts
from measure_bound import JUDGES, Proposed, kept, sightings
from measure_stages import shorter_sides, size_rows
from training.detector_samples import BoxSamples
from training.detector_score import OBJECT, is_found
from training.render_set import KINDS, SEEN, World
from training.truth import NOTHING

BOXES = np.array([[10, 10, 30, 30], [12, 10, 32, 30], [60, 10, 80, 30], [14, 14, 18, 18]], np.float32)


def samples_of(features: np.ndarray, label: np.ndarray, frame: np.ndarray, world: np.ndarray) -> BoxSamples:
    count = len(features)
    glances = np.zeros((count, feature_counts()[1]), np.float32)
    overlap = np.where(label >= 0, 0.9, 0.0).astype(np.float32)
    return BoxSamples(features, glances, np.zeros(count, np.bool_), label, overlap, label, frame, world)


@pytest.mark.parametrize(("values", "left"), [([1, 2, 0, 3], [3, 2]), ([3, 2, 4, 1], [2, 0])])
def test_of_boxes_that_overlap_or_lie_in_one_another_the_surest_is_kept(values, left):
    assert kept(BOXES, np.array(values, float)) == left


def test_each_frame_and_world_is_looked_at_by_itself():
    owner = np.array([5, 5, NOTHING, 5])
    frame, world = np.array([0, 0, 0, 1], np.int32), np.array([7, 7, 7, 8], np.int32)
    samples = samples_of(np.zeros((4, 2), np.float32), owner, frame, world)
    objects = np.array([(7, 0, 5, 0, 0, 2.0), (8, 1, 5, 0, 0, 2.0), (8, 1, 6, 0, 0, 2.0)], OBJECT)
    seen = sightings(Proposed(samples, BOXES, owner, objects), np.array([2.0, 1.0, 0.5, 0.1]))
    assert seen.detections["score"].tolist() == pytest.approx([2.0, 0.5, 0.1])
    assert seen.detections["world"].tolist() == [7, 7, 8]
    assert is_found(seen.objects, seen.detections).tolist() == [True, True, False]


@pytest.mark.parametrize("name", ["trees", "forest", "kernel", "network"])
def test_judges_tell_what_two_features_tell_together(name, monkeypatch):
    monkeypatch.setattr(measure_bound, "NEGATIVES", 2000)
    random = np.random.default_rng(3)
    features = random.normal(size=(4000, 4)).astype(np.float32)
    is_beacon = features[:, 0] * features[:, 1] > 0  # no linear machine tells it
    label = np.where(is_beacon, random.integers(len(KINDS), size=4000), NOTHING)
    none = np.zeros(4000, np.int32)
    samples = samples_of(features, label, none, none)
    values = JUDGES[name](samples.of(np.arange(3000)))(samples.of(np.arange(3000, 4000)))
    right, wrong = values[is_beacon[3000:]], values[~is_beacon[3000:]]
    assert (right[:, None] > wrong[None, :]).mean() > 0.9


def test_objects_by_the_shorter_side_of_their_own_box():
    table = np.zeros(2, SEEN)
    table["box"] = [(0, 0, 12, 40), (5, 5, 50, 15)]
    blank = np.zeros((1, 1, 1))
    worlds = [World(3, blank, blank, blank, table), World(4, blank, blank, blank, table[::-1])]
    objects = np.array([(4, 0, 0, 0, 0, 1.0), (3, 0, 0, 0, 0, 1.0), (3, 0, 1, 0, 0, 1.0)], OBJECT)
    sides = shorter_sides(objects, worlds)
    assert sides.tolist() == [10.0, 12.0, 10.0]
    rows = size_rows(np.array([0.0, 9.9, 10.0, 400.0]))
    assert np.sum(list(rows.values()), axis=0).tolist() == [1, 1, 1, 1]
    assert rows["0 to 10 px"].tolist() == [True, True, False, False]
    assert rows["from 40 px"].tolist() == [False, False, False, True]
