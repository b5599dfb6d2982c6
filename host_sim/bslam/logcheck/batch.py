"""Path, map and what may be wrong with a log, all at once: robust least squares over the whole drive.

Unknown are a pose a frame, the beacons' places, and the parameters. Errors follow Student's t, so that slips
and false labels decide nothing. The scatter of four groups (bearings, ranges, way, turn) is estimated beside,
from what is left of each and how much the unknowns have taken of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import coo_matrix, csc_matrix

from bslam.log import wrap_rad
from bslam.logcheck.drive import Drive, Floats, Ints

WAY, TURN, BEND, DELAY, YAW = range(5)
"""Parameters: what way and turn are to be multiplied by; rad that each metre turns besides; s that sightings
come late; rad by which bearings are too small."""
Free = tuple[int, ...]

_STEPS: Final = np.array([1e-4, 1e-4, 1e-4, 0.02, 1e-4])  # for derivatives by them
_FREEDOM: Final = 4.0  # degrees of, Student's t
_ITERATIONS: Final = 8
_ENOUGH: Final = 1.0  # a smaller gain of log-likelihood is none
_PROBES: Final = 3
_CURVATURE_S: Final = 2.0  # of a sum
# Any odometry may err by so much besides what is told: with the way; with the turn and the way; at rest.
_WAY_SD_PER_SQRT_M: Final = 0.03
_TURN_SD_PER_SQRT_RAD: Final = 0.1
_TURN_SD_PER_SQRT_M: Final = 0.055
_AT_REST: Final = (1e-3, 3e-3)  # m, rad per sqrt(s)


@dataclass(frozen=True)
class State:
    """Unknowns, and by what the scatter of each group is larger than stated."""

    poses: Floats  # (K, 3)
    marks: Floats  # (b, 2)
    parameters: Floats  # (5,)
    scale: Floats  # (4,)


@dataclass(frozen=True)
class Problem:
    """A drive, cut into frames. Errors are in rows: three a step of odometry, then two a sighting."""

    drive: Drive
    frame_s: Floats  # (K,)
    frame: Ints  # (m,) of each sighting
    step_sd: Floats  # (K - 1, 3) of odometry from frame to frame: forward, left, turn
    told_sd: Floats  # (K - 1, 3) the part of it that is told

    @cached_property
    def group(self) -> Ints:
        """Of each row, its place in a state's scale."""
        steps, sightings = np.tile((2, 2, 3), len(self.step_sd)), np.tile((0, 1), len(self.frame))
        return np.concatenate([steps, sightings])

    @property
    def is_read(self) -> bool:
        """The reading of odometry errs, and not the motion."""
        return self.drive.robot.wheel_noise == "speedometer" and not self.drive.is_commanded

    def steps(self, parameters: Floats) -> Floats:
        """Motion from frame to frame by odometry, (K - 1, 3)."""
        way, turn, bend_radpm, delay_s, _ = parameters
        poses = self.drive.odometry.at(self.frame_s - delay_s, way, turn, bend_radpm)
        return relative(poses[:-1], poses[1:])

    def step_errors(self, parameters: Floats, steps: Floats) -> Floats:
        """Odometry less the steps (K - 1, 3), over its noise."""
        errors = self.steps(parameters) - steps
        errors[:, 2] = wrap_rad(errors[:, 2])
        return errors / (self.step_sd * self.unit(parameters))

    def unit(self, parameters: Floats) -> Floats:
        """What noise of the reading is multiplied by in the motion, (3,)."""
        return np.abs(parameters[[WAY, WAY, TURN]]) if self.is_read else np.ones(3)

    def mounts(self, poses: Floats) -> tuple[Floats, Floats]:
        """From the robot's middle at poses (k, 3) to the sensor, and that by the heading, (k, 2) each."""
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x_m, y_m = self.drive.robot.sensor_x_m, self.drive.robot.sensor_y_m
        offset = np.column_stack([c * x_m - s * y_m, s * x_m + c * y_m])
        return offset, np.column_stack([-offset[:, 1], offset[:, 0]])


