"""Takes pictures of a rendered room and labels them: to try what is trained from pictures without a camera.

Writes --count pictures and labels.csv, for `bslam detect`, into FOLDER. Every beacon that is whole and well
seen has a box with the name of its kind. The room is --world's, or that of a drive of a --scenario: then a
robot can drive by what was trained. Another --seed takes other pictures of that room.
`.venv/bin/python -m tools.training.example_pictures FOLDER [--scenario NAME] [--world 1] [--count 20]`
"""

import argparse
import csv
import math
from pathlib import Path

import numpy as np
from PIL import Image

from bslam.datasets.labels import COLUMNS
from bslam.rig import load_rig
from bslam.world.camera import Renderer, Scene, Seen, dress, free_pose, make_world
from bslam.world.scenario import load_scenario

BETWEEN_S = 10.0  # light and white balance change from picture to picture
SLANT_RAD_MAX = math.radians(75.0)
VISIBLE_PX_MIN = 100
HIDDEN_MAX = 0.4


def is_well_seen(seen: Seen) -> bool:
    """What a user would draw a box round."""
    hidden = 1.0 - seen.visible_px / max(seen.own_px, 1)
    whole = not seen.cut and hidden <= HIDDEN_MAX
    return whole and seen.visible_px >= VISIBLE_PX_MIN and seen.slant_rad < SLANT_RAD_MAX


def take(folder: Path, scene: Scene, world: int, count: int, seed: int) -> list[list[str]]:
    """Take `count` pictures of a room into a folder; the rows of its labels.csv."""
    folder.mkdir(parents=True, exist_ok=True)
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
    rows = [_row(name, one, scene) for name, seen in views.items() for one in seen]
    with (folder / "labels.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
    return rows


def _row(picture: str, seen: Seen, scene: Scene) -> list[str]:
    look = next(one for one in scene.beacons if one.beacon_id == seen.beacon_id)
    edges = [f"{edge + 0.5:.2f}" for edge in seen.box]
    return [picture, seen.kind, *edges, f"{look.height_m:g}", ""]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("--world", type=int, default=1, help="which room (default: 1)")
    parser.add_argument(
        "--scenario", help="the room of a drive of this scenario; --world is the drive's seed"
    )
    parser.add_argument("--count", type=int, default=20, help="pictures (default: 20)")
    parser.add_argument("--seed", type=int, default=0, help="where they are taken from (default: 0)")
    words = parser.parse_args()
    if words.scenario is None:
        scene = make_world(words.world, "test")
    else:
        scene = dress(load_scenario(words.scenario), words.world)
    rows = take(words.folder, scene, words.world, words.count, words.seed)
    kinds = {row[1] for row in rows}
    print(f"{words.folder}: {words.count} pictures, {len(rows)} boxes in labels.csv, {len(kinds)} kinds")


if __name__ == "__main__":
    main()
