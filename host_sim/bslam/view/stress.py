"""What each mismatch costs: error, NEES and lost runs, a line a row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from bslam.view.style import BAND, ESTIMATE, SECOND, new_figure, tidy

_LEAST: Final = 1e-3  # what a logarithmic axis can show


@dataclass(frozen=True)
class Line:
    """The runs of a row."""

    label: str
    error_cm: Sequence[float]  # mean of each run
    nees: Sequence[float]  # mean of each run
    lost_share: float
    lost_share_95: tuple[float, float]


def draw_stress(title: str, lines: Sequence[Line]) -> Figure:
    """A dot a run and a bar at their mean; the share of lost runs with its 95 % interval."""
    figure = new_figure(11.0, 1.6 + 0.3 * len(lines))
    errors, nees, lost = figure.subplots(1, 3, sharey=True, width_ratios=(4, 4, 2))
    for place, line in enumerate(lines):
        _dots(errors, place, line.error_cm)
        _dots(nees, place, line.nees)
        low, high = line.lost_share_95
        lost.plot([100.0 * low, 100.0 * high], [place, place], color=SECOND, linewidth=1.2)
        lost.plot([100.0 * line.lost_share], [place], "o", color=SECOND, markersize=5)
    nees.axvline(3.0, color=BAND, linewidth=1.5)
    for axes, text in ((errors, "position error, cm"), (nees, "NEES (3 is consistent)")):
        axes.set_xscale("log")
        tidy(axes, text, "")
    tidy(lost, "lost runs, %", "")
    lost.set_xlim(-5.0, 105.0)
    errors.set_yticks(range(len(lines)), [line.label for line in lines], fontsize=8)
    errors.set_ylim(len(lines) - 0.5, -0.5)
    figure.suptitle(title, fontsize=11, parse_math=False)
    return figure


def _dots(axes: Any, place: int, values: Sequence[float]) -> None:
    shown = np.maximum(np.asarray(values, dtype=np.float64), _LEAST)
    axes.plot(shown, np.full(len(shown), place), ".", color=ESTIMATE, alpha=0.5, markersize=5)
    if len(shown) > 0:
        axes.plot([shown.mean()], [place], "|", color=ESTIMATE, markersize=12, markeredgewidth=2.0)
