"""Prints which functions of a firmware program execute how many instructions on an emulated board.

Examples:
    python -m tools.bench.profile_image cost
    python -m tools.bench.profile_image cost_vision --lens wide
    python -m tools.bench.profile_image cost_vision --worlds 7000:7020 --frames 8

A program of firmware/bench that ends by itself: cost, cost_vision, selftest. cost_vision is given a walk
through each of some rendered worlds, and what its frames cost by its own count is printed besides: the
functions' counts are of the whole program, from its start. Counts come from a plugin in QEMU's translator and
are the same at every run. Instructions are not cycles.
"""

import argparse
import bisect
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from bslam.commands.arguments import seeds_range
from bslam.target.lines import BUILD_DIR
from tools.checks.check_image import output_of
from tools.checks.sizes_doc import FRAMES, INSTRUCTIONS_A_TICK, PIXELS, WORLD_SEED, picture_loader
from tools.proofs.run_image import run_image
from tools.training.render_set import RIGS

PLUGIN = BUILD_DIR / "qemu_profile.so"
FRAMES_MAX = 12
"""What the 2 MB hold that firmware/bench/cost_vision.c reads from."""


def build_plugin() -> None:
    source = Path(__file__).with_name("qemu_profile.c")
    subprocess.run(
        ["cc", "-std=c11", "-O1", "-Wall", "-Wextra", "-shared", "-fPIC", str(source), "-o", str(PLUGIN)],
        check=True,
    )


def functions_of(image: Path) -> list[tuple[int, str]]:
    """Address and name of every function, in ascending order."""
    rows = [line.split() for line in output_of("arm-none-eabi-nm", str(image)).splitlines()]
    return sorted((int(row[0], 16), row[2]) for row in rows if len(row) == 3 and row[1] in "tTwW")


def profile(board: str, program: str, *more: str) -> tuple[Counter[str], str]:
    """Instructions by function, and what the program printed."""
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
    return found, ended.output


def profile_walks(board: str, lens: str, worlds: range, frames: int) -> tuple[Counter[str], list[float]]:
    """Instructions of cost_vision by function, and those of each frame, a pixel."""
    found: Counter[str] = Counter()
    costs: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in worlds:
            of_walk, output = profile(board, "cost_vision", *picture_loader(lens, Path(folder), seed, frames))
            found += of_walk
            ticks = re.findall(r"^frame \d+ (\d+) ", output, re.MULTILINE)
            costs += [int(one) * INSTRUCTIONS_A_TICK / PIXELS for one in ticks]
    return found, costs


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("program", choices=("cost", "cost_vision", "selftest"))
    parser.add_argument("--board", default="mps2_an386", help="default: mps2_an386, a Cortex-M4F")
    parser.add_argument("--lens", choices=tuple(RIGS), default=next(iter(RIGS)), help="for cost_vision")
    parser.add_argument(
        "--worlds",
        type=seeds_range,
        default=range(WORLD_SEED, WORLD_SEED + 1),
        metavar="A:B",
        help=f"seeds of worlds for cost_vision, B is not among them (default: {WORLD_SEED}:{WORLD_SEED + 1})",
    )
    parser.add_argument(
        "--frames", type=int, default=FRAMES, help=f"of each walk, 1 to 12 (default: {FRAMES})"
    )
    parser.add_argument("--rows", type=int, default=25, help="functions to print (default: 25)")
    options = parser.parse_args(argv)
    if not 1 <= options.frames <= FRAMES_MAX:
        parser.error(f"--frames {options.frames}: the board's memory holds 1 to {FRAMES_MAX}")
    build_plugin()
    costs: list[float] = []
    if options.program == "cost_vision":
        found, costs = profile_walks(options.board, options.lens, options.worlds, options.frames)
    else:
        found, _ = profile(options.board, options.program)
    total = found.total()
    print(f"{options.program} on {options.board}: {total} instructions")
    if costs:
        print(
            f"{len(costs)} frames: {sum(costs) / len(costs):.1f} a pixel, "
            f"{min(costs):.1f} to {max(costs):.1f}"
        )
    for name, count in found.most_common(options.rows):
        a_pixel = f"  {count / len(costs) / PIXELS:6.2f} a pixel" if costs else ""
        print(f"{100 * count / total:5.1f} %{a_pixel}  {name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
