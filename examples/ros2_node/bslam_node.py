"""A node of ROS 2 around bslam: odometry and markers in; pose, map -> odom and the map out (README.md)."""

import math

import numpy as np
import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosidl_runtime_py.utilities import get_message
from sensor_msgs.msg import CameraInfo
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from bslam import BslamError, Slam
from bslam.ros2.geometry import base_on, ellipse_95, frame_over, pose_in, pose_of_part
from bslam.ros2.messages import CORNERS, ODOMETRY, frames_of, poses_of, transforms_of, usable_camera
from bslam.ros2.sightings import Markers
from bslam.ros2.tags import TagSizes
from bslam.ros2.wheels import wheels_between

PARAMETERS = {
    "odometry": "/odom",
    "detections": "/apriltag/detections",
    "detections_type": "apriltag_msgs/msg/AprilTagDetectionArray",
    "camera_info": "/camera/camera_info",
    "rectified": True,  # the detector reads image_rect, as apriltag_ros does
    "tag_size_m": 0.16,
    "base_frame": "base_link",
    "wheelbase_m": 0.3,
    "wheel_speed_sd_mps": 0.05,
    "bearing_sd_rad": 0.02,
    "range_sd_fraction": 0.03,
}
FRAMES_PER_MAP = 10
WAITING_MAX = 300  # frames


