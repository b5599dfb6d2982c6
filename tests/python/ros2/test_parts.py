"""Geometry, stamps, wheels, messages and tables that a bag is read with, each alone."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bslam.errors import BslamError
from bslam.motion import move_on_arc
from bslam.ros2.geometry import (
    Camera,
    Mount,
    Transform,
    ellipse_95,
    frame_over,
    looks_down_rad,
    on_ground,
    place_tags,
    pose_in,
    yaw_of,
)
from bslam.ros2.messages import PlanarPose, frames_of, poses_of
from bslam.ros2.stamps import in_order
from bslam.ros2.tags import TagSizes, read_tag_sizes
from bslam.ros2.wheels import Gyro, Poses, gyro_means, travel_of_poses
from ros2.bags import CAMERA, CAMERA_POSE, header, new, point, pose, transform, yawed

SQUARE = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
UP = Transform(np.eye(3), np.zeros(3))


# --- tags ---------------------------------------------------------------------------------------------------


def corners_of(rng: np.random.Generator, count: int, side_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Centres (count, 3) of tags in front of a camera, and their corners' pixels (count, 4, 2)."""
    z = rng.uniform(0.5, 4.0, count)
    centres = np.column_stack([rng.uniform(-0.8, 0.8, count) * z, rng.uniform(-0.5, 0.5, count) * z, z])
    pixels = []
    for centre in centres:
        yaw, roll = rng.uniform(-0.8, 0.8), rng.uniform(-3, 3)
        turn = Transform.of((0, math.sin(yaw / 2), 0, math.cos(yaw / 2)), centre).rotation
        spin = Transform.of((0, 0, math.sin(roll / 2), math.cos(roll / 2)), centre).rotation
        pixels.append(CAMERA.project(side_m * SQUARE @ (turn @ spin).T + centre))
    return centres, np.array(pixels)


def placed(pixels: np.ndarray, side_m: float, pixel_sd: float) -> tuple[np.ndarray, np.ndarray]:
    rays = CAMERA.rays(pixels.reshape(-1, 2)).reshape(-1, 4, 2)
    return place_tags(rays, np.full(len(rays), side_m), pixel_sd / CAMERA.fx)


def test_corners_without_noise_give_the_place_whatever_their_order() -> None:
    centres, pixels = corners_of(np.random.default_rng(1), 200, 0.16)
    np.testing.assert_allclose(placed(pixels, 0.16, 0.5)[0], centres, atol=1e-6)
    np.testing.assert_allclose(placed(pixels[:, ::-1], 0.16, 0.5)[0], centres, atol=1e-6)
    np.testing.assert_allclose(placed(np.roll(pixels, 1, axis=1), 0.16, 0.5)[0], centres, atol=1e-6)


def test_the_covariance_of_a_place_is_that_of_its_error() -> None:
    rng = np.random.default_rng(2)
    centres, pixels = corners_of(rng, 1500, 0.4)
    places, covariance = placed(pixels + 0.3 * rng.standard_normal(pixels.shape), 0.4, 0.3)
    off = places - centres
    nees = np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariance), off)
    assert 2.7 < nees.mean() < 3.6
    assert 2.0 < np.median(nees) < 2.8


def test_a_tag_without_a_place_gives_none() -> None:
    line = np.array([[[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.3, 0.0]]])
    assert np.isnan(place_tags(line, np.array([0.16]), 1e-3)[0]).all()
    assert np.isnan(place_tags(np.full((1, 4, 2), np.nan), np.array([0.16]), 1e-3)[0]).all()
    assert place_tags(np.zeros((0, 4, 2)), np.zeros(0), 1e-3)[0].shape == (0, 3)


@given(st.floats(-0.9, 0.9), st.floats(-0.6, 0.6))
def test_distortion_is_taken_out(x: float, y: float) -> None:
    pixel = CAMERA.project(np.array([[x, y, 1.0]]))
    np.testing.assert_allclose(CAMERA.rays(pixel), [[x, y]], atol=1e-5)


def test_where_distortion_has_no_inverse_there_is_no_ray() -> None:
    strong = Camera(400.0, 400.0, 320.0, 240.0, (640, 480), "plumb_bob", (-0.4, 0.0, 0.0, 0.0, 0.0))
    assert np.isnan(strong.rays(np.array([[320.0 + 400.0 * 0.9, 240.0]]))).any()


# --- frames -------------------------------------------------------------------------------------------------


