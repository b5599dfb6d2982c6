"""The camera loop with a front end that says what it is told to: books, times and files, not vision."""

import math
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from bslam.core.vision import SIGNATURE_SIZE, Candidate, Seeing, Told, Turn
from bslam.core.visual_gyro import VisualGyro
from bslam.errors import BslamError
from bslam.options import RunOptions
from bslam.rig import Pan, load_rig
from bslam.runs import camera
from bslam.runs.camera import Aim, CameraStore, camera_log, covering_beacon, unseen_log
from bslam.runs.eye import Eye
from bslam.runs.runner import run_log
from bslam.scannerfile import read_scanner
from bslam.world.camera import Renderer
from bslam.world.simulate import load_scenario, simulate, true_drive

RIG = load_rig("three60")


def candidate(outline=(0.0, 0.0, 320.0, 240.0), bearing_rad=0.1, range_m=2.0):
    return Candidate(
        outline=outline,
        bearing_rad=bearing_rad,
        bearing_sd_rad=None if bearing_rad is None else 0.01,
        range_m=range_m,
        range_sd_m=None if range_m is None else 0.05,
        range_noise_sd_m=None if range_m is None else 0.03,
        beacon_class=1,
        kind="door",
        class_margin=1.0,
        score=1.0,
        marks=frozenset(),
        misplaced_sds=0.0,
        signature=np.full(SIGNATURE_SIZE, 0.5, dtype=np.float32),
        told=None if bearing_rad is None else Told(0.011, 0.05 if range_m else 0.0, 0.02 if range_m else 0.0),
    )


MODELS = Path(__file__).parents[3] / "firmware" / "models"


class FakeFrontEnd:
    """Sees the same in every frame, and writes down which camera it was."""

    looks: ClassVar[tuple[Candidate, ...]] = ()
    calls: ClassVar[list[tuple[int, bool]]] = []

    def __init__(self, cameras, model, threshold):
        assert len(cameras) == 3 and model is None and threshold == camera.TOLD_THRESHOLD.least
        self.seen_before: set[int] = set()

    def see(self, rgb, camera, moved):
        assert rgb.shape == (240, 320, 3)
        self.calls.append((camera, moved))
        return Seeing(self.looks, "seen")


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(camera, "FrontEnd", FakeFrontEnd)
    monkeypatch.setattr(FakeFrontEnd, "calls", [])
    monkeypatch.setattr(FakeFrontEnd, "looks", ())
    return replace(load_scenario("paper_room"), steps=7)


def test_camera_log_takes_the_cameras_in_turn_one_frame_a_step(short, tmp_path):
    camera_log(short, 1, None, None, RIG, CameraStore(tmp_path))
    assert [index for index, _ in FakeFrontEnd.calls] == [0, 1, 2, 0, 1, 2, 0, 1]
    assert FakeFrontEnd.calls[0] == (0, True)


def test_cameras_see_people_where_they_are_at_that_step(short, monkeypatch):
    hall = replace(load_scenario("busy_hall"), steps=60)
    path, places = true_drive(hall, 1), []

    def render(self, pose, time_s, pan_rad, movers_m):
        places.append(movers_m)
        return rendered(self, pose, time_s, pan_rad, movers_m)

    rendered = Renderer.render
    monkeypatch.setattr(Renderer, "render", render)
    _, glances = unseen_log(hall, 1, None, None, RIG, camera.TOLD_THRESHOLD)
    for _ in zip(glances, range(50), strict=False):
        continue
    np.testing.assert_array_equal(places, path.others_m[: len(places)])
    assert np.ptp(np.array(places), axis=0).max() > 0.5  # somebody walks


def test_camera_log_has_what_the_front_end_measured_at_the_time_of_the_frame(short, tmp_path, monkeypatch):
    looks = (candidate(), candidate(range_m=None), candidate(bearing_rad=None))
    monkeypatch.setattr(FakeFrontEnd, "looks", looks)
    log = camera_log(short, 1, 0.6, None, RIG, CameraStore(tmp_path))
    seen = log.sightings
    assert seen.time_us.tolist() == [step * short.step_us for step in range(8) for _ in range(2)]
    assert seen.bearing_rad.tolist() == [0.1] * 16
    np.testing.assert_array_equal(seen.range_m, [2.0, math.nan] * 8)
    np.testing.assert_array_equal(seen.bearing_sd_rad, 0.011)
    np.testing.assert_array_equal(seen.range_sd_m, [0.05, 0.0] * 8)
    np.testing.assert_array_equal(seen.range_scale_sd, [0.02, 0.0] * 8)
    assert log.robot.wheel_speed_sigma_mps == 0.6


