"""The exact MAP: its derivatives by differences, its optimum by GTSAM's on the same graph."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from bslam.algorithms.causal_map import CausalMap
from bslam.algorithms.noise import motion_covariance, range_sd_m
from bslam.algorithms.smoother import _ARC_SD_M, _FIRST_RANGE_SD_M, Smoother, _Problem
from bslam.core.presets import preset_settings
from bslam.log import first_steps
from bslam.motion import move_on_arc
from bslam.options import RunOptions
from bslam.runs.rival import run_algorithm
from bslam.world.simulate import load_scenario, simulate

STEP_S = 0.04
PLACES = np.array([[2.0, 1.0], [3.0, -1.5], [-1.0, 2.0]])
MOUNT = {"mount_x_m": 0.12, "mount_y_m": -0.05, "mount_yaw_rad": 0.3}


def parameters(**changes):
    return preset_settings(["paper"], 0, 1) | MOUNT | changes


def drive(p, steps, seed=4, has_range=True, has_gyro=False):
    """A smoother fed with a noisy curve through three beacons, every one seen at every third step."""
    rng = np.random.default_rng(seed)
    smoother = Smoother(p)
    true = guess = (0.0, 0.0, 0.0)
    look(smoother, p, true, 0, rng, has_range)
    for step in range(1, steps + 1):
        wheels = 0.02 + 0.004 * np.array([math.sin(0.1 * step), math.cos(0.07 * step)])
        true = move_on_arc(true, *wheels, p["wheelbase_m"])
        left_m, right_m = (wheels + 0.3 * STEP_S * rng.standard_normal(2)).tolist()
        guess = move_on_arc(smoother.last_pose, left_m, right_m, p["wheelbase_m"])
        turn_radps = (wheels[1] - wheels[0]) / p["wheelbase_m"] / STEP_S
        told = has_gyro and step % 2 == 0
        gyro_sd_radps = (0.02 if step % 4 == 0 else 0.1) if told else math.nan
        gyro_radps = turn_radps + gyro_sd_radps * rng.standard_normal()
        smoother.add_step(STEP_S, left_m, right_m, guess, gyro_radps, gyro_sd_radps)
        if step % 3 == 0:
            look(smoother, p, true, step, rng, has_range)
    return smoother


def look(smoother, p, pose, step, rng, has_range):
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    eye = (x + c * p["mount_x_m"] - s * p["mount_y_m"], y + s * p["mount_x_m"] + c * p["mount_y_m"])
    for beacon, (bx, by) in enumerate(PLACES):
        range_m = math.hypot(bx - eye[0], by - eye[1])
        bearing = math.atan2(by - eye[1], bx - eye[0]) - theta - p["mount_yaw_rad"]
        bearing += p["bearing_sd_rad"] * rng.standard_normal()
        range_m += range_sd_m(p, range_m) * rng.standard_normal()
        smoother.add_sighting(
            step, beacon, math.remainder(bearing, math.tau), range_m if has_range else math.nan
        )


@pytest.mark.parametrize("velocity_states", [0, 1])
@pytest.mark.parametrize("has_range", [True, False])
def test_gradient_and_step_are_those_of_finite_differences(velocity_states, has_range):
    p = parameters(velocity_states=velocity_states)
    smoother = drive(p, 9, has_range=has_range)
    rng = np.random.default_rng(1)
    poses = smoother.poses + 0.01 * rng.standard_normal(smoother.poses.shape)
    beacons = smoother.beacons + 0.1 * rng.standard_normal(smoother.beacons.shape)
    problem = _Problem(p, smoother._steps, smoother._seen, smoother._priors)
    weights = problem.weights(poses, beacons)
    _, normal = problem.linearise(poses, beacons, weights)

    def cost(values):
        at = values[: poses.size].reshape(poses.shape), values[poses.size :].reshape(beacons.shape)
        return problem.cost(*at, weights)

    values = np.concatenate([poses.ravel(), beacons.ravel()])
    h = 1e-6
    gradient = [(cost(values + h * e) - cost(values - h * e)) / (2 * h) for e in np.eye(len(values))]
    ours = np.concatenate([normal.pose_gradient.ravel(), normal.beacon_gradient.ravel()])
    # Central differences of a cost of 1e7 (the arc's weight) leave about 1e-9 of that over h.
    np.testing.assert_allclose(ours, gradient, rtol=1e-4, atol=1e-2)


@pytest.mark.parametrize("velocity_states", [0, 1])
@pytest.mark.parametrize(("has_range", "has_gyro"), [(True, False), (False, False), (True, True)])
def test_optimum_is_that_of_gtsam_on_the_same_graph(velocity_states, has_range, has_gyro):
    gtsam = pytest.importorskip("gtsam")
    p = parameters(velocity_states=velocity_states)
    smoother, start = (drive(p, 60, has_range=has_range, has_gyro=has_gyro) for _ in range(2))
    smoother.solve()
    # Plain Gauss-Newton from odometry diverges without distances: GTSAM then sets out beside the optimum.
    begin = start if has_range else beside(smoother)
    graph, values = gtsam_graph(gtsam, p, smoother, begin)
    best, last = values, math.inf
    for _ in range(20):  # not its optimizers, which stop when the narrow arcs make the cost rise once
        change = graph.linearize(best).optimize()
        best, last = best.retract(change), change.norm()
    assert last < 1e-7, "GTSAM has converged"
    poses = np.array([[(at := best.atPose2(k)).x(), at.y(), at.theta()] for k in range(61)])
    beacons = np.array([best.atPoint2(1000 + number) for number in range(len(PLACES))])
    moved = np.abs(smoother.poses - start.poses).max()
    assert moved > 0.05, "the start is far from the optimum"
    # GTSAM lets a pose leave its arc by a hundredth of a millimetre; the smoother does not.
    assert np.abs(smoother.poses[:, :2] - poses[:, :2]).max() < 2e-5
    assert np.abs(np.sin(smoother.poses[:, 2] - poses[:, 2])).max() < 2e-5
    assert np.abs(smoother.beacons - beacons).max() < 2e-5


def beside(solved):
    """Poses half a centimetre and beacons 5 cm off."""
    rng = np.random.default_rng(9)
    poses = solved.poses + 0.005 * rng.standard_normal(solved.poses.shape)
    return SimpleNamespace(
        poses=poses, beacons=solved.beacons + 0.05 * rng.standard_normal(solved.beacons.shape)
    )


def gtsam_graph(gtsam, p, solved, start):
    """The same terms by GTSAM's own poses, logarithm and bearing-range factor; distances weighted alike."""
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    values.insert(0, gtsam.Pose2())
    graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(), gtsam.noiseModel.Isotropic.Sigma(3, 1e-9)))

    def add(keys, error, covariance):
        noise = gtsam.noiseModel.Gaussian.Covariance(np.asarray(covariance, dtype=np.float64))
        graph.add(gtsam.CustomFactor(noise, keys, differentiated(gtsam, keys, error)))

    for number, place in enumerate(start.beacons):
        values.insert(1000 + number, place)
    for k, (dt_s, left_m, right_m, gyro_radps, gyro_sd_radps) in enumerate(solved._steps):
        values.insert(k + 1, gtsam.Pose2(*start.poses[k + 1]))
        read = np.array([0.5 * (left_m + right_m), 0.0, (right_m - left_m) / p["wheelbase_m"]])
        covariance = np.zeros((3, 3))
        covariance[np.ix_([0, 2], [0, 2])] = motion_covariance(p, dt_s, left_m, right_m)
        covariance[1, 1] = _ARC_SD_M**2
        add([k, k + 1], lambda a, b, read=read: twist(gtsam, a, b) - read, covariance)
        if p["velocity_states"]:
            add_speeds(gtsam, p, add, k, dt_s)
        if math.isfinite(gyro_radps):
            turned, sd_rad = gyro_radps * dt_s, gyro_sd_radps * dt_s
            add([k, k + 1], lambda a, b, t=turned: twist(gtsam, a, b)[[2]] - t, [[sd_rad**2]])
    spread = gtsam.noiseModel.Isotropic.Sigma(2, _FIRST_RANGE_SD_M)
    for beacon, *place in solved._priors:
        graph.add(gtsam.PriorFactorPoint2(1000 + beacon, np.array(place), spread))
    mount = gtsam.Pose2(*MOUNT.values())
    for pose, beacon, bearing_rad, range_m in solved._seen:
        eye = gtsam.Pose2(*solved.poses[pose]).compose(mount)
        sd = p["bearing_sd_rad"], range_sd_m(p, eye.range(solved.beacons[beacon]))

        def sight(at, place, bearing_rad=bearing_rad, range_m=range_m):
            eye = at.compose(mount)
            error = np.array([eye.bearing(place).theta() - bearing_rad, eye.range(place) - range_m])
            return error[np.isfinite(error)]

        kept = 1 if math.isnan(range_m) else 2
        add([pose, 1000 + beacon], sight, np.diag(np.square(sd[:kept])))
    return graph, values


