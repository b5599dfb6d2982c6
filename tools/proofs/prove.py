"""Runs the long proofs and prints what each reached beside its goal.

Examples:
    python -m tools.proofs.prove                    all of them: an hour and a half
    python -m tools.proofs.prove --list             what there is, how long each takes, what is proved already
    python -m tools.proofs.prove --only soak mcdc   some
    python -m tools.proofs.prove --quick            a little of each in half an hour: whether all of it runs

What a proof prints is in out/proof/NAME.txt, what came of it in out/proof/NAME.json: a proof that ended on
the sources as they are is not run again (--again does), so that one that was stopped goes on where it was.
Parts that keep one core busy run two at a time, the others alone after them. Times are of two idle cores;
what is left is told at the pace so far. Exit status 0: every goal is reached; 1: one is not, or could not be
measured.
"""

import argparse
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from bslam.runs.output import write_atomically

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "out/proof"
PYTHON = str(ROOT / ".venv/bin/python")
BSLAM = str(ROOT / ".venv/bin/bslam")
THOROUGH = MappingProxyType({"BSLAM_THOROUGH": "1"})
LAST_LINE = r"([^\n]+)\n?\Z"
SOURCES = ("firmware", "host_sim", "tests", "tools", "mk")
SUFFIXES = frozenset((".c", ".h", ".py", ".mk", ".toml", ".sh", ".bin", ".npy", ".npz"))
SAY_EVERY_S = 60.0
CORES = 2
UNMEASURED = "not measured"


class Proof(NamedTuple):
    """A row: `figure` finds in the output what was reached; the exit status says if it is enough."""

    name: str
    title: str
    goal: str
    figure: str
    command: list[str]
    minutes: float  # about, on two idle cores
    needs: tuple[str, ...] = ()  # targets of make, before it
    environment: Mapping[str, str] = MappingProxyType({})
    least: float | None = None  # share that is near, where the exit status does not judge it
    alone: bool = False  # it keeps every core busy, or holds the time that something takes against it


class Result(NamedTuple):
    """What came of one."""

    reached: bool
    figure: str
    seconds: float


# --- What is proved -----------------------------------------------------------------------------------------


def tool(name: str) -> list[str]:
    """The command of a script beside this one."""
    return [PYTHON, "-m", f"tools.proofs.{name}"]


def own_proofs(quick: bool) -> list[Proof]:
    """Of the core alone."""
    slots, guard = (f"build/unit/float/bin/bslam/store/test_{name}" for name in ("slots", "guard"))
    soaks = ("build/soak/float/soak", "build/soak/double/soak")
    cuts = ("power cuts at every byte, at every pair", "0 mixed", r"power cuts: (.*)")
    flips = ("bit flips of the guarded state", "found, or without effect", r"bit flips: (.*)")
    soak = ("6 h x 20 seeds, float beside double", "NEES 2.4-3.7, 0, 10 %", r"soak: .* seeds: (.*)")
    lives = ("of every kind of life", "no eigenvalue < 0, NEES, error", r"lives: .* seeds: (.*)")
    adversary = ("odd but legal settings and calls", "all holds", r"adversary: (.*)")
    mutants = ("mutants of the estimator killed", "92 %, store and link 100", r"mutants: (\d.*)")
    mcdc = ("MC/DC of the libraries", "95 %", r"mcdc: (\d.*?),")
    fuzz = ("fuzzing: executions, crashes", "2e8, 1e6 each, 0", r"fuzz: (.*)")
    depth = MappingProxyType({}) if quick else THOROUGH
    less_soak = ["--minutes", "30", "--seeds", "4", "--nees", "1.1", "5.8"] if quick else []
    hours, days, sample = (1, 1, 14) if quick else (10, 30, 500)
    each = [*tool("soak"), "--seeds", "1", "--minutes", str(60 * hours), "--lives"]
    month = [
        *tool("soak"),
        "--seeds",
        "1",
        "--minutes",
        str(1440 * days),
        "--filters",
        "invariant",
        "--lives",
    ]
    make = ["make", "--no-print-directory"]
    # The ledger tells of executions elsewhere, too: of each target some are made here.
    how_long = ["--seconds", "60"] if quick else ["--each", "30"]
    fuzzing = [*tool("fuzz"), "--jobs", str(CORES), *how_long]
    return [
        Proof("cuts", *cuts, [slots], 1, (slots,), depth),
        Proof("flips", *flips, [guard], 0.1, (guard,), depth),
        Proof("soak", *soak, [*tool("soak"), *less_soak], 0.2 if quick else 4, soaks),
        Proof("lives", f"{hours} h {lives[0]}", *lives[1:], each, 2.5 * hours, soaks),
        Proof(
            "rest",
            f"{days} days at rest, and parked",
            *lives[1:],
            [*month, "rest", "park"],
            1.3 * days,
            soaks,
        ),
        Proof("adversary", *adversary, [*make, f"adversary{'-short' * quick}"], 0.3 if quick else 15),
        Proof("mutants", *mutants, [*make, "mutants", f"MUTANTS=--sample {sample}"], sample / 25),
        Proof("mcdc", *mcdc, tool("mcdc"), 2, ("mcdc-programs",)),
        Proof("fuzz", *fuzz, fuzzing, 1 if quick else 12, ("fuzz-programs",), alone=True),
    ]


