"""What the front end makes of rendered worlds, with the truth beside it: samples to train and measure on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from bslam.core.vision import BeaconModel, DetectorModel
from bslam.modelfile import AdditiveSvm, BeaconClass, HingedSvm, Svm, weights_in_row
from tools.training.additive import KNOTS
from tools.training.front_end import FrontEnd, Proposals, feature_counts
from tools.training.render_set import CELL_PX, KINDS, World, camera_of, read_world
from tools.training.truth import NOTHING, areas, owners, teaches

CLASSES = (
    BeaconClass(
        "extinguisher", 0.60, 0.0, 1.10, 1.60, 0.01, 0.18, 0.48, 0.18, 0.18, 0.01
    ),  # round: it shows no flank
    BeaconClass("radiator", 0.63, 0.12, 0.70, 0.70, 0.09, 0.0, 0.0, 0.8, 1.4, 0.05),
    BeaconClass("door", 2.00, 0.035, 2.00, 2.00, 0.01, 0.0, 0.0, 0.9, 0.9, 0.05),
    BeaconClass("window", 1.20, 0.04, 2.10, 2.10, 0.02, 0.0, 0.0, 0.9, 1.6, 0.01),
    BeaconClass("poster", 0.84, 0.015, 1.92, 1.92, 0.02, 0.0, 0.0, 0.59, 0.59, 0.01),
    BeaconClass("sign", 0.285, 0.015, 1.75, 2.35, 0.04, 0.0, 0.0, 0.3, 0.3, 0.1),
    BeaconClass("cabinet", 1.80, 0.375, 1.80, 1.80, 0.02, 0.0, 0.0, 0.8, 1.0, 0.03),
)
"""In the order of KINDS: whole heights, middling depths, where their upper sides are, how wide they are, and
what their looks make of a distance in training worlds. A radiator's
height and a sign's are what is outlined in the mean: the lower side of the one is often found at the skirting
or the floor, and a pale rim of the other is taken for the wall. The last:
by how much the distances of one thing are off together over a drive (paper_room, drives 0:8): cabinets are
taken for doors, and rims of signs for walls."""

CLUTTER = len(KINDS)
"""Label of a proposal on clutter; kinds are 0 to CLUTTER - 1, NOTHING and IGNORED below."""

RECOLOURED = 100_000
ORDERS = ((2, 1, 0), (2, 1, 0), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1))
GAMMAS = (0.85, 1.2)

CELLS_A_FRAME = 80
CELL_FRAMES_STEP = 3


@dataclass(frozen=True)
class CellSamples:
    """Cells of some frames: features, and whether a beacon is in them (all 16 pixels nearly) or none."""

    features: NDArray[np.int16]
    is_beacon: NDArray[np.bool_]
    world: NDArray[np.int32]


@dataclass(frozen=True)
class BoxSamples:
    """Proposals, or candidates, of all frames."""

    features: NDArray[np.float32]
    glances: NDArray[np.float32]
    is_cut: NDArray[np.bool_]  # above or below, by the frame
    label: NDArray[np.int64]
    overlap: NDArray[np.float32]  # with the best object that counts
    object_row: NDArray[np.int64]  # of the world's `seen`, or -1
    frame: NDArray[np.int32]
    world: NDArray[np.int32]

    def of(self, chosen: NDArray[np.bool_] | NDArray[np.integer]) -> BoxSamples:
        """Those that a mask or indices choose."""
        return BoxSamples(*(getattr(self, one.name)[chosen] for one in fields(self)))


def recoloured(picture: NDArray[np.uint16], seed: int) -> NDArray[np.uint16]:
    """A picture in RGB565 as if everything had been painted otherwise: its channels in another order, each
    with another gamma; the same for all pictures of a seed."""
    random = np.random.default_rng([seed, 4])
    order = ORDERS[int(random.integers(len(ORDERS)))]
    channels = (picture >> 11, picture >> 5 & 63, picture & 31)
    steps = (31, 63, 31)
    red, green, blue = (
        np.rint(steps[to] * (np.arange(steps[one] + 1) / steps[one]) ** random.uniform(*GAMMAS)).astype(
            np.uint16
        )[channels[one]]
        for to, one in enumerate(order)
    )
    return (red << 11 | green << 5 | blue).astype(np.uint16)


def blank_svm(rows: int, features: int, quadratic: bool = False) -> Svm:
    """A machine that decides 0."""
    weights = np.zeros((rows, weights_in_row(features, quadratic)), np.float32)
    return Svm(features, quadratic, weights, np.zeros(rows, np.float32))


def blank_additive(rows: int, features: int) -> AdditiveSvm:
    """One that decides 0."""
    knots = np.tile(np.arange(KNOTS, dtype=np.float32), (features, 1))
    weights = np.zeros((rows, features * KNOTS), np.int8)
    zeros = np.zeros(rows, np.float32)
    return AdditiveSvm(knots, np.zeros(0, np.uint8), weights, zeros, zeros)


def blank_hinged(rows: int, features: int) -> HingedSvm:
    """One that decides 0."""
    zeros = np.zeros(rows, np.float32)
    return HingedSvm(np.zeros(features, np.uint8), np.zeros((rows, features, 2), np.int8), zeros, zeros)


def blank_detector() -> DetectorModel:
    """A detector that proposes nothing and accepts nothing: what training starts with."""
    cells, glances, blobs, closer = feature_counts()
    return DetectorModel(
        cell=Svm(cells, False, np.zeros((1, cells), np.float32), np.array([-4.0], np.float32)),
        glance=blank_svm(1, glances),
        glance_threshold=1.0,
        blob_offset=np.zeros(blobs, np.float32),
        blob_scale=np.ones(blobs, np.float32),
        screen=blank_svm(1, blobs),
        screen_threshold=1.0,
        any_threshold=1.0,
        kinds=blank_additive(len(KINDS) + 2, blobs),
        fusion=blank_svm(1, len(KINDS) + 3, quadratic=True),
        fusion_threshold=1.0,
        close=blank_hinged(len(KINDS) + 2, closer),
        verdict=blank_svm(1, len(KINDS) + 4, quadratic=True),
        threshold=1.0,
    )


def model_of(detector: DetectorModel) -> BeaconModel:
    """A whole model with one detector for every lens."""
    return BeaconModel(CLASSES, detector, detector)


def gather_cells(folder: Path, lens: str, style: str, seeds: Iterable[int], processes: int) -> CellSamples:
    """Cells of the worlds' frames."""
    work = partial(_cells_of_world, folder, lens, style, model_of(blank_detector()))
    return _gathered(CellSamples, work, seeds, processes, f"cells {lens}")


