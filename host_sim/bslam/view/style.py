"""Colours and axes that all pictures share."""

from __future__ import annotations

import io
from typing import Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

TRUTH: Final = "#555555"
ESTIMATE: Final = "#1f6fb4"
SECOND: Final = "#d1495b"
BEACON: Final = "#ffd34d"
WALL: Final = "#222222"
BAND: Final = "#4c9f70"
# By what became of a sighting: colours that stay apart for the colour-blind, and are dark enough for words.
WRONG_RESULT: Final = "wrong"
RESULT_COLOURS: Final = {
    "matched": "#00795c",
    "new": "#0067a8",
    WRONG_RESULT: "#c44601",
    "deferred": "#666666",
    "rejected": "#8f4a80",
    "refused": "#8f4a80",
}
RESULT_DASHES: Final = {"deferred": "dashed", "rejected": "dotted", "refused": "dotted"}
_DPI: Final = 110


class Drawing(Figure):
    """A figure that a notebook shows when it is the value of a cell, without pyplot's global state."""

    def _repr_png_(self) -> bytes:
        return png(self)


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure of its own canvas: no global state, so that processes and threads may draw at once."""
    figure = Drawing(figsize=(width_in, height_in), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def tidy(axes: Any, x_label: str, y_label: str) -> None:
    """Labels, a light grid, no box."""
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.grid(True, color="#e4e4e4", linewidth=0.7)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def png(figure: Figure) -> bytes:
    """The figure as the content of a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def thinned(values: NDArray[Any], most: int = 4000) -> NDArray[Any]:
    """At most about `most` evenly chosen rows: more than a picture has columns only costs time."""
    return values[:: max(1, len(values) // most)]


def moving_mean(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Mean over `window` rows about each row, over those that are finite; NaN where there are none."""
    finite = np.isfinite(values)
    kernel = np.ones(min(window, len(values)))
    total = np.convolve(np.where(finite, values, 0.0), kernel, mode="same")
    count = np.convolve(finite.astype(np.float64), kernel, mode="same")
    return np.where(count > 0.5, total / np.maximum(count, 1.0), np.nan)


def mean_over_runs(values: NDArray[Any]) -> NDArray[np.float64]:
    """(runs, n) -> (n,), over the finite ones; NaN where there are none."""
    finite = np.isfinite(values)
    total = np.sum(np.where(finite, values, 0.0), axis=0)
    return np.where(finite.any(axis=0), total / np.maximum(finite.sum(axis=0), 1), np.nan)
