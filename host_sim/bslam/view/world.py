"""A scenario as a picture: what stands where, who moves about, and where the robot may go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from bslam.log import Beacons
from bslam.view.style import BAND, BEACON, ESTIMATE, SECOND, TRUTH, WALL, new_figure, thinned, tidy

_MARGIN_M: Final = 0.5
_BOX: Final = "#b08d57"


@dataclass(frozen=True)
class World:
    """What is in the picture, in the arena's frame; lengths in m."""

    title: str
    walls_m: NDArray[np.float64]  # (w, 4) x1, y1, x2, y2
    beacons: Beacons
    start: tuple[float, float, float]  # x, y, heading
    radius_m: float  # of the robot
    boxes_m: Sequence[NDArray[np.float64]] = ()  # (4, 2) corners each
    movers: Sequence[tuple[NDArray[np.float64], float]] = ()  # path (k, 2) and radius each
    waypoints_m: Sequence[tuple[float, float]] = ()
    path_m: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))  # (n, 2) of one drive


def draw_world(world: World) -> Figure:
    """The picture."""
    ends_m = world.walls_m.reshape(-1, 2)
    low_m, high_m = ends_m.min(axis=0) - _MARGIN_M, ends_m.max(axis=0) + _MARGIN_M
    width_m, height_m = high_m - low_m
    figure = new_figure(6.0, 6.0 * height_m / width_m + 0.7)
    axes = figure.add_subplot()
    for x1, y1, x2, y2 in world.walls_m:
        axes.plot([x1, x2], [y1, y2], color=WALL, linewidth=2.5, solid_capstyle="round", zorder=3)
    axes.plot(*thinned(world.path_m).T, color=ESTIMATE, linewidth=0.8, alpha=0.7, label="a drive", zorder=2)
    for corners_m in world.boxes_m:
        axes.add_patch(Polygon(corners_m, facecolor=_BOX, edgecolor=WALL, linewidth=0.8, zorder=3))
    for path_m, radius_m in world.movers:
        axes.plot(*path_m.T, color=SECOND, linewidth=1.2, linestyle=":", zorder=4)
        axes.add_patch(Circle(path_m[0], radius_m, color=SECOND, alpha=0.7, zorder=4))
    if world.waypoints_m:
        style: dict[str, Any] = {"linestyle": "", "marker": "D", "markersize": 4, "zorder": 5}
        axes.plot(*np.array(world.waypoints_m).T, color=BAND, label="way point", **style)
    _draw_beacons(axes, world.beacons)
    x_m, y_m, heading_rad = world.start
    axes.add_patch(Circle((x_m, y_m), world.radius_m, facecolor="white", edgecolor=TRUTH, zorder=6))
    tip = (x_m + world.radius_m * np.cos(heading_rad), y_m + world.radius_m * np.sin(heading_rad))
    axes.plot([x_m, tip[0]], [y_m, tip[1]], color=TRUTH, linewidth=1.5, label="start", zorder=7)
    axes.set_aspect("equal")
    axes.set_xlim(low_m[0], high_m[0])
    axes.set_ylim(low_m[1], high_m[1])
    axes.set_title(world.title, fontsize=10, parse_math=False)
    tidy(axes, "x, m", "y, m")
    figure.legend(loc="outside lower center", ncols=5, fontsize=7, frameon=False)
    return figure


def _draw_beacons(axes: Any, beacons: Beacons) -> None:
    style = {"marker": "*", "markersize": 10, "markeredgecolor": "#6b4b00", "markeredgewidth": 0.6}
    axes.plot(beacons.x_m, beacons.y_m, color=BEACON, linestyle="", label="beacon", zorder=5, **style)
    for identity, x_m, y_m in zip(beacons.beacon_id, beacons.x_m, beacons.y_m, strict=True):
        offset = {"xytext": (4, 4), "textcoords": "offset points"}
        axes.annotate(str(identity), (x_m, y_m), fontsize=6, color="#6b4b00", **offset)
