"""The mean of all ways and maps: the MAP's where all is Gaussian; how well a map fits: by the integral."""

import math

import numpy as np

from bslam.algorithms.posterior import posterior_mean
from bslam.algorithms.smoother import Smoother
from bslam.core.slam import Slam
from bslam.motion import move_on_arc

STEP_S = 0.04


def driven(first_range_ln, steps, bearing_sd_rad, wheel_speed_sigma_mps=0.02):
    """A robot that drives straight on past one beacon, whose readings are exact, though noise is expected."""
    p = Slam.defaults() | {"wheel_speed_sigma_mps": wheel_speed_sigma_mps, "bearing_sd_rad": bearing_sd_rad}
    p |= {"velocity_states": 0}
    smoother = Smoother(p, first_range_ln)
    pose = (0.0, 0.0, 0.0)
    for step in range(steps + 1):
        smoother.add_sighting(step, 0, math.atan2(1.5 - pose[1], 2.0 - pose[0]) - pose[2], math.nan)
        if step < steps:
            pose = move_on_arc(pose, 0.04, 0.04, p["wheelbase_m"])
            smoother.add_step(STEP_S, 0.04, 0.04, pose)
    smoother.solve()
    return smoother


def test_mean_is_the_map_where_the_map_of_the_beacons_is_sure():
    smoother = driven((math.log(2.5), 0.02), 60, 0.001)
    mean, covariance, good = posterior_mean(smoother, 200, np.random.default_rng(1))
    sd_m = math.sqrt(covariance[0, 0])
    assert good > 50
    assert np.abs(mean - smoother.poses[-1]).max() < 0.3 * sd_m


def test_fit_in_a_map_is_the_integral_over_its_poses():
    """Two maps' weights differ by the odds that the readings' joint density gives them."""
    smoother = driven((math.log(2.5), 0.5), 1, 0.05, 1.0)
    near, far = (np.array([[2.0, 1.5]]) * factor for factor in (0.15, 1.0))
    ours = smoother.poses_in(near)[1] - smoother.poses_in(far)[1]
    problem = smoother._problem()

    def ln_integral(beacons):
        """Over way and turn of the only step, by a grid; the arc forbids the rest."""
        weights = problem.weights(smoother.poses, beacons)
        way_m, turn_rad = np.meshgrid(np.linspace(-0.12, 0.2, 161), np.linspace(-0.3, 0.3, 161))
        costs = [
            problem.cost(
                np.array([[0.0, 0.0, 0.0], move_on_arc((0.0, 0.0, 0.0), w - t, w + t, 2.0)]), beacons, weights
            )
            for w, t in zip(way_m.ravel(), turn_rad.ravel(), strict=True)
        ]
        return math.log(np.sum(np.exp(-np.array(costs))))

    assert abs(ours - (ln_integral(near) - ln_integral(far))) < 0.02
