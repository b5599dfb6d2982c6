"""Trains a scanner from labelled pictures, and tells how good it is on pictures that were left out."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np
from joblib import Parallel, delayed

from bslam.core.scanner import Scanner
from bslam.detect.boxes import Curve, Found, curve, overlaps
from bslam.detect.examples import Collection, Example
from bslam.detect.fit import fit_windows, look_at
from bslam.errors import BslamError
from bslam.scannerfile import KINDS_MAX, LOWEST, SIZE_MAX_M, WINDOWS_MAX, Kind, ScannerModel, Window

FOLDS: Final = 4
PICTURES_MIN: Final = 2 * FOLDS
"""With a class in them: each part shows it."""
AREA_MIN_PX2: Final = 400
"""Smaller things fill a few cells of the picture."""
HIT: Final = 0.5
"""Overlap from which on a detection is of the thing."""
_SD_MIN: Final = 0.01
_FRONT: Final = 0.9  # part of the labelled boxes that are no wider, to their height, than from ahead


@dataclass(frozen=True)
class Left:
    """What was found of each class in pictures that were left out of the training."""

    found: Mapping[str, tuple[Found, ...]]

    def curve(self, kind: str, overlap: float = HIT) -> Curve:
        return curve(self.found[kind], overlap)

    def without(self, kind: str) -> Curve:
        """The same on pictures that show none of the class."""
        return curve([one for one in self.found[kind] if not len(one.labelled)], HIT)


@dataclass(frozen=True)
class Trained:
    """A model, and what it found in pictures that were left out."""

    model: ScannerModel
    left: Left


def check_collection(collection: Collection) -> None:
    """BslamError if there are more classes than a model holds, or one cannot be trained and tried."""
    if len(collection.kinds) > KINDS_MAX:
        raise BslamError(
            f"{len(collection.kinds)} classes; allowed: {KINDS_MAX}, chosen by --classes, or more models"
        )
    for kind in collection.kinds:
        count = sum(len(one.of(kind)) > 0 for one in collection.examples)
        if count < PICTURES_MIN:
            raise BslamError(
                f"class {kind!r} is in {count} pictures; allowed: {PICTURES_MIN} at least, twenty are better"
            )
        sides = np.concatenate([one.of(kind)[:, 2:] - one.of(kind)[:, :2] for one in collection.examples])
        large = int((np.prod(sides, axis=1) >= AREA_MIN_PX2).sum())
        if large < len(sides) / 2:
            raise BslamError(
                f"class {kind!r}: {len(sides) - large} of {len(sides)} boxes have less than {AREA_MIN_PX2} "
                "square pixels in a frame of 320x240; allowed: less than half, take pictures from nearer"
            )


def parts_of(collection: Collection) -> list[int]:
    """Which part each picture is in: of pictures that show the same classes those that stand together."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for index, one in enumerate(collection.examples):
        shown = tuple(kind for kind in collection.kinds if len(one.of(kind)))
        groups.setdefault(shown, []).append(index)
    parts = [0] * len(collection.examples)
    for its in groups.values():
        for place, index in enumerate(its):
            parts[index] = place * FOLDS // len(its)
    return parts


def train(collection: Collection, false_a_picture: float, seed: int = 0) -> Iterator[str | Trained]:
    """What is being done, step by step, and at last the model.

    false_a_picture: thresholds allow so many false detections in a picture that was left out.
    """
    check_collection(collection)
    examples = collection.examples
    parts = parts_of(collection)
    jobs = []
    for part in (*range(FOLDS), None):
        chosen = [one for one, its in zip(examples, parts, strict=True) if its != part]
        jobs += [(part, kind, chosen) for kind in range(len(collection.kinds))]
    names = collection.kinds
    work = (delayed(_fit_one)(names[kind], kind, chosen, seed) for _, kind, chosen in jobs)
    windows: dict[int | None, list[Window]] = {}
    done = Parallel(n_jobs=min(len(jobs), os.cpu_count() or 1), return_as="generator")(work)
    for (part, kind, chosen), its in zip(jobs, done, strict=True):
        windows.setdefault(part, []).extend(its)
        what = "all pictures" if part is None else f"without part {part + 1} of {FOLDS}"
        shapes = f"{len(its)} shape{'s' * (len(its) > 1)} of window"
        yield f"{names[kind]}: trained on {len(chosen)} pictures, {what}: {shapes}"
    count = max(len(its) for its in windows.values())
    if count > WINDOWS_MAX:
        raise BslamError(
            f"{count} windows; allowed: {WINDOWS_MAX}, so fewer classes, or boxes of fewer shapes"
        )
    left = _look_at_left(collection, parts, windows)
    kinds = tuple(_kind(name, collection, left, false_a_picture) for name in names)
    yield Trained(ScannerModel(kinds, tuple(windows[None])), left)


