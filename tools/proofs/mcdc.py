"""Measures the modified condition/decision coverage (MC/DC) of the libraries by the C tests.

Examples:
    python -m tools.proofs.mcdc                              a table by file, and the total against the goal
    python -m tools.proofs.mcdc --list vision/camera/lens.c  conditions that no test has shown to matter

`make mcdc` builds what this runs: the C unit tests, and the inputs that fuzzing kept, whose core has smaller
sizes. A condition is covered if two runs of its decision with the same core differ in it alone, of what was
evaluated, and in the outcome (clang's masking MC/DC). Decisions of one condition are no matter of MC/DC.
Inline functions of headers count once, covered if one of their copies is. tests/unit/mcdc.toml lists
conditions that cannot be covered, each with its reason; one that is covered after all, or is not there, is
an error. Exit status 0: the goal is reached; 1: not, or a test failed, or an exclusion does not fit; 2: not
built.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/mcdc"
CORE = ROOT / "firmware"
CORPUS = ROOT / "tests/fuzz/corpus"
EXCLUSIONS = ROOT / "tests/unit/mcdc.toml"
GOAL_PERCENT = 95.0


class Decision(NamedTuple):
    """Two conditions or more, joined by && and ||."""

    file: str  # below firmware
    line: int
    text: str  # as in the source, white space collapsed
    covered: tuple[bool, ...]


class Exclusion(NamedTuple):
    """Conditions that no test can cover."""

    file: str
    decision: str
    conditions: tuple[int, ...]  # from 1
    reason: str


def run_tests(account: Path) -> Path:
    """Runs every program of an account; the merged profile."""
    raw = account / "raw"
    raw.mkdir(exist_ok=True)
    for old in raw.glob("*.profraw"):
        old.unlink()
    programs = sorted(path for path in (account / "bin").rglob("*") if path.is_file())
    for number, program in enumerate(programs):  # two may have one name: those of ekf/map.c and store/map.c
        environment = os.environ | {"LLVM_PROFILE_FILE": str(raw / f"{number}.profraw")}
        inputs = [str(CORPUS / f"{program.name}.bin")] if account.name == "replay" else []
        command = [str(program), *inputs]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(done.stdout + done.stderr, file=sys.stderr)
            sys.exit(f"mcdc: {program.name} failed")
    profile = account / "all.profdata"
    subprocess.run(
        ["llvm-profdata-19", "merge", "-o", str(profile), *map(str, sorted(raw.glob("*.profraw")))],
        check=True,
    )
    return profile


def source_text(path: Path, record: list[Any]) -> str:
    """What stands between a record's first and last place, in one line."""
    first, first_column, last, last_column = record[:4]
    lines = path.read_text(encoding="utf-8").splitlines()[first - 1 : last]
    lines[-1] = lines[-1][: last_column - 1]
    lines[0] = lines[0][first_column - 1 :]
    return re.sub(r"\s+", " ", " ".join(lines))


def read_records(account: Path) -> list[tuple[Path, list[Any]]]:
    """What an account says of each decision of the core, a copy of an inline function by itself."""
    command = [
        "llvm-cov-19",
        "export",
        str(account / "libbslam.so"),
        f"-instr-profile={run_tests(account)}",
        "-skip-functions",
    ]
    exported = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    return [
        (ROOT / file["filename"], record)
        for file in exported["data"][0]["files"]
        for record in file["mcdc_records"]
    ]


def read_decisions(accounts: list[Path]) -> list[Decision]:
    """All decisions of the core: a condition is covered if it is in any account."""
    found: dict[tuple[Path, int, int], tuple[list[Any], tuple[bool, ...]]] = {}
    for account in accounts:
        for path, record in read_records(account):
            place = (path, record[0], record[1])
            covered = tuple(record[-1])
            if place in found:
                covered = tuple(a or b for a, b in zip(covered, found[place][1], strict=True))
            found[place] = (record, covered)
    return [
        Decision(path.relative_to(CORE).as_posix(), line, source_text(path, record), covered)
        for (path, line, _), (record, covered) in sorted(found.items())
    ]


