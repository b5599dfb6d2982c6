"""A bag of ROS 2 as a log."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.log import Log, Robot, Sightings, Truth
from bslam.parsing.settings import parse_table
from bslam.ros2.bag import TF_STATIC, Bag, name_of
from bslam.ros2.geometry import Camera, Mount, Transform, base_on, looks_down_rad, pose_in
from bslam.ros2.messages import (
    CAMERA_INFO,
    CORNERS,
    DETECTIONS,
    IMU,
    JOINTS,
    ODOMETRY,
    POSES,
    TF,
    Frame,
    PlanarPose,
    camera_of,
    frames_of,
    poses_of,
    transforms_of,
    usable_camera,
)
from bslam.ros2.sightings import BEARING_LEFT_RAD, RANGE_LEFT, Markers, sightings_of
from bslam.ros2.stamps import in_order, without_repeats
from bslam.ros2.tags import TagSizes
from bslam.ros2.wheels import Gyro, Joints, Poses, Travel, gyro_means, travel_of_joints, travel_of_poses

WHEELBASE_M: Final = 0.3
# What a wheeled robot and a detector of tags have about; whoever knows better says so.
GUESSES: Final[Mapping[str, Any]] = {
    "wheelbase_m": WHEELBASE_M,
    "wheel_speed_sigma_mps": 0.05,
    "wheel_noise": "actuation",
    "bearing_sigma_rad": 0.02,
    "range_sigma_fraction": 0.03,
    "range_sigma_scale_m": math.inf,
    "range_sigma_floor_m": 0.02,
}
_NOISE_OF_SIGHTINGS: Final = (
    "bearing_sigma_rad",
    "range_sigma_fraction",
    "range_sigma_scale_m",
    "range_sigma_floor_m",
)
_MOUNT_LEVEL: Final = 3  # numbers of a --mount without a pitch
_ROOM_AT_THE_EDGES: Final = 1.05  # of a field of view that is only known by what was seen


@dataclass(frozen=True)
class Request:
    """What to take from a bag. A topic of None: the only one of its kind, if there is one."""

    odometry: str | None = None
    detections: str | None = None
    joints: str | None = None
    left_joint: str | None = None
    right_joint: str | None = None
    wheel_radius_m: float | None = None
    imu: str | None = None
    truth: str | None = None  # TOPIC, or TOPIC:CHILD_FRAME for a TFMessage
    camera_info: str | None = None
    rectified: bool | None = None  # whether corners are of the rectified image; None: nobody said
    sizes: TagSizes | None = None
    pixel_sd: float = 0.5
    base: str | None = None  # the robot's frame; None: the child frame of the odometry
    mount: tuple[float, ...] | None = None  # x, y, yaw, pitch, roll of the camera, or fewer; None: /tf_static
    robot: Mapping[str, Any] = field(default_factory=dict)  # keys of robot.toml
    start_s: float = 0.0  # of the bag's time, by receipt: what to take
    end_s: float = math.inf


@dataclass(frozen=True)
class Imported:
    """A log, and what to say of how it was made, a line each."""

    log: Log
    said: tuple[str, ...]


@dataclass
class _Read:
    """All that one pass over the bag gives."""

    counts: dict[str, int] = field(default_factory=dict)
    span_ns: dict[str, tuple[int, int]] = field(default_factory=dict)  # first and last receipt
    poses: Poses = field(default_factory=Poses)
    child: str = ""
    joints: Joints = field(default_factory=lambda: Joints(None, None))
    gyro: Gyro = field(default_factory=Gyro)
    frames: list[Frame] = field(default_factory=list)
    truth: list[PlanarPose] = field(default_factory=list)
    cameras: dict[str, Any] = field(default_factory=dict)  # the first CameraInfo of each topic
    tree: dict[str, tuple[str, Transform]] = field(default_factory=dict)


Taker = Callable[[Any], None]


@dataclass(frozen=True)
class _Chosen:
    """The topic and its type for each part; None: not asked for, or not there."""

    detections: tuple[str, str]
    odometry: tuple[str, str] | None
    joints: tuple[str, str] | None
    imu: tuple[str, str] | None
    truth: tuple[str, str] | None
    truth_frame: str
    cameras: tuple[str, ...]

    @property
    def motion(self) -> str:
        """The topic that the wheels' travel is from."""
        chosen = self.joints or self.odometry
        assert chosen is not None
        return chosen[0]


