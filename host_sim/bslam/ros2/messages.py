"""What messages of ROS 2 say, as plain numbers. Times are nanoseconds of the header, lengths metres.

Works on any object with the message's fields: those of rclpy, of rosbags, or a test's own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.ros2.geometry import DISTORTIONS, Camera, Transform, yaw_of

Floats = NDArray[np.float64]

TF: Final = "tf2_msgs/msg/TFMessage"
ODOMETRY: Final = "nav_msgs/msg/Odometry"
JOINTS: Final = "sensor_msgs/msg/JointState"
IMU: Final = "sensor_msgs/msg/Imu"
CAMERA_INFO: Final = "sensor_msgs/msg/CameraInfo"
TAG_FRAME: Final = re.compile(r".*:\d+")
"""Frames in /tf that are tags, as apriltag_ros names them: tag36h11:5."""


@dataclass(frozen=True)
class Detection:
    """One marker as a detector tells it: by its place, else by its corners in the image."""

    identity: str  # the number of the marker, with its family before a colon if there is one; "": none
    position_m: Floats | None = None  # (3,) in the frame of the message
    covariance_m2: Floats | None = None  # (3, 3) of it; None: the detector does not say
    corners_px: Floats | None = None  # (4, 2) x right, y down


@dataclass(frozen=True)
class Frame:
    """The markers of one image."""

    time_ns: int
    frame_id: str  # of the camera
    detections: tuple[Detection, ...]


@dataclass(frozen=True)
class PlanarPose:
    """Where something stands on the ground."""

    time_ns: int
    x_m: float
    y_m: float
    theta_rad: float


def time_ns(header: Any) -> int:
    """The stamp of a std_msgs/Header."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


# --- detections ---------------------------------------------------------------------------------------------


def frames_of(kind: str, message: Any) -> list[Frame]:
    """The frames in a message of a kind of DETECTIONS: one, or as many stamps as a TFMessage has tags of."""
    return list(DETECTIONS[kind](message))


def _one_frame(header: Any, detections: Iterator[Detection]) -> Frame:
    return Frame(time_ns(header), header.frame_id, tuple(detections))


def _apriltags(message: Any) -> Iterator[Frame]:
    def one(tag: Any) -> Detection:
        return Detection(f"{tag.family}:{tag.id}", corners_px=_corners_px(tag.corners))

    yield _one_frame(message.header, map(one, message.detections))


def _corners_px(corners: Any) -> Floats:
    """(4, 2), of four points, or of eight numbers as older definitions have it."""
    flat = [(one.x, one.y) if hasattr(one, "x") else one for one in corners]
    return np.array(flat, dtype=np.float64).reshape(4, 2)


def _isaac_apriltags(message: Any) -> Iterator[Frame]:
    def one(tag: Any) -> Detection:
        return _of_pose(f"{tag.family}:{tag.id}", tag.pose.pose)

    yield _one_frame(message.header, map(one, message.detections))


def _aruco_markers(message: Any) -> Iterator[Frame]:
    count = len(message.marker_ids), len(message.poses)
    if count[0] != count[1]:
        raise BslamError(f"{count[0]} marker_ids and {count[1]} poses; allowed: as many of each")
    pairs = zip(message.marker_ids, message.poses, strict=True)
    yield _one_frame(message.header, (Detection(str(int(i)), _xyz(pose.position)) for i, pose in pairs))


def _aruco_opencv(message: Any) -> Iterator[Frame]:
    def one(marker: Any) -> Detection:
        return Detection(str(marker.marker_id), _xyz(marker.pose.position))

    yield _one_frame(message.header, map(one, message.markers))


def _aruco_ros(message: Any) -> Iterator[Frame]:
    yield _one_frame(message.header, (_of_pose(str(one.id), one.pose) for one in message.markers))


def _detections_3d(message: Any) -> Iterator[Frame]:
    def one(found: Any) -> Detection:
        best = max(found.results, key=lambda result: _hypothesis(result).score, default=None)
        identity = getattr(found, "id", "") or getattr(found, "tracking_id", "")
        if best is None:
            return Detection(identity, _xyz(found.bbox.center.position))
        hypothesis = _hypothesis(best)
        named = getattr(hypothesis, "class_id", None)
        return _of_pose(identity or str(hypothesis.id if named is None else named), best.pose)

    yield _one_frame(message.header, map(one, message.detections))


def _hypothesis(result: Any) -> Any:
    """Class and score; in definitions before ROS 2 Galactic they stand in the result itself."""
    return getattr(result, "hypothesis", result)


def _tag_transforms(message: Any) -> Iterator[Frame]:
    tags = [one for one in message.transforms if TAG_FRAME.fullmatch(one.child_frame_id)]
    images = {(time_ns(one.header), one.header.frame_id) for one in tags}
    for stamp, frame_id in sorted(images):
        ours = [one for one in tags if (time_ns(one.header), one.header.frame_id) == (stamp, frame_id)]
        places = (Detection(one.child_frame_id, _xyz(one.transform.translation)) for one in ours)
        yield Frame(stamp, frame_id, tuple(places))


def _of_pose(identity: str, pose: Any) -> Detection:
    """Of a PoseWithCovariance; a covariance of zeros: none is told."""
    covariance = np.asarray(pose.covariance, dtype=np.float64).reshape(6, 6)[:3, :3]
    told = covariance if np.isfinite(covariance).all() and (np.diag(covariance) > 0.0).all() else None
    return Detection(identity, _xyz(pose.pose.position), told)


