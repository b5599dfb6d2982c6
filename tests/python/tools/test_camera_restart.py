"""How restarts in a kept map are counted."""

from collections import Counter

import numpy as np
import pytest

from bslam.experiment.truth import step_times_us
from bslam.log import Sightings
from bslam.world.simulate import load_scenario, simulate
from tools.proofs.camera_restart import DRIVEN_US, Restart, in_view_us, part

STEP_US = 40_000


def _robot(lost_until_us: int, error_m: float, aligned_m: float) -> Restart:
    time_us = np.arange(0, 2 * DRIVEN_US, STEP_US)
    ones = np.ones(len(time_us))
    lost = time_us < lost_until_us
    return Restart(time_us, lost, error_m * ones, aligned_m * ones, 0, None, Counter(), "")


@pytest.mark.parametrize(
    ("error_m", "outcome"), [(0.2, "near"), (0.21, "off"), (0.99, "off"), (1.0, "elsewhere")]
)
def test_outcome_is_by_the_error_in_the_frame_that_is_asked_for(error_m: float, outcome: str) -> None:
    assert _robot(0, error_m, 0.0).outcome(0, False) == outcome
    assert _robot(0, 5.0, error_m).outcome(0, True) == outcome


def test_outcome_is_taken_five_seconds_after_the_time_it_counts_from() -> None:
    robot = _robot(DRIVEN_US + STEP_US, 0.1, 0.1)
    assert robot.outcome(0, False) == "lost"
    assert robot.outcome(STEP_US, False) == "near"


def test_outcome_is_taken_at_the_end_of_the_drive_if_that_comes_before() -> None:
    time_us = np.array([0, DRIVEN_US, DRIVEN_US + STEP_US])
    lost, error_m, aligned_m = np.array([True, True, False]), np.full(3, 0.1), np.full(3, 0.3)
    robot = Restart(time_us, lost, error_m, aligned_m, 0, None, Counter(), "")
    assert robot.outcome(0, False) == "lost"
    assert robot.outcome(None, False) == robot.outcome(DRIVEN_US, False) == "near"
    assert robot.outcome(None, True) == "off"


def _seen(rows: list[tuple[int, int]]) -> Sightings:
    time_us, beacon_id = np.array(rows, dtype=np.int64).T
    nothing = np.zeros(len(rows))
    return Sightings(time_us, beacon_id, nothing, nothing, np.ones(len(rows), dtype=np.bool_))


def test_in_view_wants_two_different_beacons_of_the_map_in_one_frame() -> None:
    rows = [(0, 1), (0, 2), (1, 1), (1, 1), (2, 1), (2, -1), (3, 1), (3, 9), (4, 1), (5, 2), (6, 3), (6, 1)]
    seen = _seen(rows)
    assert in_view_us(seen, {1, 2, 3}, 0) == 0
    assert in_view_us(seen, {1, 2, 3}, 1) == 6
    assert in_view_us(seen, {1, 2}, 1) is None


def test_part_has_the_steps_and_the_frames_of_their_time() -> None:
    log = simulate(load_scenario("paper_room"), 1, 0.6, "speedometer")
    cut = part(log, 100, 200)
    times_us = log.odometry.time_us[100:200]
    np.testing.assert_array_equal(cut.odometry.time_us, times_us)
    inside = (log.sightings.time_us >= times_us[0]) & (log.sightings.time_us <= times_us[-1])
    np.testing.assert_array_equal(cut.sightings.range_m, log.sightings.range_m[inside])
    assert cut.sightings.signature is not None and len(cut.sightings.signature) == inside.sum() > 0
    assert len(step_times_us(part(log, 4000, None))) >= len(log.odometry.time_us) - 4000