class BslamNode(Node):
    """One robot; every pose it publishes is stamped as the odometry it came from."""

    def __init__(self) -> None:
        super().__init__("bslam")
        self.p = p = {name: self.declare_parameter(name, value).value for name, value in PARAMETERS.items()}
        speeds = dict.fromkeys(("left_speed_sd_mps", "right_speed_sd_mps"), p["wheel_speed_sd_mps"])
        sensor = {name: p[name] for name in ("wheelbase_m", "bearing_sd_rad", "range_sd_fraction")}
        self.slam = Slam({**sensor, **speeds}, beacons_max=80)
        self.tree, self.camera, self.last, self.waiting, self.frames = {}, None, None, [], 0
        self.words: dict[str, int] = {}  # labels of identities
        self.pose_out = self.create_publisher(PoseWithCovarianceStamped, "~/pose", 10)
        self.map_out = self.create_publisher(MarkerArray, "~/map", 10)
        self.tf_out = self.create_publisher(TFMessage, "/tf", 100)
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(TFMessage, "/tf_static", self.on_static, latched)
        sensors, kind = qos_profile_sensor_data, get_message(p["detections_type"])
        if p["detections_type"] in CORNERS:
            self.create_subscription(CameraInfo, p["camera_info"], self.on_camera, sensors)
        self.create_subscription(Odometry, p["odometry"], self.on_odometry, sensors)
        self.create_subscription(kind, p["detections"], self.on_detections, sensors)

    def on_static(self, message) -> None:
        self.tree |= {child: (parent, pose) for parent, child, pose in transforms_of(message)}

    def on_camera(self, message) -> None:
        try:
            self.camera = usable_camera(message, self.p["camera_info"], self.p["rectified"])
        except BslamError as refusal:
            self.get_logger().warning(str(refusal), throttle_duration_sec=5.0)

    def on_detections(self, message) -> None:
        try:
            self.waiting += frames_of(self.p["detections_type"], message)  # until odometry covers them
            if len(self.waiting) > WAITING_MAX:
                del self.waiting[:-WAITING_MAX]
                raise BslamError(f"{self.p['odometry']}: silent for {WAITING_MAX} frames; the rest is lost")
        except BslamError as refusal:
            self.get_logger().warning(str(refusal), throttle_duration_sec=5.0)

    def on_odometry(self, message) -> None:
        (pose,) = poses_of(ODOMETRY, message)
        now_us = pose.time_ns // 1000
        try:
            base = base_on(self.tree, message.child_frame_id, self.p["base_frame"])
            at = pose_of_part((pose.x_m, pose.y_m, pose.theta_rad), base)
            if not np.isfinite(at).all():
                raise BslamError("odometry left out: its pose is not finite")
            if self.last is None:
                self.slam.sightings(now_us, [], [], [], [])  # an empty frame starts the clock
            else:
                left_m, right_m, doubt = wheels_between(self.last, (now_us, at), self.p["wheelbase_m"])
                if doubt is not None:  # after a pause, or where odometry was set anew, its way is unknown
                    self.slam.resume_odometry(*doubt)
                self.slam.odometry("wheels", now_us, left_m, right_m)
        except BslamError as refusal:  # a stamp that runs back, say: the next message covers this one's way
            self.get_logger().warning(str(refusal), throttle_duration_sec=5.0)
            return
        self.last = now_us, at
        self.waiting.sort(key=lambda frame: frame.time_ns)
        while self.waiting and self.waiting[0].time_ns // 1000 <= now_us:
            self.see(self.waiting.pop(0), message.header.stamp)
        self.publish(message.header, at)

    def see(self, frame, stamp) -> None:
        pose = pose_in(self.tree, self.p["base_frame"], frame.frame_id)
        try:
            if pose is None or (self.camera is None and self.p["detections_type"] in CORNERS):
                missing = "camera_info that can be used" if pose else f"way to {frame.frame_id} in /tf_static"
                raise BslamError(f"frame left out: no {missing} yet")
            markers = Markers({frame.frame_id: pose}, TagSizes({}, self.p["tag_size_m"]), self.camera, 0.5)
            self.slam.sightings(frame.time_ns // 1000, **markers.columns(frame, self.words))
        except BslamError as refusal:
            self.get_logger().warning(str(refusal), throttle_duration_sec=5.0)
        if self.frames % FRAMES_PER_MAP == 0:
            ellipses = [self.ellipse(one, stamp) for one in self.slam.beacons()]
            self.map_out.publish(MarkerArray(markers=[Marker(action=Marker.DELETEALL), *ellipses]))
        self.frames += 1

    def publish(self, header, odometry: tuple) -> None:
        x_m, y_m, theta_rad = self.slam.pose()
        out = PoseWithCovarianceStamped()
        out.header.stamp, out.header.frame_id = header.stamp, "map"
        _place(out.pose.pose.position, out.pose.pose.orientation, x_m, y_m, theta_rad)
        covariance = np.zeros((6, 6))
        covariance[np.ix_([0, 1, 5], [0, 1, 5])] = self.slam.pose_covariance()
        out.pose.covariance = covariance.ravel()
        self.pose_out.publish(out)
        tf = TransformStamped(header=out.header, child_frame_id=header.frame_id)
        _place(tf.transform.translation, tf.transform.rotation, *frame_over((x_m, y_m, theta_rad), odometry))
        self.tf_out.publish(TFMessage(transforms=[tf]))

    def ellipse(self, beacon, stamp) -> Marker:
        """A flat cylinder that holds the beacon with 95 %."""
        marker = Marker(ns="bslam", id=int(beacon.uid % 2**31), type=Marker.CYLINDER, action=Marker.ADD)
        marker.header.stamp, marker.header.frame_id = stamp, "map"
        long_m, short_m, yaw_rad = ellipse_95(beacon.covariance_m2)
        _place(marker.pose.position, marker.pose.orientation, beacon.x_m, beacon.y_m, yaw_rad)
        marker.scale.x, marker.scale.y, marker.scale.z = max(long_m, 0.01), max(short_m, 0.01), 0.02
        marker.color.g, marker.color.a = (1.0 if beacon.confirmed else 0.4), 0.7
        return marker


def _place(position, orientation, x_m: float, y_m: float, theta_rad: float) -> None:
    position.x, position.y = float(x_m), float(y_m)
    orientation.z, orientation.w = math.sin(0.5 * theta_rad), math.cos(0.5 * theta_rad)


if __name__ == "__main__":
    rclpy.init()
    rclpy.spin(BslamNode())
