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
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, Protocol

import numpy as np
from bokeh.document import Document
from bokeh.models import Button, ColumnDataSource, CustomJS, Div, HoverTool, RadioButtonGroup, Range1d
from bokeh.plotting import figure
from numpy.typing import NDArray

from bslam.moment import FAILED, FINISHED, RUNNING, Moment, Shown, Spot, Stage, Told
from bslam.view.frames import RIGHT, UNKNOWN, WRONG, Mark, annotate
from bslam.view.style import (
    BAND,
    BEACON,
    ESTIMATE,
    RESULT_COLOURS,
    RESULT_DASHES,
    SECOND,
    TRUTH,
    WALL,
    WRONG_RESULT,
)

SPEEDS: Final[dict[str, float]] = {
    "1/4": 0.25,
    "1": 1.0,
    "4": 4.0,
    "16": 16.0,
    "as fast as it goes": math.inf,
}
RESULT_WORDS: Final = {"matched": "fused", "new": "new beacon", "deferred": "undecided"}
_ON_FRAME: Final = {"matched": RIGHT, "new": "#5ab4ff", WRONG_RESULT: WRONG, "rejected": "#e59cff"}
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
# Room for ticks and labels round the plane; the tools are at the right. Always the same, so that what moves
# lies on what stays, and so that the page knows how high the plane is for its width.
_LEFT_PX, _RIGHT_PX, _TOP_PX, _BOTTOM_PX = 52, 36, 6, 48
_BORDER: Final = {
    "min_border_left": _LEFT_PX,
    "min_border_right": _RIGHT_PX,
    "min_border_top": _TOP_PX,
    "min_border_bottom": _BOTTOM_PX,
}
_TRUE_BEACON: Final = "#6b4b00"
_SIGMA_DASH: Final = [6, 3]

_HELP: Final = (
    "Each ray is a sighting of this moment, in the colour of what the filter made of it. Pause, then Step or "
    "Play; at the end, Again. Zoom and pan with the tools beside a plot."
)


def _swatch(colour: str, width: float, dash: str = "", opacity: float = 1.0) -> str:
    """A short line as it is drawn in the plot."""
    return (
        f'<svg width="26" height="10"><line x1="1" y1="5" x2="25" y2="5" stroke="{colour}" '
        f'stroke-width="{width}" stroke-dasharray="{dash}" stroke-opacity="{opacity}"/></svg>'
    )


def _sign(sign: str, colour: str) -> str:
    return f'<b style="color: {colour}">{sign}</b>'


_PATHS: Final = [
    (_swatch(TRUTH, 3, opacity=0.5), "true path"),
    (_swatch(ESTIMATE, 1.5), "estimated path"),
    (_sign("&#9733; 3", _TRUE_BEACON), "true beacon"),
    (_sign("+ #2", SECOND), "mapped beacon, ellipse 2 sigma"),
]
_RAYS: Final = [
    (_swatch(RESULT_COLOURS["matched"], 2), "fused"),
    (_swatch(RESULT_COLOURS[WRONG_RESULT], 4), "wrong: fused with another beacon, or new twice"),
    (_swatch(RESULT_COLOURS["new"], 2), "new beacon"),
    (_swatch(RESULT_COLOURS["deferred"], 2, "6 4"), "undecided"),
    (_swatch(RESULT_COLOURS["rejected"], 2, "2 4"), "rejected"),
]
_ERRORS: Final = [
    (_swatch(ESTIMATE, 1.5), "error"),
    (_swatch(BAND, 1.5, "6 3"), "2 sigma, by the filter"),
]