def _fit_one(name: str, kind: int, examples: Sequence[Example], seed: int) -> list[Window]:
    return fit_windows(kind, name, look_at(examples), np.random.default_rng([seed, kind]))


def alone(model: ScannerModel, kind: int) -> Scanner:
    """A scanner of one of its kinds that reports all that is kept. Other kinds, below their thresholds, would
    hide what it finds.
    """
    windows = tuple(replace(one, kind=0) for one in model.windows if one.kind == kind)
    return Scanner(ScannerModel((replace(model.kinds[kind], threshold=LOWEST),), windows))


def _look_at_left(
    collection: Collection, parts: Sequence[int], windows: Mapping[int | None, Sequence[Window]]
) -> Left:
    found: dict[str, list[Found]] = {kind: [] for kind in collection.kinds}
    kinds = tuple(Kind(name, 0.0, 0.0, LOWEST, 1.0, 0.0, 1.0, 1.0) for name in collection.kinds)
    for part, (index, kind) in product(range(FOLDS), enumerate(collection.kinds)):
        scanner = alone(ScannerModel(kinds, tuple(windows[part])), index)
        for one, its in zip(collection.examples, parts, strict=True):
            if its == part:
                found[kind].append(find(scanner, one, kind))
    return Left({kind: tuple(its) for kind, its in found.items()})


def find(scanner: Scanner, example: Example, kind: str) -> Found:
    """What a scanner finds of a class in a picture, beside what is there."""
    seen = [one for one in scanner.see(example.frame).items if one.kind == kind]
    boxes = np.array([one.box for one in seen]).reshape(-1, 4)
    return Found(boxes, np.array([one.score for one in seen]), example.of(kind))


def _kind(name: str, collection: Collection, left: Left, false_a_picture: float) -> Kind:
    its = left.curve(name)
    slope, offset = _odds(its)
    middle_sd, height_sd = _box_noise(left.found[name])
    threshold = its.threshold_at(false_a_picture)
    if not np.isfinite(threshold):
        threshold = 1.0
    height_m = collection.heights_m[name]
    width_m = min(height_m * _front_aspect(collection.examples, name), SIZE_MAX_M)
    return Kind(name, height_m, width_m, threshold, slope, offset, middle_sd, height_sd)


def _front_aspect(examples: Sequence[Example], name: str) -> float:
    """Width to height of a class from ahead: but for outliers, the widest box that no picture cuts off. 0 if
    each does.
    """
    aspects = []
    for one in examples:
        height, width = one.frame.shape[:2]
        left, top, right, bottom = one.of(name).T
        whole = (left > 1) & (top > 1) & (right < width - 1) & (bottom < height - 1)
        aspects += ((right - left) / (bottom - top))[whole].tolist()
    return float(np.quantile(aspects, _FRONT)) if aspects else 0.0


def _odds(its: Curve) -> tuple[float, float]:
    """Slope and offset of the logarithm of the odds that a detection of a score is a hit."""
    from sklearn.linear_model import LogisticRegression

    if its.hits.all() or not its.hits.any():
        return 1.0, 0.0
    fit = LogisticRegression(C=1.0).fit(its.scores[:, None], its.hits)
    return max(0.0, float(fit.coef_[0, 0])), float(fit.intercept_[0])


def _box_noise(found: Sequence[Found]) -> tuple[float, float]:
    """Standard deviations of the middle of a box across, of its width, and of its height, of itself."""
    middles, heights = [], []
    for one in found:
        shared = overlaps(one.boxes, one.labelled)
        for box, its in zip(one.boxes, shared, strict=True):
            if len(its) and its.max() >= HIT:
                real = one.labelled[its.argmax()]
                width, height = real[2] - real[0], real[3] - real[1]
                middles.append((box[0] + box[2] - real[0] - real[2]) / 2 / width)
                heights.append(np.log((box[3] - box[1]) / height))
    return _robust_sd(middles), _robust_sd(heights)


def _robust_sd(values: Sequence[float]) -> float:
    """By the share of normal values within a deviation; 0.2 where there are too few to tell."""
    return max(_SD_MIN, float(np.quantile(np.abs(values), 0.683))) if len(values) >= 5 else 0.2