def import_bag(path: Path, request: Request) -> Imported:
    """Read a bag. Raises BslamError that says what is missing or wrong, and what is allowed."""
    notes: list[str] = []
    with Bag(path) as bag:
        chosen = _choose(bag, request)
        read = _read(bag, chosen, request)
        kinds = dict(bag.topics)
    travel = _travel(read, chosen, request, path, notes).after_pause(chosen.motion, notes)
    gyro_radps, gyro_said = _gyro(read, chosen, request, travel, path, notes)
    markers = _markers(read, chosen, request, path, notes)
    sightings, words = sightings_of(read.frames, markers, chosen.detections[0], notes)
    sightings = _within(sightings, travel, chosen, notes)
    robot, guessed = _robot(request, travel, sightings, markers, gyro_said)
    odometry = travel.wheels(robot.wheelbase_m, gyro_radps)
    truth = _truth(read, chosen, travel, notes)
    log = Log(name_of(path), odometry, sightings, truth, None, robot, words=words)
    told = _told(read, chosen, kinds, log, markers)
    return Imported(log, (*told, *guessed, *(f"note: {one}" for one in notes)))


# --- topics, and one pass over the bag ----------------------------------------------------------------------


def _choose(bag: Bag, request: Request) -> _Chosen:
    kinds = list(DETECTIONS) if request.detections else [kind for kind in DETECTIONS if kind != TF]
    detections = bag.topic_of("--detections", request.detections, kinds)  # /tf alone may have no tags
    joints = bag.topic_of("--joints", request.joints, [JOINTS]) if request.joints else None
    if joints is None or request.odometry:
        odometry = bag.topic_of("--odometry", request.odometry, [ODOMETRY])
    else:
        odometry = None
    if odometry is None and joints is None:
        raise BslamError(
            f"{bag.path}: no topic of type {ODOMETRY}; --odometry or --joints TOPIC: allowed: "
            f"{bag.offer([ODOMETRY, JOINTS])}"
        )
    if detections is None:
        raise BslamError(
            f"{bag.path}: no topic of markers; --detections TOPIC: allowed: "
            f"{bag.offer(list(DETECTIONS))}; types: {', '.join(DETECTIONS)}"
        )
    truth, truth_frame = _truth_topic(bag, request)
    return _Chosen(
        detections,
        odometry,
        joints,
        bag.topic_of("--imu", request.imu, [IMU]) if request.imu else None,
        truth,
        truth_frame,
        _camera_topics(bag, request, detections),
    )


def _truth_topic(bag: Bag, request: Request) -> tuple[tuple[str, str] | None, str]:
    """The topic of the truth with its type, and which frame of it, if /tf holds it."""
    if request.truth is None:
        return None, ""
    topic, _, frame = request.truth.partition(":")
    if not topic:
        raise BslamError(f"--truth {request.truth!r}: no topic; allowed: TOPIC, or TOPIC:FRAME of /tf")
    found = bag.topic_of("--truth", topic, list(POSES))
    if found and found[1] == TF and not frame:
        raise BslamError(f"--truth {topic}: which frame of it? allowed: --truth {topic}:CHILD_FRAME")
    return found, frame


