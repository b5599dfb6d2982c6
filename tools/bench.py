"""Instructions a filter step takes on this host, as callgrind counts them: `make bench`.

Compiles tests/bench/bench_step.c with the core for several map sizes at -O2 and counts the instructions of
one step (odometry, then 2 to 4 sightings with distance, identity known, invariant filter). Unlike time, the
counts are the same from run to run. Instructions are not cycles.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "bench"

NEAR_OPTIMAL = {6: 7_500, 20: 35_000, 50: 153_000, 100: 550_000}
"""Instructions of near-optimal plain C for the same step without velocity states (docs/EXPERIMENTS.md)."""

FLAGS = ["-std=c11", "-O2", "-g", "-ffp-contract=off", f"-I{ROOT / 'firmware'}"]


def build(beacons: int) -> Path:
    """The bench program for a map of that many beacons."""
    BUILD.mkdir(parents=True, exist_ok=True)
    program = BUILD / f"step_{beacons}"
    sources = [ROOT / "tests/bench/bench_step.c", *sorted((ROOT / "firmware/bslam").rglob("*.c"))]
    command = ["cc", *FLAGS, f"-DBSLAM_BEACONS_MAX={beacons}", "-DBSLAM_RAYS_MAX=0"]
    subprocess.run([*command, *map(str, sources), "-lm", "-o", str(program)], check=True)
    return program


def instructions_per_step(program: Path, mode: str) -> int:
    """Counts measured_step and divides by the number of steps that the program says it made."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    command.append("--toggle-collect=measured_step")
    done = subprocess.run([*command, str(program), mode], capture_output=True, text=True)
    collected = re.search(r"Collected\s*:\s*(\d+)", done.stderr)
    if done.returncode != 0 or collected is None:
        raise SystemExit(f"bench: {program.name} {mode} failed:\n{done.stderr}")
    return int(collected[1]) // int(done.stdout)


def main() -> int:
    """Prints the table; exits 1 if a step costs more than 1.5 x the near-optimal count from 20 beacons on."""
    print("instructions a filter step, host -O2, callgrind; 2-4 sightings; instructions are not cycles")
    print(f"{'beacons':>8} {'step':>10} {'near-optimal':>13} {'ratio':>6} {'with velocity states':>21}")
    worst = 0.0
    for beacons, reference in NEAR_OPTIMAL.items():
        program = build(beacons)
        plain = instructions_per_step(program, "plain")
        velocity = instructions_per_step(program, "velocity")
        ratio = plain / reference
        worst = max(worst, ratio) if beacons >= 20 else worst
        print(f"{beacons:>8} {plain:>10} {reference:>13} {ratio:>6.2f} {velocity:>21}")
    return 0 if worst <= 1.5 else 1


if __name__ == "__main__":
    sys.exit(main())
