"""What a filter step costs on this host, and what the same costs elsewhere: `make bench`.

Counts the instructions of one step (odometry, then 2 to 4 sightings with distance, identity known, invariant
filter) with callgrind, then runs MRPT's, a textbook's and GTSAM's filter, LIBLINEAR and m2cgen on the same
drives and signatures, as far as they are installed. Unlike time, counts are the same from run to run; times
are compared within rounds in which every program runs once. Instructions are not cycles.

    make bench                                                 # all, into out/bench/BENCHMARKS.md
    .venv/bin/python -m tools.bench.bench --step-only                # the core's own counts, 10 s
    make bench-doc                                             # all, into docs/BENCHMARKS.md
"""

import argparse
import importlib.metadata
import platform
import re
import subprocess
import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path

from tools.bench.peers import filters, machines
from tools.bench.peers.programs import ESTIMATOR, PEERS, ROOT
from tools.checks.markdown import Row, table

BUILD = ROOT / "build" / "bench"

NEAR_OPTIMAL = {6: 7_500, 20: 35_000, 50: 153_000, 100: 550_000}
"""Instructions of near-optimal plain C for the same step without velocity states, by a study before this."""

PARTS = {
    "covariance and state (`linalg`, `ekf`)": ("linalg", "ekf"),
    "motion and observation, their derivatives (`model`)": ("model",),
    "whose sighting it is (`association`)": ("association",),
    "checks, accounts, history, order of time (`slam`, `base`)": ("slam", "base"),
}
FLAGS = ["-std=c11", "-O2", "-g", "-ffp-contract=off", f"-I{ROOT / 'firmware'}"]


def build(beacons: int, *more: str) -> Path:
    """The bench program for a map of that many beacons; `more` are flags that follow the others."""
    BUILD.mkdir(parents=True, exist_ok=True)
    program = BUILD / f"step_{beacons}{''.join(more)}"
    sources = [ROOT / "tests/bench/bench_step.c", *ESTIMATOR]
    command = ["cc", *FLAGS, *more, f"-DBSLAM_BEACONS_MAX={beacons}", "-DBSLAM_RAYS_MAX=0"]
    subprocess.run([*command, *map(str, sources), "-lm", "-o", str(program)], check=True)
    return program


def instructions_per_step(program: Path, mode: str, profile: str = "/dev/null") -> int:
    """Counts measured_step and divides by the number of steps that the program says it made."""
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={profile}"]
    command.append("--toggle-collect=measured_step")
    done = subprocess.run([*command, str(program), mode], capture_output=True, text=True)
    collected = re.search(r"Collected\s*:\s*(\d+)", done.stderr)
    if done.returncode != 0 or collected is None:
        raise SystemExit(f"bench: {program.name} {mode} failed:\n{done.stderr}")
    return int(collected[1]) // int(done.stdout)


def step_table() -> tuple[str, float]:
    """The core's own step by map size, and the worst ratio to the near-optimal count from 20 beacons on."""
    rows: list[Row] = []
    worst = 0.0
    for beacons, reference in NEAR_OPTIMAL.items():
        program = build(beacons)
        plain = instructions_per_step(program, "plain")
        velocity = instructions_per_step(program, "velocity")
        worst = max(worst, plain / reference) if beacons >= 20 else worst
        rows.append([beacons, f"{plain:,}", f"{reference:,}", f"{plain / reference:.2f}", f"{velocity:,}"])
    head = ["beacons", "instructions a step", "near-optimal plain C", "ratio", "with velocity states"]
    return table(head, rows), worst


def part_table() -> str:
    """What the step on the smallest map is made of, by the core's folders, and by other flags."""
    beacons = min(NEAR_OPTIMAL)
    profile = BUILD / "step.callgrind"
    total = instructions_per_step(build(beacons), "plain", str(profile))
    parts = parts_of(profile)
    rows: list[Row] = []
    for words, folders in PARTS.items():
        rows.append([words, f"{total * sum(parts.get(one, 0.0) for one in folders):,.0f}"])
    named = {one for folders in PARTS.values() for one in folders}
    rows.append(
        ["all else", f"{total * sum(share for one, share in parts.items() if one not in named):,.0f}"]
    )
    rows.append(["together", f"{total:,}"])
    for flags in (["-flto"], ["-O3"], ["-O3", "-flto"]):
        count = instructions_per_step(build(beacons, *flags), "plain")
        rows.append([f"together, `{' '.join(flags)}`", f"{count:,}"])
    return table([f"{beacons} beacons", "instructions a step"], rows)


