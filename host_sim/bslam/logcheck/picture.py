"""The evidence for a finding, drawn."""

from __future__ import annotations

from typing import Any, Final

from matplotlib.figure import Figure

from bslam.logcheck.finding import Picture
from bslam.view.style import ESTIMATE, SECOND, new_figure, thinned, tidy

_COLOURS: Final = (ESTIMATE, SECOND)


def draw_picture(picture: Picture, title: str) -> Figure:
    """A small figure of its one or two curves."""
    figure = new_figure(6.0, 3.6)
    axes = figure.subplots()
    for curve, colour in zip(picture.curves, _COLOURS, strict=False):
        points: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 3}
        style = {} if curve.is_line else points
        axes.plot(thinned(curve.x), thinned(curve.y), color=colour, label=curve.label, **style)
    tidy(axes, picture.x_label, picture.y_label)
    axes.set_title(title, fontsize=9, wrap=True, parse_math=False)
    axes.legend(frameon=False, fontsize=8)
    return figure
