"""Which wrong matches a better pose would have spared."""

from types import SimpleNamespace

import numpy as np

from bound_association import Confusions, told_right
from bslam.log import Truth

PAIR_M = 4.0, 0.2  # ahead, and to either side


def log_of(bearing_rad, range_m):
    """Two beacons, 7 on the left and 3 on the right, and sightings from the origin."""
    count = len(bearing_rad)
    ahead_m, aside_m = PAIR_M
    robot = SimpleNamespace(
        sensor_x_m=0.0, sensor_y_m=0.0, sensor_yaw_rad=0.0, bearing_sigma_rad=0.01,
        range_sigma_floor_m=0.0, range_sigma_fraction=0.02, range_sigma_scale_m=100.0,
    )  # fmt: skip
    return SimpleNamespace(
        beacons=SimpleNamespace(
            beacon_id=np.array([7, 3]), x_m=np.array([ahead_m] * 2), y_m=np.array([aside_m, -aside_m])
        ),
        robot=robot,
        sightings=SimpleNamespace(
            time_us=np.arange(count) * 1000,
            bearing_rad=np.array(bearing_rad),
            range_m=np.array(range_m),
            bearing_sd_rad=None,
            range_sd_m=None,
        ),
        truth=Truth(np.arange(count) * 1000, *np.zeros((3, count))),
    )


def confused_of(*rows):
    confused = Confusions()
    confused.rows = list(rows)
    return confused


def trace_of(*poses):
    return SimpleNamespace(time_us=np.arange(len(poses)) * 1000, pose=np.array(poses))


def test_the_pose_decides_which_of_a_pair_is_nearer():
    log = log_of([0.05, 0.05], [4.0, np.nan])  # both show 7, with and without a distance
    confused = confused_of((0, 7, 3), (1, 7, 3))
    straight, turned = (0.0, 0.0, 0.0), (0.0, 0.0, -0.1)  # so 0.05 to the left is 0.05 to the right
    assert told_right(log, confused, trace_of(turned, turned), trace_of(straight, turned)) == [0, 1, 2]


def test_the_pose_is_that_of_the_step_before_the_sighting():
    log = log_of([0.05, 0.05], [4.0, 4.0])
    run = trace_of((0.0, 0.0, 0.0), (0.0, 0.0, -0.1))
    assert told_right(log, confused_of((0, 7, 3)), run, run)[0] == 1
    assert told_right(log, confused_of((1, 7, 3)), run, run)[0] == 0


def test_where_nothing_is_confused_nothing_is_told():
    assert told_right(log_of([0.0], [4.0]), confused_of(), trace_of(), trace_of()) == [0, 0, 0]


def test_what_counts_is_a_beacon_matched_with_another():
    def account(result, uid):
        return SimpleNamespace(result=result, beacon_uid=uid, reason="none")

    confused = Confusions()
    beacons = [SimpleNamespace(uid=uid) for uid in (1, 2, 3)]
    confused.step(0, (0.0, 0.0, 0.0), SimpleNamespace(beacons=lambda: beacons))
    confused.frame(0, [7, 3, -1], (), [account("new", 1), account("new", 2), account("new", 3)])
    confused.frame(0, [7], (), None)
    confused.frame(0, [7, 7, -1], (), [account("matched", 1), account("matched", 2), account("matched", 3)])
    confused.frame(0, [3, -1], (), [account("deferred", 0), account("matched", 1)])
    assert confused.rows == [(5, 7, 3)]
    assert confused.sightings == 9


def test_what_a_sighting_says_of_its_own_noise_counts():
    log = log_of([0.02, 0.02], [4.0, 4.0])  # a little nearer to 7, which stands farther off than 3
    log.beacons.x_m = np.array([4.4, 4.0])
    log.sightings.bearing_sd_rad = np.array([0.001, 0.1])
    log.sightings.range_sd_m = np.array([1.0, 0.1])
    straight = trace_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert told_right(log, confused_of((0, 7, 3)), straight, straight) == [1, 1, 1]
    assert told_right(log, confused_of((1, 7, 3)), straight, straight) == [0, 0, 0]
