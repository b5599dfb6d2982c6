"""The paper's Tables I to III: its figures of one run, and this estimator's over several seeds."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from bslam.evaluation.consistency import BELOW_95, half_interval_95, nees_band_95
from bslam.runs.batch import Outcome

STATISTICS: Final = ("max", "min", "mean", "std")  # in the paper's order
TITLES: Final = {
    "max": "Maximum error",
    "min": "Minimum error",
    "mean": "Mean error",
    "std": "Standard deviation",
}
OBSERVATION_TITLES: Final = {"distance": "Distance observation", "direction": "Direction only"}
NAMES: Final = {
    "standard": "standard filter",
    "invariant": "invariant filter",
    "smoother": "smoother",
}
# Section V, Tables I to III: position error in cm, one run each. (Its text says 0.2 where Table I says 0.3
# m/s.)
PAPER_CM: Final[dict[tuple[float, str], dict[str, float]]] = {
    (0.3, "distance"): {"max": 20.36, "min": 0.091, "mean": 6.94, "std": 3.38},
    (0.3, "direction"): {"max": 32.24, "min": 0.14, "mean": 12.99, "std": 6.63},
    (0.6, "distance"): {"max": 28.86, "min": 0.11, "mean": 10.11, "std": 4.40},
    (0.6, "direction"): {"max": 41.55, "min": 0.021, "mean": 15.97, "std": 7.99},
    (1.0, "distance"): {"max": 64.09, "min": 0.24, "mean": 15.10, "std": 8.94},
    (1.0, "direction"): {"max": 57.78, "min": 1.03, "mean": 22.83, "std": 10.01},
}
SIGMAS_MPS: Final = (0.3, 0.6, 1.0)
PAPER_ROOM: Final = "paper_room"
BEST_TO_WORST: Final = "Mean error, best to worst run"


@dataclass(frozen=True)
class Cell:
    """One sigma, observation and filter: means over the runs of the runs' own statistics."""

    scenario: str
    sigma_mps: float
    observation: str
    filter: str
    runs: int
    lost: int
    error_cm: dict[str, float]  # by STATISTICS
    mean_low_cm: float  # least and greatest mean error of a run
    mean_high_cm: float
    mean_half_95_cm: float | None  # half of the 95 % interval of the mean error over runs; None of one run
    first_50s_cm: float
    last_50s_cm: float
    dead_reckoning_cm: float
    bound_cm: float | None  # what a filter linearised at the truth leaves, see bound.py; None: not computed
    nees_mean: float
    nees_inside_95: float  # share of steps, all runs, each alone below POSE_95
    nees_band: tuple[float, float]  # 95 % band of the NEES averaged over the runs at one step
    nees_in_band: float  # share of steps at which that average lies in the band

    @property
    def paper_cm(self) -> dict[str, float] | None:
        """What the paper has in this cell, None where it has no such room or sigma."""
        return PAPER_CM.get((self.sigma_mps, self.observation)) if self.scenario == PAPER_ROOM else None

    def as_json(self) -> dict[str, Any]:
        """For tables.json."""
        return {**vars(self), "nees_band": list(self.nees_band), "paper_cm": self.paper_cm}


def make_cell(
    scenario: str, sigma_mps: float, observation: str, filter_name: str, outcomes: Sequence[Outcome]
) -> Cell | None:
    """The cell of these runs; None if every one of them failed."""
    entries = [one.entry for one in outcomes if "position_error_m" in one.entry]
    if not entries:
        return None

    def mean_of(key: str, factor: float = 1.0) -> float:
        values = [entry[key] for entry in entries if key in entry]
        return factor * statistics.fmean(values) if values else float("nan")

    errors = [entry["position_error_m"] for entry in entries]
    band = nees_band_95(len(entries))
    half_m = half_interval_95([error["mean"] for error in errors])
    return Cell(
        scenario=scenario,
        sigma_mps=sigma_mps,
        observation=observation,
        filter=filter_name,
        runs=len(outcomes),
        lost=sum(bool(one.entry["diverged"]) for one in outcomes),
        error_cm={name: 100.0 * statistics.fmean(error[name] for error in errors) for name in STATISTICS},
        mean_low_cm=100.0 * min(error["mean"] for error in errors),
        mean_high_cm=100.0 * max(error["mean"] for error in errors),
        mean_half_95_cm=None if half_m is None else 100.0 * half_m,
        first_50s_cm=mean_of("position_error_first_50s_m", 100.0),
        last_50s_cm=mean_of("position_error_last_50s_m", 100.0),
        dead_reckoning_cm=mean_of("dead_reckoning_error_m", 100.0),
        bound_cm=mean_of("bound_error_m", 100.0) if all("bound_error_m" in one for one in entries) else None,
        nees_mean=mean_of("nees_mean"),
        nees_inside_95=mean_of("nees_inside_95"),
        nees_band=band,
        nees_in_band=_share_in_band(outcomes, band),
    )


def _share_in_band(outcomes: Sequence[Outcome], band: tuple[float, float]) -> float:
    nees = [one.nees for one in outcomes if len(one.nees)]
    mean = np.mean(nees, axis=0)
    mean = mean[np.isfinite(mean)]
    return float(np.mean((mean >= band[0]) & (mean <= band[1]))) if len(mean) else float("nan")