# Each part is a document of its own in the page: where a text changes, only that text is laid out anew. The
# legends are beside the plots: in them, they would be drawn anew with every step.
_TEMPLATE: Final = """
{% block preamble %}
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
  main { padding: 4px 8px; font: 14px/1.4 system-ui, sans-serif; color: #222; }
  h1 { font-size: 18px; margin: 0 0 2px; overflow-wrap: anywhere; }
  h2 { font-size: 14px; margin: 8px 0 0; }
  p { margin: 2px 0; }
  .bar { display: flex; flex-wrap: wrap; align-items: center; gap: 2px 6px; }
  .parts { display: grid; grid-template-columns: minmax(0, 1fr); gap: 8px 20px; }
  @media (min-width: 1000px) {
    .parts { grid: auto 1fr / minmax(0, min(58%, var(--wide))) minmax(0, 55em); }
    .parts { --wide: max(400px, calc((100vh - 230px) / {{ ratio }} + {{ beside_px }}px)); }
    .parts > :first-child { grid-row: span 2; }
  }
  .room {
    position: relative;
    padding-bottom: calc((100% - {{ beside_px }}px) * {{ ratio }} + {{ below_px }}px);
  }
  .room > div { position: absolute; inset: 0; }
  .room > .now { pointer-events: none; }
  .key { display: flex; flex-wrap: wrap; gap: 0 14px; font-size: 13px; }
  #camera { width: 100%; }
</style>
{% endblock %}
{% macro key(rows) %}
<div class="key">{% for sign, words in rows %}<span>{{ sign|safe }} {{ words }}</span>{% endfor %}</div>
{% endmacro %}
{% block contents %}
<main>
<h1>bslam live: {{ heading }}</h1>
<p>{{ help }}</p>
<div class="bar">
  {{ embed(roots.pause) }}{{ embed(roots.step) }}<span>times real speed:</span>{{ embed(roots.speed) }}
</div>
{{ embed(roots.status) }}
<div class="parts">
  <div>
    <div class="room">
      <div>{{ embed(roots.room) }}</div>
      <div class="now">{{ embed(roots.now) }}</div>
    </div>
    {{ key(paths) }}{{ key(rays) }}
  </div>
  <div>
    <h2>{{ error_title }}</h2>
    {{ key(errors) }}
    {{ embed(roots.error) }}
  </div>
  <div>
    <img id="camera" alt="camera" src="{{ frame }}" {% if not has_camera %}hidden{% endif %}>
    <h2>What became of the newest sightings, anew every {{ slow_s }} s</h2>
    {{ embed(roots.told) }}
  </div>
</div>
</main>
{% endblock %}
"""
_TABLE_STYLE: Final = """
table { width: 100%; border-collapse: collapse; text-align: right; font-size: 12px; }
th, td { padding: 2px 4px; border-bottom: 1px solid #eee; }
th { vertical-align: bottom; }
@media (max-width: 480px) { :is(th, td):is(:nth-child(2), :nth-child(8)) { display: none; } }
"""


# The camera's frame goes into an image of the page's own: in a part of the document it would be made anew
# each time. The rest after a frame of the browser's: a browser that is slow, or whose page nobody looks at,
# gets less and later, instead of a queue that grows.
_ON_STATUS: Final = """
if (frame.data.src.length) document.getElementById("camera").src = frame.data.src[0]
requestAnimationFrame(() => { drawn.data = {times: [drawn.data.times[0] + 1]} })
"""

# A connection that was lost (a laptop asleep, a tunnel that broke) takes Bokeh's document with it: the page
# is loaded anew once there is a server again.
_ON_LOST: Final = """
const again = () => fetch(location.href, {cache: "no-store"}).then(() => location.reload(), later)
const later = () => setTimeout(again, 1000)
again()
"""