def relative(a: Floats, b: Floats) -> Floats:
    """Poses b (n, 3) in the frames of a (n, 3)."""
    dx, dy = (b[:, :2] - a[:, :2]).T
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    return np.column_stack([c * dx + s * dy, -s * dx + c * dy, b[:, 2] - a[:, 2]])


def problem_of(drive: Drive) -> Problem:
    """Its frames, and how well odometry is known between them."""
    frame_s, frame = np.unique(drive.seen.time_s, return_inverse=True)
    odometry = drive.odometry
    moved = np.abs(np.diff(np.column_stack([odometry.way_m, odometry.turn_rad]), axis=0))
    sums = np.vstack([[0.0, 0.0], np.cumsum(moved, axis=0)])
    way, turn = (np.diff(np.interp(frame_s, odometry.time_s, column)) for column in sums.T)
    step_s = np.diff(frame_s)
    wheel2 = drive.robot.wheel_speed_sigma_mps**2 * drive.row_s * step_s
    told = np.column_stack([wheel2 / 2.0, 2.0 * wheel2 / drive.robot.wheelbase_m**2]) + 1e-12
    by_turn = _TURN_SD_PER_SQRT_RAD**2 * turn + _TURN_SD_PER_SQRT_M**2 * way
    own = np.column_stack([_WAY_SD_PER_SQRT_M**2 * way, by_turn]) + np.square(_AT_REST) * step_s[:, None]
    whole, part = (np.sqrt(one[:, [0, 0, 1]]) for one in (told + own, told))
    return Problem(drive, frame_s, frame.astype(np.intp), whole, part)


def errors_at(problem: Problem, state: State) -> Floats:
    """All rows, over the stated noise."""
    steps = problem.step_errors(state.parameters, relative(state.poses[:-1], state.poses[1:]))
    to_beacon, distance = _to_beacons(problem, state)
    seen, heading = problem.drive.seen, state.poses[problem.frame, 2]
    turned = seen.bearing_rad + state.parameters[YAW] - np.arctan2(to_beacon[:, 1], to_beacon[:, 0]) + heading
    sightings = np.column_stack([wrap_rad(turned), seen.range_m - distance]) / seen.sd
    return np.concatenate([steps.ravel(), sightings.ravel()])


def cost(problem: Problem, state: State) -> float:
    """Negative log-likelihood, up to what the scales decide."""
    errors = errors_at(problem, state) / state.scale[problem.group]
    return float(0.5 * (_FREEDOM + 1.0) * np.log1p(errors**2 / _FREEDOM).sum())


def fit(problem: Problem, state: State, free: Free, rounds: int) -> State:
    """The state of least cost, with scales that fit it after so many rounds."""
    for _ in range(rounds):
        state = minimise(problem, state, free)
        ratio = np.clip(scatter(problem, state, free)[0], 0.2, 5.0)
        state = replace(state, scale=np.maximum(state.scale * ratio, 0.01))
    return minimise(problem, state, free)


def minimise(problem: Problem, state: State, free: Free) -> State:
    """The state of least cost at these scales; damped as by Levenberg and Marquardt."""
    damping, least = 1e-6, cost(problem, state)
    for _ in range(_ITERATIONS):
        gain, linear = 0.0, _Linear(problem, state, free)
        while gain <= 0.0 and damping < 1e6:
            new = linear.moved(linear.solver(damping).solve(-linear.jacobian.T @ linear.left))
            gain = least - cost(problem, new)
            damping *= 0.1 if gain > 0.0 else 100.0
        if gain > 0.0:
            state, least, damping = new, least - gain, max(damping, 1e-6)
        if gain < _ENOUGH:
            break
    return state


