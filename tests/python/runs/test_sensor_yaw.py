"""A sensor's yaw comes out of a drive, with an error bar that holds."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bslam.calibration.sensor_yaw import find_yaw
from bslam.errors import BslamError


def turned(log, yaw_rad):
    """The log of a robot whose sensor is turned to the left by that and does not know it."""
    sightings = replace(log.sightings, bearing_rad=log.sightings.bearing_rad - yaw_rad)
    return replace(log, sightings=sightings)


@pytest.mark.parametrize("yaw_deg", [0.0, 3.0, -60.0, 179.0])
@pytest.mark.parametrize("with_truth", [True, False])
def test_find_yaw_without_noise_is_exact(made, yaw_deg, with_truth):
    log = turned(made.circle_log(steps=600), math.radians(yaw_deg))
    found = find_yaw(log if with_truth else replace(log, truth=None))
    assert found.value == pytest.approx(math.radians(yaw_deg), abs=1e-9)
    assert found.error < 1e-9


def test_find_yaw_knows_where_the_sensor_sits(made):
    log = made.circle_log(steps=600)
    x_m, y_m, yaw_rad = 0.3, -0.1, 0.2
    theta = np.repeat(log.truth.theta_rad, 3)
    at = np.repeat(log.truth.x_m + 1j * log.truth.y_m, 3) + np.exp(1j * theta) * complex(x_m, y_m)
    beacons = np.tile(log.beacons.x_m + 1j * log.beacons.y_m, len(log.truth.x_m))
    seen = (beacons - at) * np.exp(-1j * (theta + yaw_rad))
    sightings = replace(log.sightings, bearing_rad=np.angle(seen), range_m=np.abs(seen))
    robot = replace(log.robot, sensor_x_m=x_m, sensor_y_m=y_m)
    assert find_yaw(replace(log, sightings=sightings, robot=robot)).value == pytest.approx(yaw_rad, abs=1e-9)


def test_find_yaw_error_bar_holds_over_seeds(made):
    scores = []
    for seed in range(40):
        found = find_yaw(replace(turned(made.circle_log(steps=1500, seed=seed), 0.05), truth=None))
        assert found.error < math.radians(1.0)
        scores.append((found.value - 0.05) / found.error)
    assert abs(np.mean(scores)) < 3 / math.sqrt(40)
    # Rather too long than too short: where two pairs share a sighting its error cancels, which blocks hide.
    assert 0.3 < np.std(scores) < 1.2


def test_find_yaw_wrong_scale_of_distance_does_not_turn_it(made):
    log = turned(made.circle_log(steps=600), 0.1)
    sightings = replace(log.sightings, range_m=1.2 * log.sightings.range_m)
    assert find_yaw(replace(log, sightings=sightings)).value == pytest.approx(0.1, abs=1e-9)


def test_find_yaw_without_distance_or_identity_is_refused(made):
    log = made.circle_log(steps=600)
    nameless = replace(log.sightings, beacon_id=np.full_like(log.sightings.beacon_id, -1))
    rangeless = replace(log.sightings, range_m=np.full_like(log.sightings.range_m, np.nan))
    for sightings in (nameless, rangeless):
        with pytest.raises(BslamError, match=r"circle: 0 pairs of sightings .* allowed: at least 20"):
            find_yaw(replace(log, sightings=sightings))
    with pytest.raises(BslamError, match=r"circle: \d+ pairs"):
        find_yaw(made.circle_log(steps=60))
