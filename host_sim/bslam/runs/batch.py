"""Many runs in parallel: one that fails does not stop the others, and Ctrl-C keeps what is finished."""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import joblib
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from bslam.errors import BslamError
from bslam.evaluation.metrics import Evaluation, describe, evaluate, summarise
from bslam.evaluation.trace import Trace
from bslam.log import Log
from bslam.options import RunOptions
from bslam.runs.output import write_run, write_summary
from bslam.runs.rerun import rerun
from bslam.runs.runner import FrameFeed, Watcher, run_log
from bslam.runs.sources import RecordingSource, ScenarioSource, Source
from bslam.target.lines import TargetError

_LOST = (
    "a process died (killed, or out of memory) before this run was finished; fewer --jobs need less memory"
)

# Draws the pictures of a run: out directory, name, source, log, trace, evaluation.
Draw = Callable[[Path, str, Source, Log, Trace, Evaluation | None], None]


@dataclass(frozen=True)
class Job:
    """One run: which log, how, and under which name its files stand."""

    name: str
    source: Source
    options: RunOptions
    draw: Draw | None = None
    record: bool = False  # write the log as a folder NAME and the run as NAME.mcap, too
    files: bool = True  # write trajectories and map
    maker: Maker | None = None  # who makes it; None: our own core


@dataclass(frozen=True)
class Outcome:
    """What comes back from a run, small enough to send between processes."""

    name: str
    entry: dict[str, Any]  # for summary.json
    time_s: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))  # (n + 1,)
    error_m: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))  # (n + 1,)
    nees: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))  # (n + 1,)
    bad_input: str | None = None  # the log, or an option, is not what it should be
    crash: str | None = None  # traceback of anything else that went wrong

    @property
    def failed(self) -> bool:
        return self.bad_input is not None or self.crash is not None


Maker = Callable[[Job, Path], Outcome]
"""Makes a job in another way than by our own core; it can be sent to another process."""


@dataclass(frozen=True)
class BatchResult:
    """Outcomes in the order of the jobs; `interrupted`: some are missing because the user stopped."""

    outcomes: tuple[Outcome, ...]
    interrupted: bool

    @property
    def bad_input(self) -> str | None:
        """The first complaint about the input."""
        return next((one.bad_input for one in self.outcomes if one.bad_input is not None), None)

    @property
    def ok(self) -> bool:
        return not self.interrupted and not any(one.failed for one in self.outcomes)


def run_batch(jobs: Sequence[Job], out: Path, processes: int) -> BatchResult:
    """Run all jobs, write their files and summary.json into `out`.

    After Ctrl-C what is finished stays. If a process dies (killed, or out of memory), so does the pool: every
    run that is not finished has failed then.
    """
    out = out.absolute()  # worker processes may have another working directory
    finished: dict[int, Outcome] = {}
    interrupted = False
    try:
        prepare(jobs, processes)
        for index, outcome in tqdm(
            outcomes_of(jobs, out, processes),
            total=len(jobs),
            desc="runs",
            unit="run",
            disable=_bar_off(jobs),
        ):
            finished[index] = outcome
    except KeyboardInterrupt:
        interrupted = True
    except BrokenExecutor:
        for index, job in enumerate(jobs):
            if index not in finished:
                finished[index] = Outcome(job.name, failed_entry(job, _LOST), crash=_LOST)
    outcomes = tuple(finished[index] for index in sorted(finished))
    more = {"interrupted": True} if interrupted else {}
    write_summary(out, [outcome.entry for outcome in outcomes], **more)
    return BatchResult(outcomes, interrupted)


def prepare(jobs: Sequence[Job], processes: int) -> None:
    """Do the preparations that several runs share, each once; what fails here fails again in its run."""
    needed = {job.source.shared: job.source for job in jobs if job.source.shared is not None}
    if not needed:
        return
    parallel = joblib.Parallel(n_jobs=min(processes, len(needed)), return_as="generator_unordered")
    done = parallel(joblib.delayed(_prepare_one)(source) for source in needed.values())
    for _ in tqdm(done, total=len(needed), desc="drives", unit="drive", disable=_bar_off(jobs)):
        pass


def _prepare_one(source: Source) -> None:
    with contextlib.suppress(Exception):  # which its run meets again, and reports
        source.prepare()


def execute(job: Job, out: Path) -> Outcome:
    """One run from log to files. Never raises: a failure is an outcome, too."""
    try:
        return _execute(job, out) if job.maker is None else job.maker(job, out)
    except BslamError as error:
        return Outcome(job.name, failed_entry(job, str(error)), bad_input=str(error))
    except TargetError as error:  # the robot at the other end went: there is nothing to look into here
        return Outcome(job.name, failed_entry(job, str(error)), crash=f"{error}\n")
    except Exception as error:  # a run that crashes is an outcome; the others go on
        entry = failed_entry(job, f"{type(error).__name__}: {error}")
        return Outcome(job.name, entry, crash=traceback.format_exc())


def run_job(
    job: Job, log: Log, out: Path, watcher: Watcher | None = None, frames: FrameFeed | None = None
) -> tuple[Trace, dict[str, Any]]:
    """The trace of the run, and what the entry of a recording says otherwise. Raises BslamError."""
    if isinstance(job.source, RecordingSource):
        trace, comparison = rerun(job.source.recording(), job.options, watcher)
        return trace, dict.fromkeys(["presets", "step_us_median"]) | {"recording": asdict(comparison)}
    record = out / f"{job.name}.mcap" if job.record else None
    return run_log(log, job.options, watcher=watcher, record=record, frames=frames), {}


