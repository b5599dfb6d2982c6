"""A sweep that is killed in the middle: is anything lost, is anything counted twice?

    .venv/bin/python -m tools.proofs.kill_sweep --runs 1000 --kills 3

Starts `bslam sweep` on short drives, kills it with all its processes (SIGKILL), starts it again, and compares
what comes out with the same sweep in one go. Exit status 0: every run once, with the same figures.
"""

import argparse
import json
import os
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import closing
from pathlib import Path
from typing import Any

import bslam
from bslam import cli
from bslam.experiment.sweep import STORE

TIMES = ("step_us_median",)  # differs from run to run
SCENARIO = Path(bslam.__file__).parent / "scenarios/paper_room.toml"
STEPS = 50
ENTRY_BYTES = 2000  # of the store, a run


def write_sweep(folder: Path, runs: int) -> Path:
    """A sweep file for `runs` drives of STEPS steps."""
    world = SCENARIO.read_text(encoding="utf-8")
    assert "steps = 5000 " in world or "steps = 5000\n" in world
    (folder / "short.toml").write_text(world.replace("steps = 5000", f"steps = {STEPS}"), encoding="utf-8")
    sweep = folder / "sweep.toml"
    lines = [f'scenarios = ["{folder / "short.toml"}"]', f'seeds = "0:{runs // 2}"', "files = false"]
    lines.append('association = ["known", "mahalanobis"]')
    sweep.write_text("\n".join(lines), encoding="utf-8")
    return sweep


def command(sweep: Path, out: Path, jobs: int) -> list[str]:
    """Words for `bslam`."""
    return ["sweep", str(sweep), "--out", str(out), "--jobs", str(jobs)]


def kept(out: Path) -> int:
    """Runs that stand in the store."""
    with closing(sqlite3.connect(out / STORE)) as connection:
        return int(connection.execute("select count(*) from runs").fetchone()[0])


def size(out: Path) -> int:
    """Of the store's file, which grows with the runs: while a sweep is at work nobody else may read it."""
    path = out / STORE
    return path.stat().st_size if path.is_file() else 0


def kill_once(words: list[str], out: Path, runs: int) -> int:
    """Start, kill when about so many more runs are made; the number of runs that are kept then."""
    wanted = size(out) + max(ENTRY_BYTES * runs, 1)
    with subprocess.Popen(
        [sys.executable, "-m", "bslam", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as process:
        while process.poll() is None and size(out) < wanted:
            time.sleep(0.002)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    return kept(out)


def entries_of(out: Path) -> dict[str, dict[str, Any]]:
    """The runs of summary.json by name, without what differs from run to run. None may be there twice."""
    runs = json.loads((out / "summary.json").read_text(encoding="utf-8"))["runs"]
    twice = [name for name, count in Counter(run["name"] for run in runs).items() if count > 1]
    assert not twice, f"counted twice: {twice}"
    return {run["name"]: {key: run[key] for key in run if key not in TIMES} for run in runs}


def prove(folder: Path, runs: int, kills: int, jobs: int) -> str:
    """What came of it, in words. Raises AssertionError if anything is lost, counted twice or different."""
    sweep, out, whole = write_sweep(folder, runs), folder / "killed", folder / "whole"
    counts = [kill_once(command(sweep, out, jobs), out, runs // (kills + 1)) for _ in range(kills)]
    assert 0 < counts[0] < runs, f"killed with {counts[0]} of {runs} runs made: not in the middle"
    for place in (out, whole):
        assert cli.main(command(sweep, place, jobs)) == 0
    got, wanted = entries_of(out), entries_of(whole)
    assert got.keys() == wanted.keys() and len(got) == runs, f"{len(got)} of {len(wanted)} runs"
    different = [name for name in wanted if got[name] != wanted[name]]
    assert not different, f"not as in one go: {different}"
    cuts = ", ".join(str(count) for count in counts)
    return f"killed with {cuts} runs made; then {runs} of {runs}, each once and as in one go"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000, help="an even number (default: 1000)")
    parser.add_argument("--kills", type=int, default=3, help="default: 3")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default: 2)")
    options = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        print(prove(Path(folder), options.runs, options.kills, options.jobs))
    return 0


if __name__ == "__main__":
    sys.exit(main())
