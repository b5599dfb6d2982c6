"""Odometry of a bag as travel of two wheels: from poses, from wheel joints, with a gyro beside them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.log import Odometry, wrap_rad
from bslam.motion import PAUSE_US, Pose, unseen_sd
from bslam.ros2.geometry import Transform, pose_of_part
from bslam.ros2.messages import PlanarPose, time_ns, turn_rate_of, twist_of
from bslam.ros2.stamps import in_order, without_repeats

Floats = NDArray[np.float64]

JUMP_MPS, JUMP_M = 10.0, 1.0
"""An odometry that moves faster, and so far at once, was set anew."""
JUMP_SD: Final = (0.5, 0.5)
"""m and rad that the robot's pose may be off then."""
SIDEWAYS_SHARE = 0.05
BROKEN_SHARE_MAX: Final = 0.05
"""So many messages of a topic may hold numbers that are none."""
_FIRST_STEPS_MAX = 2
GYRO_SD_RADPS = 0.02
"""Of a gyro that does not say."""


@dataclass
class Poses:
    """What an odometry topic told, message by message."""

    poses: list[PlanarPose] = field(default_factory=list)
    twists: list[tuple[float, float, float]] = field(default_factory=list)  # as `twist_of` has them

    def add(self, pose: PlanarPose, message: Any) -> None:
        self.poses.append(pose)
        self.twists.append(twist_of(message))

    def of_part(self, part: Transform) -> Poses:
        """The same of another frame, fixed on the one that they are of."""
        told = Poses()
        (c, s), (dx_m, dy_m) = part.rotation[:2, 0], part.place_m[:2]
        for one, (ahead, aside, turn) in zip(self.poses, self.twists, strict=True):
            pose = pose_of_part((one.x_m, one.y_m, one.theta_rad), part)
            told.poses.append(PlanarPose(one.time_ns, *pose))
            ahead, aside = ahead - turn * dy_m, aside + turn * dx_m
            told.twists.append((c * ahead + s * aside, c * aside - s * ahead, turn))
        return told


@dataclass(frozen=True)
class Travel:
    """Way and turn from message to message; row 0 starts the clock and moves nothing."""

    time_us: NDArray[np.int64]  # (n,)
    way_m: Floats  # (n - 1,)
    turn_rad: Floats  # (n - 1,)

    @property
    def step_us(self) -> int:
        """The usual time from message to message."""
        return max(1, int(np.median(np.diff(self.time_us))))

    @property
    def start_us(self) -> int:
        """When a log of it starts: a step before its first row."""
        return int(self.time_us[1]) - self.step_us

    def after_pause(self, topic: str, notes: list[str]) -> Travel:
        """Without messages before a first pause: a log has no way to say how long its first row took."""
        dt_us = np.diff(self.time_us)
        first = int(np.argmax(dt_us <= _FIRST_STEPS_MAX * self.step_us))
        if first == 0:
            return self
        pause_s = int(dt_us[:first].max()) * 1e-6
        notes.append(f"{topic}: left out {first} messages at the start: a pause of {pause_s:.1f} s follows")
        return Travel(self.time_us[first:], self.way_m[first:], self.turn_rad[first:])

    def wheels(self, wheelbase_m: float, gyro_radps: Floats | None = None) -> Odometry:
        half_m = 0.5 * wheelbase_m * self.turn_rad
        return Odometry("wheels", self.time_us[1:], self.way_m - half_m, self.way_m + half_m, gyro_radps)


