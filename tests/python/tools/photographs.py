"""Rendered pictures of one furnished room that stand for a user's photographs, with their labels.csv."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from bslam.core.vision import BeaconModel, DetectorModel, feature_counts
from bslam.modelfile import BeaconClass, Svm, weights_in_row
from bslam.rig import load_rig
from bslam.world.camera import Renderer, Scene, Seen, free_pose, make_world
from training.folder import COLUMNS

WORLD = 3


def name_of(seen: Seen) -> str:
    """What the user calls it."""
    return f"{seen.kind} {seen.beacon_id}"


def is_good(seen: Seen) -> bool:
    """Whole, large enough and hardly hidden: what a user would draw a box round."""
    whole = not seen.cut and seen.visible_px >= 200 and seen.visible_px > 0.9 * seen.own_px
    return whole and seen.slant_rad < 1.0


def take(folder: Path, count: int, seed: int, names: Sequence[str] | None = None) -> list[list[str]]:
    """Take `count` pictures into a folder; the rows of its labels.csv. `names`: who gets a box, None: all."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = make_world(WORLD, "test")
    renderer = Renderer(scene, load_rig("three60").cameras[1], [WORLD, seed])
    random = np.random.default_rng([WORLD, seed])
    rows: list[list[str]] = []
    taken = 0
    while taken < count:
        frame = renderer.render(tuple(free_pose(scene, random)), 10.0 * taken)
        good = [one for one in frame.seen if is_good(one)]
        if not good:
            continue
        picture = f"{seed}_{taken:02}.png"
        Image.fromarray(frame.rgb).save(folder / picture)
        boxes = [_row(picture, one, scene) for one in good if names is None or name_of(one) in names]
        rows += boxes or [[picture, *[""] * (len(COLUMNS) - 1)]]
        taken += 1
    with (folder / "labels.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
    return rows


def _row(picture: str, seen: Seen, scene: Scene) -> list[str]:
    height_m = next(one.height_m for one in scene.beacons if one.beacon_id == seen.beacon_id)
    edges = [f"{edge + 0.5:.2f}" for edge in seen.box]
    return [picture, name_of(seen), *edges, f"{height_m:g}"]


def blind_model() -> BeaconModel:
    """A detector that finds nothing, so that what is tested does not depend on the one that was trained."""
    cells, blobs = feature_counts()
    kinds, fusion = _never(3, blobs, quadratic=True), _never(1, 4)
    offset, scale = np.zeros(blobs, np.float32), np.ones(blobs, np.float32)
    detector = DetectorModel(_never(1, cells), offset, scale, _never(1, blobs), 0.0, kinds, fusion, 0.0)
    return BeaconModel((BeaconClass("thing"),), detector, detector)


def _never(rows: int, features: int, quadratic: bool = False) -> Svm:
    weights = np.zeros((rows, weights_in_row(features, quadratic)), np.float32)
    return Svm(features, quadratic, weights, np.full(rows, -1.0, np.float32))
