"""What the package offers beside `Slam` and `Log`: make, check and run a log, and look at the run.

Thin over `world`, `logcheck`, `runs`, `evaluation` and `view`, and with the words of the command line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from types import NoneType
from typing import Any, TypedDict, Unpack

import numpy as np
from matplotlib.figure import Figure

from bslam.algorithms import Algorithm
from bslam.commands.drawing import room, series
from bslam.commands.report import table
from bslam.core.slam import Slam
from bslam.errors import BslamError, did_you_mean
from bslam.evaluation.metrics import Evaluation, evaluate, summarise
from bslam.evaluation.trace import Trace
from bslam.log import WHEEL_NOISES, Log
from bslam.logcheck.check import check_folder
from bslam.logcheck.finding import Report
from bslam.options import Number, RunOptions, ensure_word
from bslam.parsing.settings import integer
from bslam.runs.methods import maker_of
from bslam.runs.rival import run_algorithm
from bslam.runs.runner import run_log
from bslam.runs.sources import options_for, what_it_says
from bslam.view.room import draw_room_in
from bslam.view.series import draw_run_in
from bslam.view.style import new_figure
from bslam.world.simulate import load_scenario
from bslam.world.simulate import simulate as simulate_scenario


class RunWords(TypedDict, total=False):
    """How a log is run, as options of `bslam replay csv`; None, or left out: by what the log tells."""

    observation: str | None
    """ "distance" or "direction"."""
    association: str | None
    """ "known", "known:RATE" (so many identities replaced), "mahalanobis", "svm", ..."""
    filter: str | None
    """ "standard", "invariant" or "smoother"."""
    motion: str
    presets: tuple[str, ...]
    velocity_states: bool | None
    noise: str | None
    sigma_mps: float | None
    """Wheel-speed sigma told to the filter, m/s."""
    parameters: Mapping[str, Number] | None
    """Settings of the core by name: `Slam.parameters()` lists them. They win over all else."""
    known_map: bool
    """The log's true beacons are given to the filter."""
    kept_map: str | Path | None
    """Path of a map to start in, at a place that nobody knows."""
    frozen: bool
    recovery: str | None
    align: str | None
    """ "none", "rigid" or "similarity", of the estimate to the truth."""
    seed: int
    """Of what "known:RATE" replaces."""
    real: str
    target: str
    """ "host", "qemu:BOARD" or "serial:DEVICE"."""


_OF_THE_FILTER = ("filter", "known_map", "kept_map", "frozen", "recovery", "target")
"""Words that an algorithm of one's own hears nothing of."""
_TEXTS = ("association", "kept_map", "target")


@dataclass(frozen=True, repr=False)
class Run:
    """A log that was run: what the filter said, and how good that was.

    trace: poses (n + 1, 3), covariances (n + 1, 3, 3), map. errors: against the truth, rows as in the trace;
    None where the log has neither truth nor true beacons. Its text is the line that the command prints.
    """

    log: Log
    options: RunOptions
    trace: Trace
    errors: Evaluation | None

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The run's entry of summary.json: keys as in docs/CLI.md, without figures that nobody knows."""
        return summarise(self.log, self.trace, self.options, self.errors)

    def __str__(self) -> str:
        entry = self.summary | {"name": self.log.name}
        return "\n".join([table([entry]), *entry["notes"], *entry["problems"]])

    __repr__ = __str__


def simulate(
    scenario: str | Path, seed: int = 0, *, sigma_mps: float | None = None, noise: str | None = None
) -> Log:
    """A drive in a made-up world, with truth.

    scenario: a name ("paper_room") or the path of a TOML file. sigma_mps: of each wheel's speed; noise:
    "speedometer" (the reading errs) or "actuation" (the wheel does); None: as the scenario has it. Raises
    BslamError for what is not allowed.
    """
    drawn = integer(0).convert(seed, "seed")
    if noise is not None:
        ensure_word("noise", noise, WHEEL_NOISES)
    return simulate_scenario(load_scenario(scenario), drawn, sigma_mps, noise)