def _camera_topics(bag: Bag, request: Request, detections: tuple[str, str]) -> tuple[str, ...]:
    """The topics of CameraInfo to read: the one named, else all."""
    if request.camera_info:
        found = bag.topic_of("--camera-info", request.camera_info, [CAMERA_INFO])
        return (found[0],) if found else ()
    there = tuple(name for name, kind in bag.topics.items() if kind == CAMERA_INFO and bag.counts[name])
    if not there and detections[1] in CORNERS:
        raise BslamError(
            f"{bag.path}: {detections[0]} has corners in pixels, and no {CAMERA_INFO} is there; allowed: a "
            "bag with camera_info, or a topic with poses of the markers"
        )
    return there


def _read(bag: Bag, chosen: _Chosen, request: Request) -> _Read:
    read = _Read(joints=Joints(request.left_joint, request.right_joint))
    takers = _takers(read, chosen)
    if TF_STATIC in bag.topics:
        takers.append((TF_STATIC, lambda message: _take_static(read, message)))
    read.counts = {topic: 0 for topic, _ in takers}
    always = {TF_STATIC, *chosen.cameras}  # recorders hear these once, at the start
    for topic, received_ns, message in bag.messages(sorted(read.counts)):
        after_s = (received_ns - bag.start_ns) * 1e-9
        if not (request.start_s <= after_s <= request.end_s or topic in always):
            continue
        read.counts[topic] += 1
        read.span_ns[topic] = (read.span_ns.get(topic, (received_ns, 0))[0], received_ns)
        for name, take in takers:
            if name == topic:
                with _Named(f"{bag.path}: {topic}, message {read.counts[topic] - 1}"):
                    take(message)
    for topic, option in ((chosen.motion, "odometry"), (chosen.detections[0], "detections")):
        if read.counts[topic] == 0:
            cut = (
                f" within --start and --end; the bag is {bag.duration_s:.1f} s long"
                if bag.counts[topic]
                else ""
            )
            raise BslamError(
                f"{bag.path}: {topic} ({option}) holds no messages{cut}; allowed: a topic with some"
            )
    return read


class _Named:
    """Says of which message an error is; fields of other kinds or sizes than usual may raise anything."""

    def __init__(self, what: str) -> None:
        self._what = what

    def __enter__(self) -> None:
        pass

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if isinstance(error, Exception):
            raise BslamError(f"{self._what}: {error}") from error


def _takers(read: _Read, chosen: _Chosen) -> list[tuple[str, Taker]]:
    """What to do with the messages of each topic."""
    kind = chosen.detections[1]
    takers: list[tuple[str, Taker]] = [
        (chosen.detections[0], lambda message: read.frames.extend(frames_of(kind, message)))
    ]
    if chosen.odometry:
        takers.append((chosen.odometry[0], lambda message: _take_odometry(read, message)))
    if chosen.joints:
        takers.append((chosen.joints[0], read.joints.add))
    if chosen.imu:
        takers.append((chosen.imu[0], read.gyro.add))
    if chosen.truth:
        topic, of_kind = chosen.truth
        frame = chosen.truth_frame
        takers.append((topic, lambda message: read.truth.extend(poses_of(of_kind, message, frame))))
    for camera in chosen.cameras:
        takers.append((camera, lambda message, camera=camera: read.cameras.setdefault(camera, message)))  # type: ignore[misc]
    return takers


def _take_odometry(read: _Read, message: Any) -> None:
    read.child = message.child_frame_id
    read.poses.add(poses_of(ODOMETRY, message)[0], message)


def _take_static(read: _Read, message: Any) -> None:
    for parent, child, pose in transforms_of(message):
        read.tree[child] = (parent, pose)


# --- motion -------------------------------------------------------------------------------------------------


def _travel(read: _Read, chosen: _Chosen, request: Request, path: Path, notes: list[str]) -> Travel:
    if chosen.joints is None:
        poses = read.poses if request.base is None else _of_base(read, request.base, path)
        return travel_of_poses(poses, chosen.motion, notes)
    for option, value in (("--wheel-radius", request.wheel_radius_m), ("--wheelbase", _wheelbase(request))):
        if value is None:
            raise BslamError(
                f"--joints {chosen.motion}: angles become ways by {option} METRES, which is missing"
            )
    radius_m, wheelbase_m = float(request.wheel_radius_m or 0.0), float(_wheelbase(request) or 0.0)
    return travel_of_joints(read.joints, chosen.motion, radius_m, wheelbase_m, notes)


def _of_base(read: _Read, base: str, path: Path) -> Poses:
    """What the odometry tells of its child frame, of the robot's frame instead."""
    try:
        pose = base_on(read.tree, read.child, base)
    except BslamError as error:
        raise BslamError(f"{path}: {error}{_base_of(read)}no --base") from None
    return read.poses.of_part(pose)


def _pose_in(read: _Read, base: str, frame: str, path: Path) -> Transform | None:
    """The pose of a frame in another by /tf_static; None: nothing ties them."""
    pose = pose_in(read.tree, base, frame)
    if pose is not None and not (np.isfinite(pose.rotation).all() and np.isfinite(pose.place_m).all()):
        raise BslamError(
            f"{path}: {TF_STATIC}: the way from {base} to {frame} has numbers that are not finite"
        )
    return pose


def _base_of(read: _Read) -> str:
    """How a message offers the frames that there are, or another way, which follows."""
    frames = ", ".join(sorted(read.tree.keys() | {parent for parent, _ in read.tree.values()}))
    return f"; allowed: --base FRAME of {frames}; or " if frames else " (it has no frames); allowed: "


def _wheelbase(request: Request) -> float | None:
    return request.robot.get("wheelbase_m")


def _gyro(
    read: _Read, chosen: _Chosen, request: Request, travel: Travel, path: Path, notes: list[str]
) -> tuple[NDArray[np.float64] | None, dict[str, float]]:
    """Turn rates beside the odometry, and the gyro's noise as a key of robot.toml."""
    if chosen.imu is None:
        return None, {}
    if not read.gyro.stamps_ns:
        raise BslamError(f"{chosen.imu[0]} (--imu) holds no messages; allowed: a topic with some")
    base = _base(read, request)
    pose = _pose_in(read, base, read.gyro.frame_id, path)
    if pose is None:
        notes.append(f"{chosen.imu[0]}: no way from {base} to {read.gyro.frame_id}; its z is taken as up")
        pose = Transform(np.eye(3), np.zeros(3))
    means, sd = gyro_means(read.gyro, chosen.imu[0], pose, travel.time_us, notes)
    return means, {"gyro_sigma_radps": sd}


def _base(read: _Read, request: Request) -> str:
    return request.base or read.child or "base_link"


# --- markers ------------------------------------------------------------------------------------------------


def _markers(read: _Read, chosen: _Chosen, request: Request, path: Path, notes: list[str]) -> Markers:
    topic, kind = chosen.detections
    detections = [one for frame in read.frames for one in frame.detections]
    if not detections:
        raise BslamError(
            f"{path}: the {read.counts[topic]} messages of {topic} hold no marker; allowed: some"
        )
    sizes = request.sizes or TagSizes({})
    if kind in CORNERS:
        sizes.require({one.identity for one in detections}, topic)
    elif request.sizes is not None:
        raise BslamError(
            f"{topic}: {kind} tells places, so sizes of tags have no use; allowed: no --tags, no --tag-size"
        )
    frames = sorted({frame.frame_id for frame in read.frames if frame.detections})
    poses = {frame: _camera_pose(read, request, frame, path, notes) for frame in frames}
    return Markers(poses, sizes, _camera(read, request, frames, kind in CORNERS), request.pixel_sd)


def _camera_pose(read: _Read, request: Request, frame: str, path: Path, notes: list[str]) -> Transform:
    base = _base(read, request)
    if request.mount is not None:
        known = pose_in(read.tree, base, frame)
        instead = "" if known is None else f"in place of {_at(known)}, as {TF_STATIC} has it"
        level = "" if len(request.mount) > _MOUNT_LEVEL else "the camera is assumed level"
        if instead or level:
            notes.append(f"--mount: {'; '.join(filter(None, (level, instead)))}")
        return Transform.of_camera(*request.mount)
    pose = _pose_in(read, base, frame, path)
    if pose is None:
        raise BslamError(
            f"{path}: {TF_STATIC} has no way from {base} to {frame}, the camera's frame"
            f"{_base_of(read)}--mount X_M,Y_M,YAW_RAD of the camera"
        )
    return pose


