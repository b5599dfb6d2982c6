"""Pictures over the link: the robot's own front end sees what the host's sees, to the bit."""

import math
import time
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bslam.cli import main
from bslam.core.appearance import rendered_seeds
from bslam.core.errors import CoreError
from bslam.core.slam import Slam
from bslam.core.vision import FrontEnd
from bslam.core.visual_gyro import VisualGyro
from bslam.errors import BslamError
from bslam.link.messages import (
    CameraRecord,
    LookReport,
    Message,
    PoseReport,
    Report,
    hello,
    read_pose_report,
)
from bslam.recording import load
from bslam.recording.entries import Frame
from bslam.rig import load_rig
from bslam.scannerfile import read_scanner
from bslam.target.client import Client
from bslam.target.film import write_film
from bslam.target.lines import ProcessLine, open_line
from bslam.target.remote import RemoteSlam
from bslam.world.camera.renderer import Renderer
from bslam.world.camera.rgb565 import to_rgb565
from bslam.world.camera.worlds import dress
from bslam.world.simulate import load_scenario, true_drive
from tools.proofs.make_film import STEP_US, camera_record, make_film, smaller, turn_ticks

SILENCE_S = 60.0
ROBOT = Path(__file__).parents[3] / "build" / "host" / "robot"
MODELS = Path(__file__).parents[3] / "firmware" / "models"
STEPS = (240, 300, 330, 420, 570)


@pytest.fixture(scope="module")
def camera():
    """Of half the pixels each way, since QEMU's serial line takes 50 us a byte."""
    return smaller(load_rig("three60").cameras[1], 2)


def pictures_of(camera):
    """What a camera shows at STEPS of a drive, RGB565."""
    scenario = load_scenario("paper_room")
    renderer, path = Renderer(dress(scenario, 0), camera, [0, 1]), true_drive(scenario, 0)
    poses = [(path.x_m[step], path.y_m[step], path.theta_rad[step]) for step in STEPS]
    return [to_rgb565(renderer.render(pose, 0.04 * i).rgb) for i, pose in enumerate(poses)]


@pytest.fixture(scope="module")
def pictures(camera):
    return pictures_of(camera)


@pytest.mark.parametrize(("target", "last"), [(f"process:{ROBOT}", 5), ("qemu:mps2_an386", 2)])
def test_a_robot_that_is_sent_pictures_sees_and_maps_what_the_host_does(target, last, camera, pictures):
    params = {"association": 2, "velocity_states": 0}
    here, eyes = Slam(params, beacons_max=80), FrontEnd([camera])
    count = 0
    with RemoteSlam(open_line(target), params, 20, fingerprints=True) as there:
        there.set_camera(0, camera_record(camera))
        chain = 0xCBF29CE484222325
        for step, picture in enumerate(pictures[:last]):
            time_us = (step + 1) * 40_000
            for slam in (here, there):
                slam.odometry("wheels", time_us, 0.3, 0.3)
            chain = here.fingerprint(chain)
            seen, accounts = there.look(time_us, 0, picture, True)
            expected = bearing_candidates(eyes, picture)
            count += len(seen)
            assert [one.bearing_rad for one in seen] == [one.bearing_rad for one in expected]
            assert all((a.signature == b.signature).all() for a, b in zip(seen, expected, strict=True))
            *columns, _, kinds, scores = columns_of(expected)
            assert accounts == here.sightings(time_us, *columns, beacon_class=kinds, score=scores)
            chain = here.fingerprint(chain)
            assert there.fingerprint(0) == chain
    assert count > 0


def test_pictures_that_cannot_be_are_refused(camera, pictures):
    with RemoteSlam(ProcessLine(ROBOT), {}, 20) as robot:
        with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
            robot.look(40_000, 0, pictures[0], True)  # no camera yet
        with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
            robot.set_camera(9, camera_record(camera))
        with pytest.raises(CoreError, match="BSLAM_E_PARAMETER"):
            robot.set_camera(0, CameraRecord(**(vars(camera_record(camera)) | {"fx_px": -1.0})))
        robot.set_camera(0, camera_record(camera))
        with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
            robot.look(40_000, 0, pictures[0][:100], True)  # rows are missing
        with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
            robot.look(80_000, 0, np.concatenate([pictures[0], pictures[0]]), True)  # too many
        here = FrontEnd([camera]).see(pictures[0]).candidates
        seen, _ = robot.look(120_000, 0, pictures[0], True)
        assert len(seen) == sum(one.bearing_rad is not None for one in here)


