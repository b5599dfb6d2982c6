"""The smoother in C: against the exact MAP of the whole drive, float against double, and refusals."""

import math

import numpy as np
import pytest

from bslam.algorithms.smoother import Smoother
from bslam.core import Slam
from bslam.core.errors import CoreError
from bslam.motion import move_on_arc
from core.instance import state_without_counters
from internals import inside

STEP_US = 40_000
SIGMA_MPS = 0.1
BEARING_SD_RAD = 0.01
PLACES = np.array([[3.0, 2.0], [4.0, -2.5], [-1.5, 3.0], [1.0, -3.0]])
PARAMS = {
    "filter": 2,
    "velocity_states": 1,
    "velocity_walk_mps_sqrt_s": 30.0,
    "turn_rate_walk_radps_sqrt_s": 1.0,
    "turn_rate_decay_s": 1.0,
    "left_speed_sd_mps": SIGMA_MPS,
    "right_speed_sd_mps": SIGMA_MPS,
    "bearing_sd_rad": BEARING_SD_RAD,
    "bearing_only_variance_factor": 1.0,
    "bearing_only_curvature_factor": 0.0,
    "mount_x_m": 0.1,
    "mount_yaw_rad": 0.2,
}


class Drive:
    """A curve among beacons that are seen in direction only at every step, all round."""

    def __init__(self, noise=1.0, seed=0):
        self.pose, self.step, self._noise = (0.0, 0.0, 0.0), 0, noise
        self._rng = np.random.default_rng(seed)

    def go(self):
        """The wheels' readings of the next step, m."""
        self.step += 1
        wheels_m = 0.016 + 0.003 * np.array([math.sin(0.05 * self.step), math.cos(0.03 * self.step)])
        self.pose = move_on_arc(self.pose, *wheels_m, 0.4)
        noise_m = self._noise * SIGMA_MPS * 0.04 * self._rng.standard_normal(2)
        return (wheels_m + noise_m).tolist()

    def look(self):
        """Bearings of all beacons."""
        x_m, y_m, theta_rad = self.pose
        eye = np.array([x_m + 0.1 * math.cos(theta_rad), y_m + 0.1 * math.sin(theta_rad)])
        ray = PLACES - eye
        noise = self._noise * BEARING_SD_RAD * self._rng.standard_normal(len(PLACES))
        bearing = np.arctan2(ray[:, 1], ray[:, 0]) - theta_rad - 0.2 + noise
        return [math.remainder(one, math.tau) for one in bearing]


def see(slam, step, bearings):
    count = len(bearings)
    slam.sightings(step * STEP_US, bearings, [math.nan] * count, list(range(count)), [True] * count)


def run(steps, real="double", noise=1.0, seed=0, exact=None, every=1):
    """The core after a drive, a frame at every so many steps, and the drive; `exact` is fed alike."""
    drive, slam = Drive(noise, seed), Slam(PARAMS, beacons_max=4, real=real)
    for step in range(steps + 1):
        if step:
            left_m, right_m = drive.go()
            slam.odometry("wheels", step * STEP_US, left_m, right_m)
            if exact is not None:
                exact.add_step(0.04, left_m, right_m, move_on_arc(exact.last_pose, left_m, right_m, 0.4))
        bearings = drive.look()
        if step % every:
            continue
        see(slam, step, bearings)
        for beacon, bearing_rad in enumerate(bearings if exact is not None else []):
            exact.add_sighting(step, beacon, bearing_rad, math.nan)
    return slam, drive


def places_of(slam):
    return np.array([[one.x_m, one.y_m] for one in slam.beacons()])


def sd_of_places(slam):
    return np.array([np.sqrt(np.diag(one.covariance_m2)) for one in slam.beacons()])


@pytest.mark.parametrize("seed", range(2))
def test_smoother_is_near_the_exact_map_of_the_whole_drive(seed):
    """Which is GTSAM's on the same graph. What is left is that three frames are one node, and its path."""
    exact = Smoother(Slam.defaults() | PARAMS)
    slam, _ = run(600, seed=seed, exact=exact)
    exact.solve()
    assert np.max(np.abs(places_of(slam) - exact.beacons) / sd_of_places(slam)) < 1.0
    off = np.array(slam.pose()) - exact.poses[-1]
    off[2] = math.remainder(off[2], math.tau)
    assert off @ np.linalg.solve(slam.pose_covariance(), off) < 1.0


@pytest.mark.parametrize("every", [2, 3, 6, 10])
def test_smoother_smooths_where_frames_are_rare(every):
    """A block holds less than its three frames there, and a cycle ends with it all the same."""
    exact = Smoother(Slam.defaults() | PARAMS)
    slam, _ = run(900, exact=exact, every=every)
    exact.solve()
    assert inside(slam).smoother.cycles > 5
    assert np.max(np.abs(places_of(slam) - exact.beacons) / sd_of_places(slam)) < 1.0


def test_drive_without_noise_is_recovered():
    slam, drive = run(600, noise=0.0)
    # The prior of 4 m +- 2.5 m pulls at the scale, which directions leave to the wheels.
    assert np.abs(places_of(slam) - PLACES).max() < 0.1
    assert math.dist(slam.pose()[:2], drive.pose[:2]) < 0.06, "0.6 % of the way"


