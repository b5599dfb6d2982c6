"""Trains the beacon detectors on rendered worlds and writes firmware/models/beacons.h: `make train`.

For each kind of lens: render, take the front end's cells and fit the cell machine; take its proposals with
that and fit screen, kinds and fusion; then the first glance, and last the closer look and the verdict. All
thresholds are chosen on worlds left out. Rendered worlds are kept under
build/training, so an interrupted run goes on where it was. Nothing here looks at the style "test".
"""

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from bslam.cheader import write_header
from bslam.core.vision import BeaconModel, DetectorModel
from tools.training.built_in import built_in_detector
from tools.training.closer import choose_fusion_threshold, fit_close, fit_verdict, gather_close
from tools.training.detector_export import beacons_header
from tools.training.detector_fit import (
    choose_thresholds,
    fit_cells,
    fit_fusion,
    fit_glance,
    fit_kinds,
    fit_screen,
    normaliser,
    shares,
    summary,
)
from tools.training.detector_samples import CLASSES, blank_detector, gather_boxes, gather_cells
from tools.training.detector_score import look_at_worlds, score
from tools.training.render_set import FRAMES_A_WORLD, RIGS, render_set

ROOT = Path(__file__).resolve().parents[2]
HEADER = ROOT / "firmware" / "models" / "beacons.h"
VALIDATION_FROM = 5000
PRECISION = 0.95


@dataclass(frozen=True)
class Plan:
    """What a lens is trained on. The cell machine has few weights: few worlds and cells are enough for it."""

    worlds: int
    cells_step: int  # every so many worlds give cells,
    cells: int  # and so many are taken
    nothing_step: int  # of boxes of nothing one in so many is kept: a wide frame has thrice as many
    glance_worlds: int  # for the first glance, which has few weights as well
    # The shares of objects with a sure box that may lose it: at the first glance, at the screen, at the first
    # additive machine.
    losses: tuple[float, float, float]


PLANS = {
    "pinhole": Plan(3000, 12, 200_000, 1, 600, (0.006, 0.002, 0.002)),
    "wide": Plan(1800, 12, 80_000, 3, 120, (0.001, 0.001, 0.001)),
}


def train(
    folder: Path, lens: str, detector: DetectorModel, worlds: int, validation: int, processes: int
) -> tuple[DetectorModel, str]:
    """The detector for a kind of lens, and what it reaches on worlds left out."""
    detector = fit_boxes(folder, lens, detector, range(worlds), processes)
    return finish(folder, lens, detector, worlds, validation, processes)


def fit_boxes(
    folder: Path, lens: str, detector: DetectorModel, seeds: range, processes: int
) -> DetectorModel:
    """The machines that tell cells and boxes. Their samples, gigabytes, are gone when it returns."""
    plan, started = PLANS[lens], time.monotonic()
    render_set(folder, lens, "train", seeds, processes)
    cells = gather_cells(folder, lens, "train", seeds[:: plan.cells_step], processes)
    detector = replace(detector, cell=fit_cells(cells, plan.cells))
    boxes = gather_boxes(folder, lens, "train", seeds, detector, processes, plan.nothing_step)
    print(f"{lens}: {summary(boxes)}", flush=True)
    offset, scale = normaliser(boxes.features)
    detector = replace(detector, blob_offset=offset, blob_scale=scale)
    for fit in (fit_screen, fit_kinds, fit_fusion):
        detector = fit(boxes, detector)
        print(f"{lens}: {fit.__name__} done, {time.monotonic() - started:.0f} s", flush=True)
    return detector


