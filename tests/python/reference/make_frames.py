"""Writes tests/vectors/frames.npz, a few rendered frames in RGB565, and frames.txt, what the front end says
of them, to the bit.

    PYTHONPATH=tests/python:tools .venv/bin/python -m reference.make_frames            # says it anew
    PYTHONPATH=tests/python:tools .venv/bin/python -m reference.make_frames --render   # of other frames

The frames stay as they are when the renderer changes, so that a change of the front end shows by itself.
"""

import argparse
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.core.vision import Candidate, FrontEnd
from bslam.rig import Camera, load_rig
from tools.training.render_set import render_world

VECTORS = Path(__file__).resolve().parents[2] / "vectors"
FRAMES, SAID = VECTORS / "frames.npz", VECTORS / "frames.txt"
THRESHOLD = -1.0
WALKS = {"pinhole_320": 2, "pinhole_160": 3, "wide_160": 3}  # frames of each
WORLD = 9012
APART = 4  # frames of a walk, so that they differ


def camera_of(walk: str) -> Camera:
    """The camera of a walk, by kind of lens and width: a small one has every other pixel of a large one."""
    kind, width = walk.split("_")
    camera = load_rig({"pinhole": "three60", "wide": "wide180"}[kind]).cameras[0]
    lens = camera.lens
    share = int(width) / lens.width_px
    small = {name: getattr(lens, name) * share for name in ("fx_px", "fy_px", "cx_px", "cy_px")}
    return replace(
        camera, lens=replace(lens, width_px=int(width), height_px=round(lens.height_px * share), **small)
    )


def rendered() -> dict[str, NDArray[np.uint16]]:
    """Frames (n, height, width) of each walk."""
    walks = {}
    for walk, count in WALKS.items():
        kind, width = walk.split("_")
        full = camera_of(f"{kind}_320")
        step = full.lens.width_px // int(width)
        pictures = render_world(WORLD, "test", full, APART * count).pictures
        walks[walk] = np.ascontiguousarray(pictures[::APART, ::step, ::step])
    return walks


def bits(value: float | None) -> str:
    """A float32, exactly."""
    return "-" if value is None else float(np.float32(value)).hex()


def line_of(one: Candidate) -> str:
    """A candidate: class, marks, numbers, and the check sum of its signature."""
    numbers = (one.score, one.class_margin, *one.outline, one.bearing_rad, one.bearing_sd_rad)
    numbers += (one.range_m, one.range_sd_m, one.range_noise_sd_m)
    signature = zlib.crc32(np.ascontiguousarray(one.signature, "<f4").tobytes())
    marks = ",".join(sorted(one.marks)) or "none"
    return " ".join([one.kind, marks, *map(bits, numbers), f"{signature:08x}"])


def said() -> Iterator[str]:
    """What the front end says of each frame, walk by walk."""
    with np.load(FRAMES) as frames:
        for walk in WALKS:
            front_end = FrontEnd([camera_of(walk)], threshold=THRESHOLD)
            for index, picture in enumerate(frames[walk]):
                seeing = front_end.see(picture)
                yield f"{walk} {index}: {seeing.reason}"
                yield from (f"  {line_of(one)}" for one in seeing.candidates)


def main() -> int:
    """Writes the files."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--render", action="store_true", help="draw the frames, too")
    if parser.parse_args().render:
        np.savez_compressed(FRAMES, **rendered())
    SAID.write_text("\n".join(said()) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