def scatter(problem: Problem, state: State, free: Free) -> tuple[Floats, Floats]:
    """By what each group's scale is too small, and what share of its rows the unknowns leave free, (4,) each.

    The unknowns' share is a trace, estimated by random signs (Hutchinson).
    """
    linear = _Linear(problem, state, free)
    solver, random = linear.solver(0.0), np.random.default_rng(0)
    rows, taken = np.bincount(problem.group, minlength=4), np.zeros(4)
    for group in range(4):
        for _ in range(_PROBES):
            signs = np.where(problem.group == group, random.choice((-1.0, 1.0), len(linear.left)), 0.0)
            of_unknowns = linear.jacobian.T @ signs
            taken[group] += of_unknowns @ solver.solve(of_unknowns) / _PROBES
    free_rows = np.maximum(rows - taken, 0.02 * rows) + 1e-9
    squares = np.bincount(problem.group, linear.left**2, minlength=4)
    return np.sqrt(squares / free_rows), free_rows / np.maximum(rows, 1)


def standard_errors(problem: Problem, state: State, free: Free, told: bool = False) -> Floats:
    """Of the free parameters, (len(free),): by the scatter that was found, or by the noise that is told."""
    if told:
        problem = replace(problem, step_sd=problem.told_sd)
        state = replace(state, scale=np.ones(4))
    solver = _Linear(problem, state, free, is_normal=told).solver(0.0)
    return np.sqrt(np.maximum(np.diag(solver.corner)[-len(free) :], 0.0))


def sameness_of_curvature(problem: Problem, state: State) -> float:
    """How alike way and turn of the fitted path run, from 0 to 1: at 1 each metre turns by the same angle,
    and a drive tells the parameters TURN and BEND only together. Of sums: noise bends single frames.
    """
    steps = relative(state.poses[:-1], state.poses[1:])
    slot = np.floor(problem.frame_s[1:] / _CURVATURE_S).astype(np.intp)
    way, turn = (np.bincount(slot - slot[0], steps[:, column]) for column in (0, 2))
    return float(abs(way @ turn) / np.sqrt((way @ way) * (turn @ turn) + 1e-12))


def _to_beacons(problem: Problem, state: State) -> tuple[Floats, Floats]:
    """From the sensor to each beacon sighted: (m, 2) and its length (m,)."""
    sensor = state.poses[:, :2] + problem.mounts(state.poses)[0]
    way = state.marks[problem.drive.seen.label] - sensor[problem.frame]
    return way, np.hypot(*way.T) + 1e-9


