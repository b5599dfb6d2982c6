"""The C core against an independent NumPy reference, and float against double, step by step over seeded
runs.
"""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from bslam.core import Slam
from core.feeding import KINDS, deviations, deviations_between, feed, feed_reference, look, name, part
from reference.dense_ekf import DenseEkf, Motion, Sighting, motion_of_wheels
from reference.runs import PARAMS, STEP_S, STEP_US, mount, places, run


def pairs(
    params: dict[str, float], seed: int, steps: int, beacons: int, real: str
) -> Iterator[tuple[int, Slam, DenseEkf]]:
    """The core and the reference after each step of a run."""
    slam, reference = Slam(params, beacons_max=beacons, real=real), DenseEkf(params)
    for k, step in enumerate(run(seed, steps, beacons, params)):
        feed(slam, step)
        feed_reference(reference, step)
        yield k, slam, reference


def worst_deviation(params: dict[str, float], seed: int, steps: int, beacons: int, real: str) -> float:
    """Over all steps of a run."""
    return max(
        deviations(slam, reference.mean, reference.covariance, reference.angles())
        for _, slam, reference in pairs(params, seed, steps, beacons, real)
    )


# ---- double: the same mathematics --------------------------------------------------------------------------

DOUBLE = 1e-10
"""Standard deviations. Rounding over hundreds of updates gives some 1e-13; a wrong term anywhere gives 1e-3
and more.
"""


@pytest.mark.parametrize("kind", KINDS, ids=name)
def test_double_core_is_the_reference_at_every_step(kind: dict[str, float]) -> None:
    assert worst_deviation({**PARAMS, **kind}, seed=1, steps=300, beacons=7, real="double") < DOUBLE


@pytest.mark.parametrize("seed", range(2, 6))
@pytest.mark.parametrize("kind", [KINDS[1], KINDS[10]], ids=name)
def test_double_core_is_the_reference_on_other_runs_and_maps(kind: dict[str, float], seed: int) -> None:
    assert worst_deviation({**PARAMS, **kind}, seed, steps=100, beacons=3 * seed, real="double") < DOUBLE


def test_run_has_points_and_rays_of_which_some_settle() -> None:
    """What the comparisons above stand on."""
    params = {**PARAMS, **KINDS[0]}
    kinds = [[b.kind for b in reference.beacons] for _, _, reference in pairs(params, 1, 300, 7, "double")]
    assert kinds[0].count("ray") == 2
    assert kinds[-1].count("ray") < 2


@pytest.mark.parametrize(
    "values",
    [
        {"forward_scale": 1.2, "turn_scale": 0.9},
        {"bearing_only_curvature_factor": 100.0},
        {"bearing_only_curvature_factor": 0.0, "bearing_only_variance_factor": 4.0},
        {"velocity_decay_s": 1e6, "turn_rate_decay_s": 1e6},
        {"mount_x_m": 0.0, "mount_y_m": 0.0, "mount_yaw_rad": -3.1},
        {"ray_linear_limit": 1e-4},
        {"range_scale_sd": 0.1},
        {"ray_inverse_distance_per_m": 0.05, "ray_inverse_distance_sd_per_m": 0.2},
    ],
    ids=lambda values: next(iter(values)),
)
@pytest.mark.parametrize("kind", [KINDS[4], KINDS[11]], ids=name)
def test_double_core_is_the_reference_with_other_values(
    kind: dict[str, float], values: dict[str, float]
) -> None:
    assert worst_deviation({**PARAMS, **kind, **values}, seed=7, steps=80, beacons=6, real="double") < DOUBLE


@pytest.mark.parametrize("kind", KINDS, ids=name)
def test_double_core_is_the_reference_where_things_with_scales_are_measured_later(
    kind: dict[str, float],
) -> None:
    """Rays, and points that rays became, get their scale from the first distance on."""
    params = {**PARAMS, **kind, "range_scale_sd": 0.1}
    slam, reference = Slam(params, real="double"), DenseEkf(params)
    changes: set[tuple[str, str]] = set()
    for k, step in enumerate(run(11, 120, 7, params)):
        late = [s if k > 12 * s.label + 3 else replace(s, range_m=None) for s in step.sightings]
        before = [beacon.kind for beacon in reference.beacons]
        feed(slam, replace(step, sightings=late))
        feed_reference(reference, replace(step, sightings=late))
        changes |= set(zip(before, (beacon.kind for beacon in reference.beacons), strict=False))
        assert deviations(slam, reference.mean, reference.covariance, reference.angles()) < DOUBLE, k
    assert {("ray", "point"), ("ray", "sized"), ("point", "sized")} <= changes


