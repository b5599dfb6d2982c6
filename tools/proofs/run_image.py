"""Runs a program of the firmware, `selftest` say, on boards in QEMU, and prints what it writes.

Exit status 0: it ended with status 0 on every board. 1: it did not, or it did not end.
"""

import argparse
import shutil
import subprocess
import sys
from dataclasses import dataclass

from bslam.target.lines import BUILD_DIR, ICOUNT, boards_here, emulator_of, how_to_start, qemu_machines

TIMEOUT_S = 120.0


@dataclass(frozen=True)
class Ended:
    """How a program ended, and what it wrote to its serial line."""

    status: int
    output: str


def run_image(board: str, program: str, *more: str) -> Ended:
    """Runs build/<board>/<program>.elf to its end, with `more` arguments for QEMU."""
    emulator = emulator_of(board)
    if shutil.which(emulator) is None:
        raise SystemExit(f"{emulator} is not installed: docs/PORTING.md says how to get it")
    command = [emulator, "-M", qemu_machines()[board], "-display", "none", "-monitor", "none"]
    command += [*how_to_start(board), "-icount", ICOUNT]
    command += ["-serial", "stdio", "-kernel", str(BUILD_DIR / board / f"{program}.elf"), *more]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired as late:
        output = (late.stdout or b"").decode(errors="replace")
        return Ended(-1, f"{output}\n{program} on {board} did not end in {TIMEOUT_S} s")
    return Ended(done.returncode, (done.stdout + done.stderr).decode(errors="replace"))


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", help="selftest, or another one of firmware/bench")
    parser.add_argument("--boards", nargs="+", default=boards_here(), help="default: all that are here")
    options = parser.parse_args(argv)
    failed = 0
    for board in options.boards:
        ended = run_image(board, options.program)
        failed += ended.status != 0
        print(f"{board}: status {ended.status}\n{ended.output.strip()}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
