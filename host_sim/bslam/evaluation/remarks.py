"""What a user has to hear of a run beside its figures, in one line each."""

from __future__ import annotations

from typing import Final

import numpy as np

from bslam.evaluation.trace import Trace
from bslam.log import Log, has_identities
from bslam.options import RunOptions, core_params, presets_of

MOSTLY: Final = 0.5  # of the inputs: more refused or gated than that, and the run says nothing of the robot
_MANY: Final = 0.1
_LISTED: Final = 5
_FAR_M: Final = 100.0  # no camera or scanner of such a robot sees half of its beacons from farther
_ODOMETRY_NOISE: Final = (
    *("left_speed_sd_mps", "right_speed_sd_mps", "travel_sd_per_sqrt_m", "forward_sd_per_sqrt_m"),
    *("forward_sd_per_sqrt_s", "turn_sd_per_sqrt_m", "turn_sd_per_sqrt_rad", "turn_sd_per_sqrt_s"),
)


def notes_on(log: Log, trace: Trace, options: RunOptions) -> list[str]:
    """What was left out, refused or taken for granted."""
    notes = list(log.notes)
    if options.sensor == "recorded":
        notes += _of_odometry(log, options) + _of_identities(log, options) + _of_truth(log) + _of_beacons(log)
        notes += _of_ranges(log)
    refused = sum(trace.refusals.values())
    if refused:
        by_status = ", ".join(f"{name} {count}" for name, count in sorted(trace.refusals.items()))
        notes.append(f"{refused} of {_inputs(log)} inputs refused: {by_status}")
    counts = trace.counts
    if counts.rejected > _MANY * counts.sightings:
        notes.append(f"{counts.rejected} of {counts.sightings} sightings gated{_how_to_know(options)}")
    return notes


def problems_of(log: Log, trace: Trace, options: RunOptions) -> list[str]:
    """What makes a run worth nothing, whatever its figures are."""
    problems = []
    refused, inputs = sum(trace.refusals.values()), _inputs(log)
    counts = trace.counts
    unused = counts.rejected + counts.refused
    if refused > MOSTLY * inputs or unused > MOSTLY * counts.sightings:
        problems.append(
            f"most of the log was not used: {refused} of {inputs} inputs refused, {unused} of "
            f"{counts.sightings} sightings gated or in refused frames{_how_to_know(options)}"
        )
    without_room = trace.counters.get("map_full", 0)
    if without_room:
        problems.append(
            f"the map was full: {without_room} times there was no room for a beacon, and what is not in the "
            "map closes no loop"
        )
    return problems


def _how_to_know(options: RunOptions) -> str:
    return "; `bslam check` tells a log's slips" if options.sensor == "recorded" else ""


def _of_ranges(log: Log) -> list[str]:
    range_m = log.sightings.range_m[np.isfinite(log.sightings.range_m)]
    if len(range_m) == 0 or np.median(range_m) <= _FAR_M:
        return []
    return [f"half of the distances are above {_FAR_M:g} m: `bslam check` tells a log in millimetres"]


def _inputs(log: Log) -> int:
    """Readings and frames."""
    return len(log.odometry.time_us) + len(np.unique(log.sightings.time_us))


def _of_odometry(log: Log, options: RunOptions) -> list[str]:
    if not options.presets and "commanded" in presets_of(options, log):
        return [
            "speeds with wheel_speed_sigma_mps = 0 count as commands; for measured ones, give their noise"
        ]
    params = core_params(options, log)
    if not any(params[name] for name in _ODOMETRY_NOISE):
        return ["odometry counts as free of error; allowed in robot.toml: wheel_speed_sigma_mps above 0"]
    return []


def _of_identities(log: Log, options: RunOptions) -> list[str]:
    if len(log.sightings.time_us) == 0:
        return ["there is no sighting: nothing but odometry tells where the robot is"]
    nameless = int((log.sightings.beacon_id[log.sightings.mappable] < 0).sum())
    if nameless <= _MANY * len(log.sightings.time_us):
        return []
    if has_identities(log):
        unused = f"{nameless} of {len(log.sightings.time_us)} sightings have no identity, and are not used"
        return [f"{unused} by --association known"] if options.association == "known" else []
    if options.association == "known":
        return ["no sighting has an identity: --association mahalanobis, joint or nearest needs none"]
    return [f"no sighting has an identity: --association {options.association} tells whose each is"]


def _of_truth(log: Log) -> list[str]:
    if log.truth is None:
        return []
    drive_us, true_us = log.odometry.time_us[[0, -1]], log.truth.time_us[[0, -1]]
    if true_us[0] <= drive_us[1] and drive_us[0] <= true_us[1]:
        return []
    spans = [f"{one[0] * 1e-6:.3f} to {one[1] * 1e-6:.3f} s" for one in (true_us, drive_us)]
    return [f"the truth, {spans[0]}, is of another time than odometry, {spans[1]}"]


def _of_beacons(log: Log) -> list[str]:
    """Identities that are sighted and not in beacons.csv."""
    if log.beacons is None or not has_identities(log):
        return []
    sighted = np.unique(log.sightings.beacon_id[log.sightings.mappable & (log.sightings.beacon_id >= 0)])
    lacking = np.setdiff1d(sighted, log.beacons.beacon_id).tolist()
    if not lacking:
        return []
    listed = ", ".join(log.identity(one) for one in lacking[:_LISTED])
    more = ", ..." if len(lacking) > _LISTED else ""
    return [
        f"the true map lacks {len(lacking)} of {len(sighted)} beacons, which are not judged: {listed}{more}"
    ]
