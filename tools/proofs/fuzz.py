"""Runs the fuzz targets in slices, keeps a ledger of what ran, prints it against the goals.

Examples:
    python -m tools.proofs.fuzz                  until every goal is met, in slices of five minutes at most
    python -m tools.proofs.fuzz --jobs 2         two slices at a time
    python -m tools.proofs.fuzz --seconds 120 --targets map api
    python -m tools.proofs.fuzz --each 60        a minute of each target, whatever ran before, then as above
    python -m tools.proofs.fuzz --table          what ran so far
    python -m tools.proofs.fuzz --keep           writes the smallest inputs that reach what all reach
                                                 to tests/fuzz/corpus

`make fuzz` builds the programs and calls this. The ledger (tests/fuzz/ledger.csv) has a line a slice: when,
of which commit and sources, target, libFuzzer's seed, executions, seconds, crashes. It is kept with the
sources: the sum is met by all slices together; the goal of each target, and no crash, by those on the sources
as they are. The last line of the table tells how many this call ran. Exit status 0: no crash, and the goals
met or the time over; 1: a crash, the input that caused it is named; 2: bad arguments, programs not built.
"""

import argparse
import csv
import hashlib
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ROOT / "build/fuzz"
BUILT_OF = PROGRAMS / "sources"
CORPUS = ROOT / "tests/fuzz/corpus"
LEDGER = ROOT / "tests/fuzz/ledger.csv"
OUT = ROOT / "out/fuzz"
TARGETS = ("link", "map", "model", "scanner", "image", "api", "drive", "session")
# What input a target makes the most of; the longer, the slower.
LENGTHS = {
    "link": 20,
    "map": 64,
    "model": 48,
    "scanner": 48,
    "image": 64,
    "api": 96,
    "drive": 14,
    "session": 160,
}
GOAL_EACH = 1_000_000
GOAL_ALL = 200_000_000
# So many of these are needed for the sum; the link's parser is the fastest by far.
FILLER = "link"
SLICE_S = 300
# What a slice makes at least where several are to share a target: each begins with the inputs that were kept.
SHARE_LEAST = 50_000
KEPT_BYTES = 300_000
# Of one input, seconds.
LIMITS = ("-timeout=10",)
# How libFuzzer ends when it is stopped by a signal.
INTERRUPTED = 72
# Of the ledger, and of what is under way.
LOCK = threading.RLock()
RUNNING: list[subprocess.Popen[str]] = []
STOP = threading.Event()


class Slice(NamedTuple):
    """A line of the ledger."""

    time: str
    commit: str
    sources: str
    target: str
    seed: int  # 0: drawn by libFuzzer, and not written down
    executions: int
    seconds: int
    crashes: int


def source_hash() -> str:
    """Of all that a target is made of: two slices with the same one ran the same code."""
    digest = hashlib.sha256()
    for folder in ("firmware", "tests/fuzz"):
        for path in sorted((ROOT / folder).rglob("*.[ch]")):
            digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]


def commit_name() -> str:
    """The commit that is checked out, or "unknown"."""
    done = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return done.stdout.strip() or "unknown"


def read_ledger() -> list[Slice]:
    """All slices so far."""
    if not LEDGER.exists():
        return []
    with LEDGER.open(newline="") as file:
        return [
            Slice(*row[:4], *(int(number) for number in row[4:]))  # type: ignore[arg-type]
            for row in list(csv.reader(file))[1:]
        ]