# ---- a robot with wheels and a camera of its own, which a film moves ---------------------------------------

TURN, SHOTS = 24, 4
ROOM, OWN_ROOM = 3, 0  # seeds of one whose pictures show something, and of what own_room.json is of


@pytest.fixture(scope="module")
def film(camera, tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "turn"
    make_film(path, "paper_room", ROOM, camera, SHOTS, TURN)
    return path


def shots_of(film, camera, count=SHOTS):
    """The pictures of a film as it has them."""
    sides = (camera.lens.height_px, camera.lens.width_px)
    data = film.read_bytes()[-count * 2 * sides[0] * sides[1] :]
    return np.frombuffer(data, "<u2").reshape(count, *sides)


@pytest.fixture(params=["process", "qemu:mps2_an386", "qemu:stm32f405_seeing", "qemu:stm32f405_scanning"])
def own_eyes(request, film, camera, tmp_path, monkeypatch):
    """A robot that drives by a film, what looks as it does, and the pictures that it takes in turn. The
    STM32F405's are of full size, three of them, which its flash has room for.
    """
    if request.param == "process":
        monkeypatch.setenv("BSLAM_FILM", str(film))
        target, shots = f"process:{ROBOT}", shots_of(film, camera)
    elif request.param == "qemu:mps2_an386":
        target, shots = f"{request.param}:{film}", shots_of(film, camera)
    else:
        camera = load_rig("three60").cameras[1]
        room = OWN_ROOM if request.param.endswith("scanning") else ROOM
        make_film(tmp_path / "large", "paper_room", room, camera, 3, TURN)
        target, shots = f"{request.param}:{tmp_path}/large", shots_of(tmp_path / "large", camera, 3)
    model = read_scanner(MODELS / "own_room.json") if request.param.endswith("scanning") else None
    with RemoteSlam(open_line(target), None, 14) as robot:
        yield robot, FrontEnd([camera], model), shots


def bearing_candidates(eyes, picture):
    return [one for one in eyes.see(picture).candidates if one.bearing_rad is not None]


def columns_of(candidates):
    """What they tell the filter, as `Slam.sightings` takes it."""
    bearings = [c.bearing_rad for c in candidates]
    ranges = [np.nan if c.range_m is None else c.range_m for c in candidates]
    told = [(c.told.bearing_sd_rad, c.told.range_sd_m, c.told.range_scale_sd) for c in candidates]
    noise = [list(column) for column in zip(*told, strict=True)] if told else [[], [], []]
    signatures = np.stack([c.signature for c in candidates]) if candidates else None
    kinds, scores = [c.beacon_class for c in candidates], [c.score for c in candidates]
    return bearings, ranges, [-1] * len(bearings), [True] * len(bearings), *noise, signatures, kinds, scores


def feed(slam, told):
    """The reading that a robot tells of."""
    report = told.report
    gyro = (report.gyro_radps, report.gyro_sd_radps)
    slam.odometry("ticks", told.time_us, report.left_ticks, report.right_ticks, *gyro)


def gather(count: int, more: Callable[[], list]) -> list:
    """The first so many that more() brings; a robot that brings none for a minute has failed."""
    found: list = []
    end_s = time.monotonic() + SILENCE_S
    while len(found) < count:
        assert time.monotonic() < end_s, f"{len(found)} of {count}, and no more in a minute"
        new = more()
        end_s = time.monotonic() + SILENCE_S if new else end_s
        found += new
    return found[:count]


def readings_of(robot, count):
    """The first reports of readings, in order."""
    return gather(count, lambda: [one for one in robot.reports(5.0) if isinstance(one.report, PoseReport)])


def test_a_robot_with_a_camera_of_its_own_sees_and_maps_what_the_host_does(own_eyes):
    robot, eyes, shots = own_eyes
    params = robot.host_params
    told = gather((TURN + SHOTS) * 3 // 2, lambda: robot.reports(5.0))
    assert robot.reports_lost == 0
    here = Slam(params, beacons_max=80, seeds=rendered_seeds())
    looks, count = 0, 0
    for step, one in enumerate(told, start=1):
        assert one.refused is None
        if isinstance(one.report, PoseReport):
            feed(here, one)
            assert one.time_us == (step - looks) * 40_000
        else:
            expected = bearing_candidates(eyes, shots[looks % len(shots)])
            assert [c.bearing_rad for c in expected] == [seen.bearing_rad for seen in one.seen]
            looks, count = looks + 1, count + len(expected)
            columns = columns_of(expected)
            assert one.accounts == here.sightings(one.time_us, *columns)
        assert here.pose() == one.report.step.pose
        assert here.pose_covariance_lower() == one.report.step.covariance
    assert looks >= len(shots) and count > 0


def wheel_speeds(told, params):
    """What a robot that turns on the spot makes of its readings: forward speed and its noise, m/s."""
    least_mps, speeds = 0.01, [(0.0, 0.01)]
    for before, one in pairwise(told):
        dt_s = (one.time_us - before.time_us) * 1e-6
        travelled_m = [
            (getattr(one.report, f"{side}_ticks") - getattr(before.report, f"{side}_ticks"))
            / params["ticks_per_revolution"]
            * 2
            * np.pi
            * params[f"{side}_radius_m"]
            for side in ("left", "right")
        ]
        sds_mps = params["left_speed_sd_mps"], params["right_speed_sd_mps"]
        variance_m2 = sum((sd_mps * dt_s) ** 2 for sd_mps in sds_mps) / 4
        variance_m2 += params["travel_sd_per_sqrt_m"] ** 2 * sum(map(abs, travelled_m)) / 4
        variance_m2 += params["forward_sd_per_sqrt_s"] ** 2 * dt_s
        variance_m2 += params["forward_sd_per_sqrt_m"] ** 2 * abs(sum(travelled_m) / 2)
        speeds.append((sum(travelled_m) / 2 / dt_s, max(math.sqrt(variance_m2) / dt_s, least_mps)))
    return speeds


CLOSE = 90  # readings a turn, a picture at each: near enough to the one before to tell the turn


def test_its_pictures_tell_how_fast_it_turns_as_on_the_host(camera, tmp_path, monkeypatch):
    path = tmp_path / "close"
    make_film(path, "paper_room", 0, camera, CLOSE, CLOSE)
    monkeypatch.setenv("BSLAM_FILM", str(path))
    found = []
    for target in (f"process:{ROBOT}", f"qemu:mps2_an386:{path}"):
        with RemoteSlam(open_line(target), None, 20) as robot:
            told = readings_of(robot, 40)
            here = Slam(robot.host_params, beacons_max=80)
        for one in told[:2]:  # before what it sees comes in between
            feed(here, one)
        assert here.pose() == told[1].report.step.pose
        found.append([(one.report.gyro_radps, one.report.gyro_sd_radps) for one in told])
    assert found[0] == found[1]
    eyes, gyro, expected = FrontEnd([camera]), VisualGyro(VisualGyro.SD_RADPS), []
    speeds = wheel_speeds(told, robot.host_params)
    for one, picture, speed in zip(told, shots_of(path, camera, CLOSE), speeds, strict=False):
        gyro.advance(one.time_us, *speed)
        gyro.take(0, eyes.see(picture).turn)
        expected.append(gyro.rate())
    assert found[0][0] == (None, 0.0) and expected[0] is None
    rates = np.array(found[0][1:])
    np.testing.assert_allclose(rates, expected[1:], rtol=1e-5)
    assert (rates[:, 1] >= np.float32(VisualGyro.SD_RADPS)).all()
    assert np.mean(rates[:, 0]) == pytest.approx(2 * np.pi / CLOSE / 0.04, rel=0.01)


def test_a_host_that_greets_while_a_reading_waits_for_its_picture_takes_no_rate_from_it(
    camera, tmp_path, monkeypatch
):
    make_film(tmp_path / "close", "paper_room", 0, camera, CLOSE, CLOSE)
    monkeypatch.setenv("BSLAM_FILM", str(tmp_path / "close"))
    with closing(Client(ProcessLine(ROBOT), as_it_is=True)) as client:

        def greet():
            client.ask(Message.HELLO, hello(1, as_it_is=True))
            frames = [frame for frame in client.listen(None) if frame.type == Report.POSE]
            return [read_pose_report(frame.payload).gyro_radps for frame in frames]

        told = gather(20, greet)
    assert told[0] is None and None not in told[1:]


@pytest.mark.parametrize("target", ["process", "qemu:stm32f405"])
def test_a_board_s_own_gyro_goes_with_each_reading(target, tmp_path, monkeypatch):
    path, rates = tmp_path / "gyro", np.linspace(1.4, 1.8, TURN)
    write_film(path, STEP_US, turn_ticks(TURN), gyro_radps=rates)
    monkeypatch.setenv("BSLAM_FILM", str(path))
    name = f"process:{ROBOT}" if target == "process" else f"{target}:{path}"
    with RemoteSlam(open_line(name), None, 20) as robot:
        told = readings_of(robot, 2 * TURN)
        here = Slam(robot.host_params, beacons_max=80)
    for one in told:
        feed(here, one)
        assert here.pose() == one.report.step.pose
    assert [one.report.gyro_radps for one in told] == 2 * [float(one) for one in rates.astype(np.float32)]
    blind = Slam(beacons_max=80)
    for one in told:
        blind.odometry("ticks", one.time_us, one.report.left_ticks, one.report.right_ticks)
    assert blind.pose() != here.pose()


def test_a_camera_whose_pixels_are_doubled_is_doubled_over_the_link():
    wide = load_rig("wide180").cameras[0]
    half = smaller(wide, 2)
    assert half.zoom == 2
    doubled, plain = FrontEnd([half]), FrontEnd([replace(half, zoom=1)])
    count, differing = 0, 0
    with RemoteSlam(ProcessLine(ROBOT), {"association": 2}, 20) as robot:
        with pytest.raises(CoreError, match="BSLAM_E_RANGE"):
            robot.set_camera(0, camera_record(wide))  # 640 x 480 has no room
        robot.set_camera(0, camera_record(half))
        for step, picture in enumerate(pictures_of(half), start=1):
            robot.odometry("wheels", step * 40_000, 0.03, 0.03)
            seen, _ = robot.look(step * 40_000, 0, picture, True)
            bearings = [one.bearing_rad for one in seen]
            assert bearings == [one.bearing_rad for one in bearing_candidates(doubled, picture)]
            differing += bearings != [one.bearing_rad for one in bearing_candidates(plain, picture)]
            count += len(seen)
    assert count > 0 and differing > 0


@pytest.mark.usefixtures("robots_clock")
def test_its_console_recording_replays_to_the_same_bits(film, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("BSLAM_FILM", str(film))
    path = tmp_path / "seen.mcap"
    words = ["console", f"process:{ROBOT}", "--reset", "--record", str(path), "--seconds", "2"]
    assert main(words) == 0
    assert main(["replay", str(path), "--pictures", "0", "--out", str(tmp_path / "out")]) == 0
    assert "states are the recorded ones to the bit" in capsys.readouterr().out
    frames = [one for one in load(path).entries if isinstance(one, Frame)]
    assert any(one.signature is not None for one in frames)


def test_rows_that_a_picture_over_the_link_broke_into_are_not_mixed_with_it(film, camera, monkeypatch):
    """The host sends a picture of its own while the robot's camera delivers rows: what is reported as seen is
    whole, and the link's picture is refused or seen as it is.
    """
    monkeypatch.setenv("BSLAM_FILM", str(film))
    eyes, shots = FrontEnd([camera]), shots_of(film, camera)
    known = [[c.bearing_rad for c in bearing_candidates(eyes, shots[i % SHOTS])] for i in range(3 * SHOTS)]
    with RemoteSlam(open_line(f"process:{ROBOT}"), None, 20) as robot:
        told = []
        for attempt in range(3):
            with suppress(CoreError):  # refused: rows came in between
                robot.look((attempt + 1) * 10**7, 0, shots[0], True)
            told += robot.reports(0.2)
    seen = [[one.bearing_rad for one in t.seen] for t in told if isinstance(t.report, LookReport)]
    assert all(one in known for one in seen)


def test_a_film_that_is_none_is_a_robot_at_rest(tmp_path, monkeypatch, film):
    for name, data in {
        "empty": bytes(64),
        "cut": b"FILM" + bytes(60),
        "magic": b"MOVI" + film.read_bytes()[4:],
    }.items():
        (tmp_path / name).write_bytes(data)
        monkeypatch.setenv("BSLAM_FILM", str(tmp_path / name))
        with RemoteSlam(open_line(f"process:{ROBOT}"), None, 20) as robot:
            assert robot.counters()["odometry"] == 0
            with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
                robot.look(40_000, 0, np.zeros((8, 8), np.uint16), True)


def test_a_film_that_cannot_be_shown_is_bad_input(tmp_path):
    with pytest.raises(BslamError, match="allowed: a film"):
        open_line(f"qemu:mps2_an386:{tmp_path}/none")
    with pytest.raises(BslamError, match="FILM_ADDRESS"):
        open_line(f"qemu:microbit:{tmp_path}/none")
