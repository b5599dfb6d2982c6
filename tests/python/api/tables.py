"""A short drive as tables, which tests change."""

from dataclasses import replace
from typing import Any

import bslam
from bslam import Log
from bslam.log import first_steps

_MADE = first_steps(bslam.simulate("paper_room", 3, noise="actuation", sigma_mps=0.1), 300)
DRIVE = replace(_MADE, sightings=replace(_MADE.sightings, signature=None), seeds=None)
ROBOT: dict[str, Any] = {
    "wheelbase_m": 0.4,
    "step_us": 40_000,
    "wheel_speed_sigma_mps": 0.1,
    "wheel_noise": "actuation",
    "field_of_view_rad": 3.1416,
    "bearing_sigma_rad": 0.014,
    "range_sigma_fraction": 0.02,
    "range_sigma_scale_m": 110.9,
}


def columns(log: Log = DRIVE) -> dict[str, dict[str, list[Any]]]:
    """By table and column the values, as plain lists."""
    assert log.truth is not None and log.beacons is not None
    moved, seen = log.odometry, log.sightings
    return {
        "odometry": {
            "time_us": moved.time_us.tolist(),
            "left_m": moved.a.tolist(),
            "right_m": moved.b.tolist(),
        },
        "sightings": {
            name: getattr(seen, name).tolist() for name in ("time_us", "beacon_id", "bearing_rad", "range_m")
        },
        "truth": {name: one.tolist() for name, one in vars(log.truth).items()},
        "beacons": {name: one.tolist() for name, one in vars(log.beacons).items()},
    }
