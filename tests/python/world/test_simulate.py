"""Whole drives: what must hold whatever the seed."""

import math
import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.log import Log, wrap_rad
from bslam.world.arena import Arena
from bslam.world.robot import move_on_arc
from bslam.world.scenario import Encoders, Gyro, Scenario
from bslam.world.simulate import load_scenario, scenario_names, simulate, true_drive


def assert_same_arrays(one: object, other: object) -> None:
    for field in fields(one):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))


def assert_same_log(one: Log, other: Log) -> None:
    assert (one.name, one.robot) == (other.name, other.robot)
    for name in ("odometry", "sightings", "truth", "beacons"):
        assert_same_arrays(getattr(one, name), getattr(other, name))


def with_noise(scenario: Scenario, noise: str, sigma_mps: float) -> Scenario:
    return replace(scenario, wheels=replace(scenario.wheels, noise=noise, sigma_mps=sigma_mps))


def least_clearance_m(arena: Arena, x_m: np.ndarray, y_m: np.ndarray) -> float:
    """Least distance of the whole way, not only of its points, to a wall."""
    points = np.stack([x_m, y_m], axis=1)
    return float(arena.path_clearance(points[:-1], points[1:]).min())


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(("noise", "sigma_mps"), [("speedometer", 0.3), ("actuation", 1.0)])
def test_drive_never_passes_a_wall(paper_room: Scenario, seed: int, noise: str, sigma_mps: float) -> None:
    drive = true_drive(with_noise(paper_room, noise, sigma_mps), seed)
    # Every 2 cm the body is held against the walls; between, at a wall's end, it may be nearer by a sagitta.
    assert least_clearance_m(paper_room.arena, drive.x_m, drive.y_m) > 0.3 - 2e-4
    for x_m, y_m in zip(drive.x_m.tolist(), drive.y_m.tolist(), strict=True):
        assert paper_room.arena.nearest_wall(x_m, y_m)[0] >= 0.3


def test_drive_stalls_now_and_then_and_then_wheels_and_robot_stand(paper_room: Scenario) -> None:
    stalls = 0
    for seed in range(12):
        drive = true_drive(paper_room, seed)
        stalled = drive.stalled
        stalls += int(stalled.sum())
        assert not drive.left_m[stalled].any()
        assert not drive.right_m[stalled].any()
        for poses in (drive.x_m, drive.y_m, drive.theta_rad):
            assert not np.diff(poses)[stalled].any()
        assert stalled.mean() < 0.1
    assert stalls > 0


def test_drive_follows_from_the_wheels_travel(paper_room: Scenario) -> None:
    drive = true_drive(paper_room, 3)
    pose = (drive.x_m[0], drive.y_m[0], drive.theta_rad[0])
    for left_m, right_m in zip(drive.left_m.tolist(), drive.right_m.tolist(), strict=True):
        pose = move_on_arc(pose, left_m, right_m, paper_room.body.wheelbase_m)
    assert pose == pytest.approx((drive.x_m[-1], drive.y_m[-1], drive.theta_rad[-1]), abs=1e-9)


def test_drive_keeps_to_the_limits_of_the_motors(paper_room: Scenario) -> None:
    drive, settings = true_drive(paper_room, 3), paper_room.driving
    v_mps = 0.5 * (drive.left_m + drive.right_m) / 0.04
    omega_radps = (drive.right_m - drive.left_m) / 0.4 / 0.04
    assert v_mps.min() >= -1e-12
    assert v_mps.max() <= settings.speed_mps + 1e-9
    assert np.abs(omega_radps).max() <= settings.turn_rate_radps + 1e-9
    free = ~(drive.stalled[1:] | drive.stalled[:-1])  # a wall stops the robot at once
    assert np.abs(np.diff(v_mps))[free].max() <= 0.04 * settings.acceleration_mps2 + 1e-9
    assert np.abs(np.diff(omega_radps))[free].max() <= 0.04 * settings.turn_acceleration_radps2 + 1e-9


def test_drive_in_the_papers_room_is_like_the_reference(paper_room: Scenario) -> None:
    """The given logs, made by another simulator: way 62-70 m, some beacon seen in 96-100 % of the steps."""
    ways_m, seen_shares, beacons_per_step = [], [], []
    for seed in range(8):
        log = simulate(paper_room, seed)
        assert log.truth is not None
        ways_m.append(np.hypot(np.diff(log.truth.x_m), np.diff(log.truth.y_m)).sum())
        seen_shares.append(len(np.unique(log.sightings.time_us)) / len(log.truth.time_us))
        beacons_per_step.append(len(log.sightings.time_us) / len(log.truth.time_us))
    assert 60.0 < np.mean(ways_m) < 70.0
    assert min(ways_m) > 55.0
    assert 0.97 < np.mean(seen_shares) <= 1.0
    assert 1.8 < np.mean(beacons_per_step) < 2.2