def write_down(slice_: Slice) -> None:
    """Adds a line to the ledger."""
    is_new = not LEDGER.exists()
    with LEDGER.open("a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if is_new:
            writer.writerow(Slice._fields)
        writer.writerow(slice_)


def executions(ledger: Iterable[Slice], target: str) -> int:
    """How often a target was executed, over all slices."""
    return sum(line.executions for line in ledger if line.target == target)


def run_slice(target: str, seed: int, seconds: int, runs: int) -> Slice:
    """Makes inputs up for so many seconds, `runs` at most; those that reach anything new stay in out/fuzz."""
    corpus, crashes = OUT / "corpus" / target, OUT / "crashes"
    crashes.mkdir(parents=True, exist_ok=True)
    unpack(target)
    command = [
        str(PROGRAMS / target), f"-max_total_time={seconds}", f"-runs={runs}", f"-max_len={LENGTHS[target]}",
        # Weighing inputs by what is rare about them costs an eighth of the fastest target's time.
        "-len_control=0", f"-entropic={int(target != FILLER)}", *LIMITS, "-print_final_stats=1",
        f"-artifact_prefix={crashes}/{target}-", f"-seed={seed}", str(corpus),
    ]  # fmt: skip
    began = time.monotonic()
    commit, sources = commit_name(), BUILT_OF.read_text(encoding="utf-8")
    status, log = follow(command)
    if status == INTERRUPTED or STOP.is_set():
        raise KeyboardInterrupt
    found = re.search(r"stat::number_of_executed_units:\s*(\d+)", log)
    crashed = status != 0 and not was_only_slow(target, log)
    line = Slice(
        time.strftime("%Y-%m-%d %H:%M:%S"),
        commit,
        sources,
        target,
        seed,
        int(found.group(1)) if found else 0,
        round(time.monotonic() - began),
        int(crashed),
    )
    with LOCK:
        write_down(line)
        if crashed:
            print_crash(log, target)
    return line


def was_only_slow(target: str, log: str) -> bool:
    """Whether a program gave up an input after so many seconds that it ends in time when it has it alone: a
    computer that stood still is no fault of the input. The input is gone then."""
    kept = re.search(r"Test unit written to (\S+)", log)
    if "ERROR: libFuzzer: timeout" not in log or kept is None:
        return False
    status, _ = follow([str(PROGRAMS / target), *LIMITS, kept[1]])
    if status == 0:
        Path(kept[1]).unlink()
        print(f"fuzz {target}: an input took long once and does not alone: no crash", file=sys.stderr)
    return status == 0


def follow(command: list[str]) -> tuple[int, str]:
    """Exit status of a program, and what it complained of."""
    with LOCK:
        if STOP.is_set():
            raise KeyboardInterrupt
        process = subprocess.Popen(
            command,
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
        RUNNING.append(process)
    with process:
        log = process.communicate()[1]
    with LOCK:
        RUNNING.remove(process)
    return process.returncode, log


def print_crash(log: str, target: str) -> None:
    """What did not hold, and how to see it again."""
    for line in log.splitlines():
        if re.search(r"does not hold|ERROR: |runtime error|SUMMARY|Test unit written", line):
            print(f"fuzz {target}: {line}", file=sys.stderr)
    print(f"fuzz {target}: again: build/fuzz/{target} FILE", file=sys.stderr)


def missing(ledger: list[Slice], target: str) -> int:
    """Executions that a target still needs: its own million; the filler, what the others leave of the sum."""
    now = source_hash()
    need = {
        name: GOAL_EACH - executions((one for one in ledger if one.sources == now), name) for name in TARGETS
    }
    if target == FILLER:
        others = sum(max(need[name], 0) for name in TARGETS if name != FILLER)
        need[FILLER] = max(need[FILLER], GOAL_ALL - others - sum(line.executions for line in ledger))
    return max(need[target], 0)


def print_table(before: int) -> bool:
    """What ran, against the goals; true if they are met and nothing crashed on the sources as they are.
    `before`: how many slices the ledger had when this call began.
    """
    ledger = read_ledger()
    now = source_hash()
    heads = ("executions", "on these sources", "seconds", "crashes", "kept")
    print(f"{'target':<10}{heads[0]:>14}{heads[1]:>18}{heads[2]:>9}{heads[3]:>9}{heads[4]:>8}  goal")
    for target in TARGETS:
        lines = [line for line in ledger if line.target == target]
        present = [line for line in lines if line.sources == now]
        corpus = len(kept_inputs(target))
        print(
            f"{target:<10}{executions(ledger, target):>14,}{executions(present, target):>18,}"
            f"{sum(line.seconds for line in lines):>9,}{sum(line.crashes for line in present):>9}{corpus:>8}"
            f"  {GOAL_EACH:,}"
        )
    total = sum(line.executions for line in ledger)
    crashes = sum(line.crashes for line in ledger if line.sources == now)
    mended = sum(line.crashes for line in ledger) - crashes
    reached = not any(missing(ledger, target) for target in TARGETS)
    here = sum(line.executions for line in ledger[before:])
    print(
        f"fuzz: {total:,} executions of {GOAL_ALL:,}, {here:,} of them now, "
        f"{crashes} crashes ({mended} on earlier sources)"
    )
    return reached and crashes == 0


def kept_inputs(target: str) -> list[bytes]:
    """The inputs in tests/fuzz/corpus: each behind its length, two bytes, low one first."""
    path = CORPUS / f"{target}.bin"
    data = path.read_bytes() if path.exists() else b""
    inputs = []
    while data:
        size = int.from_bytes(data[:2], "little")
        inputs.append(data[2 : 2 + size])
        data = data[2 + size :]
    return inputs


def unpack(target: str) -> None:
    """To files, as libFuzzer wants them."""
    corpus = OUT / "corpus" / target
    corpus.mkdir(parents=True, exist_ok=True)
    for data in kept_inputs(target):
        (corpus / hashlib.sha1(data, usedforsecurity=False).hexdigest()).write_bytes(data)


def keep(targets: list[str]) -> None:
    """Reduces what was found to inputs that reach all of it, and those that broke a property once."""
    count = size = 0
    CORPUS.mkdir(parents=True, exist_ok=True)
    for target in targets:
        unpack(target)
        fresh = OUT / "kept" / target
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir(parents=True)
        command = [str(PROGRAMS / target), "-merge=1", "-set_cover_merge=1", str(fresh)]
        subprocess.run([*command, str(OUT / "corpus" / target)], cwd=ROOT, capture_output=True, check=True)
        broke = (OUT / "crashes").glob(f"{target}-*")
        inputs = sorted({path.read_bytes() for path in (*fresh.iterdir(), *broke)})
        (CORPUS / f"{target}.bin").write_bytes(b"".join(len(d).to_bytes(2, "little") + d for d in inputs))
        count += len(inputs)
        size += sum(len(data) + 2 for data in inputs)
    print(f"fuzz: {count} inputs kept, {size:,} bytes of at most {KEPT_BYTES:,}")


class Campaign:
    """Slices, several at a time."""

    def __init__(self, jobs: int, seconds: float) -> None:
        self.jobs = jobs
        self.end = time.monotonic() + seconds
        self.seed = len(read_ledger())
        self.under_way: list[tuple[str, int]] = []  # target and executions
        self.crashed = False
        STOP.clear()

    def run_until_none(self, choose: Callable[[], tuple[str, float, int] | None]) -> bool:
        """Slices (target, seconds, executions) as they are chosen; false: one crashed, which ends it."""
        with ThreadPoolExecutor(self.jobs) as pool:
            try:
                for done in [pool.submit(self._work, choose) for _ in range(self.jobs)]:
                    done.result()
            except BaseException:
                self._stop()
                raise
        return not self.crashed

    def _stop(self) -> None:
        """Nothing more begins, and what is under way ends: it is not written down."""
        with LOCK:
            STOP.set()
            for process in RUNNING:
                process.terminate()  # which one that has just begun heeds, too

    def _work(self, choose: Callable[[], tuple[str, float, int] | None]) -> None:
        while True:
            with LOCK:
                chosen = None if self.crashed or STOP.is_set() else choose()
                if chosen is None:
                    return
                target, seconds, runs = chosen
                self.seed += 1
                seed = self.seed
                self.under_way.append((target, runs))
            line = run_slice(target, seed, max(1, round(seconds)), runs)
            print(f"fuzz {target}: {line.executions:,} executions in {line.seconds} s", flush=True)
            with LOCK:
                self.under_way.remove((target, runs))
                self.crashed |= line.crashes > 0

    def next_missing(self, targets: list[str]) -> tuple[str, float, int] | None:
        """What goes towards the goals; None: nothing is left to begin, or the time is over."""
        left_s = self.end - time.monotonic()
        ledger = read_ledger()
        need = {
            target: missing(ledger, target) - sum(runs for name, runs in self.under_way if name == target)
            for target in targets
        }
        # The one that ran the shortest: each gets its share of a time that is too short.
        waiting = [target for target in targets if need[target] > 0]
        if not waiting or left_s <= 0:
            return None
        spent = {t: sum(line.seconds for line in ledger if line.target == t) for t in waiting}
        target = min(waiting, key=lambda name: (name == FILLER, spent[name]))
        share = max(SHARE_LEAST, -(-missing(ledger, target) // self.jobs))
        return target, min(SLICE_S, left_s), min(need[target], share)


def run_each(targets: list[str], seconds: float, jobs: int) -> bool:
    """A slice of each target, whatever ran before; false: a crash."""
    waiting = list(targets) if seconds > 0 else []
    return Campaign(jobs, float("inf")).run_until_none(
        lambda: (waiting.pop(0), seconds, GOAL_EACH) if waiting else None
    )


def campaign(targets: list[str], seconds: float, jobs: int) -> bool:
    """Slices until all goals are met or the time is over; false: a crash."""
    one = Campaign(jobs, seconds)
    return one.run_until_none(lambda: one.next_missing(targets))


def main(argv: list[str] | None = None) -> int:
    """Exit status as said above."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument(
        "--each", type=float, default=0.0, metavar="S", help="first each target so long, whatever ran before"
    )
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="slices at a time (default: 1)")
    parser.add_argument("--targets", nargs="+", choices=TARGETS, default=list(TARGETS), metavar="TARGET")
    parser.add_argument("--table", action="store_true", help="print what ran, run nothing")
    parser.add_argument("--built", action="store_true", help="for make: the programs are of these sources")
    parser.add_argument("--keep", action="store_true", help="reduce what was found to tests/fuzz/corpus")
    options = parser.parse_args(argv)
    if options.built:
        BUILT_OF.write_text(source_hash(), encoding="utf-8")
        return 0
    is_built = BUILT_OF.exists() and BUILT_OF.read_text(encoding="utf-8") == source_hash()
    if not is_built and not options.table:
        print("fuzz: not built of the sources as they are; `make fuzz` does it", file=sys.stderr)
        return 2
    OUT.mkdir(parents=True, exist_ok=True)
    if options.keep:
        keep(options.targets)
        return 0
    before = len(read_ledger())
    clean = options.table or (
        run_each(options.targets, options.each, options.jobs)
        and campaign(options.targets, options.seconds, options.jobs)
    )
    met = print_table(before)
    return 0 if clean and (met or options.seconds < float("inf")) else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("fuzz: stopped; tests/fuzz/ledger.csv has all slices that ended")
