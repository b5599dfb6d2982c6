"""Bags of simulated drives come back as the log they were made of."""

import json
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bslam.cli import main
from bslam.evaluation.metrics import evaluate, summarise
from bslam.log import Log, first_steps
from bslam.logcheck.check import check_log
from bslam.options import RunOptions
from bslam.ros2.geometry import Transform, pose_of_part
from bslam.ros2.importer import Request, import_bag
from bslam.ros2.tags import TagSizes
from bslam.runs.runner import run_log
from ros2.bags import (
    CAMERA,
    EPOCH_NS,
    MADE_UP,
    SIDE_M,
    STORE,
    Drive,
    Said,
    header,
    new,
    parts,
    point,
    pose,
    quaternion,
    transform,
    write_bag,
    yawed,
)

EPOCH_US = EPOCH_NS // 1000
SIZES = TagSizes({}, SIDE_M)
OPTIONS = RunOptions(sensor="recorded")


def imported(bag: Path, **request) -> Log:
    return import_bag(bag, Request(robot={"wheelbase_m": 0.4}, **request)).log


def assert_same_sightings(log: Log, direct: Log, within: float = 1e-9) -> None:
    ours, theirs = log.sightings, direct.sightings
    order = np.lexsort((theirs.beacon_id, theirs.time_us))
    mine = np.lexsort((ours.beacon_id, ours.time_us))
    np.testing.assert_array_equal(ours.time_us[mine] - EPOCH_US, theirs.time_us[order])
    np.testing.assert_array_equal(ours.beacon_id[mine], theirs.beacon_id[order])
    np.testing.assert_allclose(ours.bearing_rad[mine], theirs.bearing_rad[order], atol=within)
    np.testing.assert_allclose(ours.range_m[mine], theirs.range_m[order], atol=within)


def test_poses_of_markers_and_odometry_come_back(drive: Drive, aruco: Path) -> None:
    log, direct = imported(aruco, truth="/mocap"), drive.log
    assert_same_sightings(log, direct)
    assert log.odometry.kind == "wheels"
    np.testing.assert_array_equal(log.odometry.time_us - EPOCH_US, direct.odometry.time_us)
    np.testing.assert_allclose(log.odometry.a, direct.odometry.a, atol=1e-12)
    np.testing.assert_allclose(log.odometry.b, direct.odometry.b, atol=1e-12)
    for name in ("sensor_x_m", "sensor_y_m", "sensor_yaw_rad"):
        assert getattr(log.robot, name) == pytest.approx(getattr(direct.robot, name), abs=1e-9)
    assert log.robot.wheel_noise == "actuation"
    assert log.truth is not None and len(log.truth.time_us) == 601
    assert log.truth.time_us[0] == EPOCH_US


@pytest.mark.parametrize(
    ("part", "topic", "plugin", "definitions"),
    [
        ("detections_3d", "/detections", "sqlite3", False),
        ("opencv", "/aruco_detections", "sqlite3", True),
        ("tag_frames", "/tf", "mcap", True),
    ],
)
def test_other_markers_come_back(
    tmp_path: Path, drive: Drive, part: str, topic: str, plugin: str, definitions: bool
) -> None:
    small = replace(drive, log=_beginning(drive.log))
    said = parts(small.odometry(), getattr(small, part)(), small.static())
    bag = write_bag(tmp_path / "bag", said, plugin, definitions)
    assert_same_sightings(imported(bag, detections=topic), small.log)


def _beginning(log: Log) -> Log:
    return first_steps(log, 60)


def test_gyro_is_averaged_over_each_step_and_turned_upright(drive: Drive, aruco: Path) -> None:
    log = imported(aruco, imu="/imu")
    assert drive.log.truth is not None and log.odometry.gyro_radps is not None
    turn_rad = np.remainder(np.diff(drive.log.truth.theta_rad[:601]) + np.pi, 2 * np.pi) - np.pi
    np.testing.assert_allclose(log.odometry.gyro_radps, turn_rad / 0.04, atol=1e-9)
    assert log.robot.gyro_sigma_radps == pytest.approx(1e-3 / 2.0)  # of four readings a step