def _xyz(point: Any) -> Floats:
    return np.array([point.x, point.y, point.z], dtype=np.float64)


DETECTIONS: Final[dict[str, Callable[[Any], Iterator[Frame]]]] = {
    "apriltag_msgs/msg/AprilTagDetectionArray": _apriltags,
    "isaac_ros_apriltag_interfaces/msg/AprilTagDetectionArray": _isaac_apriltags,
    "ros2_aruco_interfaces/msg/ArucoMarkers": _aruco_markers,
    "aruco_interfaces/msg/ArucoMarkers": _aruco_markers,
    "aruco_opencv_msgs/msg/ArucoDetection": _aruco_opencv,
    "aruco_msgs/msg/MarkerArray": _aruco_ros,
    "vision_msgs/msg/Detection3DArray": _detections_3d,
    TF: _tag_transforms,
}
"""Messages that hold markers, and how each is read."""
CORNERS: Final = frozenset({"apriltag_msgs/msg/AprilTagDetectionArray"})
"""Those that tell corners in the image, not places: camera and side of the tag make a place of them."""


# --- poses, frames, wheels, gyro ----------------------------------------------------------------------------


def poses_of(kind: str, message: Any, frame: str = "") -> list[PlanarPose]:
    """Poses in a message of a kind of POSES; of a TFMessage those of the child frame `frame`."""
    return list(POSES[kind](message, frame))


def _odometry_pose(message: Any, _: str) -> Iterator[PlanarPose]:
    yield _planar(message.header, message.pose.pose.position, message.pose.pose.orientation)


def _stamped_pose(message: Any, _: str) -> Iterator[PlanarPose]:
    pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    yield _planar(message.header, pose.position, pose.orientation)


def _transform_pose(message: Any, frame: str) -> Iterator[PlanarPose]:
    for one in message.transforms if hasattr(message, "transforms") else [message]:
        if not frame or one.child_frame_id == frame:
            yield _planar(one.header, one.transform.translation, one.transform.rotation)


def _planar(header: Any, position: Any, orientation: Any) -> PlanarPose:
    return PlanarPose(time_ns(header), float(position.x), float(position.y), yaw_of(_quaternion(orientation)))


def _quaternion(q: Any) -> tuple[float, float, float, float]:
    return float(q.x), float(q.y), float(q.z), float(q.w)


POSES: Final[dict[str, Callable[[Any, str], Iterator[PlanarPose]]]] = {
    ODOMETRY: _odometry_pose,
    "geometry_msgs/msg/PoseStamped": _stamped_pose,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _stamped_pose,
    "geometry_msgs/msg/TransformStamped": _transform_pose,
    TF: _transform_pose,
}
"""Messages that hold poses, and how each is read."""


def twist_of(message: Any) -> tuple[float, float, float]:
    """Speed ahead and to the left, m/s, and turn rate, rad/s, of an Odometry, in its child frame."""
    speed = message.twist.twist.linear
    return float(speed.x), float(speed.y), float(message.twist.twist.angular.z)


def transforms_of(message: Any) -> Iterator[tuple[str, str, Transform]]:
    """Parent, child, and the child's pose in the parent, of a TFMessage."""
    for one in message.transforms:
        turn, place = _quaternion(one.transform.rotation), _xyz(one.transform.translation)
        yield one.header.frame_id, one.child_frame_id, Transform.of(turn, place)


def camera_of(message: Any, rectified: bool) -> Camera:
    """The camera of a CameraInfo; `rectified`: of the rectified image, P without distortion, else K and D."""
    fields = (getattr(message, name, None) for name in ("k", "d", "p"))
    k, d, p = (np.asarray(one, dtype=np.float64) for one in fields)
    size = (int(message.width), int(message.height))
    if rectified:
        p = p.reshape(3, 4)
        return Camera(p[0, 0], p[1, 1], p[0, 2], p[1, 2], size, "", ())
    k = k.reshape(3, 3)
    return Camera(k[0, 0], k[1, 1], k[0, 2], k[1, 2], size, message.distortion_model, tuple(d.tolist()))


def usable_camera(message: Any, topic: str, rectified: bool | None) -> Camera:
    """The same, to turn corners into places; None: nobody says what they are of. Raises BslamError where that
    cannot be done.
    """
    camera = camera_of(message, bool(rectified))
    if not (camera.fx > 0.0 and camera.fy > 0.0):
        raise BslamError(f"{topic}: focal lengths {camera.fx:g}, {camera.fy:g}; allowed: a calibrated camera")
    if camera.is_distorted and rectified is None:
        raise BslamError(
            f"{topic}: the camera distorts; allowed: --image rectified, if the detector read image_rect "
            "(apriltag_ros does), or --image raw"
        )
    if camera.is_distorted and camera.model not in DISTORTIONS:
        raise BslamError(
            f"{topic}: distortion model {camera.model!r}; allowed: {', '.join(DISTORTIONS[1:])}, or a "
            "detector on the rectified image, told so"
        )
    return camera


def turn_rate_of(message: Any) -> tuple[str, Floats, float]:
    """Frame, angular velocity (3,) in it, rad/s, and its sd (0: not told), of an Imu."""
    variance = float(message.angular_velocity_covariance[8])
    return message.header.frame_id, _xyz(message.angular_velocity), max(variance, 0.0) ** 0.5
