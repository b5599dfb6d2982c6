"""What counts as found, by hand."""

import numpy as np
import pytest

from tools.training.detector_score import DETECTION, OBJECT, Sightings, score
from tools.training.render_set import SEEN
from tools.training.truth import IGNORED, NOTHING, counts, overlaps, owners, teaches


def seen(*rows: dict[str, object]) -> np.ndarray:
    """Beacons in view that count, but for what is said otherwise."""
    table = np.zeros(len(rows), SEEN)
    table["visible_px"] = table["own_px"] = 400
    table["box"] = (10.0, 10.0, 30.0, 30.0)
    for one, row in zip(table, rows, strict=True):
        for name, value in row.items():
            one[name] = value
    return table


@pytest.mark.parametrize(
    "change",
    [
        {"visible_px": 149, "own_px": 149},
        {"cut": True},
        {"slant_rad": np.radians(60.5)},
        {"visible_px": 350, "own_px": 400},
    ],
)
def test_counts_what_is_small_cut_slanted_or_hidden_does_not(change: dict[str, object]) -> None:
    assert counts(seen({}, change)).tolist() == [True, False]


def test_teaches_what_is_cut_above_or_below_but_not_at_the_sides() -> None:
    above, beside = (
        {"cut": True, "box": (10.0, -0.5, 30.0, 30.0)},
        {"cut": True, "box": (-0.5, 5.0, 30.0, 30.0)},
    )
    small = {"cut": True, "box": (10.0, -0.5, 30.0, 30.0), "visible_px": 149, "own_px": 149}
    assert teaches(seen({}, above, beside, small), 320).tolist() == [True, True, False, False]


def test_overlaps_are_intersection_over_union() -> None:
    boxes = np.array([[0.0, 0.0, 10.0, 10.0]])
    others = np.array([[0.0, 0.0, 10.0, 10.0], [5.0, 0.0, 15.0, 10.0], [10.0, 0.0, 20.0, 10.0]])
    assert overlaps(boxes, others)[0] == pytest.approx([1.0, 1.0 / 3.0, 0.0])


def test_owners_half_an_overlap_is_the_object_less_is_nothing() -> None:
    boxes = np.array([[10.0, 10.0, 30.0, 30.0], [20.0, 10.0, 30.0, 30.0], [20.5, 10.0, 30.0, 30.0]])
    owner, overlap = owners(boxes, seen({}), np.array([True]))
    assert owner.tolist() == [0, 0, NOTHING]
    assert overlap == pytest.approx([1.0, 0.5, 0.475])


def test_owners_box_on_a_beacon_that_does_not_count_is_ignored() -> None:
    boxes = np.array([[12.0, 12.0, 28.0, 28.0], [40.0, 40.0, 50.0, 50.0]])
    owner, _ = owners(boxes, seen({"cut": True}), np.array([False]))
    assert owner.tolist() == [IGNORED, NOTHING]
    owner, overlap = owners(boxes, seen(), np.zeros(0, np.bool_))
    assert owner.tolist() == [NOTHING, NOTHING]
    assert overlap.tolist() == [0.0, 0.0]


def sightings(objects: list[int]) -> Sightings:
    """Detections of falling score: of object n, of nothing (-1), ignored (-2), twice (-3); of 4 objects."""
    detections = np.zeros(len(objects), DETECTION)
    detections["score"] = np.arange(len(objects), 0, -1)
    detections["object"] = objects
    there = np.zeros(4, OBJECT)
    there["row"] = np.arange(4)
    return Sightings(detections, there)


def test_score_is_the_lowest_threshold_with_the_precision() -> None:
    result = score(sightings([0, 1, -2, -1, 2, -1, -3]), 0.75)
    assert result.recall == 0.75
    assert result.precision == 0.75
    assert result.threshold == 3.0  # that of object 2: three of four are right
    assert result.found.tolist() == [True, True, True, False]


def test_score_precision_out_of_reach_accepts_nothing() -> None:
    result = score(sightings([-1, -1, 0]), 0.9)
    assert (result.recall, result.threshold) == (0.0, float("inf"))


def test_score_clutter_may_be_accepted() -> None:
    seen_by = sightings([-1, 0])
    seen_by.detections["on_clutter"][0] = True
    assert score(seen_by, 0.9).recall == 0.0
    assert score(seen_by, 0.9, clutter_is_accepted=True).recall == 0.25
