"""What makes a map exact, and a run off, by hand."""

import numpy as np
import pytest

from bslam.evaluation.consistency import share_interval_95
from bslam.evaluation.failure import is_exact, map_one_to_one, was_off

TRUE = np.array([[0.0, 0.0], [0.6, 0.0], [5.0, 5.0]])
ALL = np.ones(3, bool)
TIME_S = np.arange(0.0, 30.0, 0.5)


@pytest.mark.parametrize(
    ("mapped", "needed", "counts"),
    [
        (TRUE, ALL, (3, 0, 0, 0)),
        ([[0.35, 0.0], [0.95, 0.0], [5.0, 5.4]], ALL, (3, 0, 0, 0)),  # the first is nearer to the second
        ([*TRUE, [5.1, 5.0]], ALL, (3, 1, 0, 0)),
        ([*TRUE, [3.0, 3.0]], ALL, (3, 0, 0, 1)),
        (TRUE[:2], ALL, (2, 0, 1, 0)),
        (TRUE[:2], np.array([True, True, False]), (2, 0, 0, 0)),  # hardly sighted: nobody misses it
        ([[0.3, 0.0]], np.array([False, True, False]), (1, 0, 0, 0)),  # who is needed goes first
        ([[5.0, 5.51]], np.array([False, False, True]), (0, 0, 1, 1)),
        ([[np.nan, 0.0]], ALL, (0, 0, 3, 1)),
        (np.empty((0, 2)), ALL, (0, 0, 3, 0)),
    ],
)
def test_map_one_to_one(mapped, needed, counts):
    found = map_one_to_one(np.asarray(mapped, float), TRUE, needed)
    assert tuple(found.values()) == counts
    assert list(found) == ["matched", "doubled", "missing", "false"]
    assert is_exact(found) is (counts[1:] == (0, 0, 0))


@pytest.mark.parametrize(("last_s", "expected"), [(14.5, False), (15.0, True)])
def test_off_for_five_seconds_on_end(last_s, expected):
    error_m = np.where((TIME_S >= 10.0) & (last_s >= TIME_S), 1.2, 0.9)
    assert was_off(TIME_S, error_m) is expected
    error_m[24] = np.nan  # where the truth is not known nothing is said
    assert was_off(TIME_S, error_m) is expected
    error_m[24] = 1.0
    assert not was_off(TIME_S, error_m)


def test_off_is_beside_known_association_what_that_is_not():
    error_m = np.full(len(TIME_S), 2.0)
    assert was_off(TIME_S, error_m, np.full(len(TIME_S), 0.6))
    assert not was_off(TIME_S, error_m, np.full(len(TIME_S), 0.7))
    assert was_off(TIME_S, error_m, np.full(len(TIME_S), np.nan))
    assert not was_off(TIME_S, np.full(len(TIME_S), 0.9), np.full(len(TIME_S), 0.1))


def test_interval_of_a_share_is_wilsons():
    assert share_interval_95(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert share_interval_95(3, 40) == pytest.approx((0.0258, 0.1986), abs=1e-4)
    assert share_interval_95(40, 40) == pytest.approx((0.9124, 1.0), abs=1e-4)
