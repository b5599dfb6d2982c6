"""The closer look: what it is told of boxes that may be beacons, its machine, and the verdict on what that
says.

Fitted after all other machines, to the boxes that these let through.
"""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from bslam.core.vision import DetectorModel
from tools.training.detector_fit import (
    FUSION_LIMIT,
    FUSION_SHARE,
    OVERLAP_FOUND,
    SURE,
    decide,
    kind_targets,
    machine_values,
    usable,
)
from tools.training.detector_samples import BoxSamples, boxes_of_world, joined, model_of
from tools.training.front_end import FrontEnd
from tools.training.hinged import decide_hinged, fit_hinged
from tools.training.render_set import camera_of
from tools.training.together import fit_together

CLOSE_COST = 0.001
CLOSE_ITERATIONS = 80
VERDICT_COST = 0.001
VERDICT_ITERATIONS = 150
FUSION_LOSS = 0.002
"""The share of objects with a sure box that get no closer look."""

CELLS, WAYS, BANDS, SIDE = 6, 4, 3, 24  # as in patch.c
MIRRORED_WAYS = (0, 3, 2, 1)  # what rises falls


@dataclass(frozen=True)
class CloseSamples:
    """Boxes that reach the closer look, what it is told of them, and what was said of them before."""

    boxes: BoxSamples
    told: NDArray[np.uint8]  # (n, close features)
    said: NDArray[np.float32]  # (n, 2): the fusion's value, and that of kinds' first row

    def of(self, chosen: NDArray[np.bool_] | NDArray[np.integer]) -> CloseSamples:
        """Those that a mask or indices choose."""
        return CloseSamples(self.boxes.of(chosen), self.told[chosen], self.said[chosen])


def gather_close(
    folder: Path, lens: str, style: str, seeds: Iterable[int], detector: DetectorModel, processes: int
) -> CloseSamples:
    """Boxes of the worlds' frames that pass the stages before the fusion; every second frame as it is, the
    others in other colours."""
    work = partial(_close_of_world, folder, lens, style, detector)
    numbers = list(seeds)
    with ProcessPoolExecutor(processes) as pool:
        progress = tqdm(pool.map(work, numbers), total=len(numbers), desc=f"closer {lens}", unit="world")
        parts = [part for both in progress for part in both]
    return CloseSamples(
        joined(BoxSamples, [part.boxes for part in parts]),
        np.concatenate([part.told for part in parts]),
        np.concatenate([part.said for part in parts]),
    )


def _close_of_world(
    folder: Path, lens: str, style: str, detector: DetectorModel, seed: int
) -> list[CloseSamples]:
    model = model_of(detector)
    parts = []
    for recolour in (False, True):
        front_end = FrontEnd([camera_of(lens, seed)], model)
        for boxes in boxes_of_world(folder, lens, style, front_end, seed, recolour):
            values = machine_values(boxes, detector)
            limits = detector.glance_threshold, detector.screen_threshold, detector.any_threshold
            chosen = np.flatnonzero((values[:, :3] >= limits).all(axis=1))
            told = front_end.close_features(chosen.tolist())
            parts.append(CloseSamples(boxes.of(chosen), told, values[chosen][:, [3, 2]]))
    return parts


def mirrored(told: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """What the closer look would be told (n, close features) of the mirror image: a room has no left and
    right. The features of boxes are the same."""
    count, cells, bands = len(told), CELLS * CELLS * WAYS, BANDS * SIDE
    parts = (
        told[:, :cells].reshape(count, CELLS, CELLS, WAYS)[:, :, ::-1, MIRRORED_WAYS],
        told[:, cells : cells + bands].reshape(count, BANDS, SIDE)[:, :, ::-1],
        told[:, cells + bands : cells + 2 * bands].reshape(count, BANDS, SIDE)[:, ::-1],
        told[:, cells + 2 * bands :],
    )
    return np.hstack([part.reshape(count, -1) for part in parts])


def fit_close(samples: CloseSamples, detector: DetectorModel) -> DetectorModel:
    """The hinged machine, from the worlds that the kinds' machines were fitted to, each box and its mirror
    image."""
    chosen = usable(samples.boxes) & (samples.boxes.world % FUSION_SHARE != 0)
    told, targets = samples.told[chosen], kind_targets(samples.boxes)[chosen]
    both = np.concatenate([told, mirrored(told)])
    machine = fit_hinged(both, np.concatenate([targets, targets]), CLOSE_COST, CLOSE_ITERATIONS)
    return replace(detector, close=machine)


def verdict_inputs(samples: CloseSamples, detector: DetectorModel) -> NDArray[np.float32]:
    """What the verdict weighs of boxes (n, kinds + 4)."""
    inputs = np.hstack([samples.said, decide_hinged(detector.close, samples.told)])
    return np.clip(inputs, -FUSION_LIMIT, FUSION_LIMIT).astype(np.float32)


def fit_verdict(samples: CloseSamples, detector: DetectorModel) -> DetectorModel:
    """The quadratic machine on what both looks say, from the worlds that the fusion was fitted to."""
    some = samples.of(usable(samples.boxes) & (samples.boxes.world % FUSION_SHARE == 0))
    targets = kind_targets(some.boxes)[:, :1]
    verdict = fit_together(verdict_inputs(some, detector), targets, VERDICT_COST, VERDICT_ITERATIONS)
    return replace(detector, verdict=verdict)


def choose_fusion_threshold(samples: CloseSamples, detector: DetectorModel) -> DetectorModel:
    """From boxes that nothing was fitted to: FUSION_LOSS of the objects with a sure box lose it."""
    some = samples.of(samples.boxes.overlap >= OVERLAP_FOUND)
    verdicts = decide(detector.verdict, verdict_inputs(some, detector))[:, 0]
    best: dict[tuple[int, int], int] = {}
    for i, key in enumerate(zip(some.boxes.world.tolist(), some.boxes.object_row.tolist(), strict=True)):
        if verdicts[i] >= SURE and (key not in best or verdicts[i] > verdicts[best[key]]):
            best[key] = i
    kept = some.said[list(best.values()), 0]
    return replace(detector, fusion_threshold=float(np.quantile(kept, FUSION_LOSS)))
