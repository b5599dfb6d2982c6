"""The whole drive at once: the poses and beacons that fit all readings best, by Gauss and Newton.

Every pose is an unknown, and so is every beacon; the first pose is the origin. Minimised are the squares of
  odometry     (way, turn) between two poses against the reading, a gyro's among it, MATH (5), (6)
  arc          what is left of the move beside that arc: 0, to a hundredth of a millimetre
  speeds       (v, omega) of a step against that of the step before, MATH (15), with velocity states
  sightings    direction and distance, MATH (11), (13); the sd of a distance is that of the predicted one
  beacon       seen in direction only: 4 m along its first direction, +- 2.5 m
Poses couple with their neighbours only: their normal equations are a band, beacons its dense border.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded, solve

from bslam.algorithms.noise import measured_motion, range_sd_m

Array = NDArray[np.float64]
Numbers = NDArray[np.intp]

_ARC_SD_M: Final = 1e-5
_SPEED_VARIANCE_MIN: Final = 1e-12  # (m/s)², (rad/s)²: speeds without a walk would weigh infinitely
_FIRST_RANGE_M: Final = 4.0
_FIRST_RANGE_SD_M: Final = 2.5
_ITERATIONS_MAX: Final = 500  # Gauss-Newton is slow where a map of another size fits nearly as well
_SETTLED: Final = 1e-7  # m, rad: the largest change of an iteration that changes nothing
_SETTLED_COST: Final = 1e-10  # nor does one that lessens the cost by so small a share
_SHORTEST: Final = 1e-6  # share of a step that is still tried
_POSE: Final = 3  # unknowns of a pose
_BEACON: Final = 2


class Smoother:
    """Takes in odometry and sightings one by one; `solve` moves all poses and beacons to where they fit best.

    parameters: values of the core's parameters by name, which are the model.
    """

    def __init__(self, parameters: Mapping[str, int | float]) -> None:
        self._p = parameters
        # dt_s, left_m, right_m, gyro_radps, gyro_sd_radps
        self._steps: list[tuple[float, float, float, float, float]] = []
        self._seen: list[tuple[int, int, float, float]] = []  # pose, beacon, bearing_rad, range_m
        self._priors: list[tuple[int, float, float]] = []  # beacon, x_m, y_m
        self._new_poses: list[tuple[float, float, float]] = []
        self._new_beacons: list[tuple[float, float]] = []
        self._poses: Array = np.zeros((1, _POSE))
        self._beacons: Array = np.zeros((0, _BEACON))

    @property
    def steps(self) -> int:
        """Odometry readings so far."""
        return len(self._steps)

    @property
    def poses(self) -> Array:
        """(steps + 1, 3) x_m, y_m, theta_rad; since the last `solve` by odometry."""
        if self._new_poses:
            self._poses = np.concatenate([self._poses, self._new_poses])
            self._new_poses = []
        return self._poses

    @property
    def last_pose(self) -> tuple[float, float, float]:
        """The newest of `poses`."""
        x_m, y_m, theta_rad = self._new_poses[-1] if self._new_poses else self._poses[-1].tolist()
        return x_m, y_m, theta_rad

    @property
    def beacons(self) -> Array:
        """(beacons, 2) x_m, y_m in the order in which they were first seen."""
        if self._new_beacons:
            self._beacons = np.concatenate([self._beacons, self._new_beacons])
            self._new_beacons = []
        return self._beacons

    def add_step(
        self,
        dt_s: float,
        left_m: float,
        right_m: float,
        pose: tuple[float, float, float],
        gyro_radps: float = math.nan,
        gyro_sd_radps: float = math.nan,
    ) -> None:
        """A reading of odometry, and the pose that it leads to from the last one. NaN: no gyro."""
        self._steps.append((dt_s, left_m, right_m, gyro_radps, gyro_sd_radps))
        self._new_poses.append(pose)

    def add_sighting(self, pose: int, beacon: int, bearing_rad: float, range_m: float) -> None:
        """A sighting from the pose of that number; NaN: no distance. A new beacon has the next number."""
        self._seen.append((pose, beacon, bearing_rad, range_m))
        if beacon < len(self._beacons) + len(self._new_beacons):
            return
        guess_m = _FIRST_RANGE_M if np.isnan(range_m) else range_m
        x_m, y_m, theta_rad = self.poses[pose].tolist()
        heading_rad = theta_rad + self._p["mount_yaw_rad"] + bearing_rad
        eye_x_m, eye_y_m = self._mount(np.array([theta_rad]))[0].tolist()
        place = (
            x_m + eye_x_m + guess_m * float(np.cos(heading_rad)),
            y_m + eye_y_m + guess_m * float(np.sin(heading_rad)),
        )
        if np.isnan(range_m):
            self._priors.append((beacon, *place))
        self._new_beacons.append(place)

    def solve(self) -> int:
        """Iterate until nothing changes; the number of iterations. ArithmeticError if that never is."""
        problem = self._problem()
        poses, beacons = self.poses, self.beacons
        for iteration in range(1, _ITERATIONS_MAX + 1):
            weights = problem.weights(poses, beacons)
            cost, normal = problem.linearise(poses, beacons, weights)
            trial = problem.lower(poses, beacons, *normal.solve(), weights, cost)
            largest = max(np.abs(trial[0] - poses).max(), np.abs(trial[1] - beacons).max(initial=0.0))
            poses, beacons = trial
            if largest < _SETTLED or cost - problem.cost(*trial, weights) < _SETTLED_COST * cost:
                self._poses, self._beacons = poses, beacons
                return iteration
        raise ArithmeticError(f"{self.steps} poses have not settled in {_ITERATIONS_MAX} iterations")

    def _problem(self) -> _Problem:
        return _Problem(self._p, self._steps, self._seen, self._priors)

    def _mount(self, theta_rad: Array) -> Array:
        return _mount(self._p, theta_rad)[0]


class _Normal:
    """Normal equations H d = -g: a band for the poses, a dense border for the beacons."""

    def __init__(self, poses: int, beacons: int, half_band: int) -> None:
        self.band = np.zeros((half_band + 1, _POSE * poses))  # lower diagonals, as scipy has them
        self.border = np.zeros((poses, _POSE, beacons, _BEACON))
        self.corner = np.zeros((beacons, _BEACON, beacons, _BEACON))
        self.pose_gradient = np.zeros((poses, _POSE))
        self.beacon_gradient = np.zeros((beacons, _BEACON))

    def add_chain(self, jacobian: Array, residual: Array, first: int = 0) -> None:
        """Residuals (k, rows) of runs of poses; jacobian (k, rows, columns), run k from pose first + k on."""
        count, _, columns = jacobian.shape
        hessian = np.einsum("kri,krj->kij", jacobian, jacobian)
        gradient = np.einsum("kri,kr->ki", jacobian, residual)
        for column in range(columns):
            at = slice(_POSE * first + column, _POSE * (first + count - 1) + column + 1, _POSE)
            for row in range(column, columns):
                self.band[row - column, at] += hessian[:, row, column]
            self.pose_gradient.reshape(-1)[at] += gradient[:, column]

    def solve(self) -> tuple[Array, Array]:
        """Changes (poses, 3) and (beacons, 2); the first pose stays."""
        change, solved, corner, beacon_gradient = self._eliminate()
        beacon_change = np.zeros(len(corner))
        if len(corner):
            beacon_change = -solve(corner, beacon_gradient, assume_a="pos", check_finite=False)
            change[_POSE:] -= solved @ beacon_change
        return change.reshape(-1, _POSE), beacon_change.reshape(-1, _BEACON)

    def _eliminate(self) -> tuple[Array, Array, Array, Array]:
        """Without the poses: their change if beacons stay, what they change by beacons; what is left."""
        band = self.band[:, _POSE:]
        unknowns, beacons = band.shape[1], _BEACON * len(self.corner)
        border = self.border.reshape(-1, beacons)[_POSE:]
        corner = self.corner.reshape(beacons, beacons)
        pose_gradient = self.pose_gradient.reshape(-1)[_POSE:]
        beacon_gradient = self.beacon_gradient.reshape(-1)
        change, solved = np.zeros(_POSE + unknowns), np.zeros((unknowns, beacons))
        if unknowns:
            factor = cholesky_banded(band, lower=True, check_finite=False)
            right = np.column_stack([pose_gradient, border])
            both = cho_solve_banded((factor, True), right, overwrite_b=True, check_finite=False)
            change[_POSE:], solved = -both[:, 0], both[:, 1:]
            corner = corner - border.T @ solved
            beacon_gradient = beacon_gradient - border.T @ both[:, 0]
        return change, solved, corner, beacon_gradient


class _Problem:
    """The residuals and their derivatives, all of a kind at once."""

    def __init__(
        self,
        parameters: Mapping[str, int | float],
        steps: list[tuple[float, float, float, float, float]],
        seen: list[tuple[int, int, float, float]],
        priors: list[tuple[int, float, float]],
    ) -> None:
        self._p = parameters
        self._dt_s, *told = np.array(steps, dtype=np.float64).reshape(-1, 5).T
        self._measured, covariance = measured_motion(parameters, self._dt_s, *told)
        self._odometry_weight = np.linalg.inv(np.linalg.cholesky(covariance))
        self._with_speeds = bool(parameters["velocity_states"]) and len(steps) > 0
        if self._with_speeds:
            self._keep, self._speed_weight = _speed_model(parameters, self._dt_s)
        table = np.array(seen, dtype=np.float64).reshape(-1, 4)
        self._pose_of, self._beacon_of = table[:, 0].astype(np.intp), table[:, 1].astype(np.intp)
        self._bearing_rad, self._range_m = table[:, 2], table[:, 3]
        self._has_range = np.isfinite(self._range_m)
        self._range_m = np.where(self._has_range, self._range_m, 0.0)
        prior = np.array(priors, dtype=np.float64).reshape(-1, 3)
        self._prior_of, self._prior_m = prior[:, 0].astype(np.intp), prior[:, 1:]

    def weights(self, poses: Array, beacons: Array) -> Array:
        """1 / sd of (bearing, range) of each sighting, (m, 2), with the predicted distances; no range: 0."""
        sd_m = range_sd_m(self._p, self._look(poses, beacons)[0][:, 1])
        by_bearing = np.full(len(sd_m), 1.0 / self._p["bearing_sd_rad"])
        return np.column_stack([by_bearing, np.where(self._has_range, 1.0 / sd_m, 0.0)])

    def cost(self, poses: Array, beacons: Array, weights: Array) -> float:
        """Half the sum of squares."""
        parts = [self._moves(poses)[1], self._sight_residuals(poses, beacons, weights)]
        parts += [self._prior_residuals(beacons)]
        if self._with_speeds:
            parts += [residual for _, residual in self._speeds(*self._twists(poses))]
        return 0.5 * float(sum(np.sum(part**2) for part in parts))

    def linearise(self, poses: Array, beacons: Array, weights: Array) -> tuple[float, _Normal]:
        """The cost, and the normal equations about these values."""
        normal = _Normal(len(poses), len(beacons), 8 if self._with_speeds else 5)
        if len(poses) > 1:
            normal.add_chain(*self._moves(poses))
        if self._with_speeds:
            first, later = self._speeds(*self._twists(poses))
            normal.add_chain(*first)
            normal.add_chain(*later)
        self._add_sightings(normal, poses, beacons, weights)
        self._add_priors(normal, beacons)
        return self.cost(poses, beacons, weights), normal

    def lower(
        self,
        poses: Array,
        beacons: Array,
        pose_change: Array,
        beacon_change: Array,
        weights: Array,
        cost: float,
    ) -> tuple[Array, Array]:
        """Poses and beacons after the change, or so much of it that the cost does not rise."""
        share = 1.0
        while share > _SHORTEST:
            trial = self.moved(poses, share * pose_change), beacons + share * beacon_change
            if self.cost(*trial, weights) <= cost * (1.0 + 1e-12) + 1e-12:
                return trial
            share *= 0.5
        raise ArithmeticError(f"no part of a step lessens the cost {cost:g} of {len(poses)} poses")

    def moved(self, poses: Array, change: Array) -> Array:
        """The poses (n + 1, 3) after a change, led along exact arcs again.

        A straight change leaves the arcs by its square, which their weight would forbid but for tiny steps.
        """
        twist, jacobian = self._twists(poses)
        both = np.concatenate([change[:-1], change[1:]], axis=1)
        twist = twist + np.einsum("nij,nj->ni", jacobian, both)
        theta = np.concatenate([[0.0], np.cumsum(twist[:, 2])])
        course, chord = theta[:-1] + 0.5 * twist[:, 2], twist[:, 0] * np.sinc(twist[:, 2] / (2.0 * np.pi))
        places = np.cumsum(chord[:, None] * np.column_stack([np.cos(course), np.sin(course)]), axis=0)
        return np.column_stack([np.concatenate([np.zeros((1, 2)), places]), theta])

    def _twists(self, poses: Array) -> tuple[Array, Array]:
        """Way, sideways, turn (n, 3) of the arc from each pose to the next, and by both poses, (n, 3, 6).

        (way, sideways) = V(turn)^-1 R(theta)^T (p' - p): the logarithm of the move.
        """
        moved = np.diff(poses, axis=0)
        c, s = np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])
        ahead, left = c * moved[:, 0] + s * moved[:, 1], c * moved[:, 1] - s * moved[:, 0]
        turn = np.remainder(moved[:, 2] + np.pi, 2.0 * np.pi) - np.pi
        g, slope = _half_cotangent(turn)
        half = 0.5 * turn
        twist = np.column_stack([g * ahead + half * left, g * left - half * ahead, turn])
        by_place = np.empty((len(turn), 2, 2))  # of (way, sideways) by (x', y')
        by_place[:, 0, 0], by_place[:, 0, 1] = g * c - half * s, g * s + half * c
        by_place[:, 1, 0], by_place[:, 1, 1] = -half * c - g * s, g * c - half * s
        by_turn = np.column_stack([slope * ahead + 0.5 * left, slope * left - 0.5 * ahead])
        by_first_heading = np.column_stack([g * left - half * ahead, -g * ahead - half * left])
        jacobian = np.zeros((len(turn), 3, 2 * _POSE))
        jacobian[:, :2, 0:2], jacobian[:, :2, 3:5] = -by_place, by_place
        jacobian[:, :2, 2], jacobian[:, :2, 5] = by_first_heading - by_turn, by_turn
        jacobian[:, 2, 2], jacobian[:, 2, 5] = -1.0, 1.0
        return twist, jacobian

    def _moves(self, poses: Array) -> tuple[Array, Array]:
        """Odometry and arc: jacobian (n, 3, 6), residual (n, 3)."""
        twist, jacobian = self._twists(poses)
        error = np.column_stack([twist[:, 0] - self._measured[:, 0], twist[:, 2] - self._measured[:, 1]])
        weight = self._odometry_weight
        residual = np.column_stack([np.einsum("nij,nj->ni", weight, error), twist[:, 1] / _ARC_SD_M])
        rows = np.concatenate(
            [np.einsum("nij,njk->nik", weight, jacobian[:, [0, 2]]), jacobian[:, 1:2] / _ARC_SD_M], axis=1
        )
        return rows, residual

    def _speeds(self, twist: Array, jacobian: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """v and omega against those of the step before, the first against rest: (jacobian, residual) each."""
        speed = twist[:, [0, 2]] / self._dt_s[:, None]
        by_poses = jacobian[:, [0, 2]] / self._dt_s[:, None, None]
        weight, keep = self._speed_weight, self._keep
        first = by_poses[:1] * weight[:1, :, None], speed[:1] * weight[:1]
        residual = (speed[1:] - keep[1:] * speed[:-1]) * weight[1:]
        rows = np.zeros((len(residual), 2, 3 * _POSE))
        rows[:, :, : 2 * _POSE] -= keep[1:, :, None] * by_poses[:-1]
        rows[:, :, _POSE:] += by_poses[1:]
        return first, (rows * weight[1:, :, None], residual)

    def _look(self, poses: Array, beacons: Array) -> tuple[Array, Array, Array]:
        """Predicted (bearing, range) (m, 2), and by the pose (m, 2, 3) and the beacon (m, 2, 2)."""
        at = poses[self._pose_of]
        eye, eye_turned = _mount(self._p, at[:, 2])
        ray = beacons[self._beacon_of] - at[:, :2] - eye
        squared = np.maximum(np.sum(ray**2, axis=1), 1e-12)
        range_m = np.sqrt(squared)
        bearing = np.arctan2(ray[:, 1], ray[:, 0]) - at[:, 2] - self._p["mount_yaw_rad"]
        by_beacon = np.empty((len(ray), 2, 2))
        by_beacon[:, 0] = np.column_stack([-ray[:, 1], ray[:, 0]]) / squared[:, None]
        by_beacon[:, 1] = ray / range_m[:, None]
        by_pose = np.empty((len(ray), 2, _POSE))
        by_pose[:, :, :2] = -by_beacon
        by_pose[:, :, 2] = -np.einsum("mij,mj->mi", by_beacon, eye_turned)
        by_pose[:, 0, 2] -= 1.0
        return np.column_stack([bearing, range_m]), by_pose, by_beacon

    def _sight_residuals(self, poses: Array, beacons: Array, weights: Array) -> Array:
        return self._sight_error(self._look(poses, beacons)[0]) * weights

    def _sight_error(self, predicted: Array) -> Array:
        bearing = np.remainder(predicted[:, 0] - self._bearing_rad + np.pi, 2.0 * np.pi) - np.pi
        return np.column_stack([bearing, predicted[:, 1] - self._range_m])

    def _add_sightings(self, normal: _Normal, poses: Array, beacons: Array, weights: Array) -> None:
        predicted, by_pose, by_beacon = self._look(poses, beacons)
        residual = self._sight_error(predicted) * weights
        by_pose, by_beacon = by_pose * weights[:, :, None], by_beacon * weights[:, :, None]
        _add_views(normal, self._pose_of, self._beacon_of, residual, by_pose, by_beacon)

    def _prior_residuals(self, beacons: Array) -> Array:
        return (beacons[self._prior_of] - self._prior_m) / _FIRST_RANGE_SD_M

    def _add_priors(self, normal: _Normal, beacons: Array) -> None:
        of, weight = self._prior_of, 1.0 / _FIRST_RANGE_SD_M
        for axis in range(_BEACON):
            normal.corner[of, axis, of, axis] += weight**2
        normal.beacon_gradient[of] += weight * self._prior_residuals(beacons)


def _add_views(
    normal: _Normal, pose_of: Numbers, beacon_of: Numbers, residual: Array, by_pose: Array, by_beacon: Array
) -> None:
    """Residuals (m, rows), each of a pose and a beacon, with derivatives (m, rows, 3) and (m, rows, 2)."""
    own = np.zeros((len(normal.pose_gradient), _POSE, _POSE))
    np.add.at(own, pose_of, np.einsum("mri,mrj->mij", by_pose, by_pose))
    for column in range(_POSE):
        for row in range(column, _POSE):
            normal.band[row - column, column::_POSE] += own[:, row, column]
    np.add.at(normal.pose_gradient, pose_of, np.einsum("mri,mr->mi", by_pose, residual))
    np.add.at(normal.beacon_gradient, beacon_of, np.einsum("mri,mr->mi", by_beacon, residual))
    at: Any = (pose_of, slice(None), beacon_of)
    np.add.at(normal.border, at, np.einsum("mri,mrj->mij", by_pose, by_beacon))
    at = (beacon_of, slice(None), beacon_of)
    np.add.at(normal.corner, at, np.einsum("mri,mrj->mij", by_beacon, by_beacon))


def _half_cotangent(turn: Array) -> tuple[Array, Array]:
    """h cot h with h = turn / 2, and its derivative by turn; near 0 by the series."""
    small = np.abs(turn) < 1e-2
    half = np.where(small, 1.0, 0.5 * turn)
    value = np.where(small, 1.0 - turn**2 / 12.0 - turn**4 / 720.0, half / np.tan(half))
    slope = 0.5 * (1.0 / np.tan(half) - half / np.sin(half) ** 2)
    return value, np.where(small, -turn / 6.0 - turn**3 / 180.0, slope)


def _mount(p: Mapping[str, int | float], theta_rad: Array) -> tuple[Array, Array]:
    """Where the sensor sits from the robot's middle, turned into the map, (n, 2), and by theta."""
    c, s = np.cos(theta_rad), np.sin(theta_rad)
    x_m, y_m = p["mount_x_m"], p["mount_y_m"]
    eye = np.column_stack([c * x_m - s * y_m, s * x_m + c * y_m])
    return eye, np.column_stack([-eye[:, 1], eye[:, 0]])


def _speed_model(p: Mapping[str, int | float], dt_s: Array) -> tuple[Array, Array]:
    """What is left of (v, omega) after each step, and 1 / sd of what comes to it, (n, 2) each, MATH (15).

    The first step's sd holds what the speeds at the start may have been.
    """
    decay_s = np.array([p["velocity_decay_s"], p["turn_rate_decay_s"]])
    walk = np.array([p["velocity_walk_mps_sqrt_s"], p["turn_rate_walk_radps_sqrt_s"]])
    start = np.array([p["velocity_sd_mps"], p["turn_rate_sd_radps"]])
    keep = 1.0 / (1.0 + dt_s[:, None] / decay_s)
    variance = walk**2 * dt_s[:, None] + _SPEED_VARIANCE_MIN
    variance[0] += (keep[0] * start) ** 2
    return keep, 1.0 / np.sqrt(variance)
