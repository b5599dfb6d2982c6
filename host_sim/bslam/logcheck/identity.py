"""Labels that were exchanged: sightings that contradict their own beacon and fit another one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from bslam.log import wrap_rad
from bslam.logcheck.batch import YAW, Problem, State
from bslam.logcheck.drive import Bools, Floats, Ints

_FEWEST: Final = 6  # sightings
_FEWEST_ONE_WAY: Final = 20  # where the other beacon is never named for it
_SHARE: Final = 0.6  # of a beacon's sightings while it is exchanged
_FAR: Final = 6.0  # scatters from where its own beacon is
_NEAR: Final = 3.0  # from the other one
_BY_CHANCE: Final = 0.05  # share of a beacon's sightings that may be far


@dataclass(frozen=True)
class Exchange:
    """Sightings of the beacon `named` that show the beacon `shown`."""

    named: int
    shown: int
    hits: Ints  # rows of them
    inside: int  # sightings named so from the first of them to the last
    rows: Ints  # all sightings named so
    own_m: Floats  # how far each of these is from its own beacon
    other_m: Floats  # and from the other


def exchanges(problem: Problem, state: State) -> list[Exchange]:
    """Every beacon named for another over some while."""
    off_m, scatters = _distances(problem, state)
    label, names = problem.drive.seen.label, problem.drive.names
    nearest = np.argmin(scatters, axis=1)
    is_other = _is_far(label, scatters) & (scatters.min(axis=1) < _NEAR)
    found = []
    for a, b in np.unique(np.column_stack([label, nearest])[is_other], axis=0).tolist():
        rows, hits = np.flatnonzero(label == a), np.flatnonzero(is_other & (label == a) & (nearest == b))
        inside = int(np.sum((rows >= hits[0]) & (rows <= hits[-1])))
        if len(hits) >= max(_FEWEST, _SHARE * inside):
            names_ab = int(names[a]), int(names[b])
            found.append(Exchange(*names_ab, hits, inside, rows, off_m[rows, a], off_m[rows, b]))
    pairs = {(one.named, one.shown) for one in found}
    return [one for one in found if len(one.hits) >= _FEWEST_ONE_WAY or (one.shown, one.named) in pairs]


def contradictions(problem: Problem, state: State) -> bool:
    """Whether sightings of some beacon are not where it is, and not by chance."""
    label = problem.drive.seen.label
    far, of = np.bincount(label, _is_far(label, _distances(problem, state)[1])), np.bincount(label)
    return bool(np.any((far >= _FEWEST) & (far > _BY_CHANCE * of)))


def _is_far(label: Ints, scatters: Floats) -> Bools:
    return np.asarray(scatters[np.arange(len(label)), label] > _FAR)


def _distances(problem: Problem, state: State) -> tuple[Floats, Floats]:
    """Of each sighting from each beacon, (m, b): in metres, and in its scatter."""
    seen, pose = problem.drive.seen, state.poses[problem.frame]
    way = state.marks[None, :, :] - (pose[:, :2] + problem.mounts(pose)[0])[:, None, :]
    course_rad = seen.bearing_rad + state.parameters[YAW] + pose[:, 2]
    turned = wrap_rad(np.arctan2(way[:, :, 1], way[:, :, 0]) - course_rad[:, None])
    longer_m = np.hypot(way[:, :, 0], way[:, :, 1]) - seen.range_m[:, None]
    ends = seen.range_m[:, None] * np.column_stack([np.cos(course_rad), np.sin(course_rad)])
    sd = seen.sd * np.maximum(state.scale[:2], 0.5)
    return np.hypot(*(way - ends[:, None, :]).T).T, np.hypot(turned / sd[:, :1], longer_m / sd[:, 1:])
