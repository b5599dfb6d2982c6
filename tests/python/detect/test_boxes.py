"""detect/boxes.py: overlaps, and precision and recall."""

import numpy as np
import pytest
from sklearn.metrics import precision_recall_curve

from bslam.detect.boxes import Found, curve, overlaps

BOX = [0.0, 0.0, 10.0, 10.0]


def found(boxes, scores, labelled):
    return Found(
        np.array(boxes, float).reshape(-1, 4), np.array(scores), np.array(labelled, float).reshape(-1, 4)
    )


def test_overlap_is_intersection_over_union():
    other = np.array([[5.0, 0.0, 15.0, 10.0], [20.0, 20.0, 30.0, 30.0], BOX])
    assert overlaps(np.array([BOX]), other)[0] == pytest.approx([50 / 150, 0.0, 1.0])
    assert overlaps(np.empty((0, 4)), other).shape == (0, 3)


def test_a_labelled_box_is_found_once():
    its = curve([found([BOX, BOX], [0.5, 0.9], [BOX])], 0.5)
    assert its.hits.tolist() == [True, False] and its.scores.tolist() == [0.9, 0.5]
    assert its.recall.tolist() == [1.0, 1.0] and its.precision.tolist() == [1.0, 0.5]


def test_overlap_that_is_asked_for_decides():
    shifted = [5.0, 0.0, 15.0, 10.0]
    assert curve([found([shifted], [1.0], [BOX])], 0.3).hits.tolist() == [True]
    assert curve([found([shifted], [1.0], [BOX])], 0.5).hits.tolist() == [False]


def test_figures_of_a_curve():
    far = [50.0, 50.0, 60.0, 60.0]
    its = curve(
        [found([BOX, far], [0.9, 0.8], [BOX]), found([far], [0.7], [far]), found([far], [0.6], [])], 0.5
    )
    assert its.labelled == 2 and its.pictures == 3
    assert its.recall_at(0.1) == 0.5 and its.recall_at(0.4) == 1.0
    assert its.threshold_at(0.1) == pytest.approx(0.85) and its.threshold_at(0.4) == pytest.approx(0.65)
    assert its.average_precision == pytest.approx(0.5 + 0.5 * 2 / 3)


def test_average_precision_is_that_of_scikit_learns_curve():
    rng = np.random.default_rng(1)
    scores, hits = rng.normal(size=200), rng.random(200) < 0.4
    boxes = [[100.0 * i, 0.0, 100.0 * i + 10.0, 10.0] for i in range(200)]
    pictures = zip(boxes, scores, hits, strict=True)
    its = curve([found([box], [score], [box] if hit else []) for box, score, hit in pictures], 0.5)
    precision, recall, _ = precision_recall_curve(hits, scores)
    best = np.maximum.accumulate(precision[:-1])  # recall falls there
    assert its.average_precision == pytest.approx(-np.sum(np.diff(recall) * best))


def test_nothing_found_is_nothing():
    its = curve([found([], [], [BOX])], 0.5)
    assert its.average_precision == 0.0 and its.recall_at(1.0) == 0.0
    assert its.threshold_at(1.0) == np.inf