@pytest.mark.parametrize("name", ["building20", "building50"])
def test_drive_in_a_building_visits_every_room_and_sees_every_beacon(name: str) -> None:
    scenario = load_scenario(name)
    log, drive = simulate(scenario, 1), true_drive(scenario, 1)
    for area in scenario.areas:
        inside = (drive.x_m > area.x_m[0]) & (drive.x_m < area.x_m[1])
        assert (inside & (drive.y_m > area.y_m[0]) & (drive.y_m < area.y_m[1])).sum() > 50
    identities, counts = np.unique(log.sightings.beacon_id, return_counts=True)
    assert identities.tolist() == [beacon.beacon_id for beacon in scenario.arena.beacons]
    assert counts.min() >= 4


@pytest.mark.parametrize("name", scenario_names())
def test_simulate_makes_a_log_that_can_be_written_and_read(name: str, tmp_path: Path) -> None:
    scenario = replace(load_scenario(name), steps=200)
    log = simulate(scenario, 5)
    assert log.name == f"{name}_seed5"
    log.write(tmp_path / log.name)
    assert_same_log(log, Log.read(tmp_path / log.name))


def test_simulate_starts_at_the_origin_with_sightings_and_odometry_from_step_one(
    short_room: Scenario,
) -> None:
    turned = replace(short_room, start=replace(short_room.start, heading_rad=2.0))
    log = simulate(turned, 1)
    assert log.truth is not None
    assert log.beacons is not None
    assert log.truth.time_us.tolist() == list(range(0, 501 * 40_000, 40_000))
    assert (log.truth.x_m[0], log.truth.y_m[0], log.truth.theta_rad[0]) == (0.0, 0.0, 0.0)
    np.testing.assert_array_equal(log.odometry.time_us, log.truth.time_us[1:])
    assert log.sightings.time_us[0] == 0
    # Beacon 0 is at (0, -2.5) from the start; turning the frame by 2 rad turns it by -2 rad.
    at = (-2.5 * math.sin(2.0), -2.5 * math.cos(2.0))
    assert (log.beacons.x_m[0], log.beacons.y_m[0]) == pytest.approx(at)


def test_simulate_twice_gives_the_same_log_to_the_bit(short_room: Scenario) -> None:
    assert_same_log(simulate(short_room, 4), simulate(short_room, 4))
    assert (simulate(short_room, 5).truth.x_m != simulate(short_room, 4).truth.x_m).any()


def test_simulate_with_another_sigma_changes_only_the_odometry(short_room: Scenario) -> None:
    low, high = simulate(short_room, 4, sigma_mps=0.3), simulate(short_room, 4, sigma_mps=1.0)
    assert_same_arrays(low.truth, high.truth)
    assert_same_arrays(low.sightings, high.sightings)
    assert (low.odometry.a != high.odometry.a).all()
    assert (low.robot.wheel_speed_sigma_mps, high.robot.wheel_speed_sigma_mps) == (0.3, 1.0)


def test_simulate_another_draw_changes_only_the_odometry(short_room: Scenario) -> None:
    def drawn(draw: int) -> Log:
        wheels = replace(short_room.wheels, draw=draw)
        return simulate(replace(short_room, wheels=wheels), 4, sigma_mps=0.6)

    first, second, third = drawn(0), drawn(1), drawn(2)
    assert_same_arrays(first.odometry, simulate(short_room, 4, sigma_mps=0.6).odometry)
    assert_same_arrays(second.odometry, drawn(1).odometry)
    assert (second.odometry.a != third.odometry.a).all()
    difference_m = second.odometry.a - first.odometry.a  # of two noises that know nothing of each other
    assert abs(difference_m.std() / (0.024 * math.sqrt(2.0)) - 1.0) < 0.1
    for other in (second, third):
        assert_same_arrays(first.truth, other.truth)
        assert_same_arrays(first.sightings, other.sightings)


def test_simulate_speedometer_noise_is_white_of_the_sigma_asked_for(paper_room: Scenario) -> None:
    drive, log = true_drive(paper_room, 2), simulate(paper_room, 2, sigma_mps=0.6)
    errors_m = np.stack([log.odometry.a - drive.left_m, log.odometry.b - drive.right_m])
    steps = paper_room.steps
    for error_m in errors_m:
        assert abs(error_m.mean()) < 5.0 * 0.024 / math.sqrt(steps)  # 0.6 m/s for 1/25 s
        assert abs(error_m.std() / 0.024 - 1.0) < 5.0 / math.sqrt(2.0 * steps)
        assert abs(np.corrcoef(error_m[:-1], error_m[1:])[0, 1]) < 5.0 / math.sqrt(steps)
    assert abs(np.corrcoef(errors_m)[0, 1]) < 5.0 / math.sqrt(steps)


