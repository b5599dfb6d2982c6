"""Lives through simulated hours in float and in double: consistency, repairs, errors against the truth.

Examples:
    python -m tools.proofs.soak                                        a drive of 6 hours, seeds 1000 to 1019
    python -m tools.proofs.soak --minutes 30 --seeds 4 --nees 1.1 5.8
    python -m tools.proofs.soak --lives --minutes 600 --seeds 1        10 hours of every kind of life
    python -m tools.proofs.soak --lives rest park --minutes 43200 --seeds 1 --filters invariant --reals float

`make soak` builds what this runs (tests/soak). NEES is the squared error of the pose in standard deviations:
3 on average for a consistent filter; that of a beacon from the robot is 2. The bounds of the drive are for 20
seeds; those of four are the chi-square distribution's, 95 % of 12 degrees of freedom. In a life errors hang
together for hours: its bound is that of one draw a seed, 99.9 %. The standard filter is only asked for a
covariance there. The lives are those of tests/soak/world.c. Exit status 0: as promised; 1: not; 2: not built.
"""

import argparse
import subprocess
import sys
from pathlib import Path
from statistics import NormalDist
from typing import NamedTuple

PROGRAMS = Path(__file__).resolve().parents[2] / "build/soak"
REALS = ("float", "double")
FILTERS = {"standard": 0, "invariant": 1, "smoother": 2}
MOST_APART = 0.1
ROUNDING = 1e-9  # of eigenvalues that double computes
FIRST_SEED = 1000  # what was looked at while this was written lies below


class Life(NamedTuple):
    """What is asked of one: a mean error. None: one beacon does not tell where around it the robot is."""

    error_m: float | None
    by_directions: bool = False


LIVES = {
    "drive": Life(0.06), "rest": Life(0.06), "park": Life(0.06), "spin": Life(0.06), "shuttle": Life(0.06),
    "one_beacon": Life(None), "doubt": Life(0.1),
    "directions": Life(0.1, True), "rest_directions": Life(0.1, True), "park_directions": Life(0.1, True),
    "spin_directions": Life(0.2, True), "doubt_directions": Life(0.2, True),
}  # fmt: skip


class Outcome(NamedTuple):
    """What became of one seed."""

    nees: float
    nees_last_hour: float
    nees_beacon: float
    error_m: float
    error_max_m: float
    least_eigenvalue: float
    repairs: float