class _Linear:
    """The problem about a state: Jacobian and errors, over their scatter and by the roots of their weights.

    Columns: poses, beacons, free parameters. is_normal: errors are normal, and all weigh 1.
    """

    def __init__(self, problem: Problem, state: State, free: Free, is_normal: bool = False) -> None:
        self.problem, self.state, self.free = problem, state, free
        self.poses, self.marks = state.poses.size, state.marks.size
        scale = state.scale[problem.group]
        errors = errors_at(problem, state) / scale
        root = np.ones(len(errors)) if is_normal else np.sqrt((_FREEDOM + 1.0) / (_FREEDOM + errors**2))
        entries = [self._of_steps(), self._of_sightings()]
        rows, columns, values = (np.concatenate([one[part].ravel() for one in entries]) for part in range(3))
        shape = (len(errors), self.poses + self.marks + len(free))
        self.jacobian = coo_matrix((values * (root / scale)[rows], (rows, columns)), shape=shape).tocsr()
        self.left = root * errors

    def _of_steps(self) -> tuple[Ints, Ints, Floats]:
        """Rows, columns, values of odometry's errors: by the pose before, the one after, the parameters."""
        problem, state = self.problem, self.state
        steps = relative(state.poses[:-1], state.poses[1:])
        c, s = np.cos(state.poses[:-1, 2]), np.sin(state.poses[:-1, 2])
        no, one = np.zeros_like(c), np.ones_like(c)
        by_poses = (
            np.array(
                [
                    [c, s, -steps[:, 1], -c, -s, no],
                    [-s, c, steps[:, 0], s, -c, no],
                    [no, no, one, no, no, -one],
                ]
            ).transpose(2, 0, 1)
            / (problem.step_sd * problem.unit(state.parameters))[:, :, None]
        )
        by_parameters = np.empty((len(c), 3, len(self.free)))
        for place, which in enumerate(self.free):
            shift = np.where(np.arange(len(_STEPS)) == which, _STEPS, 0.0)
            ends = [problem.step_errors(state.parameters + sign * shift, steps) for sign in (1.0, -1.0)]
            by_parameters[:, :, place] = (ends[0] - ends[1]) / (2.0 * _STEPS[which])
        first = 3 * np.arange(len(c))[:, None]
        columns = [first + np.arange(6)]
        return self._entries(first + np.arange(3), columns, np.concatenate([by_poses, by_parameters], axis=2))

    def _of_sightings(self) -> tuple[Ints, Ints, Floats]:
        """The same of sightings: by pose, beacon and parameters."""
        problem = self.problem
        way, distance = _to_beacons(problem, self.state)
        along = way / distance[:, None]
        across = np.column_stack([-along[:, 1], along[:, 0]]) / distance[:, None]
        by_heading = problem.mounts(self.state.poses)[1][problem.frame]
        yaw = np.tile(np.array(self.free) == YAW, (len(way), 1)).astype(np.float64)
        bearing = [across, (across * by_heading).sum(axis=1, keepdims=True) + 1.0, -across, yaw]
        range_ = [along, (along * by_heading).sum(axis=1, keepdims=True), -along, 0.0 * yaw]
        values = np.stack([np.hstack(bearing), np.hstack(range_)], axis=1) / problem.drive.seen.sd[:, :, None]
        label = problem.drive.seen.label[:, None]
        columns = [3 * problem.frame[:, None] + np.arange(3), self.poses + 2 * label + np.arange(2)]
        start = 3 * len(problem.step_sd)
        return self._entries(start + 2 * np.arange(len(way))[:, None] + np.arange(2), columns, values)

    def _entries(self, rows: Ints, columns: list[Ints], values: Floats) -> tuple[Ints, Ints, Floats]:
        """Values (n, rows, columns) with their rows and columns; those of the parameters come last."""
        ours = self.poses + self.marks + np.arange(len(self.free))
        all_columns = np.hstack([*columns, np.broadcast_to(ours, (len(rows), len(ours)))])
        shape = values.shape
        return (
            np.broadcast_to(rows[:, :, None], shape),
            np.broadcast_to(all_columns[:, None, :], shape),
            values,
        )

    def moved(self, step: Floats) -> State:
        """The state after a step of all unknowns."""
        poses, marks, own = np.split(step, [self.poses, self.poses + self.marks])
        parameters = self.state.parameters.copy()
        parameters[list(self.free)] += own
        places = self.state.marks + marks.reshape(-1, 2)
        return State(self.state.poses + poses.reshape(-1, 3), places, parameters, self.state.scale)

    def solver(self, damping: float) -> _Solver:
        """Of the normal equations."""
        return _Solver((self.jacobian.T @ self.jacobian).tocsc(), self.poses, damping)


class _Solver:
    """Normal equations: the part of the poses is a band, the rest a corner."""

    def __init__(self, normal: csc_matrix, poses: int, damping: float) -> None:
        path = normal[:poses, :poses]
        band = np.zeros((6, poses))
        for below in range(min(6, poses)):
            band[below, : poses - below] = path.diagonal(-below)
        band[0] = (1.0 + damping) * band[0] + 1e-9
        band[0, :3] += 1e8 * (1.0 + band[0, :3])  # the first pose stays: the map's frame is its
        corner = normal[poses:, poses:].toarray()
        corner += np.diag(damping * np.diag(corner) + 1e-9)
        self._factor = cholesky_banded(band, lower=True, check_finite=False)
        self._side = normal[:poses, poses:].toarray()
        self._solved = self._path(self._side)
        self.corner = np.linalg.inv(corner - self._side.T @ self._solved)

    def _path(self, right: Floats) -> Floats:
        return np.asarray(cho_solve_banded((self._factor, True), right, check_finite=False))

    def solve(self, right: Floats) -> Floats:
        """x of normal x = right."""
        poses = len(self._side)
        path = self._path(right[:poses])
        rest = self.corner @ (right[poses:] - self._side.T @ path)
        return np.concatenate([path - self._solved @ rest, rest])
