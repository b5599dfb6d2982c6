"""What holds for the C core whatever it is fed: over long seeded runs, and for inputs that hypothesis makes
up."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bslam.core import CoreError, Slam
from core import instance
from core.feeding import KINDS, deviations_between, feed, look, name
from reference.dense_ekf import Sighting
from reference.runs import PARAMS, STEP_US, Step, run

INVARIANT_VELOCITY = {**PARAMS, **KINDS[10]}

ROUNDING = {"float": 2.0**-24, "double": 2.0**-53}

REALS = pytest.mark.parametrize("real", ["float", "double"])
EVERY_KIND = pytest.mark.parametrize("kind", KINDS, ids=name)


def assert_sound(slam: Slam) -> None:
    """Finite, angles in (-pi, pi], covariance positive definite but for rounding, nothing found insane."""
    mean = instance.mean(slam)
    assert np.isfinite(mean).all()
    assert (np.abs(mean[instance.angles(slam)]) <= np.pi * (1 + ROUNDING[slam._raw.real])).all()
    # Exactly singular is no fault (a new ray's anchor is the robot's position), so rounding may show either
    # way.
    assert instance.correlation_floor(slam) > -64 * ROUNDING[slam._raw.real]
    assert slam.counters()["insane"] == 0


def fed(params: dict[str, float], steps: list[Step], real: str = "float") -> Slam:
    """An instance after a run."""
    slam = Slam(params, real=real)
    for step in steps:
        feed(slam, step)
    return slam


def changed(steps: list[Step], change: Callable[[Sighting], Sighting]) -> list[Step]:
    """The run with every sighting changed."""
    return [Step(s.time_us, s.left_m, s.right_m, [change(x) for x in s.sightings]) for s in steps]


# ---- long runs ---------------------------------------------------------------------------------------------


@REALS
@EVERY_KIND
def test_long_run_stays_sound(kind: dict[str, float], real: str) -> None:
    params = {**PARAMS, **kind}
    slam = Slam(params, real=real)
    for k, step in enumerate(run(11, 2500, 14, params)):
        feed(slam, step)
        if k % 25 == 0:
            assert_sound(slam)
    counters = slam.counters()
    assert counters["matched"] + counters["added"] + counters["rejected"] == counters["sightings"]
    assert counters["frames"] == 2500 and counters["frames_refused"] == counters["odometry_refused"] == 0


@pytest.mark.parametrize("kind", [KINDS[1], KINDS[10], KINDS[11]], ids=name)
def test_float_survives_minutes_without_sightings(kind: dict[str, float]) -> None:
    """Blind for 200 s the robot is lost by metres and radians; then it sees its map again."""
    params = {**PARAMS, **kind}
    single, double = Slam(params, real="float"), Slam(params, real="double")
    for k, step in enumerate(run(12, 5300, 8, params)):
        seen = step if not 100 <= k < 5100 else Step(step.time_us, step.left_m, step.right_m, [])
        feed(single, seen)
        feed(double, seen)
    assert_sound(single)
    # The prior is 1e4 times wider than what is known after, so that as many roundings show.
    assert deviations_between(single, double) < 0.2


def test_float_stays_by_its_double_twin_for_twenty_minutes() -> None:
    """Rounding adds up: by 2000 steps to 0.001 standard deviations, by 30,000 to 0.01."""
    params = {**PARAMS, **KINDS[10]}
    single, double = Slam(params, real="float"), Slam(params, real="double")
    for k, step in enumerate(run(99, 30_000, 10, params)):
        feed(single, step)
        feed(double, step)
        if k % 1000 == 999:
            assert_sound(single)
            assert instance.correlation_floor(single) > 0
            assert deviations_between(single, double) < 0.05


@pytest.mark.parametrize("gap_s", [1, 2, 4])
@EVERY_KIND
def test_float_survives_a_gap_in_odometry(kind: dict[str, float], gap_s: int) -> None:
    params = {**PARAMS, **kind}
    slam = Slam(params)
    for k, step in enumerate(run(3, 200, 8, params)):
        late_us = gap_s * 1_000_000 - STEP_US if k >= 100 else 0
        feed(slam, Step(step.time_us + late_us, step.left_m, step.right_m, step.sightings))
        assert_sound(slam)


@EVERY_KIND
def test_float_survives_an_interruption_of_odometry_with_the_largest_doubt(kind: dict[str, float]) -> None:
    params = {**PARAMS, **kind}
    slam = Slam(params)
    for k, step in enumerate(run(3, 200, 8, params)):
        late_us = 3_600_000_000 if k >= 100 else 0
        late = Step(step.time_us + late_us, step.left_m, step.right_m, step.sightings)
        if k == 100:
            with pytest.raises(CoreError, match="BSLAM_E_TIME"):
                feed(slam, late)
            slam.resume_odometry(30.0, 3.2)
        feed(slam, late)
        assert_sound(slam)


# ---- the same inputs, and inputs that mean the same --------------------------------------------------------


@REALS
def test_same_inputs_give_the_same_bytes(real: str) -> None:
    steps = list(run(13, 300, 9, PARAMS))
    one, other = (fed(INVARIANT_VELOCITY, steps, real) for _ in range(2))
    assert instance.state_without_addresses(one) == instance.state_without_addresses(other)


def test_two_instances_in_turn_do_not_influence_each_other() -> None:
    mine, others = list(run(14, 200, 9, PARAMS)), list(run(15, 200, 5, PARAMS))
    alone = fed(INVARIANT_VELOCITY, mine)
    a, b = Slam(INVARIANT_VELOCITY), Slam({**PARAMS, **KINDS[2]})
    for my_step, other_step in zip(mine, others, strict=True):
        feed(a, my_step)
        feed(b, other_step)
    assert instance.state_without_addresses(a) == instance.state_without_addresses(alone)


def test_other_labels_for_the_same_beacons_change_no_bit() -> None:
    labels = [17, 3, 900, 2**31 - 1, 0, 44, 5]
    steps = list(run(16, 300, 7, PARAMS))
    a = fed(INVARIANT_VELOCITY, steps)
    b = fed(INVARIANT_VELOCITY, changed(steps, lambda s: Sighting(labels[s.label], s.bearing_rad, s.range_m)))
    assert (instance.mean(a) == instance.mean(b)).all()
    assert (instance.covariance(a) == instance.covariance(b)).all()
    assert [beacon.label for beacon in b.beacons()] == [labels[beacon.label] for beacon in a.beacons()]


@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-11), ("float", 5e-3)])
def test_order_of_sightings_in_a_frame_does_not_matter(real: str, tolerance: float) -> None:
    """Beyond rounding; the first frame in the same order, so that the maps are."""
    rng = np.random.default_rng(17)
    steps = list(run(17, 300, 9, PARAMS))
    shuffled = [Step(s.time_us, s.left_m, s.right_m, list(s.sightings)) for s in steps]
    for step in shuffled[1:]:
        rng.shuffle(step.sightings)
    a, b = fed(INVARIANT_VELOCITY, steps, real), fed(INVARIANT_VELOCITY, shuffled, real)
    assert deviations_between(a, b) < tolerance


def mirror_signs(slam: Slam) -> NDArray[np.float64]:
    """What becomes of each state value when the world is seen in a mirror along the x axis: +1 or -1."""
    signs = np.ones(instance.dim(slam))
    signs[[1, *instance.angles(slam)]] = -1
    if slam.params["velocity_states"]:
        signs[4] = -1
    for at in instance.begins(slam):
        signs[at + 1] = -1
    return signs


@REALS
@EVERY_KIND
def test_mirrored_world_gives_the_mirrored_estimate_to_the_bit(kind: dict[str, float], real: str) -> None:
    """Left and right enter the core alike: any sign that is wrong on one side only shows here."""
    params = {**PARAMS, **kind}
    mirrored = {
        **params,
        "mount_y_m": -params["mount_y_m"],
        "mount_yaw_rad": -params["mount_yaw_rad"],
        "left_speed_sd_mps": params["right_speed_sd_mps"],
        "right_speed_sd_mps": params["left_speed_sd_mps"],
    }
    steps = list(run(18, 200, 7, params))
    swapped = [Step(s.time_us, s.right_m, s.left_m, s.sightings) for s in steps]
    mirrored_steps = changed(swapped, lambda x: Sighting(x.label, -x.bearing_rad, x.range_m))
    a, b = fed(params, steps, real), fed(mirrored, mirrored_steps, real)
    signs = mirror_signs(a)
    assert (instance.mean(a) == signs * instance.mean(b)).all()
    assert (instance.covariance(a) == np.outer(signs, signs) * instance.covariance(b)).all()


def test_frame_in_two_halves_is_nearly_the_frame() -> None:
    """A consistency check of another kind: relinearising in between moves the estimate by far less than it
    is uncertain."""
    steps = list(run(19, 100, 8, PARAMS))
    whole, halves = Slam(INVARIANT_VELOCITY, real="double"), Slam(INVARIANT_VELOCITY, real="double")
    for step in steps:
        feed(whole, step)
        half = len(step.sightings) // 2 if step.time_us > 0 else len(step.sightings)
        feed(halves, Step(step.time_us, step.left_m, step.right_m, step.sightings[:half]))
        look(halves, Step(step.time_us + 1, 0, 0, step.sightings[half:]))
    assert whole.counters()["settled"] == halves.counters()["settled"]
    assert deviations_between(whole, halves) < 0.3


# ---- anything ----------------------------------------------------------------------------------------------

ANY_REAL = st.one_of(
    st.floats(width=32),
    st.sampled_from([0.0, -0.0, 1e-3, 1e4, 1e12, -1e12, 1.1e12, 3.2, -3.2, 6.28, 6.29, 1e-40, 1e38]),
    st.floats(-1, 1, width=32),
)
ANY_TIME = st.one_of(
    st.integers(-(2**63), 2**63 - 1),
    st.sampled_from([0, -1, 2**62, 2**62 - 1, -(2**63), 2**63 - 1, 3_600_000_000, 3_600_000_001]),
    st.integers(0, 40 * STEP_US),
)
ANY_LABEL = st.one_of(st.integers(-(2**31), 2**31 - 1), st.integers(-1, 12))
ANY_TICKS = st.one_of(st.integers(0, 2**32 - 1), st.integers(0, 300))
ANY_SIGHTING = st.tuples(ANY_REAL, ANY_REAL, ANY_LABEL, st.booleans())

ANY_CALL = st.one_of(
    st.tuples(st.just("odometry"), st.sampled_from(["wheels", "velocity"]), ANY_TIME, ANY_REAL, ANY_REAL),
    st.tuples(st.just("odometry"), st.sampled_from(["wheels"]), ANY_TIME, ANY_REAL, ANY_REAL, ANY_REAL),
    st.tuples(st.just("odometry"), st.just("ticks"), ANY_TIME, ANY_TICKS, ANY_TICKS),
    st.tuples(st.just("sightings"), ANY_TIME, st.lists(ANY_SIGHTING, max_size=66)),
    st.tuples(st.just("add_known_beacon"), ANY_LABEL, ANY_REAL, ANY_REAL),
    st.tuples(st.just("remove_beacon"), st.integers(0, 30)),
    st.tuples(st.just("pose_at"), ANY_TIME),
    st.tuples(st.just("resume_odometry"), ANY_REAL, ANY_REAL),
)


def call(slam: Slam, wanted: tuple) -> bool:  # type: ignore[type-arg]
    """Makes the call. True if it was taken; a refusal must have left every byte but the counters alone."""
    method, *arguments = wanted
    if method == "sightings":
        time_us, rows = arguments
        arguments = [time_us, *([row[k] for row in rows] for k in range(4))]
    before = instance.state_without_counters(slam)
    try:
        getattr(slam, method)(*arguments)
    except CoreError:
        assert instance.state_without_counters(slam) == before
        return False
    return True


WARM = {
    real: fed({**INVARIANT_VELOCITY, "speed_max_mps": 20.0}, list(run(20, 60, 8, PARAMS)), real)
    for real in ("float", "double")
}
"""Instances that have driven and mapped for a while."""


@REALS
@given(wanted=ANY_CALL)
@settings(max_examples=400)
def test_any_call_is_taken_or_refused_without_a_trace(real: str, wanted: tuple) -> None:  # type: ignore[type-arg]
    slam = instance.copy_of(WARM[real])
    call(slam, wanted)
    mean = instance.mean(slam)
    assert np.isfinite(mean).all() and np.isfinite(instance.covariance(slam)).all()
    assert (np.abs(mean[instance.angles(slam)]) <= np.pi * (1 + ROUNDING[real])).all()


@REALS
@given(calls=st.lists(ANY_CALL, max_size=30))
@settings(max_examples=150)
def test_any_calls_in_a_row_leave_a_finite_state(real: str, calls: list[tuple]) -> None:  # type: ignore[type-arg]
    slam = instance.copy_of(WARM[real])
    for wanted in calls:
        call(slam, wanted)
    assert np.isfinite(instance.mean(slam)).all()
    assert len(slam.beacons()) <= 20