def travel_of_poses(told: Poses, topic: str, notes: list[str]) -> Travel:
    """Arcs between the poses of an odometry topic; speeds where the pose says nothing.

    Raises BslamError for fewer than two messages, or numbers that are none.
    """
    order = in_order([one.time_ns for one in told.poses], topic, notes)
    time_us = np.array([told.poses[i].time_ns // 1000 for i in order], dtype=np.int64)
    order, time_us = _unrepeated(order, time_us, topic, notes)
    pose = np.array([(told.poses[i].x_m, told.poses[i].y_m, told.poses[i].theta_rad) for i in order])
    twist = np.array([told.twists[i] for i in order])
    usable = _finite(np.hstack([pose, twist]), order, topic, notes)
    time_us, pose, twist = time_us[usable], pose[usable], twist[usable]
    way_m, aside_m, turn_rad = arcs(pose)
    dt_s = np.diff(time_us) * 1e-6
    by_twist = is_jump(way_m, aside_m, dt_s)
    if by_twist.any():
        notes.append(f"{topic}: the pose jumps {int(by_twist.sum())} times; there its speeds are taken")
    if not np.ptp(pose, axis=0).any() and twist.any():
        notes.append(f"{topic}: the pose never changes; its speeds are taken")
        by_twist[:] = True
    way_m = np.where(by_twist, twist[1:, 0] * dt_s, way_m)
    turn_rad = np.where(by_twist, twist[1:, 2] * dt_s, turn_rad)
    ahead_m, sideways_m = np.abs(way_m).sum(), np.abs(aside_m[~by_twist]).sum()
    if sideways_m > SIDEWAYS_SHARE * (ahead_m + sideways_m):
        notes.append(
            f"{topic}: {sideways_m:.2f} m of its way go sideways and are lost: wheels only roll ahead"
        )
    return Travel(time_us, way_m, turn_rad)


def arcs(pose: Floats) -> tuple[Floats, Floats, Floats]:
    """Way along the arc, way aside of it, m, and turn, rad, from pose to pose of (n, 3): x, y, heading."""
    step_m, turn_rad = np.diff(pose[:, :2], axis=0), wrap_rad(np.diff(pose[:, 2]))
    heading_rad = pose[:-1, 2] + 0.5 * turn_rad
    ahead = np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
    aside = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    chord_over_arc = np.sinc(turn_rad / (2.0 * np.pi))  # sin(half turn) / half turn
    return (step_m * ahead).sum(axis=1) / chord_over_arc, (step_m * aside).sum(axis=1), turn_rad


def wheels_between(
    before: tuple[int, Pose], after: tuple[int, Pose], wheelbase_m: float
) -> tuple[float, float, tuple[float, float] | None]:
    """Travel of the left and right wheel, m, between poses of an odometry at their times in us, and None.

    After a pause, or where odometry was set anew, it tells no travel: 0, 0, and by how much, m and rad, that
    makes the robot's pose doubtful.
    """
    dt_us = after[0] - before[0]
    way_m, aside_m, turn_rad = arcs(np.array([before[1], after[1]]))
    if dt_us > PAUSE_US:
        return 0.0, 0.0, unseen_sd(dt_us)
    if is_jump(way_m, aside_m, np.array([dt_us * 1e-6]))[0]:
        return 0.0, 0.0, JUMP_SD
    half_m = 0.5 * wheelbase_m * turn_rad[0]
    return float(way_m[0] - half_m), float(way_m[0] + half_m), None


def is_jump(way_m: Floats, aside_m: Floats, dt_s: Floats) -> NDArray[np.bool_]:
    """Whether an odometry that moves so far in so long was set anew."""
    moved_m = np.hypot(way_m, aside_m)
    return (moved_m > JUMP_M) & (moved_m > JUMP_MPS * dt_s)


@dataclass
class Joints:
    """Angles of the wheels' joints, from the messages that have both."""

    left: str | None
    right: str | None
    stamps_ns: list[int] = field(default_factory=list)
    angles_rad: list[tuple[float, float]] = field(default_factory=list)
    names: set[str] = field(default_factory=set)

    def add(self, message: Any) -> None:
        names = list(message.name)
        if not self.names.issuperset(names):
            self.names.update(names)
            self._choose()
        if self.left in names and self.right in names and len(message.position) == len(names):
            both = (self.left, self.right)
            left_rad, right_rad = (float(message.position[names.index(str(one))]) for one in both)
            self.stamps_ns.append(time_ns(message.header))
            self.angles_rad.append((left_rad, right_rad))

    def _choose(self) -> None:
        """The joint with "left" and the one with "right" and "wheel" in its name, where nobody named them."""
        for side in ("left", "right"):
            fit = [one for one in self.names if side in one.lower() and "wheel" in one.lower()]
            if getattr(self, side) is None and len(fit) == 1:
                setattr(self, side, fit[0])


def travel_of_joints(
    told: Joints, topic: str, radius_m: float, wheelbase_m: float, notes: list[str]
) -> Travel:
    """From angles of joints. Raises BslamError if there are no such joints, or fewer than two messages."""
    if not told.stamps_ns:
        named = (
            f"no messages with positions of the joints {told.left or 'left?'} and {told.right or 'right?'}"
        )
        there = f"--left-joint and --right-joint of {', '.join(sorted(told.names)) or 'none'}"
        raise BslamError(f"{topic}: {named}; allowed: {there}")
    order = in_order(told.stamps_ns, topic, notes)
    time_us = np.array(told.stamps_ns, dtype=np.int64)[order] // 1000
    order, time_us = _unrepeated(order, time_us, topic, notes)
    angles_rad = np.array(told.angles_rad)[order]
    usable = _finite(angles_rad, order, topic, notes)
    time_us, angles_rad = time_us[usable], angles_rad[usable]
    left_m, right_m = radius_m * np.diff(angles_rad, axis=0).T
    return Travel(time_us, 0.5 * (left_m + right_m), (right_m - left_m) / wheelbase_m)


def _unrepeated(
    order: NDArray[np.int64], time_us: NDArray[np.int64], topic: str, notes: list[str]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    new = without_repeats(time_us, topic, notes)
    if new.sum() < 2:
        raise BslamError(
            f"{topic}: {int(new.sum())} messages; allowed: two or more, with stamps of their own"
        )
    return order[new], time_us[new]


def _finite(values: Floats, order: NDArray[np.int64], topic: str, notes: list[str]) -> NDArray[np.bool_]:
    """Which rows, that are these messages, have finite numbers alone; notes how many are left out.

    Raises BslamError where they are more than a few.
    """
    usable: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=1))
    bad = int((~usable).sum())
    if bad:
        said = f"{bad} of {len(usable)} messages, from message {order[np.argmin(usable)]} on, have numbers"
        if bad > BROKEN_SHARE_MAX * len(usable):
            most = f"allowed: {100 * BROKEN_SHARE_MAX:g} %, which are left out"
            raise BslamError(f"{topic}: {said} that are not finite; {most}")
        notes.append(f"{topic}: left out {said} that are not finite")
    return usable


@dataclass
class Gyro:
    """Angular velocities of an IMU."""

    stamps_ns: list[int] = field(default_factory=list)
    rates_radps: list[Floats] = field(default_factory=list)
    frame_id: str = ""
    sd_radps: float = 0.0

    def add(self, message: Any) -> None:
        self.frame_id, rate, sd = turn_rate_of(message)
        self.stamps_ns.append(time_ns(message.header))
        self.rates_radps.append(rate)
        self.sd_radps = max(self.sd_radps, sd)


def gyro_means(
    told: Gyro, topic: str, pose: Transform, time_us: NDArray[np.int64], notes: list[str]
) -> tuple[Floats, float]:
    """Mean turn rate about the robot's z from time to time (n - 1,), NaN: none there; and its noise, rad/s.

    pose: of the IMU on the robot.
    """
    order = in_order(told.stamps_ns, topic, notes)
    stamps_us = np.array(told.stamps_ns, dtype=np.int64)[order] // 1000
    rate = np.array(told.rates_radps)[order] @ pose.rotation[2]
    usable = _finite(rate[:, np.newaxis], order, topic, notes)
    stamps_us, rate = stamps_us[usable], rate[usable]
    total = np.concatenate([[0.0], np.cumsum(rate)])
    upto = np.searchsorted(stamps_us, time_us, side="right")
    count = np.diff(upto)
    with np.errstate(invalid="ignore"):
        means = np.diff(total[upto]) / np.where(count > 0, count, np.nan)
    if not count.any():
        raise BslamError(f"{topic}: no message within the time of the odometry; allowed: stamps of one clock")
    sd = told.sd_radps / float(np.sqrt(max(1.0, float(np.median(count)))))
    return means, min(max(sd, 1e-6), 100.0) if told.sd_radps > 0.0 else GYRO_SD_RADPS
