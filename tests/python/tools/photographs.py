"""Rendered pictures of one furnished room that stand for a user's photographs, with their labels.csv."""

import csv
from collections import Counter
from pathlib import Path

import numpy as np
from PIL import Image

from bslam.core.vision import BeaconModel, DetectorModel, feature_counts
from bslam.modelfile import BeaconClass, Svm, weights_in_row
from bslam.rig import load_rig
from bslam.world.camera import Renderer, Scene, Seen, free_pose, make_world
from training.folder import COLUMNS

WORLD = 1


def name_of(seen: Seen) -> str:
    """What the user calls it."""
    return f"{seen.kind} {seen.beacon_id}"


def is_good(seen: Seen) -> bool:
    """Whole, large enough and hardly hidden: what a user would draw a box round."""
    whole = not seen.cut and seen.visible_px >= 200 and seen.visible_px > 0.9 * seen.own_px
    return whole and seen.slant_rad < 1.0


def take(folder: Path, count: int, seed: int) -> list[list[str]]:
    """Take `count` pictures of the room into a folder; the rows of its labels.csv.

    Who is in one picture only gets no box: a user has no use for that either.
    """
    folder.mkdir(parents=True, exist_ok=True)
    scene = make_world(WORLD, "test")
    renderer = Renderer(scene, load_rig("three60").cameras[1], [WORLD, seed])
    random = np.random.default_rng([WORLD, seed])
    views: dict[str, list[Seen]] = {}
    while len(views) < count:
        frame = renderer.render(tuple(free_pose(scene, random)), 10.0 * len(views))
        good = [one for one in frame.seen if is_good(one)]
        if good:
            name = f"{seed}_{len(views):02}.png"
            Image.fromarray(frame.rgb).save(folder / name)
            views[name] = good
    often = Counter(one.beacon_id for seen in views.values() for one in seen)
    rows = []
    for name, seen in views.items():
        boxes = [_row(name, one, scene) for one in seen if often[one.beacon_id] > 1]
        rows += boxes or [[name, *[""] * (len(COLUMNS) - 1)]]
    with (folder / "labels.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
    return rows


def _row(picture: str, seen: Seen, scene: Scene) -> list[str]:
    look = next(one for one in scene.beacons if one.beacon_id == seen.beacon_id)
    edges = [f"{edge + 0.5:.2f}" for edge in seen.box]
    return [picture, name_of(seen), *edges, f"{look.height_m:g}", f"{look.depth_m:g}"]


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
