"""What a robot switched on in a kept map could know at best five seconds after two beacons are in view.

The reference for `tools/measure_restart.py`, on the same drives and restarts: the exact MAP as in
`tools/bound_drive.py`, from power-on to then. It is told what no robot knows: the pose that it is switched
on at, where each beacon truly stands, which one each sighting shows, and it sets out from the true way. "the
best of the three" takes that way to believe the sightings which comes nearest the truth at each restart.

    .venv/bin/python tools/bound_restart.py --seeds 1000:1020
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bound_drive import KNOWN_SD_M, WAYS, best_errors_m
from bslam.core.slam import Slam
from bslam.experiment.camera import CameraStore, camera_log
from bslam.experiment.options import RunOptions, core_params
from bslam.log import Log
from bslam.rig import load_rig
from bslam.world.simulate import load_scenario
from camera_drives import arguments
from measure_restart import DRIVEN_US, NEAR_M, SWITCHED_ON_AT, in_view_us, part


def restarts(log: Log) -> Iterator[Log]:
    """What is driven from each power-on until five seconds after two beacons were in view."""
    assert log.beacons is not None
    for first in SWITCHED_ON_AT:
        rest = part(log, first, None)
        times_us = rest.odometry.time_us
        view_us = in_view_us(rest.sightings, log.beacons.beacon_id.tolist(), int(times_us[0]))
        until_us = times_us[-1] if view_us is None else view_us + DRIVEN_US
        yield part(rest, 0, int(np.searchsorted(times_us, until_us, "right")))


def main() -> int:
    """Measures and prints."""
    args = arguments(__doc__, range(1000, 1020))
    scenario, rig, store = load_scenario(args.scenario), load_rig(args.rig), CameraStore(args.store)
    options = RunOptions(association="known", sigma_mps=args.sigma)
    errors_m: list[list[float]] = []
    for count, seed in enumerate(args.seeds, 1):
        log = camera_log(scenario, seed, args.sigma, None, rig, store)
        params = Slam.defaults() | core_params(options, log)
        errors_m += [
            [float(best_errors_m(one, params, way, KNOWN_SD_M)[-1]) for way in WAYS.values()]
            for one in restarts(log)
        ]
        print(f"{count} of {len(args.seeds)} drives", flush=True)
    table_m = np.array(errors_m)
    table_m = np.column_stack([table_m, table_m.min(axis=1)])
    seeds = f"seeds {args.seeds.start}:{args.seeds.stop}"
    print(f"{args.scenario}, {rig.name}, {seeds}, sigma {args.sigma}; told pose, map and identities")
    for name, column in zip((*WAYS, "the best of the three"), table_m.T, strict=True):
        near = int((column <= NEAR_M).sum())
        print(f"{name}: {near} of {len(column)} within {NEAR_M} m, median {100 * np.median(column):.1f} cm")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
