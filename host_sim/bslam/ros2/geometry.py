"""Rigid motions, cameras and square tags: from what a camera sees to a bearing and a range on the ground.

Frames are those of REP-103: a body's x ahead, y left, z up; an optical frame's z ahead, x right, y down.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError

Floats = NDArray[np.float64]

_LEVEL: Final = math.cos(0.1)  # of the angle between two frames' upward axes
_UPRIGHT: Final = 0.5  # an axis whose level part is shorter points up or down
DISTORTIONS: Final = ("", "plumb_bob", "rational_polynomial")
_UNDISTORT_STEPS, _UNDISTORT_WITHIN = 50, 1e-4
_CHI2_95: Final = 5.991  # two degrees of freedom
_FIT_STEPS: Final = 40
_FIT_WITHIN: Final = 1e-4  # of its sd: a step so small is the last
_TILT_SD_RAD: Final = 1.0  # what is known of a tag's tilt before it is seen: holds those seen from the front
# From the top left, clockwise in the image; any other order round the tag gives its centre too.
_SQUARE: Final = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


@dataclass(frozen=True)
class Transform:
    """The pose of a frame in another: a point p of it is rotation @ p + place_m there."""

    rotation: Floats  # (3, 3)
    place_m: Floats  # (3,)

    @staticmethod
    def of(quaternion: tuple[float, float, float, float], place_m: Floats) -> Transform:
        """quaternion: x, y, z, w, of any length but 0; 0: no turn, as a message that nobody filled has it."""
        return Transform(_rotation(quaternion), np.asarray(place_m, dtype=np.float64))

    @staticmethod
    def of_camera(
        x_m: float, y_m: float, yaw_rad: float, pitch_rad: float = 0.0, roll_rad: float = 0.0
    ) -> Transform:
        """An optical frame on a robot; angles as REP-103 has them: pitch is positive where it looks down."""
        (cr, sr), (cp, sp), (cy, sy) = (
            (math.cos(one), math.sin(one)) for one in (roll_rad, pitch_rad, yaw_rad)
        )
        ahead = [cy * cp, sy * cp, -sp]
        left = [cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr]
        up = [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr]
        rotation = np.column_stack([-np.array(left), -np.array(up), ahead])
        return Transform(rotation, np.array([x_m, y_m, 0.0]))

    def after(self, other: Transform) -> Transform:
        """`other` is in this frame: its pose in this frame's parent."""
        return Transform(self.rotation @ other.rotation, self.rotation @ other.place_m + self.place_m)

    def inverse(self) -> Transform:
        return Transform(self.rotation.T, -self.rotation.T @ self.place_m)


def _rotation(quaternion: tuple[float, float, float, float]) -> Floats:
    norm = math.sqrt(sum(one * one for one in quaternion))
    x, y, z, w = (one / norm for one in quaternion) if norm != 0.0 else (0.0, 0.0, 0.0, 1.0)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def yaw_of(quaternion: tuple[float, float, float, float]) -> float:
    """Heading of the x axis, rad."""
    rotation = _rotation(quaternion)
    return math.atan2(rotation[1, 0], rotation[0, 0])


Tree = Mapping[str, tuple[str, Transform]]
"""By child frame: the parent frame, and the child's pose in it."""


def pose_in(tree: Tree, base: str, frame: str) -> Transform | None:
    """The pose of `frame` in `base`, over their common ancestor; None: nothing ties them."""
    up, down = _to_root(tree, base), _to_root(tree, frame)
    common = next((name for name in down if name in up), None)
    return None if common is None else up[common].inverse().after(down[common])


def _to_root(tree: Tree, frame: str) -> dict[str, Transform]:
    """The pose of `frame` in itself and in each of its ancestors, nearest first."""
    found = {frame: Transform(np.eye(3), np.zeros(3))}
    while frame in tree and tree[frame][0] not in found:
        parent, pose = tree[frame]
        found[parent] = pose.after(found[frame])
        frame = parent
    return found