def test_camera_log_has_the_turn_rates_that_the_frames_tell(short, tmp_path, monkeypatch):
    drive = replace(short, steps=40)
    true_rad = np.unwrap(simulate(drive, 1).truth.theta_rad)
    told = iter([None, None, None, *(true_rad[3:] - true_rad[:-3]).tolist()])

    def see(self, rgb, camera, moved):
        turn_rad = next(told)
        return Seeing((), "nothing", None if turn_rad is None else Turn(turn_rad, 1e-6, 0.0, 0.0, 0.0))

    monkeypatch.setattr(FakeFrontEnd, "see", see)
    log = camera_log(drive, 1, 0.6, None, RIG, CameraStore(tmp_path))
    assert np.isnan(log.odometry.gyro_radps).tolist()[:3] == [True, True, False]
    rate_radps = np.diff(true_rad) / (drive.step_us * 1e-6)
    np.testing.assert_allclose(log.odometry.gyro_radps[10:], rate_radps[10:], atol=0.15)
    assert log.robot.gyro_sigma_radps == VisualGyro.SD_RADPS


def test_a_run_that_looks_on_the_way_is_the_one_over_the_log(short, tmp_path, monkeypatch):
    def see(self, rgb, camera, moved):
        turn = Turn(0.02, 1e-6, 0.0, 0.1, 0.5) if camera in self.seen_before else None
        self.seen_before.add(camera)
        return Seeing((candidate(),), "seen", turn)

    monkeypatch.setattr(FakeFrontEnd, "see", see)
    drive, options = replace(short, steps=30), RunOptions(sensor="camera", association="known")
    told = camera.TOLD_THRESHOLD
    log = camera_log(drive, 1, 0.6, None, RIG, CameraStore(tmp_path), told)
    unseen, glances = unseen_log(drive, 1, 0.6, None, RIG, told)
    assert unseen.odometry.gyro_radps is None
    live = run_log(unseen, options, frames=Eye(unseen, options, glances))
    logged = run_log(log, options)
    np.testing.assert_array_equal(live.pose, logged.pose)
    without = replace(log, odometry=replace(log.odometry, gyro_radps=None))
    assert not np.array_equal(run_log(without, options).pose, logged.pose)


def test_camera_log_drives_as_without_a_camera(short, tmp_path):
    log, plain = camera_log(short, 3, 1.0, None, RIG, CameraStore(tmp_path)), simulate(short, 3, 1.0)
    for name in ("time_us", "a", "b"):
        np.testing.assert_array_equal(getattr(log.odometry, name), getattr(plain.odometry, name))
    np.testing.assert_array_equal(log.truth.x_m, plain.truth.x_m)
    assert np.abs(log.beacons.x_m - plain.beacons.x_m).max() < 0.5  # a thick one's face is off the wall


def other_draw(scenario):
    return replace(scenario, wheels=replace(scenario.wheels, draw=1))


def test_store_renders_once_for_every_reading_noise_and_anew_for_another_seed(short, tmp_path):
    store = CameraStore(tmp_path)
    first = camera_log(short, 1, 0.3, None, RIG, store)
    again = camera_log(short, 1, 1.0, None, RIG, store)
    camera_log(other_draw(short), 1, 0.3, None, RIG, store)
    assert len(FakeFrontEnd.calls) == 8
    np.testing.assert_array_equal(first.sightings.bearing_rad, again.sightings.bearing_rad)
    camera_log(short, 2, 0.3, None, RIG, store)
    assert len(FakeFrontEnd.calls) == 16
    assert not list(tmp_path.glob("*.part"))


def test_store_renders_anew_where_the_wheels_themselves_jitter(short, tmp_path):
    store = CameraStore(tmp_path)
    camera_log(short, 1, 0.3, "actuation", RIG, store)
    camera_log(short, 1, 1.0, "actuation", RIG, store)
    camera_log(other_draw(short), 1, 0.3, "actuation", RIG, store)
    assert len(FakeFrontEnd.calls) == 24


