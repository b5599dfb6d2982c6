"""The fitted map and path against what is known of them: beacons.csv, truth.csv.

Points are complex numbers: w = a z + b turns, scales and shifts; with the conjugate of z it also mirrors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.truth import truth_at
from bslam.log import Log
from bslam.logcheck.batch import DELAY, Problem, State
from bslam.logcheck.drive import Bools, Floats, Ints

Complex = NDArray[np.complex128]

_PAIRS: Final = 3000
_POINTS: Final = 200  # that a pair is tried on
_FEWEST: Final = 3
_NEAR: Final = 0.08  # of the usual distance from the middle: a point is where it is told
_FITTING: Final = 0.6  # share of points that must be about there
_CLEARER: Final = 0.05  # by which one hand must fit better than the other


@dataclass(frozen=True)
class Fitted:
    """How the estimate is brought onto a reference."""

    what: str  # "beacons.csv", "truth.csv"
    scale: float
    is_mirrored: bool
    names: NDArray[np.int64]  # of the points, if they are beacons
    estimate: Complex  # in the reference's frame
    reference: Complex
    near: float

    def exchanged(self) -> list[tuple[int, int]]:
        """Pairs of names of which each stands where the other is told."""
        if not len(self.names):
            return []
        is_off = np.abs(self.estimate - self.reference) > self.near
        crossed: Bools = np.abs(self.estimate[:, None] - self.reference) < self.near
        crossed = crossed & crossed.T & is_off[:, None] & is_off
        return [(int(self.names[a]), int(self.names[b])) for a, b in np.argwhere(np.triu(crossed, 1))]


def references(log: Log, problem: Problem, state: State) -> list[Fitted]:
    """The map on beacons.csv, the path on the truth: those that are there and fit in most places."""
    found = []
    if log.beacons is not None:
        names, ours, theirs = np.intersect1d(problem.drive.names, log.beacons.beacon_id, return_indices=True)
        reference = log.beacons.x_m[theirs] + 1j * log.beacons.y_m[theirs]
        found.append(_align("beacons.csv", names, _complex(state.marks[ours]), reference))
    if log.truth is not None:
        time_us = np.rint(1e6 * (problem.frame_s - state.parameters[DELAY])).astype(np.int64)
        poses, known = truth_at(log.truth, int(log.odometry.time_us[0]) + time_us)
        nameless = np.empty(0, dtype=np.int64)
        found.append(_align("truth.csv", nameless, _complex(state.poses[known]), _complex(poses[known])))
    return [one for one in found if one is not None]


def _complex(points: Floats) -> Complex:
    return np.asarray(points[:, 0] + 1j * points[:, 1])


def _align(what: str, names: NDArray[np.int64], estimate: Complex, reference: Complex) -> Fitted | None:
    """The similarity that most points agree on; None where they are too few, in a line, or do not agree."""
    if len(estimate) < _FEWEST or not np.ptp(reference) or not np.ptp(estimate):
        return None
    middle = np.median(reference.real) + 1j * np.median(reference.imag)
    near = _NEAR * float(np.median(np.abs(reference - middle)))
    found = []
    for z in (estimate, np.conj(estimate)):
        placed, scale = _placed(z, reference, near)
        found.append((float(np.minimum(np.abs(placed - reference) / near, 3.0).mean()), scale, placed))
    (plain, *_), (mirrored, *_) = found
    _, scale, placed = min(found, key=lambda one: one[0])
    if abs(plain - mirrored) < _CLEARER or np.mean(np.abs(placed - reference) < 3.0 * near) < _FITTING:
        return None
    return Fitted(what, scale, mirrored < plain, names, placed, reference, near)


def _placed(z: Complex, reference: Complex, near: float) -> tuple[Complex, float]:
    """z where most of it is near the reference, and the scale: by the best of many pairs, then by all."""
    i, j = _pairs(len(z))
    far = np.abs(z[i] - z[j]) > 0.3 * np.median(np.abs(z - np.mean(z)))
    a = (reference[i] - reference[j])[far] / (z[i] - z[j])[far]
    b = reference[i][far] - a * z[i][far]
    some = slice(None, None, 1 + len(z) // _POINTS)
    off = np.abs(a[:, None] * z[some] + b[:, None] - reference[some])
    best = int(np.argmin(np.minimum(off / near, 3.0).mean(axis=1)))
    turn, shift = complex(a[best]), complex(b[best])
    for _ in range(10):
        weight = 1.0 / (1.0 + (np.abs(turn * z + shift - reference) / near) ** 2)
        z_mean, mean = np.average(z, weights=weight), np.average(reference, weights=weight)
        p, q = z - z_mean, reference - mean
        turn = complex(np.sum(weight * np.conj(p) * q) / np.sum(weight * np.abs(p) ** 2))
        shift = complex(mean - turn * z_mean)
    return turn * z + shift, abs(turn)


def _pairs(count: int) -> tuple[Ints, Ints]:
    """Pairs of points: all, or a sample of them."""
    if count * (count - 1) // 2 <= _PAIRS:
        return np.triu_indices(count, 1)
    i, j = np.random.default_rng(0).integers(0, count, (2, _PAIRS))
    return i[i != j], j[i != j]
