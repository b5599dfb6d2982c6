"""What a detector finds in rendered worlds, against the truth: recall at a precision."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from bslam.core.vision import DetectorModel, FrontEnd
from tools.training.detector_samples import clutter_share, model_of
from tools.training.render_set import World, camera_of, read_world
from tools.training.truth import NOTHING, counts, owners

DUPLICATE = -3
"""A second detection of an object: false."""
CLUTTER_SHARE = 0.4
SCORE_MIN = -4.0

DETECTION = np.dtype(
    [
        ("world", np.int32),
        ("frame", np.int32),
        ("score", np.float32),
        ("object", np.int32),  # row of the world's `seen`, or NOTHING, IGNORED, DUPLICATE
        ("kind", np.int8),  # said
        ("true_kind", np.int8),  # -1 where there is none
        ("on_clutter", np.bool_),
        ("overlap", np.float32),
    ]
)
OBJECT = np.dtype(
    [
        ("world", np.int32),
        ("frame", np.int32),
        ("row", np.int32),
        ("beacon_id", np.int32),
        ("kind", np.int8),
        ("range_m", np.float32),
    ]
)


@dataclass(frozen=True)
class Sightings:
    """Detections, surest first, and the objects that count."""

    detections: NDArray[np.void]
    objects: NDArray[np.void]


@dataclass(frozen=True)
class Score:
    """The operating point of least score at a wanted precision."""

    threshold: float
    precision: float
    recall: float
    found: NDArray[np.bool_]  # (objects,)
    accepted: NDArray[np.void]  # detections that count, right or false

    @property
    def right(self) -> NDArray[np.bool_]:
        """Which of the accepted detections are right."""
        return self.accepted["object"] >= 0


def look_at_worlds(
    folder: Path, lens: str, style: str, seeds: Iterable[int], detector: DetectorModel | None, processes: int
) -> Sightings:
    """What the front end says of the worlds' frames, with this detector or the built-in one. All boxes are
    taken whose score is at least SCORE_MIN, whatever the detector's own threshold."""
    seeds = list(seeds)
    work = partial(_look_at_world, folder, lens, style, detector)
    with ProcessPoolExecutor(processes) as pool:
        parts = list(tqdm(pool.map(work, seeds), total=len(seeds), desc=f"looking {lens}", unit="world"))
    found = np.concatenate([detections for detections, _ in parts])
    return sorted_sightings(found, np.concatenate([objects for _, objects in parts]))


def sorted_sightings(found: NDArray[np.void], objects: NDArray[np.void]) -> Sightings:
    """Detections in any order, as Sightings has them."""
    found = found[np.argsort(-found["score"], kind="stable")]
    return Sightings(_mark_duplicates(found), objects)


def objects_of(world: World) -> NDArray[np.void]:
    """The objects of a world's frames that count."""
    seen = world.seen
    objects = [
        (world.seed, seen["frame"][row], row, seen["beacon_id"][row], seen["kind"][row], seen["range_m"][row])
        for row in np.flatnonzero(counts(seen))
    ]
    return np.array(objects, OBJECT)


def score(seen: Sightings, precision: float, clutter_is_accepted: bool = False) -> Score:
    """The lowest threshold with that precision. Where none has it: threshold inf, recall 0."""
    detections = seen.detections
    counted = (
        (detections["object"] >= 0) | (detections["object"] == NOTHING) | (detections["object"] == DUPLICATE)
    )
    if clutter_is_accepted:
        counted &= ~((detections["object"] == NOTHING) & detections["on_clutter"])
    detections = detections[counted]
    share = np.cumsum(detections["object"] >= 0) / np.arange(1, len(detections) + 1)
    good = np.flatnonzero(share >= precision)
    if len(good) == 0:
        return Score(float("inf"), 1.0, 0.0, np.zeros(len(seen.objects), np.bool_), detections[:0])
    accepted = detections[: good[-1] + 1]
    found = is_found(seen.objects, accepted)
    return Score(float(accepted["score"][-1]), float(share[good[-1]]), float(found.mean()), found, accepted)


def is_found(objects: NDArray[np.void], accepted: NDArray[np.void]) -> NDArray[np.bool_]:
    """Which objects have a detection."""
    keys = {(one["world"], one["object"]) for one in accepted if one["object"] >= 0}
    return np.array([(one["world"], one["row"]) in keys for one in objects], np.bool_)


def _look_at_world(
    folder: Path, lens: str, style: str, detector: DetectorModel | None, seed: int
) -> tuple[NDArray[np.void], NDArray[np.void]]:
    world = read_world(folder, lens, style, seed)
    model = None if detector is None else model_of(detector)
    front_end = FrontEnd([camera_of(lens, seed)], model, threshold=SCORE_MIN)
    detections = []
    for frame, picture in enumerate(world.pictures):
        candidates = front_end.see(picture).candidates
        rows = np.flatnonzero(world.seen["frame"] == frame)
        boxes = np.array([one.outline for one in candidates], np.float32).reshape(-1, 4)
        owner, overlap = owners(boxes, world.seen[rows], counts(world.seen[rows]))
        on_clutter = clutter_share(world.clutter[frame], boxes) > CLUTTER_SHARE
        for i, one in enumerate(candidates):
            row = int(rows[owner[i]]) if owner[i] >= 0 else int(owner[i])
            true_kind = int(world.seen["kind"][row]) if row >= 0 else -1
            detections.append(
                (seed, frame, one.score, row, one.beacon_class - 1, true_kind, on_clutter[i], overlap[i])
            )
    return np.array(detections, DETECTION), objects_of(world)


def _mark_duplicates(detections: NDArray[np.void]) -> NDArray[np.void]:
    """Of several detections of an object all but the surest, which comes first."""
    marked = detections.copy()
    known: set[tuple[int, int]] = set()
    for one in marked:
        key = (int(one["world"]), int(one["object"]))
        if one["object"] >= 0 and key in known:
            one["object"] = DUPLICATE
        known.add(key)
    return marked
