"""Files that a run leaves: summary.json, trajectories in TUM format, the map. Each whole or not at all."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.evaluation.metrics import Evaluation
from bslam.evaluation.trace import Trace
from bslam.maps.blob import SUFFIX

SCHEMA: Final = 1
_MAP_HEADER: Final = (
    "beacon,x_m,y_m,var_x_m2,cov_xy_m2,var_y_m2,range_m,phi_rad,sightings,confirmed,true_beacon"
)


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write a file so that a reader, or a power cut, sees the old content or the new. Raises BslamError."""
    data = content.encode() if isinstance(content, str) else content
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            Path(temporary).chmod(0o644)  # mkstemp makes it private
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise BslamError(
            f"{path}: cannot be written: {error}; allowed: a directory one may write to"
        ) from error


def write_summary(out: Path, runs: Sequence[dict[str, Any]], **more: Any) -> Path:
    """Write summary.json; the path of it."""
    path = out / "summary.json"
    write_json(path, {"schema": SCHEMA, "runs": list(runs), **more})
    return path


def write_json(path: Path, content: Any) -> None:
    """Write JSON in which every number is finite."""
    write_atomically(path, json.dumps(finite(content), indent=1, allow_nan=False) + "\n")


def finite(content: Any) -> Any:
    """The same content in plain Python types; a key or item that is no finite number is left out."""
    if isinstance(content, dict):
        return {str(key): finite(value) for key, value in content.items() if _is_sayable(value)}
    if isinstance(content, (list, tuple)):
        return [finite(value) for value in content if _is_sayable(value)]
    if isinstance(content, np.generic):
        return content.item()
    return content


def write_run(
    out: Path,
    name: str,
    trace: Trace,
    evaluation: Evaluation | None,
    start_map: Path | None = None,
    identity: Callable[[int], str] = str,
) -> None:
    """Write NAME.estimate.tum, NAME.truth.tum (if there is a truth), NAME.map.csv and the map itself: where
    none could be saved, none of an earlier run stays but `start_map`, which this one started in.

    The estimate stays in the map frame and the truth in its own: real logs are aligned by whoever compares
    them.
    """
    write_atomically(out / f"{name}.estimate.tum", tum(trace.time_us, trace.pose))
    known = np.zeros(1, dtype=np.bool_) if evaluation is None else np.isfinite(evaluation.truth[:, 0])
    if evaluation is None or not known.any():
        (out / f"{name}.truth.tum").unlink(missing_ok=True)
    else:
        write_atomically(out / f"{name}.truth.tum", tum(trace.time_us[known], evaluation.truth[known]))
    write_atomically(out / f"{name}.map.csv", map_csv(trace, identity))
    kept = out / f"{name}{SUFFIX}"
    if trace.kept_map is not None:
        write_atomically(kept, trace.kept_map)
    elif start_map is None or start_map.resolve() != kept.resolve():
        kept.unlink(missing_ok=True)


def tum(time_us: NDArray[np.int64], poses: NDArray[np.float64]) -> str:
    """TUM format: time_s x y z qx qy qz qw, one line a pose; (n,) and (n, 3). The format has no word for a
    heading that nobody knows: it stands as 0.
    """
    half = 0.5 * np.nan_to_num(poses[:, 2])
    columns = (
        time_us.tolist(),
        poses[:, 0].tolist(),
        poses[:, 1].tolist(),
        np.sin(half).tolist(),
        np.cos(half).tolist(),
    )
    return "".join(
        f"{t // 1_000_000}.{t % 1_000_000:06d} {x:.6f} {y:.6f} 0 0 0 {qz:.9f} {qw:.9f}\n"
        for t, x, y, qz, qw in zip(*columns, strict=True)
    )


def map_csv(trace: Trace, identity: Callable[[int], str] = str) -> str:
    """The final map, one beacon a line: by its label, or where it has none by its number in the map.

    `true_beacon` is what the harness knows: the identity of the sighting that made the beacon, empty for
    clutter. identity: a label as the log has it.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_MAP_HEADER.split(","))
    for beacon in trace.beacons:
        covariance = beacon.covariance_m2
        numbers = (beacon.x_m, beacon.y_m, covariance[0, 0], covariance[0, 1], covariance[1, 1])
        writer.writerow(
            [
                identity(beacon.label) if beacon.label >= 0 else beacon.uid,
                *(f"{float(number):.9g}" for number in (*numbers, beacon.range_m, beacon.phi_rad)),
                beacon.sightings,
                int(beacon.confirmed),
                identity(beacon.true_id) if beacon.true_id >= 0 else "",
            ]
        )
    return text.getvalue()


def _is_sayable(value: Any) -> bool:
    return not (isinstance(value, (float, np.floating)) and not math.isfinite(value)) and value is not None
