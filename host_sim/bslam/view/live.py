"""The page that `bslam live` serves: a Bokeh document that follows a run, and tells it to wait or go on.

A browser holds one document, a second one another; all show the same run. A document asks for the newest
moment many times a second and sends what is new. What moves at every step lies in a plot of its own, without
axes and with one glyph, over that of the room: a browser draws the whole of a plot anew if anything in it
changes. What nobody reads so fast is sent twice a second or so; of the paths only the rows that were added.
"""

from __future__ import annotations

import base64
import html
import io
import math
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, Protocol

import numpy as np
from bokeh.document import Document
from bokeh.layouts import row
from bokeh.models import Button, ColumnDataSource, CustomJS, Div, HoverTool, RadioButtonGroup, Range1d
from bokeh.plotting import figure
from numpy.typing import NDArray

from bslam.moment import FAILED, FINISHED, RUNNING, Moment, Shown, Spot, Stage, Told
from bslam.view.frames import RIGHT, UNKNOWN, WRONG, Mark, annotate
from bslam.view.style import BAND, BEACON, ESTIMATE, SECOND, TRUTH, WALL

SPEEDS: Final[dict[str, float]] = {
    "1/4": 0.25,
    "1": 1.0,
    "4": 4.0,
    "16": 16.0,
    "as fast as it goes": math.inf,
}
RESULT_COLOURS: Final = {
    "matched": BAND,
    "new": ESTIMATE,
    "deferred": "#e08e0b",
    "rejected": SECOND,
    "refused": SECOND,
}
_ON_FRAME: Final = {"matched": RIGHT, "new": "#5ab4ff", "rejected": WRONG, "refused": WRONG}
RESULT_WORDS: Final = {"matched": "fused", "new": "new beacon"}
_REFRESH_MS: Final = 20
_UNDER_WAY_MOST: Final = 2  # moments sent that the browser has not drawn: while it draws one the next travels
_SLOW_S: Final = 0.4
_ROWS_MOST: Final = 4000  # of a path: more than a screen has pixels only costs time
_SIGMAS: Final = 2.0  # size of the ellipses
_RAY_M: Final = 3.0  # of a sighting without a distance and without a beacon
_NOSE_M: Final = 0.35  # how far the robot's heading is drawn
_DOT_M: Final = 1e-3  # length of a line that is drawn as a dot, its ends being round
_ROUND: Final = np.linspace(0.0, math.tau, 25)
_TOLD_SHOWN: Final = 16
_ROOM_PX: Final = 640
_FRAME_PX: Final = (560.0, 480.0)  # at most, of the room's plot without its axes
_BORDER: Final = {"min_border_left": 60, "min_border_top": 30, "min_border_bottom": 55, "min_border_right": 8}
_SIDE_PX: Final = 560


# Each part is a document of its own in it: where a text changes, only that text is laid out anew.
_KEY: Final = {
    "true path": TRUTH,
    "estimated path": ESTIMATE,
    "true beacon": "#b48a00",
    "mapped beacon, 2 sigma": SECOND,
}
# Beside the plot: in it, it would be drawn anew with every step.
_LEGEND: Final = " ".join(
    f"<b style='color: {colour}; padding: 0 0.5em'>{words}</b>" for words, colour in _KEY.items()
)
_TEMPLATE: Final = """
{% block contents %}
<div style="display: flex; gap: 1em; flex-wrap: wrap; align-items: center">
  {{ embed(roots.bar) }}{{ embed(roots.status) }}
</div>
<div style="display: flex; gap: 0.5em">
  <div>
    <div style="position: relative">
      {{ embed(roots.room) }}
      <div style="position: absolute; left: 0; top: 0; pointer-events: none">{{ embed(roots.now) }}</div>
    </div>
    {{ embed(roots.legend) }}{{ embed(roots.error) }}</div>
  <div>
    <img id="camera" alt="camera" width="{{ side_px }}" src="{{ frame }}"
      {% if not has_camera %}hidden{% endif %}>
    {{ embed(roots.told) }}
  </div>
</div>
{% endblock %}
"""


# The camera's frame goes into an image of the page's own: in a part of the document it would be made anew
# each time. The rest after a frame of the browser's: a browser that is slow, or whose page nobody looks at,
# gets less and later, instead of a queue that grows.
_ON_STATUS: Final = """
if (frame.data.src.length) document.getElementById("camera").src = frame.data.src[0]
requestAnimationFrame(() => { drawn.data = {times: [drawn.data.times[0] + 1]} })
"""


_Line = tuple[NDArray[np.float64], str, float, float]
"""Points (n, 2) in m, colour, width in px, alpha."""


class Controls(Protocol):
    """What the page tells the run."""

    @property
    def playing(self) -> bool:
        """It goes on by itself."""

    @property
    def speed(self) -> float:
        """So many times as fast as the robot drives."""

    def play(self) -> None:
        """Go on by itself."""

    def pause(self) -> None:
        """Stand still after the step that is under way."""

    def step(self) -> None:
        """Go one step and stand still."""

    def set_speed(self, speed: float) -> None:
        """So many times as fast as the robot drives."""


class Page:
    """One document. moment: gives the newest state of the run."""

    def __init__(
        self, document: Document, stage: Stage, moment: Callable[[], Moment], controls: Controls
    ) -> None:
        self._stage, self._moment, self._controls = stage, moment, controls
        self._drawn: Moment | None = None
        self._under_way = 0  # moments that were sent and that the browser has not drawn yet
        # Rows of the course that are in the document, and the truth that they belong to, by source.
        self._sent: dict[str, tuple[int, NDArray[np.float64] | None]] = {}
        self._slowly_s = 0.0
        self._drawn_rows = 0  # of the course, in the room's plot
        self._sources = {name: ColumnDataSource(columns) for name, columns in _EMPTY.items()}
        self._sources["walls"].data = dict(zip(("x0", "y0", "x1", "y1"), stage.walls_m.T, strict=True))
        self._status, self._told = Div(), Div(width=_SIDE_PX)
        drawn = ColumnDataSource({"times": [0]})
        drawn.on_change("data", lambda _attribute, _old, _new: self._note_drawn())
        told = {"drawn": drawn, "frame": self._sources["frame"]}
        self._status.js_on_change("text", CustomJS(args=told, code=_ON_STATUS))
        self._pause = Button(label="Play", button_type="primary", width=90)
        self._step = Button(label="Step", width=90)
        speed = RadioButtonGroup(labels=list(SPEEDS))
        if controls.speed in SPEEDS.values():
            speed.active = list(SPEEDS.values()).index(controls.speed)
        self._pause.on_click(self._toggle)
        self._step.on_click(controls.step)
        speed.on_change("active", lambda _attr, _old, new: controls.set_speed(list(SPEEDS.values())[new]))
        bar = row(self._pause, self._step, Div(text="times real speed:"), speed)
        room = self._room_plot()
        parts = {"bar": bar, "status": self._status, "room": room, "now": self._now_plot(room)}
        parts["error"] = self._error_plot()
        parts |= {"told": self._told, "legend": Div(text=_LEGEND)}
        for name, part in parts.items():
            part.name = name
            document.add_root(part)
        document.template = _TEMPLATE
        document.title = f"bslam: {stage.title}"
        document.add_periodic_callback(self.refresh, _REFRESH_MS)
        self.refresh()
        shown = self._sources["frame"].data["src"]
        document.template_variables.update(
            side_px=_SIDE_PX, has_camera=stage.has_camera, frame="".join(shown)
        )
        self._under_way = _UNDER_WAY_MOST  # until the browser has all of that
        document.on_event("document_ready", lambda _event: self._note_drawn(all_of_it=True))

    def _note_drawn(self, all_of_it: bool = False) -> None:
        self._under_way = 0 if all_of_it else max(self._under_way - 1, 0)
        self.refresh()

    def _toggle(self) -> None:
        if self._controls.playing:
            self._controls.pause()
        else:
            self._controls.play()

    def _room_plot(self) -> Any:
        """What stays or grows in the plane; as much of it as the walls and the truth take."""
        x_low, y_low, x_high, y_high = self._stage.extent_m
        px_per_m = min(_FRAME_PX[0] / (x_high - x_low), _FRAME_PX[1] / (y_high - y_low))
        plot = figure(
            frame_width=round(px_per_m * (x_high - x_low)),
            frame_height=round(px_per_m * (y_high - y_low)),
            x_range=Range1d(x_low, x_high),
            y_range=Range1d(y_low, y_high),
            tools="pan,wheel_zoom,box_zoom,reset,save",
            active_scroll="wheel_zoom",
            x_axis_label="x, m",
            y_axis_label="y, m",
            title=self._stage.title,
            **_BORDER,
        )
        source = self._sources
        plot.segment("x0", "y0", "x1", "y1", source=source["walls"], color=WALL, line_width=3)
        line = {"line_width": 3, "line_alpha": 0.5, "color": TRUTH}
        plot.line("x", "y", source=source["truth"], **line)
        plot.line("x", "y", source=source["path"], color=ESTIMATE)
        star = {"color": BEACON, "line_color": "#6b4b00", "size": 16}
        plot.scatter("x", "y", source=source["beacons"], marker="star", **star)
        outline = {"fill_color": None, "line_color": SECOND, "line_alpha": "alpha", "line_width": 1.5}
        plot.ellipse("x", "y", "width", "height", "angle", source=source["map"], **outline)
        cross = {"color": SECOND, "alpha": "alpha", "size": 11}
        crosses = plot.scatter("x", "y", source=source["map"], marker="cross", **cross)
        tips = [("beacon", "@name"), ("sightings", "@sightings"), ("sd, m", "@sd_m{0.000}")]
        plot.add_tools(HoverTool(renderers=[crosses], tooltips=tips))
        return plot

    def _now_plot(self, room: Any) -> Any:
        """What moves: lies over the room's plot, shows the same part of the plane, lets the mouse through."""
        plot = figure(
            frame_width=room.frame_width,
            frame_height=room.frame_height,
            x_range=room.x_range,
            y_range=room.y_range,
            tools="",
            toolbar_location=None,
            background_fill_color=None,
            border_fill_color=None,
            outline_line_color=None,
            **_BORDER,
        )
        plot.axis.visible = False
        plot.grid.visible = False
        lines = {"color": "colour", "line_width": "width", "line_alpha": "alpha", "line_cap": "round"}
        plot.multi_line("xs", "ys", source=self._sources["now"], **lines)
        return plot

    def _error_plot(self) -> Any:
        plot = figure(
            width=_ROOM_PX,
            height=210,
            tools="pan,wheel_zoom,box_zoom,reset,save",
            x_axis_label="time, s",
            y_axis_label="m",
            title="position error" + (" after alignment so far" if self._stage.aligned else ""),
        )
        plot.line(
            "t", "sd", source=self._sources["errors"], color=BAND, legend_label="2 sigma, by the filter"
        )
        plot.line("t", "error", source=self._sources["errors"], color=ESTIMATE, legend_label="error")
        plot.legend.location = "top_left"
        plot.legend.background_fill_alpha = 0.5
        return plot

    def refresh(self) -> None:
        """Send what is new since the last time, unless the browser is still busy with that."""
        moment = self._moment()
        if moment is self._drawn or self._under_way >= _UNDER_WAY_MOST:
            return
        self._drawn = moment
        self._pause.label = "Pause" if self._controls.playing else "Play"
        self._pause.disabled = self._step.disabled = moment.state in (FINISHED, FAILED)
        if moment.shown is not None:  # before the status, whose change shows it
            self._sources["frame"].data = {"src": [_frame_url(moment.shown)]}
        words = self._words(moment)
        self._under_way += words != self._status.text
        self._status.text = words
        self._sources["now"].data = self._now(moment)
        now_s = time.monotonic()
        if moment.state != RUNNING or now_s - self._slowly_s > _SLOW_S:
            self._slowly_s = now_s
            self._send_slowly(moment)

    def _words(self, moment: Moment) -> str:
        course = moment.course
        words = [moment.state, f"step {moment.step} of {self._stage.steps}"]
        if len(course.time_s):
            words.append(f"time {course.time_s[-1]:.2f} s")
            words.append("pose ({:.2f} m, {:.2f} m, {:.3f} rad)".format(*course.estimate[-1]))
            if np.isfinite(course.error_m[-1]):
                words.append(f"error {100.0 * course.error_m[-1]:.1f} cm")
        text = html.escape(" · ".join(words))
        if moment.message:
            text += f"<br><b>{html.escape(moment.message)}</b>"
        return text

    def _send_slowly(self, moment: Moment) -> None:
        """What costs the browser much and nobody can read so fast."""
        self._sources["beacons"].data = _columns(("x", "y"), moment.true_beacons_m)
        self._sources["map"].data = _map_columns(moment.beacons)
        self._told.text = _told_table(moment.told[:_TOLD_SHOWN])
        course = moment.course
        self._send_rows("errors", moment, (course.time_s, course.error_m, _SIGMAS * course.sd_m))
        self._send_rows("path", moment, (course.estimate[:, 0], course.estimate[:, 1]))
        self._send_rows("truth", moment, (course.truth[:, 0], course.truth[:, 1]))
        self._drawn_rows = len(course.time_s)

    def _send_rows(self, name: str, moment: Moment, columns: Sequence[NDArray[np.float64]]) -> None:
        """The rows that were added; all of them where the truth was moved."""
        thin, truth = max(1, self._stage.steps // _ROWS_MOST), moment.course.truth.base
        sent, of_truth = self._sent.get(name, (0, None))
        first = -(-sent // thin) * thin if of_truth is truth else 0
        new = {key: one[first::thin] for key, one in zip(_EMPTY[name], columns, strict=True)}
        self._sent[name] = (len(columns[0]), truth)
        if of_truth is truth:
            self._sources[name].stream(new)
        else:
            self._sources[name].data = new

    def _now(self, moment: Moment) -> dict[str, list[Any]]:
        """Lines, as columns: the last bits of both paths, rays, robots, the estimate's ellipse."""
        course = moment.course
        if not len(course.time_s):
            return _EMPTY["now"]
        estimate, truth = course.estimate[-1], course.truth[-1]
        tail = slice(max(self._drawn_rows - 1, 0), None)
        lines = [(course.truth[tail, :2], TRUTH, 3.0, 0.5), (course.estimate[tail, :2], ESTIMATE, 1.0, 1.0)]
        lines += self._rays(estimate, moment)
        lines.append((_ellipse(estimate[:2], moment.covariance_m2), ESTIMATE, 1.5, 1.0))
        lines += _robot(truth, TRUTH) if np.isfinite(truth).all() else []
        lines += _robot(estimate, ESTIMATE)
        points, colour, width, alpha = zip(*lines, strict=True)
        xs, ys = ([one[:, axis].tolist() for one in points] for axis in (0, 1))
        return {"xs": xs, "ys": ys, "colour": list(colour), "width": list(width), "alpha": list(alpha)}

    def _rays(self, pose: NDArray[np.float64], moment: Moment) -> list[_Line]:
        """From the sensor along each bearing of the newest frame, as far as the sighting says."""
        x_m, y_m, yaw_rad = self._stage.sensor
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x0, y0 = pose[0] + c * x_m - s * y_m, pose[1] + s * x_m + c * y_m
        spots = {one.uid: one for one in moment.beacons}
        rays: list[_Line] = []
        for told in moment.frame:
            spot = spots.get(-1 if told.beacon_uid is None else told.beacon_uid)
            reach_m = told.range_m
            if reach_m is None:
                reach_m = _RAY_M if spot is None else math.hypot(spot.x_m - x0, spot.y_m - y0)
            course_rad = pose[2] + yaw_rad + told.bearing_rad
            end = (x0 + reach_m * math.cos(course_rad), y0 + reach_m * math.sin(course_rad))
            rays.append((np.array([(x0, y0), end]), RESULT_COLOURS[told.result], 1.5, 1.0))
        return rays


_EMPTY: Final[dict[str, dict[str, list[Any]]]] = {
    "frame": {"src": []},
    "walls": {"x0": [], "y0": [], "x1": [], "y1": []},
    "truth": {"x": [], "y": []},
    "path": {"x": [], "y": []},
    "errors": {"t": [], "error": [], "sd": []},
    "beacons": {"x": [], "y": []},
    "map": {
        name: [] for name in ("x", "y", "width", "height", "angle", "alpha", "name", "sightings", "sd_m")
    },
    "now": {"xs": [], "ys": [], "colour": [], "width": [], "alpha": []},
}


def _robot(pose: NDArray[np.float64], colour: str) -> list[_Line]:
    """A dot, and a line where it looks to."""
    ahead = np.array([math.cos(pose[2]), math.sin(pose[2])])
    ends = [np.array([pose[:2], pose[:2] + reach_m * ahead]) for reach_m in (_DOT_M, _NOSE_M)]
    return [(ends[0], colour, 11.0, 1.0), (ends[1], colour, 3.0, 1.0)]


def _ellipse(at_m: NDArray[np.float64], covariance_m2: NDArray[np.float64]) -> NDArray[np.float64]:
    """Its outline, at _SIGMAS."""
    variances, directions = np.linalg.eigh(covariance_m2)
    radii_m = _SIGMAS * np.sqrt(np.maximum(variances, 0.0))
    return at_m + (np.column_stack([np.cos(_ROUND), np.sin(_ROUND)]) * radii_m) @ directions.T


def _columns(names: Iterable[str], table: NDArray[np.float64]) -> dict[str, Any]:
    return {name: table[:, index] for index, name in enumerate(names)}


def _ellipses(parts: Sequence[tuple[float, float, NDArray[np.float64]]]) -> dict[str, list[Any]]:
    """Centres and covariances as the columns of an ellipse, at _SIGMAS."""
    columns: dict[str, list[Any]] = {"x": [], "y": [], "width": [], "height": [], "angle": []}
    for x_m, y_m, covariance_m2 in parts:
        variances, directions = np.linalg.eigh(covariance_m2)
        minor_m, major_m = 2.0 * _SIGMAS * np.sqrt(np.maximum(variances, 0.0))
        angle_rad = math.atan2(directions[1, 1], directions[0, 1])
        for name, value in zip(columns, (x_m, y_m, major_m, minor_m, angle_rad), strict=True):
            columns[name].append(float(value))
    return columns


def _map_columns(beacons: Sequence[Spot]) -> dict[str, Any]:
    columns = _ellipses([(one.x_m, one.y_m, one.covariance_m2) for one in beacons])
    return columns | {
        "alpha": [0.95 if one.confirmed else 0.35 for one in beacons],
        "name": [str(one.label if one.label >= 0 else one.uid) for one in beacons],
        "sightings": [one.sightings for one in beacons],
        "sd_m": [math.sqrt(max(float(np.trace(one.covariance_m2)), 0.0)) for one in beacons],
    }


def _told_table(told: Sequence[Told]) -> str:
    """What became of the newest sightings, and why."""
    heads = ("time, s", "bearing, rad", "range, m", "true beacon", "became", "why", "beacon", "test ratio")
    rows = "".join(_told_row(one) for one in told)
    cells = "".join(f"<th style='padding: 0 0.7em'>{head}</th>" for head in heads)
    return f"<table style='text-align: right; font-size: 12px'><tr>{cells}</tr>{rows}</table>"


def _told_row(one: Told) -> str:
    cells = (
        f"{one.time_s:.2f}",
        f"{one.bearing_rad:.3f}",
        "-" if one.range_m is None else f"{one.range_m:.2f}",
        "-" if one.true_id < 0 else str(one.true_id),
        RESULT_WORDS.get(one.result, one.result),
        "" if one.reason == "none" else one.reason,
        "" if one.beacon_uid is None else str(one.beacon_uid),
        "" if one.test_ratio is None else f"{one.test_ratio:.2f}",
    )
    style = f"color: {RESULT_COLOURS[one.result]}"
    return f"<tr style='{style}'>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>"


def _frame_url(shown: Shown) -> str:
    """The frame with its boxes, as a browser takes it in place of an address."""
    marks = [Mark(one.outline, one.lines, _ON_FRAME.get(one.result, UNKNOWN)) for one in shown.boxes]
    buffer = io.BytesIO()
    annotate(shown.rgb, marks, shown.caption).save(buffer, format="JPEG", quality=80)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f"data:image/jpeg;base64,{data}"