def parts_of(profile: Path) -> dict[str, float]:
    """Folder of the core -> its share of what was counted."""
    command = ["callgrind_annotate", "--auto=no", "--threshold=100", str(profile)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    counts: dict[str, int] = {}
    for count, file in re.findall(r"^ *([\d,]+) \([^)]*\) +([^:\n]+):", said, re.MULTILINE):
        found = re.search(r"firmware/(?:bslam/)?(\w+)/", file)
        folder = found[1] if found else "other"
        counts[folder] = counts.get(folder, 0) + int(count.replace(",", ""))
    return {folder: count / sum(counts.values()) for folder, count in counts.items()}


def machine_table(rounds: int) -> str:
    """Support vector machines: training and decision."""
    task = machines.make_task()
    entrants = [one for one in machines.ENTRANTS if one.is_here()]
    rows = [_machine_row(one, machines.measure(one, task, rounds)) for one in entrants]
    head = ["", "training, us", "instructions", "decision, ns", "instructions", "flash, M4F", "right"]
    tests = f"{len(task.tests[0])} tests"
    sizes = f"{len(task.sets)} objects; {machines.OWN} views of each against {machines.NEGATIVES}; {tests}"
    return f"{sizes}\n\n{table(head, rows)}"


def _machine_row(one: machines.Entrant, result: machines.Result) -> Row:
    train = ["-", "-"]
    if one.trains:
        train = [f"{result.train_ns / 1e3:.0f}", f"{result.train_instructions:,}"]
    flash = "-" if result.flash_bytes is None else f"{result.flash_bytes:,}"
    decide = [result.decide_ns, f"{result.decide_instructions:,}"]
    return [one.name, *train, *decide, flash, f"{100.0 * result.right:.1f} %"]


def missing() -> dict[str, str]:
    """Peers that are not installed, and how they are."""
    apt = {one.name: f"apt-get install {one.package}" for one in PEERS if not one.is_here()}
    svm = {one.name: one.package for one in machines.ENTRANTS if one.package and not one.is_here()}
    return apt | svm | ({} if filters.has_gtsam() else {"GTSAM": "pip install gtsam"})


def about() -> str:
    """Machine, date, compilers and versions."""
    found = re.search(r"model name\s*:\s*(.*)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    lines = [f"{found[1] if found else platform.processor()}, {platform.system()} {platform.machine()}"]
    lines.append(f"bslam {_first_line('git', '-C', str(ROOT), 'describe', '--always', '--dirty')}")
    lines += [_first_line("cc", "--version"), _first_line("valgrind", "--version")]
    packages = ("libmrpt-slam-dev", "libeigen3-dev", "liblinear-dev")
    lines += [f"{one} {version}" for one in packages if (version := _debian_version(one))]
    for name in ("gtsam", "m2cgen", "scikit-learn"):
        try:
            lines.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return f"{date.today().isoformat()}: {'; '.join(lines)}."


def _first_line(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True).stdout.split("\n")[0] or "unknown"


def _debian_version(package: str) -> str:
    command = ["dpkg-query", "--show", "--showformat=${Version}", package]
    try:
        return subprocess.run(command, capture_output=True, text=True).stdout
    except FileNotFoundError:
        return ""


def sections(step: str, rounds: int) -> Iterator[str]:
    """The page, piece by piece: each takes its time."""
    yield f"{HEAD}\n{about()}\n"
    absent = missing()
    for name, command in absent.items():
        print(f"left out: {name} is not installed: {command}", file=sys.stderr)
    if absent:
        names = "; ".join(f"{name} (`{command}`)" for name, command in absent.items())
        yield f"Left out, not being installed: {names}.\n"
    yield f"## The core's own step\n\n{step}\n{STEP_NOTE}\n"
    yield f"## What the smallest step is made of\n\n{part_table()}\n{PART_NOTE}\n"
    yield f"## Time, in times of bslam's\n\n{filters.time_table(rounds)}\n{TIME_NOTE}\n"
    yield f"## Instructions a step\n\n{filters.count_table()}"
    yield f"## Memory kept between steps\n\n{filters.memory_table()}\n{MEMORY_NOTE}\n"
    yield f"## Error, and landmarks made without identities\n\n{filters.accuracy_table()}\n{ACCURACY_NOTE}\n"
    yield f"## Support vector machines\n\n{machine_table(rounds)}\n{MACHINE_NOTE}\n"


HEAD = """# Benchmarks

Written by `make bench-doc`. `make bench` measures the same on your host, with those of
the others that are installed there. No board has run it yet.
"""
STEP_NOTE = """Instructions by callgrind, `-O2`; odometry and 2 to 4 sightings with distance, known
association, invariant filter. They are not cycles. Near-optimal is a study's count for the same step."""
PART_NOTE = """By callgrind; inlined functions count where they stand in the source."""
TIME_NOTE = f"""CPU time of a step with 2 to 4 sightings, all beacons mapped, known association, `-O2`:
median of rounds in which each program runs once [least, largest] (goal). bslam: float, invariant, without
velocity states; in brackets its least time. MRPT: range-bearing EKF-SLAM, in its fastest form and as it
comes; only its step is timed. iSAM2 keeps all poses, so its time grows: over {filters.GTSAM_STEPS} steps."""
MEMORY_NOTE = """bslam: the one struct, in float. The others: what the heap holds after a step."""
ACCURACY_NOTE = """Mean position error of simulated drives of 200 s (seeds 100:104 and 100:102), actuation
noise of 0.3 m/s. Unknown: nearest neighbour by Mahalanobis distance. MRPT has one standard deviation for
all distances. bslam has room for four times the beacons there are, 100 at most, and counts all it holds.
GTSAM's error stands in [RESULTS](RESULTS.md#consistency)."""
MACHINE_NOTE = """Descriptors of rendered beacons. Training: one classifier against the rest, to LIBLINEAR's
default tolerance; bslam on the 8-bit samples that the robot keeps. Decision: all classifiers' values for
one descriptor. Headers come from scikit-learn's LinearSVC on the same views. m2cgen computes in double; its
flash leaves out the library for that."""


def main() -> int:
    """Writes the page; exits 1 if a step costs more than 1.5 x the near-optimal count from 20 beacons on."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--step-only", action="store_true", help="only count the core's own step")
    parser.add_argument("--rounds", type=int, default=7, metavar="N", help="of times (default: 7)")
    parser.add_argument(
        "--out", type=Path, default=ROOT / "out/bench", metavar="DIR", help="default: out/bench"
    )
    options = parser.parse_args()
    step, worst = step_table()
    if options.step_only:
        print(step, end="")
    else:
        page = []
        for section in sections(step, options.rounds):
            print(section, flush=True)
            page.append(section)
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "BENCHMARKS.md").write_text("\n".join(page), encoding="utf-8")
    return 0 if worst <= 1.5 else 1


if __name__ == "__main__":
    sys.exit(main())
