"""From what the user chose to parameters of the core."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from bslam.core.presets import preset_settings
from bslam.core.slam import Slam
from bslam.datasets import dlr
from bslam.errors import BslamError
from bslam.log import Odometry, Robot
from bslam.options import (
    LEAST_BEARING_SD_RAD,
    LEAST_RANGE_SD_M,
    RunOptions,
    core_params,
    odometry_lead_us,
    parse_association,
    presets_of,
    recovery_of,
)
from bslam.runs.runner import run_log


def velocity(log):
    return replace(log, odometry=Odometry("velocity", np.array([0, 40_000]), np.zeros(2), np.zeros(2)))


def test_every_parameter_exists_in_the_core(made):
    log = made.circle_log(steps=1)
    ticks = replace(
        log,
        odometry=replace(log.odometry, kind="ticks"),
        robot=replace(
            log.robot, left_radius_m=0.1, right_radius_m=0.1, ticks_per_revolution=10, counter_bits=16
        ),
    )
    known = Slam.defaults()
    for one in (log, ticks, velocity(log)):
        for observation in ("distance", "direction"):
            assert set(core_params(RunOptions(observation=observation), one)) == set(known)
    assert {name for name, _ in dlr.ROBOT.settings} <= set(known)


def test_the_robot_s_noise_and_geometry_reach_the_filter(made):
    log = made.circle_log(steps=1)
    robot = replace(
        log.robot, range_sigma_scale_m=100.0, sensor_x_m=0.1, sensor_yaw_rad=0.2, sighting_delay_us=5000
    )
    params = core_params(RunOptions(), replace(log, robot=robot))
    assert params["left_speed_sd_mps"] == params["right_speed_sd_mps"] == 0.05
    assert params["range_sd_per_m"] == pytest.approx(0.01)
    assert (params["mount_x_m"], params["mount_yaw_rad"], params["sighting_delay_us"]) == (0.1, 0.2, 5000)
    assert core_params(RunOptions(), log)["range_sd_per_m"] == 0.0  # a scale of infinity
    assert math.isinf(log.robot.range_sigma_scale_m)


@pytest.mark.parametrize(
    ("key", "low", "high"),
    [
        ("wheelbase_m", 1e-3, 10.0),
        ("wheel_speed_sigma_mps", 0.0, 100.0),
        ("bearing_sigma_rad", 0.0, 3.2),
        ("range_sigma_floor_m", 0.0, 100.0),
        ("range_sigma_fraction", 0.0, 10.0),
        ("range_sigma_scale_m", 0.1, math.inf),
        ("sensor_x_m", -100.0, 100.0),
        ("sensor_y_m", -100.0, 100.0),
        ("sensor_yaw_rad", -3.2, 3.2),
        ("sighting_delay_us", 0, 10_000_000),
        ("left_radius_m", 1e-4, 10.0),
        ("right_radius_m", 1e-4, 10.0),
        ("ticks_per_revolution", 1, 10_000_000),
        ("counter_bits", 2, 32),
    ],
)
def test_whatever_robot_toml_may_hold_the_core_takes(made, key, low, high):
    log = made.circle_log(steps=1)
    log = replace(log, odometry=replace(log.odometry, kind="ticks"))
    encoders = {"left_radius_m": 0.1, "right_radius_m": 0.1, "ticks_per_revolution": 10, "counter_bits": 16}
    rule = next(one for one in fields(Robot) if one.name == key).metadata["rule"]
    for value in (low, high):
        robot = replace(log.robot, **(encoders | {key: rule.convert(value, key)}))
        Slam(
            core_params(RunOptions(), replace(log, robot=robot, odometry=replace(log.odometry, kind="ticks")))
        )
    step = 1 if isinstance(low, int) else 1e-5
    for value in {low - step, high + step} - {math.inf}:
        with pytest.raises(BslamError, match=f"{key}: .* is not allowed; allowed: "):
            rule.convert(value, key)


def test_a_sensor_without_noise_is_told_to_err_a_little(made):
    log = made.circle_log(steps=400)
    perfect = replace(log.robot, bearing_sigma_rad=0.0, range_sigma_fraction=0.0)
    params = core_params(RunOptions(), replace(log, robot=perfect))
    assert params["bearing_sd_rad"] == LEAST_BEARING_SD_RAD
    assert params["range_sd_floor_m"] == LEAST_RANGE_SD_M
    assert next(one for one in Slam.parameters() if one.name == "bearing_sd_rad").low == LEAST_BEARING_SD_RAD
    assert core_params(RunOptions(), log)["range_sd_floor_m"] == 0.0  # its distances err in proportion
    trace = run_log(replace(log, robot=perfect), RunOptions())
    assert np.hypot(trace.pose[-1, 0] - log.truth.x_m[-1], trace.pose[-1, 1] - log.truth.y_m[-1]) < 1e-3


def test_sigma_of_the_command_line_wins_over_the_log_s_and_set_over_all(made):
    log = made.circle_log(steps=1)
    assert core_params(RunOptions(sigma_mps=0.7), log)["left_speed_sd_mps"] == 0.7
    chosen = RunOptions(sigma_mps=0.7, parameters=(("left_speed_sd_mps", 0.1), ("filter", 0)))
    assert core_params(chosen, log)["left_speed_sd_mps"] == 0.1
    assert core_params(chosen, log)["filter"] == 0


@pytest.mark.parametrize(("name", "walk"), [("smoother", 30.0)])
def test_what_is_set_for_directions_alone_is_not_where_distances_are_seen(made, name, walk):
    log, options = made.circle_log(steps=1), RunOptions(observation="direction", filter=name)
    assert core_params(options, log)["velocity_walk_mps_sqrt_s"] == walk
    ranged = core_params(replace(options, observation="distance"), log)
    assert ranged["velocity_walk_mps_sqrt_s"] == Slam.defaults()["velocity_walk_mps_sqrt_s"]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (RunOptions(), ("paper",)),
        (RunOptions(noise="actuation"), ("real-wheels",)),
        (RunOptions(sigma_mps=0.0), ("real-wheels",)),
        (RunOptions(sensor="camera"), ("paper", "camera")),
        (RunOptions(observation="direction", noise="actuation"), ("real-wheels", "bearing-only")),
        (RunOptions(presets=("camera",)), ("camera",)),
    ],
)
def test_presets_are_chosen_by_what_the_log_says_unless_asked_for(made, options, expected):
    log = made.circle_log(steps=1)
    assert presets_of(options, log) == expected
    params, preset = core_params(options, log), preset_settings(expected, 0, 1)
    assert params["huber_d"] == preset["huber_d"]
    assert params["velocity_states"] == preset["velocity_states"]
    assert presets_of(RunOptions(), velocity(log)) == ("real-wheels",)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (RunOptions(), 1),
        (RunOptions(noise="actuation"), 0),
        (RunOptions(noise="actuation", velocity_states=True), 1),
        (RunOptions(velocity_states=False), 0),
        (RunOptions(sigma_mps=0.0), 0),  # nothing errs: the filter refuses a speedometer without noise
    ],
)
def test_velocity_states_belong_to_speedometer_noise(made, options, expected):
    assert core_params(options, made.circle_log(steps=1))["velocity_states"] == expected


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (RunOptions(), "off"),
        (RunOptions(association="svm"), "growing"),
        (RunOptions(association="svm", kept_map="room.bslam"), "carried"),
        (RunOptions(kept_map="room.bslam"), "carried"),
        (RunOptions(association="svm", recovery="off"), "off"),
        (RunOptions(association="svm", recovery="carried"), "carried"),
    ],
)
def test_what_a_run_notices_of_being_lost(made, options, expected):
    assert recovery_of(options) == expected
    params = core_params(options, made.circle_log(steps=1))
    assert params["recovery"] == int(expected != "off")
    settled_us = 1_000_000_000 if expected == "growing" else Slam.defaults()["settled_us"]
    assert params["settled_us"] == settled_us


def test_speeds_without_a_noise_count_as_commands(made):
    measured = velocity(made.circle_log(steps=1))
    log = replace(measured, robot=replace(measured.robot, wheel_speed_sigma_mps=0.0, sighting_delay_us=5_000))
    assert presets_of(RunOptions(), log) == ("real-wheels", "commanded")
    params, preset = core_params(RunOptions(), log), preset_settings(["commanded"], 0, 1)
    same = ("scale_states", "forward_sd_per_sqrt_m", "turn_sd_per_sqrt_rad", "huber_d", "gate_d2")
    assert [params[name] for name in same] == [preset[name] for name in same]
    assert params["left_speed_sd_mps"] == params["velocity_states"] == 0
    # Commands lead the motion; the images' own delay is on top.
    assert odometry_lead_us(RunOptions(), log) == preset["sighting_delay_us"] == 175_000
    assert params["sighting_delay_us"] == 180_000
    # Errors alike for many frames: the scatter that the log tells counts for more, never for less.
    assert params["bearing_sd_rad"] == preset["bearing_sd_rad"] > log.robot.bearing_sigma_rad
    coarse = replace(log, robot=replace(log.robot, bearing_sigma_rad=0.3))
    assert core_params(RunOptions(), coarse)["bearing_sd_rad"] == 0.3
    directions = core_params(RunOptions(observation="direction", filter="smoother"), log)
    assert directions["bearing_sd_rad"] == 2 * params["bearing_sd_rad"]
    asked = core_params(RunOptions(velocity_states=True), log)
    assert (asked["velocity_states"], asked["scale_states"]) == (1, 0)


@pytest.mark.parametrize("options", [RunOptions(sigma_mps=0.1), RunOptions(presets=("real-wheels",))])
def test_speeds_with_a_noise_are_measured(made, options):
    log = velocity(made.circle_log(steps=1))
    log = replace(log, robot=replace(log.robot, wheel_speed_sigma_mps=0.0))
    assert presets_of(options, log) == ("real-wheels",)
    assert odometry_lead_us(options, log) == 0
    assert core_params(options, log)["left_speed_sd_mps"] == (options.sigma_mps or 0.0)


def test_a_detector_that_scores_is_a_camera(made):
    log = made.circle_log(steps=1)
    scored = replace(log.sightings, score=np.ones(len(log.sightings.time_us)))
    assert presets_of(RunOptions(), replace(log, sightings=scored)) == ("paper", "camera")


def test_settings_of_the_log_win_over_presets_and_lose_against_the_user(made):
    log = made.circle_log(steps=1)
    told = replace(log, robot=replace(log.robot, settings=(("gate_d2", 0), ("turn_sd_per_sqrt_m", 0.04))))
    assert core_params(RunOptions(), told)["turn_sd_per_sqrt_m"] == 0.04
    assert core_params(RunOptions(parameters=(("gate_d2", 9.0),)), told)["gate_d2"] == 9.0
    wrong = replace(log, robot=replace(log.robot, settings=(("gate", 0),)))
    with pytest.raises(
        BslamError, match=r"robot\.toml, \[settings\], key gate: no such setting; allowed: gate_d2 or"
    ):
        core_params(RunOptions(), wrong)


def test_a_frame_may_be_ahead_by_as_much_as_readings_are_apart(made):
    log = made.circle_log(steps=3)
    assert core_params(RunOptions(), log)["ahead_max_us"] == Slam.defaults()["ahead_max_us"]
    slow = replace(log.odometry, time_us=log.odometry.time_us * 25)
    assert core_params(RunOptions(), replace(log, odometry=slow))["ahead_max_us"] == 25 * made.step_us


@pytest.mark.parametrize(
    ("text", "expected"),
    [("known", ("known", 0.0)), ("known:0.05", ("known", 0.05)), ("nearest", ("nearest", 0.0))],
)
def test_parse_association_reads(text, expected):
    assert parse_association(text) == expected


@pytest.mark.parametrize("text", ["jcbb", "known:", "known:2", "known:nan", "known:x", "nearest:0.1", ""])
def test_parse_association_says_what_is_allowed(text):
    with pytest.raises(
        BslamError, match=r"allowed: known, known:RATE with RATE from 0 to 1, nearest, mahalanobis"
    ):
        parse_association(text)


def test_association_name_is_what_the_command_line_takes():
    assert RunOptions(association="known", wrong_identity_rate=0.05).association_name == "known:0.05"
    assert RunOptions(association="nearest").association_name == "nearest"
