"""What a drive has that the filter is not told: each does what it says, and nothing else."""

import math
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.log import Log, Sightings, wrap_rad
from bslam.rig import load_rig
from bslam.runs.camera import CameraStore, camera_log
from bslam.world.scenario import Encoders, Gaps, Gyro, Mismatch, Scenario, Slips, load_scenario
from bslam.world.sensor import look
from bslam.world.simulate import simulate, true_drive
from bslam.world.untold import coloured

STEP_S = 0.04
SIGMAS = 5.0  # a figure of so many draws may be off by as many of its standard errors


def changed(scenario: Scenario, **tables: dict) -> Scenario:
    """With those keys in those tables."""
    return replace(
        scenario, **{name: replace(getattr(scenario, name), **keys) for name, keys in tables.items()}
    )


def exact(scenario: Scenario) -> Scenario:
    """Without noise of wheels and sensor."""
    noise = {"bearing_sigma_rad": 0.0, "range_sigma_fraction": 0.0, "range_sigma_scale_m": math.inf}
    return changed(scenario, sensor=noise, wheels={"sigma_mps": 0.0})


def assert_same(one: object, other: object) -> None:
    for field in fields(one):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))


def assert_only(part: str, one: Log, other: Log) -> None:
    """The two differ in that part, and in what the filter is told not at all."""
    assert one.robot == other.robot
    for name in {"odometry", "sightings", "truth"} - {part}:
        assert_same(getattr(one, name), getattr(other, name))
    with pytest.raises(AssertionError):
        assert_same(getattr(one, part), getattr(other, part))


def rows_of(some: Sightings, others: Sightings) -> NDArray[np.intp]:
    """Which rows of `others` these are, by time and beacon."""
    keys = list(zip(others.time_us.tolist(), others.beacon_id.tolist(), strict=True))
    place = {key: row for row, key in enumerate(keys)}
    return np.array([place[key] for key in zip(some.time_us.tolist(), some.beacon_id.tolist(), strict=True)])


def correlation(noise: NDArray[np.float64], lag: int) -> float:
    return float(np.mean(noise[lag:] * noise[:-lag]) / np.mean(noise**2))


@pytest.mark.parametrize(
    ("noise", "wheels_m", "gyro_radps", "end", "sightings"),
    [
        (
            "speedometer",
            (-0.008369190955, 0.017152312774),
            -0.02730943914,
            (7.125515098, 0.3601551439),
            (897, 340.0388163, 4798.043515),
        ),
        (
            "actuation",
            (-0.00016, 0.016951442171),
            -0.02309422997,
            (6.983830240, 0.1864524389),
            (940, 223.0067235, 4902.917830),
        ),
    ],
)
def test_simulate_as_told_draws_what_it_always_drew(
    short_room: Scenario,
    noise: str,
    wheels_m: tuple[float, float],
    gyro_radps: float,
    end: tuple[float, float],
    sightings: tuple[int, float, float],
) -> None:
    """Numbers of the simulator before it knew any mismatch: what is added may take none of its draws.

    To 1e-6, as the last bits are the machine's cosine's; another draw changes the first digit.
    """
    room = changed(replace(short_room, gyro=Gyro(0.02, 0.05)), sensor={"outlier_share": 0.2})
    log = simulate(room, 4, noise=noise)
    assert log.truth is not None and log.odometry.gyro_radps is not None
    assert (log.odometry.a[0], log.odometry.b[499]) == pytest.approx(wheels_m, rel=1e-6)
    assert log.odometry.gyro_radps[250] == pytest.approx(gyro_radps, rel=1e-6)
    assert (log.truth.x_m[-1], log.truth.theta_rad[-1]) == pytest.approx(end, rel=1e-6)
    seen = log.sightings
    assert (len(seen.time_us), seen.bearing_rad.sum(), seen.range_m.sum()) == pytest.approx(
        sightings, rel=1e-6
    )