def test_simulate_actuation_noise_moves_the_wheels_against_the_reading(paper_room: Scenario) -> None:
    log = simulate(paper_room, 2, sigma_mps=0.6, noise="actuation")
    drive = true_drive(with_noise(paper_room, "actuation", 0.6), 2)
    rolled = ~drive.stalled
    for read_m, true_m in ((log.odometry.a, drive.left_m), (log.odometry.b, drive.right_m)):
        jitter_m = true_m[rolled] - read_m[rolled]
        assert abs(jitter_m.std() / 0.024 - 1.0) < 5.0 / math.sqrt(2.0 * len(jitter_m))
        np.testing.assert_array_equal(read_m[drive.stalled], 0.0)
        assert np.abs(np.diff(read_m[rolled])).max() < 0.03  # what is read is smooth: the robot's commands
    rolled_m = drive.left_m[~drive.stalled]
    assert np.diff(rolled_m).std() == pytest.approx(
        0.024 * math.sqrt(2.0), rel=0.05
    )  # the motion is smooth but for it


def test_simulate_without_noise_reads_the_true_travel(short_room: Scenario) -> None:
    drive, log = true_drive(short_room, 2), simulate(short_room, 2, sigma_mps=0.0)
    np.testing.assert_array_equal(log.odometry.a, drive.left_m)


def test_simulate_ticks_roll_over_and_give_the_way_back(paper_room: Scenario, tmp_path: Path) -> None:
    encoders = Encoders(left_radius_m=0.05, right_radius_m=0.05, ticks_per_revolution=2000, counter_bits=12)
    scenario = replace(paper_room, encoders=encoders)
    log, drive = simulate(scenario, 1, sigma_mps=0.0), true_drive(scenario, 1)
    assert log.odometry.kind == "ticks"
    assert log.odometry.time_us[0] == 0
    assert log.robot.counter_bits == 12
    ticks = np.mod(np.diff(log.odometry.a) + 2048.0, 4096.0) - 2048.0
    tick_m = 2.0 * math.pi * 0.05 / 2000.0
    assert abs(np.diff(log.odometry.a)).max() > 2048.0  # it did roll over
    np.testing.assert_allclose(np.cumsum(ticks) * tick_m, np.cumsum(drive.left_m), atol=1.001 * tick_m)
    log.write(tmp_path)
    assert_same_arrays(log.odometry, Log.read(tmp_path).odometry)


def test_simulate_delay_shifts_the_stamps_and_drops_what_comes_too_late(short_room: Scenario) -> None:
    late = replace(short_room, sensor=replace(short_room.sensor, delay_us=100_000))
    on_time, delayed = simulate(short_room, 1), simulate(late, 1)
    assert delayed.robot.sighting_delay_us == 100_000
    kept = len(delayed.sightings.time_us)
    np.testing.assert_array_equal(delayed.sightings.time_us, on_time.sightings.time_us[:kept] + 100_000)
    np.testing.assert_array_equal(delayed.sightings.range_m, on_time.sightings.range_m[:kept])
    assert delayed.sightings.time_us[-1] <= 500 * 40_000


def test_simulate_tells_the_log_where_the_sensor_sits(short_room: Scenario) -> None:
    mounted = replace(short_room, sensor=replace(short_room.sensor, x_m=0.1, y_m=-0.05, yaw_rad=0.2))
    robot = simulate(mounted, 1).robot
    assert (robot.sensor_x_m, robot.sensor_y_m, robot.sensor_yaw_rad) == (0.1, -0.05, 0.2)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"seed": -1}, "seed: -1 .*an integer from 0"),
        ({"seed": 0, "sigma_mps": -0.1}, r"sigma, m/s: -0\.1 .*a number from 0"),
        ({"seed": 0, "sigma_mps": math.nan}, "sigma, m/s: nan"),
        ({"seed": 0, "noise": "pink"}, "noise: 'pink' .*speedometer or actuation"),
    ],
)
def test_simulate_refuses_what_is_not_allowed(short_room: Scenario, arguments: dict, expected: str) -> None:
    with pytest.raises(BslamError, match=expected):
        simulate(short_room, **arguments)


def test_simulate_where_no_goal_can_be_says_so(edited_room: Callable[..., Path]) -> None:
    full = load_scenario(edited_room("path_clearance_m = 0.45", "path_clearance_m = 6.0"))
    with pytest.raises(BslamError, match=r"scenario edited: no goal can be reached .*path_clearance_m, 6"):
        simulate(full, 0)


