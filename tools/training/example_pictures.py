"""Takes pictures of a rendered room and labels them: to try what is trained from pictures without a camera.

Writes --count pictures and labels.csv into FOLDER. Every beacon that is whole and well seen has a box and a
name of its own, unless it is in one picture only; with --kinds the name of its kind, for `bslam detect`.
Another --seed takes other pictures of that room.
`.venv/bin/python -m tools.training.example_pictures FOLDER [--world 1] [--count 20] [--seed 0] [--kinds]`
"""

import argparse
import csv
import math
from collections import Counter
from pathlib import Path

import numpy as np
from PIL import Image

from bslam.datasets.labels import COLUMNS
from bslam.rig import load_rig
from bslam.world.camera import Renderer, Scene, Seen, free_pose, make_world

BETWEEN_S = 10.0  # light and white balance change from picture to picture
SLANT_RAD_MAX = math.radians(75.0)
VISIBLE_PX_MIN = 100
HIDDEN_MAX = 0.4
PICTURES_MIN = 2


def name_of(seen: Seen) -> str:
    """What the user calls it."""
    return f"{seen.kind} {seen.beacon_id}"


def is_well_seen(seen: Seen) -> bool:
    """What a user would draw a box round."""
    hidden = 1.0 - seen.visible_px / max(seen.own_px, 1)
    whole = not seen.cut and hidden <= HIDDEN_MAX
    return whole and seen.visible_px >= VISIBLE_PX_MIN and seen.slant_rad < SLANT_RAD_MAX


def take(
    folder: Path, world: int, count: int, seed: int, least: int = PICTURES_MIN, by_kind: bool = False
) -> list[list[str]]:
    """Take `count` pictures into a folder; the rows of its labels.csv.

    Objects in fewer than `least` pictures get no box. by_kind: the name is the kind's.
    """
    folder.mkdir(parents=True, exist_ok=True)
    scene = make_world(world, "test")
    renderer = Renderer(scene, load_rig("three60").cameras[0], [world, seed])
    random = np.random.default_rng([world, seed])
    views: dict[str, list[Seen]] = {}
    while len(views) < count:
        frame = renderer.render(free_pose(scene, random), BETWEEN_S * len(views))
        seen = [one for one in frame.seen if is_well_seen(one)]
        if seen:
            name = f"{seed}_{len(views):02}.png"
            Image.fromarray(frame.rgb).save(folder / name)
            views[name] = seen
    often = Counter(one.beacon_id for seen in views.values() for one in seen)
    rows = []
    for name, seen in views.items():
        boxes = [_row(name, one, scene, by_kind) for one in seen if often[one.beacon_id] >= least]
        rows += boxes or [[name, *[""] * (len(COLUMNS) - 1)]]
    with (folder / "labels.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
    return rows


def _row(picture: str, seen: Seen, scene: Scene, by_kind: bool) -> list[str]:
    look = next(one for one in scene.beacons if one.beacon_id == seen.beacon_id)
    edges = [f"{edge + 0.5:.2f}" for edge in seen.box]
    if by_kind:
        return [picture, seen.kind, *edges, f"{look.height_m:g}", ""]
    return [picture, name_of(seen), *edges, f"{look.height_m:g}", f"{look.depth_m:g}"]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("--world", type=int, default=1, help="which room (default: 1)")
    parser.add_argument("--count", type=int, default=20, help="pictures (default: 20)")
    parser.add_argument("--seed", type=int, default=0, help="where they are taken from (default: 0)")
    parser.add_argument("--kinds", action="store_true", help="names of kinds, not of objects")
    words = parser.parse_args()
    least = 1 if words.kinds else PICTURES_MIN
    rows = take(words.folder, words.world, words.count, words.seed, least, words.kinds)
    objects = {row[1] for row in rows if row[1]}
    print(f"{words.folder}: {words.count} pictures, {len(rows)} lines in labels.csv, {len(objects)} objects")


if __name__ == "__main__":
    main()