def fault_proof(name: str, title: str, goal: str, only: str, seeds: int, minutes: float) -> Proof:
    """Some faults of a drive, injected into so many; a drive takes so long."""
    measured = r"\| (.*) \| (?:as promised|NOT AS PROMISED)"
    command = [BSLAM, "faults", "--out", str(OUT / name), "--only", only, "--seeds", str(seeds)]
    return Proof(name, f"{title}, {seeds} drives", goal, measured, command, seeds * minutes)


def fault_proofs(seeds: int) -> list[Proof]:
    """Each fault once, and those of a drive in many."""
    rows = ("fault rows as promised", "all", r"(\d+ of \d+) as promised")
    found, near = "2 s, 0.3 m 5 s later, all", "0.2 m after 5 s, all"
    third = max(1, seeds // 3)
    cameras = [*tool("camera_restart"), "--seeds", f"1000:{1000 + third}", "--jobs", str(CORES)]
    in_frame = r"5 s after (two.*in the map's frame.*)"
    camera_row = (f"the same, camera in, {3 * third} restarts", "0.2 m, 59 of 60", in_frame)
    return [
        Proof("faults", *rows, [BSLAM, "faults", "--out", str(OUT / "faults")], 3, ("images",)),
        fault_proof("kidnapping", "kidnapped, and not", found, "kidnapping", seeds, 0.02),
        fault_proof("restart", "restart in a kept map", near, "restart", seeds, 0.02),
        Proof("restart_camera", *camera_row, cameras, third / 2, least=59 / 60, alone=True),
        fault_proof("outliers", "40 % outliers", "1.5 x clean, 0 false", "outlier", third, 0.02),
    ]


def other_proofs(quick: bool) -> list[Proof]:
    """Of the whole project."""
    steps, runs = (200, 30) if quick else (5000, 1000)
    bits = [*tool("same_bits"), "--steps", str(steps), "--jobs", str(CORES)]
    wide = [*bits, "--rig", "wide180"]
    smoothed = [*bits, "--association", "known", "--observation", "direction", "--filter", "smoother"]
    sweep = [*tool("kill_sweep"), "--runs", str(runs)]
    minutes = 1 if quick else 10
    attack = [*tool("attack_link"), "--minutes", str(minutes)]
    cores = ["make", f"--jobs={CORES}", "firmware-all"]
    rows = (
        ("test", "make test", "passes", r"make test: (.*)", ["make", "test"], 10),
        ("cores", "library for every core", "builds", LAST_LINE, cores, 1),
        ("bits", f"the same bits over {steps} steps", "on every board", LAST_LINE, bits, steps / 700),
        ("bits180", "the same, wide180", "on every board", LAST_LINE, wide, steps / 600),
        ("bits_smoother", "the same, smoother", "on every board", LAST_LINE, smoothed, steps / 4000),
        ("link", f"the link, {minutes} min attacked", "all the host's", LAST_LINE, attack, minutes),
        ("sweep", f"{runs} runs, killed three times", "0 lost", LAST_LINE, sweep, runs / 100),
    )
    images = ("bits", "bits180", "bits_smoother", "link")
    return [Proof(*row)._replace(needs=("images",) if row[0] in images else (), alone=True) for row in rows]


def proofs(seeds: int = 60, quick: bool = False) -> list[Proof]:
    """All rows."""
    return [*own_proofs(quick), *fault_proofs(seeds), *other_proofs(quick)]


# --- Running them -------------------------------------------------------------------------------------------


def source_digest() -> str:
    """Of all that a proof may run: what was proved on other sources is not proved."""
    digest = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in SUFFIXES:
                digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def kept_result(folder: Path, proof: Proof, sources: str) -> Result | None:
    """What came of a proof on these sources, if it ended before."""
    try:
        kept = json.loads((folder / f"{proof.name}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    same = kept["sources"] == sources and kept["command"] == [*proof.environment, *proof.command]
    return Result(kept["reached"], kept["figure"], kept["seconds"]) if same else None


def keep_result(folder: Path, proof: Proof, sources: str, result: Result) -> None:
    """For kept_result()."""
    command = [*proof.environment, *proof.command]
    told = {"sources": sources, "command": command, **result._asdict()}
    write_atomically(folder / f"{proof.name}.json", json.dumps(told, indent=1) + "\n")


def figure_of(proof: Proof, output: str) -> str:
    """All in the output that looks like the figure."""
    return "; ".join(re.findall(proof.figure, output)) or UNMEASURED


def is_enough(proof: Proof, status: int, figure: str) -> bool:
    """Whether the goal is reached."""
    if proof.least is None:
        return status == 0 and figure != UNMEASURED
    share = re.search(r"(\d+) near.* of (\d+)", figure)
    return status == 0 and share is not None and int(share[1]) >= proof.least * int(share[2])


class StoppedError(Exception):
    """Nothing more shall run."""


class Bench:
    """Where proofs run: what is under way can be ended. One builds at a time, as two would write the same."""

    def __init__(self) -> None:
        self._building = threading.Lock()
        self._lock = threading.Lock()
        self._processes: set[subprocess.Popen[str]] = set()
        self._stopped = False

    def stop(self) -> None:
        """Ends all, with what they have started."""
        with self._lock:
            self._stopped = True
            for process in self._processes:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGTERM)

    def build(self, proof: Proof, lines: list[str]) -> int:
        """Has make build what one needs; the exit status."""
        make = ["make", "--no-print-directory", "--silent", f"--jobs={CORES}", *proof.needs]
        with self._building:
            return self.follow(make, proof, lines) if proof.needs else 0

    def follow(self, command: list[str], proof: Proof, lines: list[str]) -> int:
        """The exit status; what it prints goes behind the lines there are."""
        environment = {**os.environ, **proof.environment, "PYTHONUNBUFFERED": "1"}
        with self._lock:
            if self._stopped:
                raise StoppedError
            process = subprocess.Popen(
                command,
                cwd=ROOT,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                stdin=subprocess.DEVNULL,
                process_group=0,  # and this session's share of the processor
            )
            self._processes.add(process)
        with process:
            assert process.stdout is not None
            lines += process.stdout
        with self._lock:
            self._processes.remove(process)
            if self._stopped:
                raise StoppedError
        return process.returncode


def run(proof: Proof, folder: Path, bench: Bench) -> Result:
    """Builds what one needs and runs it; each minute the last line that it printed is told."""
    began = time.monotonic()
    lines = [""]
    ended = threading.Event()
    threading.Thread(target=tell, args=(proof, lines, ended), daemon=True).start()
    try:
        status = bench.build(proof, lines) or bench.follow(proof.command, proof, lines)
    finally:
        ended.set()
    output = "".join(lines)
    (folder / f"{proof.name}.txt").write_text(output, encoding="utf-8")
    figure = figure_of(proof, output)
    return Result(is_enough(proof, status, figure), figure, time.monotonic() - began)


def tell(proof: Proof, lines: list[str], ended: threading.Event) -> None:
    """What a proof said last, each minute until it has ended."""
    minutes = 0
    while not ended.wait(SAY_EVERY_S):
        minutes += 1
        say(f"  {proof.name}, {minutes} min: {lines[-1].rstrip()[:100]}")


def say(text: str) -> None:
    """Progress."""
    print(text, file=sys.stderr, flush=True)


def duration(minutes: float) -> str:
    """As people say it."""
    whole = max(1, round(minutes))
    return f"{whole} min" if whole < 60 else f"{whole // 60} h {whole % 60} min"


def minutes_of(chosen: list[Proof]) -> float:
    """Until all have run: those of one core side by side, the longest first, then each of the others."""
    lanes = [0.0] * CORES
    for proof in longest_first(chosen):
        lanes[lanes.index(min(lanes))] += proof.minutes
    return max(lanes) + sum(proof.minutes for proof in chosen if proof.alone)


def longest_first(chosen: list[Proof]) -> list[Proof]:
    """Those that run beside each other."""
    return sorted((proof for proof in chosen if not proof.alone), key=lambda proof: -proof.minutes)


class Progress:
    """Which proof begins, and how long it all takes yet."""

    def __init__(self, count: int, to_do: list[Proof]) -> None:
        self._lock = threading.Lock()
        self._count, self._to_do = count, list(to_do)
        self._begun = count - len(to_do)
        self._spent = self._expected = 0.0

    def begin(self, proof: Proof) -> None:
        """Tells it; what is under way counts whole."""
        with self._lock:
            self._begun += 1
            pace = self._spent / self._expected if self._expected > 0 else 1.0
            say(
                f"proof {self._begun} of {self._count}, {proof.name}: about {duration(pace * proof.minutes)} "
                f"of {duration(pace * minutes_of(self._to_do))} left"
            )

    def end(self, proof: Proof, result: Result) -> None:
        """Tells it."""
        with self._lock:
            self._to_do.remove(proof)
            self._spent += result.seconds / 60
            self._expected += proof.minutes
            say(f"  {proof.name}: {'reached' if result.reached else 'MISSED'}: {result.figure}")


def run_all(chosen: list[Proof], folder: Path, sources: str, again: bool) -> list[tuple[Proof, Result]]:
    """The results of all, those that are kept not made again."""
    kept = {proof.name: None if again else kept_result(folder, proof, sources) for proof in chosen}
    results = {name: result for name, result in kept.items() if result is not None}
    for name in results:
        say(f"proof {name}: kept from before")
    to_do = [proof for proof in chosen if proof.name not in results]
    bench, progress = Bench(), Progress(len(chosen), to_do)

    def make(proof: Proof) -> None:
        progress.begin(proof)
        result = results[proof.name] = run(proof, folder, bench)
        if result.figure != UNMEASURED:
            keep_result(folder, proof, sources, result)
        progress.end(proof, result)

    with ThreadPoolExecutor(CORES) as lanes:
        try:
            for done in [lanes.submit(make, proof) for proof in longest_first(to_do)]:
                done.result()
            for proof in to_do:
                if proof.alone:
                    lanes.submit(make, proof).result()
        except BaseException:
            bench.stop()
            lanes.shutdown(wait=True, cancel_futures=True)
            raise
    return [(proof, results[proof.name]) for proof in chosen]


# --- What is printed ----------------------------------------------------------------------------------------


def print_table(rows: list[tuple[Proof, Result]]) -> bool:
    """Goal beside figure; true if all are reached."""
    for proof, result in rows:
        print(f"{'yes' if result.reached else 'NO ':<4}{proof.title:<42}{proof.goal:<26}{result.figure}")
    missed = [proof.name for proof, result in rows if not result.reached]
    reasons = f"; not: {', '.join(missed)}" if missed else ""
    print(f"proof: {len(rows) - len(missed)} of {len(rows)} goals reached{reasons}")
    return not missed


def print_list(chosen: list[Proof], folder: Path, sources: str) -> None:
    """What there is, and what came of it so far."""
    for proof in chosen:
        result = kept_result(folder, proof, sources)
        state = "to do" if result is None else "reached" if result.reached else "missed"
        print(f"{proof.name:<16}{duration(proof.minutes):>12}  {state:<9}{proof.title}")
    print(f"{'all':<16}{duration(minutes_of(chosen)):>12}")


def main(argv: list[str] | None = None) -> int:
    """Exit status as said above."""
    names = [proof.name for proof in proofs()]
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="names: " + " ".join(names),
    )
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="NAME", help="these")
    parser.add_argument("--seeds", type=int, metavar="N", help="drives for each fault of a drive (60)")
    parser.add_argument("--quick", action="store_true", help="a little of each; its figures prove nothing")
    parser.add_argument("--again", action="store_true", help="those that ended before, too")
    parser.add_argument("--list", action="store_true", help="print what there is, run nothing")
    options = parser.parse_args(argv)
    seeds = options.seeds or (1 if options.quick else 60)
    chosen = [proof for proof in proofs(seeds, options.quick) if proof.name in options.only]
    OUT.mkdir(parents=True, exist_ok=True)
    sources = source_digest()
    if options.list:
        print_list(chosen, OUT, sources)
        return 0
    return 0 if print_table(run_all(chosen, OUT, sources, options.again)) else 1


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("proof: stopped; the same command goes on with what has not ended (out/proof)")
