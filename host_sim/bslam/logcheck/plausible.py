"""What no log can mean, looked at before anything is fitted: a fit would blame something else."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from bslam.log import Log, wrap_rad
from bslam.logcheck.drive import Factors, Floats, Ints, drive_of
from bslam.logcheck.finding import Finding
from bslam.logcheck.flow import best_flow
from bslam.logcheck.units import is_gross

HELD_BACK: Final = "all else: mend this first, then check again"

_SHARE: Final = 0.05  # of frames or sightings that may be so in a good log
_PLACES_MIN: Final = 3  # that the count of a frame names
_JUMP: Final = 3.0  # times the usual change of a bearing, where the count changes
_STEPS_MIN: Final = 20  # of odometry or truth
_CLEARER: Final = 0.8  # of the spread that rows as told leave
_NARROW, _WIDE = 0.5, 0.9  # agreement of headings with the way: 1 is whole


def counted(log: Log) -> Iterator[Finding]:
    """Identities that are places in the frame, or come several times in one."""
    s = log.sightings
    named = np.flatnonzero((s.beacon_id >= 0) & s.mappable)
    if len(named) < _STEPS_MIN:
        return
    _, frame, count = np.unique(s.time_us[named], return_inverse=True, return_counts=True)
    ids = s.beacon_id[named]
    place = np.arange(len(ids)) - np.searchsorted(frame, frame)
    if len(np.unique(count)) < _PLACES_MIN or not np.array_equal(ids - ids.min(), place):
        return
    if _jumps(log, named, frame, count):
        what = f"beacon_id counts the sightings of each frame, from {int(ids.min())} to {int(ids.max())}"
        mend = "write which beacon it is; or leave beacon_id empty, with --association mahalanobis"
        sure = "no other order comes, and bearings jump where a frame has more or fewer"
        yield Finding("identities", what, sure, mend, {"most": int(ids.max())})


def _jumps(log: Log, named: Ints, frame: Ints, count: Ints) -> bool:
    """Whether bearings of one identity jump from frame to frame, where the number of sightings changes."""
    bearing, ids = log.sightings.bearing_rad[named], log.sightings.beacon_id[named]
    order = np.lexsort((frame, ids))
    i, j = order[:-1], order[1:]
    near = (ids[i] == ids[j]) & (frame[j] - frame[i] == 1)
    change = np.abs(wrap_rad(bearing[j] - bearing[i]))[near]
    is_other = (count[frame[i]] != count[frame[j]])[near]
    if not is_other.any() or is_other.all():
        return False
    return bool(np.mean(change[is_other]) > _JUMP * np.median(change[~is_other]))


def repeated(log: Log) -> Iterator[Finding]:
    """One identity several times in a frame, which can be seen but once."""
    s = log.sightings
    named = (s.beacon_id >= 0) & s.mappable
    pairs, count = np.unique(np.column_stack([s.time_us, s.beacon_id])[named], axis=0, return_counts=True)
    frames = len(np.unique(pairs[:, 0]))
    often = len(np.unique(pairs[count > 1, 0]))
    if often > _SHARE * frames:
        what = f"{often} of {frames} frames have one beacon_id several times"
        sure = f"{int(count.sum() - len(count))} of {int(count.sum())} sightings too many"
        mend = "keep one sighting of a beacon a frame; frames of several sensors need stamps of their own"
        yield Finding("identities", what, sure, mend, {"frames": often})


def outside_view(log: Log, factor: float) -> Iterator[Finding]:
    """Bearings that the sensor cannot have seen."""
    half_rad = 0.5 * log.robot.field_of_view_rad
    bearing = np.abs(wrap_rad(factor * log.sightings.bearing_rad))
    out = bearing > half_rad + 3.0 * log.robot.bearing_sigma_rad + 0.02
    if len(out) and out.mean() > _SHARE:
        most = float(np.quantile(bearing, 0.99))
        what = f"{int(out.sum())} of {len(out)} bearings are outside of field_of_view_rad"
        mend = f"field_of_view_rad = {min(2.0 * most, 6.28):.2f} in robot.toml: the whole angle, not half"
        sure = f"it goes to {half_rad:.2f} rad either way, and they to {most:.2f}"
        yield Finding("field of view", what, sure, mend, {"share": float(out.mean())})


def headings(x_m: Floats, y_m: Floats, theta_rad: Floats) -> Iterator[Finding]:
    """True headings in degrees, which go with the way only if they are brought to radians."""
    way = np.diff(x_m + 1j * y_m)
    known = np.isfinite(theta_rad[:-1]) & (np.abs(way) > 0.5 * np.median(np.abs(way)))
    theta, course = theta_rad[:-1][known], np.angle(way[known])
    if len(theta) < _STEPS_MIN or np.abs(theta).max() <= 2.0 * np.pi:
        return
    told, mended = (float(np.abs(np.mean(np.exp(2j * (f * theta - course))))) for f in (1.0, np.pi / 180.0))
    if told < _NARROW and mended > _WIDE:
        sure = f"headings agree to {told:.2f} with the way as told, to {mended:.2f} as degrees; 1 is whole"
        mend = "multiply theta_rad of truth.csv by 0.0174533"
        yield Finding("degrees", "truth.csv: theta_rad is in degrees", sure, mend, {"agree": mended})


def summed_up(log: Log, factors: Factors) -> Iterator[Finding]:
    """Wheel travel that counts from the start, and not from the row before."""
    o = log.odometry
    if o.kind != "wheels" or len(o.a) < _STEPS_MIN:
        return
    grown = max(float(np.abs(one).max() / (np.abs(np.diff(one)).mean() + 1e-12)) for one in (o.a, o.b))
    if grown < _STEPS_MIN:
        return
    travel = [np.diff(one, prepend=one[0]) for one in (o.a, o.b)]
    flows = [
        best_flow(drive_of(replace(log, odometry=one), factors))
        for one in (o, replace(o, a=travel[0], b=travel[1]))
    ]
    told, mended = flows
    if told is None or mended is None or not mended.spread < _CLEARER * told.spread:
        return
    if not is_gross(abs(told.way) or 1e-9):
        return
    what = "odometry.csv: left_m and right_m are sums since the start"
    share = mended.spread / told.spread
    sure = f"differences from row to row leave {share:.2f} of what they leave of the sightings' motion"
    mend = "write the travel since the row before; or counters as left_ticks and right_ticks"
    yield Finding("units", what, sure, mend, {"share": share})