@dataclass(frozen=True)
class Mount:
    """Where the sensor of a log sits on the robot; level, whatever the camera does."""

    x_m: float
    y_m: float
    yaw_rad: float

    @staticmethod
    def of(pose: Transform) -> Mount:
        """Of a camera's pose in the robot's frame: it looks along z, or along x if z points up or down."""
        axis = _looking_along(pose)
        return Mount(
            float(pose.place_m[0]), float(pose.place_m[1]), math.atan2(float(axis[1]), float(axis[0]))
        )


def looks_down_rad(pose: Transform) -> float:
    """By how much a camera looks below the level."""
    return -math.asin(min(1.0, max(-1.0, float(_looking_along(pose)[2]))))


def _looking_along(pose: Transform) -> Floats:
    axes = (pose.rotation[:, 2], pose.rotation[:, 0])
    return next((one for one in axes if float(np.hypot(*one[:2])) > _UPRIGHT), axes[1])


def on_ground(
    position_m: Floats, covariance_m2: Floats | None, pose: Transform, mount: Mount
) -> tuple[float, float, float, float]:
    """Bearing and range of a place in the frame of a camera, seen from the mount, and the sd of each.

    Range is along the ground, heights left out. sd 0: no covariance is told.
    """
    place = pose.rotation @ position_m + pose.place_m
    dx_m, dy_m = place[0] - mount.x_m, place[1] - mount.y_m
    range_m = math.hypot(dx_m, dy_m)
    bearing_rad = math.remainder(math.atan2(dy_m, dx_m) - mount.yaw_rad, math.tau)
    if covariance_m2 is None or range_m == 0.0:
        return bearing_rad, range_m, 0.0, 0.0
    level = (pose.rotation @ covariance_m2 @ pose.rotation.T)[:2, :2]
    along = np.array([dx_m, dy_m]) / range_m
    across = np.array([-along[1], along[0]])
    return (
        bearing_rad,
        range_m,
        math.sqrt(max(0.0, float(across @ level @ across))) / range_m,  # rounding may leave less than 0
        math.sqrt(max(0.0, float(along @ level @ along))),
    )


@dataclass(frozen=True)
class Camera:
    """Focal lengths and principal point in pixels, and the distortion as sensor_msgs/CameraInfo has it."""

    fx: float
    fy: float
    cx: float
    cy: float
    size_px: tuple[int, int]  # width, height; 0: not told
    model: str  # one of DISTORTIONS; "": none
    distortion: tuple[float, ...]  # k1, k2, p1, p2, k3, k4, k5, k6, as many as there are

    @property
    def is_distorted(self) -> bool:
        return any(self.distortion)

    def rays(self, pixels: Floats) -> Floats:
        """x/z and y/z of the rays through pixels (n, 2), distortion taken out; NaN: it has no inverse."""
        seen = (pixels - [self.cx, self.cy]) / [self.fx, self.fy]
        if not self.is_distorted:
            return seen
        rays = seen.copy()
        with np.errstate(all="ignore"):
            for _ in range(_UNDISTORT_STEPS):
                radial, shift = self._distortion_at(rays)
                rays, before = (seen - shift) / radial, rays
                if np.allclose(rays, before, rtol=0.0, atol=1e-12):
                    break
            radial, shift = self._distortion_at(rays)
            off = np.abs(rays * radial + shift - seen).max(axis=1)
        rays[~(off < _UNDISTORT_WITHIN)] = np.nan
        return rays

    def project(self, points: Floats) -> Floats:
        """Pixels (n, 2) of points (n, 3) in the optical frame, distortion put in."""
        rays = points[:, :2] / points[:, 2:]
        radial, shift = self._distortion_at(rays)
        return (rays * radial + shift) * [self.fx, self.fy] + [self.cx, self.cy]

    def _distortion_at(self, rays: Floats) -> tuple[Floats, Floats]:
        """Factor (n, 1) along the radius and shift (n, 2) beside it."""
        k1, k2, p1, p2, k3, k4, k5, k6 = (*self.distortion[:8], *[0.0] * (8 - len(self.distortion[:8])))
        x, y = rays.T
        r2 = x * x + y * y
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        shift_x = 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        shift_y = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return radial[:, np.newaxis], np.column_stack([shift_x, shift_y])


