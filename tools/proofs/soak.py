"""Runs the filter for simulated hours in float and in double, and compares: consistency, repairs, errors.

Examples:
    python -m tools.proofs.soak                                        6 hours, seeds 1000 to 1019
    python -m tools.proofs.soak --minutes 30 --seeds 4 --nees 1.1 5.8

`make soak` builds what this runs (tests/soak/soak.c). NEES is the squared error of the pose in standard
deviations: 3 on average for a consistent filter. The bounds that it is held to are for 20 seeds; those of
four are the chi-square distribution's, 95 % of 12 degrees of freedom. Exit status 0: as promised; 1: not;
2: not built.
"""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

PROGRAMS = Path(__file__).resolve().parents[2] / "build/soak"
MOST_APART = 0.1
FIRST_SEED = 1000  # what was looked at while this was written lies below


class Drive(NamedTuple):
    """What became of one seed."""

    nees: float
    nees_last_hour: float
    error_m: float
    repairs: int


def run(real: str, seeds: int, minutes: int, standstill_s: int) -> list[Drive]:
    """All seeds, one after the other."""
    command = [str(PROGRAMS / real / "soak"), *map(str, (FIRST_SEED, seeds, minutes, standstill_s))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"soak {real}: {done.stderr.strip()}")
    rows = [line.split(",") for line in done.stdout.splitlines()]
    return [Drive(float(row[2]), float(row[3]), float(row[4]), int(row[5])) for row in rows]


def mean(drives: list[Drive], field: str) -> float:
    """Over the seeds."""
    return sum(float(getattr(drive, field)) for drive in drives) / len(drives)


def main() -> int:
    """Exit status as said above."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=int, default=360, help="simulated, a seed (360)")
    parser.add_argument("--seeds", type=int, default=20, help="so many, from 1000 on (20)")
    parser.add_argument("--nees", type=float, nargs=2, default=(2.4, 3.7), metavar=("LOW", "HIGH"))
    parser.add_argument("--standstill", type=int, default=3, help="seconds before it drives off (3)")
    options = parser.parse_args()
    if not all((PROGRAMS / real / "soak").exists() for real in ("float", "double")):
        print("soak: not built; `make soak` does it", file=sys.stderr)
        return 2
    drives = {
        real: run(real, options.seeds, options.minutes, options.standstill) for real in ("float", "double")
    }
    print(f"{'':<8}{'NEES':>8}{'last hour':>11}{'lowest':>8}{'highest':>9}{'error, cm':>11}{'repairs':>9}")
    for real, runs in drives.items():
        nees = [drive.nees for drive in runs]
        print(
            f"{real:<8}{mean(runs, 'nees'):>8.3f}{mean(runs, 'nees_last_hour'):>11.3f}{min(nees):>8.2f}"
            f"{max(nees):>9.2f}{100 * mean(runs, 'error_m'):>11.3f}{sum(d.repairs for d in runs):>9}"
        )
    single, double = drives["float"], drives["double"]
    apart = max(abs(mean(single, field) / mean(double, field) - 1) for field in ("nees", "error_m"))
    repairs = sum(drive.repairs for drive in single + double)
    low, high = options.nees
    kept = low <= mean(single, "nees") <= high and repairs == 0 and apart <= MOST_APART
    print(
        f"soak: {options.minutes} min x {options.seeds} seeds: "
        f"NEES {mean(single, 'nees'):.2f} ({low} to {high}), "
        f"{repairs} repairs (0), float {100 * apart:.1f} % from double (at most {100 * MOST_APART:.0f})"
    )
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
