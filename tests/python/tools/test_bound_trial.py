"""What a rule that sums up sightings costs, and where it is wrong."""

import argparse
import math

import numpy as np
import pytest

from bound_trial import Thing, fit, lesson, missed_in, plain, scores, sightings_before, verdict_row
from bslam.core.slam import Slam
from bslam.experiment.camera import UNTOLD_THRESHOLD
from bslam.experiment.ledger import CLUTTER


def thing(identity, score, ranged=True, cut=False, kind=1):
    """All its sightings alike but for their scores."""
    score = np.array(score, np.float64)
    return Thing(
        identity=identity,
        score=score,
        has_range=np.full(len(score), ranged),
        is_cut=np.full(len(score), cut),
        beacon_class=np.full(len(score), kind),
    )


def test_scores_are_summed_as_the_library_sums_them():
    sure = [0.5, 1.0, 2.0, 2.01, 9.0]
    assert scores(thing(1, sure)) == pytest.approx([0.0, 0.5, 1.5, 4.0, 4.0])
    assert scores(thing(1, [0.3, 0.52, 9.0], ranged=False)) == pytest.approx([-0.2, 0.02, 0.05])
    assert plain(thing(1, [0.3, 1.0, 9.0], ranged=False)) == pytest.approx([-0.2, 0.5, 3.0])


def test_a_thing_is_trusted_from_a_sum_on():
    one = thing(1, [1.0] * 6)  # half a point each
    assert [sightings_before(plain, one, trusted) for trusted in (0.5, 0.6, 3.0, 3.1)] == [0, 1, 5, 6]


def test_a_beacon_is_missed_if_no_beginning_of_it_is_trusted():
    eight, four = thing(7, [1.0] * 8), thing(7, [1.0] * 4)
    assert missed_in([eight], [8]) == 1
    assert missed_in([eight], [7]) == 0
    assert missed_in([four, four], [4, 4]) == 1
    assert missed_in([four, four], [4, 3]) == 0
    assert missed_in([four], [4]) == 0
    assert missed_in([thing(CLUTTER, [1.0] * 8)], [8]) == 0


def test_a_row_has_costs_and_faults():
    drives = [[thing(1, [1.0] * 8), thing(CLUTTER, [1.0] * 10)], [thing(1, [1.0] * 8), thing(2, [0.5] * 10)]]
    # From a sum of 2 on: three sightings of 36 each of the first beacon, ten of the second, which is missed;
    # six of the clutter's ten after the one that was the last of its trial.
    assert verdict_row("plain", plain, drives, 2.0) == "| plain, 2 | 44.4 | 0.50 | 0.50 | 0 of 2 | 16.667 |"
    assert verdict_row("plain", plain, [*drives[1:], drives[1][:1]], 9.0).split(" | ")[2] == "1.50"


@pytest.mark.parametrize("with_class", [False, True])
def test_a_machine_that_is_taught_tells_sure_things_from_unsure_ones(with_class):
    random = np.random.default_rng(1)
    things = [thing(k, random.uniform(1.0, 2.0, 20)) for k in range(20)]
    things += [thing(CLUTTER, random.uniform(0.5, 0.9, 20), ranged=False) for _ in range(20)]
    rule = fit(things, with_class)
    assert all(np.all(rule(one) > 0) for one in things[:20])
    assert all(np.all(rule(one) < 0) for one in things[20:])


def test_a_machine_is_told_the_class_only_where_it_is_to_be():
    things = [thing(k, [1.0] * 10, kind=1) for k in range(10)] + [thing(CLUTTER, [1.0] * 10, kind=4)] * 10
    assert (
        fit(things, with_class=True)(things[0])[0] > 0.5 > -0.5 > fit(things, with_class=True)(things[-1])[0]
    )
    assert fit(things, with_class=False)(things[0]) == pytest.approx(0.0, abs=0.01)


def test_what_to_teach_is_a_world_and_its_seeds():
    assert lesson("pairs=100:106") == ("pairs", range(100, 106))
    for text in ("pairs", "pairs=3:2"):
        with pytest.raises((ValueError, argparse.ArgumentTypeError)):
            lesson(text)


@pytest.mark.parametrize("ranged", [True, False])
@pytest.mark.parametrize("score", [0.55, 1.0, 1.9, 2.1, 6.0])
def test_scores_say_of_a_sighting_what_the_core_adds_for_it(score, ranged):
    slam = Slam({"association": 3, "trust_score": UNTOLD_THRESHOLD.whole}, looks=True)
    slam.sightings(1000, [1.0], [4.0], [-1], [True], score=[1.0])  # it measures distances
    slam.sightings(2000, [-1.0], [4.0 if ranged else math.nan], [-1], [True], score=[score])
    made = slam._slam.ekf.beacons[1]
    assert scores(thing(1, [score], ranged)) == pytest.approx([made.score_sum], abs=1e-6)
