"""How much of a missed recall is the classifier's: boosted trees on what the beacon detector's machines see.

Takes the built-in front end's boxes and features of the worlds that the detector was trained on, fits boosted
trees to them (no SVM, and too large for the device), lets them judge the boxes of worlds of style "test" and
prints recall at a precision as tools/measure_detector.py does, outlines not measured. What trees miss too, no
other judgement of these boxes and features will find.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier
from tqdm import tqdm

from bslam.core.vision import FrontEnd
from train_detector import PLANS
from training.detector_fit import kind_targets, usable
from training.detector_samples import gather_boxes
from training.detector_score import DETECTION, Sightings, objects_of, score, sorted_sightings
from training.render_set import RIGS, camera_of, read_world, render_set
from training.truth import areas, counts, intersections, overlaps, owners

ROOT = Path(__file__).resolve().parent.parent
NEAR_M = {"pinhole": 6.0, "wide": 5.0}
NEGATIVES = 150_000
OVERLAP_MAX, WITHIN_MAX = 0.3, 0.7  # as in detector.c
ODDS_MIN = -4.0


def fit_trees(folder: Path, lens: str, worlds: int, processes: int) -> HistGradientBoostingClassifier:
    """Trees that tell beacons of any kind from all else: all beacons' boxes and NEGATIVES others."""
    samples = gather_boxes(folder, lens, "train", range(worlds), None, processes, PLANS[lens].halves)
    good = np.flatnonzero(usable(samples))
    is_beacon = kind_targets(samples)[good, 0]
    others = np.random.default_rng(0).permutation(good[~is_beacon])[:NEGATIVES]
    chosen = np.concatenate([good[is_beacon], others])
    trees = HistGradientBoostingClassifier(max_iter=200, learning_rate=0.1, l2_regularization=1.0)
    return trees.fit(samples.features[chosen], kind_targets(samples)[chosen, 0])


def kept(boxes: NDArray[np.float32], values: NDArray[np.float64]) -> list[int]:
    """Those that no surer one overlaps, surest first."""
    chosen: list[int] = []
    for one in np.argsort(-values, kind="stable").tolist():
        box, others = boxes[one : one + 1], boxes[chosen]
        within = intersections(box, others)[0] / np.minimum(areas(box), areas(others))
        if not ((overlaps(box, others)[0] > OVERLAP_MAX) | (within > WITHIN_MAX)).any():
            chosen.append(one)
    return chosen


def look(
    folder: Path, lens: str, seeds: Iterable[int], trees: HistGradientBoostingClassifier
) -> tuple[Sightings, float]:
    """What the trees find, and the share of objects that any box is of: the proposals' own recall."""
    found, objects, proposed = [], [], 0
    for seed in tqdm(list(seeds), desc="looking", unit="world"):
        world, front_end = read_world(folder, lens, "test", seed), FrontEnd([camera_of(lens, seed)])
        for frame, picture in enumerate(world.pictures):
            front_end.see(picture)
            boxes = front_end.proposals()
            if len(boxes.boxes) == 0:
                continue
            rows = np.flatnonzero(world.seen["frame"] == frame)
            owner, overlap = owners(boxes.boxes, world.seen[rows], counts(world.seen[rows]))
            proposed += len(np.unique(owner[owner >= 0]))
            values = trees.decision_function(boxes.features)
            likely = np.flatnonzero(values > ODDS_MIN)
            for i in likely[kept(boxes.boxes[likely], values[likely])].tolist():
                row = int(rows[owner[i]]) if owner[i] >= 0 else int(owner[i])
                found.append((seed, frame, values[i], row, -1, -1, False, overlap[i]))
        objects.append(objects_of(world))
    joined = np.concatenate(objects)
    return sorted_sightings(np.array(found, DETECTION), joined), proposed / len(joined)


def main() -> int:
    """Prints what trees reach."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lens", choices=tuple(RIGS), default="pinhole")
    parser.add_argument("--worlds", type=int, help="to train on (default: the detector's)")
    parser.add_argument("--first-seed", type=int, default=9000, help="of the test worlds (default: 9000)")
    parser.add_argument("--tests", type=int, default=40, help="test worlds (default: 40)")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "training", help="rendered worlds")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    lens, seeds = options.lens, range(options.first_seed, options.first_seed + options.tests)
    worlds = options.worlds or PLANS[lens].worlds
    render_set(options.folder, lens, "train", range(worlds), options.processes)
    render_set(options.folder, lens, "test", seeds, options.processes)
    trees = fit_trees(options.folder, lens, worlds, options.processes)
    seen, proposed = look(options.folder, lens, seeds, trees)
    print(f"{lens}: a box of {proposed:.3f} of {len(seen.objects)} objects")
    for precision in (0.95, 0.90):
        result = score(seen, precision)
        near = result.found[seen.objects["range_m"] < NEAR_M[lens]].mean()
        print(f"  trees, at {precision:.2f}: {near:.3f} to {NEAR_M[lens]:g} m, {result.recall:.3f} of all")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