def twist(gtsam, a, b):
    return gtsam.Pose2.Logmap(a.between(b))


def add_speeds(gtsam, p, add, k, dt_s):
    walk = np.array([p["velocity_walk_mps_sqrt_s"], p["turn_rate_walk_radps_sqrt_s"]]) ** 2 * dt_s
    keep = 1 / (1 + dt_s / np.array([p["velocity_decay_s"], p["turn_rate_decay_s"]]))
    if k == 0:
        first = walk + (keep * [p["velocity_sd_mps"], p["turn_rate_sd_radps"]]) ** 2
        add([0, 1], lambda a, b: twist(gtsam, a, b)[[0, 2]] / dt_s, np.diag(first))
        return

    def change(a, b, c):
        return (twist(gtsam, b, c)[[0, 2]] - keep * twist(gtsam, a, b)[[0, 2]]) / dt_s

    add([k - 1, k, k + 1], change, np.diag(walk))


def differentiated(gtsam, keys, error):
    """A CustomFactor's function: the error, and its derivatives by central differences on the manifold."""

    def read(values, key):
        return values.atPoint2(key) if key >= 1000 else values.atPose2(key)

    def moved(value, change):
        return value + change if isinstance(value, np.ndarray) else value.retract(change)

    def call(_, values, jacobians):
        at = [read(values, key) for key in keys]
        for number in range(len(keys) if jacobians is not None else 0):
            size, columns = (2 if keys[number] >= 1000 else 3), []
            for step in 1e-6 * np.eye(size):
                ends = [
                    error(*[moved(one, sign * step) if i == number else one for i, one in enumerate(at)])
                    for sign in (1.0, -1.0)
                ]
                columns.append((ends[0] - ends[1]) / 2e-6)
            jacobians[number] = np.column_stack(columns)
        return error(*at)

    return call


