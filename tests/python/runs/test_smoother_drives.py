"""Whole drives in direction only through the smoother: ones that were lost, or too sure by far, once."""

from dataclasses import replace
from math import tau

import pytest

from bslam.evaluation.metrics import evaluate, summarise
from bslam.options import RunOptions
from bslam.runs.runner import run_log
from bslam.world.simulate import load_scenario, simulate


@pytest.mark.parametrize(
    ("seed", "field_of_view_rad"),
    [
        pytest.param(3048, tau, id="a turn on the spot, joined, shrank the map"),
        pytest.param(2020, tau, id="the same, with a bend as wrong as the path was"),
        pytest.param(1016, tau / 2, id="a beacon leapt over the way that it was seen from"),
    ],
)
def test_drive_stays_near_the_bound_and_knows_what_it_errs_by(seed, field_of_view_rad):
    room = load_scenario("paper_room")
    log = simulate(replace(room, sensor=replace(room.sensor, field_of_view_rad=field_of_view_rad)), seed, 1.0)
    options = RunOptions(observation="direction", association="known", filter="smoother", seed=seed)
    trace = run_log(log, options)
    figures = summarise(log, trace, options, evaluate(log, trace, options))
    assert not figures["diverged"]
    assert figures["position_error_m"]["mean"] < 1.5 * figures["bound_error_m"]
    assert figures["nees_mean"] < 6.0
