"""MRPT's filter as an algorithm: what it is fed comes out as a map and a path."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bslam.algorithms import Sighting
from bslam.errors import BslamError
from bslam.evaluation.metrics import evaluate
from bslam.log import first_steps
from bslam.options import RunOptions
from bslam.runs import methods
from bslam.runs.rival import run_algorithm, setup_for
from bslam.world.simulate import load_scenario, simulate

(METHOD,) = (one for one in methods.shipped_methods(25) if one.name == "mrpt")
OPTIONS = RunOptions(velocity_states=False)

needs_mrpt = pytest.mark.skipif(not METHOD.is_here, reason=METHOD.install)


@pytest.fixture(scope="module")
def log():
    """A short drive through the paper's room with a sensor that sits off the axle, and hardly any noise."""
    room = load_scenario("paper_room")
    sensor = replace(room.sensor, x_m=0.12, y_m=-0.05, yaw_rad=0.3, bearing_sigma_rad=1e-3)
    sensor = replace(sensor, range_sigma_fraction=1e-3, range_sigma_scale_m=math.inf)
    quiet = replace(room, steps=400, sensor=sensor, wheels=replace(room.wheels, sigma_mps=0.01))
    return first_steps(simulate(quiet, 3), 400)


@needs_mrpt
def test_path_and_map_of_a_quiet_drive_are_the_true_ones(log):
    METHOD.prepare()
    trace = run_algorithm(log, OPTIONS, methods.load_method(METHOD), lambda _step: None)
    assert evaluate(log, trace, OPTIONS).error_m[1:].max() < 0.02
    seen = set(log.sightings.beacon_id.tolist())
    assert {one.label for one in trace.beacons} == seen and len(trace.beacons) == len(seen)
    for one in trace.beacons:
        at = np.flatnonzero(log.beacons.beacon_id == one.label)[0]
        assert math.hypot(one.x_m - log.beacons.x_m[at], one.y_m - log.beacons.y_m[at]) < 0.05
    assert (np.linalg.eigvalsh(trace.covariance[-1]) > 0.0).all()


@needs_mrpt
def test_without_identities_it_tells_beacons_apart_by_itself(log):
    options = replace(OPTIONS, association="mahalanobis")
    trace = run_algorithm(first_steps(log, 30), options, methods.load_method(METHOD), lambda _step: None)
    assert {one.label for one in trace.beacons} == {-1}
    assert {one.true_id for one in trace.beacons} == set(first_steps(log, 30).sightings.beacon_id.tolist())


@needs_mrpt
def test_gyro_and_noise_of_the_wheels_reach_it(log):
    """Odometry alone: the covariance is that of our noise model; a gyro makes it narrower in heading."""
    make = methods.load_method(METHOD)
    sd_rad = []
    for rate_radps in (None, 0.0):
        algorithm = make(setup_for(log, OPTIONS))
        algorithm.reset(0)
        algorithm.observe(0, [Sighting(0.1, 2.0, 3)])  # MRPT does not move before it has a landmark
        algorithm.pose()
        for step in range(1, 11):
            if rate_radps is not None:
                algorithm.gyro(40_000 * step, rate_radps, log.robot.gyro_sigma_radps)
            algorithm.odometry(40_000 * step, 0.016, 0.016)
            pose = algorithm.pose()
        assert pose == pytest.approx((0.16, 0.0, 0.0), abs=1e-9)
        sd_rad.append(math.sqrt(algorithm.pose_covariance()[2, 2]))
        algorithm.map()
    wheel_sd_m = log.robot.wheel_speed_sigma_mps * 0.04
    expected_rad = math.sqrt(2.0 * 10.0) * wheel_sd_m / log.robot.wheelbase_m
    assert sd_rad[0] == pytest.approx(expected_rad, rel=1e-3)
    gyro_rad = 0.04 * log.robot.gyro_sigma_radps
    step_rad = math.sqrt(2.0) * wheel_sd_m / log.robot.wheelbase_m
    assert sd_rad[1] == pytest.approx(math.sqrt(10.0 / (step_rad**-2 + gyro_rad**-2)), rel=1e-3)


@needs_mrpt
def test_program_that_ended_is_named(log):
    algorithm = methods.load_method(METHOD)(setup_for(log, OPTIONS))
    algorithm.reset(0)
    algorithm.observe(0, [Sighting(0.1, 2.0, 3)])
    algorithm._program.kill()
    algorithm._program.wait()
    with pytest.raises(BslamError, match="mrpt: its program ended with -9"):
        algorithm.pose()
