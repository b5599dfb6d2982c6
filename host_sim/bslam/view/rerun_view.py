"""A run in Rerun's viewer, for `bslam live --rerun`: paths, map with ellipses, sightings, error as a curve.

rerun-sdk (MIT or Apache-2.0) is optional: of the viewers it is the one whose time line goes back while data
come in.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError, pip_install
from bslam.moment import FAILED, FINISHED, Moment, Spot, Stage, Told

INSTALL: Final = pip_install("rerun-sdk")
FILE_SUFFIX: Final = ".rrd"
_POLL_S: Final = 0.03
_FLUSH_S: Final = 30.0  # at most for what a viewer, or a disk, has yet to take
_INTO_A_FILE: Final = f"allowed: --rerun FILE{FILE_SUFFIX}, for a viewer elsewhere"
_PATH_EVERY_S: Final = 1.0  # of the log: a path is sent whole
_SIGMAS: Final = 2.4477  # 95 %
_ROUND: Final = np.linspace(0.0, math.tau, 25)
_TRUE: Final = (120, 120, 120)
_ESTIMATE: Final = (40, 100, 220)
_BEACON: Final = (200, 60, 40)
_FUSED: Final = (30, 160, 80)
_OTHER: Final = (230, 140, 20)
_RAY_M: Final = 3.0  # of a sighting without a distance


def open_stream(target: str) -> Any:
    """A stream of Rerun's: to a viewer that is started ("viewer"), or into FILE.rrd. Raises BslamError."""
    if target != "viewer" and not target.endswith(FILE_SUFFIX):
        raise BslamError(f"--rerun {target!r}: allowed: --rerun alone (opens a viewer), or FILE{FILE_SUFFIX}")
    from bslam.view.serve import has_screen  # here: it takes a second

    try:
        import rerun
    except ImportError as error:
        raise BslamError(f"--rerun needs the package rerun-sdk, which is missing: {INSTALL}") from error
    if target == "viewer" and not has_screen():
        raise BslamError(f"--rerun: no screen for its viewer here; {_INTO_A_FILE}")
    stream = rerun.RecordingStream("bslam")
    try:
        stream.spawn() if target == "viewer" else stream.save(target)
    except (OSError, RuntimeError) as error:
        raise BslamError(f"--rerun {target}: {str(error).strip().partition(chr(10))[0]}") from error
    return stream


def follow(scene: Scene, newest: Callable[[], Moment]) -> None:
    """Show moments until the run has ended. Raises BslamError if the viewer has gone."""
    while True:
        moment = newest()
        scene.show(moment)
        if moment.state in (FINISHED, FAILED):
            try:
                scene.stream.flush(timeout_sec=_FLUSH_S)
            except RuntimeError as error:
                said = str(error).partition(",")[0]
                raise BslamError(f"--rerun: its viewer has gone ({said}); {_INTO_A_FILE}") from error
            return
        time.sleep(_POLL_S)


class Scene:
    """What a viewer has of a run; everything in the frame of the map, on the ground."""

    def __init__(self, stage: Stage, stream: Any) -> None:
        import rerun

        self.stream, self._rr, self._stage = stream, rerun, stage
        self._rows, self._path_s = 0, -math.inf
        stream.log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        walls = stage.walls_m.reshape(-1, 2, 2)
        if len(walls):
            stream.log("world/walls", rerun.LineStrips3D(_flat(walls), colors=[_TRUE]), static=True)
        nose = rerun.Arrows3D(vectors=[(0.4, 0.0, 0.0)], colors=[_ESTIMATE])
        stream.log("world/robot", nose, static=True)

    def show(self, moment: Moment) -> None:
        """What is new since the moment before."""
        course, rr, stream = moment.course, self._rr, self.stream
        rows = len(course.time_s)
        for row in range(self._rows, rows):
            stream.set_time("drive", duration=float(course.time_s[row] - course.time_s[0]))
            x_m, y_m, theta_rad = course.estimate[row]
            turn = rr.RotationAxisAngle(axis=(0.0, 0.0, 1.0), radians=float(theta_rad))
            stream.log("world/robot", rr.Transform3D(translation=(x_m, y_m, 0.0), rotation=turn))
            stream.log("plots/sd_m", rr.Scalars([float(course.sd_m[row])]))
            if math.isfinite(course.error_m[row]):
                stream.log("plots/error_m", rr.Scalars([float(course.error_m[row])]))
        if rows == self._rows and moment.state != FINISHED:
            return
        self._rows = rows
        self._show_map(moment)
        if moment.state == FINISHED or course.time_s[-1] - self._path_s >= _PATH_EVERY_S:
            self._path_s = float(course.time_s[-1])
            self._show_path("world/path", course.estimate, _ESTIMATE)
            self._show_path("world/true_path", course.truth[np.isfinite(course.truth[:, 0])], _TRUE)

    def _show_path(self, name: str, poses: NDArray[np.float64], colour: tuple[int, int, int]) -> None:
        if len(poses) > 1:
            self.stream.log(name, self._rr.LineStrips3D(_flat(poses[np.newaxis, :, :2]), colors=[colour]))

    def _show_map(self, moment: Moment) -> None:
        rr, stream, beacons = self._rr, self.stream, moment.beacons
        if len(moment.true_beacons_m):
            spots = rr.Points3D(_flat(moment.true_beacons_m), colors=[_TRUE], radii=[0.06])
            stream.log("world/true_beacons", spots)
        names = [str(one.label if one.label >= 0 else one.uid) for one in beacons]
        rings = _flat(np.array([_ellipse(one) for one in beacons]).reshape(-1, len(_ROUND), 2))
        stream.log("world/map/ellipses", rr.LineStrips3D(rings, colors=[_BEACON]))
        spots = _flat(np.array([(one.x_m, one.y_m) for one in beacons]).reshape(-1, 2))
        stream.log("world/map", rr.Points3D(spots, colors=[_BEACON], radii=[0.05], labels=names))
        rays = [self._ray(one, moment.course.estimate[-1]) for one in moment.frame]
        colours = [_FUSED if one.result == "matched" else _OTHER for one in moment.frame]
        strips = _flat(np.array(rays).reshape(-1, 2, 2))
        stream.log("world/sightings", rr.LineStrips3D(strips, colors=colours))

    def _ray(self, one: Told, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """From the sensor to what it saw, (2, 2)."""
        x_m, y_m, yaw_rad = self._stage.sensor
        c, s = math.cos(pose[2]), math.sin(pose[2])
        start = np.array([pose[0] + c * x_m - s * y_m, pose[1] + s * x_m + c * y_m])
        angle = pose[2] + yaw_rad + one.bearing_rad
        reach_m = _RAY_M if one.range_m is None else one.range_m
        return np.array([start, start + reach_m * np.array([math.cos(angle), math.sin(angle)])])


def _ellipse(one: Spot) -> NDArray[np.float64]:
    """The outline (25, 2) that holds a beacon with 95 %."""
    variance, axes = np.linalg.eigh(one.covariance_m2)
    circle = np.column_stack([np.cos(_ROUND), np.sin(_ROUND)]) * np.sqrt(np.maximum(variance, 0.0))
    return np.array([one.x_m, one.y_m]) + _SIGMAS * circle @ axes.T


def _flat(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (..., 2) on the ground, (..., 3)."""
    return np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)
