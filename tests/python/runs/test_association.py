"""Association by position and looks, on simulated drives: what it reaches, and what it may not know."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.evaluation.trace import Trace
from bslam.log import SIGNATURE_SIZE, Log, Sightings
from bslam.options import RunOptions
from bslam.runs.runner import run_log
from bslam.world.simulate import load_scenario, simulate

SVM = RunOptions(association="svm")
SEED, SIGMA_MPS, STEPS = 42, 1.0, 2500


def a_drive(name: str) -> Log:
    return simulate(replace(load_scenario(name), steps=STEPS), SEED, SIGMA_MPS)


@pytest.fixture(scope="module")
def pairs() -> Log:
    return a_drive("pairs")


@pytest.fixture(scope="module")
def harder_pairs() -> Log:
    """Where position alone goes wrong, and classes are enough."""
    return simulate(replace(load_scenario("pairs"), steps=2 * STEPS), 13, SIGMA_MPS)


@pytest.fixture(scope="module")
def many_rooms() -> Log:
    """Where position alone goes wrong for good."""
    return simulate(replace(load_scenario("building20"), steps=2 * STEPS), 4, SIGMA_MPS)


def mean_error_m(log: Log, trace: Trace) -> float:
    assert log.truth is not None
    off = trace.pose[:, :2] - np.stack([log.truth.x_m, log.truth.y_m], axis=1)
    return float(np.hypot(*off.T).mean())


def with_sightings(log: Log, rows: Any) -> Log:
    """The drive with some of its sightings."""
    left: dict[str, Any] = {
        name: None if values is None else values[rows] for name, values in vars(log.sightings).items()
    }
    return replace(log, sightings=Sightings(**left))


def relabelled(log: Log) -> Log:
    """Every beacon with another's identity."""
    beacon_id = log.sightings.beacon_id
    return replace(log, sightings=replace(log.sightings, beacon_id=(beacon_id * 5 + 3) % 12))


def test_true_identities_change_no_bit(pairs: Log) -> None:
    one, other = run_log(pairs, SVM), run_log(relabelled(pairs), SVM)
    np.testing.assert_array_equal(one.pose, other.pose)
    np.testing.assert_array_equal(one.covariance, other.covariance)
    assert one.counters == other.counters
    assert [(b.uid, b.x_m, b.y_m) for b in one.beacons] == [(b.uid, b.x_m, b.y_m) for b in other.beacons]
    assert one.counts == other.counts  # the true identities are consistent in both


def test_a_run_by_looks_notices_when_it_is_lost_and_nothing_else(pairs: Log) -> None:
    trace, alone = run_log(pairs, SVM), run_log(pairs, replace(SVM, recovery="off"))
    assert (trace.counters["lost"], trace.counters["withheld"]) == (0, 0)
    assert alone.counters["contradicting"] == 0
    np.testing.assert_array_equal(trace.pose, alone.pose)
    np.testing.assert_array_equal(trace.covariance, alone.covariance)


def test_pairs_are_told_apart(pairs: Log) -> None:
    trace, known = run_log(pairs, SVM), run_log(pairs, RunOptions())
    assert trace.counts.wrong_associations < 0.001 * trace.counts.sightings
    assert trace.counts.deferred < 0.01 * trace.counts.sightings
    assert mean_error_m(pairs, trace) < 1.1 * mean_error_m(pairs, known)


def test_pairs_are_not_told_apart_without_machines(many_rooms: Log) -> None:
    trace = run_log(many_rooms, replace(SVM, parameters=(("learn_budget", 0),)))
    assert trace.counts.wrong_associations > 0.03 * trace.counts.sightings


def test_without_signatures_position_alone_decides(many_rooms: Log) -> None:
    log = replace(many_rooms, sightings=replace(many_rooms.sightings, signature=None))
    blind = run_log(log, SVM)
    assert blind.counters["trained"] == 0
    assert blind.counts.wrong_associations > 0.03 * blind.counts.sightings


def test_a_beacon_that_vanishes_leaves_the_map_and_no_other_does() -> None:
    log = simulate(load_scenario("paper_room"), 1, 0.6, "speedometer")
    seen = log.sightings
    rows = (seen.beacon_id != 1) | (seen.time_us < log.odometry.time_us[-1] // 2)
    gone = with_sightings(log, rows)
    confirmed = [sum(one.confirmed for one in run_log(drive, SVM).beacons) for drive in (log, gone)]
    assert confirmed == [6, 5]


def with_classes(log: Log, share_right: float) -> Log:
    """As a detector with six kinds of beacons would say it, which is right so often."""
    random = np.random.default_rng(5)
    beacon_id = log.sightings.beacon_id
    is_right = random.random(len(beacon_id)) < share_right
    beacon_class = np.where(is_right, 1 + beacon_id % 6, random.integers(1, 7, len(beacon_id)))
    return replace(log, sightings=replace(log.sightings, beacon_class=beacon_class))


def test_classes_help_where_machines_do_not(harder_pairs: Log) -> None:
    untrained = replace(SVM, parameters=(("learn_budget", 0),))
    without, told = run_log(harder_pairs, untrained), run_log(with_classes(harder_pairs, 0.95), untrained)
    assert told.counts.wrong_associations < 0.2 * without.counts.wrong_associations
    assert mean_error_m(harder_pairs, told) < 0.8 * mean_error_m(harder_pairs, without)


def test_directions_alone_find_their_beacons() -> None:
    log = a_drive("paper_room")
    trace = run_log(log, replace(SVM, observation="direction"))
    assert trace.counts.wrong_associations <= 0.001 * trace.counts.sightings
    assert sum(beacon.confirmed for beacon in trace.beacons) <= 7


def test_double_finds_the_same_beacons(pairs: Log) -> None:
    trace = run_log(pairs, replace(SVM, real="double"))
    assert trace.counts.wrong_associations < 0.001 * trace.counts.sightings


@pytest.mark.parametrize("shape", [(1, SIGNATURE_SIZE - 1), (2, SIGNATURE_SIZE), (SIGNATURE_SIZE,)])
def test_signatures_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    slam = Slam({"association": 3})
    before = slam.state_bytes
    with pytest.raises(BslamError, match="signatures of shape"):
        slam.sightings(0, [0.1], [4.0], [-1], [True], signature=np.zeros(shape, np.float32))
    assert slam.state_bytes == before


def test_no_signature_is_used_twice_in_a_run(pairs: Log) -> None:
    signature = pairs.sightings.signature
    assert signature is not None
    assert len(np.unique(signature, axis=0)) == len(signature)


def test_looks_are_the_seed_s_and_change_nothing_else() -> None:
    one, again, other = (simulate(load_scenario("paper_room"), seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.sightings.signature, again.sightings.signature)
    assert one.sightings.signature is not None and other.sightings.signature is not None
    assert not np.array_equal(one.sightings.signature[:5], other.sightings.signature[:5])


def test_beacons_that_look_alike_do_and_others_do_not() -> None:
    log = simulate(load_scenario("lookalikes"), 3)
    signature = log.sightings.signature
    assert signature is not None

    def mean_look(beacon_id: int) -> np.ndarray:
        return signature[log.sightings.beacon_id == beacon_id].mean(axis=0)

    alike = [np.linalg.norm(mean_look(one) - mean_look(one + 7)) for one in (2, 5, 8, 11)]
    other = [np.linalg.norm(mean_look(one) - mean_look(one + 6)) for one in (3, 6, 9, 12)]
    assert max(alike) < min(other)
