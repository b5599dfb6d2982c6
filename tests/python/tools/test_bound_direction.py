"""What can be known of a drive in direction only at a moment."""

import numpy as np

from bound_direction import moments
from bslam.experiment.options import RunOptions
from bslam.world.simulate import load_scenario, simulate


def _moment(sigma_mps: float, drawn: int):
    log = simulate(load_scenario("paper_room"), 3, sigma_mps)
    options = RunOptions(observation="direction", association="known", filter="smoother", seed=3)
    return moments(log, options, np.array([30.0]), drawn)[0]


def test_all_are_near_the_truth_where_wheels_err_little_and_the_doubt_says_so() -> None:
    found = _moment(0.01, 60)
    assert found.time_s == 30.0
    assert max(found.core_m, found.map_m, found.mean_m) < 0.05
    assert found.mean_sd_m < 0.05


def test_bound_errs_less_than_what_does_not_know_the_truth() -> None:
    found = _moment(1.0, 0)
    assert found.bound_m < min(found.core_m, found.map_m)
    assert np.isnan(found.mean_m)
