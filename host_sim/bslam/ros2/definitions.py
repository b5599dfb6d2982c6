"""Definitions of the marker messages that ROS 2 itself does not bring.

Bags in mcap, and those of sqlite3 since ROS 2 Iron, carry their definitions; in older ones these stand in.
The fields are facts of the packages named; comments and constants are left out.
"""

from typing import Final

DEFINITIONS: Final = {
    "apriltag_msgs/msg/Point": "float64 x\nfloat64 y",
    "apriltag_msgs/msg/AprilTagDetection": (
        "string family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\n"
        "apriltag_msgs/Point centre\napriltag_msgs/Point[4] corners\nfloat64[9] homography"
    ),
    "apriltag_msgs/msg/AprilTagDetectionArray": (
        "std_msgs/Header header\napriltag_msgs/AprilTagDetection[] detections"
    ),
    "ros2_aruco_interfaces/msg/ArucoMarkers": (
        "std_msgs/Header header\nint64[] marker_ids\ngeometry_msgs/Pose[] poses"
    ),
    "aruco_interfaces/msg/ArucoMarkers": (
        "std_msgs/Header header\nint64[] marker_ids\ngeometry_msgs/Pose[] poses"
    ),
    "aruco_opencv_msgs/msg/MarkerPose": "uint16 marker_id\ngeometry_msgs/Pose pose",
    "aruco_opencv_msgs/msg/BoardPose": "string board_name\ngeometry_msgs/Pose pose",
    "aruco_opencv_msgs/msg/ArucoDetection": (
        "std_msgs/Header header\naruco_opencv_msgs/MarkerPose[] markers\naruco_opencv_msgs/BoardPose[] boards"
    ),
    "aruco_msgs/msg/Marker": (
        "std_msgs/Header header\nuint32 id\ngeometry_msgs/PoseWithCovariance pose\nfloat64 confidence"
    ),
    "aruco_msgs/msg/MarkerArray": "std_msgs/Header header\naruco_msgs/Marker[] markers",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score",
    "vision_msgs/msg/ObjectHypothesisWithPose": (
        "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose"
    ),
    "vision_msgs/msg/BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size",
    "vision_msgs/msg/Detection3D": (
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
        "vision_msgs/BoundingBox3D bbox\nstring id"
    ),
    "vision_msgs/msg/Detection3DArray": "std_msgs/Header header\nvision_msgs/Detection3D[] detections",
    "isaac_ros_apriltag_interfaces/msg/AprilTagDetection": (
        "string family\nint32 id\ngeometry_msgs/Point center\n"
        "geometry_msgs/Point[4] corners\ngeometry_msgs/PoseWithCovarianceStamped pose"
    ),
    "isaac_ros_apriltag_interfaces/msg/AprilTagDetectionArray": (
        "std_msgs/Header header\nisaac_ros_apriltag_interfaces/AprilTagDetection[] detections"
    ),
}
"""By full name the lines of a .msg file."""
