"""The best that could be known of a drive: right by right sightings, and no better than they are."""

from dataclasses import replace

import numpy as np

from bound_drive import (
    KNOWN_SD_M,
    RANGED_WAYS,
    UNKNOWN_SD_M,
    WAYS,
    at_moments_m,
    best_errors_m,
    with_true_sizes,
)
from bound_restart import restarts
from bslam.core.slam import Slam
from bslam.experiment.options import RunOptions, core_params
from bslam.log import Log, Sightings
from bslam.world.simulate import load_scenario, simulate
from measure_restart import DRIVEN_US, SWITCHED_ON_AT, part


def _log() -> Log:
    return simulate(load_scenario("paper_room"), seed=3, sigma_mps=0.6)


def _best_m(log: Log, way: str) -> list[float]:
    params = Slam.defaults() | core_params(RunOptions(association="known", sigma_mps=0.6), log)
    return [float(best_errors_m(one, params, WAYS[way], KNOWN_SD_M)[-1]) for one in restarts(log)]


def test_restarts_end_five_seconds_after_two_beacons_were_in_view() -> None:
    log = _log()
    parts = list(restarts(log))
    assert len(parts) == len(SWITCHED_ON_AT)
    for first, one in zip(SWITCHED_ON_AT, parts, strict=True):
        assert one.odometry.time_us[0] == log.odometry.time_us[first]
        driven_us = one.odometry.time_us[-1] - one.odometry.time_us[0]
        assert DRIVEN_US <= driven_us < 6 * DRIVEN_US


def test_best_is_near_by_right_sightings_and_off_by_as_much_as_they_are() -> None:
    log = _log()
    right_m = _best_m(log, "as told")
    assert max(right_m) < 0.1
    seen = log.sightings
    skewed = replace(log, sightings=replace(seen, range_m=1.1 * seen.range_m))
    worse = np.array(_best_m(skewed, "as told")) / right_m
    assert worse.min() > 1.3
    np.testing.assert_allclose(_best_m(skewed, "directions alone"), _best_m(log, "directions alone"))


def test_best_of_a_drive_is_as_good_as_its_sizes() -> None:
    log = part(_log(), 0, 1000)
    params = Slam.defaults() | core_params(RunOptions(association="known", sigma_mps=0.6), log)

    def mean_m(log: Log) -> float:
        return float(best_errors_m(log, params, WAYS["as told"], UNKNOWN_SD_M).mean())

    skewed = replace(log, sightings=replace(log.sightings, range_m=1.3 * log.sightings.range_m))
    right_m = mean_m(with_true_sizes(log))
    assert right_m < 0.15
    assert mean_m(skewed) > 1.5 * right_m
    assert abs(mean_m(with_true_sizes(skewed)) - right_m) < 1e-3


def test_best_with_sizes_estimated_finds_what_each_beacon_and_kind_errs_by() -> None:
    log = part(_log(), 0, 1000)
    params = Slam.defaults() | core_params(RunOptions(association="known", sigma_mps=0.6), log)
    seen = log.sightings
    count = len(seen.time_us)
    kind = np.where(np.arange(count) % 3 == 0, 2, 1)
    doubtful = replace(
        seen,
        range_m=seen.range_m * (1 + 0.1 * np.sin(seen.beacon_id) + 0.1 * (kind == 2)),
        range_sd_m=0.03 * seen.range_m,
        range_scale_sd=np.full(count, 0.2),
        beacon_class=kind,
    )

    def mean_m(sightings: Sightings, way: str) -> float:
        one = replace(log, sightings=sightings)
        return float(best_errors_m(one, params, WAYS[way], UNKNOWN_SD_M).mean())

    estimated_m = mean_m(doubtful, "sizes estimated")
    assert estimated_m < 0.6 * mean_m(doubtful, "as told")
    # Of whose scale nothing is in doubt, nothing is estimated.
    assert mean_m(seen, "sizes estimated") == mean_m(seen, "as told")


def test_best_on_the_way_knows_nothing_of_what_comes() -> None:
    log = part(_log(), 0, 400)
    options = RunOptions(association="known", sigma_mps=0.6)
    params = Slam.defaults() | core_params(options, log)
    errors_m = at_moments_m(log, options, params, 2)
    assert errors_m.shape == (2, len(RANGED_WAYS) + 1)
    assert 0 < errors_m.max() < 0.5
    spoilt = log.sightings.range_m.copy()
    spoilt[log.sightings.time_us > log.odometry.time_us[100]] *= 2
    other_m = at_moments_m(replace(log, sightings=replace(log.sightings, range_m=spoilt)), options, params, 2)
    np.testing.assert_array_equal(other_m[0], errors_m[0])
    assert (other_m[1] != errors_m[1]).all()