def test_a_chain_of_frames_goes_up_and_down() -> None:
    quarter = Transform.of((0, 0, math.sqrt(0.5), math.sqrt(0.5)), np.array([1.0, 0.0, 0.0]))
    tree = {"arm": ("base", quarter), "camera": ("arm", quarter), "base": ("footprint", quarter)}
    found = pose_in(tree, "base", "camera")
    assert found is not None
    np.testing.assert_allclose(found.place_m, [1.0, 1.0, 0.0], atol=1e-12)
    back = pose_in(tree, "camera", "base")
    assert back is not None
    np.testing.assert_allclose(back.after(found).place_m, 0.0, atol=1e-12)
    assert pose_in(tree, "base", "elsewhere") is None
    circle = {"a": ("b", quarter), "b": ("a", quarter)}
    assert pose_in(circle, "a", "c") is None


def test_a_mount_looks_along_the_optical_axis_or_ahead() -> None:
    assert Mount.of(Transform.of_camera(0.1, -0.2, 0.5)) == Mount(0.1, -0.2, pytest.approx(0.5))
    assert Mount.of(UP) == Mount(0.0, 0.0, 0.0)


def test_a_camera_may_be_tilted_and_rolled() -> None:
    tilted = Transform.of_camera(0.12, 0.05, 0.3, 0.2)
    np.testing.assert_allclose(tilted.rotation, CAMERA_POSE.rotation, atol=1e-12)
    assert looks_down_rad(tilted) == pytest.approx(0.2)
    rolled = Transform.of_camera(0.0, 0.0, 0.3, 0.2, 0.1)  # its left side goes up
    assert rolled.rotation[2, 0] == pytest.approx(-math.cos(0.2) * math.sin(0.1))
    np.testing.assert_allclose(rolled.rotation @ rolled.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rolled.rotation) == pytest.approx(1.0)
    assert Mount.of(rolled).yaw_rad == pytest.approx(0.3)


def test_range_is_along_the_ground_and_noise_is_split() -> None:
    camera = Transform.of_camera(0.1, 0.0, 0.0)
    place = np.array([-1.0, 3.0, 2.0])  # left, far below, ahead
    bearing, distance, bearing_sd, range_sd = on_ground(
        place, np.diag([0.04, 9.0, 0.04]), camera, Mount.of(camera)
    )
    assert (bearing, distance) == (pytest.approx(math.atan2(1.0, 2.0)), pytest.approx(math.hypot(1.0, 2.0)))
    assert (bearing_sd, range_sd) == (pytest.approx(0.2 / math.hypot(1.0, 2.0)), pytest.approx(0.2))


def test_yaw_of_quaternions_that_are_not_of_unit_length() -> None:
    assert yaw_of((0.0, 0.0, 2.0 * math.sin(0.4), 2.0 * math.cos(0.4))) == pytest.approx(0.8)
    assert yaw_of((0.0, 0.0, 0.0, 0.0)) == 0.0
    assert math.isnan(yaw_of((0.0, 0.0, math.nan, 1.0)))


def test_map_over_odometry_and_ellipses() -> None:
    x_m, y_m, turn = frame_over((1.0, 2.0, 1.0), (3.0, -1.0, 0.4))
    assert x_m + math.cos(turn) * 3.0 + math.sin(turn) == pytest.approx(1.0)
    assert y_m + math.sin(turn) * 3.0 - math.cos(turn) == pytest.approx(2.0)
    long_m, short_m, yaw = ellipse_95(np.diag([0.01, 0.04]))
    assert long_m == pytest.approx(2 * 2.4477 * 0.2, rel=1e-3)
    assert short_m == pytest.approx(2 * 2.4477 * 0.1, rel=1e-3)
    assert abs(yaw) == pytest.approx(math.pi / 2)


# --- stamps, wheels, gyro -----------------------------------------------------------------------------------


def test_stamps_are_sorted_noted_or_refused() -> None:
    notes: list[str] = []
    assert in_order([10, 30, 20, 40], "/t", notes).tolist() == [0, 2, 1, 3]
    assert "1 messages came out of order" in notes[0]
    notes.clear()
    assert in_order([900 * 10**9, 901 * 10**9, 10, 20], "/t", notes).tolist() == [2, 3]
    assert "left out 2 messages at the start" in notes[0]
    late = [i * 10**9 for i in range(20, 40)]
    with pytest.raises(BslamError, match=r"message 20 runs back by 38.000 s"):
        in_order([*late, 10**9], "/t", [])
    with pytest.raises(BslamError, match=r"header.stamp of message 1 is 0"):
        in_order([5, 0, 7], "/t", [])