def test_camera_log_of_cameras_that_stand_apart_is_refused(short, tmp_path):
    apart = replace(RIG, cameras=(RIG.cameras[0], replace(RIG.cameras[1], x_m=0.1), RIG.cameras[2]))
    with pytest.raises(BslamError, match=r"three60: its cameras stand apart; allowed: one x_m and y_m"):
        camera_log(short, 1, None, None, apart, CameraStore(tmp_path))


def test_covering_beacon_is_the_one_with_most_pixels_in_the_box():
    identity = np.full((6, 8), -1, dtype=np.int16)
    identity[1:5, 1:4] = 7
    identity[1:5, 4:6] = 3
    assert covering_beacon((0.5, 0.5, 5.5, 4.5), identity) == 7
    assert covering_beacon((3.5, 0.5, 5.5, 4.5), identity) == 3


def test_covering_beacon_of_a_box_that_none_fills_is_none():
    identity = np.full((10, 10), -2, dtype=np.int16)  # clutter
    assert covering_beacon((-0.5, -0.5, 9.5, 9.5), identity) == camera.NO_BEACON
    identity[:2] = 4
    assert covering_beacon((-0.5, -0.5, 9.5, 9.5), identity) == camera.NO_BEACON
    identity[:3] = 4
    assert covering_beacon((-0.5, -0.5, 9.5, 9.5), identity) == 4
    assert covering_beacon((20.0, 20.0, 30.0, 30.0), identity) == camera.NO_BEACON


def test_aim_follows_the_surest_bearing_no_faster_than_it_can():
    aim = Aim(replace(RIG, pan=Pan(reach_rad=1.0, speed_radps=2.0)))
    aim.turn([0.5, -0.9], time_s=0.0, step_s=0.1)
    assert aim.angle_rad == pytest.approx(0.2) and aim.moved
    for _ in range(10):
        aim.turn([3.0], time_s=0.0, step_s=0.1)
    assert aim.angle_rad == pytest.approx(1.0) and not aim.moved


def test_aim_without_a_pan_unit_stays():
    aim = Aim(RIG)
    aim.turn([0.5], time_s=0.0, step_s=0.1)
    assert aim.angle_rad == 0.0 and not aim.moved


def test_camera_log_leaves_out_what_the_detector_is_less_sure_of(short, tmp_path, monkeypatch):
    cut = replace(candidate(range_m=None), marks=frozenset({"cut_left"}), score=-0.5)
    looks = (candidate(), replace(candidate(), score=0.0), cut, replace(candidate(), score=-0.5))
    monkeypatch.setattr(FakeFrontEnd, "looks", looks)
    store = CameraStore(tmp_path)
    assert len(camera_log(short, 1, None, None, RIG, store).sightings.time_us) == 8
    told = camera_log(short, 1, None, None, RIG, store, camera.TOLD_THRESHOLD)
    assert len(told.sightings.time_us) == 24


def test_a_user_s_own_kinds_are_seen_and_kept_apart_from_the_built_in_ones(tmp_path):
    model, store = read_scanner(MODELS / "own_room.json"), CameraStore(tmp_path)
    drive = replace(load_scenario("paper_room"), steps=120)
    log = camera_log(drive, 0, None, None, RIG, store, camera.SCANNER_THRESHOLD, model)
    seen = log.sightings
    assert len(seen.time_us) > 4 and log.seeds is None and np.isnan(log.odometry.gyro_radps).all()
    assert set(seen.beacon_class.tolist()) <= {1, 2, 3, 4, 5} and seen.signature.any(axis=1).all()
    other = replace(model, kinds=tuple(replace(one, threshold=1e3) for one in model.kinds))
    none = camera_log(drive, 0, None, None, RIG, store, camera.SCANNER_THRESHOLD, other)
    assert len(none.sightings.time_us) == 0 and len(list(tmp_path.glob("*.npz"))) == 2
    unseen, glances = unseen_log(drive, 0, None, None, RIG, camera.SCANNER_THRESHOLD, model)
    assert unseen.seeds is None
    assert sum(len(one.rows) for one in glances) == len(seen.time_us)
