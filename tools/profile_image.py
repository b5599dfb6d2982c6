"""Prints which functions of a firmware program execute how many instructions on an emulated board.

A program of firmware/app that ends by itself: cost, cost_vision (which is given pictures), selftest. Counts
come from a plugin in QEMU's translator and are the same at every run. Instructions are not cycles.
"""

import argparse
import bisect
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from bslam.target.lines import BUILD_DIR, ROOT
from check_image import output_of
from run_image import run_image
from sizes_doc import FRAMES, PIXELS, picture_loader
from training.render_set import RIGS

PLUGIN = BUILD_DIR / "qemu_profile.so"


def build_plugin() -> None:
    source = ROOT / "tools" / "qemu_profile.c"
    subprocess.run(
        ["cc", "-std=c11", "-O1", "-Wall", "-Wextra", "-shared", "-fPIC", str(source), "-o", str(PLUGIN)],
        check=True,
    )


def functions_of(image: Path) -> list[tuple[int, str]]:
    """Address and name of every function, in ascending order."""
    rows = [line.split() for line in output_of("arm-none-eabi-nm", str(image)).splitlines()]
    return sorted((int(row[0], 16), row[2]) for row in rows if len(row) == 3 and row[1] in "tTwW")


def profile(board: str, program: str, *more: str) -> Counter[str]:
    """Instructions by function."""
    functions = functions_of(BUILD_DIR / board / f"{program}.elf")
    starts = [address for address, _ in functions]
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "blocks"
        ended = run_image(board, program, "-plugin", f"{PLUGIN},to={path}", *more)
        if ended.status != 0:
            raise SystemExit(f"{program} on {board} ended with status {ended.status}: {ended.output}")
        for line in path.read_text(encoding="utf-8").splitlines():
            address, instructions = line.split()
            place = bisect.bisect(starts, int(address, 16)) - 1
            found[functions[place][1]] += int(instructions)
    return found


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("program", choices=("cost", "cost_vision", "selftest"))
    parser.add_argument("--board", default="mps2_an386", help="default: mps2_an386, a Cortex-M4F")
    parser.add_argument("--lens", choices=tuple(RIGS), default=next(iter(RIGS)), help="for cost_vision")
    parser.add_argument("--rows", type=int, default=25, help="functions to print (default: 25)")
    options = parser.parse_args(argv)
    build_plugin()
    with tempfile.TemporaryDirectory() as folder:
        sees = options.program == "cost_vision"
        more = picture_loader(options.lens, Path(folder)) if sees else ()
        found = profile(options.board, options.program, *more)
    total = found.total()
    print(f"{options.program} on {options.board}: {total} instructions")
    for name, count in found.most_common(options.rows):
        a_pixel = f"  {count / FRAMES / PIXELS:6.1f} a pixel" if sees else ""
        print(f"{100 * count / total:5.1f} %{a_pixel}  {name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
