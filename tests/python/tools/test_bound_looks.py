"""Machines that are told: what they answer, and that nothing else is changed by them."""

from dataclasses import replace

import numpy as np
import pytest

from bound_looks import looks_of, row
from bslam.core.learner import encode
from bslam.experiment.runner import run_log
from bslam.experiment.sources import ScenarioSource
from measure_association import only, options_of
from told_machines import NO_LOOK, SURE, SureSlam, TaughtSlam

SECONDS = 40


@pytest.fixture(scope="module")
def log():
    """The first seconds of a drive, of simulated sightings."""
    log = ScenarioSource("lookalikes", 100, 0.6, "speedometer").load()
    return replace(log, sightings=only(log.sightings, log.sightings.time_us < SECONDS * 1_000_000))


def run(log, look_of=None, robot=SureSlam):
    """A run by looks, and the robot; without `look_of` by its own machines."""
    made = []

    def factory(params, beacons):
        made.append(robot(look_of or {}, log, params=params, beacons_max=beacons, recovery=True))
        return made[0]

    options = options_of("svm", "simulated", 0.6, 100)
    return run_log(log, options, slam_factory=factory if look_of is not None else None), made


def test_what_looks_the_same_has_one_look():
    own, alike = looks_of("lookalikes", False), looks_of("lookalikes", True)
    assert len(set(own.values())) == 50
    assert len(set(alike.values())) == 35
    assert alike[44] == alike[3] == 3


def test_told_nothing_it_runs_as_ever(log):
    untold, _ = run(log)
    told, _ = run(log, {})
    np.testing.assert_array_equal(told.pose, untold.pose)
    assert told.counts == untold.counts


def test_a_sure_machine_knows_its_beacon_from_the_others(log):
    _, (slam,) = run(log, looks_of("lookalikes", False))
    samples = encode(slam._raw, np.ascontiguousarray(log.sightings.signature, np.float32))
    shown = [slam.look_of_beacon(one.uid) for one in slam.beacons()]
    slam._looks_now = shown
    assert len(shown) > 5 and NO_LOOK not in shown
    params = slam._ffi.addressof(slam._slam.params)
    for i in range(0, len(log.sightings.beacon_id), 97):
        for index, look in enumerate(shown):
            value = slam._answers.ask(slam._looks, params, index, samples + i).value
            is_it = log.sightings.beacon_id[i] == look
            assert value == pytest.approx(SURE if is_it else -SURE)


def test_what_is_no_beacon_is_left_to_the_machines(log):
    _, (slam,) = run(log, looks_of("lookalikes", False))
    samples = encode(slam._raw, np.ascontiguousarray(log.sightings.signature, np.float32))
    slam._looks_now = [NO_LOOK] * len(slam.beacons())
    params = slam._ffi.addressof(slam._slam.params)
    own = slam._ask_machines(slam._looks, params, 0, samples)
    told = slam._answers.ask(slam._looks, params, 0, samples)
    assert (told.value, told.weight) == (own.value, own.weight)


def test_what_it_is_told_decides(log):
    """Where all look the same position alone tells them apart: more waits, and less is found again."""
    told, _ = run(log, looks_of("lookalikes", False))
    all_alike, _ = run(log, dict.fromkeys(looks_of("lookalikes", False), 0))
    assert told.counts.wrong_associations == 0
    assert told.counts.deferred < all_alike.counts.deferred
    assert told.counts.missed < all_alike.counts.missed


def test_told_nothing_what_would_be_taught_runs_as_ever(log):
    untold, _ = run(log)
    taught, _ = run(log, {}, TaughtSlam)
    np.testing.assert_array_equal(taught.pose, untold.pose)


def test_machines_that_are_taught_tell_their_beacons_from_the_others(log):
    look_of = looks_of("lookalikes", True)
    _, (slam,) = run(log, look_of, TaughtSlam)
    samples = encode(slam._raw, np.ascontiguousarray(log.sightings.signature, np.float32))
    params = slam._ffi.addressof(slam._slam.params)
    slam._looks_now = shown = [slam.look_of_beacon(one.uid) for one in slam.beacons()]
    own, other = [], []
    for i in range(0, len(log.sightings.beacon_id), 97):
        seen = look_of.get(log.sightings.beacon_id[i], NO_LOOK)
        for index, look in enumerate(shown):
            opinion = slam._answers.ask(slam._looks, params, index, samples + i)
            assert 0 < opinion.weight < 1
            (own if seen == look else other).append(opinion.value > 0)
    assert np.mean(own) > 0.99 and np.mean(other) < 0.01


def test_a_machine_is_taught_of_all_that_was_seen(log):
    """Matched or not; that of each look by as many sightings as there were by then."""
    look_of = looks_of("lookalikes", True)
    _, (slam,) = run(log, look_of, TaughtSlam)
    looks = [look_of.get(one, NO_LOOK) for one in log.sightings.beacon_id.tolist()]
    assert {look: len(rows) for look, rows in slam._seen.items()} == {
        look: looks.count(look) for look in set(looks) - {NO_LOOK}
    }
    for look, machine in slam._machines.items():
        assert machine.sightings <= len(slam._seen[look]) < 1.3 * machine.sightings + 1


def test_a_line_has_the_ratio_of_each_draw():
    error_m = np.array([[0.2, 0.1], [0.3, 0.1]])
    line = row("svm", error_m, np.zeros((2, 2)), np.full((2, 2), 0.1))
    assert line.split(" | ")[-2:] == ["1.5", "1.5, 2 |"]
