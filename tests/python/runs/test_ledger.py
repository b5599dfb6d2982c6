"""Counting associations on cases made by hand."""

from dataclasses import dataclass

import numpy as np
import pytest

from bslam.evaluation.ledger import CLUTTER, Ledger, corrupt_identities
from bslam.evaluation.trace import SightingCounts


@dataclass(frozen=True)
class Account:
    result: str
    beacon_uid: int | None = None
    reason: str = "none"


def book(ledger, *rows):
    """Rows (true_id, mappable, account) of one frame."""
    ledger.book(*(list(column) for column in zip(*rows, strict=True)))


@pytest.fixture
def in_map():
    """The uids that the map holds; a test changes the list."""
    return []


@pytest.fixture
def ledger(in_map):
    return Ledger(lambda: in_map)


def test_right_matches_count_as_nothing_but_sightings(ledger, in_map):
    in_map += [10, 11]
    book(ledger, (3, True, Account("new", 10)), (5, True, Account("new", 11)))
    book(ledger, (3, True, Account("matched", 10)), (5, True, Account("matched", 11)))
    assert ledger.counts() == SightingCounts(sightings=4)
    assert (ledger.identity(10), ledger.identity(11), ledger.identity(12)) == (3, 5, CLUTTER)


def test_wrong_associations_are_of_other_identity_clutter_or_moving_things(ledger, in_map):
    in_map += [10]
    book(ledger, (3, True, Account("new", 10)))
    book(ledger, *[(3, True, Account("matched", 10))] * 4)
    book(
        ledger,
        (5, True, Account("matched", 10)),  # another beacon
        (CLUTTER, True, Account("matched", 10)),
        (3, False, Account("matched", 10)),  # a moving thing, whatever its number
        (3, True, Account("matched", 10)),
    )
    assert ledger.counts().wrong_associations == 3


def test_matching_a_beacon_that_clutter_made_is_wrong(ledger, in_map):
    in_map += [10]
    book(ledger, (CLUTTER, True, Account("new", 10)))
    book(ledger, (3, True, Account("matched", 10)))
    assert ledger.counts().wrong_associations == 1


def test_a_beacon_is_what_most_of_its_sightings_were_so_far(ledger, in_map):
    in_map += [10]
    book(ledger, (CLUTTER, True, Account("new", 10)))
    book(ledger, *[(3, True, Account("matched", 10))] * 5)
    assert ledger.identity(10) == 3
    assert ledger.counts().wrong_associations == 2  # until three of its sightings outnumbered the first
    book(ledger, (CLUTTER, True, Account("matched", 10)))
    assert ledger.counts().wrong_associations == 3


def test_false_new_needs_a_beacon_of_that_identity_in_the_map(ledger, in_map):
    in_map += [10]
    book(ledger, (3, True, Account("new", 10)))
    in_map += [11]
    book(ledger, (3, True, Account("new", 11)))
    in_map.clear()  # both removed
    in_map += [12]
    book(ledger, (3, True, Account("new", 12)))
    assert ledger.counts().false_new == 1


def test_false_new_within_one_frame(ledger, in_map):
    in_map += [10, 11]
    book(ledger, (3, True, Account("new", 10)), (3, True, Account("new", 11)))
    assert ledger.counts().false_new == 1


def test_missed_counts_rejected_and_deferred_sightings_of_mapped_beacons(ledger, in_map):
    in_map += [10]
    book(ledger, (3, True, Account("new", 10)))
    book(
        ledger,
        (3, True, Account("rejected", reason="gate")),
        (3, True, Account("deferred", reason="ambiguous")),
        (5, True, Account("rejected", reason="map_full")),  # not in the map: nothing missed
        (CLUTTER, True, Account("rejected", reason="gate")),
    )
    counts = ledger.counts()
    assert (counts.missed, counts.rejected, counts.deferred) == (2, 3, 1)


def test_a_moving_thing_refused_by_its_class_is_not_gated_out(ledger):
    book(ledger, (2, False, Account("rejected", reason="class")))
    assert ledger.counts() == SightingCounts(sightings=1)


def test_a_refused_frame_counts_its_sightings_and_what_was_missed(ledger, in_map):
    in_map += [10]
    book(ledger, (3, True, Account("new", 10)))
    ledger.book_refused([3, 5, 3], [True, True, False])
    assert ledger.counts() == SightingCounts(sightings=4, missed=1, refused=3)


def test_corrupt_identities_changes_the_share_asked_for_to_others_that_exist():
    identity = np.tile([3, 5, 8, -1], 5000)
    changed = corrupt_identities(identity, 0.1, seed=4)
    beacons = identity >= 0
    assert set(changed[beacons].tolist()) == {3, 5, 8}
    assert (changed[~beacons] == -1).all()
    # 15000 draws: standard deviation 0.0024.
    assert np.mean(changed[beacons] != identity[beacons]) == pytest.approx(0.1, abs=0.01)
    assert np.array_equal(changed, corrupt_identities(identity, 0.1, seed=4))
    assert not np.array_equal(changed, corrupt_identities(identity, 0.1, seed=5))


def test_corrupt_identities_at_rate_one_leaves_none_right_and_at_zero_all():
    identity = np.array([3, 5, 8, 3])
    assert not np.any(corrupt_identities(identity, 1.0, seed=0) == identity)
    assert np.array_equal(corrupt_identities(identity, 0.0, seed=0), identity)


def test_corrupt_identities_with_a_single_beacon_has_nothing_to_confuse():
    assert corrupt_identities(np.array([3, 3]), 1.0, seed=0).tolist() == [3, 3]