def test_drive_without_noise_is_recovered():
    p = parameters(velocity_states=0)
    rng = np.random.default_rng(0)
    smoother, true = Smoother(p), [(0.0, 0.0, 0.0)]
    silent = p | {"bearing_sd_rad": 0.0, "range_sd_fraction": 0.0, "range_sd_per_m": 0.0}
    for step in range(41):
        if step:
            true.append(move_on_arc(true[-1], 0.02, 0.024, p["wheelbase_m"]))
            smoother.add_step(STEP_S, 0.02, 0.024, move_on_arc(smoother.last_pose, 0.03, 0.01, 0.4))
        look(smoother, silent, true[-1], step, rng, has_range=True)
    smoother.solve()
    np.testing.assert_allclose(smoother.poses, true, atol=1e-6)
    np.testing.assert_allclose(smoother.beacons, PLACES, atol=1e-6)


def test_bound_that_is_asked_rarely_does_not_start_from_odometry_alone():
    log = first_steps(simulate(load_scenario("paper_room"), 1000, sigma_mps=1.0), 1000)
    poses = run_algorithm(
        log, RunOptions(association="known"), lambda setup: CausalMap(setup, 100), lambda _step: None
    ).pose
    assert log.truth is not None
    error_m = np.hypot(
        *(poses[100::100, :2] - np.column_stack([log.truth.x_m, log.truth.y_m])[100:1001:100]).T
    )
    assert error_m.max() < 0.3
