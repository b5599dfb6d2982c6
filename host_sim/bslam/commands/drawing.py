"""Pictures of a run, drawn by the process that ran it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.align import Rigid
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
    """What the picture of the map shows, in the frame of the truth; without one, in that of the map.

    Path and beacons are brought there by one transform, that of the path, so that they stand as they do in
    the map: what the alignment leaves between a mapped beacon and the true one is seen.
    """
    to_truth = Rigid() if evaluation is None else evaluation.to_truth
    starred = set() if log.beacons is None else set(log.beacons.beacon_id.tolist())
    shown = Room(
        title=name,
        estimate_m=to_truth.points(trace.pose[:, :2]),
        mapped=[_mapped(one, to_truth, log, starred) for one in trace.beacons],
    )
    if evaluation is None:
        return shown
    title = name + _ALIGNED[evaluation.align]
    if log.truth is not None and log.beacons is not None and evaluation.align != "none":
        title += "\nbeacons go with the path; map cm of the table has them aligned by themselves"
    return replace(
        shown,
        title=title,
        truth_m=evaluation.truth[:, :2] if log.truth is not None else None,
        beacons=log.beacons,
        identity=log.identity,
        walls_m=walls_m,
    )


def _mapped(beacon: MapBeacon, to_truth: Rigid, log: Log, starred: set[int]) -> Mapped:
    """A beacon as it is drawn; named where no star has its name already."""
    x_m, y_m = to_truth.points(np.array([[beacon.x_m, beacon.y_m]]))[0]
    is_named = beacon.true_id >= 0 and beacon.true_id not in starred
    name = log.identity(beacon.true_id) if is_named else ""
    return Mapped(float(x_m), float(y_m), to_truth.covariance(beacon.covariance_m2), beacon.confirmed, name)
