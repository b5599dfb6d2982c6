"""The learning curve counts what it says."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

import measure_decisions
from bslam.log import Odometry, Truth
from measure_decisions import RIGHT, WAITS, WRONG, Decisions, draw, shares


@dataclass(frozen=True)
class Account:
    result: str
    beacon_uid: int | None = None
    reason: str = "none"


def straight(steps=40):
    """A log of 5 cm a step, as far as the curve looks at it."""
    time_us = np.arange(steps + 1) * 40_000
    x_m = 0.05 * np.arange(steps + 1)
    none = np.zeros(steps)
    truth = Truth(time_us, x_m, np.zeros(steps + 1), np.zeros(steps + 1))
    return SimpleNamespace(truth=truth, odometry=Odometry("wheels", time_us[1:], none, none))


def test_decisions_are_judged_and_sorted_by_views():
    decisions = Decisions(straight())
    beacons = [SimpleNamespace(uid=1), SimpleNamespace(uid=2)]
    decisions.step(0, (0.0, 0.0, 0.0), SimpleNamespace(beacons=lambda: beacons))

    def frame(step, *pairs):
        ids, accounts = zip(*pairs, strict=True)
        decisions.frame(step * 40_000, ids, (), accounts)

    frame(1, (7, Account("new", 1)), (8, Account("new", 2)))  # both right, no views before
    frame(2, (7, Account("matched", 1)), (8, Account("matched", 1)))  # right, wrong: one view each
    frame(3, (7, Account("deferred")))  # waits; the robot has gone a decimetre: a second view
    frame(4, (7, Account("new", 2)))  # wrong: it is in the map; two views
    expected = np.zeros_like(decisions.counts)
    expected[0, RIGHT] = 2
    expected[1] = [1, 1, 1]
    expected[2, WRONG] = 1
    assert (RIGHT, WRONG, WAITS) == (0, 1, 2)
    np.testing.assert_array_equal(decisions.counts, expected)


def test_shares_are_per_cent_and_nothing_where_nothing_was_seen():
    np.testing.assert_allclose(
        shares(np.array([[3, 1, 0], [0, 0, 0]])), [[75.0, 25.0, 0.0], [np.nan] * 3], equal_nan=True
    )


def test_the_picture_is_one():
    counts = np.ones((len(measure_decisions.FIRST_VIEWS), 3), np.int64)
    picture = draw({"a": {"svm": counts, "untrained": 2 * counts}, "b": {"svm": counts, "untrained": counts}})
    assert picture.startswith(b"\x89PNG") and len(picture) > 10_000
