"""The map: walls, true and estimated path, true and estimated beacons (as the paper's Fig. 6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from bslam.log import Beacons
from bslam.view.style import BEACON, ESTIMATE, SECOND, TRUTH, WALL, new_figure, thinned, tidy

_SIGMAS: Final = 2.0  # size of the ellipses
# An estimate that got lost is cut off this far (times the extent of the truth) outside, or the room would
# shrink.
_LOST_MARGIN: Final = 0.6
_EDGE: Final = 0.04
_HALO: Final = [withStroke(linewidth=2.5, foreground="white")]  # where a path runs under a number


@dataclass(frozen=True)
class Mapped:
    """A beacon of the estimated map."""

    x_m: float
    y_m: float
    covariance_m2: NDArray[np.float64] | None  # (2, 2); None: no ellipse
    confirmed: bool
    name: str = ""  # beside the cross; "": nobody knows one


@dataclass(frozen=True)
class Room:
    """What is in the picture; everything in one frame."""

    title: str
    estimate_m: NDArray[np.float64]  # (n, 2), its first row the start
    truth_m: NDArray[np.float64] | None = None  # (n, 2), NaN where it is not known
    beacons: Beacons | None = None
    mapped: Sequence[Mapped] = ()
    walls_m: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 4)))  # (w, 4) x1, y1, x2, y2
    identity: Callable[[int], str] = str  # a beacon_id as the log has it


def draw_room(room: Room) -> Figure:
    """The picture."""
    low_m, high_m = _extent(room)
    width_m, height_m = high_m - low_m
    width_in = float(np.clip(9.0 * np.sqrt(width_m / height_m), 6.5, 11.0))
    figure = new_figure(width_in, float(np.clip(width_in * height_m / width_m, 4.0, 11.0)) + 0.8)
    draw_room_in(figure.add_subplot(), room)
    figure.legend(loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    return figure


def draw_room_in(axes: Any, room: Room) -> None:
    """The same, but for the legend, in axes of any figure."""
    low_m, high_m = _extent(room)
    for x1, y1, x2, y2 in room.walls_m:
        axes.plot([x1, x2], [y1, y2], color=WALL, linewidth=3, solid_capstyle="round", zorder=2)
    if room.truth_m is not None:
        _draw_truth(axes, room.truth_m)
    path_m = thinned(room.estimate_m)
    axes.plot(*path_m.T, color=ESTIMATE, linewidth=1.1, alpha=0.9, label="estimated path", zorder=4)
    start: dict[str, Any] = {"marker": "o", "markersize": 8, "markeredgecolor": "white", "linestyle": ""}
    axes.plot(*room.estimate_m[0], color=ESTIMATE, label="start", zorder=7, **start)
    if room.beacons is not None:
        _draw_beacons(axes, room.beacons, room.identity)
    for confirmed in (True, False):
        shown = [one for one in room.mapped if one.confirmed == confirmed and _stands_in(one, low_m, high_m)]
        _draw_mapped(axes, shown, confirmed)
    axes.set_aspect("equal")
    axes.set_xlim(low_m[0], high_m[0])
    axes.set_ylim(low_m[1], high_m[1])
    tidy(axes, "x, m", "y, m")
    axes.set_title(room.title + _what_is_cut(room, low_m, high_m), fontsize=11, parse_math=False)


def _draw_truth(axes: Any, truth_m: NDArray[np.float64]) -> None:
    """A line where the truth is known step by step, dots where it is known now and then."""
    known = np.isfinite(truth_m[:, 0])
    style: dict[str, Any] = {"linestyle": "", "marker": ".", "markersize": 5}
    if known.mean() > 0.5:
        style = {"linewidth": 2.2, "alpha": 0.55}
    shown = thinned(truth_m if known.mean() > 0.5 else truth_m[known])
    axes.plot(*shown.T, color=TRUTH, label="true path", zorder=3, **style)


def _draw_beacons(axes: Any, beacons: Beacons, name: Callable[[int], str]) -> None:
    style = {
        "marker": "*",
        "markersize": 14,
        "markeredgecolor": "#6b4b00",
        "markeredgewidth": 0.8,
        "linestyle": "",
    }
    axes.plot(beacons.x_m, beacons.y_m, color=BEACON, label="true beacon", zorder=5, **style)
    for identity, x_m, y_m in zip(beacons.beacon_id.tolist(), beacons.x_m, beacons.y_m, strict=True):
        _write(axes, name(identity), x_m, y_m, "#6b4b00")


def _write(axes: Any, name: str, x_m: float, y_m: float, colour: str) -> None:
    """The name of what stands there."""
    style: dict[str, Any] = {"xytext": (7, 6), "textcoords": "offset points", "fontsize": 8, "color": colour}
    axes.annotate(name, (x_m, y_m), parse_math=False, zorder=8, **style, path_effects=_HALO)


def _draw_mapped(axes: Any, beacons: Sequence[Mapped], confirmed: bool) -> None:
    """Crosses with their ellipse; tentative beacons pale."""
    if not beacons:
        return
    label = "mapped beacon" if confirmed else "tentative beacon"
    if any(one.covariance_m2 is not None for one in beacons):
        label += f", {_SIGMAS:g} sigma"
    alpha = 0.95 if confirmed else 0.3
    xs, ys = [one.x_m for one in beacons], [one.y_m for one in beacons]
    style = {"marker": "+", "markersize": 11, "markeredgewidth": 1.5, "linestyle": "", "zorder": 6}
    axes.plot(xs, ys, color=SECOND, alpha=alpha, label=label, **style)
    for one in beacons:
        if one.name:
            _write(axes, one.name, one.x_m, one.y_m, SECOND)
        if one.covariance_m2 is not None:
            outline = {
                "facecolor": "none",
                "edgecolor": SECOND,
                "alpha": alpha,
                "linewidth": 1.2,
                "zorder": 6,
            }
            axes.add_patch(_ellipse((one.x_m, one.y_m), one.covariance_m2, **outline))


def _ellipse(centre_m: tuple[float, float], covariance_m2: NDArray[np.float64], **style: Any) -> Ellipse:
    variances, directions = np.linalg.eigh(covariance_m2)
    minor_m, major_m = 2.0 * _SIGMAS * np.sqrt(np.maximum(variances, 0.0))
    angle_deg = float(np.degrees(np.arctan2(directions[1, 1], directions[0, 1])))
    return Ellipse(centre_m, major_m, minor_m, angle=angle_deg, **style)


def _extent(room: Room) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest x, y shown: all that is true, and of the estimate what leaves that readable."""
    true = [room.walls_m.reshape(-1, 2)]
    if room.truth_m is not None:
        true.append(room.truth_m[np.isfinite(room.truth_m[:, 0])])
    if room.beacons is not None:
        true.append(np.column_stack([room.beacons.x_m, room.beacons.y_m]))
    lowest_m, highest_m = _reaches(room)
    shown_m = np.concatenate([room.estimate_m, lowest_m, highest_m])
    points = np.concatenate(true)
    if len(points) == 0:
        points = np.concatenate([room.estimate_m, 0.5 * (lowest_m + highest_m)])
    low_m, high_m = points.min(axis=0), points.max(axis=0)
    margin_m = _LOST_MARGIN * max(float(np.max(high_m - low_m)), 1.0)
    low_m = np.maximum(np.minimum(low_m, shown_m.min(axis=0)), low_m - margin_m)
    high_m = np.minimum(np.maximum(high_m, shown_m.max(axis=0)), high_m + margin_m)
    edge_m = max(0.4, _EDGE * float(np.max(high_m - low_m)))  # of stars and their numbers at a wall
    return low_m - edge_m, high_m + edge_m