def told(rows: list[tuple[int, float, float, float]], twist: tuple[float, float] = (0.0, 0.0)) -> Poses:
    twists = [(twist[0], 0.0, twist[1])] * len(rows)
    return Poses([PlanarPose(t * 10**9, x, y, th) for t, x, y, th in rows], twists)


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3, 3))
def test_wheels_of_poses_are_those_that_made_them(left_m: float, right_m: float, theta: float) -> None:
    x, y, turned = move_on_arc((2.0, -1.0, theta), left_m, right_m, 0.4)
    made = travel_of_poses(told([(1, 2.0, -1.0, theta), (2, x, y, turned)]), "/odom", []).wheels(0.4)
    np.testing.assert_allclose([made.a[0], made.b[0]], [left_m, right_m], atol=1e-9)


def test_odometry_that_jumps_stands_or_goes_sideways_is_noted() -> None:
    notes: list[str] = []
    jump = travel_of_poses(told([(1, 0, 0, 0), (2, 90, 0, 2), (3, 91, 0, 2)], (0.5, 0.1)), "/odom", notes)
    assert (jump.way_m[0], jump.turn_rad[0]) == (pytest.approx(0.5), pytest.approx(0.1))
    assert "the pose jumps 1 times" in notes[0]
    notes.clear()
    still = travel_of_poses(told([(1, 0, 0, 0), (2, 0, 0, 0), (4, 0, 0, 0)], (0.5, 0.1)), "/odom", notes)
    np.testing.assert_allclose(still.way_m, [0.5, 1.0])
    assert "the pose never changes" in notes[0]
    notes.clear()
    travel_of_poses(told([(1, 0, 0, 0), (2, 0, 1, 0), (3, 1, 1, 0)]), "/odom", notes)
    assert "1.00 m of its way go sideways" in notes[0]
    notes.clear()
    travel_of_poses(told([(1, 0, 0, 0), (1, 0, 0, 0), (2, 0.1, 0, 0)]), "/odom", notes)
    assert "left out 1 messages with the stamp of the one before" in notes[0]
    with pytest.raises(BslamError, match="1 of 2 messages, from message 1 on, have numbers"):
        travel_of_poses(told([(1, 0, 0, 0), (2, math.nan, 0, 0)]), "/odom", [])


def test_a_gyro_that_pauses_says_nothing_there() -> None:
    rates = [np.array([0.0, 0.0, rate]) for rate in (0.1, 0.2, 0.4)]
    gyro = Gyro([1_000_000_000, 1_500_000_000, 3_500_000_000], rates, "imu", 0.0)
    times = np.array([900_000, 2_000_000, 3_000_000, 4_000_000], dtype=np.int64)
    means, sd = gyro_means(gyro, "/imu", UP, times, [])
    np.testing.assert_allclose(means, [0.15, math.nan, 0.4])
    assert sd == 0.02
    with pytest.raises(BslamError, match="stamps of one clock"):
        gyro_means(gyro, "/imu", UP, times + 10**9, [])


# --- messages -----------------------------------------------------------------------------------------------


def test_older_definitions_are_read_too() -> None:
    tag = SimpleNamespace(family="36h11", id=4, corners=np.arange(8.0))
    old = SimpleNamespace(header=header(5, "camera"), detections=[tag])
    (frame,) = frames_of("apriltag_msgs/msg/AprilTagDetectionArray", old)
    assert frame.detections[0].identity == "36h11:4"
    np.testing.assert_array_equal(frame.detections[0].corners_px, np.arange(8.0).reshape(4, 2))
    at = new("geometry_msgs/msg/PoseWithCovariance", pose=pose((1, 2, 3)))
    results = [SimpleNamespace(id="7", score=0.2, pose=at), SimpleNamespace(id="8", score=0.9, pose=at)]
    found = SimpleNamespace(results=results, tracking_id="")
    foxy = SimpleNamespace(header=header(5, "camera"), detections=[found])
    (frame,) = frames_of("vision_msgs/msg/Detection3DArray", foxy)
    assert frame.detections[0].identity == "8"
    assert frame.detections[0].covariance_m2 is None


def test_isaac_and_aruco_ros_tell_covariances() -> None:
    at = new("geometry_msgs/msg/PoseWithCovariance", pose=pose((1, 2, 3)), covariance=np.eye(6).ravel())
    marker = new("aruco_msgs/msg/Marker", id=3, pose=at)
    markers = new("aruco_msgs/msg/MarkerArray", header=header(7, "camera"), markers=[marker])
    stamped = new("geometry_msgs/msg/PoseWithCovarianceStamped", pose=at)
    of_isaac = "isaac_ros_apriltag_interfaces/msg/AprilTagDetection"
    tag = new(of_isaac, family="tag36h11", id=3, pose=stamped)
    tags = new(f"{of_isaac}Array", header=header(7, "camera"), detections=[tag])
    for name, message in (("aruco_msgs/msg/MarkerArray", markers), (f"{of_isaac}Array", tags)):
        (frame,) = frames_of(name, message)
        (one,) = frame.detections
        assert one.identity.endswith("3") and one.covariance_m2 is not None
        np.testing.assert_array_equal(one.position_m, [1, 2, 3])