def gather_boxes(
    folder: Path,
    lens: str,
    style: str,
    seeds: Iterable[int],
    detector: DetectorModel | None,
    processes: int,
    nothing_step: int = 1,
) -> BoxSamples:
    """Proposals of the worlds' frames by a detector's cells (None: the built-in one's): of every second frame
    as it is, of the others in other colours. Of those that show nothing one in `nothing_step` is kept.

    These have RECOLOURED added to their world's number. What is a beacon hangs on shape, size, place
    more than on its colour: a detector that has seen red signs and no other red things takes those for signs.
    """
    seeds = list(seeds)
    seeds += [seed + RECOLOURED for seed in seeds]
    model = None if detector is None else model_of(detector)
    work = partial(_boxes_of_world, folder, lens, style, model, nothing_step)
    return _gathered(BoxSamples, work, seeds, processes, f"proposals {lens}")


def _gathered(kind, work, seeds: Iterable[int], processes: int, title: str):  # type: ignore[no-untyped-def]
    seeds = list(seeds)
    with ProcessPoolExecutor(processes) as pool:
        return joined(kind, list(tqdm(pool.map(work, seeds), total=len(seeds), desc=title, unit="world")))


def joined(kind, parts):  # type: ignore[no-untyped-def]
    """Samples of some parts as one; `kind` is their dataclass."""
    return kind(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(kind)))