def place_tags(rays: Floats, side_m: Floats, ray_sd: float) -> tuple[Floats, Floats]:
    """Centres (n, 3) of square tags in the optical frame, and their covariance (n, 3, 3).

    rays (n, 4, 2): x/z and y/z of each tag's corners, in order round it; side_m (n,); ray_sd: noise of each
    ray's x and y. Least squares over the six degrees of freedom (Levenberg, Marquardt), started from the
    homography. NaN where there is no solution in front of the camera.
    """
    rotation, place = _from_homography(rays, side_m)
    corners = np.concatenate([_SQUARE, np.zeros((4, 1))], axis=1) * side_m[:, np.newaxis, np.newaxis]
    hold = np.diag([1.0 / _TILT_SD_RAD**2] * 3 + [0.0] * 3)
    damping, todo = np.full(len(rays), 1e-3), np.arange(len(rays))
    information = np.full((len(rays), 6, 6), np.nan)
    with np.errstate(all="ignore"):
        for _ in range(_FIT_STEPS):
            if not len(todo):
                break
            tags = rays[todo], corners[todo]
            missed, slope = (one / ray_sd for one in _missed(*tags, rotation[todo], place[todo]))
            information[todo] = now = np.einsum("nki,nkj->nij", slope, slope) + hold
            damped = now * (1.0 + damping[todo, np.newaxis, np.newaxis] * np.eye(6))
            step = _solved(damped, np.einsum("nki,nk->ni", slope, missed))
            turned, moved = _turned(step[:, :3]) @ rotation[todo], place[todo] + step[:, 3:]
            cost = np.square(_missed(*tags, turned, moved)[0] / ray_sd).sum(axis=1)
            better = (cost <= np.square(missed).sum(axis=1)) & (moved[:, 2] > 0.0)
            rotation[todo[better]], place[todo[better]] = turned[better], moved[better]
            damping[todo] *= np.where(better, 0.1, 10.0)
            todo = todo[~(np.einsum("ni,nij,nj->n", step, now, step) < _FIT_WITHIN**2)]
    good = np.isfinite(information).all(axis=(1, 2)) & (place[:, 2] > 0.0)
    place[~good], information[~good] = np.nan, np.eye(6)
    return place, np.linalg.inv(information)[:, 3:, 3:]


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Of (n, k, k) and (n, k); NaN where there is no solution."""
    good = np.asarray(np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=1))
    good[good] &= np.abs(np.linalg.det(matrix[good])) > 0.0
    solution = np.full(right.shape, np.nan)
    solution[good] = np.linalg.solve(matrix[good], right[good][:, :, np.newaxis])[:, :, 0]
    return solution


def _from_homography(rays: Floats, side_m: Floats) -> tuple[Floats, Floats]:
    """Rotation (n, 3, 3) and place (n, 3) of tags, exact without noise; NaN where there is none."""
    count = len(rays)
    u, v = (np.broadcast_to(one, (count, 4)) * side_m[:, np.newaxis] for one in _SQUARE.T)
    x, y = rays[:, :, 0], rays[:, :, 1]
    one, none = np.ones_like(x), np.zeros_like(x)
    of_x = np.stack([u, v, one, none, none, none, -u * x, -v * x], axis=2)
    of_y = np.stack([none, none, none, u, v, one, -u * y, -v * y], axis=2)
    matrix, right = np.concatenate([of_x, of_y], axis=1), np.concatenate([x, y], axis=1)
    h = np.append(_solved(matrix, right), np.ones((count, 1)), axis=1).reshape(count, 3, 3)
    a, b = h[:, :, 0], h[:, :, 1]
    scale = 2.0 / (np.linalg.norm(a, axis=1) + np.linalg.norm(b, axis=1))
    a = a / np.linalg.norm(a, axis=1, keepdims=True)
    b = b - np.sum(a * b, axis=1, keepdims=True) * a
    b = b / np.linalg.norm(b, axis=1, keepdims=True)
    return np.stack([a, b, np.cross(a, b)], axis=2), scale[:, np.newaxis] * h[:, :, 2]


def _missed(rays: Floats, corners: Floats, rotation: Floats, place: Floats) -> tuple[Floats, Floats]:
    """By how much the corners' rays are missed (n, 8), and how they change (n, 8, 6): see `_slope`."""
    turned = np.einsum("nij,nkj->nki", rotation, corners)
    points = turned + place[:, np.newaxis]
    missed = (rays - points[:, :, :2] / points[:, :, 2:]).reshape(len(rays), 8)
    return missed, _slope(turned, points)


