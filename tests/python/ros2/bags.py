"""Bags of ROS 2 made of simulated drives, with the writer of rosbags."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from bslam.log import Log, first_steps
from bslam.motion import move_on_arc
from bslam.ros2.definitions import DEFINITIONS
from bslam.ros2.geometry import Camera, Mount, Transform
from bslam.world.simulate import load_scenario, simulate

EPOCH_NS = 1_700_000_000_000_000_000
SIDE_M = 0.3
OPTICAL = "camera_optical_frame"
# Ahead of the robot's middle and to its left, 0.4 m up, turned left and tilted down.
MOUNT = Transform.of_camera(0.12, 0.05, 0.3)
TILT = Transform.of((math.sin(-0.1), 0.0, 0.0, math.cos(-0.1)), np.zeros(3))
CAMERA_POSE = Transform(MOUNT.rotation, np.array([0.12, 0.05, 0.4])).after(TILT)
CAMERA = Camera(400.0, 410.0, 640.0, 360.0, (1280, 720), "plumb_bob", (-0.05, 0.01, 1e-4, -1e-4, 0.0))

STORE = get_typestore(Stores.ROS2_HUMBLE)
for name, text in DEFINITIONS.items():
    STORE.register(get_types_from_msg(text, name))
MADE_UP = "shop_msgs/msg/Thing"
STORE.register(get_types_from_msg("std_msgs/Header header\nint32 number", MADE_UP))


def new(kind: str, **fields: Any) -> Any:
    """A message with these fields; the others are 0, empty, or such messages."""
    filled = {name: fields.pop(name) if name in fields else _zero(what) for name, what in _fields(kind)}
    assert not fields, fields
    return STORE.types[kind](**filled)


def _fields(kind: str) -> list[tuple[str, Any]]:
    return list(STORE.fielddefs[kind][1])


def _zero(what: Any) -> Any:
    node, detail = what
    if node.name == "NAME":
        return new(detail)
    if node.name == "BASE":
        return {"string": "", "bool": False}.get(detail[0], 0.0 if "float" in detail[0] else 0)
    (of, inner), count = detail
    if of.name != "BASE" or inner[0] == "string":
        return []
    return np.zeros(count if node.name == "ARRAY" else 0, dtype=inner[0])


def header(time_ns: int, frame: str = "") -> Any:
    stamp = new("builtin_interfaces/msg/Time", sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    return new("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def quaternion(rotation: np.ndarray) -> Any:
    """Of a rotation whose turn is less than half a circle."""
    w = 0.5 * math.sqrt(max(1e-12, 1.0 + float(np.trace(rotation))))
    x, y, z = (rotation[i, j] - rotation[j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    return new("geometry_msgs/msg/Quaternion", x=x / (4 * w), y=y / (4 * w), z=z / (4 * w), w=w)


def yawed(yaw_rad: float) -> Any:
    return new("geometry_msgs/msg/Quaternion", z=math.sin(0.5 * yaw_rad), w=math.cos(0.5 * yaw_rad))


def point(place: Iterable[float]) -> Any:
    x, y, z = place
    return new("geometry_msgs/msg/Point", x=float(x), y=float(y), z=float(z))


def pose(place: Iterable[float], turn: Any = None) -> Any:
    return new("geometry_msgs/msg/Pose", position=point(place), orientation=turn or yawed(0.0))


def transform(time_ns: int, parent: str, child: str, place: Iterable[float], turn: Any = None) -> Any:
    x, y, z = place
    shift = new("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))
    moved = new("geometry_msgs/msg/Transform", translation=shift, rotation=turn or yawed(0.0))
    kind = "geometry_msgs/msg/TransformStamped"
    return new(kind, header=header(time_ns, parent), child_frame_id=child, transform=moved)


Said = tuple[int, str, str, Any]
"""Time in ns of the recorder, topic, type, message."""


def write_bag(path: Path, said: Iterable[Said], plugin: str = "mcap", definitions: bool = True) -> Path:
    """A bag in the order of time; without definitions: as older recorders wrote them."""
    storage = StoragePlugin.MCAP if plugin == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=9 if definitions else 8, storage_plugin=storage) as writer:
        topics: dict[str, Any] = {}
        for time_ns, topic, kind, message in sorted(said, key=lambda one: one[0]):
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(topics[topic], time_ns, STORE.serialize_cdr(message, kind))
    if plugin != "mcap" and not definitions:
        _forget_definitions(path)
    return path


def _forget_definitions(path: Path) -> None:
    import sqlite3

    (file,) = path.glob("*.db3")
    with sqlite3.connect(file) as base:
        base.execute("delete from message_definitions")
    base.close()


# --- a drive ------------------------------------------------------------------------------------------------


def short_drive(steps: int = 1500) -> Log:
    """The paper's room: wheels that jitter as real ones do, and a sensor where CAMERA_POSE has it."""
    mount, scenario = Mount.of(CAMERA_POSE), load_scenario("paper_room")
    sensor = replace(scenario.sensor, x_m=mount.x_m, y_m=mount.y_m, yaw_rad=mount.yaw_rad)
    return first_steps(simulate(replace(scenario, sensor=sensor), 3, 0.05, "actuation"), steps)


