"""Several algorithms on the same drives, each run in a process of its own.

An algorithm that raises, says what cannot be, dies or hangs has failed, by name, and all others go on.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Event
from typing import Any, Final

import numpy as np
from tqdm import tqdm

from bslam.errors import BslamError
from bslam.options import RunOptions
from bslam.runs.batch import Job, Outcome, failed_entry, write_files
from bslam.runs.methods import OURS, Method, load_method
from bslam.runs.rival import run_algorithm
from bslam.runs.sources import Source

_POLL_S: Final = 0.2
_START_S: Final = 60.0  # until a process has read its modules, on top of the limit of a call
# What of a run's description only bslam's own core has.
_OF_THE_CORE: Final = ("filter", "motion", "velocity_states", "target", "real", "known_map", "parameters")


@dataclass(frozen=True)
class Bout:
    """One algorithm on one drive."""

    method: Method
    job: Job


@dataclass(frozen=True)
class ContestResult:
    """What became of each bout, in their order; `interrupted`: some are missing because the user stopped."""

    outcomes: tuple[tuple[Bout, Outcome], ...]
    interrupted: bool


@dataclass(frozen=True)
class Guest:
    """Makes a batch's jobs by an algorithm, each in a process of its own."""

    method: Method
    call_limit_s: float

    def __call__(self, job: Job, out: Path) -> Outcome:
        """The outcome; one that is named if the algorithm raises, dies or hangs."""
        return _watch(Bout(self.method, replace(job, maker=None)), out.absolute(), self.call_limit_s, Event())


def guest_jobs(jobs: Sequence[Job], guest: Guest) -> list[Job]:
    """The same drives for an algorithm; what only our core has, a filter say, makes no second run of it."""
    drives: dict[str, Job] = {}
    for job in jobs:
        plain = replace(job.options, filter="standard", motion="arc", parameters=())
        drives.setdefault(repr((job.source, plain)), job)
    return [replace(one, name=f"{one.name}.{guest.method.name}", maker=guest) for one in drives.values()]


def make_bouts(
    methods: Sequence[Method], sources: Sequence[Source], options: Sequence[RunOptions]
) -> list[Bout]:
    """Every method on every drive, drive by drive; named SCENARIO_seedN.METHOD."""
    return [
        Bout(method, Job(f"{source.name}_seed{one.seed}.{method.name}", source, one))
        for source, one in zip(sources, options, strict=True)
        for method in methods
    ]


def hold_contest(bouts: Sequence[Bout], out: Path, processes: int, call_limit_s: float) -> ContestResult:
    """Run all bouts and write their files into `out`. After Ctrl-C what is finished stays."""
    out = out.absolute()
    finished: dict[int, Outcome] = {}
    interrupted = False
    stop = Event()
    pool = ThreadPoolExecutor(max_workers=processes)
    try:
        waiting = {
            pool.submit(_watch, bout, out, call_limit_s, stop): index for index, bout in enumerate(bouts)
        }
        for done in tqdm(as_completed(waiting), total=len(waiting), desc="runs", unit="run", disable=None):
            finished[waiting[done]] = done.result()
    except KeyboardInterrupt:
        interrupted = True
        stop.set()
        pool.shutdown(wait=True, cancel_futures=True)
    finally:
        pool.shutdown()
    return ContestResult(tuple((bouts[index], finished[index]) for index in sorted(finished)), interrupted)


def _watch(bout: Bout, out: Path, call_limit_s: float, stop: Event) -> Outcome:
    """Run a bout in its own process, and end that if it gives no sign of life for too long."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    steps = context.Value("q", 0, lock=False)
    process = context.Process(target=_fight, args=(bout, out, there, steps), daemon=True)
    process.start()
    there.close()
    try:
        return _listen(bout, here, process, steps, call_limit_s, stop)
    finally:
        if process.is_alive():
            process.kill()
        process.join()
        here.close()


def _listen(
    bout: Bout, here: Connection, process: Any, steps: Any, call_limit_s: float, stop: Event
) -> Outcome:
    """Wait for the outcome, as long as steps are done now and then."""
    done, until_s = 0, time.monotonic() + call_limit_s + _START_S
    while not stop.is_set():
        if here.poll(_POLL_S):
            try:
                return here.recv()
            except EOFError:
                process.join()
                ending = _how_it_ended(process.exitcode)
                return _failure(bout, f"its process died ({ending}) after step {steps.value}")
        if steps.value != done:
            done, until_s = steps.value, time.monotonic() + call_limit_s
        elif time.monotonic() > until_s:
            taken = f"took more than {call_limit_s:g} s; allowed: as much as --call-limit says"
            return _failure(bout, f"hangs: what came after step {done} {taken}")
    return _failure(bout, "stopped")


def _how_it_ended(status: int | None) -> str:
    return f"signal {-status}" if status is not None and status < 0 else f"exit status {status}"


def _failure(bout: Bout, error: str, crash: str | None = None) -> Outcome:
    entry = _entry_of(bout, failed_entry(bout.job, f"{bout.method.where}: {error}"))
    return Outcome(bout.job.name, entry, crash=crash or error)


def _entry_of(bout: Bout, entry: dict[str, Any]) -> dict[str, Any]:
    """The run's entry for summary.json, with the method's name and without what only our core has."""
    ours = bout.method.name == OURS
    kept = {key: value for key, value in entry.items() if ours or key not in _OF_THE_CORE}
    return {"method": bout.method.name} | kept


def _fight(bout: Bout, out: Path, there: Connection, steps: Any) -> None:
    """In the bout's own process: run, and say how it went."""
    with contextlib.suppress(KeyboardInterrupt):  # the parent knows, too, and decides
        os.dup2(2, 1)  # what an algorithm prints must not get into the table
        there.send(_outcome(bout, out, steps))


