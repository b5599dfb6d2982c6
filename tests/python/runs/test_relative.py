"""The relative pose error of motions whose figures are known; evo 1.38 gives the same from the TUM files."""

from dataclasses import replace

import numpy as np
import pytest

from bslam.evaluation.align import Rigid
from bslam.evaluation.metrics import evaluate, summarise
from bslam.evaluation.relative import relative_pose_error
from bslam.evaluation.truth import step_times_us
from bslam.log import Truth
from bslam.options import RunOptions

STEPS = 500  # of 2 cm
KEYS = ("relative_pose_error", "dead_reckoning_relative_pose_error")


def straight(steps=STEPS, step_m=0.02):
    way_m = step_m * np.arange(steps + 1)
    return np.column_stack([way_m, 0.0 * way_m, 0.0 * way_m])


def figures(made, log, poses):
    trace, options = made.trace(poses, step_times_us(log)), RunOptions()
    return summarise(log, trace, options, evaluate(log, trace, options))


def poses_of(truth):
    return np.column_stack([truth.x_m, truth.y_m, truth.theta_rad])


def test_a_scale_that_is_wrong_is_so_much_a_metre():
    error = relative_pose_error(straight(step_m=0.021), straight())
    assert error == pytest.approx(
        {"translation_rmse_m": 0.05, "rotation_rmse_rad": 0.0, "distance_rmse_m": 0.05}
    )


def test_a_constant_drift_of_the_heading_is_one_arc_beside_one_metre():
    # 0.1 rad in each metre: a chord 2 sin(0.05) / 0.1 long, 0.05 rad beside the true metre.
    s = 0.02 * np.arange(STEPS + 1)
    arc = np.column_stack([np.sin(0.1 * s) / 0.1, (1.0 - np.cos(0.1 * s)) / 0.1, 0.1 * s])
    chord_m = 20.0 * np.sin(0.05)
    error = relative_pose_error(arc, straight())
    assert error["translation_rmse_m"] == pytest.approx(abs(chord_m * np.exp(0.05j) - 1.0))
    assert error["rotation_rmse_rad"] == pytest.approx(0.1)
    assert error["distance_rmse_m"] == pytest.approx(1.0 - chord_m)


def test_pairs_are_consecutive_and_what_does_not_fill_one_is_left_out():
    # 2.5 m: two pairs. A step aside of 0.3 m within the first is in that pair alone, one at the end in none.
    poses = straight(steps=125)
    poses[20:, 1] += 0.3
    poses[-1, 1] += 9.0
    error = relative_pose_error(poses, straight(steps=125))
    assert error["translation_rmse_m"] == pytest.approx(np.sqrt(0.3**2 / 2))


def test_no_frame_changes_it_and_a_turn_past_pi_is_none(made):
    log = made.circle_log(steps=STEPS)
    poses = poses_of(log.truth) + np.random.default_rng(0).normal(0.0, 0.05, (STEPS + 1, 3))
    here = figures(made, log, poses)["relative_pose_error"]
    there = figures(made, log, Rigid(2.5, 30.0, -7.0).poses(poses))["relative_pose_error"]
    assert there == pytest.approx(here)
    assert 0.05 < here["rotation_rmse_rad"] < 0.1  # the circle goes round more than once


def test_odometry_alone_has_its_own(made):
    log = made.circle_log(steps=STEPS, seed=3)
    entry = figures(made, log, poses_of(log.truth))
    exact, alone = (entry[key] for key in KEYS)
    assert max(exact.values()) < 1e-9
    assert min(alone.values()) > 1e-3


def test_a_truth_of_fewer_rows_counts_where_it_is(made):
    log = made.circle_log(steps=STEPS)
    part = Truth(*(column[100:300:5] for column in (log.truth.time_us, *poses_of(log.truth).T)))
    poses = poses_of(log.truth)
    poses[:99] += 5.0
    poses[320:, :2] *= 3.0
    entry = figures(made, replace(log, truth=part), poses)
    # For 40 ms beyond its ends it stands still, by 2 cm; what is beyond that is metres off.
    assert entry["relative_pose_error"]["translation_rmse_m"] < 0.02
    sparse = Truth(*(column[::100] for column in (log.truth.time_us, *poses_of(log.truth).T)))
    assert not any(key in figures(made, replace(log, truth=sparse), poses) for key in KEYS)


def test_a_truth_without_headings_gives_lengths_alone(made):
    log = made.circle_log(steps=STEPS)
    nobody = replace(log.truth, theta_rad=np.full(STEPS + 1, np.nan))
    entry = figures(made, replace(log, truth=nobody), poses_of(log.truth) * (1.1, 1.1, 1.0))
    chord_m = 2.0 * np.sin(0.5 * 1.0)  # of an arc of 1 m on a circle of 1 m
    assert entry["relative_pose_error"] == {"distance_rmse_m": pytest.approx(0.1 * chord_m, rel=0.02)}


def test_less_than_a_metre_of_path_or_no_truth_says_nothing(made):
    log = made.circle_log(steps=49)
    assert not any(key in figures(made, log, poses_of(log.truth)) for key in KEYS)
    assert not any(key in figures(made, replace(log, truth=None), poses_of(log.truth)) for key in KEYS)


def test_what_is_not_finite_makes_no_figure_that_is_not():
    poses = straight()
    poses[60:] = np.nan
    error = relative_pose_error(poses, straight())
    assert error["translation_rmse_m"] == pytest.approx(0.0)
    assert relative_pose_error(np.full_like(poses, np.nan), straight()) == {}
