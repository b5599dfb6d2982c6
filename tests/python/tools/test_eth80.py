"""Photographs as looks: each sighting has a picture of its own, and the objects stay what they are."""

import numpy as np
from sklearn.svm import LinearSVC

from bslam.world.simulate import load_scenario, simulate
from training import eth80


def disc(rgb):
    """A photograph of a ball: RGBA, transparent round it."""
    y, x = np.mgrid[-1:1:64j, -1:1:64j]
    inside = x**2 + y**2 < 0.7
    return np.dstack([np.full((64, 64, 3), rgb, np.uint8), np.where(inside, 255, 0).astype(np.uint8)])


def test_each_sighting_has_its_own_signature_and_tells_the_object():
    views = {(name, 90, 0): disc(rgb) for name, rgb in {"pea": (60, 140, 50), "plum": (120, 40, 110)}.items()}
    photographer = eth80.Photographer(views, np.random.default_rng(1))
    asked = [(("pea", "plum")[i % 2], 10.0 * i, 1.0 + 0.2 * i) for i in range(30)]
    taken = np.array(list(photographer.take(asked)))
    assert taken.shape == (30, 71) and taken.any(axis=1).all()
    assert len(np.unique(taken, axis=0)) == 30
    is_pea = np.arange(30) % 2 == 0
    assert LinearSVC().fit(taken[:10], is_pea[:10]).score(taken[10:], is_pea[10:]) == 1.0


def test_the_photograph_from_the_nearest_side_is_taken():
    pictures = {
        ("cup", polar, azimuth): disc((polar, azimuth, 0)) for polar in (68, 90) for azimuth in (0, 90, 180)
    }
    photographer = eth80.Photographer(pictures, np.random.default_rng(1))
    taken = [
        photographer._nearest("cup", *seen)[32, 32, :2] for seen in ((-20.0, 4.0), (80.0, 4.0), (130.0, 1.0))
    ]
    assert np.array(taken).tolist() == [[90, 0], [90, 90], [68, 90]]


def test_other_beacons_are_left_out():
    log = simulate(load_scenario("figure3"), seed=1)
    one = int(log.beacons.beacon_id[0])
    less = eth80._only(log, np.array([one]))
    assert less.beacons.beacon_id.tolist() == [one] and less.beacons.x_m[0] == log.beacons.x_m[0]
    rows = log.sightings.beacon_id == one
    assert 0 < rows.sum() < len(rows)
    np.testing.assert_array_equal(less.sightings.range_m, log.sightings.range_m[rows])
