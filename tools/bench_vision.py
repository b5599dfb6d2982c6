"""Instructions that the vision front end takes a pixel on this host, as callgrind counts them: `make bench`.

Renders short walks through a world of style "test", one for each kind of lens, compiles the core with
tests/bench/bench_vision.c at -O2 and counts whole frames: rows, proposals, detector, measuring. Unlike time,
the counts are the same from run to run. Instructions are not cycles.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

from training.render_set import RIGS, camera_of, render_world

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "bench"
PIXELS = 320 * 240
PER_PIXEL_MAX = 32
FLAGS = ["-std=c11", "-O2", "-g", "-ffp-contract=off", f"-I{ROOT / 'firmware'}"]


def build() -> Path:
    """The bench program."""
    BUILD.mkdir(parents=True, exist_ok=True)
    program = BUILD / "vision"
    sources = [ROOT / "tests/bench/bench_vision.c", *sorted((ROOT / "firmware/bslam").rglob("*.c"))]
    subprocess.run(["cc", *FLAGS, *map(str, sources), "-lm", "-o", str(program)], check=True)
    return program


def pictures(lens: str, seed: int, frames: int) -> Path:
    """A file of frames, as the program reads them."""
    path = BUILD / f"{lens}_{seed}.rgb565"
    render_world(seed, "test", camera_of(lens, seed), frames).pictures.tofile(path)
    return path


def count(program: Path, lens: str, path: Path) -> tuple[int, int, int, int]:
    """Instructions, frames, candidates found, bytes of an instance."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    command += ["--toggle-collect=measured_frame", str(program), lens, str(path)]
    done = subprocess.run(command, capture_output=True, text=True)
    collected = re.search(r"Collected\s*:\s*(\d+)", done.stderr)
    if done.returncode != 0 or collected is None:
        raise SystemExit(f"bench: {program.name} {lens} failed:\n{done.stderr}")
    frames, candidates, size = map(int, done.stdout.split())
    return int(collected[1]), frames, candidates, size


def main() -> int:
    """Prints the table; exits 1 if a lens takes more than PER_PIXEL_MAX instructions a pixel."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7000, help="of the world (default: 7000)")
    parser.add_argument("--frames", type=int, default=10, help="frames of the walk (default: 10)")
    options = parser.parse_args()
    program = build()
    print("instructions of the vision front end a pixel, 320x240, host -O2, callgrind; not cycles")
    print(f"{'lens':>8} {'a pixel':>8} {'candidates a frame':>19} {'bytes of an instance':>21}")
    worst = 0.0
    for lens in RIGS:
        path = pictures(lens, options.seed, options.frames)
        instructions, frames, candidates, size = count(program, lens, path)
        per_pixel = instructions / frames / PIXELS
        worst = max(worst, per_pixel)
        print(f"{lens:>8} {per_pixel:>8.1f} {candidates / frames:>19.1f} {size:>21}")
    return 0 if worst <= PER_PIXEL_MAX else 1


if __name__ == "__main__":
    sys.exit(main())