def read_exclusions() -> list[Exclusion]:
    """The file's entries."""
    with EXCLUSIONS.open("rb") as file:
        entries = tomllib.load(file).get("exclusion", [])
    return [
        Exclusion(entry["file"], entry["decision"], tuple(entry["conditions"]), entry["reason"])
        for entry in entries
    ]


def apply_exclusions(
    decisions: list[Decision], exclusions: list[Exclusion]
) -> tuple[dict[Decision, set[int]], int]:
    """The conditions of each decision (from 0) that do not count, and how many exclusions do not fit."""
    excluded: dict[Decision, set[int]] = {}
    wrong = 0
    for exclusion in exclusions:
        fitting = [d for d in decisions if d.file == exclusion.file and d.text == exclusion.decision]
        if not fitting:
            print(f"mcdc: {exclusion.file} has no decision {exclusion.decision!r}", file=sys.stderr)
            wrong += 1
        for decision in fitting:
            places = {place - 1 for place in exclusion.conditions}
            if any(place >= len(decision.covered) or decision.covered[place] for place in places):
                print(
                    f"mcdc: {decision.file}:{decision.line}: excluded, but covered or not there",
                    file=sys.stderr,
                )
                wrong += 1
            excluded.setdefault(decision, set()).update(places)
    return excluded, wrong


def print_file(decisions: list[Decision], excluded: dict[Decision, set[int]], file: str) -> None:
    """The conditions of a file that no test has shown to matter."""
    for decision in decisions:
        out = excluded.get(decision, set())
        open_ = [i + 1 for i, covered in enumerate(decision.covered) if not covered and i not in out]
        if decision.file == file and open_:
            print(f"{decision.file}:{decision.line}: {open_} of {len(decision.covered)}: {decision.text}")


class Count(NamedTuple):
    """Conditions of a file, or of all."""

    file: str
    conditions: int
    covered: int
    excluded: int

    @property
    def open(self) -> int:
        """Neither covered nor excluded."""
        return self.conditions - self.covered - self.excluded

    @property
    def percent(self) -> float:
        """Covered, of those that count."""
        counted = self.conditions - self.excluded
        return 100 * self.covered / counted if counted > 0 else 100.0


def count(name: str, decisions: list[Decision], excluded: dict[Decision, set[int]]) -> Count:
    """Adds up the conditions of some decisions."""
    return Count(
        name,
        sum(len(decision.covered) for decision in decisions),
        sum(sum(decision.covered) for decision in decisions),
        sum(len(excluded.get(decision, set())) for decision in decisions),
    )


def print_table(decisions: list[Decision], excluded: dict[Decision, set[int]]) -> float:
    """A line a file that is not covered whole; the share of all conditions that count, in percent."""
    files = sorted({decision.file for decision in decisions})
    rows = [count(file, [d for d in decisions if d.file == file], excluded) for file in files]
    total = count("all", decisions, excluded)
    print(f"{'file':<32}{'conditions':>11}{'covered':>9}{'excluded':>10}{'open':>6}{'percent':>9}")
    for row in [*(row for row in rows if row.covered < row.conditions), total]:
        numbers = f"{row.conditions:>11}{row.covered:>9}{row.excluded:>10}{row.open:>6}{row.percent:>9.1f}"
        print(f"{row.file:<32}{numbers}")
    print(
        f"mcdc: {total.percent:.1f} % of {total.conditions - total.excluded} conditions "
        f"(goal {GOAL_PERCENT:g}), {total.excluded} excluded; "
        f"{sum(row.open == 0 for row in rows)} of {len(rows)} files whole"
    )
    return total.percent


def main() -> int:
    """Exit status as said above."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--list", metavar="FILE", nargs="*", default=None, help="what is open in these files (or all)"
    )
    options = parser.parse_args()
    accounts = [BUILD / "unit", BUILD / "replay"]
    if not all((account / "libbslam.so").exists() for account in accounts):
        print("mcdc: nothing built; `make mcdc` does it", file=sys.stderr)
        return 2
    decisions = read_decisions(accounts)
    excluded, wrong = apply_exclusions(decisions, read_exclusions())
    if options.list is not None:
        for file in options.list or sorted({decision.file for decision in decisions}):
            print_file(decisions, excluded, file)
    percent = print_table(decisions, excluded)
    return 0 if percent >= GOAL_PERCENT and wrong == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