def check(log: Log) -> Report:
    """What `bslam check` says of a log, which prints as the command does. See `Log.check`."""
    with TemporaryDirectory() as place:
        folder = Path(place) / "log"
        log.write(folder)
        try:
            report = check_folder(folder)
        except BslamError as error:
            raise BslamError(str(error).replace(str(folder), log.name)) from error
    return replace(report, name=log.name)


def run(log: Log, algorithm: Callable[..., Algorithm] | None = None, **words: Unpack[RunWords]) -> Run:
    """Run the filter over a log, as `bslam replay csv` does with options of these names. See `Log.run`."""
    if isinstance(words.get("kept_map"), Path):
        words["kept_map"] = str(words["kept_map"])
    _ensure_words(words, algorithm)
    given: dict[str, Any] = {**words, "sensor": "recorded", "map_align": "rigid"}
    given["parameters"] = tuple((words.get("parameters") or {}).items())
    options = options_for(what_it_says(log), given)
    if algorithm is None:
        trace = run_log(log, options)
    else:  # whose covariance is of x, y, theta, and so are the filter's words for it
        options = replace(options, filter="standard")
        if getattr(algorithm, "needs_identity", False):
            options = replace(options, association="known")
        trace = run_algorithm(log, options, maker_of(algorithm), lambda step: None)
    return Run(log, options, trace, evaluate(log, trace, options))


def _ensure_words(words: RunWords, algorithm: object) -> None:
    """Raise BslamError for a word that is none, that counts for nothing, or of another type."""
    for word, value in words.items():
        if word not in RunWords.__annotations__:
            allowed = ", ".join(RunWords.__annotations__)
            near = did_you_mean(word, [*RunWords.__annotations__]) or _perhaps_a_setting(word)
            raise BslamError(f"option {word!r} does not exist; allowed: {allowed}{near}")
        if algorithm is not None and word in _OF_THE_FILTER and value:
            allowed = ", ".join(one for one in RunWords.__annotations__ if one not in _OF_THE_FILTER)
            raise BslamError(f"option {word!r} is of the filter alone; allowed with an algorithm: {allowed}")
        if word in _TEXTS and not isinstance(value, (str, NoneType)):
            raise BslamError(f"{word}: {value!r} is not allowed; allowed: a text, or None")
        if word == "parameters" and not isinstance(value, (Mapping, NoneType)):
            raise BslamError(f"parameters {value!r}: allowed is a mapping, names to numbers")


def _perhaps_a_setting(word: str) -> str:
    names = Slam.defaults()
    return f"; did you mean parameters={{{word!r}: ...}}?" if word in names else did_you_mean(word, names)


def plot(run: Run) -> Figure:
    """Path and map with 2-sigma ellipses beside, where there is a truth, position error and NEES over time.

    A matplotlib figure, which a notebook shows; `plot(run).savefig("run.png")` keeps it. The map is brought
    to the truth as the path is; ellipses stand relative to the start.
    """
    if not isinstance(run, Run):
        raise BslamError(f"plot of {type(run).__name__}; allowed: a Run, as log.run() gives it")
    log, trace, errors = run.log, run.trace, run.errors
    has_errors = errors is not None and bool(np.isfinite(errors.error_m).any())
    figure = new_figure(15.0 if has_errors else 8.0, 7.5)
    grid = figure.add_gridspec(2, 2 if has_errors else 1)
    map_axes = figure.add_subplot(grid[:, 0])
    draw_room_in(map_axes, room(log.name, log, trace, errors, walls_m=np.empty((0, 4))))
    named = map_axes.get_legend_handles_labels()
    figure.legend(*named, loc="outside lower left", ncols=6, fontsize=8, frameon=False)
    if errors is not None and has_errors:
        error_axes = figure.add_subplot(grid[0, 1])
        nees_axes = figure.add_subplot(grid[1, 1], sharex=error_axes)
        draw_run_in(error_axes, nees_axes, series("against the truth", errors))
    return figure
