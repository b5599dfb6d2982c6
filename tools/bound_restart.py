"""What a robot switched on in a kept map could know at best five seconds after two beacons are in view.

The reference for `tools/measure_restart.py`, on the same drives and restarts, by code that shares nothing
with the core: the exact MAP (bslam.algorithms.smoother) of all that the wheels and the pictures say from
power-on to then. It is told what no robot knows: the pose that it is switched on at, where each beacon truly
stands, which one each sighting shows, and it sets out from the true way. What errs then is what the pictures
say.

They do not say how their errors hang together, so the sightings are believed in three ways: as they are told,
directions alone, and all with three times the standard deviation. "the best of three" takes that which comes
nearest the truth at each restart, which nobody could choose.

    .venv/bin/python tools/bound_restart.py --seeds 1000:1020
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bslam.algorithms.noise import range_sd_m
from bslam.algorithms.smoother import Smoother
from bslam.core.slam import Slam
from bslam.experiment.align import Rigid
from bslam.experiment.camera import CameraStore, camera_log
from bslam.experiment.options import Number, RunOptions, core_params
from bslam.experiment.truth import truth_at
from bslam.log import Log, Sightings
from bslam.rig import load_rig
from bslam.world.simulate import load_scenario
from camera_drives import arguments
from measure_restart import DRIVEN_US, NEAR_M, SWITCHED_ON_AT, in_view_us, part

WAYS = {"as told": (1.0, True), "directions alone": (1.0, False), "a third as good": (3.0, True)}
"""How sightings are believed: their standard deviations times this, with distances or without."""


def best_error_m(log: Log, params: dict[str, Number], way: tuple[float, bool]) -> float:
    """How far off the MAP of this part of a drive is at its end, m."""
    assert log.truth is not None
    true = truth_at(log.truth, log.odometry.time_us)[0]
    from_start = Rigid(*true[0, [2, 0, 1]].tolist()).inverse()
    poses = from_start.poses(true)
    poses[:, 2] = np.unwrap(poses[:, 2])
    smoother = Smoother(params)
    _add_steps(smoother, log, poses)
    _add_sightings(smoother, log, params, from_start, way)
    smoother.set_out_from(poses)
    smoother.solve()
    return float(np.hypot(*(smoother.poses[-1, :2] - poses[-1, :2])))


def _add_steps(smoother: Smoother, log: Log, poses: NDArray[np.float64]) -> None:
    odometry = log.odometry
    gaps_s = np.diff(odometry.time_us) * 1e-6
    rows = zip(gaps_s, odometry.a[1:], odometry.b[1:], poses[1:], strict=True)
    for dt_s, left_m, right_m, pose in rows:
        x_m, y_m, theta_rad = pose.tolist()
        smoother.add_step(dt_s, left_m, right_m, (x_m, y_m, theta_rad))


def _add_sightings(
    smoother: Smoother, log: Log, params: dict[str, Number], from_start: Rigid, way: tuple[float, bool]
) -> None:
    assert log.beacons is not None
    times_us, (factor, has_range) = log.odometry.time_us, way
    places_m = from_start.points(np.column_stack([log.beacons.x_m, log.beacons.y_m])).tolist()
    ids = log.beacons.beacon_id.tolist()
    number = {one: smoother.add_known_beacon(*place) for one, place in zip(ids, places_m, strict=True)}
    for row, seen in enumerate(log.sightings.beacon_id.tolist()):
        if seen in number:
            step = int(np.argmin(np.abs(times_us - log.sightings.time_us[row])))
            bearing_rad, range_m, *sds = _told(log.sightings, row, params)
            smoother.add_sighting(
                step,
                number[seen],
                bearing_rad,
                range_m if has_range else math.nan,
                *(factor * sd for sd in sds),
            )


def _told(seen: Sightings, row: int, params: dict[str, Number]) -> tuple[float, float, float, float]:
    """Direction, distance, and their standard deviations: the sighting's own, or by the parameters."""
    range_m, sd_rad, sd_m = float(seen.range_m[row]), float(params["bearing_sd_rad"]), math.nan
    if seen.bearing_sd_rad is not None and seen.bearing_sd_rad[row] > 0:
        sd_rad = float(seen.bearing_sd_rad[row])
    if not math.isnan(range_m):
        own_m = 0.0 if seen.range_sd_m is None else float(seen.range_sd_m[row])
        scale = 0.0 if seen.range_scale_sd is None else float(seen.range_scale_sd[row])
        sd_m = math.hypot(own_m, scale * range_m) if own_m > 0 else float(range_sd_m(params, range_m))
    return float(seen.bearing_rad[row]), range_m, sd_rad, sd_m


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
    options = RunOptions(association="known", sigma_mps=args.sigma, recovery=True)
    errors: list[list[float]] = []
    for count, seed in enumerate(args.seeds, 1):
        log = camera_log(scenario, seed, args.sigma, None, rig, store)
        params = Slam.defaults() | core_params(options, log)
        errors += [[best_error_m(one, params, way) for way in WAYS.values()] for one in restarts(log)]
        print(f"{count} of {len(args.seeds)} drives", flush=True)
    table = np.array(errors)
    table = np.column_stack([table, table.min(axis=1)])
    seeds = f"seeds {args.seeds.start}:{args.seeds.stop}"
    print(f"{args.scenario}, {rig.name}, {seeds}, sigma {args.sigma}; told pose, map and identities")
    for name, column in zip((*WAYS, "the best of three"), table.T, strict=True):
        near = int((column <= NEAR_M).sum())
        print(f"{name}: {near} of {len(column)} within {NEAR_M} m, median {100 * np.median(column):.1f} cm")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
