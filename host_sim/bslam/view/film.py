"""A run as an animated picture: path, truth, ellipses and sightings on the left, the error on the right."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from bslam.moment import Moment, Stage
from bslam.view.style import (
    BEACON,
    ESTIMATE,
    RESULT_COLOURS,
    SECOND,
    TRUTH,
    WALL,
    new_figure,
    tidy,
)

SUFFIXES: Final = (".gif", ".webp")
_FRAME_MS: Final = 80
_END_MS: Final = 2000  # how long the last one stands
_COLOURS: Final = 48  # of a GIF's palette: lines and letters need no more
_SIGMAS: Final = 2.0
_RAY_M: Final = 3.0  # of a sighting without a distance
_NOSE_M: Final = 0.45
_SHOWN: Final = {"matched": "fused", "wrong": "wrong", "new": "new beacon", "rejected": "rejected"}


class _Scene:
    """The figure, whose lines are moved from frame to frame."""

    def __init__(self, stage: Stage, moments: Sequence[Moment]) -> None:
        self._stage = stage
        x_low, y_low, x_high, y_high = stage.extent_m
        aspect = (x_high - x_low) / (y_high - y_low)
        height_in = 3.7
        self.figure: Figure = new_figure(min(0.85 * height_in * aspect, 5.4) + 3.1, height_in)
        self._room, self._error = self.figure.subplots(
            1, 2, width_ratios=(min(0.85 * height_in * aspect, 5.4), 2.7)
        )
        self._draw_room(moments[0].true_beacons_m)
        self._draw_error(moments[-1])

    def _draw_room(self, beacons_m: NDArray[np.float64]) -> None:
        axes, stage = self._room, self._stage
        x_low, y_low, x_high, y_high = stage.extent_m
        axes.add_collection(
            LineCollection(stage.walls_m.reshape(-1, 2, 2).tolist(), colors=WALL, linewidths=2.5)
        )
        axes.plot(*beacons_m.T, "*", color=BEACON, markersize=11, markeredgecolor="#6b4b00", zorder=3)
        self._truth = axes.plot([], [], color=TRUTH, linewidth=2.6, alpha=0.45, label="true path")[0]
        self._path = axes.plot([], [], color=ESTIMATE, linewidth=1.1, label="estimate")[0]
        self._rays = axes.add_collection(LineCollection([], zorder=2))
        self._map = axes.plot([], [], "+", color=SECOND, markersize=7, zorder=4, label="map, 2 sigma")[0]
        self._ellipses: Any = None
        self._robots = [
            axes.plot([], [], color=colour, linewidth=2.5, marker="o", markevery=[0], markersize=7, zorder=5)[
                0
            ]
            for colour in (TRUTH, ESTIMATE)
        ]
        for result, words in _SHOWN.items():
            axes.plot([], [], color=RESULT_COLOURS[result], linewidth=2, label=words)
        axes.set_aspect("equal")
        axes.set_xlim(x_low, x_high)
        axes.set_ylim(y_low, y_high)
        tidy(axes, "x, m", "y, m")
        self.figure.legend(
            loc="outside lower center", ncols=7, fontsize=7.5, frameon=False, columnspacing=1.2
        )

    def _draw_error(self, last: Moment) -> None:
        axes, course = self._error, last.course
        self._bound = axes.plot(
            [], [], color=TRUTH, linewidth=1, linestyle="--", label="2 sigma, by the filter"
        )[0]
        self._off = axes.plot([], [], color=ESTIMATE, linewidth=1, label="position error")[0]
        highest_cm = 100.0 * max(np.nanmax(course.error_m), _SIGMAS * np.nanquantile(course.sd_m, 0.95), 0.01)
        axes.set_xlim(0.0, course.time_s[-1])
        axes.set_ylim(0.0, 1.3 * highest_cm)
        tidy(axes, "time, s", "cm")
        axes.legend(loc="upper left", fontsize=8, frameon=False)

    def show(self, moment: Moment) -> Image.Image:
        """The frame of that moment."""
        course = moment.course
        self._truth.set_data(*course.truth[:, :2].T)
        self._path.set_data(*course.estimate[:, :2].T)
        self._off.set_data(course.time_s, 100.0 * course.error_m)
        self._bound.set_data(course.time_s, 100.0 * _SIGMAS * course.sd_m)
        for robot, pose in zip(self._robots, (course.truth[-1], course.estimate[-1]), strict=True):
            nose = pose[:2] + _NOSE_M * np.array([math.cos(pose[2]), math.sin(pose[2])])
            robot.set_data(*np.array([pose[:2], nose]).T)
        rays = [_ray(self._stage.sensor, course.estimate[-1], one) for one in moment.frame]
        self._rays.set_segments(rays)
        self._rays.set_color([RESULT_COLOURS[one.verdict] for one in moment.frame])
        self._rays.set_linewidth([3.0 if one.wrong else 1.6 for one in moment.frame])
        self._map.set_data([one.x_m for one in moment.beacons], [one.y_m for one in moment.beacons])
        self._show_ellipses(moment)
        self.figure.canvas.draw()
        return Image.fromarray(np.asarray(self.figure.canvas.buffer_rgba())).convert("RGB")

    def _show_ellipses(self, moment: Moment) -> None:
        """Of the beacons and of the robot."""
        if self._ellipses is not None:
            self._ellipses.remove()
        places = [((one.x_m, one.y_m), one.covariance_m2) for one in moment.beacons]
        places.append((tuple(moment.course.estimate[-1, :2]), moment.covariance_m2))
        shapes = [_axes(covariance_m2) for _, covariance_m2 in places]
        self._ellipses = EllipseCollection(
            *zip(*shapes, strict=True),
            units="xy",
            offsets=[place for place, _ in places],
            offset_transform=self._room.transData,
            facecolors="none",
            edgecolors=[*[SECOND] * len(moment.beacons), ESTIMATE],
            linewidths=1.3,
            zorder=4,
        )
        self._room.add_collection(self._ellipses)


def _axes(covariance_m2: NDArray[np.float64]) -> tuple[float, float, float]:
    """Width, height in m and angle in degrees of its ellipse."""
    variances, directions = np.linalg.eigh(covariance_m2)
    minor_m, major_m = 2.0 * _SIGMAS * np.sqrt(np.maximum(variances, 0.0))
    return major_m, minor_m, math.degrees(math.atan2(directions[1, 1], directions[0, 1]))


def _ray(
    sensor: tuple[float, float, float], pose: NDArray[np.float64], told: Any
) -> list[tuple[float, float]]:
    x_m, y_m, yaw_rad = sensor
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x0_m, y0_m = pose[0] + c * x_m - s * y_m, pose[1] + s * x_m + c * y_m
    reach_m, course_rad = told.range_m or _RAY_M, pose[2] + yaw_rad + told.bearing_rad
    return [(x0_m, y0_m), (x0_m + reach_m * math.cos(course_rad), y0_m + reach_m * math.sin(course_rad))]


def film(stage: Stage, moments: Sequence[Moment], suffix: str) -> bytes:
    """The animated picture, of one of SUFFIXES; it goes round and round."""
    scene = _Scene(stage, moments)
    frames = [scene.show(one) for one in moments]
    times_ms = [_FRAME_MS] * (len(frames) - 1) + [_END_MS]
    if suffix == ".gif":
        # One palette, of the frame that shows most: with one of its own each frame would flicker.
        palette = frames[-1].quantize(_COLOURS, dither=Image.Dither.NONE)
        frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in frames]
    buffer = io.BytesIO()
    first, *rest = frames
    words = {"save_all": True, "append_images": rest, "duration": times_ms, "loop": 0}
    first.save(buffer, format=suffix[1:], **words, **({} if suffix == ".gif" else {"lossless": True}))
    return buffer.getvalue()
