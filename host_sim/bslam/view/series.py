"""What a run does over time: position error and NEES (as the paper's Fig. 7 to 9)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bslam.view.style import (
    BAND,
    ESTIMATE,
    SECOND,
    TRUTH,
    mean_over_runs,
    moving_mean,
    new_figure,
    thinned,
    tidy,
)

_SMOOTH_S: Final = 5.0
_PAGE_IN: Final = 9.6
_TOP: Final = 1.5  # room for the legend above the highest error
_NEES_TOP: Final = 0.35  # the same above the highest NEES, as a share of a logarithmic scale


@dataclass(frozen=True)
class Series:
    """Error and NEES of one or several runs over the same time."""

    title: str
    time_s: NDArray[Any]  # (n,)
    error_m: NDArray[Any]  # (runs, n), NaN where it is not known
    nees: NDArray[Any]  # (runs, n), NaN where there is none
    nees_band: tuple[float, float]  # holds 95 % of a consistent filter's NEES, averaged over the runs
    window_s: float  # the means of this long at both ends are drawn, as the table has them


def draw_run(series: Series) -> Figure:
    """Error and NEES, one above the other."""
    figure = new_figure(9.5, 6.0)
    error_axes, nees_axes = figure.subplots(2, 1, sharex=True)
    draw_run_in(error_axes, nees_axes, series)
    return figure


def draw_run_in(error_axes: Any, nees_axes: Any, series: Series) -> None:
    """The same in axes of any figure."""
    draw_error(error_axes, series)
    draw_nees(nees_axes, series)
    error_axes.set_xlabel("")
    error_axes.set_title(series.title, fontsize=11, parse_math=False)


def draw_cells(title: str, cells: Sequence[Series]) -> Figure:
    """A row for each way of running: errors on one scale at the left, NEES at the right.

    No wider than a page, whose letters would shrink with it.
    """
    figure = new_figure(_PAGE_IN, 0.6 + 2.9 * len(cells))
    panels = figure.subplots(len(cells), 2, sharex=True, sharey="col", squeeze=False)
    for row, series in zip(panels, cells, strict=True):
        draw_error(row[0], series)
        draw_nees(row[1], series)
        row[0].set_title(series.title, fontsize=10, loc="left")
    for axes in panels[:-1].flat:
        axes.set_xlabel("")
    panels[0, 0].set_ylim(0.0, _TOP * max(_highest_cm(series) for series in cells))
    figure.suptitle(title, fontsize=12)
    return figure


def draw_error(axes: Any, series: Series) -> None:
    """Position error in cm: first run, mean and spread of several; means at the two ends."""
    time_s, error_cm = series.time_s, 100.0 * series.error_m
    several = len(error_cm) > 1
    if several:
        _draw_spread(axes, time_s, error_cm)
    sparse = np.mean(np.isfinite(error_cm[0])) < 0.5
    style = {"linestyle": "", "marker": ".", "markersize": 3} if sparse else {"linewidth": 0.9}
    colour, label = (TRUTH, "first run") if several else (ESTIMATE, "position error")
    axes.plot(time_s, error_cm[0], color=colour, alpha=0.8, label=label, **style)
    mean_cm = mean_over_runs(error_cm)
    if several:
        axes.plot(time_s, mean_cm, color=ESTIMATE, linewidth=1.6, label=f"mean of {len(error_cm)} runs")
    window_s = series.window_s
    _draw_window(axes, time_s, mean_cm, time_s <= time_s[0] + window_s, f"first {window_s:g} s", "-")
    _draw_window(axes, time_s, mean_cm, time_s > time_s[-1] - window_s, f"last {window_s:g} s", "--")
    axes.set_ylim(0.0, _TOP * _highest_cm(series))
    axes.set_xlim(float(time_s[0]), float(time_s[-1]))
    tidy(axes, "time, s", "position error, cm")
    axes.legend(fontsize=8, frameon=False, loc="upper right", ncols=2)


def draw_nees(axes: Any, series: Series) -> None:
    """NEES of the pose on a logarithmic scale, with the band of a consistent filter."""
    low, high = series.nees_band
    axes.axhspan(low, high, color=BAND, alpha=0.15, linewidth=0, label=f"95 % band, {low:.2g} to {high:.2g}")
    axes.axhline(3.0, color=BAND, linewidth=1.2, label="consistent: 3")
    mean = mean_over_runs(series.nees)
    known = np.isfinite(mean)
    if known.any():
        axes.plot(thinned(series.time_s), thinned(mean), color=ESTIMATE, linewidth=0.6, alpha=0.55)
        window = max(1, round(_SMOOTH_S / float(np.median(np.diff(series.time_s)))))
        label = f"{_SMOOTH_S:g} s mean; over all {mean[known].mean():.2f}"
        axes.plot(series.time_s, moving_mean(mean, window), color=ESTIMATE, linewidth=1.8, label=label)
        least, most = min(low, float(mean[known].min())), max(high, float(mean[known].max()))
        least, most = max(0.01, 0.7 * least), max(20.0, 1.5 * most)
        axes.set_ylim(least, most * (most / least) ** _NEES_TOP)
    axes.set_yscale("log")
    axes.set_xlim(float(series.time_s[0]), float(series.time_s[-1]))
    tidy(axes, "time, s", "NEES of the pose")
    axes.legend(fontsize=8, frameon=False, loc="upper right", ncols=2)


def _draw_window(
    axes: Any, time_s: NDArray[Any], mean_cm: NDArray[Any], rows: NDArray[np.bool_], name: str, line: str
) -> None:
    """A horizontal line at the mean of the rows."""
    values = mean_cm[rows][np.isfinite(mean_cm[rows])]
    if len(values):
        span, label = (time_s[rows][0], time_s[rows][-1]), f"{name}: {values.mean():.1f} cm"
        axes.plot(span, [values.mean()] * 2, color=SECOND, linewidth=2.4, linestyle=line, label=label)


def _highest_cm(series: Series) -> float:
    """Greatest error worth showing: of the first run and of the mean, not of the worst run of many."""
    shown_cm = 100.0 * np.stack([series.error_m[0], mean_over_runs(series.error_m)])
    return max(float(np.max(shown_cm[np.isfinite(shown_cm)], initial=0.0)), 1.0)


def _draw_spread(axes: Any, time_s: NDArray[Any], error_cm: NDArray[Any]) -> None:
    """Shade what lies between the 10 and the 90 % quantile of the runs."""
    rows = np.isfinite(error_cm).all(axis=0)
    low, high = np.quantile(error_cm[:, rows], [0.1, 0.9], axis=0)
    axes.fill_between(
        time_s[rows], low, high, color=ESTIMATE, alpha=0.15, linewidth=0, label="80 % of the runs"
    )