def test_simulate_where_no_goal_can_be_reached_says_so(edited_room: Callable[..., Path]) -> None:
    areas = "areas = [{ x_m = [7.0, 9.0], y_m = [3.0, 5.0] }]\nsteps = 5"
    shut = load_scenario(edited_room("steps = 5", areas))
    shut = replace(shut, arena=load_scenario(edited_room(", doors = [[3.0, 5.0]]", "")).arena)
    with pytest.raises(BslamError, match=r"scenario edited: no goal can be reached in the area x \(7\.0, 9"):
        simulate(shut, 0)


def test_simulate_in_an_area_the_robot_fills_says_so(edited_room: Callable[..., Path]) -> None:
    """Every goal there is reached at once: this must end, and not with a robot that stands for ever."""
    areas = "areas = [{ x_m = [1.4, 1.6], y_m = [2.4, 2.6] }]\nsteps = 5"
    with pytest.raises(BslamError, match="no goal is farther than reach_m"):
        simulate(load_scenario(edited_room("steps = 5", areas)), 0)


def test_drive_in_a_lane_hardly_wider_than_the_robot_goes_on(edited_room: Callable[..., Path]) -> None:
    """A door 10 cm wider than the robot, which hits its posts: it gives up at times but does not stick."""
    scenario = load_scenario(edited_room("[[3.0, 5.0]]", "[[3.0, 3.7]]"))
    scenario = replace(scenario, driving=replace(scenario.driving, cell_m=0.1, path_clearance_m=0.31))
    for seed in range(4):
        drive = true_drive(scenario, seed)
        assert least_clearance_m(scenario.arena, drive.x_m, drive.y_m) > 0.3 - 2e-4
        assert drive.stalled.mean() < 0.25
        assert np.hypot(np.diff(drive.x_m), np.diff(drive.y_m)).sum() > 30.0


def test_drive_through_a_door_too_narrow_for_routes_stays_in_its_room(
    edited_room: Callable[..., Path],
) -> None:
    drive = true_drive(load_scenario(edited_room("[[3.0, 5.0]]", "[[3.0, 3.7]]")), 0)
    assert drive.x_m.max() < 5.5


def test_drive_after_a_bump_turns_on_the_spot(paper_room: Scenario) -> None:
    drive = next(one for one in (true_drive(paper_room, seed) for seed in range(20)) if one.stalled.any())
    bump = int(np.flatnonzero(drive.stalled)[0])
    turning = slice(bump + 1, bump + 11)  # 0.4 s, the shortest such turn
    np.testing.assert_allclose(drive.left_m[turning], -drive.right_m[turning], atol=1e-12)
    assert abs(drive.right_m[turning]).min() > 0.0


def test_simulate_is_quick_enough(paper_room: Scenario) -> None:
    begin_s = time.process_time()
    simulate(paper_room, 0)
    assert time.process_time() - begin_s < 0.7  # a run has two seconds for everything


def test_gyro_says_the_true_turn_with_its_noise_and_a_bias_of_the_drive(paper_room: Scenario) -> None:
    plain = simulate(paper_room, seed=5)
    sure = simulate(replace(paper_room, gyro=Gyro(1e-6)), seed=5)
    assert sure.odometry.a.tolist() == plain.odometry.a.tolist()
    assert sure.sightings.range_m.tolist() == plain.sightings.range_m.tolist()
    assert sure.truth is not None and sure.odometry.gyro_radps is not None
    turned_rad = wrap_rad(np.diff(sure.truth.theta_rad))
    assert np.abs(sure.odometry.gyro_radps * 0.04 - turned_rad).max() < 1e-6
    off = simulate(replace(paper_room, gyro=Gyro(0.02, 0.05)), seed=5)
    assert off.odometry.gyro_radps is not None
    error_radps = off.odometry.gyro_radps - turned_rad / 0.04
    assert error_radps.std() == pytest.approx(0.02, rel=0.05)
    assert 0.001 < abs(error_radps.mean()) < 0.2
    assert off.robot.gyro_sigma_radps == pytest.approx(math.hypot(0.02, 0.05 * math.sqrt(50)))
    encoders = Encoders(left_radius_m=0.05, right_radius_m=0.05, ticks_per_revolution=2000, counter_bits=12)
    ticks = simulate(replace(paper_room, gyro=Gyro(1e-6), encoders=encoders), seed=5).odometry
    assert ticks.gyro_radps is not None and math.isnan(ticks.gyro_radps[0])
    assert ticks.gyro_radps[1:].tolist() == sure.odometry.gyro_radps.tolist()
