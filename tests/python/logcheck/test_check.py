"""A log is tested before it is believed: what is planted is named, with what mends it, and nothing else."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bslam.log import first_steps
from bslam.logcheck.check import check_log
from bslam.world.simulate import load_scenario, simulate
from logcheck.drives import arc, exchanged, made_up, with_odometry, with_robot, with_sightings


def found(log):
    report = check_log(log)
    return [one for one in report.findings if not one.is_note], report


def the_one(log):
    """The only finding."""
    findings, _ = found(log)
    assert len(findings) == 1, [one.what for one in findings]
    return findings[0]


@pytest.mark.parametrize("kind", ["wheels", "ticks", "velocity"])
@pytest.mark.parametrize("seed", [0, 1])
def test_check_a_good_log_finds_nothing(kind, seed):
    findings, report = found(made_up(seed, kind=kind))
    assert findings == []
    assert report.untested == []
    assert report.estimates["turn"]["value"] == pytest.approx(1.0, abs=0.03)
    assert report.estimates["way"]["value"] == pytest.approx(1.0, abs=0.02)
    half_a_row_s = 0.02  # within a row of odometry its noise hides the delay
    assert report.estimates["delay"]["value"] == pytest.approx(0.0, abs=1.5 * half_a_row_s)


@pytest.mark.parametrize(("sigma_mps", "steps"), [(0.05, 2000), (0.3, 2000)])
def test_check_a_simulated_log_finds_nothing(sigma_mps, steps):
    log = simulate(load_scenario("paper_room"), 11, sigma_mps, None)
    assert found(first_steps(log, steps))[0] == []


@pytest.mark.parametrize("seconds", [10, 60])
def test_check_exact_wheels_that_are_told_so_err_by_nothing(seconds):
    log = simulate(load_scenario("paper_room"), 3, 0.0, None)
    assert found(first_steps(log, 25 * seconds))[0] == []


@pytest.mark.parametrize(("seed", "seconds"), [(2, 30), (6, 10)])
def test_check_a_delay_is_not_bought_with_a_way_of_another_size(seed, seconds):
    log = simulate(load_scenario("paper_room"), seed, 1.0, None)
    assert found(first_steps(log, 25 * seconds))[0] == []


def mirrored(log):
    return with_sightings(log, bearing_rad=-log.sightings.bearing_rad)


def swapped(log):
    return with_odometry(log, a=log.odometry.b, b=log.odometry.a)


@pytest.mark.parametrize("ranges", [True, False])
def test_check_a_detector_that_hangs_is_named(ranges):
    log = first_steps(made_up(), 200)
    seen = log.sightings
    same = {"range_m": np.full(len(seen.time_us), 2.0 if ranges else np.nan)}
    one = the_one(with_sightings(log, bearing_rad=np.full(len(seen.time_us), 0.1), **same))
    assert one.what == "sightings do not change while odometry moves" and "hangs" in one.mend
    moved = np.where(np.arange(len(seen.time_us)) == 100, 0.2, 0.1)
    findings, _ = found(with_sightings(log, bearing_rad=moved, **same))
    assert "hangs" not in str(findings)


def test_check_mirrored_bearings_are_told_from_swapped_wheels_by_the_map():
    one = the_one(mirrored(made_up()))
    assert one.kind == "mirrored bearings"
    assert one.mend == "multiply bearing_rad of sightings.csv by -1"
    assert one.picture is not None
    one = the_one(swapped(made_up()))
    assert one.kind == "swapped wheels"
    assert one.mend == "exchange the columns left_m and right_m"


def test_check_mirrored_bearings_without_any_truth_names_both():
    one = the_one(replace(mirrored(made_up()), beacons=None))
    assert "bearings are mirrored, or left and right wheel are swapped" in one.what
    assert "multiply bearing_rad" in one.mend and "exchange the columns" in one.mend


def test_check_a_mirrored_map_is_not_blamed_on_the_robot():
    log = made_up()
    one = the_one(replace(log, beacons=replace(log.beacons, y_m=-log.beacons.y_m)))
    assert one.kind == "mirrored bearings" and one.what.startswith("beacons.csv is mirrored")


@pytest.mark.parametrize(("name", "factor"), [("millimetres", 1e3), ("centimetres", 1e2)])
def test_check_a_wrong_unit_is_named_with_whose_it_is(name, factor):
    log = made_up()
    ranges = with_sightings(log, range_m=factor * log.sightings.range_m)
    assert the_one(ranges).what == f"sightings.csv: range_m is in {name}"
    both = with_odometry(ranges, a=factor * log.odometry.a, b=factor * log.odometry.b)
    assert the_one(both).what.endswith(f"left_m and right_m and range_m are in {name}")
    odometry = with_odometry(log, a=factor * log.odometry.a, b=factor * log.odometry.b)
    assert the_one(odometry).what == f"odometry: left_m and right_m are in {name}"
    beacons = replace(log.beacons, x_m=factor * log.beacons.x_m, y_m=factor * log.beacons.y_m)
    one = the_one(replace(log, beacons=beacons))
    assert (one.kind, one.mend.split(",")[0]) == (
        "units",
        f"multiply x_m and y_m of beacons.csv by {1 / factor:.4g}",
    )


def test_check_units_of_speeds_are_told_apart():
    log = made_up(kind="velocity")
    both = with_odometry(log, a=1e3 * log.odometry.a, b=np.degrees(log.odometry.b))
    assert {(one.kind, one.mend) for one in found(both)[0]} == {
        ("units", "multiply v_mps by 0.001"),
        ("degrees", "multiply omega_radps by 0.0174533"),
    }


def test_check_directions_in_degrees_are_named():
    log = made_up()
    one = the_one(with_sightings(log, bearing_rad=np.degrees(log.sightings.bearing_rad)))
    assert one.kind == "degrees" and "pi/180" in one.mend


@pytest.mark.parametrize("delay_s", [0.12, 0.4, -0.2])
def test_check_a_delay_is_named_with_the_setting_that_mends_it(delay_s):
    log = made_up()
    late_us = log.sightings.time_us + round(1e6 * delay_s)
    one = the_one(with_sightings(log, time_us=late_us))
    assert one.kind == "delay"
    if delay_s > 0.0:
        setting, value_us = one.mend.split("=")
        assert setting == "--set sighting_delay_us"
        told = with_robot(with_sightings(log, time_us=late_us), sighting_delay_us=int(value_us))
    else:
        _, value_us, *_, file = one.mend.split()
        assert file == "sightings.csv" and "time_us" in one.mend
        told = with_sightings(log, time_us=late_us + int(value_us))
    assert int(value_us) == pytest.approx(1e6 * abs(delay_s), abs=15_000)
    assert found(told)[0] == []


@pytest.mark.parametrize("seed", [2, 5])
@pytest.mark.parametrize("delay_s", [0.3, 0.4])
def test_check_a_delay_on_an_arc_is_named_or_said_not_to_be_tested(seed, delay_s):
    log = arc(seed, 0.01)
    findings, report = found(with_sightings(log, time_us=log.sightings.time_us + round(1e6 * delay_s)))
    assert [one.kind for one in findings] == ["delay"] or any("delay" in one for one in report.untested)


def test_check_a_delay_that_a_drive_hardly_shows_is_as_unsure_as_it_is_wrong():
    log = made_up(2, turn_most_radps=0.2)
    late = with_sightings(log, time_us=log.sightings.time_us + 300_000)
    one = the_one(late)
    value_s, error_s = one.figures["delay_s"], one.figures["error"]
    assert abs(value_s - 0.3) < 1.5 * error_s
    assert error_s >= 0.99 * value_s / math.sqrt(2.0 * one.figures["log_likelihood_gain"])


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_check_the_scale_of_the_way_is_named(factor):
    log = made_up()
    one = the_one(
        with_robot(
            with_odometry(log, a=factor * log.odometry.a, b=factor * log.odometry.b),
            wheelbase_m=factor * log.robot.wheelbase_m,
        )
    )
    assert one.mend.startswith("--set forward_scale=")
    assert float(one.mend.split("=")[1]) == pytest.approx(1.0 / factor, rel=0.02)


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_check_the_scale_of_the_turn_is_named(factor):
    log = made_up()
    one = the_one(with_robot(log, wheelbase_m=log.robot.wheelbase_m / factor))
    assert one.mend.startswith("--set turn_scale=")
    assert float(one.mend.split("=")[1]) == pytest.approx(1.0 / factor, rel=0.02)


def test_check_one_wheel_of_another_size_is_named():
    log = made_up(kind="ticks")
    kinds = [one.what for one in found(with_robot(log, left_radius_m=1.08 * log.robot.left_radius_m))[0]]
    assert any("left wheel goes" in what and "too far" in what for what in kinds)


def test_check_ranges_off_by_a_tenth_are_told_from_a_long_way_by_the_beacons():
    log = made_up()
    one = the_one(with_sightings(log, range_m=1.1 * log.sightings.range_m))
    assert one.what.startswith("beacons.csv is 0.9")


def test_check_ranges_and_a_way_that_differ_are_blamed_on_one_only_where_something_tells():
    log = made_up(has_truth=True)
    long = with_sightings(log, range_m=1.25 * log.sightings.range_m)
    one = the_one(replace(long, truth=None))
    assert "odometry's way is" in one.what and "or distances of sightings are" in one.what
    forward, distances = one.mend.split("; or multiply range_m of sightings.csv, ")
    assert float(forward.removeprefix("--set forward_scale=")) == pytest.approx(1.25, rel=0.02)
    assert float(distances.split()[-1]) == pytest.approx(0.8, rel=0.02)
    one = the_one(long)
    assert one.what.startswith("distances of sightings are 2") and one.what.endswith("% too long")
    path, truth = one.picture.curves
    assert (path.label, truth.label) == ("path", "truth.csv")
    assert np.ptp(path.x) == pytest.approx(1.25 * np.ptp(truth.x), rel=0.05)
    assert float(one.mend.split()[-1]) == pytest.approx(0.8, rel=0.03)
    short = with_odometry(log, a=0.8 * log.odometry.a, b=0.8 * log.odometry.b)
    short = with_robot(short, wheelbase_m=0.8 * log.robot.wheelbase_m)
    assert float(the_one(short).mend.removeprefix("--set forward_scale=")) == pytest.approx(1.25, rel=0.02)


def test_check_a_mend_is_tested_again():
    log = made_up()
    spoilt = with_robot(with_odometry(log, a=0.8 * log.odometry.a, b=0.8 * log.odometry.b), wheelbase_m=0.2)
    mends = dict(one.mend.removeprefix("--set ").split("=") for one in found(spoilt)[0])
    assert set(mends) == {"forward_scale", "turn_scale"}
    settings = tuple((key, float(value)) for key, value in mends.items())
    assert found(with_robot(spoilt, settings=settings))[0] == []
    half = with_robot(spoilt, settings=(("forward_scale", 1.1), ("turn_scale", float(mends["turn_scale"]))))
    assert the_one(half).mend[:-2] == f"--set forward_scale={mends['forward_scale']}"[:-2]
    assert check_log(spoilt, settings).findings == []


def test_check_noise_told_too_small_is_named_and_too_large_noted():
    log = made_up()
    kinds = {"bearing_sigma_rad": 0.02, "range_sigma_fraction": 0.02, "range_sigma_floor_m": 0.02}
    small = with_robot(log, **{key: value / 3.0 for key, value in kinds.items()})
    findings = found(small)[0]
    assert [one.kind for one in findings] == ["noise", "noise"]
    for one in findings:
        assert one.figures["single"] == pytest.approx(3.0, rel=0.15)
    findings, report = found(with_robot(log, **{key: 6.0 * value for key, value in kinds.items()}))
    assert findings == []
    assert [one.kind for one in report.findings] == ["noise", "noise"]


@pytest.mark.parametrize(("first_s", "last_s"), [(20.0, 45.0), (35.0, 60.0)])
def test_check_labels_exchanged_for_a_while_are_named_with_when(first_s, last_s):
    one = the_one(exchanged(made_up(), 1, 7, first_s, last_s))
    assert one.kind == "identities"
    assert sorted(one.figures["labels"]) == ["1", "7"]
    row_s = 0.04  # times are from the first row of odometry
    assert first_s - row_s <= one.figures["from_s"] < one.figures["until_s"] <= last_s
    assert one.figures["until_s"] - one.figures["from_s"] > 0.6 * (last_s - first_s)


def test_check_labels_exchanged_against_the_map_are_named():
    one = the_one(exchanged(made_up(), 2, 5, 0.0, 1e6))
    assert one.kind == "identities" and one.figures["labels"] == ["2", "5"] and "beacons.csv" in one.mend


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_check_missing_identities_are_counted(share):
    log = made_up()
    ids = log.sightings.beacon_id
    blank = np.random.default_rng(0).random(len(ids)) < share
    findings, report = found(with_sightings(log, beacon_id=np.where(blank, -1, ids)))
    assert [one.what for one in findings] == [
        f"{blank.sum()} of {len(ids)} sightings have no identity",
    ]
    assert len(report.untested) == (share == 1.0)


def test_check_sightings_of_another_time_are_named():
    log = made_up()
    one = the_one(with_sightings(log, time_us=log.sightings.time_us + 10**9))
    assert one.kind == "stamps" and "before or after odometry" in one.what


def test_check_by_directions_alone_tests_signs_and_says_what_it_does_not():
    log = mirrored(made_up())
    blind = with_sightings(log, range_m=np.full(len(log.sightings.range_m), math.nan))
    findings, report = found(blind)
    assert [one.kind for one in findings] == ["mirrored bearings"]
    assert any("no sighting has a distance" in one for one in report.untested)


def test_check_a_robot_at_rest_or_on_a_straight_says_what_it_cannot_test():
    log = made_up()
    still = np.zeros(len(log.odometry.a))
    findings, report = found(with_odometry(log, a=still, b=still))
    assert findings == [] and len(report.untested) == 1
    straight = found(with_odometry(log, a=log.odometry.a, b=log.odometry.a))[1]
    assert any("hardly turns" in one for one in straight.untested)


@pytest.mark.parametrize(("seed", "sigma_mps"), [(8, 0.01), (11, 0.01), (3, 0.1), (7, 0.1)])
def test_check_an_arc_does_not_tell_a_wheel_from_the_scale_of_the_turn(seed, sigma_mps):
    findings, report = found(arc(seed, sigma_mps))
    assert findings == []
    assert [one for one in report.untested if one.endswith("the drive has one curvature")]
    assert not {"turn", "bend"} & set(report.estimates)