def test_joints_make_the_same_travel(drive: Drive, tags: Path) -> None:
    request = {"joints": "/joint_states", "wheel_radius_m": 0.05, "rectified": False, "sizes": SIZES}
    log = imported(tags, **request)
    np.testing.assert_allclose(log.odometry.a, drive.log.odometry.a, atol=1e-9)
    np.testing.assert_allclose(log.odometry.b, drive.log.odometry.b, atol=1e-9)


def test_corners_give_bearing_range_and_their_noise(drive: Drive, tags: Path) -> None:
    log = imported(tags, rectified=False, sizes=SIZES, truth="/mocap")
    sightings, truth, beacons = log.sightings, log.truth, drive.log.beacons
    assert truth is not None and beacons is not None
    assert sightings.bearing_sd_rad is not None and sightings.range_sd_m is not None
    assert len(sightings.time_us) > 400
    row = np.searchsorted(truth.time_us, sightings.time_us)
    theta, robot = truth.theta_rad[row], drive.log.robot
    at = np.argsort(beacons.beacon_id)[sightings.beacon_id]
    x_m = truth.x_m[row] + robot.sensor_x_m * np.cos(theta) - robot.sensor_y_m * np.sin(theta)
    y_m = truth.y_m[row] + robot.sensor_x_m * np.sin(theta) + robot.sensor_y_m * np.cos(theta)
    dx_m, dy_m = beacons.x_m[at] - x_m, beacons.y_m[at] - y_m
    off_rad = np.arctan2(dy_m, dx_m) - theta - robot.sensor_yaw_rad - sightings.bearing_rad
    off_rad = np.remainder(off_rad + np.pi, 2 * np.pi) - np.pi
    assert np.abs(off_rad).max() < 0.005
    off = (sightings.range_m - np.hypot(dx_m, dy_m)) / sightings.range_sd_m
    # Corners err by 0.2 px where 0.5 are told.
    assert 0.1 < np.sqrt(np.mean(off**2)) < 0.8
    assert np.abs(np.mean(off)) < 0.15
    assert log.robot.field_of_view_rad == pytest.approx(2 * math.atan(640 / CAMERA.fx), rel=0.1)


@pytest.fixture(scope="module")
def direct_error_m(drive: Drive) -> float:
    return replayed_error_m(drive.log)


def replayed_error_m(log: Log) -> float:
    trace = run_log(log, OPTIONS)
    summary = summarise(log, trace, OPTIONS, evaluate(log, trace, OPTIONS))
    assert not summary["diverged"]
    return summary["position_error_m"]["mean"]


NOISE = [
    f"--set={name}"
    for name in ("bearing_sigma_rad=0.013575", "range_sigma_fraction=0.02", "range_sigma_scale_m=110.9")
]


