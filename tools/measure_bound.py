"""How much of a missed recall is the classifier's: others on what the beacon detector's machines see.

Takes the built-in front end's boxes and features of the worlds that the detector was trained on, fits
judges to them, lets them judge the boxes of worlds of style "test" and prints recall at a precision as
tools/measure_detector.py does, outlines not measured. Judges: boosted trees, a forest of extremely
randomised trees, a machine with a Gaussian kernel (Nystroem, least squares), a network of two layers, none
of which suits the device; and additive machines, the detector's own kind, fitted to the same boxes. What all
of them miss, no other judgement of these boxes and features is likely to find. `--style test` fits them to
worlds of the style they are tried on (other seeds): what is gained is what the change of style costs.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesClassifier, HistGradientBoostingClassifier
from sklearn.kernel_approximation import Nystroem
from sklearn.linear_model import RidgeClassifier
from sklearn.neural_network import MLPClassifier
from sklearn.pipeline import make_pipeline
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from bslam.core.vision import FrontEnd
from train_detector import PLANS
from training.detector_fit import (
    FEATURE_LIMIT,
    fit_fusion,
    fit_kinds,
    fit_screen,
    kind_targets,
    machine_values,
    normaliser,
    usable,
)
from training.detector_samples import BoxSamples, blank_detector, gather_boxes
from training.detector_score import DETECTION, Sightings, objects_of, score, sorted_sightings
from training.render_set import CELL_PX, RIGS, camera_of, read_world, render_set
from training.truth import areas, counts, intersections, overlaps, owners

ROOT = Path(__file__).resolve().parent.parent
NEAR_M = {"pinhole": 6.0, "wide": 5.0}
NEGATIVES = 150_000
OVERLAP_MAX, WITHIN_MAX = 0.3, 0.7  # as in detector.c

Judge = Callable[[BoxSamples], NDArray[np.floating]]
"""How likely each box is a beacon's, on any scale."""


@dataclass(frozen=True)
class Proposed:
    """All boxes of some worlds, and the objects that count."""

    samples: BoxSamples
    boxes: NDArray[np.float32]
    owner: NDArray[np.int64]  # row of the world's `seen`, NOTHING or IGNORED
    objects: NDArray[np.void]


def some_boxes(samples: BoxSamples) -> BoxSamples:
    """All beacons' boxes and NEGATIVES others."""
    good = np.flatnonzero(usable(samples))
    is_beacon = kind_targets(samples)[good, 0]
    others = np.random.default_rng(0).permutation(good[~is_beacon])[:NEGATIVES]
    return samples.of(np.concatenate([good[is_beacon], others]))


def fit_trees(samples: BoxSamples) -> Judge:
    """Boosted trees that tell beacons of any kind from all else."""
    some = some_boxes(samples)
    trees = HistGradientBoostingClassifier(
        max_iter=200, learning_rate=0.1, l2_regularization=1.0, random_state=0
    )
    trees.fit(some.features, kind_targets(some)[:, 0])
    return lambda boxes: trees.decision_function(boxes.features)


def fit_forest(samples: BoxSamples) -> Judge:
    """The same by a forest of extremely randomised trees."""
    some = some_boxes(samples)
    forest = ExtraTreesClassifier(100, min_samples_leaf=3, max_features=10, random_state=0)
    forest.fit(some.features, kind_targets(some)[:, 0])
    return lambda boxes: forest.predict_proba(boxes.features)[:, 1]


def fit_kernel(samples: BoxSamples) -> Judge:
    """The same by a machine with a Gaussian kernel, as far as 1000 boxes span it."""
    some = some_boxes(samples)
    offset, scale = normaliser(some.features)

    def normal(boxes: BoxSamples) -> NDArray[np.float32]:
        return np.clip((boxes.features - offset) * scale, -FEATURE_LIMIT, FEATURE_LIMIT)

    kernel = Nystroem(gamma=0.5 / len(offset), n_components=1000, random_state=0)
    machine = make_pipeline(kernel, RidgeClassifier(alpha=0.1, solver="cholesky"))
    machine.fit(normal(some), kind_targets(some)[:, 0])
    return lambda boxes: machine.decision_function(normal(boxes))


def fit_network(samples: BoxSamples) -> Judge:
    """The same by a network with two hidden layers, stopped by a tenth of the boxes."""
    some = some_boxes(samples)
    offset, scale = normaliser(some.features)

    def normal(boxes: BoxSamples) -> NDArray[np.float32]:
        return np.clip((boxes.features - offset) * scale, -FEATURE_LIMIT, FEATURE_LIMIT)

    network = MLPClassifier((64, 32), alpha=1e-3, early_stopping=True, n_iter_no_change=4, random_state=0)
    network.fit(normal(some), kind_targets(some)[:, 0])
    return lambda boxes: network.predict_proba(normal(boxes))[:, 1]


def fit_additive(samples: BoxSamples) -> Judge:
    """The detector's machines: screen, additive ones, and the one that joins them."""
    offset, scale = normaliser(samples.features)
    detector = replace(blank_detector(), blob_offset=offset, blob_scale=scale)
    for fit in (fit_screen, fit_kinds, fit_fusion):
        detector = fit(samples, detector)
    return lambda boxes: machine_values(boxes, detector)[:, -1]


