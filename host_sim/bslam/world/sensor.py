"""What the sensor says of the beacons, from the exact poses: field of view, hiding walls, noise, outliers.

Arrays have one row a pose and one column a beacon. Lengths in metres, angles in radians.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bslam.log import Sightings, wrap_rad
from bslam.world.arena import Arena
from bslam.world.crowd import Screens
from bslam.world.scenario import Mismatch, Sensor
from bslam.world.signatures import Looks
from bslam.world.untold import coloured

Matrix = NDArray[np.float64]

_AS_TOLD = Mismatch()


def see(
    arena: Arena,
    sensor: Sensor,
    time_us: NDArray[np.int64],
    poses: Matrix,
    random: np.random.Generator,
    screens: Screens | None = None,
    mismatch: Mismatch = _AS_TOLD,
) -> Sightings:
    """Sightings of every visible beacon; poses (n, 3) are x m, y m, theta rad in the arena's frame.

    `screens` moved about in the meantime and may have stood in front. Of `mismatch` the scales of distances
    count; `sensor` is the true one.

    Noise is drawn for every beacon at every pose, seen or not, so that what one sighting gets does not hang
    on the others. An outlier keeps its beacon's identity, but its direction and range mean nothing.
    """
    bearing_rad, range_m = look(arena, sensor, poses)
    side_rad, true_range_m = bearing_rad + poses[:, 2:] + sensor.yaw_rad, range_m
    seen = is_visible(arena, sensor, poses, bearing_rad, range_m)
    if screens is not None:
        step, beacon = np.nonzero(seen)
        eye, _ = _mount(sensor, poses)
        seen[step, beacon] = ~screens.hide(step, eye[step], arena.beacon_xy_m[beacon])
    # What is drawn from these changes nothing of the rest, above all not how things look.
    looks_random, scale_random, miss_random, bearing_random = random.spawn(4)
    white = random.standard_normal((2, *seen.shape))
    bearing_noise, range_noise = coloured(white, float(np.ptp(time_us[:2])) * 1e-6, sensor.noise_time_s)
    bearing_rad = wrap_rad(bearing_rad + sensor.bearing_sigma_rad * bearing_noise)
    own_scale = 1.0 + mismatch.range_scale_sd * scale_random.standard_normal(len(arena.beacons))
    range_m = mismatch.range_scale * own_scale * range_m + range_sigma_m(sensor, range_m) * range_noise
    bearing_rad, range_m = _spoil(arena, sensor, random, bearing_random, bearing_rad, range_m)
    if sensor.miss_share > 0.0:
        seen &= miss_random.random(seen.shape) >= sensor.miss_share
    seen &= range_m > 0.0  # from afar the noise can exceed the range; no detector would report that
    step, beacon = np.nonzero(seen)
    beacon_id = np.array([one.beacon_id for one in arena.beacons], dtype=np.int64)
    looks = Looks(arena, looks_random)
    return Sightings(
        time_us=time_us[step] + sensor.delay_us,
        beacon_id=beacon_id[beacon],
        bearing_rad=bearing_rad[seen],
        range_m=range_m[seen],
        mappable=np.ones(len(step), dtype=np.bool_),
        signature=looks.see(beacon, side_rad[seen], true_range_m[seen], looks_random),
    )


def _spoil(
    arena: Arena,
    sensor: Sensor,
    random: np.random.Generator,
    bearing_random: np.random.Generator,
    bearing_rad: Matrix,
    range_m: Matrix,
) -> tuple[Matrix, Matrix]:
    """Bearing and range with outliers among them, each kind from a stream of its own."""
    if sensor.outlier_share > 0.0:
        lot, direction, distance = random.random((3, *bearing_rad.shape))
        spoilt = lot < sensor.outlier_share
        bearing_rad = np.where(spoilt, sensor.field_of_view_rad * (direction - 0.5), bearing_rad)
        range_m = np.where(spoilt, _farthest_m(arena, sensor) * distance, range_m)
    if sensor.bearing_outlier_share > 0.0:
        lot, direction = bearing_random.random((2, *bearing_rad.shape))
        spoilt = lot < sensor.bearing_outlier_share
        bearing_rad = np.where(spoilt, sensor.field_of_view_rad * (direction - 0.5), bearing_rad)
    return bearing_rad, range_m


def look(arena: Arena, sensor: Sensor, poses: Matrix) -> tuple[Matrix, Matrix]:
    """True bearing from the sensor's forward axis and true range of every beacon, hidden or not."""
    eye, forward_rad = _mount(sensor, poses)
    ray = arena.beacon_xy_m[np.newaxis] - eye[:, np.newaxis]
    bearing_rad = wrap_rad(np.arctan2(ray[..., 1], ray[..., 0]) - forward_rad[:, np.newaxis])
    return bearing_rad, np.hypot(ray[..., 0], ray[..., 1])


def is_visible(
    arena: Arena, sensor: Sensor, poses: Matrix, bearing_rad: Matrix, range_m: Matrix
) -> NDArray[np.bool_]:
    """Whether the beacon is in the field of view, near enough, and not behind a wall."""
    visible = (np.abs(bearing_rad) <= sensor.field_of_view_rad / 2.0) & (range_m <= sensor.range_max_m)
    step, beacon = np.nonzero(visible)
    eye, _ = _mount(sensor, poses)
    visible[step, beacon] = arena.in_sight(eye[step], arena.beacon_xy_m[beacon])
    return visible


def range_sigma_m(sensor: Sensor, range_m: Matrix) -> Matrix:
    """Standard deviation of a measured range."""
    fraction, scale_m = sensor.range_sigma_fraction, sensor.range_sigma_scale_m
    return np.hypot(sensor.range_sigma_floor_m, range_m * np.hypot(fraction, range_m / scale_m))


def _mount(sensor: Sensor, poses: Matrix) -> tuple[Matrix, Matrix]:
    """Where the sensor is, (n, 2), and where it looks, (n,)."""
    x_m, y_m, theta_rad = poses.T
    cos, sin = np.cos(theta_rad), np.sin(theta_rad)
    eye = np.stack(
        [x_m + cos * sensor.x_m - sin * sensor.y_m, y_m + sin * sensor.x_m + cos * sensor.y_m], axis=1
    )
    return eye, theta_rad + sensor.yaw_rad


def _farthest_m(arena: Arena, sensor: Sensor) -> float:
    return min(sensor.range_max_m, math.dist(arena.low, arena.high))
