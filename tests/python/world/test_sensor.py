"""What is seen from where, and with what noise."""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bslam.log import Log, Sightings, wrap_rad
from bslam.world.arena import Arena, Beacon, Wall
from bslam.world.scenario import Scenario, Sensor
from bslam.world.sensor import is_visible, look, range_sigma_m, see

EXACT = Sensor(
    field_of_view_rad=math.radians(180.0),
    bearing_sigma_rad=0.0,
    range_sigma_fraction=0.0,
    range_sigma_scale_m=math.inf,
)
NOISY = replace(EXACT, bearing_sigma_rad=0.0136, range_sigma_fraction=0.02, range_sigma_scale_m=110.9)


def look_once(arena: Arena, sensor: Sensor, pose: tuple[float, float, float]) -> Sightings:
    return see(arena, sensor, np.array([0]), np.array([pose]), np.random.default_rng(1))


@pytest.mark.parametrize(
    ("pose", "bearing_rad", "range_m"),
    [
        ((0.0, 0.0, 0.0), 0.0, 2.0),
        ((0.0, 0.0, 0.5), -0.5, 2.0),
        ((1.0, -1.0, 0.0), math.pi / 4.0, math.sqrt(2.0)),
        ((-1.0, 0.0, -1.5), 1.5, 3.0),
    ],
)
def test_see_measures_from_the_forward_axis_counter_clockwise(
    square: Arena, pose: tuple[float, float, float], bearing_rad: float, range_m: float
) -> None:
    sightings = look_once(square, EXACT, pose)
    assert sightings.beacon_id.tolist() == [7]
    assert sightings.bearing_rad.tolist() == pytest.approx([bearing_rad])
    assert sightings.range_m.tolist() == pytest.approx([range_m])
    assert sightings.mappable.tolist() == [True]


@pytest.mark.parametrize(
    ("field_of_view_deg", "heading_deg", "visible"),
    [(180, 89, True), (180, 91, False), (180, -91, False), (60, 29, True), (60, 31, False), (360, 180, True)],
)
def test_see_only_in_the_field_of_view(
    square: Arena, field_of_view_deg: float, heading_deg: float, visible: bool
) -> None:
    sensor = replace(EXACT, field_of_view_rad=math.radians(field_of_view_deg))
    sightings = look_once(square, sensor, (0.0, 0.0, math.radians(heading_deg)))
    assert len(sightings.time_us) == int(visible)


@pytest.mark.parametrize(("range_max_m", "visible"), [(2.01, True), (1.99, False)])
def test_see_only_up_to_the_greatest_range(square: Arena, range_max_m: float, visible: bool) -> None:
    sightings = look_once(square, replace(EXACT, range_max_m=range_max_m), (0.0, 0.0, 0.0))
    assert len(sightings.time_us) == int(visible)


def test_see_not_through_a_wall_but_through_its_door(square: Arena) -> None:
    door = (Wall((1.0, -2.0), (1.0, -0.5)), Wall((1.0, 0.5), (1.0, 2.0)))
    arena = Arena((*square.walls, *door), square.beacons)
    assert len(look_once(arena, EXACT, (0.0, 0.0, 0.0)).time_us) == 1
    assert len(look_once(arena, EXACT, (0.0, 1.5, 0.0)).time_us) == 0


def test_see_from_where_the_sensor_is_mounted(square: Arena) -> None:
    """The robot faces along y from (0, -1); the sensor, 1 m ahead and turned right, faces the beacon."""
    sensor = replace(EXACT, x_m=1.0, y_m=0.0, yaw_rad=-math.pi / 2.0)
    sightings = look_once(square, sensor, (0.0, -1.0, math.pi / 2.0))
    assert sightings.bearing_rad.tolist() == pytest.approx([0.0], abs=1e-12)
    assert sightings.range_m.tolist() == pytest.approx([2.0])


def test_see_stamps_a_delayed_sighting_late(square: Arena) -> None:
    assert look_once(square, replace(EXACT, delay_us=30_000), (0.0, 0.0, 0.0)).time_us.tolist() == [30_000]


def test_see_one_frame_after_the_other_every_visible_beacon(paper_room: Scenario) -> None:
    poses = np.array([[1.5, 2.5, 0.0], [8.0, 4.0, 1.5]])
    sightings = see(paper_room.arena, EXACT, np.array([0, 40_000]), poses, np.random.default_rng(1))
    assert sightings.time_us.tolist() == [0, 0, 0, 40_000, 40_000]
    assert sightings.beacon_id.tolist() == [0, 1, 3, 4, 5]


