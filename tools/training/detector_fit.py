"""Fits the machines of a detector to samples, one after the other: cells, screen, kinds, fusion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from sklearn.preprocessing import StandardScaler

from bslam.core.vision import DetectorModel
from bslam.modelfile import Svm
from tools.training.additive import decide_additive, fit_additive, most_telling, place_knots
from tools.training.detector_samples import CLASSES, CLUTTER, RECOLOURED, BoxSamples, CellSamples
from tools.training.fit import choose_cost, fit, mean_average_precision
from tools.training.render_set import KINDS
from tools.training.together import fit_together
from tools.training.truth import IGNORED, NOTHING

CELL_COSTS = (0.01, 0.1)
KIND_COSTS = (0.0005, 0.002, 0.008)
KIND_FOLDS = 2
KIND_TRIALS = 20_000  # beacons, and as many others, that the cost is chosen on
KIND_EQUAL = 0.001  # average precisions that differ by less are equal
FUSION_COST = 0.001
SCREEN_COST = 0.01
SCREEN_RECALL = 0.99
GLANCE_COST = 0.01
SURE = -0.5
"""Objects whose best box scores this or more are those that the stages before it are to keep."""
STAGES = ("glance", "screen", "any")
OVERLAP_FOUND = 0.5  # as OVERLAP_MIN of truth.py
FEATURE_LIMIT = 3.0  # as BSLAM_FEATURE_LIMIT
OVERLAP_SURE = 0.6
OVERLAP_NEGATIVE = 0.45
POSITIVES_MAX = 240_000
NEGATIVES_FIRST = 100_000
NEGATIVES_TRIED = 1_200_000  # of which the hard ones are taken
NEGATIVES_HARD = 160_000
NOT_CROSSED = np.zeros(0, np.uint8)
CROSSED = 16  # features that are told in pairs, too
FIRST_ITERATIONS = 50
ITERATIONS = 80
FUSION_LIMIT = 4.0  # as BSLAM_FUSION_LIMIT
SIZE_FREE, SIZE_LOSS, SIZE_LOSS_MAX = 0.2, 1.5, 1.0  # as in detector.c
LOG_HEIGHT, PER_METRE = 1, 7  # as BSLAM_BLOB_LOG_HEIGHT, BSLAM_BLOB_PER_METRE
FUSION_SHARE = 5  # every so many worlds are kept for the fusion


def fit_cells(samples: CellSamples, most: int) -> Svm:
    """The linear machine that tells a beacon's cell, from so many of them at most."""
    random = np.random.default_rng(0)
    chosen = random.permutation(len(samples.is_beacon))[:most]
    x = samples.features[chosen].astype(np.float64)
    targets = samples.is_beacon[chosen, None]
    few = slice(0, most // 5)
    cost, _ = choose_cost(
        x[few], targets[few], balanced=True, groups=samples.world[chosen][few], costs=CELL_COSTS
    )
    return fit(x, targets, cost, balanced=True).svm


def normaliser(features: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Offset and scale that bring the features to mean 0 and deviation 1."""
    scaler = StandardScaler().fit(features.astype(np.float64))
    return scaler.mean_.astype(np.float32), (1.0 / scaler.scale_).astype(np.float32)


def normalised(features: NDArray[np.float32], detector: DetectorModel) -> NDArray[np.float32]:
    """As bslam_detector_normalise."""
    return np.clip((features - detector.blob_offset) * detector.blob_scale, -FEATURE_LIMIT, FEATURE_LIMIT)


def kind_targets(samples: BoxSamples) -> NDArray[np.bool_]:
    """Any beacon, each kind, clutter: (n, kinds + 2)."""
    kinds = samples.label[:, None] == np.arange(len(KINDS))[None, :]
    return np.column_stack([kinds.any(axis=1), kinds, samples.label == CLUTTER])


def usable(samples: BoxSamples) -> NDArray[np.bool_]:
    """Samples that are clearly one thing: not on a beacon that does not count, not a half-hit."""
    half = (samples.label < 0) & (samples.overlap >= OVERLAP_NEGATIVE)
    weak = (samples.label >= 0) & (samples.label != CLUTTER) & (samples.overlap < OVERLAP_SURE)
    return (samples.label != IGNORED) & ~half & ~weak


def decide(svm: Svm, x: NDArray[np.floating]) -> NDArray[np.float32]:
    """Decision values (n, rows) in float32, in parts that fit in memory."""
    first, second = np.triu_indices(svm.features)
    weights = svm.weights.astype(np.float32)
    if svm.byte_scale is not None:
        weights = weights * svm.byte_scale[:, None]
    values = np.empty((len(x), svm.rows), np.float32)
    for start in range(0, len(x), 20_000):
        part = x[start : start + 20_000].astype(np.float32)
        phi = np.hstack([part, part[:, first] * part[:, second]]) if svm.quadratic else part
        values[start : start + 20_000] = phi @ weights.T + svm.bias
    return values


def fit_screen(samples: BoxSamples, detector: DetectorModel) -> DetectorModel:
    """The linear machine that keeps SCREEN_RECALL of the objects' boxes."""
    good = np.flatnonzero(usable(samples))
    random = np.random.default_rng(0)
    chosen = random.permutation(good)[:80_000]
    x = normalised(samples.features[chosen], detector)
    positive = kind_targets(samples)[chosen, :1]
    svm = fit(x, positive, SCREEN_COST, balanced=True).svm
    values = decide(svm, x)[:, 0]
    return replace(
        detector, screen=svm, screen_threshold=float(np.quantile(values[positive[:, 0]], 1 - SCREEN_RECALL))
    )


def fit_kinds(samples: BoxSamples, detector: DetectorModel) -> DetectorModel:
    """The additive machines. A first fit without crossed features tells which of them to cross, and which
    negatives are hard."""
    random = np.random.default_rng(1)
    fits = np.flatnonzero(usable(samples) & (samples.world % FUSION_SHARE != 0))
    screened = decide(detector.screen, normalised(samples.features[fits], detector))[:, 0]
    fits = fits[screened >= detector.screen_threshold]
    targets = kind_targets(samples)
    is_beacon = targets[fits, 0]
    positives = random.permutation(fits[is_beacon])[:POSITIVES_MAX]
    negatives = random.permutation(fits[~is_beacon])
    chosen = np.concatenate([positives, negatives[:NEGATIVES_FIRST]])
    x = normalised(samples.features[chosen], detector)
    knots = place_knots(x[: len(positives)])
    tried = np.concatenate([positives[:KIND_TRIALS], negatives[:KIND_TRIALS]])
    cost = choose_kind_cost(
        normalised(samples.features[tried], detector),
        targets[tried],
        knots,
        samples.world[tried] % RECOLOURED,
    )
    first = fit_additive(x, targets[chosen], knots, NOT_CROSSED, cost, FIRST_ITERATIONS)
    crossed = most_telling(first, x, CROSSED)
    rest = negatives[NEGATIVES_FIRST : NEGATIVES_FIRST + NEGATIVES_TRIED]
    if len(rest):
        worst = decide_additive(first, normalised(samples.features[rest], detector))[:, :-1].max(axis=1)
        hard = rest[np.argsort(-worst)[:NEGATIVES_HARD]]
        chosen = np.concatenate([chosen, hard])
    x = normalised(samples.features[chosen], detector)
    kinds = fit_additive(x, targets[chosen], knots, crossed, cost, ITERATIONS)
    return replace(detector, kinds=kinds)


def choose_kind_cost(
    x: NDArray[np.float32],
    targets: NDArray[np.bool_],
    knots: NDArray[np.float32],
    worlds: NDArray[np.integer],
) -> float:
    """The cost by cross-validation over worlds, of machines without grids. A world and its other colours are
    left out together. Of equals the middle one: an extreme one wants a reason."""

    def score(cost: float) -> float:
        values = np.empty(targets.shape)
        for fold in range(KIND_FOLDS):
            out = worlds % KIND_FOLDS == fold
            machine = fit_additive(x[~out], targets[~out], knots, NOT_CROSSED, cost, FIRST_ITERATIONS)
            values[out] = decide_additive(machine, x[out])
        return mean_average_precision(targets, values)

    scores = {cost: score(cost) for cost in KIND_COSTS}
    print("kinds: " + ", ".join(f"C {cost:g}: AP {value:.4f}" for cost, value in scores.items()), flush=True)
    good = [cost for cost in KIND_COSTS if scores[cost] > max(scores.values()) - KIND_EQUAL]
    return min(good, key=lambda cost: abs(np.log(cost / KIND_COSTS[len(KIND_COSTS) // 2])))


def misfits(features: NDArray[np.float32], is_cut: NDArray[np.bool_]) -> NDArray[np.float32]:
    """What each kind's value (n, kinds) loses because the box is not as high as the kind: as detector.c."""
    heights_m = np.array([one.height_m for one in CLASSES])
    excess = np.abs(features[:, LOG_HEIGHT, None] - np.log(heights_m))
    loss = np.clip(SIZE_LOSS * (excess - SIZE_FREE), 0.0, SIZE_LOSS_MAX)
    has_height = (features[:, PER_METRE] > 0) & ~is_cut
    return np.where(has_height[:, None], loss, 0.0).astype(np.float32)


def fit_fusion(samples: BoxSamples, detector: DetectorModel) -> DetectorModel:
    """The quadratic machine on all machines' values, from worlds that the kinds were not fitted to."""
    chosen = np.flatnonzero(usable(samples) & (samples.world % FUSION_SHARE == 0))
    x = normalised(samples.features[chosen], detector)
    screened = decide(detector.screen, x)
    passed = screened[:, 0] >= detector.screen_threshold
    values = np.hstack([decide_additive(detector.kinds, x[passed]), screened[passed]])
    values[:, 1 : 1 + len(KINDS)] -= misfits(samples.features[chosen][passed], samples.is_cut[chosen][passed])
    is_beacon = kind_targets(samples)[chosen][passed][:, :1]
    svm = fit_together(np.clip(values, -FUSION_LIMIT, FUSION_LIMIT), is_beacon, FUSION_COST, 150)
    any_threshold = float(np.quantile(values[is_beacon[:, 0], 0], 1 - SCREEN_RECALL))
    return replace(detector, fusion=svm, any_threshold=any_threshold)


def machine_values(samples: BoxSamples, detector: DetectorModel) -> NDArray[np.float32]:
    """What the machines say of boxes, (n, 4): glance, screen, the first additive one, the score."""
    x = normalised(samples.features, detector)
    screened = decide(detector.screen, x)
    values = np.hstack([decide_additive(detector.kinds, x), screened])
    values[:, 1 : 1 + len(KINDS)] -= misfits(samples.features, samples.is_cut)
    score = decide(detector.fusion, np.clip(values, -FUSION_LIMIT, FUSION_LIMIT))
    return np.hstack([decide(detector.glance, samples.glances), screened, values[:, :1], score])


def fit_glance(samples: BoxSamples, detector: DetectorModel) -> DetectorModel:
    """The linear machine of the first glance: tells boxes that the others will find to be beacons from all
    else. Thresholds are chosen anew after it."""
    fits = samples.of(usable(samples))
    is_beacon = kind_targets(fits)[:, 0]
    found = np.flatnonzero(is_beacon)
    sure = machine_values(fits.of(found), detector)[:, -1] >= SURE
    targets = np.zeros((len(fits.label), 1), np.bool_)
    targets[found[sure]] = True
    chosen = ~is_beacon | targets[:, 0]
    svm = fit(fits.glances[chosen], targets[chosen], GLANCE_COST, balanced=True).svm
    return replace(detector, glance=svm)


def choose_thresholds(
    samples: BoxSamples, detector: DetectorModel, losses: tuple[float, float, float]
) -> DetectorModel:
    """The thresholds of the stages before the score, from boxes that nothing was fitted to: each drops the
    best box of this share of the objects that have a sure one."""
    on_object = samples.of(samples.overlap >= OVERLAP_FOUND)
    values = machine_values(on_object, detector)
    best: dict[tuple[int, int], int] = {}
    for i, key in enumerate(zip(on_object.world.tolist(), on_object.object_row.tolist(), strict=True)):
        if values[i, -1] >= SURE and (key not in best or values[i, -1] > values[best[key], -1]):
            best[key] = i
    kept = values[list(best.values())]
    glance, screen, first = (float(np.quantile(kept[:, stage], loss)) for stage, loss in enumerate(losses))
    return replace(detector, glance_threshold=glance, screen_threshold=screen, any_threshold=first)


def shares(samples: BoxSamples, detector: DetectorModel) -> str:
    """How many boxes each stage leaves."""
    values = machine_values(samples, detector)
    limits = detector.glance_threshold, detector.screen_threshold, detector.any_threshold
    left = np.cumprod([values[:, i] >= limit for i, limit in enumerate(limits)], axis=0).sum(axis=1)
    return f"of {len(values)} boxes " + ", ".join(
        f"{name} leaves {count}" for name, count in zip(STAGES, left.tolist(), strict=True)
    )


def summary(samples: BoxSamples) -> str:
    """How many boxes of which kind."""
    names: Sequence[str] = (*KINDS, "clutter")
    counts = [f"{name} {int((samples.label == i).sum())}" for i, name in enumerate(names)]
    nothing, ignored = int((samples.label == NOTHING).sum()), int((samples.label == IGNORED).sum())
    return f"{len(samples.label)} boxes: {', '.join(counts)}, nothing {nothing}, not counted {ignored}"