def test_range_scale_lengthens_every_distance_by_its_share(short_room: Scenario) -> None:
    told, long = (
        simulate(room, 3) for room in (short_room, changed(short_room, mismatch={"range_scale": 1.05}))
    )
    assert_only("sightings", long, told)
    drive = true_drive(short_room, 3)
    poses = np.stack([drive.x_m, drive.y_m, drive.theta_rad], axis=1)
    true_m = look(short_room.arena, short_room.sensor, poses)[1]
    true_m = true_m[told.sightings.time_us // 40_000, told.sightings.beacon_id]
    added_m = long.sightings.range_m - told.sightings.range_m  # the same noise in both
    np.testing.assert_allclose(added_m, 0.05 * true_m, atol=1e-12)
    np.testing.assert_array_equal(long.sightings.bearing_rad, told.sightings.bearing_rad)


def test_range_scale_sd_gives_each_beacon_a_factor_of_its_own(short_room: Scenario) -> None:
    room = exact(short_room)
    factors = []
    for seed in range(15):
        told, off = (
            simulate(one, seed).sightings for one in (room, changed(room, mismatch={"range_scale_sd": 0.05}))
        )
        factor = off.range_m / told.range_m
        for beacon in np.unique(told.beacon_id):
            own = factor[told.beacon_id == beacon]
            assert np.ptp(own) < 1e-12
            factors.append(own[0])
    assert len(set(np.round(factors, 9))) == len(factors) > 50
    assert np.mean(factors) == pytest.approx(1.0, abs=SIGMAS * 0.05 / math.sqrt(len(factors)))
    assert np.std(factors) == pytest.approx(0.05, rel=SIGMAS / math.sqrt(2 * len(factors)))


@pytest.mark.parametrize(
    ("mismatch", "sensor"),
    [
        ({"sensor_yaw_rad": 0.035}, {"yaw_rad": 0.2 + 0.035}),
        ({"sensor_x_m": 0.1, "sensor_y_m": -0.05}, {"x_m": -0.05 + 0.1, "y_m": -0.05}),
        ({"delay_us": 100_000}, {"delay_us": 130_000}),
        ({"delay_us": -30_000}, {"delay_us": 0}),
    ],
)
def test_sensor_mismatch_is_a_sensor_that_is_not_as_told(
    short_room: Scenario, mismatch: dict, sensor: dict
) -> None:
    room = changed(short_room, sensor={"x_m": -0.05, "yaw_rad": 0.2, "delay_us": 30_000})
    told, off = simulate(room, 5), simulate(changed(room, mismatch=mismatch), 5)
    assert_only("sightings", off, told)
    assert_same(off.sightings, simulate(changed(room, sensor=sensor), 5).sightings)


@pytest.mark.parametrize("noise", ["speedometer", "actuation"])
def test_larger_wheel_says_less_than_it_goes(short_room: Scenario, noise: str) -> None:
    wheels = changed(short_room, mismatch={"left_radius_scale": 1.03, "right_radius_scale": 0.98})
    told, off = simulate(short_room, 3, noise=noise), simulate(wheels, 3, noise=noise)
    assert_only("odometry", off, told)
    drive = true_drive(changed(short_room, wheels={"noise": noise}), 3)
    if noise == "actuation":  # what is read is the command, without the wheel's jitter
        np.testing.assert_allclose(off.odometry.a, told.odometry.a / 1.03, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(off.odometry.b, told.odometry.b / 0.98, rtol=1e-12, atol=1e-15)
    else:  # the noise of the reading stays
        lacking_m = told.odometry.a - off.odometry.a
        np.testing.assert_allclose(lacking_m, drive.left_m * (1.0 - 1.0 / 1.03), atol=1e-15)
        lacking_m = told.odometry.b - off.odometry.b
        np.testing.assert_allclose(lacking_m, drive.right_m * (1.0 - 1.0 / 0.98), atol=1e-15)


def test_larger_wheel_counts_fewer_ticks(short_room: Scenario) -> None:
    encoders = Encoders(left_radius_m=0.05, right_radius_m=0.05, ticks_per_revolution=2000, counter_bits=32)
    room = replace(exact(short_room), encoders=encoders)
    told, off = simulate(room, 3), simulate(changed(room, mismatch={"left_radius_scale": 1.03}), 3)
    assert off.robot.left_radius_m == 0.05
    way_m = true_drive(room, 3).left_m.sum()
    assert off.odometry.a[-1] == pytest.approx(way_m / (2.0 * math.pi * 0.0515) * 2000, abs=1.0)
    np.testing.assert_array_equal(off.odometry.b, told.odometry.b)


def test_longer_wheelbase_turns_less_than_the_wheels_say(short_room: Scenario) -> None:
    log = simulate(changed(exact(short_room), mismatch={"wheelbase_scale": 1.1}), 3)
    assert log.robot.wheelbase_m == 0.4 and log.truth is not None
    said_rad = (log.odometry.b - log.odometry.a) / 0.4
    turned_rad = wrap_rad(np.diff(log.truth.theta_rad))
    np.testing.assert_allclose(said_rad, 1.1 * turned_rad, atol=1e-12)
    assert np.abs(turned_rad).max() > 0.01


def test_misses_are_the_share_asked_for_and_the_rest_is_as_it_was(paper_room: Scenario) -> None:
    told, thin = simulate(paper_room, 6), simulate(changed(paper_room, sensor={"miss_share": 0.3}), 6)
    assert_only("sightings", thin, told)
    rows, total = rows_of(thin.sightings, told.sightings), len(told.sightings.time_us)
    for name in ("bearing_rad", "range_m"):
        np.testing.assert_array_equal(getattr(thin.sightings, name), getattr(told.sightings, name)[rows])
    assert len(rows) / total == pytest.approx(0.7, abs=SIGMAS * math.sqrt(0.21 / total))


def test_bearing_outliers_spoil_bearings_alone(paper_room: Scenario) -> None:
    told, spoilt = (
        simulate(room, 6).sightings
        for room in (paper_room, changed(paper_room, sensor={"bearing_outlier_share": 0.1}))
    )
    np.testing.assert_array_equal(spoilt.range_m, told.range_m)
    wrong = spoilt.bearing_rad != told.bearing_rad
    assert wrong.mean() == pytest.approx(0.1, abs=SIGMAS * math.sqrt(0.09 / len(wrong)))
    half_rad = paper_room.sensor.field_of_view_rad / 2.0
    assert np.abs(spoilt.bearing_rad[wrong]).max() <= half_rad
    uniform_sd_rad = half_rad / math.sqrt(3.0)
    assert spoilt.bearing_rad[wrong].std() == pytest.approx(uniform_sd_rad, rel=0.1)


def test_coloured_noise_keeps_its_size_and_forgets_in_its_time() -> None:
    white = np.random.default_rng(8).standard_normal((200_000, 2))
    assert coloured(white, STEP_S, 0.0) is white
    noise = coloured(white, STEP_S, 0.4)
    # One independent value in about 20 steps: 10,000 of them.
    assert noise.std() == pytest.approx(1.0, abs=SIGMAS / math.sqrt(2 * 10_000))
    assert correlation(noise[:, 0], 10) == pytest.approx(math.exp(-1.0), abs=SIGMAS / math.sqrt(10_000))
    assert abs(np.corrcoef(noise.T)[0, 1]) < SIGMAS / math.sqrt(10_000)


def test_sighting_noise_of_a_beacon_hangs_together_in_time(paper_room: Scenario) -> None:
    room = changed(paper_room, sensor={"noise_time_s": 1.0})
    told, off = simulate(paper_room, 6), simulate(room, 6)
    assert_only("sightings", off, told)
    drive = true_drive(paper_room, 6)
    poses = np.stack([drive.x_m, drive.y_m, drive.theta_rad], axis=1)
    true_rad = look(paper_room.arena, paper_room.sensor, poses)[0]
    for log, alike in ((told, 0.0), (off, math.exp(-STEP_S))):
        seen = log.sightings
        noise = wrap_rad(seen.bearing_rad - true_rad[seen.time_us // 40_000, seen.beacon_id])
        noise /= paper_room.sensor.bearing_sigma_rad
        of_one = noise[seen.beacon_id == 4]
        assert len(of_one) > 500
        # Few values are independent over a second: the sd of some 40 of them is known to a tenth.
        assert noise.std() == pytest.approx(1.0, abs=0.25)
        assert correlation(of_one, 1) == pytest.approx(alike, abs=0.15)


def test_wheel_noise_hangs_together_in_time(paper_room: Scenario) -> None:
    told, off = simulate(paper_room, 6), simulate(changed(paper_room, wheels={"noise_time_s": 0.2}), 6)
    assert_only("odometry", off, told)
    noise_m = off.odometry.a - true_drive(paper_room, 6).left_m
    independent = 5000 * STEP_S / 0.4
    assert noise_m.std() == pytest.approx(0.3 * STEP_S, rel=SIGMAS / math.sqrt(2 * independent))
    assert correlation(noise_m, 5) == pytest.approx(math.exp(-1.0), abs=SIGMAS / math.sqrt(independent))


def rolled_and_gone(scenario: Scenario, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What each wheel rolled in each step, and what that would be for the true motion, (steps, 2) both."""
    drive = true_drive(scenario, seed)
    turn_rad = wrap_rad(np.diff(drive.theta_rad))
    chord_m = np.hypot(np.diff(drive.x_m), np.diff(drive.y_m))
    course_rad = drive.theta_rad[:-1] + 0.5 * turn_rad
    ahead = np.cos(course_rad) * np.diff(drive.x_m) + np.sin(course_rad) * np.diff(drive.y_m)
    way_m = np.sign(ahead) * chord_m / np.sinc(turn_rad / math.tau)
    half_m = 0.5 * scenario.body.wheelbase_m * turn_rad
    return np.stack([drive.left_m, drive.right_m], axis=1), np.stack([way_m - half_m, way_m + half_m], axis=1)


@pytest.mark.parametrize("ratio", [1.0, 0.4])
def test_slips_roll_without_going_as_often_and_as_long_as_asked_for(
    paper_room: Scenario, ratio: float
) -> None:
    plain_room = replace(paper_room, steps=1500)
    room = replace(plain_room, slips=Slips(4, (0.5, 1.5), ratio))
    sides = set()
    for seed in range(6):
        rolled_m, gone_m = rolled_and_gone(room, seed)
        slipping = np.abs(rolled_m - gone_m) > 1e-9
        np.testing.assert_allclose(gone_m[slipping], (1.0 - ratio) * rolled_m[slipping], atol=1e-9)
        steps = np.flatnonzero(slipping.any(axis=1))
        part = (steps - 375) // 187.5  # one in each quarter of it; what falls onto a stall shows nothing
        events = [steps[part == one] for one in np.unique(part)]
        assert len(events) >= 3
        assert steps.min() >= 375 and steps.max() < 1125  # in the middle half
        for event in events:
            assert np.ptp(event) + 1 <= 1.5 / STEP_S + 1
            sides.add(tuple(slipping[event].any(axis=0)))
        first = int(steps[0])
        plain = true_drive(plain_room, seed)
        np.testing.assert_array_equal(true_drive(room, seed).x_m[: first + 1], plain.x_m[: first + 1])
    assert sides == {(True, False), (False, True), (True, True)}


def test_slips_are_read_as_if_the_robot_had_gone(paper_room: Scenario) -> None:
    room = replace(exact(paper_room), slips=Slips(4))
    log, drive = simulate(room, 2), true_drive(room, 2)
    np.testing.assert_array_equal(log.odometry.a, drive.left_m)


def test_gaps_take_rows_of_odometry_and_nothing_else(paper_room: Scenario) -> None:
    told, thin = simulate(paper_room, 6), simulate(replace(paper_room, gaps=Gaps(6, (2.0, 2.0))), 6)
    assert_only("odometry", thin, told)
    kept = np.isin(told.odometry.time_us, thin.odometry.time_us)
    np.testing.assert_array_equal(thin.odometry.a, told.odometry.a[kept])
    missing = np.diff(thin.odometry.time_us)
    missing = missing[missing > 40_000]
    assert len(missing) == 6
    assert missing.tolist() == pytest.approx([2.04e6] * 6, abs=40_000)


def test_blind_gaps_have_no_sightings_either(paper_room: Scenario) -> None:
    room = replace(paper_room, gaps=Gaps(2, (3.0, 5.0), blind=True))
    told, thin = simulate(paper_room, 6), simulate(room, 6)
    assert_same(thin.truth, told.truth)
    rows = np.diff(thin.odometry.time_us)
    for row in np.flatnonzero(rows > 40_000):
        before_us, after_us = thin.odometry.time_us[row : row + 2]
        assert 3.0e6 <= after_us - before_us <= 5.08e6
        inside = (told.sightings.time_us > before_us) & (told.sightings.time_us < after_us)
        assert inside.any()
        assert not ((thin.sightings.time_us > before_us) & (thin.sightings.time_us < after_us)).any()
    lost = len(told.sightings.time_us) - len(thin.sightings.time_us)
    assert 0 < lost < 800  # some 4 a frame at most, in 250 frames


def test_gap_of_counters_loses_no_way(paper_room: Scenario) -> None:
    encoders = Encoders(left_radius_m=0.05, right_radius_m=0.05, ticks_per_revolution=2000, counter_bits=32)
    room = replace(paper_room, encoders=encoders, gyro=Gyro(0.02))
    told, thin = simulate(room, 6).odometry, simulate(replace(room, gaps=Gaps(3, (2.0, 2.0))), 6).odometry
    assert (thin.a[0], thin.a[-1]) == (told.a[0], told.a[-1])
    assert thin.gyro_radps is not None and len(thin.gyro_radps) == len(thin.time_us) < len(told.time_us)


def test_carried_robot_stands_and_is_then_elsewhere(paper_room: Scenario) -> None:
    gaps = Gaps(3, (2.0, 2.0), blind=True, carried_sd_m=0.5, carried_sd_rad=1.0)
    room, moves = replace(paper_room, steps=1000, gaps=gaps), []
    for seed in range(30):
        log, drive = simulate(room, seed), true_drive(room, seed)
        ends_us = log.odometry.time_us[1:][np.diff(log.odometry.time_us) > 40_000]
        for end_us in ends_us.tolist():
            after = end_us // 40_000 - 1  # the pose with which the first row after the gap begins
            assert not drive.left_m[after - 49 : after].any()
            assert np.ptp(drive.x_m[after - 49 : after - 1]) == 0.0
            moves.append([one[after] - one[after - 1] for one in (drive.x_m, drive.y_m, drive.theta_rad)])
            clearance_m = paper_room.arena.nearest_wall(drive.x_m[after], drive.y_m[after])[0]
            assert clearance_m > paper_room.driving.path_clearance_m - 1e-9
    assert len(moves) == 90
    # Walls cut some of the long ones off.
    assert np.std(moves, axis=0)[:2] == pytest.approx([0.5, 0.5], rel=0.3)
    assert np.std(moves, axis=0)[2] == pytest.approx(1.0, rel=SIGMAS / math.sqrt(180))


SENSOR, START = "[sensor]\n", "[start]\n"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (SENSOR, SENSOR + "miss_share = 1.1\n", r"\[sensor\], key miss_share: 1\.1 .*from 0 to 1"),
        (SENSOR, SENSOR + "noise_time_s = -1\n", r"\[sensor\], key noise_time_s: -1 .*from 0"),
        (SENSOR, SENSOR + "bearing_outlier_share = nan\n", r"key bearing_outlier_share: nan .*from 0 to 1"),
        ("[wheels]\n", "[wheels]\nnoise_time_s = inf\n", r"\[wheels\], key noise_time_s: inf .*finite"),
        (START, "[mismatch]\nrange_scale = 0\n[start]\n", r"\[mismatch\], key range_scale: 0 .*0\.5 to 2"),
        (START, "[mismatch]\nyaw = 0\n[start]\n", r"\[mismatch\], key yaw: no such key; .*sensor_yaw_rad"),
        (
            START,
            "[mismatch]\nsensor_x_m = 0.31\n[start]\n",
            r"\[mismatch\], keys sensor_x_m, sensor_y_m: \(0\.31, 0\.0\) .*on the robot's body",
        ),
        (START, "[mismatch]\ndelay_us = -1\n[start]\n", r"key delay_us: -1 .*is not negative"),
        (START, "[slips]\ncount = 0\n[start]\n", r"\[slips\], key count: 0 .*from 1 to 1000"),
        (START, "[slips]\ncount = 2\nlasts_s = [2, 1]\n[start]\n", r"key lasts_s: \[2, 1\] .*0 < shortest"),
        (START, "[slips]\ncount = 34\n[start]\n", r"keys count, lasts_s: \(34, 0\.5, 1\.5\) .*50 s at most"),
        (START, "[gaps]\ncount = 1\n[start]\n", r"\[gaps\], key lasts_s: is missing; allowed: \[shortest"),
        (START, "[gaps]\ncount = 6\nlasts_s = [2, 9]\n[start]\n", r"\[gaps\], keys .*a quarter of the drive"),
    ],
)
def test_scenario_with_what_cannot_be_untold_is_refused_by_name(
    edited_room: Callable[..., Path], old: str, new: str, expected: str
) -> None:
    with pytest.raises(BslamError, match=expected):
        load_scenario(edited_room(old, new))


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ("[slips]\ncount = 1", r"\[slips\]"),
        ("[gaps]\ncount = 1\nlasts_s = [1, 1]\ncarried_sd_rad = 1", r"\[gaps\], keys carried_sd_m"),
    ],
)
def test_recorded_way_takes_nothing_that_changes_it(
    edited_room: Callable[..., Path], tmp_path: Path, table: str, key: str
) -> None:
    (tmp_path / "truth.csv").write_text("time_us,x_m,y_m,theta_rad\n0,0,0,0\n200000000,1,0,0\n")
    path = edited_room("[driving]\n", f'{table}\n[driving]\nrecorded = "truth.csv"\n')
    with pytest.raises(BslamError, match=key + r".*not where \[driving\] has recorded"):
        load_scenario(path)


@pytest.mark.parametrize(
    "table", [{"mismatch": Mismatch(range_scale=1.05)}, {"gaps": Gaps(1, (1.0, 1.0))}], ids=["range", "gaps"]
)
def test_cameras_refuse_what_only_simulated_sightings_have(
    paper_room: Scenario, tmp_path: Path, table: dict
) -> None:
    (name,) = table
    with pytest.raises(BslamError, match=rf"\[{name}\]: cameras do not know it; allowed: --sensor simulated"):
        camera_log(replace(paper_room, **table), 0, None, None, load_rig("three60"), CameraStore(tmp_path))


def test_scenario_file_says_all_of_it(edited_room: Callable[..., Path]) -> None:
    tables = "\n".join(
        [
            "[mismatch]\nrange_scale = 1.05\nwheelbase_scale = 0.97\ndelay_us = 100_000",
            "[slips]\ncount = 4\nlasts_s = [0.5, 1.5]\nratio = 0.8",
            "[gaps]\ncount = 2\nlasts_s = [5, 5]\nblind = true\ncarried_sd_m = 1\ncarried_sd_rad = 0.5",
            START,
        ]
    )
    scenario = load_scenario(edited_room(START, tables))
    assert scenario.mismatch == Mismatch(range_scale=1.05, wheelbase_scale=0.97, delay_us=100_000)
    assert scenario.slips == Slips(4, (0.5, 1.5), 0.8)
    assert scenario.gaps == Gaps(2, (5.0, 5.0), True, 1.0, 0.5)
