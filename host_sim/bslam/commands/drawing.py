"""Pictures of a run, drawn by the process that ran it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.consistency import nees_band_95
from bslam.evaluation.metrics import WINDOW_S, Evaluation
from bslam.evaluation.trace import MapBeacon, Trace
from bslam.log import Log
from bslam.runs.output import write_atomically
from bslam.runs.sources import Source
from bslam.view.room import Mapped, Room, draw_room
from bslam.view.series import Series, draw_run
from bslam.view.style import png

_ALIGNED = {
    "none": "",
    "rigid": " (rigidly aligned with the truth)",
    "similarity": " (aligned with the truth, scale included)",
}


def draw(out: Path, name: str, source: Source, log: Log, trace: Trace, evaluation: Evaluation | None) -> None:
    """Write NAME.map.png and, if there is a truth, NAME.error.png."""
    write_atomically(
        out / f"{name}.map.png", png(draw_room(room(name, log, trace, evaluation, source.walls_m())))
    )
    path = out / f"{name}.error.png"
    path.unlink(missing_ok=True)
    if evaluation is not None and np.isfinite(evaluation.error_m).any():
        write_atomically(path, png(draw_run(series(name, evaluation))))


def series(name: str, evaluation: Evaluation) -> Series:
    """What the picture of error and NEES shows."""
    error_m, nees = evaluation.error_m[None], evaluation.nees[None]
    return Series(name, evaluation.time_s, error_m, nees, nees_band_95(1), WINDOW_S)


def room(
    name: str,
    log: Log,
    trace: Trace,
    evaluation: Evaluation | None,
    walls_m: NDArray[np.float64],
) -> Room:
    """What the picture of the map shows, in the frame of the truth; without one, in that of the map."""
    if evaluation is None:
        mapped = [Mapped(one.x_m, one.y_m, one.covariance_m2, one.confirmed) for one in trace.beacons]
        return Room(name, trace.pose[:, :2], mapped=mapped)
    return Room(
        title=name + _ALIGNED[evaluation.map_align],
        estimate_m=evaluation.estimate[:, :2],
        truth_m=evaluation.truth[:, :2] if log.truth is not None else None,
        beacons=log.beacons,
        identity=log.identity,
        mapped=[_in_truth(beacon, evaluation) for beacon in trace.beacons],
        walls_m=walls_m,
    )


def _in_truth(beacon: MapBeacon, evaluation: Evaluation) -> Mapped:
    """A beacon in the frame of the truth; if aligned without ellipse, which is relative to the start."""
    x_m, y_m = evaluation.map_to_truth.points(np.array([[beacon.x_m, beacon.y_m]]))[0]
    covariance_m2 = beacon.covariance_m2 if evaluation.map_align == "none" else None
    return Mapped(float(x_m), float(y_m), covariance_m2, beacon.confirmed)
