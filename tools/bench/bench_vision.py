"""Instructions a pixel that the vision front end takes on this host, by callgrind: `make bench-vision`.

Renders short walks through a world of style "test", one for each kind of lens, compiles the core with
tests/bench/bench_vision.c at -O2 and counts whole frames, by stage, at 320x240 and, of every other pixel, at
160x120. Unlike time, the counts are the same from run to run. Instructions are not cycles.
"""

import argparse
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tools.training.render_set import RIGS, camera_of, render_world

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "bench"
WIDTHS = (320, 160)
PER_PIXEL_MAX = 75
STAGES = {
    "rows": ("bslam_thumbnail_row", "bslam_thumbnail_row_doubled"),
    "room": ("bslam_background_tones", "bslam_background_learn", "bslam_background_floor_line"),
    "cells": ("bslam_cells_step", "bslam_cells_decide"),
    "boxes": ("bslam_proposals_find", "bslam_vertical_edges_propose"),
    "features": ("bslam_box_prefilter", "bslam_blob_features", "bslam_detector_normalise"),
    "machines": ("bslam_svm_decide", "bslam_additive_locate", "bslam_additive_decide"),
    "pixels": ("bslam_patch_features", "bslam_hinged_decide"),
    "measuring": ("bslam_measure",),
}
"""Functions of the core whose instructions, with those of what they call, make up a stage."""

FLAGS = ["-std=c11", "-O2", "-g", "-ffp-contract=off", f"-I{ROOT / 'firmware'}"]


def build(lens: str) -> Path:
    """The bench program with room for what a lens needs."""
    BUILD.mkdir(parents=True, exist_ok=True)
    program = BUILD / f"vision_{lens}"
    zoom = RIGS[lens].cameras[0].zoom
    room = [f"-DBSLAM_IMAGE_WIDTH_MAX={320 * zoom}", f"-DBSLAM_IMAGE_HEIGHT_MAX={240 * zoom}"]
    room += [f"-DBSLAM_PROPOSALS_MAX={120 * zoom}"]
    sources = [ROOT / "tests/bench/bench_vision.c"]
    sources += [path for one in ("base", "vision") for path in sorted((ROOT / "firmware" / one).rglob("*.c"))]
    subprocess.run(["cc", *FLAGS, *room, *map(str, sources), "-lm", "-o", str(program)], check=True)
    return program


@dataclass(frozen=True)
class Count:
    """Instructions a pixel, in all and by stage; candidates a frame; bytes of an instance."""

    total: float
    stages: dict[str, float]
    candidates: float
    size: int


def pictures(lens: str, width: int, seed: int, frames: int) -> Path:
    """A file of frames, as the program reads them."""
    path = BUILD / f"{lens}_{width}_{seed}.rgb565"
    step = 320 // width
    frames_565 = render_world(seed, "test", camera_of(lens, seed), frames).pictures[:, ::step, ::step]
    np.ascontiguousarray(frames_565).tofile(path)
    return path


def count(program: Path, lens: str, width: int, path: Path) -> Count:
    """What the program takes for the frames of a file."""
    profile = BUILD / "callgrind.out"
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={profile}"]
    command += ["--toggle-collect=measured_frame", str(program), lens, str(width), str(path)]
    done = subprocess.run(command, capture_output=True, text=True)
    collected = re.search(r"Collected\s*:\s*(\d+)", done.stderr)
    if done.returncode != 0 or collected is None:
        raise SystemExit(f"bench: {program.name} {lens} failed:\n{done.stderr}")
    frames, candidates, size = map(int, done.stdout.split())
    pixels = frames * width * (width * 3 // 4)
    inclusive = by_function(profile)
    stages = {
        stage: sum(inclusive.get(name, 0) for name in names) / pixels for stage, names in STAGES.items()
    }
    return Count(int(collected[1]) / pixels, stages, candidates / frames, size)


def by_function(profile: Path) -> dict[str, int]:
    """Instructions of each function and what it calls."""
    command = ["callgrind_annotate", "--inclusive=yes", "--threshold=100", "--auto=no", str(profile)]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found: dict[str, int] = {}
    for number, name in re.findall(r"^ *([\d,]+) \([^)]*\) +\S+:(\w+)", lines, re.MULTILINE):
        found[name] = max(found.get(name, 0), int(number.replace(",", "")))
    return found


def main() -> int:
    """Prints the table; exits 1 if a lens takes more than PER_PIXEL_MAX instructions a pixel at 320x240."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7000, help="of the world (default: 7000)")
    parser.add_argument("--frames", type=int, default=10, help="frames of the walk (default: 10)")
    options = parser.parse_args()
    programs = {lens: build(lens) for lens in RIGS}
    print("instructions of the vision front end a pixel, host -O2, callgrind; not cycles")
    titles = (*STAGES, "rest", "all")
    print(f"{'lens':>8} {'width':>6} " + " ".join(f"{title:>9}" for title in titles) + "  candidates a frame")
    over, sizes = [], {}
    for width in WIDTHS:
        for lens in RIGS:
            path = pictures(lens, width, options.seed, options.frames)
            taken = count(programs[lens], lens, width, path)
            rest = taken.total - sum(taken.stages.values())
            numbers = (*taken.stages.values(), rest, taken.total)
            shares = " ".join(f"{number:>9.1f}" for number in numbers)
            print(f"{lens:>8} {width:>6} {shares} {taken.candidates:>19.1f}")
            over += [lens] if width == WIDTHS[0] and taken.total > PER_PIXEL_MAX else []
            sizes[lens] = taken.size
    print(f"bytes of an instance for 320x240: {sizes}")
    if over:
        print(f"more than {PER_PIXEL_MAX} a pixel at {WIDTHS[0]}: {', '.join(over)}", file=sys.stderr)
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
