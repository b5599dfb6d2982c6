"""A first path and map for the fit, by a plain EKF that is wary of labels.

A sighting that contradicts its own beacon, and fits another one, moves nothing: it is put aside as doubtful.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from bslam.logcheck.batch import YAW, Problem, State
from bslam.logcheck.drive import Bools, Floats

_SD_FACTOR: Final = 2.0  # told noise counts as larger, as much else may be wrong
_HUBER_D: Final = 2.5


def first_state(problem: Problem, parameters: Floats, far_d2: float) -> tuple[State, Bools]:
    """Path and map in the frame of the first pose, and which sightings (m,) are doubtful.

    far_d2: by how much more a doubtful sighting contradicts its own beacon than another one, as squared
    Mahalanobis distances.
    """
    filter_ = _Filter(problem, parameters)
    steps = problem.steps(parameters)
    bounds = np.searchsorted(problem.frame, np.arange(len(problem.frame_s) + 1)).tolist()
    for k in range(len(problem.frame_s)):
        if k:
            filter_.predict(steps[k - 1], problem.step_sd[k - 1] ** 2)
        rows = range(bounds[k], bounds[k + 1])
        filter_.doubt(rows, far_d2)
        for row in rows:
            filter_.take(row)
        filter_.poses[k] = filter_.x[:3]
    marks = filter_.x[3:].reshape(-1, 2)
    return State(filter_.poses, marks, parameters, np.array([2.0, 2.0, 1.0, 1.0])), filter_.doubtful


class _Filter:
    """State x: pose, beacons' places; a beacon not seen yet has no part in it."""

    def __init__(self, problem: Problem, parameters: Floats) -> None:
        seen, self.problem = problem.drive.seen, problem
        self.label = seen.label.tolist()
        self.measured = np.column_stack([seen.bearing_rad + parameters[YAW], seen.range_m])
        self.noise = (_SD_FACTOR * seen.sd) ** 2
        size = 3 + 2 * len(problem.drive.names)
        self.x, self.covariance = np.zeros(size), np.zeros((size, size))
        self.known = np.zeros(len(problem.drive.names), dtype=bool)
        self.poses = np.zeros((len(problem.frame_s), 3))
        self.doubtful = np.zeros(len(self.label), dtype=bool)

    def predict(self, step: Floats, variance: Floats) -> None:
        c, s = np.cos(self.x[2]), np.sin(self.x[2])
        forward, left = c * step[0] - s * step[1], s * step[0] + c * step[1]
        self.x[:3] += (forward, left, step[2])
        turned = np.array([[-left], [forward]])
        self.covariance[:2] += turned * self.covariance[2]
        self.covariance[:, :2] += (turned * self.covariance[:, 2]).T
        self.covariance[[0, 1, 2], [0, 1, 2]] += variance
        self.covariance = 0.5 * (self.covariance + self.covariance.T)

    def doubt(self, rows: Iterable[int], far_d2: float) -> None:
        for row in rows:
            label = self.label[row]
            if self.known[label]:
                innovation, spread, _ = self._seen(row, label)
                inverse = np.linalg.inv(spread)
                own = innovation @ inverse @ innovation
                if own > far_d2:
                    known = np.flatnonzero(self.known).tolist()
                    others = np.array([self._innovation(row, one)[0] for one in known])
                    best = np.einsum("ni,ij,nj->n", others, inverse, others).min()
                    self.doubtful[row] = own > far_d2 + best

    def take(self, row: int) -> None:
        label = self.label[row]
        if self.doubtful[row]:
            return
        if not self.known[label]:
            self._add(row, label)
            return
        innovation, spread, gain = self._seen(row, label)
        distance2 = float(innovation @ np.linalg.solve(spread, innovation))
        spread += (max(1.0, distance2 / _HUBER_D**2) - 1.0) * np.diag(self.noise[row])
        weighted = gain @ np.linalg.inv(spread)
        self.x += weighted @ innovation
        self.covariance -= weighted @ gain.T

    def _seen(self, row: int, label: int) -> tuple[Floats, Floats, Floats]:
        """Innovation, its covariance, and the covariance of all else with it."""
        innovation, jacobian = self._innovation(row, label)
        places = [0, 1, 2, 3 + 2 * label, 4 + 2 * label]
        gain = self.covariance[:, places] @ jacobian.T
        return innovation, jacobian @ gain[places] + np.diag(self.noise[row]), gain

    def _innovation(self, row: int, label: int) -> tuple[Floats, Floats]:
        """With its Jacobian by pose and beacon, (2, 5)."""
        offset, by_heading = (one[0] for one in self.problem.mounts(self.x[None, :3]))
        way = self.x[3 + 2 * label : 5 + 2 * label] - self.x[:2] - offset
        distance = np.hypot(*way) + 1e-9
        along, across = way / distance, np.array([-way[1], way[0]]) / distance**2
        bearing_rad, range_m = self.measured[row].tolist()
        turned = bearing_rad - np.arctan2(way[1], way[0]) + self.x[2]
        innovation = np.array([np.remainder(turned + np.pi, 2.0 * np.pi) - np.pi, range_m - distance])
        by_pose = [[*-across, -across @ by_heading - 1.0, *across], [*-along, -along @ by_heading, *along]]
        return innovation, np.array(by_pose)

    def _add(self, row: int, label: int) -> None:
        offset, by_heading = (one[0] for one in self.problem.mounts(self.x[None, :3]))
        bearing_rad, range_m = self.measured[row]
        along = np.array([np.cos(self.x[2] + bearing_rad), np.sin(self.x[2] + bearing_rad)])
        across = range_m * np.array([-along[1], along[0]])
        by_pose = np.column_stack([np.eye(2), by_heading + across])
        by_noise = np.column_stack([across, along])
        own, pose = slice(3 + 2 * label, 5 + 2 * label), self.covariance[:3, :3]
        self.x[own] = self.x[:2] + offset + range_m * along
        self.covariance[own] = by_pose @ self.covariance[:3]
        self.covariance[:, own] = self.covariance[own].T
        self.covariance[own, own] = by_pose @ pose @ by_pose.T + by_noise * self.noise[row] @ by_noise.T
        self.known[label] = True
