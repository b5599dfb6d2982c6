"""A kept map as JSON, to be read, mended or made by other programs. It comes back but for rounding."""

from __future__ import annotations

import base64
import json
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from bslam.errors import BslamError
from bslam.maps.blob import CLASSES, FEATURES, KINDS, VALUES_OF, KeptBeacon, KeptMachine, KeptMap, from_lower

FORMAT: Final = "bslam map"


def to_json(kept: KeptMap) -> str:
    """The text: beacons, state values with the lower triangle of their covariance row by row, machines."""
    rows = [kept.covariance[i, : i + 1].tolist() for i in range(len(kept.values))]
    machines = [
        {
            "trained": one.trained,
            "unit": one.unit,
            "weights": one.weights.tolist(),
            "samples": base64.b64encode(one.samples.tobytes()).decode(),
            "own_alpha": one.own_alpha.tolist(),
            "rivals": [list(rival) for rival in one.rivals],
        }
        for one in kept.machines
    ]
    content = {
        "format": FORMAT,
        "next_uid": kept.next_uid,
        "beacons": [asdict(one) for one in kept.beacons],
        "values": kept.values.tolist(),
        "covariance": rows,
        "machines": machines,
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def from_json(text: str) -> KeptMap:
    """The map. Raises BslamError with the key that is missing or wrong."""
    try:
        content = json.loads(text)
        if content["format"] != FORMAT:
            raise ValueError(f"format {content['format']!r}")
        beacons = tuple(_beacon(one) for one in content["beacons"])
        values = np.array(content["values"], dtype=np.float64)
        rows = content["covariance"]
        if [len(row) for row in rows] != list(range(1, len(values) + 1)):
            raise ValueError("covariance: row i has i numbers")
        if sum(VALUES_OF[one.kind] for one in beacons) != len(values):
            raise ValueError(
                "values: two of a point, three of a sized beacon, four of a ray, none of a known one"
            )
        lower = np.array([value for row in rows for value in row], dtype=np.float64)
        machines = tuple(_machine(one) for one in content["machines"])
        return KeptMap(beacons, values, from_lower(lower, len(values)), int(content["next_uid"]), machines)
    except KeyError as error:
        raise BslamError(f"map as JSON: no key {error}; allowed: what `bslam map export` writes") from error
    except (TypeError, ValueError) as error:
        raise BslamError(f"map as JSON: {error}; allowed: what `bslam map export` writes") from error


def _beacon(row: dict[str, Any]) -> KeptBeacon:
    if row["kind"] not in KINDS:
        raise ValueError(f"kind {row['kind']!r}: allowed: {', '.join(KINDS)}")
    if len(row["seen_as"]) != CLASSES:
        raise ValueError(f"seen_as: allowed: {CLASSES} counts")
    return KeptBeacon(**row | {"seen_as": tuple(row["seen_as"])})


def _machine(row: dict[str, Any]) -> KeptMachine:
    samples = np.frombuffer(base64.b64decode(row["samples"]), np.int8).reshape(-1, FEATURES)
    if len(row["weights"]) != FEATURES + 1 or len(row["own_alpha"]) != len(samples):
        raise ValueError(f"machine: allowed: {FEATURES + 1} weights, and a dual variable for each sample")
    return KeptMachine(
        bool(row["trained"]),
        float(row["unit"]),
        np.array(row["weights"], np.int16),
        samples,
        np.array(row["own_alpha"], np.uint16),
        tuple((int(owner), int(place), int(alpha)) for owner, place, alpha in row["rivals"]),
    )
