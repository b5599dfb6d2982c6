"""Thousands of runs that outlive their process: a run that is finished is kept, and never made again.

What is kept stands in one SQLite file: a run is in it whole or not at all, whenever the process or the power
is cut. The same sweep goes on where it stopped; another one is refused.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import sqlite3
import sys
import zlib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from textwrap import shorten
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import bslam
from bslam.core.builds import REALS, SIZE_CLASSES
from bslam.core.raw import library, vision_library
from bslam.errors import BslamError
from bslam.evaluation.failure import was_off
from bslam.options import RunOptions
from bslam.runs.batch import Job, Outcome, outcomes_of, prepare
from bslam.runs.output import finite, write_atomically
from bslam.runs.sources import Source

STORE: Final = "sweep.sqlite"
PARQUET: Final = "results.parquet"
_FINISHED: Final = "finished"
_TABLES: Final = """
create table if not exists plan (word text primary key, value text not null);
create table if not exists runs (name text primary key, entry text not null, series blob);
"""
_LOG_INTERVAL_S: Final = 30.0  # between lines of progress where there is no terminal


@dataclass
class SweepResult:
    """What there is after a sweep; entries in the order of the jobs, those that failed left out."""

    entries: list[dict[str, Any]]
    failed: list[Outcome] = field(default_factory=list)  # of this time; the next one tries them again
    missing: int = 0  # neither made nor failed
    kept: int = 0  # of the entries, made by an earlier process
    stopped: str = ""  # why runs are missing

    @property
    def all_entries(self) -> list[dict[str, Any]]:
        """Those that failed last."""
        return [*self.entries, *(one.entry for one in self.failed)]


def code_digest() -> str:
    """Of the program: runs of two versions are not one sweep."""
    files = [*Path(bslam.__file__).parent.rglob("*.py"), *Path(bslam.__file__).parent.rglob("*.toml")]
    files += Path(bslam.__file__).parent.rglob("*.npy")
    digest = hashlib.sha256(library(REALS[0], SIZE_CLASSES[0]).sources.encode())
    digest.update(vision_library().sources.encode())
    for path in sorted(files):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


class Store:
    """The runs of one sweep, in a folder. Raises BslamError if it cannot be, or holds part of another sweep.

    plan: everything that decides what its runs are, in the words of its file. A finished sweep is replaced by
    another one.
    """

    def __init__(self, folder: Path, plan: Mapping[str, str]) -> None:
        self.path = folder / STORE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._connection = sqlite3.connect(self.path, timeout=1.0, isolation_level=None)
        except (OSError, sqlite3.Error) as error:
            raise BslamError(f"{self.path}: {error}; allowed: a folder one may write to") from error
        try:
            with self._trouble():
                self._connection.execute("pragma locking_mode = exclusive")
                self._connection.execute("begin exclusive")
                self._make_tables()
                self._agree(plan)
                self._connection.execute("commit")
        except BaseException:
            self._connection.close()
            raise

    def close(self) -> None:
        """Another process may go on."""
        self._connection.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _make_tables(self) -> None:
        for statement in _TABLES.split(";"):
            self._connection.execute(statement)

    def _agree(self, plan: Mapping[str, str]) -> None:
        then = dict(self._connection.execute("select word, value from plan"))
        finished = then.pop(_FINISHED, None)
        changed = [word for word in dict.fromkeys((*plan, *then)) if plan.get(word) != then.get(word)]
        if then and changed and finished is None:
            change = _change(changed[0], *(one.get(changed[0], "not there") for one in (then, plan)))
            raise BslamError(
                f"{self.path}: holds part of another sweep: {change} now; "
                "allowed: the sweep as it was, another --out, or --restart"
            )
        if changed:
            self._connection.execute("delete from plan")
            self._connection.execute("drop table runs")  # another version's may have other columns
            self._make_tables()
            self._connection.executemany("insert into plan values (?, ?)", plan.items())

    def finish(self) -> None:
        """Nothing is missing: another sweep may take the place of this one."""
        with self._trouble():
            self._connection.execute("insert or ignore into plan values (?, 'yes')", (_FINISHED,))

    def entries(self) -> dict[str, dict[str, Any]]:
        """What is kept, by the runs' names."""
        with self._trouble():
            rows = self._connection.execute("select name, entry from runs").fetchall()
        return {name: json.loads(entry) for name, entry in rows}

    def keep(self, name: str, entry: Mapping[str, Any], series: bytes | None = None) -> None:
        """Keep a run that is finished, and its error over time; one that is kept stays as it is."""
        text = json.dumps(finite(dict(entry)), allow_nan=False)
        with self._trouble():
            self._connection.execute("insert or ignore into runs values (?, ?, ?)", (name, text, series))

    def series(self, name: str) -> NDArray[np.float64]:
        """The kept time in s and error in m of a run, (2, n + 1)."""
        with self._trouble():
            (packed,) = self._connection.execute("select series from runs where name = ?", (name,)).fetchone()
        return np.frombuffer(zlib.decompress(packed), np.float32).reshape(2, -1).astype(np.float64)

    @contextlib.contextmanager
    def _trouble(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            why = str(error)
            if "locked" in why:
                why = "another process is at work on this sweep"
            allowed = "the same command again, which goes on"
            raise BslamError(f"{self.path}: {why}; what it holds is kept; allowed: {allowed}") from error


def _change(word: str, old: str, new: str) -> str:
    """What changed, in words; of a table the first key that did."""
    try:
        then, now = json.loads(old), json.loads(new)
    except ValueError:
        then, now = old, new
    if isinstance(then, dict) and isinstance(now, dict):
        values = ((key, json.dumps(then.get(key)), json.dumps(now.get(key))) for key in {**then, **now})
        return next(_change(f"{word}, {key}", *both) for key, *both in values if both[0] != both[1])
    return f"{word} was {shorten(old, 200)} and is {shorten(new, 200)}"


def forget(folder: Path) -> None:
    """Throw away what is kept. Raises BslamError."""
    try:
        for path in folder.glob(f"{STORE}*"):
            path.unlink()
    except OSError as error:
        raise BslamError(f"{folder / STORE}: {error}; allowed: a folder one may write to") from error


def run_sweep(
    jobs: Sequence[Job], store: Store, out: Path, processes: int, backend: str | None = None
) -> SweepResult:
    """Make the runs that are not kept yet, and keep each as it is finished. Raises BslamError."""
    out = out.absolute()
    beside = beside_known(jobs)
    compared = {*beside, *beside.values()}
    kept = store.entries()
    todo = [job for job in jobs if job.name not in kept]
    result = SweepResult([], kept=len(jobs) - len(todo))
    terminal = sys.stderr.isatty()
    interval_s = 0.1 if terminal else _LOG_INTERVAL_S
    bar = tqdm(total=len(jobs), initial=result.kept, desc="runs", unit="run", mininterval=interval_s)
    if not terminal:
        bar.maxinterval = interval_s
    try:
        with bar:
            if backend is None:
                prepare(todo, processes)
            for index, outcome in outcomes_of(todo, out, processes, backend):
                if outcome.failed:
                    result.failed.append(outcome)
                else:
                    name = todo[index].name
                    store.keep(name, outcome.entry, _packed(outcome) if name in compared else None)
                bar.update()
    except KeyboardInterrupt:
        result.stopped = "stopped"
    except BrokenExecutor:
        result.stopped = "a process died (killed, or out of memory); fewer --jobs need less memory"
    kept = _compared(store, beside)
    result.entries = [kept[job.name] for job in jobs if job.name in kept]
    result.missing = len(jobs) - len(result.entries) - len(result.failed)
    if len(result.entries) == len(jobs):
        store.finish()
    return result


def _compared(store: Store, beside: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    """All entries that are kept, held against known association where that ran beside."""
    kept = store.entries()
    for name, known in beside.items():
        if name in kept and known in kept:
            compare_with_known(kept[name], kept[known], store.series(name), store.series(known))
    return kept


def beside_known(jobs: Sequence[Job]) -> dict[str, str]:
    """Of each run the one with known association on the same drive, by name, where there is another one."""
    known = {
        _drive(job): job.name for job in jobs if job.maker is None and job.options.association_name == "known"
    }
    pairs = {job.name: known[drive] for job in jobs if (drive := _drive(job)) in known}
    return {name: other for name, other in pairs.items() if name != other}


def _drive(job: Job) -> tuple[Source, RunOptions]:
    return job.source, replace(job.options, association="known", wrong_identity_rate=0.0)


def _packed(outcome: Outcome) -> bytes:
    """As `Store.series` reads it."""
    return zlib.compress(np.stack([outcome.time_s, outcome.error_m]).astype(np.float32).tobytes())


def compare_with_known(
    entry: dict[str, Any],
    known: Mapping[str, Any],
    series: NDArray[np.float64],
    known_series: NDArray[np.float64],
) -> None:
    """Adds the ratio of the mean errors, and judges anew whether the run was off; series as `Store`'s."""
    if series.shape != known_series.shape or "position_error_m" not in known:
        return
    entry["ratio_to_known"] = entry["position_error_m"]["mean"] / known["position_error_m"]["mean"]
    entry["failed_by"] = [why for why in entry["failed_by"] if why != "off"]
    if was_off(series[0], series[1], known_series[1]):
        entry["failed_by"].append("off")
    entry["failed"] = bool(entry["failed_by"])


def write_parquet(path: Path, entries: Sequence[Mapping[str, Any]]) -> None:
    """A row a run, a column a figure ("position_error_m.mean"). Raises BslamError, ImportError."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = [_flat(finite(dict(entry))) for entry in entries]
    names = list(dict.fromkeys(name for row in rows for name in row))
    table = pa.table({name: [row.get(name) for row in rows] for name in names})
    buffer = pa.BufferOutputStream()
    pq.write_table(table, buffer)
    write_atomically(path, buffer.getvalue().to_pybytes())


def _flat(entry: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in entry.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat
