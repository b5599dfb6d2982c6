"""What no log can mean is named before anything is fitted, and the fit blames nothing else for it."""

from dataclasses import replace

import numpy as np
import pytest

from bslam.api import check
from logcheck.drives import made_up, with_odometry, with_robot, with_sightings


def by_place(log):
    seen = log.sightings
    _, frame = np.unique(seen.time_us, return_inverse=True)
    return with_sightings(log, beacon_id=np.arange(len(frame)) - np.searchsorted(frame, frame))


def twice(log):
    seen, random = log.sightings, np.random.default_rng(0)
    rows = np.repeat(np.arange(len(seen.time_us)), 2)
    other = np.tile([0.0, 1.0], len(rows) // 2) * random.normal(0.0, 0.02, len(rows))
    columns = {name: getattr(seen, name)[rows] for name in ("time_us", "beacon_id", "range_m", "mappable")}
    return with_sightings(log, bearing_rad=seen.bearing_rad[rows] + other, **columns)


def in_degrees(log):
    return replace(log, truth=replace(log.truth, theta_rad=np.degrees(log.truth.theta_rad)))


def travel(change):
    return lambda log: with_odometry(log, a=change(log.odometry.a), b=change(log.odometry.b))


ALONE = {
    "sums": (travel(np.cumsum), "sums since the start"),
    "sums of ticks": (travel(lambda one: np.round(1e4 * np.cumsum(one))), "sums since the start"),
    "ticks": (travel(lambda one: np.round(10_240 * one)), "times too large, and in no unit that is known"),
    "tenths": (travel(lambda one: 0.1 * one), " times too small, and in no unit that is known"),
    "places": (by_place, "beacon_id counts the sightings of each frame, from 0 to "),
}
SLIPS = {
    "speeds": (travel(lambda one: one / 0.04), "left_m and right_m are speeds", "by 0.04"),
    "step in ms": (lambda log: with_robot(log, step_us=40), "step_us is in milliseconds", "step_us = 40000"),
    "no bearing noise": (
        lambda log: with_robot(log, bearing_sigma_rad=0.0),
        "bearings scatter",
        "bearing_sigma_rad = 0.0",
    ),
    "no wheel noise": (
        lambda log: with_robot(log, wheel_speed_sigma_mps=0.0),
        "odometry is told to have no noise",
        "wheel_speed_sigma_mps = 0.0",
    ),
    "view": (lambda log: with_robot(log, field_of_view_rad=1.0), "outside of field_of_view_rad", "= 3.9"),
    "twice": (twice, "frames have one beacon_id several times", "keep one sighting"),
    "degrees": (in_degrees, "truth.csv: theta_rad is in degrees", "0.0174533"),
}


@pytest.mark.parametrize("name", ALONE)
@pytest.mark.parametrize("has_truth", [True, False])
def test_check_what_no_log_can_mean_is_named_alone(name, has_truth):
    change, what = ALONE[name]
    report = check(change(made_up(has_truth=has_truth)))
    (one,) = report.findings
    assert what in one.what
    assert report.untested == ["all else: mend this first, then check again"]


@pytest.mark.parametrize("name", SLIPS)
def test_check_a_slip_that_spoils_a_fit_is_the_only_finding(name):
    change, what, mend = SLIPS[name]
    (one,) = [one for one in check(change(made_up(has_truth=True))).findings if not one.is_note]
    assert what in one.what and mend in one.mend
