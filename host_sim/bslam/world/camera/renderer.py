"""One camera that takes pictures of a scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.rig import Camera
from bslam.world.camera import lens, raw
from bslam.world.camera.scene import BeaconLook, Body, Drift, Floats, Scene

_TARGET_BRIGHTNESS = (0.16, 0.28)  # of the mean linear light, where the auto-exposure settles
_EXPOSURE_LAG_S = (0.25, 0.9)
_SHUTTER_S = (0.004, 0.02)
_MOTION_BLUR_PX_MAX = 4.0
_LONGEST_STEP_S = 0.5  # frames farther apart tell nothing about how fast the camera turns
_LENS_BLUR_PX = (0.25, 0.6)  # standard deviation
_FAINT = 0.005
_CAST = 0.05  # white balance that a camera keeps, and (next) that it wanders by
_BALANCE_DRIFT = 0.05
_SHOT = (1e-4, 4e-4)  # variance at full light, when the exposure is 1
_READ = (0.001, 0.003)

Pose = tuple[float, float, float]


@dataclass(frozen=True)
class Seen:
    """A beacon in a picture. Counts are of pixel centres; `box` is left, top, right, bottom in px edges.

    The box is that of the whole object's projection, clipped to the frame; pixel i covers [i - 0.5, i + 0.5].
    own_px: what it would cover in the frame if nothing stood before it. cut: its projection leaves the frame.
    slant_rad: between the horizontal line of sight to the middle of its front and the front's normal.
    bearing_rad: of that middle, as the camera sees it, in the robot's frame. range_m: horizontal, from the
    camera to it.
    """

    beacon_id: int
    kind: str
    box: tuple[float, float, float, float]
    visible_px: int
    own_px: int
    cut: bool
    slant_rad: float
    bearing_rad: float
    range_m: float


@dataclass(frozen=True)
class Frame:
    """A picture and the truth about it.

    rgb (h, w, 3) uint8; identity (h, w) int16: beacon_id, -1 none, -2 clutter; depth_m (h, w) float32: along
    the ray of the pixel's centre, inf where the lens shows nothing.
    """

    rgb: NDArray[np.uint8]
    identity: NDArray[np.int16]
    depth_m: NDArray[np.float32]
    seen: tuple[Seen, ...]


class Renderer:
    """One camera's exposure, white balance and noise. The same calls give the same pictures, to the bit."""

    def __init__(self, scene: Scene, camera: Camera, seed: int | Sequence[int]) -> None:
        random = np.random.default_rng(np.random.SeedSequence(seed))
        self._scene, self._camera = scene, camera
        self._tables = scene.tables.copy() if scene.movers else scene.tables
        self._caster = raw.Caster(self._tables, lens.rays(camera), int(random.integers(1, 2**63)))
        self._target = random.uniform(*_TARGET_BRIGHTNESS)
        self._lag_s = random.uniform(*_EXPOSURE_LAG_S)
        self._shutter_s = random.uniform(*_SHUTTER_S)
        self._blur_px = random.uniform(*_LENS_BLUR_PX)
        self._shot, self._read = random.uniform(*_SHOT), random.uniform(*_READ)
        self._cast = random.uniform(1.0 - _CAST, 1.0 + _CAST, 3)
        self._balance = [
            Drift(_BALANCE_DRIFT, random.uniform(15.0, 60.0), random.uniform(0.0, math.tau)) for _ in range(3)
        ]
        self._exposure: float | None = None
        self._last: tuple[float, float] | None = None  # time s and direction rad of the picture before

    def render(
        self, pose: Pose, time_s: float, pan_rad: float = 0.0, movers_m: Floats | None = None
    ) -> Frame:
        """The picture from a robot's pose (x m, y m, theta rad) in the arena's frame.

        Times should rise from call to call; pan_rad turns the camera beyond its mounting; movers_m (n, 2):
        where the scene's movers are, if not where they were. BslamError unless all are finite.
        """
        movers = [] if movers_m is None else movers_m.tolist()
        if not all(math.isfinite(one) for one in (*pose, time_s, pan_rad, *chain(*movers))):
            raise BslamError(
                f"pose {pose!r}, time {time_s!r}, pan {pan_rad!r}, movers {movers!r}: allowed: finite numbers"
            )
        for surface, place in zip(self._scene.movers, movers, strict=movers_m is not None):
            self._tables.move(surface, *place)
        eye, yaw_rad = self._eye(pose, pan_rad)
        lamp, sky = self._scene.lighting.at(time_s)
        identity, depth_m = self._caster.trace(eye, (math.cos(yaw_rad), math.sin(yaw_rad)), lamp, sky)
        rgb = self._expose(time_s, yaw_rad)
        self._last = (time_s, yaw_rad)
        return Frame(rgb, identity, depth_m, self._seen(eye, yaw_rad, pose[2]))

    def _eye(self, pose: Pose, pan_rad: float) -> tuple[tuple[float, float, float], float]:
        x_m, y_m, theta_rad = pose
        camera = self._camera
        cos, sin = math.cos(theta_rad), math.sin(theta_rad)
        eye_x_m = x_m + cos * camera.x_m - sin * camera.y_m
        eye_y_m = y_m + sin * camera.x_m + cos * camera.y_m
        return (eye_x_m, eye_y_m, camera.z_m), theta_rad + camera.yaw_rad + pan_rad

    def _expose(self, time_s: float, yaw_rad: float) -> NDArray[np.uint8]:
        step_s = math.inf if self._last is None else max(0.0, time_s - self._last[0])
        wanted = self._target / max(self._caster.brightness(), 1e-6)
        if self._exposure is None:
            self._exposure = wanted
        self._exposure *= (wanted / self._exposure) ** (1.0 - math.exp(-step_s / self._lag_s))
        gain = [
            float(self._exposure * cast * drift.at(time_s))
            for cast, drift in zip(self._cast, self._balance, strict=True)
        ]
        smear_px = 0.0
        if self._last is not None and 0.0 < step_s <= _LONGEST_STEP_S:
            turned_rad = abs(math.remainder(yaw_rad - self._last[1], math.tau))
            smear_px = self._camera.lens.fx_px * turned_rad / step_s * self._shutter_s
        across_px = math.hypot(self._blur_px, min(smear_px, _MOTION_BLUR_PX_MAX) / math.sqrt(12.0))
        noise = (self._shot * self._exposure, self._read * math.sqrt(self._exposure))
        return self._caster.expose(gain, noise, _blur(across_px, raw.BLUR_TAPS), _blur(self._blur_px, 3)[0])

    def _seen(self, eye: tuple[float, float, float], yaw_rad: float, theta_rad: float) -> tuple[Seen, ...]:
        seen = []
        for beacon, body in zip(self._scene.beacons, self._scene.bodies, strict=True):
            visible_px = self._caster.visible_px(body.first, body.count)
            if visible_px:
                seen.append(self._look(beacon, body, visible_px, eye, yaw_rad, theta_rad))
        return tuple(seen)

    def _look(
        self,
        beacon: BeaconLook,
        body: Body,
        visible_px: int,
        eye: tuple[float, float, float],
        yaw_rad: float,
        theta_rad: float,
    ) -> Seen:
        found = lens.outline(self._camera, _to_level(body.corners_from(eye), eye, yaw_rad))
        assert found is not None  # some of it is in the picture
        to_x, to_y = beacon.x_m - eye[0], beacon.y_m - eye[1]
        direction_rad = math.atan2(to_y, to_x)
        return Seen(
            beacon_id=beacon.beacon_id,
            kind=beacon.kind,
            box=found[0],
            visible_px=visible_px,
            own_px=self._caster.own_px(body.first, body.count, found[0]),
            cut=found[1],
            slant_rad=abs(math.remainder(direction_rad + math.pi - beacon.facing_rad, math.tau)),
            bearing_rad=math.remainder(direction_rad - theta_rad, math.tau),
            range_m=math.hypot(to_x, to_y),
        )


def _to_level(points: Floats, eye: tuple[float, float, float], yaw_rad: float) -> Floats:
    """Points (..., 3) of the arena in the level frame."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    x, y, z = np.moveaxis(points - eye, -1, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x, z], axis=-1)


def _blur(sigma_px: float, taps: int) -> list[float]:
    """A normal distribution over an odd number of pixels; what is too small to see is nothing."""
    offsets = np.arange(taps) - taps // 2
    weights = np.exp(-0.5 * (offsets / sigma_px) ** 2)
    weights[weights < _FAINT] = 0.0
    return (weights / weights.sum()).tolist()
