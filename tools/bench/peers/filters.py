"""The filter step beside other people's filters: time, instructions, memory, error, landmarks."""

from __future__ import annotations

import importlib.util
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import fmean, median

from tqdm import tqdm

from bslam.log import Log
from bslam.options import RunOptions
from bslam.runs.rival import run_algorithm
from tools.bench.peers.drives import circle, simulated, text
from tools.bench.peers.programs import CORE, PEERS, Program, instructions, run
from tools.checks.markdown import Row, table

STEPS = {6: 3000, 20: 1500, 50: 400, 100: 120, 200: 45}
"""Measured, by beacons: so many that a run takes some ms at least and some s at most."""
COUNTED_STEPS = {6: 300, 20: 90, 50: 24, 100: 6, 200: 6}
"""So many under callgrind that what only the first ones cost (binding to libraries) is lost among them."""
GOALS = {
    "MRPT, Davison": (15, 15, 9, 5, 4),
    "MRPT, default": (20, 20, 20, 20, 20),
    "textbook, Eigen float": (6, 13, 27, 65, 100),
}
"""What each is to take at least, in times of bslam's time, by beacons as in STEPS."""
GTSAM_STEPS = 300
LIMIT_S = 30.0
"""For a drive of 200 s without identities: bslam takes some ms for it."""
SCENARIOS = {"paper_room": range(100, 104), "building20": range(100, 102)}
"""Drives for accuracy: the simulator's, by seed."""


def here() -> list[Program]:
    """bslam and the peers that are installed."""
    return [CORE, *(one for one in PEERS if one.is_here())]


def has_gtsam() -> bool:
    return importlib.util.find_spec("gtsam") is not None


def time_table(rounds: int) -> str:
    """Ratios to bslam's time, from rounds in which each program runs once; goals in brackets."""
    rows: dict[str, list[object]] = {one.name: [one.name] for one in here()}
    for column, (beacons, steps) in enumerate(STEPS.items()):
        taken_ns = _times_ns(circle(beacons, steps), beacons, steps, rounds)
        own_ns = taken_ns[CORE.name]
        rows[CORE.name].append(f"1 ({min(own_ns) / 1e3:.2f} us)")
        for name in list(taken_ns)[1:]:
            ratios = sorted(its / own for its, own in zip(taken_ns[name], own_ns, strict=True))
            rows[name].append(_ratio_words(ratios, GOALS[name][column]))
    lines: list[Row] = list(rows.values())
    if has_gtsam():
        lines.append(["GTSAM, iSAM2 (from Python)", *(_gtsam_words(beacons) for beacons in STEPS)])
    return table(["beacons", *STEPS], lines)


def _times_ns(log: Log, beacons: int, steps: int, rounds: int) -> dict[str, list[float]]:
    drive = text(log, steps)
    programs = {one: one.build(beacons) for one in here()}
    taken_ns: dict[str, list[float]] = {one.name: [] for one in programs}
    for _ in tqdm(range(rounds), desc=f"{beacons} beacons", unit="round", leave=False):
        for one, path in programs.items():
            taken_ns[one.name].append(run(path, one.words, drive).step_ns)
    return taken_ns


def _ratio_words(ratios: Sequence[float], goal: int) -> str:
    middle = median(ratios)
    verdict = "" if middle >= goal else ", **missed**"
    return f"{middle:.1f} [{ratios[0]:.1f}, {ratios[-1]:.1f}] ({goal}{verdict})"


def _gtsam_words(beacons: int) -> str:
    """iSAM2's middle step, in times of bslam's mean one on the same drive."""
    from bslam.algorithms.isam2 import Isam2

    log = circle(beacons, GTSAM_STEPS)
    own = run(CORE.build(beacons), CORE.words, text(log, GTSAM_STEPS))
    options = RunOptions(velocity_states=False, association="known")
    trace = run_algorithm(log, options, Isam2, lambda _step: None)
    return f"{1e3 * trace.step_us_median / own.step_ns:.0f}"


def count_table() -> str:
    """Instructions of a step, by callgrind."""
    rows = []
    for one in here():
        row: list[object] = [one.name]
        for beacons, steps in tqdm(COUNTED_STEPS.items(), f"counting {one.name}", unit="map", leave=False):
            drive = text(circle(beacons, steps), steps)
            count = instructions(one.build(beacons), one.words, drive, steps)
            row.append(f"{count:,}")
        rows.append(row)
    return table(["beacons", *STEPS], rows)


def memory_table() -> str:
    """Bytes kept between steps: the struct, or what the heap holds."""
    rows = []
    for one in here():
        logs = {beacons: text(circle(beacons, 3), 3) for beacons in STEPS}
        runs = (run(one.build(beacons), one.words, drive) for beacons, drive in logs.items())
        rows.append([one.name, *(f"{each.kept_bytes / 1024:,.0f} KB" for each in runs)])
    return table(["beacons", *STEPS], rows)


def accuracy_table() -> str:
    """Mean position error with identities, and what is made of the same drives without."""
    head = ["", "error, known", "error, unknown", "landmarks made", "there are", "ratio of time, known"]
    rows = [row for scenario, seeds in SCENARIOS.items() for row in _accuracy_rows(scenario, seeds)]
    return table(head, rows)


def _accuracy_rows(scenario: str, seeds: range) -> Iterator[Row]:
    logs = [simulated(scenario, seed) for seed in tqdm(seeds, desc=scenario, unit="drive", leave=False)]
    there = len(logs[0].beacons.beacon_id) if logs[0].beacons is not None else 0
    own_ns = 1.0
    for one in here():
        program = one.build(_room(there))
        known = [run(program, one.words, text(log, _steps(log))) for log in logs]
        taken_ns = fmean(each.step_ns for each in known)
        own_ns = taken_ns if one is CORE else own_ns
        row = [f"{scenario}: {one.name}", _cm(each.error_m for each in known), "-", "-", there]
        if one.by_distance is not None:
            words = [*one.words, *one.by_distance]
            row[2:4] = _without_identities(program, words, logs)
        yield [*row, f"{taken_ns / own_ns:.1f}"]


def _without_identities(program: Path, words: Sequence[str], logs: Sequence[Log]) -> list[str]:
    """Mean error and landmarks made; of a program that makes more and more of them only that."""
    drives = [text(log, _steps(log), identities=False) for log in logs]
    try:
        runs = [run(program, words, drive, LIMIT_S) for drive in drives]
    except subprocess.TimeoutExpired:
        return [f"stopped after {LIMIT_S:.0f} s", "-"]
    return [_cm(each.error_m for each in runs), ", ".join(str(each.landmarks) for each in runs)]


def _room(beacons: int) -> int:
    """For false ones as well."""
    return min(4 * beacons, 100)


def _steps(log: Log) -> int:
    return len(log.odometry.time_us)


def _cm(errors_m: Iterator[float]) -> str:
    return f"{100.0 * fmean(errors_m):.1f} cm"
