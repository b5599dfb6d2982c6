"""Any algorithm on a log: what it is told, in which order, and what it must not say."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from bslam.algorithms import Landmark
from bslam.algorithms.dead_reckoning import DeadReckoning
from bslam.algorithms.ours import Bslam
from bslam.errors import BslamError
from bslam.evaluation.metrics import summarise
from bslam.evaluation.truth import dead_reckoning
from bslam.log import first_steps
from bslam.options import RunOptions
from bslam.runs.methods import load_method, own_method, shipped_methods
from bslam.runs.rival import AlgorithmError, run_algorithm, setup_for
from bslam.runs.runner import run_log
from bslam.world.simulate import load_scenario, simulate


class Scribe:
    """Writes down what it is told."""

    def __init__(self, setup):
        self.setup = setup
        self.calls = []

    def reset(self, seed):
        self.calls.append(("reset", seed))

    def odometry(self, time_us, left_m, right_m):
        self.calls.append(("odometry", time_us, left_m, right_m))

    def observe(self, time_us, sightings):
        self.calls.append(("observe", time_us, list(sightings)))

    def pose(self):
        return 0.0, 0.0, 0.0

    def map(self):
        return []


def ignore(_step):
    pass


def told(log, options, kind=Scribe):
    made = []

    def make(setup):
        made.append(kind(setup))
        return made[-1]

    trace = run_algorithm(log, options, make, ignore)
    return made[-1], trace


@pytest.mark.parametrize("observation", ["distance", "direction"])
@pytest.mark.parametrize("real", ["float", "double"])
def test_our_core_as_an_algorithm_is_our_core_to_the_bit(made, observation, real):
    log = made.circle_log(150, seed=3)
    options = RunOptions(observation=observation, real=real)
    rival, own = run_algorithm(log, options, Bslam, ignore), run_log(log, options)
    assert rival.pose.tolist() == own.pose.tolist()
    assert rival.covariance.tolist() == own.covariance.tolist()
    places = [(one.label, one.x_m, one.y_m) for one in own.beacons if one.confirmed]
    assert [(one.label, one.x_m, one.y_m) for one in rival.beacons] == places
    assert len(places) == 3


def test_gyro_is_told_to_who_takes_it_before_the_wheels_of_its_step(made):
    log = with_gyro(made.circle_log(4, seed=3), [0.3, math.nan, 0.1, -0.2])
    listening = type("Listening", (Scribe,), {"gyro": lambda self, *told: self.calls.append(("gyro", *told))})
    scribe, _ = told(log, RunOptions(), listening)
    calls = [call for call in scribe.calls if call[0] in ("gyro", "odometry")]
    assert [call[0] for call in calls] == ["gyro", "odometry", "odometry", *["gyro", "odometry"] * 2]
    rates = [call[1:] for call in calls if call[0] == "gyro"]
    assert rates == [(made.step_us * k, rate, 0.02) for k, rate in ((1, 0.3), (3, 0.1), (4, -0.2))]
    own = replace(log, odometry=replace(log.odometry, gyro_sd_radps=np.array([0.5, 0.0, 0.0, 0.25])))
    calls = told(own, RunOptions(), listening)[0].calls
    assert [call[3] for call in calls if call[0] == "gyro"] == [0.5, 0.02, 0.25]
    deaf, _ = told(log, RunOptions())
    assert {call[0] for call in deaf.calls} == {"reset", "observe", "odometry"}


def test_our_core_as_an_algorithm_hears_the_gyro_to_the_bit(made):
    rates = np.random.default_rng(0).normal(0.3, 0.1, 150)
    rates[40:60] = np.nan
    log = with_gyro(made.circle_log(150, seed=3), rates)
    own = run_log(log, RunOptions())
    assert run_algorithm(log, RunOptions(), Bslam, ignore).pose.tolist() == own.pose.tolist()
    assert own.pose.tolist() != run_log(with_gyro(log, None), RunOptions()).pose.tolist()


@pytest.mark.parametrize("name", ["map", "isam2"])
def test_the_bound_and_its_neighbour_hear_the_gyro(made, name):
    """With one that is next to exact, the heading is its sum."""
    if name == "isam2":
        pytest.importorskip("gtsam")
    quiet = made.circle_log(60, seed=3)
    turn_rad = np.unwrap(quiet.truth.theta_rad)
    rates = np.diff(turn_rad) / (made.step_us * 1e-6)
    log = with_gyro(quiet, rates, sigma_radps=1e-5)
    (method,) = (one for one in shipped_methods(10) if one.name == name)
    trace = run_algorithm(log, RunOptions(), load_method(method), ignore)
    np.testing.assert_allclose(np.unwrap(trace.pose[:, 2])[::10], turn_rad[::10], atol=1e-4)
    deaf = run_algorithm(quiet, RunOptions(), load_method(method), ignore)
    assert np.abs(np.unwrap(deaf.pose[:, 2])[::10] - turn_rad[::10]).max() > 1e-3


def with_gyro(log, rates_radps, sigma_radps=0.02):
    rates = None if rates_radps is None else np.asarray(rates_radps, dtype=np.float64)
    robot = replace(log.robot, gyro_sigma_radps=sigma_radps)
    return replace(log, odometry=replace(log.odometry, gyro_radps=rates), robot=robot)


def test_our_core_as_an_algorithm_makes_the_same_mistakes():
    log = first_steps(simulate(load_scenario("pairs"), seed=2), 400)
    classes = (1 + log.sightings.beacon_id % 2).astype(np.int64)
    scores = 0.6 + np.arange(len(classes)) % 7 / 5
    log = replace(log, sightings=replace(log.sightings, beacon_class=classes, score=scores))
    for association in ("nearest", "svm"):
        options = RunOptions(association=association)
        rival, own = run_algorithm(log, options, Bslam, ignore), run_log(log, options)
        assert rival.counts == own.counts
        known = [(one.uid, one.true_id) for one in own.beacons if one.confirmed]
        assert [one.true_id for one in rival.beacons] == [true_id for _, true_id in known]
        assert rival.pose.tolist() == own.pose.tolist()
    assert own.counts.sightings > 500
    bare = replace(log, sightings=replace(log.sightings, score=None))
    assert run_log(bare, options).counts.deferred < own.counts.deferred  # of which some were on trial


def test_class_is_told_where_identities_are_not(made):
    log = made.circle_log(3, seed=1)
    signed = np.zeros((len(log.sightings.beacon_id), 71), np.float32)
    kinds = (log.sightings.beacon_id % 3).astype(np.int64)
    scores = np.where(kinds == 0, 0.0, 0.5 + kinds)
    log = replace(log, sightings=replace(log.sightings, signature=signed, beacon_class=kinds, score=scores))
    scribe, _ = told(log, RunOptions(association="svm"))
    assert [one.beacon_class for one in scribe.calls[1][2]] == [None, 2, 2]
    assert [one.score for one in scribe.calls[1][2]] == [None, 2.5, 2.5]


def test_who_says_nothing_of_sightings_has_no_wrong_ones(made):
    log = made.circle_log(3, seed=1)
    _, trace = told(log, RunOptions())
    entry = summarise(log, trace, RunOptions(), None)
    assert entry["sightings"] == 12 and "wrong_associations" not in entry and "told" not in entry
    short = type("Short", (Scribe,), {"accounts": lambda self: [], "uids": lambda self: []})
    with pytest.raises(AlgorithmError, match=r"accounts\(\) returned 0; allowed: one for each of 3"):
        told(log, RunOptions(), short)


def test_calls_come_in_order_of_time_from_the_start_on(made):
    log = made.circle_log(5, seed=1)
    scribe, trace = told(log, RunOptions(seed=7))
    assert scribe.calls[0] == ("reset", 7)
    assert [call[0] for call in scribe.calls[1:]] == ["observe", *["odometry", "observe"] * 5]
    assert [call[1] for call in scribe.calls[1::2]] == [made.step_us * k for k in range(6)]
    assert [call[2:] for call in scribe.calls[2::2]] == list(
        zip(log.odometry.a.tolist(), log.odometry.b.tolist(), strict=True)
    )
    first = scribe.calls[1][2][0]
    assert (first.label, first.bearing_rad, first.range_m) == (
        3,
        log.sightings.bearing_rad[0],
        log.sightings.range_m[0],
    )
    assert trace.steps == 5


def test_what_is_not_to_be_known_is_none(made):
    log = made.circle_log(3, seed=1)
    scribe, _ = told(log, RunOptions(observation="direction", association="nearest"))
    sighting = scribe.calls[1][2][0]
    assert sighting.range_m is None
    assert sighting.label is None
    assert not scribe.setup.identities
    assert scribe.setup.observation == "direction"


def test_who_needs_identities_gets_them(made):
    class Needy(Scribe):
        needs_identity = True

    scribe, _ = told(made.circle_log(3, seed=1), RunOptions(association="nearest"), Needy)
    assert scribe.setup.identities
    assert [one.label for one in scribe.calls[1][2]] == [3, 5, 8]


def test_start_without_an_image_is_an_empty_one(made):
    log = made.circle_log(3, seed=1)
    late = made.sightings([(made.step_us * 2, 3, 0.1, 2.0, True)])
    scribe, trace = told(type(log)(**vars(log) | {"sightings": late}), RunOptions())
    assert scribe.calls[1] == ("observe", 0, [])
    assert [call[1] for call in scribe.calls if call[0] == "observe"] == [0, made.step_us * 2]
    assert trace.seen.tolist() == [False, False, True, False]


def test_dead_reckoning_is_the_sum_of_arcs(made):
    log = made.circle_log(100, seed=2)
    trace = run_algorithm(log, RunOptions(), DeadReckoning, ignore)
    np.testing.assert_allclose(trace.pose, dead_reckoning(log), atol=1e-12)


def test_landmark_without_a_label_stands_for_the_beacon_it_is_near(made):
    class Mapper(Scribe):
        def map(self):
            return [Landmark(2.1, 0.4), Landmark(9.0, 9.0), Landmark(0.0, 0.0, label=8)]

    _, trace = told(made.circle_log(2), RunOptions(), Mapper)
    assert [one.true_id for one in trace.beacons] == [3, -1, 8]


@pytest.mark.parametrize(
    ("pose", "says"),
    [
        ((0.0, math.nan, 0.0), "nan"),
        ((math.inf, 0.0, 0.0), "inf"),
        ((0.0, 0.0), "three numbers"),
        (None, "three numbers"),
        ("abc", "three numbers"),
    ],
)
def test_pose_that_cannot_be_is_named_with_its_step(made, pose, says):
    class Wrong(Scribe):
        def pose(self):
            return pose if len(self.calls) > 4 else (0.0, 0.0, 0.0)

    with pytest.raises(BslamError, match=r"pose\(\) returned .* at step 2; allowed") as caught:
        told(made.circle_log(5), RunOptions(), Wrong)
    assert says in str(caught.value)


def test_exception_of_an_algorithm_says_at_which_step_it_came(made):
    class Wrong(Scribe):
        def observe(self, time_us, sightings):
            return 1 // (2 - sum(call == "odometry" for call, *_ in self.calls))

    log = made.circle_log(5)
    with pytest.raises(ZeroDivisionError) as caught:
        told(log, RunOptions(), Wrong)
    assert caught.value.__notes__ == [f"at step 2 (observe, time_us {log.odometry.time_us[1]})"]


def test_map_that_cannot_be_is_named(made):
    class Wrong(Scribe):
        def map(self):
            return [Landmark(math.nan, 0.0)]

    with pytest.raises(BslamError, match=r"map\(\) returned Landmark"):
        told(made.circle_log(2), RunOptions(), Wrong)


def test_setup_has_every_parameter_of_the_core(made):
    setup = setup_for(made.circle_log(3), RunOptions(parameters=(("huber_d", 2.0),)))
    assert setup.parameters["huber_d"] == 2.0
    assert setup.parameters["wheelbase_m"] == 0.4
    assert set(setup.parameters) == set(Bslam(setup)._slam.params)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("my_slam", ["--with my_slam", "module:Class"]),
        ("no_such_module:A", ["no_such_module", "module:Class"]),
        ("/no/such/file.py:A", ["/no/such/file.py"]),
        ("a b:A", ["'a b'"]),
    ],
)
def test_own_method_that_is_not_there_is_named(text, parts):
    with pytest.raises(BslamError) as caught:
        own_method(text)
    for part in parts:
        assert part in str(caught.value)


def test_class_that_is_not_there_or_lacks_methods_is_named(tmp_path):
    file = tmp_path / "mine.py"
    whole = "".join(f"    {one} = print\n" for one in ("reset", "odometry", "observe", "pose", "map"))
    file.write_text(f"class Half:\n    def reset(self, seed): pass\nclass Whole:\n{whole}")
    with pytest.raises(BslamError, match=r"no class Whale; allowed: .*: Whole; did you mean 'Whole'\?$"):
        load_method(own_method(f"{file}:Whale"))
    with pytest.raises(BslamError, match="has no odometry, observe, pose, map"):
        load_method(own_method(f"{file}:Half"))


@pytest.mark.parametrize(("returned", "said"), [(None, "a list of Landmark"), ([1], "Landmark, of bslam")])
def test_map_of_something_else_is_named(made, returned, said):
    class Strange(Scribe):
        def map(self):
            return returned

    with pytest.raises(AlgorithmError, match=rf"map\(\) returned .*; allowed: {said}"):
        told(made.circle_log(3), RunOptions(), Strange)


@pytest.mark.parametrize(
    "returned", [-np.eye(3), np.diag([1.0, 1.0, -1e-6]), [[1, 2, 0], [2, 1, 0], [0, 0, 1]], np.tri(3)]
)
def test_covariance_that_is_none_is_named_with_its_step(made, returned):
    class Strange(Scribe):
        def pose_covariance(self):
            return returned if len(self.calls) > 6 else np.zeros((3, 3))

    with pytest.raises(AlgorithmError, match=r"pose_covariance\(\) returned .* at step 3; allowed: a sym"):
        told(made.circle_log(3), RunOptions(), Strange)


def test_class_without_a_constructor_is_made_without_a_setup(tmp_path, made):
    file = tmp_path / "plain.py"
    body = "".join(f"    def {call}: return {value}\n" for call, value in {
        "reset(self, seed)": None, "odometry(self, time_us, left_m, right_m)": None,
        "observe(self, time_us, sightings)": None, "pose(self)": (0, 0, 0), "map(self)": [],
    }.items())  # fmt: skip
    file.write_text(f"class Plain:\n{body}")
    trace = run_algorithm(made.circle_log(3), RunOptions(), load_method(own_method(f"{file}:Plain")), ignore)
    assert trace.steps == 3


def test_shipped_methods_can_be_loaded_where_what_they_need_is_installed(made):
    setup = setup_for(made.circle_log(3), RunOptions())
    for method in shipped_methods(25):
        if method.is_here:
            assert re.match(r"\w+", type(load_method(method)(setup)).__name__)
