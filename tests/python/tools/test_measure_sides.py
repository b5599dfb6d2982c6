"""From which side beacons come into view: counted by hand on a few sightings, and on a drive."""

import numpy as np

from bslam.experiment.sources import ScenarioSource
from measure_sides import APART_MAX, OUT_OF_VIEW_US, SECTORS, Sides, count_sides, log_odds, sectors_between

LATER_US = OUT_OF_VIEW_US + 1


def test_sectors_between_is_the_shorter_way_round():
    assert [sectors_between(SECTORS - 1, one) for one in (0, SECTORS - 1, 7)] == [1, 0, 8]
    assert sectors_between(0, SECTORS - 1) == 1


def test_own_and_other_are_counted_as_they_come_into_view():
    sides = Sides(np.array([[4.0, 0.1], [4.2, 0.1], [0.0, 9.0]]))
    west, east = np.array([0.0, 0.0]), np.array([8.0, 0.0])
    sides.see(0, 0, west, True)  # for the first time: nothing is known yet
    sides.see(0, 40_000, west, True)  # in view
    assert sides.counts.sum() == 0
    sides.see(1, 2 * LATER_US, west, True)  # beacon 0 might be it, and was seen from there
    assert sides.counts[0, 1, 0] == 1
    sides.see(0, 4 * LATER_US, east, True)  # it is itself, from behind, and so might beacon 1 be
    assert sides.counts[0, 0, APART_MAX] == 1
    assert sides.counts[0, 1, APART_MAX] == 1
    sides.see(0, 6 * LATER_US, west, True)  # known from two sides now
    assert sides.counts[1, 0, 0] == 1
    assert sides.counts.sum() == 5


def test_a_distance_tells_apart_what_a_direction_does_not():
    for has_range, others in ((True, 0), (False, 1)):
        sides = Sides(np.array([[4.0, 0.0], [9.0, 0.0]]))
        sides.see(0, 0, np.zeros(2), has_range)
        sides.see(1, LATER_US, np.zeros(2), has_range)
        assert sides.counts[:, 1].sum() == others


def test_log_odds_of_shares():
    counts = np.array([[9, 0], [0, 9]])
    np.testing.assert_allclose(log_odds(counts), [np.log(19.0), -np.log(19.0)])


def test_in_a_building_a_beacon_comes_into_view_from_where_it_was_seen():
    _, of_more = count_sides(ScenarioSource("building20", 100, 0.6, "speedometer").load())
    assert of_more[0, 0] > 0.7 * of_more[0].sum()