def _cells_of_world(folder: Path, lens: str, style: str, model: BeaconModel, seed: int) -> CellSamples:
    world = read_world(folder, lens, style, seed)
    camera = camera_of(lens, seed)
    front_end = FrontEnd([camera], model)
    random = np.random.default_rng([seed, 3])
    features, labels = [], []
    for index, picture in enumerate(world.pictures):
        front_end.see(picture)
        if index % CELL_FRAMES_STEP:
            continue
        for is_beacon in (False, True):
            cover = world.cover[index].repeat(camera.zoom, axis=0).repeat(camera.zoom, axis=1)
            good = cover >= 14 if is_beacon else cover == 0
            rows, columns = np.nonzero(good)
            chosen = random.permutation(len(rows))[:CELLS_A_FRAME]
            features.append(front_end.cell_features(rows[chosen], columns[chosen]))
            labels.append(np.full(len(chosen), is_beacon))
    label = np.concatenate(labels)
    return CellSamples(np.concatenate(features), label, np.full(len(label), seed, np.int32))


def _boxes_of_world(
    folder: Path, lens: str, style: str, model: BeaconModel | None, nothing_step: int, seed: int
) -> BoxSamples:
    number = seed % RECOLOURED
    front_end = FrontEnd([camera_of(lens, number)], model)
    parts = list(boxes_of_world(folder, lens, style, front_end, number, seed >= RECOLOURED))
    boxes = joined(BoxSamples, parts)
    return boxes.of((boxes.label != NOTHING) | (np.arange(len(boxes.label)) % nothing_step == 0))


def boxes_of_world(
    folder: Path, lens: str, style: str, front_end: FrontEnd, seed: int, recolour: bool
) -> Iterator[BoxSamples]:
    """Proposals of a world's odd frames, or of the even ones in other colours, one after the other; the front
    end has then seen the frame."""
    world = read_world(folder, lens, style, seed)
    world = replace(world, seed=seed + RECOLOURED) if recolour else world
    cell_px = CELL_PX / camera_of(lens, seed).zoom
    for index, picture in enumerate(world.pictures):
        if (index % 2 == 0) != recolour:
            continue
        front_end.see(recoloured(picture, world.seed) if recolour else picture)
        yield _label_boxes(world, index, front_end.proposals(), cell_px)


def _label_boxes(world: World, index: int, found: Proposals, cell_px: float) -> BoxSamples:
    boxes = found.boxes
    rows = np.flatnonzero(world.seen["frame"] == index)
    seen = world.seen[rows]
    owner, overlap = owners(boxes, seen, teaches(seen, world.pictures.shape[2]))
    label = owner.copy()
    label[owner >= 0] = seen["kind"][owner[owner >= 0]]
    is_clutter = (owner == NOTHING) & (clutter_share(world.clutter[index], boxes) > 0.4)
    label[is_clutter] = CLUTTER
    object_row = np.full(len(boxes), -1)
    object_row[owner >= 0] = rows[owner[owner >= 0]]
    top, bottom = boxes[:, 1], boxes[:, 3]
    return BoxSamples(
        found.features,
        found.glances,
        (top < cell_px) | (bottom > world.pictures.shape[1] - cell_px),
        label,
        overlap.astype(np.float32),
        object_row,
        np.full(len(boxes), index, np.int32),
        np.full(len(boxes), world.seed, np.int32),
    )


def clutter_share(clutter: NDArray[np.uint8], boxes: NDArray[np.float32]) -> NDArray[np.float64]:
    """Share of each box (n, 4) that clutter covers, to the cell."""
    total = np.zeros((clutter.shape[0] + 1, clutter.shape[1] + 1))
    total[1:, 1:] = clutter.cumsum(axis=0).cumsum(axis=1)
    limits = np.array([clutter.shape[1], clutter.shape[0]] * 2)
    left, top, right, bottom = np.clip(np.rint((boxes + 0.5) / CELL_PX), 0, limits).astype(int).T
    inside = total[bottom, right] - total[top, right] - total[bottom, left] + total[top, left]
    return inside / np.maximum(areas(boxes), 1.0)