def standing(steps: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    return np.arange(steps) * 40_000, np.zeros((steps, 3))


def test_see_has_the_noise_it_was_given(square: Arena) -> None:
    steps = 20_000
    sightings = see(square, NOISY, *standing(steps), np.random.default_rng(3))
    sigma_m = 2.0 * math.hypot(0.02, 2.0 / 110.9)
    assert float(range_sigma_m(NOISY, np.array(2.0))) == pytest.approx(sigma_m)
    # Of n draws, a mean strays by sigma / sqrt(n) and a sigma by sigma / sqrt(2 n): five times that may be.
    for error, sigma in ((sightings.bearing_rad, 0.0136), (sightings.range_m - 2.0, sigma_m)):
        assert abs(error.mean()) < 5.0 * sigma / math.sqrt(steps)
        assert abs(error.std() / sigma - 1.0) < 5.0 / math.sqrt(2.0 * steps)
    lag_one = np.corrcoef(sightings.range_m[:-1], sightings.range_m[1:])[0, 1]
    assert abs(lag_one) < 5.0 / math.sqrt(steps)


def test_range_sigma_adds_a_floor_a_fraction_and_a_part_with_the_square() -> None:
    sensor = replace(NOISY, range_sigma_floor_m=0.03)
    expected_m = math.sqrt(0.03**2 + (0.02 * 5.0) ** 2 + (5.0**2 / 110.9) ** 2)
    assert float(range_sigma_m(sensor, np.array(5.0))) == pytest.approx(expected_m)


def test_see_spoils_the_share_of_outliers_and_leaves_the_rest_as_it_was(square: Arena) -> None:
    steps = 20_000
    clean = see(square, NOISY, *standing(steps), np.random.default_rng(3))
    mixed = see(square, replace(NOISY, outlier_share=0.3), *standing(steps), np.random.default_rng(3))
    assert len(mixed.time_us) == steps
    spoilt = mixed.bearing_rad != clean.bearing_rad
    assert abs(spoilt.mean() - 0.3) < 5.0 * math.sqrt(0.3 * 0.7 / steps)
    np.testing.assert_array_equal(mixed.range_m[~spoilt], clean.range_m[~spoilt])
    assert np.abs(mixed.bearing_rad[spoilt]).max() <= math.pi / 2.0
    assert np.ptp(mixed.range_m[spoilt]) > 5.0  # anything up to the room's diagonal, 5.7 m
    assert (mixed.beacon_id == 7).all()


def test_see_reports_no_range_that_is_not_positive() -> None:
    """At 100 m the sd of the range is 90 m: one in seven falls below zero."""
    arena = Arena((Wall((-1.0, -1.0), (-1.0, 1.0)),), (Beacon(0, (100.0, 0.0)),))
    sightings = see(arena, NOISY, *standing(2000), np.random.default_rng(3))
    assert 0.8 < len(sightings.time_us) / 2000 < 0.92
    assert (sightings.range_m > 0.0).all()


def test_see_without_beacons_is_empty(square: Arena) -> None:
    assert len(look_once(Arena(square.walls, ()), NOISY, (0.0, 0.0, 0.0)).time_us) == 0


def test_sensor_model_sees_exactly_what_the_reference_logs_have(paper_room: Scenario) -> None:
    data = Path(os.environ.get("BSLAM_DATA", Path(__file__).parents[4] / "shared" / "data"))
    folder = data / "paper_room" / "paper_room_700_sigma0.3"
    if not folder.is_dir():
        pytest.skip("no reference logs: set BSLAM_DATA to a directory that has paper_room/")
    log = Log.read(folder)
    assert log.truth is not None
    start = paper_room.start  # its heading is 0: the map frame is only shifted
    poses = np.stack([log.truth.x_m + start.x_m, log.truth.y_m + start.y_m, log.truth.theta_rad], axis=1)
    bearing_rad, range_m = look(paper_room.arena, paper_room.sensor, poses)
    visible = is_visible(paper_room.arena, paper_room.sensor, poses, bearing_rad, range_m)
    step, beacon = np.nonzero(visible)
    np.testing.assert_array_equal(log.sightings.time_us, log.truth.time_us[step])
    np.testing.assert_array_equal(log.sightings.beacon_id, beacon)
    bearing_error = (
        wrap_rad(log.sightings.bearing_rad - bearing_rad[visible]) / paper_room.sensor.bearing_sigma_rad
    )
    range_error = (log.sightings.range_m - range_m[visible]) / range_sigma_m(
        paper_room.sensor, range_m[visible]
    )
    for error in (bearing_error, range_error):  # standard normal, 9791 of them
        assert abs(error.mean()) < 5.0 / math.sqrt(len(error))
        assert abs(error.std() - 1.0) < 5.0 / math.sqrt(2.0 * len(error))
