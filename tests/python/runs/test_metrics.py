"""The figures of summary.json on traces made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from bslam.evaluation.align import Rigid
from bslam.evaluation.metrics import evaluate, map_pairs, summarise
from bslam.evaluation.trace import SightingCounts
from bslam.evaluation.truth import step_times_us
from bslam.log import Truth
from bslam.options import RunOptions

OPTIONS = RunOptions(filter="standard")
STEPS = 3000  # 120 s


@pytest.fixture
def log(made):
    return made.circle_log(steps=STEPS)


def true_poses(log):
    return np.column_stack([log.truth.x_m, log.truth.y_m, log.truth.theta_rad])


def figures(log, trace, options=OPTIONS, align=None):
    options = replace(options, align=align)
    return summarise(log, trace, options, evaluate(log, trace, options))


def test_position_error_is_the_distance_at_each_step_after_the_first(made, log):
    poses = true_poses(log)
    poses[1:, 0] += np.where(np.arange(1, STEPS + 1) % 2 == 0, 0.3, 0.1)
    error = figures(log, made.trace(poses, step_times_us(log)))["position_error_m"]
    assert error["mean"] == pytest.approx(0.2)
    assert (error["min"], error["max"]) == (pytest.approx(0.1), pytest.approx(0.3))
    assert error["std"] == pytest.approx(0.1)
    assert error["rmse"] == pytest.approx(np.sqrt(0.05))


def test_first_and_last_50_s_are_means_of_their_steps(made, log):
    poses, time_s = true_poses(log), log.truth.time_us * 1e-6
    poses[:, 1] += np.where(time_s <= 50.0, 0.4, np.where(time_s > 70.0, 0.1, 9.0))
    entry = figures(log, made.trace(poses, step_times_us(log)))
    assert entry["position_error_first_50s_m"] == pytest.approx(0.4)
    assert entry["position_error_last_50s_m"] == pytest.approx(0.1)


def test_diverged_looks_at_the_last_1000_steps(made, log):
    for step, expected in ((STEPS - 1000, False), (STEPS - 999, True), (STEPS, True)):
        poses = true_poses(log)
        poses[step, 0] += 2.1
        assert figures(log, made.trace(poses, step_times_us(log)))["diverged"] is expected


def test_a_run_fails_by_what_is_named(made, log):
    exact = [
        made.map_beacon(uid, *one)
        for uid, one in enumerate(
            zip(made.beacons.beacon_id, made.beacons.x_m, made.beacons.y_m, strict=True)
        )
    ]
    poses, times_us = true_poses(log), step_times_us(log)
    good = figures(log, made.trace(poses, times_us, exact))
    assert good["map_one_to_one"] == {"matched": 3, "doubled": 0, "missing": 0, "false": 0}
    assert (good["failed"], good["failed_by"]) == (False, [])
    lacking = figures(log, made.trace(poses, times_us, exact[:2]))
    assert lacking["map_one_to_one"]["missing"] == 1 and lacking["failed_by"] == ["map"]
    off = poses.copy()
    off[500:640, 0] += 1.1  # 5.6 s
    assert figures(log, made.trace(off, times_us, exact))["failed_by"] == ["off"]
    sure = np.tile(1e-4 * np.eye(3), (STEPS + 1, 1, 1))
    late = poses.copy()
    late[-1200:, 0] += 0.05  # NEES 25
    assert figures(log, made.trace(late, times_us, exact, sure))["failed_by"] == ["nees"]
    late[-1:, 0] += 3.0
    entry = figures(log, made.trace(late, times_us, exact, sure))
    assert entry["failed"] is True and entry["failed_by"] == ["diverged", "nees"]


def test_what_is_not_finite_is_diverged(made, log):
    poses = true_poses(log)
    poses[100] = np.nan
    entry = figures(log, made.trace(poses, step_times_us(log)))
    assert entry["diverged"] is True


def test_nees_starts_at_step_51(made, log):
    poses = true_poses(log)
    poses[:51, 0] += 5.0
    poses[51:, 0] += 0.1  # 0.1^2 / 0.01 = 1
    poses[-100:, 0] += 0.2  # 9
    entry = figures(log, made.trace(poses, step_times_us(log)))
    scored = STEPS - 50
    assert entry["nees_mean"] == pytest.approx(1.0 + 8.0 * 100 / scored)
    assert entry["nees_inside_95"] == pytest.approx(1.0 - 100 / scored)


def test_a_filter_that_is_sure_of_what_is_wrong_has_it_said(made, log):
    poses = true_poses(log)
    poses[:, 0] += 0.1
    sure = made.trace(poses, step_times_us(log), covariance=np.tile(1e-8 * np.eye(3), (STEPS + 1, 1, 1)))
    assert any(one.startswith("NEES 1e+06 for 3: the filter is sure") for one in figures(log, sure)["notes"])
    assert not any(
        one.startswith("NEES") for one in figures(log, made.trace(poses, step_times_us(log)))["notes"]
    )


def test_dead_reckoning_is_odometry_alone(made):
    log = made.circle_log(steps=500, seed=3)
    poses = true_poses(log)
    entry = figures(log, made.trace(poses, step_times_us(log)))
    assert 0.0 < entry["dead_reckoning_error_m"] < 1.0
    assert entry["position_error_m"]["max"] == 0.0
    assert entry["path_m"] == pytest.approx(500 * 0.02, rel=1e-3)  # chords are a little shorter


def test_alignment_takes_away_a_rigid_motion_and_only_that(made, log):
    moved = Rigid(2.0, 30.0, -7.0)
    poses = moved.poses(true_poses(log))
    trace = made.trace(poses, step_times_us(log))
    assert figures(log, trace, align="rigid")["position_error_m"]["max"] < 1e-9
    assert figures(log, trace)["position_error_m"]["min"] > 1.0
    scaled = poses * [1.1, 1.1, 1.0]
    # A circle of 1.1 m about the same centre: 0.1 m everywhere.
    entry = figures(log, made.trace(scaled, step_times_us(log)), align="rigid")
    assert entry["position_error_m"]["mean"] == pytest.approx(0.1, abs=0.01)


def test_nees_that_is_of_the_alignment_is_said_to_be(made, log):
    poses = true_poses(log)
    poses[1500:, 0] += 0.2  # by half of which, and a little turned, the alignment is off at the start
    covariance = np.tile(0.02 * np.eye(3), (STEPS + 1, 1, 1))
    covariance[:100] *= 1e-4  # the start is sure
    trace = made.trace(poses, step_times_us(log), covariance=covariance)
    entry = figures(log, trace, align="rigid")
    (note,) = [one for one in entry["notes"] if one.startswith(f"NEES {entry['nees_mean']:.1f} ")]
    assert note == (
        f"NEES {entry['nees_mean']:.1f} comes from the first 4.0 s, where the filter is surer than the "
        "alignment, 10.3 cm off at the start; afterwards 0.5"
    )
    for known in (figures(log, trace), figures(log, made.trace(poses, step_times_us(log)), align="rigid")):
        assert not any("comes from the first" in one for one in known["notes"])


def test_nees_is_the_same_wherever_an_aligned_truth_has_its_frame(made, log):
    poses = true_poses(log) + np.random.default_rng(0).normal(0.0, 0.1, (STEPS + 1, 3))
    trace = made.trace(poses, step_times_us(log))
    truth = Rigid(-1.3, 4.0, 2.0).poses(true_poses(log))
    elsewhere = replace(log, truth=Truth(log.truth.time_us, *truth.T))
    for name in ("standard", "invariant"):
        options = RunOptions(filter=name)
        here, there = (figures(one, trace, options, align="rigid")["nees_mean"] for one in (log, elsewhere))
        assert here == pytest.approx(there)


def test_a_sparse_truth_counts_only_where_it_is_known(made, log):
    rows = np.array([500, 2000, 2900])
    sparse = Truth(*(column[rows] for column in (log.truth.time_us, *true_poses(log).T)))
    poses = true_poses(log)
    poses[:, 0] += 50.0
    poses[rows, 0] -= 49.7
    # 50 ms about each stamp hold the step itself and its two neighbours, which are 50 m off.
    evaluation = evaluate(
        replace(log, truth=sparse), made.trace(poses, step_times_us(log)), replace(OPTIONS, align="none")
    )
    assert np.flatnonzero(np.isfinite(evaluation.error_m)).tolist() == sorted([*rows - 1, *rows, *rows + 1])
    assert evaluation.error_m[rows] == pytest.approx([0.3] * 3)


def test_map_rmse_counts_confirmed_beacons_and_duplicates(made, log):
    beacons = [
        made.map_beacon(10, 3, 2.0, 0.9),  # 0.4 m off
        made.map_beacon(11, 5, 0.3, 2.0),  # 0.3 m off
        made.map_beacon(12, 5, 0.0, 2.0),  # the same beacon again, exact
        made.map_beacon(13, 8, 9.0, 9.0, confirmed=False),
        made.map_beacon(14, -1, 9.0, 9.0),  # clutter has no true place
    ]
    entry = figures(log, made.trace(true_poses(log), step_times_us(log), beacons))
    assert entry["map_rmse_m"] == pytest.approx(np.sqrt((0.16 + 0.09) / 3))
    assert entry["beacons_mapped"] == 4
    assert entry["beacons_true"] == 3
    mapped_m, true_m = map_pairs(log, made.trace(true_poses(log), step_times_us(log), beacons))
    assert mapped_m.shape == true_m.shape == (3, 2)


def test_the_map_has_its_own_alignment(made, log):
    moved = Rigid(1.0, 5.0, 5.0)
    places = moved.points(np.column_stack([made.beacons.x_m, made.beacons.y_m]))
    pairs = zip(made.beacons.beacon_id, places, strict=True)
    beacons = [made.map_beacon(uid, identity, *place) for uid, (identity, place) in enumerate(pairs)]
    trace = made.trace(true_poses(log), step_times_us(log), beacons)
    assert figures(log, trace, align="rigid")["map_rmse_m"] < 1e-9
    assert figures(log, trace, align="none")["map_rmse_m"] > 1.0


def test_directions_are_judged_with_and_without_the_scale_that_they_do_not_tell(made, log):
    places = 0.8 * np.column_stack([made.beacons.x_m, made.beacons.y_m])
    pairs = zip(made.beacons.beacon_id, places, strict=True)
    beacons = [made.map_beacon(uid, identity, *place) for uid, (identity, place) in enumerate(pairs)]
    poses = true_poses(log) * (0.8, 0.8, 1.0)
    trace = made.trace(poses, step_times_us(log), beacons)
    entry = figures(log, trace, replace(OPTIONS, observation="direction"), align="rigid")
    assert [entry["position_scale"], entry["map_scale"]] == pytest.approx([1.25, 1.25])
    assert max(entry["position_rmse_scaled_m"], entry["map_rmse_scaled_m"]) < 1e-9
    assert min(entry["position_error_m"]["rmse"], entry["map_rmse_m"]) > 0.1
    assert "map_scale" not in figures(log, trace, align="rigid")


def test_beacons_true_needs_four_mappable_sightings(made, log):
    rows = [(0, 3, 0.0, 1.0, True)] * 4 + [(0, 5, 0.0, 1.0, True)] * 3 + [(0, 8, 0.0, 1.0, False)] * 9
    log = replace(log, sightings=made.sightings(rows))
    assert figures(log, made.trace(true_poses(log), step_times_us(log)))["beacons_true"] == 1


def test_without_truth_only_what_can_be_known_is_said(made, log):
    trace = made.trace(true_poses(log), step_times_us(log), counts=SightingCounts(7, 1, 2, 3, 4, 5))
    log = replace(log, truth=None, beacons=None)
    entry = figures(log, trace)
    assert not any(key in entry for key in ("position_error_m", "nees_mean", "map_rmse_m", "beacons_true"))
    assert entry["diverged"] is False
    assert (entry["sightings"], entry["wrong_associations"], entry["false_new"]) == (7, 1, 2)
    assert (entry["missed"], entry["deferred"], entry["rejected"]) == (3, 4, 5)
    assert entry["path_m"] == pytest.approx(STEPS * 0.02)


def test_what_was_run_is_said_in_the_words_of_the_command_line(made, log):
    options = RunOptions(association="known", wrong_identity_rate=0.05, seed=4)
    entry = figures(log, made.trace(true_poses(log), step_times_us(log)), options)
    words = {
        key: entry[key] for key in ("seed", "sigma_mps", "observation", "association", "filter", "motion")
    }
    assert words == {
        "seed": 4,
        "sigma_mps": 0.05,
        "observation": "distance",
        "association": "known:0.05",
        "filter": "invariant",
        "motion": "arc",
    }
    assert entry["velocity_states"] is True
    assert entry["steps"] == STEPS
    assert entry["seen_any_share"] == 1.0