@dataclass
class Drive:
    """Messages of a simulated drive. delay_ns: by which detections reach the recorder after their stamp."""

    log: Log
    delay_ns: int = 60_000_000
    camera_pose: Transform = field(default_factory=lambda: CAMERA_POSE)
    camera: Camera = CAMERA

    def time_ns(self, time_us: int) -> int:
        return EPOCH_NS + int(time_us) * 1000

    def odometry(self) -> Iterator[Said]:
        """Integrated poses with the wheels' speeds, as a base driver tells them; the first at the start."""
        odometry, base_m = self.log.odometry, self.log.robot.wheelbase_m
        at = (1.0, -2.0, 0.5)  # odometry's own origin is of no account
        rows = [(0, 0.0, 0.0), *zip(odometry.time_us.tolist(), odometry.a, odometry.b, strict=True)]
        for time_us, left_m, right_m in rows:
            at = move_on_arc(at, left_m, right_m, base_m)
            said = new("nav_msgs/msg/Odometry", header=header(self.time_ns(time_us), "odom"))
            said.child_frame_id = "base_link"
            said.pose.pose = pose((at[0], at[1], 0.0), yawed(at[2]))
            dt_s = self.log.robot.step_us * 1e-6
            said.twist.twist.linear.x = 0.5 * (left_m + right_m) / dt_s
            said.twist.twist.angular.z = (right_m - left_m) / base_m / dt_s
            yield self.time_ns(time_us), "/odom", "nav_msgs/msg/Odometry", said

    def joints(self, radius_m: float) -> Iterator[Said]:
        odometry = self.log.odometry
        ways = np.cumsum(np.vstack([[0.0, 0.0], np.column_stack([odometry.a, odometry.b])]), axis=0)
        for time_us, (left_m, right_m) in zip([0, *odometry.time_us.tolist()], ways, strict=True):
            names = ["arm_joint", "wheel_right_joint", "wheel_left_joint"]
            angles = np.array([0.3, right_m / radius_m, left_m / radius_m])
            kind = "sensor_msgs/msg/JointState"
            said = new(kind, header=header(self.time_ns(time_us)), name=names, position=angles)
            yield self.time_ns(time_us), "/joint_states", kind, said

    def gyro(self) -> Iterator[Said]:
        """True turn rates, four times a step, of an IMU that lies on its side."""
        truth = self.log.truth
        assert truth is not None
        rates = np.remainder(np.diff(truth.theta_rad) + np.pi, 2 * np.pi) - np.pi
        for time_us, rate in zip(
            truth.time_us[1:].tolist(), rates / self.log.robot.step_us * 1e6, strict=True
        ):
            for part in range(4):
                stamp = self.time_ns(time_us - part * self.log.robot.step_us // 4)
                said = new("sensor_msgs/msg/Imu", header=header(stamp, "imu_link"))
                said.angular_velocity.y = rate
                said.angular_velocity_covariance = np.eye(3).ravel() * 1e-6
                yield stamp, "/imu", "sensor_msgs/msg/Imu", said

    def truth(self) -> Iterator[Said]:
        truth = self.log.truth
        assert truth is not None
        for time_us, x, y, theta in zip(truth.time_us, truth.x_m, truth.y_m, truth.theta_rad, strict=True):
            kind, stamp = "geometry_msgs/msg/PoseStamped", self.time_ns(time_us)
            yield (
                stamp,
                "/mocap",
                kind,
                new(kind, header=header(stamp, "map"), pose=pose((x, y, 0), yawed(theta))),
            )

    def static(self) -> Iterator[Said]:
        """base_footprint over the robot's frame, a mast, the camera on it, and an IMU on its side."""
        mast = Transform(np.eye(3), np.array([0.05, 0.0, 0.2]))
        camera = mast.inverse().after(self.camera_pose)
        imu = Transform.of((math.sin(math.pi / 4), 0.0, 0.0, math.cos(math.pi / 4)), np.zeros(3))
        frames = [
            transform(EPOCH_NS, "base_footprint", "base_link", (0, 0, 0.1)),
            transform(EPOCH_NS, "base_link", "mast", mast.place_m),
            transform(EPOCH_NS, "mast", OPTICAL, camera.place_m, quaternion(camera.rotation)),
            transform(EPOCH_NS, "base_link", "imu_link", (0, 0, 0), quaternion(imu.rotation)),
        ]
        yield (
            EPOCH_NS,
            "/tf_static",
            "tf2_msgs/msg/TFMessage",
            new("tf2_msgs/msg/TFMessage", transforms=frames),
        )

    def camera_info(self) -> Iterator[Said]:
        c, kind = self.camera, "sensor_msgs/msg/CameraInfo"
        k = np.array([c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1.0])
        p = np.array([c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1.0, 0])
        said = new(kind, header=header(EPOCH_NS, OPTICAL), width=c.size_px[0], height=c.size_px[1], k=k, p=p)
        said.distortion_model, said.d = c.model, np.array(c.distortion)
        yield EPOCH_NS, "/camera/camera_info", kind, said

    def frames(self) -> Iterator[tuple[int, list[tuple[int, np.ndarray]]]]:
        """By time in ns: the beacons seen, each with its place in the optical frame, 0.3 m up."""
        seen, mount = self.log.sightings, Mount.of(self.camera_pose)
        back = self.camera_pose.inverse()
        for time_us in np.unique(seen.time_us).tolist():
            rows = np.flatnonzero(seen.time_us == time_us)
            places = []
            for row in rows:
                angle = seen.bearing_rad[row] + mount.yaw_rad
                ground = [mount.x_m, mount.y_m] + seen.range_m[row] * np.array(
                    [math.cos(angle), math.sin(angle)]
                )
                place = back.rotation @ np.array([*ground, 0.3]) + back.place_m
                places.append((int(seen.beacon_id[row]), place))
            yield self.time_ns(time_us), places

    def true_frames(self) -> Iterator[tuple[int, list[tuple[int, np.ndarray]]]]:
        """The same beacons, where they truly are."""
        log, back = self.log, self.camera_pose.inverse()
        assert log.truth is not None and log.beacons is not None
        row_of = {time_us: row for row, time_us in enumerate(log.truth.time_us.tolist())}
        at = {
            i: (x, y) for i, x, y in zip(log.beacons.beacon_id, log.beacons.x_m, log.beacons.y_m, strict=True)
        }
        for time_ns, places in self.frames():
            row = row_of[(time_ns - EPOCH_NS) // 1000]
            theta = log.truth.theta_rad[row]
            c, s, x_m, y_m = math.cos(theta), math.sin(theta), log.truth.x_m[row], log.truth.y_m[row]
            seen = []
            for i, _ in places:
                dx, dy = at[i][0] - x_m, at[i][1] - y_m
                robot = np.array([c * dx + s * dy, c * dy - s * dx, 0.3])
                seen.append((i, back.rotation @ robot + back.place_m))
            yield time_ns, seen

    def aruco(self) -> Iterator[Said]:
        kind = "ros2_aruco_interfaces/msg/ArucoMarkers"
        for stamp, places in self.frames():
            ids, poses = np.array([i for i, _ in places]), [pose(place) for _, place in places]
            said = new(kind, header=header(stamp, OPTICAL), marker_ids=ids, poses=poses)
            yield stamp + self.delay_ns, "/aruco_markers", kind, said

    def detections_3d(self) -> Iterator[Said]:
        kind = "vision_msgs/msg/Detection3DArray"
        for stamp, places in self.frames():
            found = []
            for i, place in places:
                hypothesis = new("vision_msgs/msg/ObjectHypothesis", class_id=str(i), score=0.9)
                at = new("geometry_msgs/msg/PoseWithCovariance", pose=pose(place))
                result = new("vision_msgs/msg/ObjectHypothesisWithPose", hypothesis=hypothesis, pose=at)
                found.append(new("vision_msgs/msg/Detection3D", results=[result]))
            yield stamp, "/detections", kind, new(kind, header=header(stamp, OPTICAL), detections=found)

    def opencv(self) -> Iterator[Said]:
        kind = "aruco_opencv_msgs/msg/ArucoDetection"
        for stamp, places in self.frames():
            found = [new("aruco_opencv_msgs/msg/MarkerPose", marker_id=i, pose=pose(at)) for i, at in places]
            yield stamp, "/aruco_detections", kind, new(kind, header=header(stamp, OPTICAL), markers=found)

    def tag_frames(self) -> Iterator[Said]:
        kind = "tf2_msgs/msg/TFMessage"
        for stamp, places in self.frames():
            for i, place in places:  # a message each, as apriltag_ros sends them
                said = new(kind, transforms=[transform(stamp, OPTICAL, f"tag36h11:{i}", place)])
                yield stamp, "/tf", kind, said

    def apriltags(self, pixel_sd: float = 0.2) -> Iterator[Said]:
        """Corners of upright tags that face the camera more or less; no noise but that of corners."""
        random = np.random.default_rng(8)
        kind = "apriltag_msgs/msg/AprilTagDetectionArray"
        square = SIDE_M * np.array([[-0.5, 0.5, 0], [0.5, 0.5, 0], [0.5, -0.5, 0], [-0.5, -0.5, 0]])
        for stamp, places in self.true_frames():
            tags = []
            for i, place in places:
                yaw = math.atan2(place[0], place[2]) + random.uniform(-0.7, 0.7)
                turn = Transform.of((0.0, math.sin(yaw / 2), 0.0, math.cos(yaw / 2)), place)
                corners = square @ turn.rotation.T + place
                if (corners[:, 2] < np.abs(corners[:, :2]).max(axis=1) / 1.5).any():
                    continue  # beside or behind a camera that sees less than the simulated sensor
                px = self.camera.project(corners) + pixel_sd * random.standard_normal((4, 2))
                points = [new("apriltag_msgs/msg/Point", x=x, y=y) for x, y in px]
                tag = new("apriltag_msgs/msg/AprilTagDetection", family="tag36h11", id=i, corners=points)
                tags.append(tag)
            said = new(kind, header=header(stamp, OPTICAL), detections=tags)
            yield stamp + self.delay_ns, "/apriltag/detections", kind, said


def parts(*ones: Iterable[Said]) -> Sequence[Said]:
    return [one for part in ones for one in part]