def _execute(job: Job, out: Path) -> Outcome:
    log = job.source.load()
    if job.record:
        log.write(out / job.name)
    trace, more = run_job(job, log, out)
    return write_files(job, out, log, trace, more)


def write_files(
    job: Job, out: Path, log: Log, trace: Trace, more: Mapping[str, Any] = MappingProxyType({})
) -> Outcome:
    """Judge a run that is over, and write its files; `more` goes into its entry. Raises BslamError."""
    evaluation = evaluate(log, trace, job.options)
    if job.files:
        start_map = job.options.kept_map
        kept = None if start_map is None else Path(start_map)
        write_run(out, job.name, trace, evaluation, kept, log.identity)
    if job.draw is not None:
        job.draw(out, job.name, job.source, log, trace, evaluation)
    entry = summarise(log, trace, job.options, evaluation) | {
        "name": job.name,
        "scenario": job.source.name,
        "truth": job.source.truth_kind if log.truth is not None else "none",
        **more,
    }
    entry = {key: value for key, value in entry.items() if value is not None}
    if evaluation is None:
        return Outcome(job.name, entry)
    return Outcome(
        name=job.name,
        entry=entry,
        time_s=evaluation.time_s.astype(np.float32),
        error_m=evaluation.error_m.astype(np.float32),
        nees=evaluation.nees.astype(np.float32),
    )


def failed_entry(job: Job, error: str) -> dict[str, Any]:
    words = describe(job.options) | {"name": job.name, "scenario": job.source.name}
    return words | {"diverged": True, "failed": True, "error": error}


def outcomes_of(
    jobs: Sequence[Job], out: Path, processes: int, backend: str | None = None
) -> Iterator[tuple[int, Outcome]]:
    """Pairs of job index and outcome as they finish; in this process where a second one would not help.

    backend: joblib's; None: its own processes on this machine.
    """
    processes = min(processes, len(jobs))
    if processes <= 1 and backend is None:
        yield from ((index, execute(job, out)) for index, job in enumerate(jobs))
        return
    with joblib.parallel_config(backend=backend or "loky"):
        parallel = joblib.Parallel(n_jobs=-1 if backend else processes, return_as="generator_unordered")
    own = os.getpid()
    work = (joblib.delayed(_execute_in_worker)(index, job, out, own) for index, job in enumerate(jobs))
    yield from parallel(work)


def _execute_in_worker(index: int, job: Job, out: Path, parent: int) -> tuple[int, Outcome]:
    if os.getpid() != parent and threading.current_thread() is threading.main_thread():
        # Ctrl-C reaches every process of the terminal; the parent alone decides what it means. (Where there
        # are no processes to be had, the parent itself does the work.)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        # Processes that an algorithm gets (contest.py) inherit the word, and know nothing of joblib's "loky".
        multiprocessing.set_start_method("spawn", force=True)
    return index, execute(job, out)


def _bar_off(jobs: Sequence[Job]) -> bool | None:
    """No bar for a single run; else tqdm's own choice: a bar on a terminal only."""
    return True if len(jobs) < 2 else None


def make_jobs(
    sources: Sequence[Source],
    options: Sequence[RunOptions],
    draw: Draw | None,
    pictures: int,
    record: bool = False,
) -> list[Job]:
    """One job for each pair of source and options, named apart; the first `pictures` of them are drawn."""
    names = run_names(sources, options)
    return [
        Job(name, source, one, draw if index < pictures else None, record)
        for index, (name, source, one) in enumerate(zip(names, sources, options, strict=True))
    ]


def run_names(sources: Sequence[Source], options: Sequence[RunOptions]) -> list[str]:
    """A name for each run: the log's, a simulation's seed, and whatever else differs between the runs."""
    varying = {
        word: len({getattr(one, word) for one in options}) > 1
        for word in (
            "sigma_mps",
            "observation",
            "association_name",
            "filter",
            "motion",
            "noise",
            "velocity_states",
            "recovery",
        )
    }
    seeds_vary = len({one.seed for one in options}) > 1
    parameters = [dict(one.parameters) for one in options]
    known = dict.fromkeys(itertools.chain.from_iterable(parameters))
    keys = [key for key in known if len({one.get(key) for one in parameters}) > 1]
    names: dict[str, None] = {}
    for source, one, values in zip(sources, options, parameters, strict=True):
        name = source.name
        if seeds_vary or isinstance(source, ScenarioSource):
            name += f"_seed{one.seed}"
        name += "".join(_name_part(word, getattr(one, word)) for word, varies in varying.items() if varies)
        name += "".join(f"_{key}{values[key]:g}" for key in keys if key in values)
        names[_unique(name, names)] = None
    return list(names)


def _name_part(word: str, value: Any) -> str:
    if word == "sigma_mps":
        return f"_sigma{value:g}" if value is not None else ""
    if word == "velocity_states":
        return "_velocity" if value else "_novelocity"
    if word == "recovery":
        return f"_recovery{value}" if value else ""
    return f"_{str(value).replace(':', '')}"


def _unique(name: str, taken: Collection[str]) -> str:
    """`name`, or where two logs share it, with a number behind."""
    numbered = (f"{name}-{number}" for number in itertools.count(2))
    return next(one for one in itertools.chain([name], numbered) if one not in taken)
