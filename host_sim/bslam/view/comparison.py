"""Several algorithms on the same drives: their errors over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from numpy.typing import NDArray

from bslam.view.style import mean_over_runs, moving_mean, new_figure, tidy

_COLOURS: Final = ("#1f6fb4", "#999999", "#222222", "#4c9f70", "#d1495b", "#8d5fb8", "#e08a1e", "#17a2a2")
_SMOOTH_S: Final = 2.0


@dataclass(frozen=True)
class Contender:
    """The errors of one algorithm over one or several drives."""

    name: str
    time_s: NDArray[Any]  # (n,)
    error_m: NDArray[Any]  # (drives, n), NaN where it is not known
    dashed: bool = False  # the bound, say


def draw_comparison(title: str, contenders: Sequence[Contender]) -> Figure:
    """Mean error over the drives, smoothed over 2 s, on a scale that holds the bound and odometry alone."""
    figure = new_figure(9.5, 5.0)
    axes = figure.subplots()
    for number, one in enumerate(contenders):
        error_cm = 100.0 * mean_over_runs(one.error_m[:, 1:])
        colour, label = _COLOURS[number % len(_COLOURS)], f"{one.name}: {np.nanmean(error_cm):.1f} cm"
        step_s = float(np.median(np.diff(one.time_s)))
        shown = moving_mean(error_cm, max(1, round(_SMOOTH_S / step_s)))
        style = {"linestyle": "--", "linewidth": 1.6} if one.dashed else {"linewidth": 1.4}
        axes.plot(one.time_s[1:], shown, color=colour, label=label, **style)
    axes.set_yscale("log")
    axes.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("{x:g}")
    axes.set_title(title, fontsize=11, parse_math=False)
    tidy(axes, "time, s", "position error, cm")
    axes.legend(fontsize=8, frameon=False, ncols=2)
    return figure