JUDGES: dict[str, Callable[[BoxSamples], Judge]] = {
    "trees": fit_trees,
    "forest": fit_forest,
    "kernel": fit_kernel,
    "network": fit_network,
    "additive": fit_additive,
}


def kept(boxes: NDArray[np.float32], values: NDArray[np.floating]) -> list[int]:
    """Those that no surer one overlaps, surest first."""
    chosen: list[int] = []
    for one in np.argsort(-values, kind="stable").tolist():
        box, others = boxes[one : one + 1], boxes[chosen]
        within = intersections(box, others)[0] / np.minimum(areas(box), areas(others))
        if not ((overlaps(box, others)[0] > OVERLAP_MAX) | (within > WITHIN_MAX)).any():
            chosen.append(one)
    return chosen


def propose(folder: Path, lens: str, seeds: Iterable[int]) -> Proposed:
    """The front end's boxes of worlds of style "test"."""
    parts: list[tuple[NDArray[np.generic], ...]] = []
    objects = []
    for seed in tqdm(list(seeds), desc="looking", unit="world"):
        world, camera = read_world(folder, lens, "test", seed), camera_of(lens, seed)
        front_end = FrontEnd([camera])
        edge_px = CELL_PX / camera.zoom
        for frame, picture in enumerate(world.pictures):
            front_end.see(picture)
            found = front_end.proposals()
            count = len(found.boxes)
            rows = np.flatnonzero(world.seen["frame"] == frame)
            owner, overlap = owners(found.boxes, world.seen[rows], counts(world.seen[rows]))
            owner[owner >= 0] = rows[owner[owner >= 0]]
            cut = (found.boxes[:, 1] < edge_px) | (found.boxes[:, 3] > picture.shape[0] - edge_px)
            where = np.full(count, frame), np.full(count, seed)
            parts.append((found.features, found.glances, cut, owner, overlap, owner, *where, found.boxes))
        objects.append(objects_of(world))
    *columns, boxes = (np.concatenate(column) for column in zip(*parts, strict=True))
    samples = BoxSamples(*columns)
    return Proposed(samples, boxes, samples.object_row, np.concatenate(objects))


def sightings(proposed: Proposed, values: NDArray[np.floating]) -> Sightings:
    """What is found where boxes are worth these values."""
    samples, found = proposed.samples, []
    frames = np.flatnonzero(np.diff(samples.world) | np.diff(samples.frame)) + 1
    for part in np.split(np.arange(len(values)), frames):
        for i in part[kept(proposed.boxes[part], values[part])].tolist():
            where = samples.world[i], samples.frame[i]
            found.append((*where, values[i], proposed.owner[i], -1, -1, False, samples.overlap[i]))
    return sorted_sightings(np.array(found, DETECTION), proposed.objects)


def report(name: str, seen: Sightings, near_m: float) -> None:
    """Prints what a judge reaches."""
    near = seen.objects["range_m"] < near_m
    for precision in (0.95, 0.90):
        found = score(seen, precision).found
        shares = f"{found[near].mean():.3f} to {near_m:g} m, {found.mean():.3f} of all"
        print(f"  {name}, at {precision:.2f}: {shares}")


def main() -> int:
    """Prints what the judges reach."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lens", choices=tuple(RIGS), default="pinhole")
    parser.add_argument("--worlds", type=int, help="to train on (default: the detector's)")
    parser.add_argument("--style", choices=("train", "test"), default="train", help="of worlds to train on")
    parser.add_argument("--first-seed", type=int, default=9000, help="of the test worlds (default: 9000)")
    parser.add_argument("--tests", type=int, default=40, help="test worlds (default: 40)")
    parser.add_argument("--judges", nargs="+", choices=tuple(JUDGES), default=["trees"])
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "training", help="rendered worlds")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    lens, seeds = options.lens, range(options.first_seed, options.first_seed + options.tests)
    worlds = options.worlds or PLANS[lens].worlds
    if options.style == "test" and seeds.start < worlds:
        parser.error(f"worlds 0 to {worlds - 1} of style test are trained on: --first-seed {worlds} or more")
    render_set(options.folder, lens, options.style, range(worlds), options.processes)
    render_set(options.folder, lens, "test", seeds, options.processes)
    proposed = propose(options.folder, lens, seeds)
    objects = proposed.objects
    owned = proposed.owner >= 0
    with_box = len(np.unique(np.column_stack([proposed.samples.world, proposed.owner])[owned], axis=0))
    print(f"{lens}: a box of {with_box / len(objects):.3f} of {len(objects)} objects", flush=True)
    samples = gather_boxes(
        options.folder, lens, options.style, range(worlds), None, options.processes, PLANS[lens].nothing_step
    )
    for name in options.judges:
        started = time.monotonic()
        with threadpool_limits(1):  # the same sums on any number of cores
            judge = JUDGES[name](samples)
        report(name, sightings(proposed, judge(proposed.samples)), NEAR_M[lens])
        print(f"  ({name}: {time.monotonic() - started:.0f} s)", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
