"""Where the beacon detector loses objects: no box, none that fits well, judged away, or judged too low.

Walks through worlds of style "test" with the built-in model and says of the objects that count, by kind (what
counts: tools/training/truth.py): of how many a proposal overlaps by half and by .7; how many are still among
the candidates when every score is taken; and how many are found at a precision. Then the same by the object's
shorter side in pixels of the picture. `--coarse` looks at pixels as they are where the rig says doubled.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.core.vision import FrontEnd
from bslam.rig import Camera
from training.detector_score import Sightings, is_found, look_at_worlds, objects_of, score
from training.render_set import KINDS, RIGS, World, camera_of, read_world, render_set
from training.truth import OVERLAP_MIN, overlaps

ROOT = Path(__file__).resolve().parent.parent
NEAR_M = {"pinhole": 6.0, "wide": 5.0}
OVERLAP_GOOD = 0.7
PRECISIONS = (0.95, 0.90)
SIZES_PX = (0.0, 10.0, 14.0, 20.0, 28.0, 40.0, np.inf)


def best_boxes(world: World, camera: Camera) -> NDArray[np.float64]:
    """Of each object that counts the best overlap of a proposal, in the order of objects_of."""
    front_end, objects = FrontEnd([camera]), objects_of(world)
    best = np.zeros(len(objects))
    for frame, picture in enumerate(world.pictures):
        front_end.see(picture)
        boxes = front_end.proposals().boxes
        here = np.flatnonzero(objects["frame"] == frame)
        if len(boxes) and len(here):
            best[here] = overlaps(boxes, world.seen["box"][objects["row"][here]]).max(axis=0)
    return best


def shorter_sides(objects: NDArray[np.void], worlds: Sequence[World]) -> NDArray[np.float64]:
    """The shorter side of each object's box, in pixels of the picture."""
    boxes = {world.seed: world.seen["box"] for world in worlds}
    sides = [boxes[int(one["world"])][one["row"]] for one in objects]
    return np.array([min(box[2] - box[0], box[3] - box[1]) for box in sides])


def size_rows(side_px: NDArray[np.float64]) -> dict[str, NDArray[np.bool_]]:
    """Which objects are of which size, by the sizes' names."""
    rows = {}
    for low, high in pairwise(SIZES_PX):
        name = f"{low:g} to {high:g} px" if np.isfinite(high) else f"from {low:g} px"
        rows[name] = (side_px >= low) & (side_px < high)
    return rows


def report(seen: Sightings, best: NDArray[np.float64], side_px: NDArray[np.float64], near_m: float) -> None:
    """Prints shares of the objects, near ones by kind and by size, then all."""
    stages = [best >= OVERLAP_MIN, best >= OVERLAP_GOOD, is_found(seen.objects, seen.detections)]
    stages += [score(seen, precision).found for precision in PRECISIONS]
    titles = ("a box", "a good one", "any score", *(f"at {precision:.2f}" for precision in PRECISIONS))
    print(f"{'':>16} {'objects':>8} " + " ".join(f"{title:>10}" for title in titles))
    near = seen.objects["range_m"] < near_m
    rows = {f"to {near_m:g} m": near, "all": np.ones_like(near)}
    rows |= {kind: near & (seen.objects["kind"] == index) for index, kind in enumerate(KINDS)}
    rows |= {name: near & chosen for name, chosen in size_rows(side_px).items()}
    for name, chosen in rows.items():
        if chosen.any():
            shares = " ".join(f"{stage[chosen].mean():>10.3f}" for stage in stages)
            print(f"{name:>16} {int(chosen.sum()):>8} {shares}")


def main() -> int:
    """Prints a table for a lens."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lens", choices=tuple(RIGS), default="wide")
    parser.add_argument("--first-seed", type=int, default=2000, help="of the worlds (default: 2000)")
    parser.add_argument("--worlds", type=int, default=60, help="(default: 60)")
    parser.add_argument("--coarse", action="store_true", help="without the rig's zoom")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "training", help="rendered worlds")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    lens, seeds = options.lens, range(options.first_seed, options.first_seed + options.worlds)
    if options.coarse:
        cameras = tuple(replace(camera, zoom=1) for camera in RIGS[lens].cameras)
        RIGS[lens] = replace(RIGS[lens], cameras=cameras)
    render_set(options.folder, lens, "test", seeds, options.processes)
    seen = look_at_worlds(options.folder, lens, "test", seeds, None, options.processes)
    worlds = [read_world(options.folder, lens, "test", seed) for seed in seeds]
    best = np.concatenate([best_boxes(world, camera_of(lens, world.seed)) for world in worlds])
    report(seen, best, shorter_sides(seen.objects, worlds), NEAR_M[lens])
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