def _outcome(bout: Bout, out: Path, steps: Any) -> Outcome:
    def count(step: int) -> None:
        steps.value = step

    try:
        log = bout.job.source.load()
        trace = run_algorithm(log, bout.job.options, load_method(bout.method), count)
        outcome = write_files(_judged(bout), out, log, trace)
        return replace(outcome, entry=_entry_of(bout, outcome.entry))
    except BslamError as error:
        return _failure(bout, " ".join([str(error), *getattr(error, "__notes__", ())]))
    except Exception as error:  # anything: it is a stranger's code
        said = " ".join([f"{type(error).__name__}: {error}", *getattr(error, "__notes__", ())])
        return _failure(bout, said, _without_our_frames())


def _judged(bout: Bout) -> Job:
    """The job as it is judged: only our core may keep its covariance in invariant coordinates."""
    if bout.method.name == OURS:
        return bout.job
    return replace(bout.job, options=replace(bout.job.options, filter="standard"))


def _without_our_frames() -> str:
    """The traceback from the algorithm's own code on, which is what its author looks for."""
    kind, error, trace = sys.exc_info()
    ours = str(Path(__file__).parent)
    while (
        trace is not None and trace.tb_next is not None and trace.tb_frame.f_code.co_filename.startswith(ours)
    ):
        trace = trace.tb_next
    return "".join(traceback.format_exception(kind, error, trace))


def means(result: ContestResult, methods: Sequence[Method], bound: str, every: int) -> list[dict[str, Any]]:
    """One entry a method for compare.json: means over its runs that went well, and ratios to the bound.

    `on_bound_steps_m` is the mean error at the steps at which the bound is solved; the ratio is of those,
    over the drives on which both went well.
    """
    by_method = {method.name: _by_drive(result, method.name) for method in methods}
    table = []
    for method in methods:
        runs = by_method[method.name]
        good = [one for one in runs.values() if not one.failed]
        line: dict[str, Any] = {
            "method": method.name,
            "where": method.where,
            "meaning": method.meaning,
            "shipped": method.shipped,
            "runs": len(runs),
            "failed": len(runs) - len(good),
            "lost": sum(bool(one.entry["diverged"]) for one in good),
            "errors": [one.entry["error"] for one in runs.values() if one.failed],
        }
        for name, path in _FIGURES.items():
            values = [value for one in good if (value := _figure(one.entry, path)) is not None]
            if values:
                line[name] = float(np.mean(values))
        line |= _beside_the_bound(runs, by_method.get(bound, {}), every)
        table.append(line)
    return table


_FIGURES: Final = {
    "position_error_mean_m": ("position_error_m", "mean"),
    "position_error_max_m": ("position_error_m", "max"),
    "position_error_last_50s_m": ("position_error_last_50s_m",),
    "bound_error_m": ("bound_error_m",),
    "nees_mean": ("nees_mean",),
    "map_rmse_m": ("map_rmse_m",),
    "beacons_mapped": ("beacons_mapped",),
    "beacons_true": ("beacons_true",),
    "wrong_associations": ("wrong_associations",),
    "step_us_median": ("step_us_median",),
}


def _figure(entry: dict[str, Any], path: tuple[str, ...]) -> float | None:
    value: Any = entry
    for key in path:
        value = value.get(key) if isinstance(value, dict) else None
    return value


def _by_drive(result: ContestResult, name: str) -> dict[tuple[str, int], Outcome]:
    return {
        (bout.job.source.name, bout.job.options.seed): outcome
        for bout, outcome in result.outcomes
        if bout.method.name == name
    }


def _beside_the_bound(
    runs: dict[tuple[str, int], Outcome], bound: dict[tuple[str, int], Outcome], every: int
) -> dict[str, float]:
    pairs = list(_pairs(runs, bound, every))
    if not pairs:
        return {}
    own_m, bound_m = np.mean(pairs, axis=0).tolist()
    return {
        "on_bound_steps_m": own_m,
        "bound_m": bound_m,
        "ratio_to_bound": own_m / bound_m if bound_m else 0.0,
    }


def _pairs(
    runs: dict[tuple[str, int], Outcome], bound: dict[tuple[str, int], Outcome], every: int
) -> Iterator[tuple[float, float]]:
    """Mean errors of a method and of the bound on the same drive and steps."""
    for drive, one in runs.items():
        other = bound.get(drive)
        if other is None or one.failed or other.failed or len(one.error_m) == 0:
            continue
        rows = np.arange(len(one.error_m)) % every == 0
        rows &= np.isfinite(one.error_m) & np.isfinite(other.error_m)
        if rows.any():
            yield float(np.mean(one.error_m[rows])), float(np.mean(other.error_m[rows]))