_Line = tuple[NDArray[np.float64], str, float, float, str]
"""Points (n, 2) in m, colour, width in px, alpha, dash."""


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
    """One document. moment: gives the newest state of the run. again: takes up a run that has ended."""

    def __init__(
        self,
        document: Document,
        stage: Stage,
        moment: Callable[[], Moment],
        controls: Controls,
        again: Callable[[], None],
    ) -> None:
        self._stage, self._moment, self._controls, self._again = stage, moment, controls, again
        self._drawn: Moment | None = None
        self._under_way = 0  # moments that were sent and that the browser has not drawn yet
        # Rows of the course that are in the document, and the truth that they belong to, by source.
        self._sent: dict[str, tuple[int, NDArray[np.float64] | None]] = {}
        self._slowly_s = 0.0
        self._drawn_rows = 0  # of the course, in the room's plot
        self._sources = {name: ColumnDataSource(columns) for name, columns in _EMPTY.items()}
        self._sources["walls"].data = dict(zip(("x0", "y0", "x1", "y1"), stage.walls_m.T, strict=True))
        fluid = {"sizing_mode": "stretch_width"}
        self._status, self._told = Div(**fluid), Div(**fluid, stylesheets=[_TABLE_STYLE])
        self._name = dict(zip(stage.beacon_id.tolist(), stage.beacon_name, strict=False))
        drawn = ColumnDataSource({"times": [0]})
        drawn.on_change("data", lambda _attribute, _old, _new: self._note_drawn())
        told = {"drawn": drawn, "frame": self._sources["frame"]}
        self._status.js_on_change("text", CustomJS(args=told, code=_ON_STATUS))
        self._pause = Button(label="Play", button_type="primary", width=80)
        self._step = Button(label="Step", width=80)
        self._speed = RadioButtonGroup(labels=list(SPEEDS))
        self._show_speed()
        self._pause.on_click(self._toggle)
        self._step.on_click(controls.step)
        self._speed.on_change("active", lambda _attribute, _old, new: self._set_speed(new))
        room = self._room_plot()
        parts: dict[str, Any] = {"pause": self._pause, "step": self._step, "speed": self._speed}
        parts |= {"status": self._status, "room": room, "now": self._now_plot(room)}
        parts |= {"error": self._error_plot(), "told": self._told}
        for name, part in parts.items():
            part.name = name
            document.add_root(part)
        document.template = _TEMPLATE
        document.title = f"bslam: {stage.title}"
        document.add_periodic_callback(self.refresh, _REFRESH_MS)
        document.js_on_event("connection_lost", CustomJS(code=_ON_LOST))
        self.refresh()
        shown = self._sources["frame"].data["src"]
        x_low, y_low, x_high, y_high = stage.extent_m
        document.template_variables.update(
            heading=html.escape(stage.title),  # Bokeh's templates escape nothing
            help=_HELP,
            paths=_PATHS,
            rays=_RAYS,
            errors=_ERRORS,
            slow_s=f"{_SLOW_S:g}",
            error_title="Position error, m" + (", after alignment so far" if stage.aligned else ""),
            ratio=(y_high - y_low) / (x_high - x_low),
            beside_px=_LEFT_PX + _RIGHT_PX,
            below_px=_TOP_PX + _BOTTOM_PX,
            has_camera=stage.has_camera,
            frame="".join(shown),
        )
        self._under_way = _UNDER_WAY_MOST  # until the browser has all of that
        document.on_event("document_ready", lambda _event: self._note_drawn(all_of_it=True))

    def _note_drawn(self, all_of_it: bool = False) -> None:
        self._under_way = 0 if all_of_it else max(self._under_way - 1, 0)
        self.refresh()

    def _toggle(self) -> None:
        has_ended = self._moment().state == FINISHED
        if has_ended:
            self._again()
        if self._controls.playing and not has_ended:
            self._controls.pause()
        else:
            self._controls.play()

    def _set_speed(self, active: int | None) -> None:
        if active is not None and (speed := list(SPEEDS.values())[active]) != self._controls.speed:
            self._controls.set_speed(speed)

    def _show_speed(self) -> None:
        """As it was chosen, here, on another page or by --speed, which has others, too."""
        speeds = list(SPEEDS.values())
        chosen = self._controls.speed
        self._speed.active = speeds.index(chosen) if chosen in speeds else None

    def _room_plot(self) -> Any:
        """What stays or grows in the plane; as much of it as the walls and the truth take."""
        x_low, y_low, x_high, y_high = self._stage.extent_m
        plot = figure(
            sizing_mode="stretch_both",
            x_range=Range1d(x_low, x_high),
            y_range=Range1d(y_low, y_high),
            tools="pan,wheel_zoom,box_zoom,reset,save",
            # None is active at first: a finger or a wheel that scrolls the page must not be caught.
            active_drag=None,
            active_scroll=None,
            x_axis_label="x, m",
            y_axis_label="y, m",
            **_BORDER,
        )
        source = self._sources
        plot.segment("x0", "y0", "x1", "y1", source=source["walls"], color=WALL, line_width=3)
        line = {"line_width": 3, "line_alpha": 0.5, "color": TRUTH}
        plot.line("x", "y", source=source["truth"], **line)
        plot.line("x", "y", source=source["path"], color=ESTIMATE)
        star = {"color": BEACON, "line_color": _TRUE_BEACON, "size": 16}
        plot.scatter("x", "y", source=source["beacons"], marker="star", **star)
        words: dict[str, Any] = {
            "text_font_size": "13px",
            "text_font_style": "bold",
            "text_baseline": "middle",
        }
        words |= {"background_fill_color": "white", "background_fill_alpha": 0.7}
        above = {"x_offset": 9, "y_offset": -11, "text_color": _TRUE_BEACON}
        plot.text("x", "y", "name", source=source["beacons"], **words, **above)
        outline = {"fill_color": None, "line_color": SECOND, "line_alpha": "alpha", "line_width": 1.5}
        plot.ellipse("x", "y", "width", "height", "angle", source=source["map"], **outline)
        cross = {"color": SECOND, "alpha": "alpha", "size": 11}
        crosses = plot.scatter("x", "y", source=source["map"], marker="cross", **cross)
        below = {"x_offset": -9, "y_offset": 12, "text_color": SECOND, "text_align": "right"}
        plot.text("x", "y", "name", source=source["map"], **words, **below)
        tips = [("beacon", "@name"), ("sightings", "@sightings"), ("sd, m", "@sd_m{0.000}")]
        plot.add_tools(HoverTool(renderers=[crosses], tooltips=tips))
        return plot

    def _now_plot(self, room: Any) -> Any:
        """What moves: lies over the room's plot, shows the same part of the plane, lets the mouse through."""
        plot = figure(
            sizing_mode="stretch_both",
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
        lines = {
            "color": "colour",
            "line_width": "width",
            "line_alpha": "alpha",
            "line_cap": "round",
            "line_dash": "dash",
        }
        plot.multi_line("xs", "ys", source=self._sources["now"], **lines)
        return plot

    def _error_plot(self) -> Any:
        plot = figure(
            sizing_mode="stretch_width",
            height=190,
            tools="pan,wheel_zoom,box_zoom,reset,save",
            active_drag=None,
            active_scroll=None,
            x_axis_label="time, s",
            y_axis_label="m",
            **_BORDER,
        )
        source = self._sources["errors"]
        plot.line("t", "sd", source=source, color=BAND, line_width=1.5, line_dash=_SIGMA_DASH)
        plot.line("t", "error", source=source, color=ESTIMATE, line_width=1.2)
        return plot

    def refresh(self) -> None:
        """Send what is new since the last time, unless the browser is still busy with that."""
        moment = self._moment()
        if moment is self._drawn or self._under_way >= _UNDER_WAY_MOST:
            return
        self._drawn = moment
        has_ended = moment.state == FINISHED
        self._pause.label = "Again" if has_ended else "Pause" if self._controls.playing else "Play"
        self._pause.disabled = moment.state == FAILED
        self._step.disabled = moment.state in (FINISHED, FAILED)
        self._show_speed()
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
        names = list(self._stage.beacon_name) or [""] * len(moment.true_beacons_m)
        self._sources["beacons"].data = _columns(("x", "y"), moment.true_beacons_m) | {"name": names}
        self._sources["map"].data = _map_columns(moment.beacons)
        self._told.text = _told_table(moment.told[:_TOLD_SHOWN], self._name)
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
        lines: list[_Line] = [(course.truth[tail, :2], TRUTH, 3.0, 0.5, "solid")]
        lines.append((course.estimate[tail, :2], ESTIMATE, 1.0, 1.0, "solid"))
        lines += self._rays(estimate, moment)
        lines.append((_ellipse(estimate[:2], moment.covariance_m2), ESTIMATE, 1.5, 1.0, "solid"))
        lines += _robot(truth, TRUTH) if np.isfinite(truth).all() else []
        lines += _robot(estimate, ESTIMATE)
        points, colour, width, alpha, dash = zip(*lines, strict=True)
        xs, ys = ([one[:, axis].tolist() for one in points] for axis in (0, 1))
        style = {"colour": list(colour), "width": list(width), "alpha": list(alpha), "dash": list(dash)}
        return {"xs": xs, "ys": ys, **style}

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
            result = told.verdict
            width_px, dash = 4.0 if told.wrong else 2.0, RESULT_DASHES.get(result, "solid")
            rays.append((np.array([(x0, y0), end]), RESULT_COLOURS[result], width_px, 1.0, dash))
        return rays


_EMPTY: Final[dict[str, dict[str, list[Any]]]] = {
    "frame": {"src": []},
    "walls": {"x0": [], "y0": [], "x1": [], "y1": []},
    "truth": {"x": [], "y": []},
    "path": {"x": [], "y": []},
    "errors": {"t": [], "error": [], "sd": []},
    "beacons": {"x": [], "y": [], "name": []},
    "map": {
        name: [] for name in ("x", "y", "width", "height", "angle", "alpha", "name", "sightings", "sd_m")
    },
    "now": {"xs": [], "ys": [], "colour": [], "width": [], "alpha": [], "dash": []},
}


def _robot(pose: NDArray[np.float64], colour: str) -> list[_Line]:
    """A dot, and a line where it looks to."""
    ahead = np.array([math.cos(pose[2]), math.sin(pose[2])])
    ends = [np.array([pose[:2], pose[:2] + reach_m * ahead]) for reach_m in (_DOT_M, _NOSE_M)]
    return [(ends[0], colour, 11.0, 1.0, "solid"), (ends[1], colour, 3.0, 1.0, "solid")]


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
        "name": [_number(one.uid) for one in beacons],
        "sightings": [one.sightings for one in beacons],
        "sd_m": [math.sqrt(max(float(np.trace(one.covariance_m2)), 0.0)) for one in beacons],
    }


def _number(uid: int) -> str:
    """A mapped beacon's, in the map and in the table: true beacons have numbers of their own."""
    return f"#{uid}"


def _told_table(told: Sequence[Told], name: Mapping[int, str]) -> str:
    """What became of the newest sightings, and why; name: of the true beacons."""
    heads = ("time, s", "bearing, rad", "range, m", "true beacon", "taken for", "became", "why", "test ratio")
    rows = "".join(_told_row(one, name) for one in told)
    return f"<table><tr>{''.join(f'<th>{head}</th>' for head in heads)}</tr>{rows}</table>"


def _told_row(one: Told, name: Mapping[int, str]) -> str:
    became = RESULT_WORDS.get(one.result, one.result) + (", WRONG" if one.wrong else "")
    true, taken = f"color: {_TRUE_BEACON}; font-weight: bold", f"color: {SECOND}; font-weight: bold"
    cells = (
        (f"{one.time_s:.2f}", ""),
        (f"{one.bearing_rad:.3f}", ""),
        ("-" if one.range_m is None else f"{one.range_m:.2f}", ""),
        ("-" if one.true_id < 0 else name.get(one.true_id, str(one.true_id)), true),
        ("" if one.beacon_uid is None else _number(one.beacon_uid), taken),
        (became, f"color: {RESULT_COLOURS[one.verdict]}; font-weight: bold"),
        ("" if one.reason == "none" else one.reason, ""),
        ("" if one.test_ratio is None else f"{one.test_ratio:.2f}", ""),
    )
    return (
        "<tr>" + "".join(f"<td style='{style}'>{html.escape(cell)}</td>" for cell, style in cells) + "</tr>"
    )


def _frame_url(shown: Shown) -> str:
    """The frame with its boxes, as a browser takes it in place of an address."""
    marks = [
        Mark(
            one.outline,
            (*one.lines, "WRONG") if one.result == WRONG_RESULT else one.lines,
            _ON_FRAME.get(one.result, UNKNOWN),
        )
        for one in shown.boxes
    ]
    buffer = io.BytesIO()
    annotate(shown.rgb, marks, shown.caption).save(buffer, format="JPEG", quality=80)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f"data:image/jpeg;base64,{data}"
