"""Sightings that come late: the filter stays accurate and consistent in each of its forms."""

from dataclasses import replace

import numpy as np
import pytest

from bslam.evaluation import metrics
from bslam.options import RunOptions
from bslam.runs.runner import run_log
from bslam.world.scenario import load_scenario
from bslam.world.simulate import simulate


@pytest.mark.parametrize("velocity_states", [True, False])
@pytest.mark.parametrize("delay_us", [0, 130_000, 300_000])
def test_late_sightings_leave_the_filter_consistent(delay_us, velocity_states):
    room = load_scenario("paper_room")
    late = replace(room, sensor=replace(room.sensor, delay_us=delay_us))
    nees, error_cm = [], []
    for seed in range(500, 504):
        log = simulate(late, seed, sigma_mps=0.6)
        options = RunOptions(velocity_states=velocity_states)
        trace = run_log(log, options)
        evaluation = metrics.evaluate(log, trace, options)
        entry = metrics.summarise(log, trace, options, evaluation)
        nees.append(entry["nees_mean"])
        error_cm.append(100.0 * entry["position_error_m"]["mean"])
    # Four runs: 3 is consistent; the band is as wide as their scatter, and far from the 10 to 1000 of a
    # filter that takes the way since the image as exact.
    assert 1.5 < np.mean(nees) < 4.5
    assert np.mean(error_cm) < (9.0 if velocity_states else 12.0)