def markdown(
    cells: Sequence[Cell], heading: str, pictures: dict[float, str], room_picture: str | None
) -> str:
    """The tables as a document; `pictures` by sigma and `room_picture` are file names beside it."""
    lines = [f"# {heading}", ""]
    lines += [
        "Position error, estimated against true position at every step, in cm: means over the runs of each",
        "run's figure. NEES of the pose: 3 is consistent; the band holds 95 % of a consistent filter's NEES",
        "averaged over the runs at one step.",
        "",
    ]
    if any(cell.paper_cm for cell in cells):
        lines += ["The paper shows one run a cell.", ""]
    if room_picture is not None:
        lines += ["## The room", "", f"![room]({room_picture})", ""]
    for sigma_mps in sorted({cell.sigma_mps for cell in cells}):
        of_sigma = [cell for cell in cells if cell.sigma_mps == sigma_mps]
        lines += [f"## {section_title(of_sigma)}", "", *_table(of_sigma), ""]
        if sigma_mps in pictures:
            lines += [f"![error over time, sigma {sigma_mps:g}]({pictures[sigma_mps]})", ""]
    return "\n".join(lines)


def heading(scenario: str) -> str:
    """Of all tables."""
    return "Tables I to III, Figures 6 to 9" if scenario == PAPER_ROOM else f"Tables of {scenario}"


def figure_of(scenario: str, sigma_mps: float) -> str:
    """The paper's figure to compare a picture with, and a colon; empty if there is none."""
    there = scenario == PAPER_ROOM and sigma_mps in SIGMAS_MPS
    return f"Figure {7 + SIGMAS_MPS.index(sigma_mps)}: " if there else ""


def section_title(cells: Sequence[Cell]) -> str:
    """Of the cells of one sigma, by the paper's table if it has one."""
    sigma_mps = cells[0].sigma_mps
    table = f"Table {('I', 'II', 'III')[SIGMAS_MPS.index(sigma_mps)]}: " if cells[0].paper_cm else ""
    return f"{table}sigma {sigma_mps:g} m/s"


def runs_a_cell(count: int) -> str:
    """So many, in words."""
    return f"{count} run{'' if count == 1 else 's'} a cell"


def _table(cells: Sequence[Cell]) -> list[str]:
    """For each observation one column for the paper's figures, and one for each of our filters."""
    lines = [f"| cm | {' | '.join(heads(cells))} |", "|---|" + "---:|" * len(heads(cells))]
    for name in STATISTICS:
        row = f"| {TITLES[name]} |"
        for cell, is_after_paper in with_paper(cells):
            row += f" {paper_figure(cell, name)} |" if is_after_paper else ""
            row += f" {cell.error_cm[name]:.2f} |"
        lines.append(row)
    extra = {
        BEST_TO_WORST: lambda c: f"{c.mean_low_cm:.2f} to {c.mean_high_cm:.2f}",
        "Mean error, first 50 s": lambda c: f"{c.first_50s_cm:.2f}",
        "Mean error, last 50 s": lambda c: f"{c.last_50s_cm:.2f}",
        "Mean error of the bound: Jacobians at the truth": lambda c: (
            "-" if c.bound_cm is None else f"{c.bound_cm:.2f}"
        ),
        "Mean error of odometry alone": lambda c: f"{c.dead_reckoning_cm:.0f}",
        "NEES (3 is consistent)": lambda c: f"{c.nees_mean:.2f}",
        f"NEES {BELOW_95}, of steps": lambda c: f"{100 * c.nees_inside_95:.1f} %",
        "Steps with the mean over runs in its band": lambda c: (
            f"{100 * c.nees_in_band:.0f} % in {c.nees_band[0]:.2f} to {c.nees_band[1]:.2f}"
        ),
        "Runs lost": lambda c: str(c.lost),
    }
    if all(cell.runs == 1 for cell in cells):
        del extra[BEST_TO_WORST]
    for title, text in extra.items():
        row = "".join(
            (" |" if is_after_paper else "") + f" {text(cell)} |"
            for cell, is_after_paper in with_paper(cells)
        )
        lines.append(f"| {title} |{row}")
    return lines


def with_paper(cells: Sequence[Cell]) -> list[tuple[Cell, bool]]:
    """Each cell, and whether the paper's column stands before it: before the first of an observation, where
    the paper has one."""
    return [
        (cell, bool(cell.paper_cm) and (number == 0 or cell.observation != cells[number - 1].observation))
        for number, cell in enumerate(cells)
    ]


def heads(cells: Sequence[Cell]) -> list[str]:
    """Of all columns of figures."""
    found = []
    for cell, is_after_paper in with_paper(cells):
        title = OBSERVATION_TITLES[cell.observation]
        found += [f"{title}: paper"] if is_after_paper else []
        found.append(f"{title}: {NAMES[cell.filter]}")
    return found


def paper_figure(cell: Cell, name: str) -> str:
    """What the paper has in the cell's place, as text."""
    return f"{cell.paper_cm[name]:g}" if cell.paper_cm else "-"