def run(real: str, life: str, kind: str, options: argparse.Namespace) -> list[Outcome] | str:
    """All seeds, one after the other; or what the program complained of."""
    numbers = (FILTERS[kind], FIRST_SEED, options.seeds, options.minutes, options.standstill)
    command = [str(PROGRAMS / real / "soak"), life, *map(str, numbers)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return done.stderr.strip() or f"ended with {done.returncode}"
    rows = [line.split(",")[2:] for line in done.stdout.splitlines()]
    return [Outcome(*map(float, row)) for row in rows]


def mean(outcomes: list[Outcome], field: str) -> float:
    """Over the seeds."""
    return sum(float(getattr(outcome, field)) for outcome in outcomes) / len(outcomes)


def print_row(name: str, outcomes: list[Outcome], verdict: str) -> None:
    """Of both tables."""
    least = min(outcome.least_eigenvalue for outcome in outcomes)
    print(
        f"{name:<34}{mean(outcomes, 'nees'):>8.3f}{mean(outcomes, 'nees_last_hour'):>11.3f}"
        f"{mean(outcomes, 'nees_beacon'):>9.2f}{100 * mean(outcomes, 'error_m'):>11.3f}"
        f"{100 * max(outcome.error_max_m for outcome in outcomes):>9.1f}{least:>10.1e}"
        f"{sum(outcome.repairs for outcome in outcomes):>9.0f}  {verdict}",
        flush=True,
    )


def most(freedom: int) -> float:
    """What 99.9 % of a chi-square distribution's draws stay below, after Wilson and Hilferty."""
    part = 2 / (9 * freedom)
    return float(freedom * (1 - part + NormalDist().inv_cdf(0.999) * part**0.5) ** 3)


def complaints(life: Life, kind: str, outcomes: list[Outcome]) -> str:
    """What is not as it should be; empty: nothing."""
    seeds, found = len(outcomes), []
    if any(not one.least_eigenvalue >= -ROUNDING or one.repairs for one in outcomes):
        found.append("no covariance")
    if kind != "standard" and not mean(outcomes, "nees_beacon") <= most(2 * seeds) / seeds:
        found.append("beacon")
    if kind != "standard" and life.error_m is not None:
        if not mean(outcomes, "nees") <= most(3 * seeds) / seeds:
            found.append("NEES")
        if not mean(outcomes, "error_m") <= life.error_m:
            found.append("error")
    return ", ".join(found)


def live(options: argparse.Namespace) -> bool:
    """Every life in every filter that can lead it. True: all are as they should be."""
    asked = [
        (name, kind, real)
        for name in options.lives or LIVES
        for kind in options.filters
        if kind != "smoother" or LIVES[name].by_directions
        for real in options.reals
    ]
    failed, least = [], 1.0
    for name, kind, real in asked:
        outcomes = run(real, name, kind, options)
        wrong = outcomes if isinstance(outcomes, str) else complaints(LIVES[name], kind, outcomes)
        if not isinstance(outcomes, str):
            least = min(least, *(outcome.least_eigenvalue for outcome in outcomes))
            print_row(f"{name} {kind} {real}", outcomes, wrong)
        if wrong:
            failed.append(f"{name} {kind} {real} ({wrong})")
    print(
        f"lives: {options.minutes} min x {options.seeds} seeds: {len(asked) - len(failed)} of {len(asked)} "
        f"as they should be, least eigenvalue {least:.1e}" + "".join(f"; {what}" for what in failed)
    )
    return not failed


def drive(options: argparse.Namespace) -> bool:
    """The drive by the default filter, float against double."""
    drives = {}
    for real in REALS:
        outcomes = run(real, "drive", "invariant", options)
        if isinstance(outcomes, str):
            sys.exit(f"soak {real}: {outcomes}")
        drives[real] = outcomes
        print_row(real, outcomes, "")
    single, double = drives["float"], drives["double"]
    apart = max(abs(mean(single, field) / mean(double, field) - 1) for field in ("nees", "error_m"))
    repairs = sum(one.repairs for one in single + double)
    low, high = options.nees
    print(
        f"soak: {options.minutes} min x {options.seeds} seeds: "
        f"NEES {mean(single, 'nees'):.2f} ({low} to {high}), "
        f"{repairs:.0f} repairs (0), float {100 * apart:.1f} % from double (at most {100 * MOST_APART:.0f})"
    )
    return bool(low <= mean(single, "nees") <= high) and repairs == 0 and apart <= MOST_APART


def main() -> int:
    """Exit status as said above."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=int, default=360, help="simulated, a seed (360)")
    parser.add_argument("--seeds", type=int, default=20, help="so many, from 1000 on (20)")
    parser.add_argument("--nees", type=float, nargs=2, default=(2.4, 3.7), metavar=("LOW", "HIGH"))
    parser.add_argument("--standstill", type=int, default=3, help="seconds before it drives off (3)")
    parser.add_argument(
        "--lives", nargs="*", choices=LIVES, metavar="LIFE", help="these, or all, for the drive"
    )
    parser.add_argument("--filters", nargs="+", choices=FILTERS, default=list(FILTERS), metavar="FILTER")
    parser.add_argument("--reals", nargs="+", choices=REALS, default=REALS, metavar="REAL")
    options = parser.parse_args()
    if not all((PROGRAMS / real / "soak").exists() for real in options.reals):
        print("soak: not built; `make soak` does it", file=sys.stderr)
        return 2
    heads = ("NEES", "last hour", "beacon", "error, cm", "worst", "least", "repairs")
    print(
        f"{'':<34}{heads[0]:>8}{heads[1]:>11}{heads[2]:>9}{heads[3]:>11}{heads[4]:>9}{heads[5]:>10}{heads[6]:>9}"
    )
    return 0 if (drive(options) if options.lives is None else live(options)) else 1


if __name__ == "__main__":
    sys.exit(main())