def _camera(read: _Read, request: Request, frames: Sequence[str], needed: bool) -> Camera | None:
    """The camera of these frames; None: it is neither known nor needed."""
    fit = [name for name, one in read.cameras.items() if one.header.frame_id in frames]
    if not needed:
        known = [camera_of(read.cameras[name], False) for name in fit]
        return known[0] if len(known) == 1 and known[0].fx > 0.0 else None
    names = fit or list(read.cameras)
    if len(frames) > 1:
        raise BslamError(f"corners of several cameras ({', '.join(frames)}); allowed: a topic of one camera")
    if len(names) != 1:
        raise BslamError(f"--camera-info: allowed: one of {', '.join(names) or 'none with messages'}")
    return usable_camera(read.cameras[names[0]], names[0], request.rectified)


def _within(sightings: Sightings, travel: Travel, chosen: _Chosen, notes: list[str]) -> Sightings:
    """Those while odometry runs; a frame may be as late as rows are apart."""
    start_us, end_us = travel.start_us, int(travel.time_us[-1])
    kept = (sightings.time_us >= start_us) & (sightings.time_us <= end_us + travel.step_us)
    if not kept.any():
        seen = sightings.time_us[[0, -1]] * 1e-6 if len(kept) else np.full(2, math.nan)
        raise BslamError(
            f"{chosen.detections[0]} is stamped {seen[0]:.3f} to {seen[1]:.3f} s, {chosen.motion} "
            f"{start_us * 1e-6:.3f} to {end_us * 1e-6:.3f} s; allowed: stamps of one clock"
        )
    if not kept.all():
        lost = int((~kept).sum())
        notes.append(f"{chosen.detections[0]}: left out {lost} sightings before or after the odometry")
    columns = {one.name: getattr(sightings, one.name) for one in fields(sightings)}
    cut: Any = {name: None if column is None else column[kept] for name, column in columns.items()}
    return replace(sightings, **cut)


# --- truth, robot.toml, what is said ------------------------------------------------------------------------


