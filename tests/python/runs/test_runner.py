"""Feeding a log to the core: in which order, what is hidden, what is kept."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from bslam.core.errors import CoreError
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.evaluation.metrics import evaluate, summarise
from bslam.log import Odometry
from bslam.options import RunOptions
from bslam.runs.runner import run_log

DISTANCE = RunOptions()


@dataclass(frozen=True)
class Account:
    result: str
    reason: str
    beacon_uid: int | None


class Recorder:
    """A core that writes down its calls; its pose is the number of them."""

    def __init__(self, refuse=()):
        self.calls, self.refuse, self.asked_us = [], refuse, []
        self.params = {"filter": 1, "bearing_sd_rad": 0.30000001192}

    def defaults(self):
        return {"filter": 1, "bearing_sd_rad": 0.0136}

    def _take(self, *call):
        self.calls.append(call)
        if len(self.calls) - 1 in self.refuse:
            raise CoreError("BSLAM_E_TIME", "refused")

    def odometry(self, kind, time_us, a, b, gyro_radps, gyro_sd_radps):
        self._take(kind, time_us, a, b, *(() if gyro_radps is None else (gyro_radps, gyro_sd_radps)))

    def sightings(self, time_us, bearing_rad, range_m, label, mappable, *more):
        self._take("frame", time_us, bearing_rad, range_m, label, mappable, *more)
        return [Account("deferred", "none", None) for _ in label]

    def pose(self):
        return float(len(self.calls)), 0.0, 0.0

    def pose_at(self, time_us):
        self.asked_us.append(time_us)
        if time_us < 0:
            raise CoreError("BSLAM_E_TIME", "before the history")
        return time_us * 1e-6, 0.0, 0.0

    def pose_covariance_lower(self):
        return (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)

    def beacons(self):
        return []

    def counters(self):
        return {"odometry": 2}


def run(log, options=DISTANCE, recorder=None):
    recorder = recorder or Recorder()
    return run_log(log, options, lambda params, beacons_max: recorder), recorder


@pytest.fixture
def log(made):
    """Two wheel rows at 40 and 80 ms; frames at 0, 40, 50 and 90 ms."""
    rows = [
        (0, 3, 0.1, 1.0, True),
        (40_000, 3, 0.2, 2.0, True),
        (40_000, 5, 0.3, math.nan, False),
        (50_000, -1, 0.4, 3.0, True),
        (90_000, 3, 0.5, 4.0, True),
    ]
    return replace(made.circle_log(steps=2), sightings=made.sightings(rows))


def test_frames_are_fed_after_the_odometry_that_covers_them_and_in_order(log):
    trace, recorder = run(log)
    fed = [(call[0], call[1]) for call in recorder.calls]
    frame, wheels = "frame", "wheels"
    assert fed == [
        (frame, 0), (wheels, 40_000), (frame, 40_000), (wheels, 80_000), (frame, 50_000), (frame, 90_000)
    ]  # fmt: skip
    assert trace.time_us.tolist() == [0, 40_000, 80_000]
    assert trace.pose[:, 0].tolist() == [1.0, 3.0, 6.0]  # after the frames that belong to the row
    assert trace.seen.tolist() == [True, True, True]


def test_what_was_seen_before_the_start_is_refused(log, made):
    later = replace(log.odometry, time_us=log.odometry.time_us + 30_000)
    seen = made.sightings([(0, 3, 0.1, 1.0, True), (28_000, 3, 0.1, 1.0, True), (50_000, 3, 0.1, 1.0, True)])
    trace, recorder = run(replace(log, odometry=later, sightings=seen, truth=None))
    assert [call[1] for call in recorder.calls[:3]] == [28_000, 70_000, 50_000]
    assert trace.time_us[0] == 28_000
    assert trace.refusals == {"before_start": 1}
    assert trace.counts.sightings == 3


def shifted(log, by_us):
    """The same drive by another clock."""
    parts = {name: getattr(log, name) for name in ("odometry", "sightings", "truth")}
    return replace(log, **{name: replace(part, time_us=part.time_us + by_us) for name, part in parts.items()})


@pytest.mark.parametrize("by_us", [5_000_000, 60_000_000, 1_248_272_272_841_000])
@pytest.mark.parametrize("with_truth_at_the_start", [True, False])
def test_wheels_give_the_same_whatever_the_clock_starts_at(made, by_us, with_truth_at_the_start):
    log = made.circle_log(steps=300, seed=4)
    if not with_truth_at_the_start:  # nothing but the first row says when the drive began
        late = log.sightings.time_us > 0
        columns = {name: column[late] for name, column in vars(log.sightings).items() if column is not None}
        log = replace(log, sightings=replace(log.sightings, **columns))
        truth = {name: column[1:] for name, column in vars(log.truth).items()}
        log = replace(log, truth=replace(log.truth, **truth))
    options = RunOptions()

    def figures(one):
        trace = run_log(one, options)
        evaluation = evaluate(one, trace, options)
        return summarise(one, trace, options, evaluation) | {"step_us_median": 0.0}, trace.pose

    entry, poses = figures(log)
    shifted_entry, shifted_poses = figures(shifted(log, by_us))
    assert shifted_entry == entry
    np.testing.assert_array_equal(shifted_poses, poses)


def test_rows_of_one_stamp_are_one_frame(log):
    _, recorder = run(log)
    bearing, range_m, label, mappable = recorder.calls[2][2:]
    assert (bearing, label, mappable) == ([0.2, 0.3], [3, -1], [True, False])
    assert range_m[0] == 2.0
    assert math.isnan(range_m[1])


@pytest.mark.parametrize("association", ["known", "mahalanobis"])
def test_what_the_detector_calls_a_sighting_is_told_without_looks_too(log, association):
    classed = replace(log.sightings, beacon_class=np.array([1, 2, 3, 4, 5]))
    _, recorder = run(replace(log, sightings=classed), RunOptions(association=association))
    frames = [call for call in recorder.calls if call[0] == "frame"]
    assert [call[10] for call in frames] == [[1], [2, 3], [4], [5]]
    assert all(call[6:10] == (None, None, None, None) for call in frames)  # no noise, no signature


def test_direction_only_hides_the_range(log):
    _, recorder = run(log, RunOptions(observation="direction"))
    assert all(math.isnan(one) for call in recorder.calls if call[0] == "frame" for one in call[3])


@pytest.mark.parametrize("association", ["nearest", "mahalanobis"])
def test_unknown_association_hides_the_identity(log, association):
    _, recorder = run(log, RunOptions(association=association))
    assert {one for call in recorder.calls if call[0] == "frame" for one in call[4]} == {-1}


def test_wrong_identities_are_the_harness_s_and_repeat_with_the_seed(log):
    options = RunOptions(association="known", wrong_identity_rate=1.0, seed=1)
    assert [call[4] for call in run(log, options)[1].calls if call[0] == "frame"] == [[3], [3, -1], [-1], [3]]
    several = replace(log, sightings=replace(log.sightings, beacon_id=np.array([3, 5, 3, 8, 3])))
    first, again = (run(several, options)[1].calls for _ in range(2))
    assert str(first) == str(again)
    labels = [one for call in first if call[0] == "frame" for one in call[4]]
    assert all(label != true for label, true in zip(labels, [3, 5, -2, 8, 3], strict=True))


def test_without_a_frame_at_the_start_an_empty_one_starts_the_clock(log):
    late = replace(log, sightings=replace(log.sightings, time_us=log.sightings.time_us + 1))
    trace, recorder = run(late)
    assert recorder.calls[0] == ("frame", 0, [], [], [], [])
    assert [call[:2] for call in recorder.calls[1:3]] == [("wheels", 40_000), ("frame", 1)]
    assert trace.counts.sightings == 5


def test_the_first_row_of_velocities_only_marks_the_start(log):
    times_us = np.array([40_000, 80_000])
    trace, recorder = run(replace(log, odometry=Odometry("velocity", times_us, np.ones(2), np.zeros(2))))
    assert recorder.calls[0] == ("velocity", 40_000, 1.0, 0.0)
    assert trace.time_us.tolist() == [40_000, 80_000]
    assert trace.steps == 1


def test_a_gyro_s_rates_go_with_their_rows(log):
    odometry = replace(log.odometry, gyro_radps=np.array([0.25] + [math.nan] * (len(log.odometry.a) - 1)))
    _, recorder = run(replace(log, odometry=odometry))
    assert [call[4:] for call in recorder.calls if call[0] == "wheels"][:2] == [(0.25, 0.0), ()]
    own = replace(odometry, gyro_sd_radps=np.full(len(odometry.a), 0.5))
    _, recorder = run(replace(log, odometry=own))
    assert [call[4:] for call in recorder.calls if call[0] == "wheels"][:2] == [(0.25, 0.5), ()]


def test_ticks_are_whole_numbers(made, log):
    robot = replace(
        made.robot, left_radius_m=0.05, right_radius_m=0.05, ticks_per_revolution=64, counter_bits=16
    )
    odometry = Odometry("ticks", np.array([0, 40_000]), np.array([1.0, 5.0]), np.array([2.0, 6.0]))
    _, recorder = run(replace(log, odometry=odometry, robot=robot))
    assert [call[2:] for call in recorder.calls if call[0] == "ticks"] == [(1, 2), (5, 6)]
    assert all(isinstance(one, int) for call in recorder.calls if call[0] == "ticks" for one in call[2:])


def test_a_refusal_is_counted_and_the_run_goes_on(log):
    trace, recorder = run(log, recorder=Recorder(refuse=(1, 4)))
    assert trace.refusals == {"BSLAM_E_TIME": 2}
    assert len(recorder.calls) == 6
    assert trace.counts.sightings == 5
    assert trace.counts.deferred == 4  # the refused frame has no account
    assert trace.counts.refused == 1


def test_a_drive_whose_map_cannot_be_saved_is_measured_all_the_same(log):
    class Lost(Recorder):
        def save_map(self):
            raise CoreError("BSLAM_E_MAP", "map of 80 bytes")

    trace, recorder = run(log, recorder=Lost())
    assert trace.kept_map is None and trace.refusals == {"BSLAM_E_MAP": 1}
    assert len(trace.pose) == 3 and trace.counters == {"odometry": 2}
    recorder.save_map = lambda: b"map"
    assert run(log, recorder=recorder)[0].kept_map == b"map"


def test_with_a_lead_the_pose_is_that_of_the_past(log):
    trace, recorder = run(log, RunOptions(odometry_lead_us=50_000))
    assert recorder.asked_us == [-50_000, -10_000, 30_000]
    # Before the history there is the start, then the newest pose, then the past.
    assert trace.pose[:, 0].tolist() == [0.0, 0.0, 0.03]


def test_parameters_that_are_whole_numbers_stay_so_to_the_last_digit(made):
    options = RunOptions(parameters=(("confirm_window_us", 123_456_789), ("range_sd_fraction", 0.3)))
    changed = run_log(made.circle_log(steps=1), options).parameters
    assert repr(changed["confirm_window_us"]) == "123456789"
    assert changed["range_sd_fraction"] == 0.3


def test_the_trace_has_the_covariance_as_a_matrix_and_the_changed_parameters(log):
    trace, _ = run(log)
    assert trace.covariance[1].tolist() == [[1.0, 2.0, 4.0], [2.0, 3.0, 5.0], [4.0, 5.0, 6.0]]
    assert trace.parameters == {"bearing_sd_rad": 0.3}
    assert trace.counters == {"odometry": 2}
    assert trace.step_us_median > 0.0


# --- with the real core -------------------------------------------------------------------------------------


def test_an_exact_log_is_followed_exactly(made):
    log = made.circle_log(steps=400)
    trace = run_log(log, RunOptions(velocity_states=False))
    entry = summarise(log, trace, DISTANCE, evaluate(log, trace, DISTANCE))
    # float32 over 400 steps of a metre's size.
    assert entry["position_error_m"]["max"] < 1e-3
    assert entry["beacons_mapped"] == entry["beacons_true"] == 3
    assert entry["map_rmse_m"] < 1e-3
    assert entry["wrong_associations"] == entry["missed"] == entry["rejected"] == 0


def test_a_noisy_log_is_consistent(made):
    options = RunOptions(velocity_states=False)
    means = []
    for seed in range(8):
        log = made.circle_log(steps=400, seed=seed)
        trace = run_log(log, options)
        entry = summarise(log, trace, options, evaluate(log, trace, options))
        assert entry["position_error_m"]["mean"] < 0.1
        assert entry["position_error_m"]["mean"] < entry["dead_reckoning_error_m"] + 0.05
        means.append(entry["nees_mean"])
    # Errors of one run stay alike for long, so that its mean is worth few independent values: eight runs of
    # five each, say, leave a standard error of 0.4.
    assert 1.5 < np.mean(means) < 4.5


def test_wrong_identities_show_in_the_ledger(made):
    log = made.circle_log(steps=100, seed=0)
    trace = run_log(log, RunOptions(association="known", wrong_identity_rate=0.2))
    assert trace.counts.sightings == 303
    assert trace.counts.wrong_associations + trace.counts.missed > 30


def test_the_same_run_twice_is_the_same_to_the_bit(made):
    log = made.circle_log(steps=100, seed=0)
    first, second = (run_log(log, DISTANCE) for _ in range(2))
    assert np.array_equal(first.pose, second.pose)
    assert np.array_equal(first.covariance, second.covariance)


def test_a_parameter_out_of_range_is_bad_input(made):
    with pytest.raises(BslamError, match="bearing_sd_rad"):
        run_log(made.circle_log(steps=1), RunOptions(parameters=(("bearing_sd_rad", -1.0),)))


def test_more_beacons_than_the_small_build_holds_get_a_larger_one(made):
    log = made.circle_log(steps=1)
    rows = [(0, k, -1.0 + 0.04 * k, 2.0, True) for k in range(15)]
    rows += [(40_000, 15 + k, -1.0 + 0.04 * k, 3.0, True) for k in range(15)]
    trace = run_log(replace(log, sightings=made.sightings(rows)), DISTANCE)
    assert len(trace.beacons) == 30
    assert Slam().params  # the small one is there, too
