"""Runs the long proofs and prints what each reached beside its goal.

Examples:
    tools/prove.py                        all of them: hours
    tools/prove.py --only soak mcdc       some
    tools/prove.py --seeds 3              fewer drives for each fault of a drive, for a first look

`make proof` builds what this runs. What a proof prints is in out/proof/NAME.txt. Exit status 0: every goal is
reached; 1: one is not, or could not be measured.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out/proof"
PYTHON = str(ROOT / ".venv/bin/python")
BSLAM = str(ROOT / ".venv/bin/bslam")
THOROUGH = MappingProxyType({"BSLAM_THOROUGH": "1"})
LAST_LINE = r"([^\n]+)\n?\Z"


class Proof(NamedTuple):
    """A row: `figure` finds in the output what was reached; the exit status says if it is enough."""

    name: str
    title: str
    goal: str
    figure: str
    command: list[str]
    environment: Mapping[str, str] = MappingProxyType({})


def own_proofs() -> list[Proof]:
    """Of the core alone."""
    store = ROOT / "build/unit/float/bin/store"
    cuts = ("power cuts at every byte, at every pair", "0 mixed", r"power cuts: (.*)")
    flips = ("bit flips of the guarded state", "found, or without effect", r"bit flips: (.*)")
    soak = ("6 h x 20 seeds, float beside double", "NEES 2.4-3.7, 0, 10 %", r"soak: .* seeds: (.*)")
    mcdc = ("MC/DC of firmware/bslam", "95 %", r"mcdc: (\d.*?),")
    fuzz = ("fuzzing: executions, crashes", "2e8, 1e6 each, 0", r"fuzz: (.*)")
    return [
        Proof("cuts", *cuts, [str(store / "test_slots")], THOROUGH),
        Proof("flips", *flips, [str(store / "test_guard")], THOROUGH),
        Proof("soak", *soak, [PYTHON, "tools/soak.py"]),
        Proof("mcdc", *mcdc, [PYTHON, "tools/mcdc.py"]),
        Proof("fuzz", *fuzz, [PYTHON, "tools/fuzz.py"]),
    ]


def fault_proof(name: str, title: str, goal: str, only: str, seeds: int) -> Proof:
    """Some faults of a drive, injected into so many."""
    measured = r"\| (.*) \| (?:as promised|NOT AS PROMISED)"
    command = [BSLAM, "faults", "--out", str(OUT / name), "--only", only, "--seeds", str(seeds)]
    return Proof(name, f"{title}, {seeds} drives", goal, measured, command)


def fault_proofs(seeds: int) -> list[Proof]:
    """Each fault once, and those of a drive in many."""
    rows = ("fault rows as promised", "all", r"(\d+ of \d+) as promised")
    found, near = "noticed, found, 0 alarms", "all within 0.2 m"
    return [
        Proof("faults", *rows, [BSLAM, "faults", "--out", str(OUT / "faults")]),
        fault_proof("kidnapping", "kidnapped, and not", found, "kidnapping", seeds),
        fault_proof("restart", "restart in a kept map", near, "restart", seeds),
        fault_proof("outliers", "40 % outliers", "1.5 x clean, 0 false", "outlier", max(1, seeds // 3)),
    ]


def other_proofs() -> list[Proof]:
    """Of the whole project."""
    bits = [PYTHON, "tools/same_bits.py", "--steps", "5000"]
    smoothed = [*bits, "--association", "known", "--observation", "direction", "--filter", "smoother"]
    sweep = [PYTHON, "tools/kill_sweep.py", "--runs", "1000"]
    return [
        Proof("test", "make test", "passes", r"make test: (.*)", ["make", "test"]),
        Proof("cores", "library for every core", "builds", LAST_LINE, ["make", "firmware-all"]),
        Proof("bits", "the same bits over 5000 steps", "on every board", LAST_LINE, bits),
        Proof("bits180", "the same, wide180", "on every board", LAST_LINE, [*bits, "--rig", "wide180"]),
        Proof("bits_smoother", "the same, smoother", "on every board", LAST_LINE, smoothed),
        Proof("sweep", "1000 runs, killed three times", "0 lost", LAST_LINE, sweep),
    ]


def proofs(seeds: int) -> list[Proof]:
    """All rows."""
    return [*own_proofs(), *fault_proofs(seeds), *other_proofs()]


def reached(proof: Proof, output: str) -> str:
    """All in the output that looks like the figure."""
    return "; ".join(re.findall(proof.figure, output)) or "not measured"


def run(proof: Proof) -> tuple[bool, str]:
    """Whether the goal is reached, and the figure."""
    done = subprocess.run(
        proof.command,
        cwd=ROOT,
        env={**os.environ, **proof.environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    (OUT / f"{proof.name}.txt").write_text(done.stdout, encoding="utf-8")
    return done.returncode == 0, reached(proof, done.stdout)


def main() -> int:
    """Exit status as said above."""
    names = [proof.name for proof in proofs(1)]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="NAME")
    parser.add_argument("--seeds", type=int, default=60, help="drives for each fault of a drive (60)")
    options = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    rows = []
    for proof in proofs(options.seeds):
        if proof.name in options.only:
            began = time.monotonic()
            kept, figure = run(proof)
            rows.append((proof, kept, figure))
            print(f"proof {proof.name}: {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)
    for proof, kept, figure in rows:
        print(f"{'yes' if kept else 'NO ':<4}{proof.title:<42}{proof.goal:<26}{figure}")
    missed = [proof.name for proof, kept, _ in rows if not kept]
    reasons = f"; not: {', '.join(missed)}" if missed else ""
    print(f"proof: {len(rows) - len(missed)} of {len(rows)} goals reached{reasons}")
    return 1 if missed else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("proof: stopped; what was printed so far is in out/proof")