def _reaches(room: Room) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest x, y of each confirmed beacon's ellipse, (b, 2) both."""
    confirmed = [one for one in room.mapped if one.confirmed]
    places_m = np.reshape([(one.x_m, one.y_m) for one in confirmed], (-1, 2))
    unknown = np.zeros((2, 2))
    covariances = [unknown if one.covariance_m2 is None else one.covariance_m2 for one in confirmed]
    variances = np.reshape([np.diagonal(one) for one in covariances], (-1, 2))
    half_m = _SIGMAS * np.sqrt(np.maximum(np.nan_to_num(variances), 0.0))
    return places_m - half_m, places_m + half_m


def _what_is_cut(room: Room, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> str:
    """What the title says where the picture is not large enough for the map."""
    lowest_m, highest_m = _reaches(room)
    cut = int(((lowest_m < low_m) | (highest_m > high_m)).any(axis=1).sum())
    words = f"; {cut} of {len(lowest_m)} mapped beacons reach beyond the picture" if cut else ""
    beyond = sum(not one.confirmed and not _stands_in(one, low_m, high_m) for one in room.mapped)
    return f"{words}; {beyond} tentative beyond the picture" if beyond else words


def _stands_in(one: Mapped, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> bool:
    """Whether the picture has its place: an ellipse without would be a stray stroke at the edge."""
    return bool(low_m[0] <= one.x_m <= high_m[0] and low_m[1] <= one.y_m <= high_m[1])