@pytest.mark.parametrize(
    ("scales", "size_off_max"),
    [({"forward_scale": 0.8, "turn_scale": 0.8}, 0.01), ({"scale_states": 1}, 0.2)],
    ids=["given", "estimated"],
)
def test_wheels_that_read_too_much_bend_no_way_that_is_joined(scales, size_off_max):
    """Without speeds, ways are odometry's times its scales; joined nodes' ways are told against that.

    Estimated scales start at 1, so the map has the size that was thought at first for a good part.
    """
    params = PARAMS | {"velocity_states": 0} | scales
    drive, slam = Drive(0.0), Slam(params, beacons_max=4, real="double")
    for step in range(1500):
        if step:
            left_m, right_m = drive.go()
            slam.odometry("wheels", step * STEP_US, left_m / 0.8, right_m / 0.8)
        see(slam, step, drive.look())
    assert inside(slam).smoother.levels[1] > 0
    size = np.mean(np.linalg.norm(places_of(slam), axis=1) / np.linalg.norm(PLACES, axis=1))
    assert abs(size - 1.0) < size_off_max
    assert np.abs(places_of(slam) / size - PLACES).max() < 0.05


def test_float_is_double_within_a_share_of_the_doubt():
    slams = [run(900, real)[0] for real in ("float", "double")]
    off = places_of(slams[0]) - places_of(slams[1])
    assert np.abs(off / sd_of_places(slams[1])).max() < 0.02


def test_nodes_and_sightings_stay_within_their_room():
    slam, _ = run(1200, real="float")
    smoother = inside(slam).smoother
    assert 200 < smoother.node_count <= len(smoother.nodes)
    assert smoother.seen_count == sum(
        smoother.nodes[(smoother.first_node + k) % len(smoother.nodes)].seen
        for k in range(smoother.node_count)
    )
    assert smoother.cycles > 30
    assert smoother.insane == 0


DISTANCE = 255  # as BSLAM_SMOOTHER_RANGE: in place of a beacon, of an entry that goes with the one before


def test_beacon_taken_out_leaves_the_others_as_they_are():
    slam, _ = run(300)
    before = places_of(slam)
    slam.remove_beacon(slam.beacons()[1].uid)
    np.testing.assert_allclose(places_of(slam), np.delete(before, 1, axis=0))
    smoother = inside(slam).smoother
    kept = [
        smoother.seen[(smoother.first_seen + k) % len(smoother.seen)].beacon
        for k in range(smoother.seen_count)
    ]
    assert set(kept) - {DISTANCE} == {0, 1, 2}


@pytest.mark.parametrize(
    "refused",
    [
        lambda slam: see(slam, 61, [0.1, math.nan]),
        lambda slam: see(slam, 61, [9.0]),
        lambda slam: see(slam, 1000, [0.1]),
        lambda slam: slam.odometry("wheels", 60 * STEP_US, 0.01, 0.01),
        lambda slam: slam.odometry("wheels", 61 * STEP_US, math.nan, 0.01),
        lambda slam: slam.set_pose(math.inf, 0.0, 0.0, 0.1, 0.1),
        lambda slam: slam.remove_beacon(99),
    ],
)
def test_refusal_leaves_smoother_and_filter_as_they_were(refused):
    slam, _ = run(60, real="float")
    before, estimate = state_without_counters(slam), (slam.pose(), places_of(slam).tolist())
    with pytest.raises(CoreError):
        refused(slam)
    assert state_without_counters(slam) == before
    assert (slam.pose(), places_of(slam).tolist()) == estimate


def test_robot_that_only_turns_does_not_learn_distances():
    slam, theta_rad = Slam(PARAMS, beacons_max=4), 0.0
    rng = np.random.default_rng(1)
    for step in range(500):
        if step:
            noise_m = 0.004 * rng.standard_normal(2)
            slam.odometry("wheels", step * STEP_US, *(np.array([-0.004, 0.004]) + noise_m).tolist())
            theta_rad += 0.008 / 0.4
        bearing = np.arctan2(PLACES[:, 1], PLACES[:, 0]) - theta_rad
        noisy = bearing + BEARING_SD_RAD * rng.standard_normal(4)
        see(slam, step, [math.remainder(one, math.tau) for one in noisy.tolist()])
    assert np.all(np.linalg.eigvalsh(slam.pose_covariance()) > 0.0)
    along = PLACES / np.hypot(*PLACES.T)[:, None]
    for beacon, u in zip(slam.beacons(), along, strict=True):
        assert u @ beacon.covariance_m2 @ u > 1.0**2, "nothing tells how far it is"


def test_robot_that_stands_stays_finite():
    slam, rng = Slam(PARAMS, beacons_max=4), np.random.default_rng(1)
    bearing = np.arctan2(PLACES[:, 1], PLACES[:, 0])
    for step in range(500):
        if step:
            slam.odometry("wheels", step * STEP_US, *(0.004 * rng.standard_normal(2)).tolist())
        see(slam, step, (bearing + BEARING_SD_RAD * rng.standard_normal(4)).tolist())
    assert np.all(np.linalg.eigvalsh(slam.pose_covariance()) > 0.0)
    assert np.isfinite(places_of(slam)).all()
    assert math.hypot(*slam.pose()[:2]) < 0.3


def test_long_time_without_a_beacon_makes_nodes_of_odometry_alone():
    slam, drive = run(100, real="float")
    before = inside(slam).smoother.node_count
    for step in range(101, 226):  # 5 s
        slam.odometry("wheels", step * STEP_US, *drive.go())
    bearings = drive.look()
    see(slam, 225, bearings)
    assert inside(slam).smoother.node_count - before >= 5.0 / 0.24 - 1
    assert np.isfinite(slam.pose_covariance()).all()


def test_pose_set_from_outside_begins_the_past_anew():
    slam, _ = run(100)
    slam.set_pose(1.0, 2.0, 0.5, 0.1, 0.1)
    assert inside(slam).smoother.node_count == 0
    assert slam.pose() == pytest.approx((1.0, 2.0, 0.5))