def finish(
    folder: Path, lens: str, detector: DetectorModel, worlds: int, validation: int, processes: int
) -> tuple[DetectorModel, str]:
    """What depends on the other machines: the first glance, and thresholds; then the closer look."""
    plan, left_out = PLANS[lens], range(VALIDATION_FROM, VALIDATION_FROM + validation)
    some = range(min(worlds, plan.glance_worlds))
    for seeds in (some, left_out):
        render_set(folder, lens, "train", seeds, processes)
    boxes = gather_boxes(folder, lens, "train", some, detector, processes)
    detector = fit_glance(boxes, detector)
    boxes = gather_boxes(folder, lens, "train", left_out, detector, processes)
    detector = choose_thresholds(boxes, detector, plan.losses)
    print(f"{lens}: {shares(boxes, detector)}", flush=True)
    return look_closer(folder, lens, detector, worlds, validation, processes)


def look_closer(
    folder: Path, lens: str, detector: DetectorModel, worlds: int, validation: int, processes: int
) -> tuple[DetectorModel, str]:
    """What depends on all that, hence comes last: the closer look, the verdict, and their thresholds."""
    seeds, left_out = range(worlds), range(VALIDATION_FROM, VALIDATION_FROM + validation)
    for some in (seeds, left_out):
        render_set(folder, lens, "train", some, processes)
    boxes = gather_close(folder, lens, "train", seeds, detector, processes)
    print(f"{lens}, closer: {summary(boxes.boxes)}", flush=True)
    for fit in (fit_close, fit_verdict):
        detector = fit(boxes, detector)
    boxes = gather_close(folder, lens, "train", left_out, detector, processes)
    detector = choose_fusion_threshold(boxes, detector)
    looked_at = int((boxes.said[:, 0] >= detector.fusion_threshold).sum())
    print(f"{lens}: a closer look at {looked_at} of {len(boxes.said)} boxes", flush=True)
    seen = look_at_worlds(folder, lens, "train", left_out, detector, processes)
    result = score(seen, PRECISION)
    detector = replace(detector, threshold=result.threshold)
    return detector, (
        f"worlds 0 to {worlds - 1} of style train, {FRAMES_A_WORLD} frames each; recall {result.recall:.3f} "
        f"at precision {PRECISION} on worlds {left_out[0]} to {left_out[-1]}, which gave the threshold"
    )


STAGES = {"cells": train, "glance": finish, "closer": look_closer}
"""Where training may begin, each going on to the end."""


def note_of(header: Path, lens: str) -> str:
    """What a header says of a lens."""
    head = header.read_text(encoding="utf-8").split("#ifndef")[0].replace("\n//   ", " ")
    return next(
        line.removeprefix(f"// {lens}: ") for line in head.splitlines() if line.startswith(f"// {lens}:")
    )


def main() -> int:
    """Trains a detector for each kind of lens and writes the header."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lens", choices=tuple(RIGS), help="that one alone; the other stays as built in")
    parser.add_argument(
        "--from",
        dest="stage",
        choices=tuple(STAGES),
        default="cells",
        help="keep the machines that are built in before this stage (default: cells, the first)",
    )
    parser.add_argument("--worlds", type=int, help="to train on, a lens (default: as the model was made)")
    parser.add_argument("--validation", type=int, default=40, help="worlds left out (default: 40)")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "training", help="rendered worlds")
    parser.add_argument("--header", type=Path, default=HEADER, help="what to write")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    detectors, notes = {}, {}
    for lens in RIGS:
        if options.lens in (None, lens):
            worlds = options.worlds or PLANS[lens].worlds
            # BLAS shares the sums of a product out among the cores: another number of cores adds in another
            # order, and the fits would end in other bits.
            with threadpool_limits(1):
                where = options.folder, lens
                start = blank_detector() if options.stage == "cells" else built_in_detector(lens)
                made = STAGES[options.stage](*where, start, worlds, options.validation, options.processes)
                detectors[lens], notes[lens] = made
        else:
            detectors[lens], notes[lens] = built_in_detector(lens), note_of(HEADER, lens)
        print(f"{lens}: {notes[lens]}", flush=True)
    model = BeaconModel(CLASSES, detectors["pinhole"], detectors["wide"])
    write_header(options.header, beacons_header(model, notes))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