def test_tags_of_one_image_in_tf_are_one_frame_and_other_frames_are_none() -> None:
    ones = [
        transform(10, "camera", "tag36h11:1", (1, 0, 2)),
        transform(10, "odom", "base_link", (0, 0, 0)),
        transform(10, "camera", "tag36h11:2", (0, 0, 2)),
        transform(20, "camera", "tag36h11:1", (1, 0, 2)),
    ]
    message = new("tf2_msgs/msg/TFMessage", transforms=ones)
    frames = frames_of("tf2_msgs/msg/TFMessage", message)
    assert [(one.time_ns, len(one.detections)) for one in frames] == [(10, 2), (20, 1)]
    (truth,) = poses_of("tf2_msgs/msg/TFMessage", message, "base_link")
    assert truth == PlanarPose(10, 0.0, 0.0, 0.0)


def test_poses_of_every_kind() -> None:
    stamped = new("geometry_msgs/msg/PoseStamped", header=header(9), pose=pose((1, 2, 0), yawed(0.5)))
    with_doubt = new("geometry_msgs/msg/PoseWithCovarianceStamped", header=header(9))
    with_doubt.pose.pose = stamped.pose
    moved = transform(9, "map", "robot", (1, 2, 0), yawed(0.5))
    for name, message in (
        ("PoseStamped", stamped),
        ("PoseWithCovarianceStamped", with_doubt),
        ("TransformStamped", moved),
    ):
        (one,) = poses_of(f"geometry_msgs/msg/{name}", message)
        assert (one.time_ns, one.x_m, one.y_m, one.theta_rad) == (9, 1.0, 2.0, pytest.approx(0.5))
    assert point((1, 2, 3)).z == 3.0


# --- sizes of tags ------------------------------------------------------------------------------------------


def test_sizes_by_number_family_and_default(tmp_path: Path) -> None:
    table = tmp_path / "tags.toml"
    table.write_text('default_m = 0.1\n[side_m]\n5 = 0.2\n"tag25h9:5" = 0.3\n')
    sizes = read_tag_sizes(table)
    assert [sizes.of(one) for one in ("tag36h11:5", "tag25h9:5", "tag36h11:6", "5")] == [0.2, 0.3, 0.1, 0.2]
    listed = tmp_path / "tags.csv"
    listed.write_text("id,side_m\n5,0.2\ntag25h9:5,0.3\n")
    assert read_tag_sizes(listed) == TagSizes({"5": 0.2, "tag25h9:5": 0.3})


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        (
            "t.toml",
            "[side_m]\n5 = 300\n",
            "key side_m.5: 300 is not allowed; allowed: metres, from 0.001 to 10, as 0.16",
        ),
        ("t.toml", "sides = 3\n", "key sides: no such key; allowed: default_m, side_m"),
        ("t.toml", "side_m = 3\n", "key side_m: 3 is not allowed; allowed: a table"),
        ("t.toml", "default_m = 'a'\n", "key default_m: 'a' is not allowed"),
        ("t.toml", "[", "not TOML"),
        ("t.csv", "id,side_m\n5,-1\n", "line 2, column side_m: '-1' is not allowed"),
        (
            "t.csv",
            "id,side_m\n5,0.2\n5,0.3\n",
            "column id: '5' is not allowed; allowed: a tag that no",
        ),
        ("t.csv", "id,side_m\n", "no rows below the header"),
        ("t.yaml", "", "allowed: FILE.toml or FILE.csv"),
    ],
)
def test_bad_tables_are_refused(tmp_path: Path, name: str, text: str, said: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(BslamError) as error:
        read_tag_sizes(tmp_path / name)
    assert said in str(error.value)


def test_tags_of_unknown_size_are_named_in_order() -> None:
    with pytest.raises(BslamError, match=r"size of tags a:2, a:10 unknown; .*`2 = 0.16` below `\[side_m\]`"):
        TagSizes({}).require(["a:10", "a:2"], "/tags")
    with pytest.raises(BslamError, match=r"size of tags a:10 unknown; .* for these, too, or their rows"):
        TagSizes({"3": 0.1}).require(["a:10", "a:3"], "/tags")
