"""The node of examples/ros2_node, driven with a stub of rclpy and messages of rosbags."""

import math
import runpy
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bslam.motion import move_on_arc
from bslam.ros2.geometry import Transform, pose_of_part
from ros2.bags import EPOCH_NS, SIDE_M, STORE, Drive, Said, new, parts

NODE = Path(__file__).parents[3] / "examples" / "ros2_node" / "bslam_node.py"
LINES_MAX = 150
ARUCO = {"detections": "/aruco_markers", "detections_type": "ros2_aruco_interfaces/msg/ArucoMarkers"}


@dataclass
class Bus:
    """Who listens to which topic, what was published there, and what the node warned of."""

    listeners: dict[str, tuple[str, Any]] = field(default_factory=dict)
    published: dict[str, list[Any]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    parameters: dict[str, Any] = field(default_factory=dict)

    def send(self, said: Said) -> None:
        _, topic, kind, message = said
        if topic in self.listeners:
            assert self.listeners[topic][0] == kind
            self.listeners[topic][1](message)


def kind(package: str, name: str) -> Any:
    """A message class as rclpy has it: all fields may be left out."""

    def make(**fields: Any) -> Any:
        return new(f"{package}/msg/{name}", **fields)

    make.full_name = f"{package}/msg/{name}"  # type: ignore[attr-defined]
    if name == "Marker":
        make.CYLINDER, make.ADD, make.DELETEALL = 3, 0, 3  # type: ignore[attr-defined]
    return make


@pytest.fixture
def bus(monkeypatch: pytest.MonkeyPatch) -> Bus:
    bus = Bus()

    class Node:
        def __init__(self, name: str) -> None:
            self.name = name

        def declare_parameter(self, name: str, value: Any) -> Any:
            return SimpleNamespace(value=bus.parameters.get(name, value))

        def create_subscription(self, of: Any, topic: str, callback: Any, qos: Any) -> None:
            bus.listeners[topic] = (of.full_name, callback)

        def create_publisher(self, of: Any, topic: str, qos: Any) -> Any:
            sent = bus.published.setdefault(topic, [])
            return SimpleNamespace(publish=lambda message: sent.append(checked(of.full_name, message)))

        def get_logger(self) -> Any:
            return SimpleNamespace(warning=lambda text, **more: bus.warnings.append(text))

    qos = {"DurabilityPolicy": SimpleNamespace(TRANSIENT_LOCAL=1), "QoSProfile": SimpleNamespace}
    modules: dict[str, dict[str, Any]] = {
        "rclpy": {},
        "rclpy.node": {"Node": Node},
        "rclpy.qos": {**qos, "qos_profile_sensor_data": 10},
        "rosidl_runtime_py": {},
        "rosidl_runtime_py.utilities": {"get_message": lambda name: kind(*name.split("/msg/"))},
    }
    for package, names in {
        "geometry_msgs": ("PoseWithCovarianceStamped", "TransformStamped"),
        "nav_msgs": ("Odometry",),
        "sensor_msgs": ("CameraInfo",),
        "tf2_msgs": ("TFMessage",),
        "visualization_msgs": ("Marker", "MarkerArray"),
    }.items():
        modules |= {package: {}, f"{package}.msg": {name: kind(package, name) for name in names}}
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    return bus


def checked(name: str, message: Any) -> Any:
    """The message, as it comes over the wire: fields of another type than its own do not."""
    return STORE.deserialize_cdr(STORE.serialize_cdr(message, name), name)


def drive_node(bus: Bus, said: Sequence[Said], **parameters: Any) -> Any:
    bus.parameters = {"wheelbase_m": 0.4, **parameters}
    node = runpy.run_path(str(NODE))["BslamNode"]()
    for one in sorted(said, key=lambda one: one[0]):
        bus.send(one)
    return node


def pose_errors_m(bus: Bus, drive: Drive) -> np.ndarray:
    truth = drive.log.truth
    assert truth is not None
    at = {EPOCH_NS + time_us * 1000: row for row, time_us in enumerate(truth.time_us.tolist())}
    poses = [(one.header.stamp, one.pose.pose.position) for one in bus.published["~/pose"]]
    rows = [at[stamp.sec * 10**9 + stamp.nanosec] for stamp, _ in poses]
    return np.hypot(*np.array([(p.x - truth.x_m[i], p.y - truth.y_m[i]) for (_, p), i in zip(poses, rows)]).T)  # noqa: B905


def test_it_follows_the_robot_by_tags_that_arrive_late(bus: Bus, drive: Drive) -> None:
    said = parts(drive.static(), drive.camera_info(), drive.odometry(), drive.apriltags())
    drive_node(bus, [one for one in said if one[0] <= EPOCH_NS + 10**10], tag_size_m=SIDE_M, rectified=False)
    assert bus.warnings == []
    errors_m = pose_errors_m(bus, drive)
    assert len(errors_m) == 251
    assert errors_m.mean() < 0.1
    covariance = np.array(bus.published["~/pose"][-1].pose.covariance).reshape(6, 6)
    assert (np.linalg.eigvalsh(covariance[np.ix_([0, 1, 5], [0, 1, 5])]) > 0.0).all()
    assert covariance[2:5].any() == covariance[:, 2:5].any() == False  # noqa: E712


def test_map_and_transform_agree_with_the_pose(bus: Bus, drive: Drive) -> None:
    said = parts(drive.static(), drive.odometry(), drive.aruco())
    drive_node(bus, list(said), **ARUCO)
    assert bus.warnings == []
    assert pose_errors_m(bus, drive).mean() < 0.15
    (over,) = bus.published["/tf"][-1].transforms
    assert (over.header.frame_id, over.child_frame_id) == ("map", "odom")
    turn = 2.0 * math.atan2(over.transform.rotation.z, over.transform.rotation.w)
    *_, (_, _, _, odometry) = drive.odometry()
    x_m, y_m = odometry.pose.pose.position.x, odometry.pose.pose.position.y
    shift, pose = over.transform.translation, bus.published["~/pose"][-1].pose.pose.position
    assert pose.x == pytest.approx(shift.x + math.cos(turn) * x_m - math.sin(turn) * y_m)
    assert pose.y == pytest.approx(shift.y + math.sin(turn) * x_m + math.cos(turn) * y_m)
    (clear, *markers), beacons = bus.published["~/map"][-1].markers, drive.log.beacons
    assert clear.action == clear.DELETEALL  # or a beacon that the filter drops would stay
    assert beacons is not None and len(markers) == 6
    for one in markers:
        off_m = np.hypot(beacons.x_m - one.pose.position.x, beacons.y_m - one.pose.position.y).min()
        assert off_m < 0.3
        assert 0.0 < one.scale.y <= one.scale.x < 1.0


def test_odometry_that_is_set_anew_moves_nothing(bus: Bus, drive: Drive) -> None:
    odometry = list(drive.odometry())[:100]
    for _, _, _, message in odometry[50:]:
        position = message.pose.pose.position
        position.x, position.y = position.x + 30.0, position.y - 40.0
    drive_node(bus, odometry)
    places = np.array([(p.x, p.y) for p in (one.pose.pose.position for one in bus.published["~/pose"])])
    assert np.hypot(*np.diff(places, axis=0).T).max() < 0.1
    at, direct = (0.0, 0.0, 0.0), drive.log.odometry
    for left_m, right_m in zip(direct.a[:99], direct.b[:99], strict=True):
        at = move_on_arc(at, left_m, right_m, 0.4)
    assert np.hypot(*(places[-1] - at[:2])) < 0.1


def test_a_pause_of_odometry_makes_the_pose_doubtful_and_silences_nothing(bus: Bus, drive: Drive) -> None:
    """It drove on meanwhile, 2 m; the frames of the pause are of no use."""
    odometry = list(drive.odometry())
    heard = [*odometry[:200], *odometry[350:]]
    drive_node(bus, parts(drive.static(), heard, drive.aruco()), **ARUCO)
    assert len(bus.published["~/pose"]) == len(heard)
    assert bus.warnings and all(one.startswith("frame at") for one in bus.warnings)
    sds_m = [math.sqrt(one.pose.covariance[0]) for one in bus.published["~/pose"]]
    errors_m = pose_errors_m(bus, drive)
    assert errors_m[200] < 2.0 * sds_m[200] and sds_m[200] > 10.0 * sds_m[199]
    assert errors_m[-50:].mean() < 0.1


def test_frames_that_no_odometry_covers_are_not_kept_for_ever(bus: Bus, drive: Drive) -> None:
    node = drive_node(bus, parts(drive.static(), drive.aruco()), **ARUCO)
    assert len(list(drive.aruco())) > 300 == len(node.waiting)
    assert set(bus.warnings) == {"/odom: silent for 300 frames; the rest is lost"}


@pytest.mark.parametrize(("model", "focal_px", "said"), [("equidistant", 400.0, "model"), ("", 0.0, "calib")])
def test_a_camera_that_makes_no_places_of_corners_is_said(
    bus: Bus, drive: Drive, model: str, focal_px: float, said: str
) -> None:
    lens = replace(drive, camera=replace(drive.camera, model=model, fx=focal_px, fy=focal_px))
    messages = parts(drive.static(), lens.camera_info(), list(drive.odometry())[:60], drive.apriltags())
    node = drive_node(bus, messages, tag_size_m=SIDE_M, rectified=False)
    assert said in bus.warnings[0] and "no camera_info that can be used" in bus.warnings[1]
    assert not node.slam.beacons()


def test_what_is_missing_is_said(bus: Bus, drive: Drive) -> None:
    odometry = list(drive.odometry())[:60]
    drive_node(bus, [*odometry, *list(drive.apriltags())[:20]])
    assert any("no way to camera_optical_frame in /tf_static" in one for one in bus.warnings)
    assert len(bus.published["~/pose"]) == 60
    bus.warnings.clear()
    drive_node(bus, [*drive.static(), *odometry, odometry[30], *list(drive.apriltags())[:20]])
    assert any("no camera_info" in one for one in bus.warnings)
    assert any("BSLAM_E_TIME" in one for one in bus.warnings)


def test_labels_are_of_whole_identities_and_none_is_none(bus: Bus, drive: Drive) -> None:
    """The tags of two families with one number are two beacons; those that nobody knows are not beacon 0."""

    def change(message: Any) -> None:
        for one in message.detections:
            hypothesis = one.results[0].hypothesis
            number = int(hypothesis.class_id)
            hypothesis.class_id = ("exit", "a:1", "b:1", "-1", "", "1")[number]

    names = {"detections": "/detections", "detections_type": "vision_msgs/msg/Detection3DArray"}
    node = drive_node(
        bus, parts(drive.static(), drive.odometry(), changed(drive.detections_3d(), change)), **names
    )
    assert sorted(node.words) == ["1", "a:1", "b:1", "exit"]
    assert sorted(node.words.values()) == [0, 1, 2, 3]
    assert {one.label for one in node.slam.beacons()} == {0, 1, 2, 3}


def changed(said: Iterable[Said], change: Callable[[Any], None]) -> list[Said]:
    listed = list(said)
    for one in listed:
        change(one[3])
    return listed


def test_what_is_broken_is_said_and_left_out(bus: Bus, drive: Drive) -> None:
    odometry, aruco = list(drive.odometry())[:60], list(drive.aruco())[:10]
    aruco[0][3].poses.pop()
    for one in (odometry[0], odometry[20]):
        one[3].pose.pose.orientation.z = math.nan
    drive_node(bus, [*drive.static(), *odometry, *aruco], **ARUCO)
    assert sum("marker_ids and" in one for one in bus.warnings) == 1
    assert sum("its pose is not finite" in one for one in bus.warnings) == 2
    assert len(bus.published["~/pose"]) == 58


def test_odometry_of_another_frame_is_that_of_the_base(bus: Bus, drive: Drive) -> None:
    """Of the mast, ahead of base_link and to its left: the base is where base_link is."""
    odometry, mast = list(drive.odometry())[:60], Transform(np.eye(3), np.array([0.05, 0.0, 0.2]))
    drive_node(bus, [*drive.static(), *odometry])
    plain = [(one.pose.pose.position.x, one.pose.pose.position.y) for one in bus.published.pop("~/pose")]
    for _, _, _, message in odometry:
        at, turn = message.pose.pose.position, message.pose.pose.orientation
        at.x, at.y, _ = pose_of_part((at.x, at.y, 2.0 * math.atan2(turn.z, turn.w)), mast)
        message.child_frame_id = "mast"
    drive_node(bus, [*drive.static(), *odometry])
    places = [(one.pose.pose.position.x, one.pose.pose.position.y) for one in bus.published["~/pose"]]
    np.testing.assert_allclose(places, plain, atol=1e-5)
    assert bus.warnings == []
    drive_node(bus, odometry)
    assert "no way from mast, the odometry's frame, to base_link" in bus.warnings[0]


def test_it_is_short() -> None:
    assert len(NODE.read_text().splitlines()) <= LINES_MAX