def _slope(turned: Floats, points: Floats) -> Floats:
    """(n, 8, 6) of x/z and y/z of the corners by a turn about the camera's axes and a shift."""
    x, y, z = np.moveaxis(points, 2, 0)
    none = np.zeros_like(z)
    by_point = np.stack(
        [np.stack([1 / z, none, -x / z**2], axis=2), np.stack([none, 1 / z, -y / z**2], axis=2)], axis=2
    )  # (n, 4, 2, 3)
    by_turn = -by_point @ _cross(turned)
    return np.concatenate([by_turn, by_point], axis=3).reshape(len(points), 8, 6)


def _cross(vectors: Floats) -> Floats:
    """The matrices [v]x of vectors (..., 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    none = np.zeros_like(x)
    rows = ([none, -z, y], [z, none, -x], [-y, x, none])
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _turned(vectors: Floats) -> Floats:
    """Rotations (n, 3, 3) by rotation vectors (n, 3)."""
    angle = np.linalg.norm(vectors, axis=1)[:, np.newaxis, np.newaxis]
    safe = np.where(angle > 1e-12, angle, 1.0)
    turn = _cross(vectors)
    return np.eye(3) + np.sin(safe) / safe * turn + (1.0 - np.cos(safe)) / safe**2 * (turn @ turn)


def base_on(tree: Tree, body: str, base: str) -> Transform:
    """The robot's frame on the frame that its odometry is of ("": the same).

    Raises BslamError where nothing ties them, or one is tilted against the other: a heading is none then.
    """
    pose = pose_in(tree, body or base, base)
    if pose is None:
        raise BslamError(f"/tf_static has no way from {body}, the odometry's frame, to {base}")
    if not (pose.rotation[2, 2] > _LEVEL and np.isfinite(pose.place_m).all()):
        raise BslamError(f"/tf_static: {body}, the odometry's frame, is not level with {base}")
    return pose


def pose_of_part(body: tuple[float, float, float], part: Transform) -> tuple[float, float, float]:
    """Where a part of a body stands: x, y, heading of the body on the ground, pose of the part on it."""
    x_m, y_m, theta_rad = body
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    dx_m, dy_m = (float(one) for one in part.place_m[:2])
    turn_rad = math.atan2(part.rotation[1, 0], part.rotation[0, 0])
    return x_m + c * dx_m - s * dy_m, y_m + s * dx_m + c * dy_m, theta_rad + turn_rad


def frame_over(
    pose: tuple[float, float, float], odometry: tuple[float, float, float]
) -> tuple[float, float, float]:
    """The pose of odometry's frame in the map's: x, y, heading of the robot in each of them are given."""
    turn_rad = math.remainder(pose[2] - odometry[2], math.tau)
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    x_m, y_m = odometry[:2]
    return pose[0] - c * x_m + s * y_m, pose[1] - s * x_m - c * y_m, turn_rad


def ellipse_95(covariance_m2: Floats) -> tuple[float, float, float]:
    """Axes (m, from end to end, the longer one first) and heading of the longer, rad; holds 95 %."""
    (small, large), axes = np.linalg.eigh(covariance_m2)
    long_m, short_m = (2.0 * math.sqrt(_CHI2_95 * max(0.0, float(one))) for one in (large, small))
    return long_m, short_m, math.atan2(axes[1, 1], axes[0, 1])