def _truth(read: _Read, chosen: _Chosen, travel: Travel, notes: list[str]) -> Truth | None:
    if chosen.truth is None:
        return None
    topic = chosen.truth[0]
    if not read.truth:
        raise BslamError(f"{topic} (--truth) holds no pose of {chosen.truth_frame or 'anything'}")
    told = [one for one in read.truth if np.isfinite([one.x_m, one.y_m, one.theta_rad]).all()]
    if len(told) < len(read.truth):
        notes.append(f"{topic}: left out {len(read.truth) - len(told)} poses that are not finite")
    order = in_order([one.time_ns for one in told], topic, notes)
    time_us = np.array([told[i].time_ns // 1000 for i in order], dtype=np.int64)
    kept = without_repeats(time_us, topic, notes)
    kept &= (time_us >= travel.start_us) & (time_us <= travel.time_us[-1])
    if not kept.any():
        raise BslamError(f"{topic} (--truth): no pose while odometry runs; allowed: stamps of one clock")
    x_m, y_m, theta_rad = (
        np.array([getattr(told[i], name) for i in order])[kept] for name in ("x_m", "y_m", "theta_rad")
    )
    return Truth(time_us[kept], x_m, y_m, theta_rad)


def _robot(
    request: Request, travel: Travel, sightings: Sightings, markers: Markers, gyro: Mapping[str, float]
) -> tuple[Robot, list[str]]:
    """robot.toml, and a line for each of its values that is a guess."""
    mount, is_told = markers.mount, sightings.bearing_sd_rad is not None
    view_rad, view_said = _field_of_view(sightings, markers)
    known = {
        "step_us": travel.step_us,
        "field_of_view_rad": view_rad,
        "sensor_x_m": mount.x_m,
        "sensor_y_m": mount.y_m,
        "sensor_yaw_rad": mount.yaw_rad,
        **gyro,
    }
    robot = parse_table(Robot, {**GUESSES, **known, **request.robot}, "robot.toml")
    guessed = {name: value for name, value in GUESSES.items() if name not in request.robot}
    lines = [
        f"guessed: {name} = {value!r}; --set {name}=VALUE"
        for name, value in guessed.items()
        if not (is_told and name in _NOISE_OF_SIGHTINGS) and name != "range_sigma_scale_m"
    ]
    if is_told and markers.camera is not None:
        lines.append(
            f"guessed: corners err by {markers.pixel_sd:g} px (--pixel-sd); the sd columns hold that, and "
            f"{BEARING_LEFT_RAD:g} rad and {100 * RANGE_LEFT:g} % of the range, which calibration leaves: "
            "such errors last, so they scatter less than the sd says"
        )
    return robot, [*lines, *([view_said] if "field_of_view_rad" not in request.robot else [])]


def _field_of_view(sightings: Sightings, markers: Markers) -> tuple[float, str]:
    seen_rad = 2.0 * float(np.abs(sightings.bearing_rad).max())
    camera = markers.camera
    if camera is not None and camera.size_px[0] > 0:
        half_px = max(camera.cx, camera.size_px[0] - camera.cx)
        view_rad = min(max(2.0 * math.atan2(half_px, camera.fx), seen_rad), 6.2832)
        return view_rad, f"field of view: {view_rad:.2f} rad, from camera_info"
    view_rad = min(max(_ROOM_AT_THE_EDGES * seen_rad, 1e-3), 6.2832)
    return view_rad, f"guessed: field_of_view_rad = {view_rad:.2f}, by the widest bearing"


def _told(read: _Read, chosen: _Chosen, kinds: Mapping[str, str], log: Log, markers: Markers) -> list[str]:
    """What was read, a line a topic."""
    span_s = (log.odometry.time_us[-1] - log.odometry.time_us[0]) * 1e-6
    lines = [
        f"{topic} ({kinds[topic]}): {count} messages{_rate(count, read.span_ns.get(topic))}"
        for topic, count in read.counts.items()
        if topic != TF_STATIC and topic not in chosen.cameras
    ]
    way_m = float(np.abs(0.5 * (log.odometry.a + log.odometry.b)).sum())
    lines.append(f"odometry: {len(log.odometry.time_us)} steps in {span_s:.1f} s, {way_m:.1f} m")
    numbers = np.unique(log.sightings.beacon_id[log.sightings.beacon_id >= 0]).tolist()
    named = ", ".join(log.identity(one) for one in numbers[:12]) + (", ..." if len(numbers) > 12 else "")
    lines.append(
        f"sightings: {len(log.sightings.time_us)} of {len(numbers)} beacons: {named or 'no identity'}"
    )
    lines += [f"sensor: {name} at {_at(pose)}" for name, pose in markers.poses.items()]
    if len(markers.poses) > 1:
        lines.append("sensors: the log tells what they see as from the robot's middle")
    if log.truth is not None:
        lines.append(f"truth: {len(log.truth.time_us)} poses")
    return lines


def _at(pose: Transform) -> str:
    mount = Mount.of(pose)
    at = f"x {mount.x_m:.3f} m, y {mount.y_m:.3f} m, yaw {mount.yaw_rad:.4f} rad"
    return f"{at}, looking {looks_down_rad(pose):.4f} rad down"


def _rate(count: int, span_ns: tuple[int, int] | None) -> str:
    if span_ns is None or span_ns[1] <= span_ns[0]:
        return ""
    span_s = (span_ns[1] - span_ns[0]) * 1e-9
    return f" in {span_s:.1f} s, {(count - 1) / span_s:.1f} Hz"
