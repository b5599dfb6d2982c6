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
from PIL import Image, ImageColor

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
_LEVELS: Final = 5  # of each colour in a GIF's palette
_SIGMAS: Final = 2.0
_RAY_M: Final = 3.0  # of a sighting without a distance
_NOSE_M: Final = 0.45
_TENTATIVE: Final = (SECOND, 0.4)  # a beacon that the filter has yet to confirm
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
        walls = stage.walls_m.reshape(-1, 2, 2).tolist()
        axes.add_collection(LineCollection(walls, colors=WALL, linewidths=2.5))
        axes.plot(*beacons_m.T, "*", color=BEACON, markersize=11, markeredgecolor="#6b4b00", zorder=3)
        self._truth = axes.plot([], [], color=TRUTH, linewidth=2.6, alpha=0.45, label="true path")[0]
        self._path = axes.plot([], [], color=ESTIMATE, linewidth=1.1, label="estimate")[0]
        self._rays = axes.add_collection(LineCollection([], zorder=2))
        self._map = axes.plot([], [], "+", color=SECOND, markersize=7, zorder=4, label="map, 2 sigma")[0]
        axes.plot([], [], "o", color=_TENTATIVE, fillstyle="none", markersize=8, label="tentative")
        self._ellipses: Any = None
        style: dict[str, Any] = {"linewidth": 2.5, "marker": "o", "markevery": [0], "markersize": 7}
        self._robots = [axes.plot([], [], color=one, zorder=5, **style)[0] for one in (TRUTH, ESTIMATE)]
        for result, words in _SHOWN.items():
            axes.plot([], [], color=RESULT_COLOURS[result], linewidth=2, label=words)
        axes.set_aspect("equal")
        axes.set_xlim(x_low, x_high)
        axes.set_ylim(y_low, y_high)
        tidy(axes, "x, m", "y, m")
        style = {"ncols": 4, "fontsize": 8, "frameon": False, "columnspacing": 1.2}
        self.figure.legend(loc="outside lower center", **style)

    def _draw_error(self, last: Moment) -> None:
        axes, course = self._error, last.course
        words = {"linestyle": "--", "label": "2 sigma, by the filter"}
        self._bound = axes.plot([], [], color=TRUTH, linewidth=1, **words)[0]
        self._off = axes.plot([], [], color=ESTIMATE, linewidth=1, label="position error")[0]
        highest_cm = 100.0 * max(np.nanmax(course.error_m), _SIGMAS * np.max(course.sd_m), 0.01)
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
        self._rays.set_segments(_rays(self._stage.sensor, moment))
        self._rays.set_color([RESULT_COLOURS[one.verdict] for one in moment.frame])
        self._rays.set_linewidth([3.0 if one.wrong else 1.6 for one in moment.frame])
        self._map.set_data([one.x_m for one in moment.beacons], [one.y_m for one in moment.beacons])
        self._show_ellipses(moment)
        canvas: Any = self.figure.canvas
        canvas.draw()
        return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

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
            edgecolors=[*[SECOND if one.confirmed else _TENTATIVE for one in moment.beacons], ESTIMATE],
            linewidths=1.3,
            zorder=4,
        )
        self._room.add_collection(self._ellipses)


def _axes(covariance_m2: NDArray[np.float64]) -> tuple[float, float, float]:
    """Width, height in m and angle in degrees of its ellipse."""
    variances, directions = np.linalg.eigh(covariance_m2)
    minor_m, major_m = 2.0 * _SIGMAS * np.sqrt(np.maximum(variances, 0.0))
    return major_m, minor_m, math.degrees(math.atan2(directions[1, 1], directions[0, 1]))


def _rays(sensor: tuple[float, float, float], moment: Moment) -> list[Any]:
    """Both ends of each: as far as the sighting says, else to the beacon it was taken for."""
    x_m, y_m, yaw_rad = sensor
    *here_m, heading_rad = moment.course.estimate[-1]
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    start_m = np.array([here_m[0] + c * x_m - s * y_m, here_m[1] + s * x_m + c * y_m])
    spots = {one.uid: np.array([one.x_m, one.y_m]) for one in moment.beacons}
    rays = []
    for told in moment.frame:
        reach_m, course_rad = told.range_m, heading_rad + yaw_rad + told.bearing_rad
        if reach_m is None:
            spot_m = None if told.beacon_uid is None else spots.get(told.beacon_uid)
            reach_m = _RAY_M if spot_m is None else float(np.hypot(*(spot_m - start_m)))
        rays.append([start_m, start_m + reach_m * np.array([math.cos(course_rad), math.sin(course_rad)])])
    return rays


def _palette() -> Image.Image:
    """The colours that are drawn and their ways to white, as smooth edges have them."""
    drawn = (TRUTH, ESTIMATE, SECOND, BEACON, WALL, "#6b4b00", *dict.fromkeys(RESULT_COLOURS.values()))
    white = np.full(3, 255.0)
    levels = np.linspace(1.0, 1.0 / _LEVELS, _LEVELS)[:, None, None]
    solid = np.array([ImageColor.getrgb(one) for one in drawn], dtype=np.float64)
    colours = (white + levels * (solid - white)).reshape(-1, 3)
    image = Image.new("P", (1, 1))
    image.putpalette([255, 255, 255, *colours.round().astype(int).ravel().tolist()])
    return image


def film(stage: Stage, moments: Sequence[Moment], suffix: str) -> bytes:
    """The animated picture, of one of SUFFIXES; it goes round and round."""
    scene = _Scene(stage, moments)
    frames = [scene.show(one) for one in moments]
    times_ms = [_FRAME_MS] * (len(frames) - 1) + [_END_MS]
    if suffix == ".gif":
        palette = _palette()  # with one of its own each frame would flicker
        frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in frames]
    buffer = io.BytesIO()
    first, *rest = frames
    words = {"save_all": True, "append_images": rest, "duration": times_ms, "loop": 0}
    first.save(buffer, format=suffix[1:], **words, **({} if suffix == ".gif" else {"lossless": True}))
    return buffer.getvalue()