def test_command_line_from_bag_to_map_with_the_error_of_the_direct_log(
    tmp_path: Path, aruco: Path, direct_error_m: float, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "drive"
    words = ["import", "ros2", str(aruco), "--odometry", "/odom", "--detections", "/aruco_markers"]
    more = ["--truth", "/mocap", "--wheelbase", "0.4", *NOISE, "--set", "range_sigma_floor_m=0.0"]
    assert main([*words, *more, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "/odom (nav_msgs/msg/Odometry): 601 messages in 24.0 s, 25.0 Hz" in said
    assert "of 6 beacons: 0, 1, 2, 3, 4, 5" in said
    assert "guessed: wheel_speed_sigma_mps = 0.05" in said
    assert "guessed: bearing_sigma_rad" not in said
    assert main(["check", str(out), "--out", str(tmp_path / "check")]) == 0
    replay = ["replay", "csv", str(out), "--association", "known", "--jobs", "1", "--pictures", "0"]
    assert main([*replay, "--out", str(tmp_path / "out")]) == 0
    (run,) = json.loads((tmp_path / "out" / "summary.json").read_text())["runs"]
    assert run["position_error_m"]["mean"] == pytest.approx(direct_error_m, abs=1e-4)


def test_tags_are_replayed_about_as_well_as_the_direct_log(
    tmp_path: Path, tags: Path, direct_error_m: float
) -> None:
    sizes = tmp_path / "tags.toml"
    sizes.write_text('default_m = 0.3\n[side_m]\n"tag36h11:1" = 0.3\n2 = 0.3\n')
    out = tmp_path / "drive"
    words = ["import", "ros2", str(tags), "--tags", str(sizes), "--image", "raw", "--wheelbase", "0.4"]
    assert main([*words, "--truth", "/mocap", "--out", str(out)]) == 0
    log = Log.read(out)
    assert not [one for one in check_log(log).findings if not one.is_note]
    # Fewer beacons are in the camera's image than in the simulated sensor's; what is seen is seen better.
    assert replayed_error_m(log) < 1.2 * direct_error_m


def test_a_folder_that_is_there_keeps_what_is_no_log(
    tmp_path: Path, aruco: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    assert main(["import", "ros2", str(aruco), "--out", str(tmp_path)]) == 0
    assert "replaced" not in capsys.readouterr().out
    (tmp_path / "beacons.csv").write_text("of another drive")
    assert main(["import", "ros2", str(aruco), "--out", str(tmp_path)]) == 0
    said = f"{tmp_path}: replaced odometry.csv, sightings.csv, robot.toml; removed beacons.csv\n"
    assert said in capsys.readouterr().out
    assert sorted(one.name for one in tmp_path.iterdir()) == [
        "notes.txt", "odometry.csv", "robot.toml", "sightings.csv",
    ]  # fmt: skip
    Log.read(tmp_path)


def test_a_mount_without_a_pitch_says_that_it_takes_the_camera_for_level(
    tmp_path: Path, aruco: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = []
    for mount in ("0.12,0.05,0.3", "0.12,0.05,0.3,0.2"):
        assert main(["import", "ros2", str(aruco), "--mount", mount, "--out", str(tmp_path / mount)]) == 0
        logs.append(Log.read(tmp_path / mount))
    level, tilted = capsys.readouterr().out.split("log in ", 1)
    assert "note: --mount: the camera is assumed level; in place of x 0.120 m, y 0.050 m, yaw" in level
    assert "looking 0.2000 rad down, as /tf_static has it" in tilted and "assumed level" not in tilted
    direct = imported(aruco)
    np.testing.assert_allclose(logs[1].sightings.range_m, direct.sightings.range_m, atol=1e-9)
    assert np.abs(logs[0].sightings.range_m / direct.sightings.range_m - 1.0).max() > 0.01


# --- bad input ----------------------------------------------------------------------------------------------

BAD = {
    "{tags} --tag-size 0.3": "the camera distorts; allowed: --image rectified",
    "{tags} --image raw": "size of tags tag36h11:0, tag36h11:1",
    "{tags} --image raw --tags {tmp}/sizes.csv": "allowed: --tag-size METRES for these, too, or their rows",
    "{tags} --image raw --tag-size 300": "--tag-size: 300.0 is not allowed; allowed: metres",
    "{tags} --imu /imu": "no topic /imu (--imu); allowed: another bag (in this one: /",
    "{aruco} --detections /a --detections /b": "--detections /a and /b: allowed: one topic",
    "{tags} --odometry /odm": "no topic /odm (--odometry), did you mean /odom?",
    "{tags} --detections /odom": "is of type nav_msgs/msg/Odometry; allowed: one of /ap",
    "{tags} --joints /joint_states --image raw --tag-size 0.3": "--wheel-radius METRES, which is missing",
    "{tags} --joints /joint_states --left-joint l --wheel-radius 0.1 --wheelbase 0.3": "--left-joint",
    "{aruco} --tag-size 0.3": "sizes of tags have no use; allowed: no --tags, no --tag-size",
    "{aruco} --base nowhere": "no way from base_link, the odometry's frame, to nowhere",
    "{aruco} --mount 1,2": "allowed: X_M,Y_M,YAW_RAD",
    "{aruco} --truth /tf_static": "--truth /tf_static:CHILD_FRAME",
    "{aruco} --set wheelbas_m=0.3": "--set, key wheelbas_m: no such key",
    "{aruco} --truth :base_link": "--truth ':base_link': no topic; allowed: TOPIC, or TOPIC:FRAME",
    "{aruco} --set counter_bits=16": "log/robot.toml, key left_radius_m: is missing",
    "{aruco} --set settings={{bearing_sd_rat=1}}": "key bearing_sd_rat: no such setting",
    "{aruco} --base imu_link": "base_link, the odometry's frame, is not level with imu_link",
    "{aruco} --set wheelbase_m": "allowed: KEY=VALUE",
    "{aruco} --wheelbase 300": "--wheelbase: 300.0 is not allowed",
    "{tmp}/none": "no such bag",
    "{tmp}": "FILE.mcap or FILE.db3, as {tmp}/old.mcap, which is in it",
    "{tmp}/old.bag": "rosbags-convert",
}


@pytest.mark.parametrize(("words", "said"), BAD.items())
def test_bad_requests_are_one_line(
    tmp_path: Path, aruco: Path, tags: Path, capsys: pytest.CaptureFixture[str], words: str, said: str
) -> None:
    (tmp_path / "sizes.csv").write_text("id,side_m\n0,0.16\n")
    (tmp_path / "old.mcap").write_bytes(b"")
    words = words.format(aruco=aruco, tags=tags, tmp=tmp_path)
    assert_refused(tmp_path, words, said.replace("{tmp}", str(tmp_path)), capsys)


def assert_refused(tmp_path: Path, words: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(tmp_path.rglob("*"))
    assert main(["import", "ros2", "--out", str(tmp_path / "log"), *words.split()]) == 2
    told = capsys.readouterr()
    assert told.out == "" and told.err.count("\n") == 1
    assert said in told.err
    assert sorted(tmp_path.rglob("*")) == before


@pytest.fixture
def start(drive: Drive) -> Drive:
    return replace(drive, log=_beginning(drive.log))


def changed(said: Iterable[Said], change: Callable[[Any], None], every: int = 7) -> list[Said]:
    """One message of so many, changed."""
    listed = list(said)
    for one in listed[3::every]:
        change(one[3])
    return listed


def logged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], said: Iterable[Said], *words: str
) -> tuple[Log, str]:
    """The log that the command leaves, and what it says."""
    bag = write_bag(tmp_path / "bag", said)
    assert (
        main(["import", "ros2", str(bag), "--wheelbase", "0.4", "--out", str(tmp_path / "log"), *words]) == 0
    )
    return Log.read(tmp_path / "log"), capsys.readouterr().out


@pytest.mark.parametrize("word", ["-1", "-3", "nan", "1.5"])
def test_a_number_that_is_no_count_is_no_identity(
    tmp_path: Path, start: Drive, capsys: pytest.CaptureFixture[str], word: str
) -> None:
    def change(message: Any) -> None:
        if word == "-1":
            message.marker_ids[:1] = -1
        for one in [] if word == "-1" else message.detections[:1]:
            one.results[0].hypothesis.class_id = word

    seen = start.aruco() if word == "-1" else start.detections_3d()
    log, said = logged(tmp_path, capsys, [*start.odometry(), *start.static(), *changed(seen, change)])
    unknown = int((log.sightings.beacon_id < 0).sum())
    assert 0 < unknown < len(log.sightings.time_us)
    assert f"{unknown} markers have a number that is no count" in said
    assert log.words == ()


def test_poses_of_the_truth_that_are_no_numbers_are_left_out(
    tmp_path: Path, start: Drive, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(message: Any) -> None:
        message.pose.position.x = message.pose.orientation.w = math.nan

    said = [*start.odometry(), *start.static(), *start.aruco(), *changed(start.truth(), change, 20)]
    log, told = logged(tmp_path, capsys, said, "--truth", "/mocap")
    assert "poses that are not finite" in told
    assert log.truth is not None and len(log.truth.time_us) == 61 - len(range(3, 61, 20))


def test_a_bag_of_two_drives_is_cut(tmp_path: Path, start: Drive, capsys: pytest.CaptureFixture[str]) -> None:
    again = [(t + 10**10, *rest) for t, *rest in (*start.odometry(), *start.aruco())]
    said = [*start.static(), *start.odometry(), *start.aruco(), *again]
    words = f"{write_bag(tmp_path / 'bag', said)} --wheelbase 0.4"
    for cut, s in (("", "2.4"), (" --start 0.99", "1.4")):
        assert_refused(tmp_path, words + cut, f"about {s} s after the first message taken", capsys)
    assert_refused(
        tmp_path, f"{words} --start 20", "no messages within --start and --end; the bag is 12", capsys
    )
    assert_refused(tmp_path, f"{words} --start 3 --end 2", "allowed: 0 <= start < end", capsys)
    for cut in ("--start 5", "--end 5"):
        log = tmp_path / cut
        assert main(["import", "ros2", *words.split(), *cut.split(), "--out", str(log)]) == 0
        np.testing.assert_array_equal(Log.read(log).odometry.time_us - EPOCH_US, start.log.odometry.time_us)


def test_a_few_poses_of_the_odometry_that_are_no_numbers_are_left_out(
    tmp_path: Path, start: Drive, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(message: Any) -> None:
        message.pose.pose.position.x = math.nan

    said = [*changed(start.odometry(), change, 40), *start.static(), *start.aruco()]
    log, told = logged(tmp_path, capsys, said)
    assert "/odom: left out 2 of 61 messages, from message 3 on, have" in told
    assert len(log.odometry.time_us) == 58
    way_m = [np.sum(one.odometry.a + one.odometry.b) for one in (log, start.log)]
    assert way_m[0] == pytest.approx(way_m[1], abs=1e-3)


def test_a_marker_right_above_the_camera_has_no_bearing(
    tmp_path: Path, start: Drive, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(message: Any) -> None:
        message.poses[0].position = point((0.0, -1.0, 0.0))

    said = [*start.odometry(), *changed(start.aruco(), change)]
    log, told = logged(tmp_path, capsys, said, "--mount", "0,0,0")
    assert "markers without a place in front of the camera" in told
    assert (log.sightings.range_m > 0.0).all()


def test_a_covariance_that_is_none_is_left_out(
    tmp_path: Path, start: Drive, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(message: Any) -> None:
        for one in message.detections:
            covariance = np.full((6, 6), 5e-4)
            np.fill_diagonal(covariance, 1e-4)
            one.results[0].pose.covariance = covariance.ravel()

    said = [*start.odometry(), *start.static(), *changed(start.detections_3d(), change, 1)]
    log, told = logged(tmp_path, capsys, said)
    assert "markers have a covariance that is none" in told
    assert log.sightings.bearing_sd_rad is None


def test_the_base_may_be_another_frame_than_that_of_the_odometry(tmp_path: Path, start: Drive) -> None:
    """The same drive, told of a frame that is ahead of the base and turned to its left."""
    vio = Transform.of((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)), np.array([0.3, 0.1, 0.0]))
    tie = transform(EPOCH_NS, "base_link", "vio", vio.place_m, quaternion(vio.rotation))
    static = [
        (EPOCH_NS, "/tf_static", "tf2_msgs/msg/TFMessage", new("tf2_msgs/msg/TFMessage", transforms=[tie]))
    ]

    def of_vio(message: Any) -> None:
        at = message.pose.pose
        yaw = 2.0 * math.atan2(at.orientation.z, at.orientation.w)
        x, y, theta = pose_of_part((at.position.x, at.position.y, yaw), vio)
        message.child_frame_id, message.pose.pose = "vio", pose((x, y, 0.0), yawed(theta))

    odometry = [(t, n, k, m) for t, n, k, m in changed(start.odometry(), of_vio, 1)[3:]]
    seen = [*start.aruco(), *start.static(), *static]
    log = imported(write_bag(tmp_path / "vio", [*odometry, *seen]), base="base_link")
    direct = imported(write_bag(tmp_path / "base", [*list(start.odometry())[3:], *seen]))
    np.testing.assert_allclose(log.odometry.a, direct.odometry.a, atol=1e-9)
    np.testing.assert_allclose(log.odometry.b, direct.odometry.b, atol=1e-9)


def test_odometry_before_a_first_pause_is_left_out(
    tmp_path: Path, start: Drive, capsys: pytest.CaptureFixture[str]
) -> None:
    first, *rest = start.odometry()
    said = [first, *rest[20:], *start.aruco(), *start.static(), *start.truth()]
    log, told = logged(tmp_path, capsys, said, "--truth", "/mocap")
    assert "/odom: left out 1 messages at the start: a pause of 0.8 s follows" in told
    begins_us = int(log.odometry.time_us[0]) - log.robot.step_us
    assert begins_us == EPOCH_US + 21 * 40_000
    assert log.truth is not None
    assert min(log.sightings.time_us[0], log.truth.time_us[0]) >= begins_us


def test_a_bag_in_the_present_folder_gives_its_name(
    tmp_path: Path, start: Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = write_bag(tmp_path / "bag_1.2", parts(start.odometry(), start.aruco(), start.static()))
    monkeypatch.chdir(bag)
    assert main(["import", "ros2", "."]) == 0
    Log.read(bag / "out" / "import" / "bag_1.2")
    assert imported(bag).name == "bag_1.2"
    (file,) = bag.glob("*.mcap")
    assert imported(file).name == file.stem


def _broken(drive: Drive) -> Iterator[tuple[str, list[Said], str]]:
    start = replace(drive, log=_beginning(drive.log))
    odometry, aruco, static = list(start.odometry()), list(start.aruco()), list(start.static())
    thing = [(EPOCH_NS, "/thing", MADE_UP, new(MADE_UP, header=header(EPOCH_NS)))]
    tags = list(start.tag_frames())
    yield "no markers", [*odometry, *static], "allowed: another bag (in this one: /"
    yield (
        "tags in tf",
        [*odometry, *static, *tags],
        "--detections TOPIC: allowed: one of /tf (tf2_msgs/msg/TF",
    )
    yield "nothing", [], "holds no messages at all"
    yield "no odometry", [*aruco, *static, *thing], "no topic of type nav_msgs/msg/Odometry"
    yield (
        "no mount",
        [*odometry, *aruco],
        "to camera_optical_frame, the camera's frame (it has no frames); al",
    )
    yield "no camera", [*odometry, *start.apriltags(), *static], "no sensor_msgs/msg/CameraInfo is there"
    yield (
        "two odometries",
        [*odometry, *[(t, "/odom2", k, m) for t, _, k, m in odometry], *aruco],
        "several topics fit",
    )
    yield "one message", [odometry[0], *aruco, *static], "1 messages; allowed: two or more"
    yield (
        "no stamps",
        [*(_unstamped(one) for one in start.odometry()), *aruco, *static],
        "header.stamp of message 0 is 0",
    )
    later = Drive(start.log)
    later.time_ns = lambda time_us: EPOCH_NS + 10**12 + int(time_us) * 1000  # type: ignore[method-assign]
    yield "other clock", [*odometry, *later.aruco(), *static], "allowed: stamps of one clock"
    yield (
        "anew",
        [*odometry, *((t + 10**12, n, k, m) for t, n, k, m in odometry), *aruco, *static],
        "runs back by 2.400 s",
    )
    for camera, why in (
        (replace(CAMERA, fx=0.0, distortion=()), "allowed: a calibrated camera"),
        (replace(CAMERA, model="equidistant"), "the camera distorts"),
    ):
        lens = replace(start, camera=camera)
        yield f"lens {why[-10:]}", [*odometry, *start.apriltags(), *static, *lens.camera_info()], why
    empty = "ros2_aruco_interfaces/msg/ArucoMarkers"
    none = [(EPOCH_NS, "/aruco_markers", empty, new(empty, header=header(EPOCH_NS)))]
    unequal = changed(start.aruco(), lambda message: message.poses.pop())
    yield "unequal", [*odometry, *unequal, *static], "/aruco_markers, message 3: "
    turned = [_untold(one) for one in start.static()]
    yield "no turn", [*odometry, *aruco, *turned], "has numbers that are not finite"
    lost = changed(start.odometry(), lambda message: setattr(message.pose.pose.orientation, "w", math.nan))
    yield (
        "no heading",
        [*lost, *aruco, *static],
        "/odom: 9 of 61 messages, from message 3 on, have numbers that are not finite; allowed: 5 %",
    )
    yield "never a marker", [*odometry, *none, *static], "hold no marker"


def _untold(said: Said) -> Said:
    said[3].transforms[2].transform.rotation.w = math.nan
    return said


def _unstamped(said: Said) -> Said:
    said[3].header.stamp.sec, said[3].header.stamp.nanosec = 0, 0
    return said


def test_bags_that_lack_something_are_one_line(
    tmp_path: Path, drive: Drive, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, said, why in _broken(drive):
        bag = write_bag(tmp_path / name.replace(" ", "_"), said)
        assert_refused(tmp_path, f"{bag} {'--tag-size 0.3' if name.startswith('lens') else ''}", why, capsys)


def test_a_type_that_nobody_defines_is_named(
    tmp_path: Path, drive: Drive, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(
        __import__("bslam.ros2.bag").ros2.bag.DEFINITIONS, "ros2_aruco_interfaces/msg/ArucoMarkers"
    )
    start = replace(drive, log=_beginning(drive.log))
    bag = write_bag(tmp_path / "bag", parts(start.odometry(), start.aruco()), "sqlite3", definitions=False)
    assert_refused(tmp_path, str(bag), "which the bag does not define", capsys)


@pytest.mark.parametrize("plugin", ["mcap", "sqlite3"])
def test_damaged_bags_are_one_line(
    tmp_path: Path, drive: Drive, plugin: str, capsys: pytest.CaptureFixture[str]
) -> None:
    start = replace(drive, log=_beginning(drive.log))
    bag = write_bag(tmp_path / "bag", parts(start.odometry(), start.aruco(), start.static()), plugin)
    (file,) = (one for one in bag.iterdir() if one.suffix != ".yaml")
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    assert_refused(tmp_path, str(bag), "damaged, or no bag of ROS 2", capsys)
    file.write_bytes(b"")
    assert_refused(tmp_path, str(file), "damaged, or no bag of ROS 2", capsys)


def test_a_recording_of_bslam_is_no_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from mcap.writer import Writer as McapWriter

    with (tmp_path / "drive.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="")
        writer.finish()
    assert_refused(tmp_path, str(tmp_path / "drive.mcap"), "bslam export FILE --format csv", capsys)


def test_without_rosbags_the_line_says_how_to_get_it(
    tmp_path: Path, aruco: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "rosbags.rosbag2", None)
    assert_refused(tmp_path, str(aruco), "pip install rosbags", capsys)


def test_out_may_not_be_a_file(tmp_path: Path, aruco: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "log").write_text("")
    assert_refused(tmp_path, str(aruco), "there is a file of that name", capsys)


def test_a_log_is_not_written_into_a_bag(
    tmp_path: Path, aruco: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_refused(tmp_path, f"{aruco} --out {aruco}", "a bag is there; allowed: a folder", capsys)
    assert not (aruco / "robot.toml").exists()


# Of the .msg files in the repositories of the packages, as REP-2011 has a type hashed.
PUBLISHED = {  # christianrauch/apriltag_msgs 84bd66c, NVIDIA-ISAAC-ROS/isaac_ros_common d716470,
    # JMU-ROBOTICS-VIVA/ros2_aruco e7b4fc7, fictionlab/ros_aruco_opencv 3e82a03, pal-robotics/aruco_ros
    # fb95d1e, ros-perception/vision_msgs e77fa2d
    "apriltag_msgs/msg/AprilTagDetectionArray": "6016bfe513a7c741ccbdbc64",
    "isaac_ros_apriltag_interfaces/msg/AprilTagDetectionArray": "45595f343aa66856ae56aee8",
    "ros2_aruco_interfaces/msg/ArucoMarkers": "161456de7e598cd0907347ee",
    "aruco_opencv_msgs/msg/ArucoDetection": "4932ea28a112a7aff8ae8d36",
    "aruco_msgs/msg/MarkerArray": "690e8d9bfc13f5df5e7ac0e7",
    "vision_msgs/msg/Detection3DArray": "793f5eab9595ac1c0da07873",
}  # fmt: skip


@pytest.mark.parametrize(("kind", "published"), PUBLISHED.items())
def test_definitions_here_are_those_of_the_packages(kind: str, published: str) -> None:
    assert STORE.hash_rihs01(kind).startswith(f"RIHS01_{published}")