@pytest.mark.parametrize("delay_us", [40_000, 100_000, 250_000])
@pytest.mark.parametrize("kind", KINDS, ids=name)
def test_double_core_is_the_reference_with_late_sightings(kind: dict[str, float], delay_us: int) -> None:
    """Taken at the end of a step, in the middle of one, and further back; the reference is fed in the order
    of time. The pose of now is what the reference makes of the odometry since.
    """
    params = {**PARAMS, **kind, "sighting_delay_us": delay_us}
    slam, reference = Slam(params, real="double"), DenseEkf(params)
    since: list[tuple[Motion, int]] = []  # what the reference has not been fed yet, with its duration in us
    for k, step in enumerate(run(10, 60, 6, params)):
        slam.odometry("wheels", step.time_us, step.left_m, step.right_m)
        if k > 0:
            since.append((motion_of_wheels(params, step.left_m, step.right_m, STEP_S), STEP_US))
        # Before the clock began there is nothing to look back at.
        if step.time_us >= delay_us:
            look(slam, step)
            while (excess_us := sum(duration_us for _, duration_us in since) - delay_us) > 0:
                motion, duration_us = since.pop(0)
                taken_us = min(duration_us, excess_us)
                reference.predict(part(motion, taken_us / duration_us))
                if taken_us < duration_us:
                    rest_us = duration_us - taken_us
                    since.insert(0, (part(motion, rest_us / duration_us), rest_us))
            reference.frame(step.sightings, mount(params))
        assert deviations(slam, reference.mean, reference.covariance, reference.angles()) < DOUBLE, k
        now = deepcopy(reference)
        for motion, _ in since:
            now.predict(motion)
        np.testing.assert_allclose(slam.pose(), now.mean[:3], rtol=0, atol=1e-11)
        np.testing.assert_allclose(slam.pose_covariance(), now.covariance[:3, :3], rtol=0, atol=1e-11)


@pytest.mark.parametrize("kind", KINDS[::3], ids=name)
def test_double_core_is_the_reference_with_known_beacons(kind: dict[str, float]) -> None:
    params = {**PARAMS, **kind}
    slam, reference = Slam(params, real="double"), DenseEkf(params)
    for label, place in list(enumerate(places(6)))[1:4]:
        slam.add_known_beacon(label, *place)
        reference.add_known(label, *place)
    for step in run(8, 100, 6, params):
        feed(slam, step)
        feed_reference(reference, step)
        assert deviations(slam, reference.mean, reference.covariance, reference.angles()) < DOUBLE


@pytest.mark.parametrize("kind", KINDS[1::3], ids=name)
def test_double_core_is_the_reference_while_beacons_leave_and_come_back(kind: dict[str, float]) -> None:
    params = {**PARAMS, **kind}
    rng = np.random.default_rng(9)
    for k, slam, reference in pairs(params, seed=9, steps=100, beacons=7, real="double"):
        if k % 3 == 2:
            gone = int(rng.integers(len(reference.beacons)))
            slam.remove_beacon(slam.beacons()[gone].uid)
            reference.remove(gone)
        assert deviations(slam, reference.mean, reference.covariance, reference.angles()) < DOUBLE


# ---- the reference itself ----------------------------------------------------------------------------------


def test_reference_invariant_observation_does_not_depend_on_the_heading_error() -> None:
    """What makes the invariant filter consistent: turning the whole map with the robot changes nothing that
    is seen.
    """
    reference = DenseEkf({**PARAMS, "filter": 1})
    for step in run(1, 20, 6, PARAMS):
        feed_reference(reference, step)
    for index, beacon in enumerate(reference.beacons):
        for range_m in (3.0, None):
            rows, _, _ = reference.measurement(Sighting(beacon.label, 0.1, range_m), index, mount(PARAMS))
            assert np.abs(np.array(rows)[:, 2]).max() < 1e-14


def test_reference_standard_and_invariant_agree_before_the_first_correction() -> None:
    """Coordinates of the error are no part of the prediction and of the augment step."""
    states = []
    for invariant in (0, 1):
        reference = DenseEkf({**PARAMS, "filter": invariant, "ray_linear_limit": 1e-4})
        for step in run(1, 30, 6, PARAMS):
            new = [
                s for s in step.sightings if reference.find(s.label) is None and s.label < step.time_us / 2e5
            ]
            reference.predict(motion_of_wheels(PARAMS, step.left_m, step.right_m, STEP_S))
            reference.frame(new, mount(PARAMS))
        states.append(reference)
    np.testing.assert_allclose(states[0].mean, states[1].mean, rtol=0, atol=1e-12)
    np.testing.assert_allclose(states[0].covariance, states[1].covariance, rtol=0, atol=1e-12)


# ---- float: the same estimate ------------------------------------------------------------------------------

FLOAT = 5e-3
"""Standard deviations. Rounding in float over thousands of updates gives up to 1e-3; five times that is
still nothing an estimate's user could see.
"""


@pytest.mark.parametrize("kind", KINDS, ids=name)
def test_float_core_stays_by_its_double_twin(kind: dict[str, float]) -> None:
    params = {**PARAMS, **kind}
    single, double = Slam(params, real="float"), Slam(params, real="double")
    compared = 0
    for step in run(10, 2000, 12, params):
        feed(single, step)
        feed(double, step)
        # A ray that becomes a point one frame later in float has other coordinates for so long.
        if single.counters()["settled"] == double.counters()["settled"]:
            compared += 1
            assert deviations_between(single, double) < FLOAT
    assert compared > 1900
