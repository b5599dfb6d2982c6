"""Drives for all programs: logs, and as those read them that are no Python (tests/bench/peers/drive.c)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.truth import step_times_us, truth_at, wheel_travel
from bslam.log import Log, Odometry, Robot, Sightings, Truth
from bslam.runs.sources import ScenarioSource

SPEED_MPS, RADIUS_M = 0.4, 3.0  # of the circle that the drive for timing is
HALF_WIDTH_M, APART_M = 10.0, 0.3  # of the square in which its beacons stand; from one to the next at least
MAPPING_SIGHTINGS = 8  # a step, until every beacon has been seen
ROBOT = Robot(
    wheelbase_m=0.4,
    wheel_speed_sigma_mps=0.05,
    step_us=40_000,
    field_of_view_rad=2.0 * np.pi,
    bearing_sigma_rad=0.0136,
    range_sigma_fraction=0.02,
    range_sigma_scale_m=110.9,
    wheel_noise="actuation",
)


def circle(beacons: int, measured: int) -> Log:
    """A drive on a circle among so many beacons: all are mapped, then 2, 3 and 4 sightings a step in turn.

    Every beacon is seen from everywhere, one after the other: so the map has its full size at each of the
    measured steps, which are the last ones.
    """
    random = np.random.default_rng(beacons)
    counts = [min(MAPPING_SIGHTINGS, beacons)] * -(-beacons // MAPPING_SIGHTINGS)
    counts += [2 + step % 3 for step in range(measured)]
    step_s = ROBOT.step_us * 1e-6
    turn_rad = SPEED_MPS / RADIUS_M * step_s * np.arange(len(counts), dtype=np.float64)
    time_us = ROBOT.step_us * np.arange(len(counts))
    truth = Truth(time_us, RADIUS_M * np.sin(turn_rad), RADIUS_M * (1.0 - np.cos(turn_rad)), turn_rad)
    half_m = 0.5 * ROBOT.wheelbase_m
    travel_m = np.tile([RADIUS_M - half_m, RADIUS_M + half_m], (len(counts) - 1, 1)) * turn_rad[1]
    travel_m += ROBOT.wheel_speed_sigma_mps * step_s * random.standard_normal(travel_m.shape)
    label = np.arange(sum(counts)) % beacons
    sightings = _sightings(random, truth, np.repeat(np.arange(len(counts)), counts), label, beacons)
    odometry = Odometry("wheels", time_us[1:], *travel_m.T)
    return Log(f"circle of {beacons}", odometry, sightings, truth, None, ROBOT)


def _sightings(
    random: np.random.Generator, truth: Truth, step: NDArray[np.int64], label: NDArray[np.int64], beacons: int
) -> Sightings:
    place_m = _places_m(random, beacons)[label]
    ray_x_m, ray_y_m = place_m[:, 0] - truth.x_m[step], place_m[:, 1] - truth.y_m[step]
    range_m = np.hypot(ray_x_m, ray_y_m)
    sd_m = np.hypot(ROBOT.range_sigma_fraction * range_m, range_m**2 / ROBOT.range_sigma_scale_m)
    bearing_rad = np.arctan2(ray_y_m, ray_x_m) - truth.theta_rad[step]
    bearing_rad += ROBOT.bearing_sigma_rad * random.standard_normal(len(label))
    return Sightings(
        time_us=truth.time_us[step],
        beacon_id=label,
        bearing_rad=np.remainder(bearing_rad + np.pi, 2.0 * np.pi) - np.pi,
        range_m=np.maximum(range_m + sd_m * random.standard_normal(len(label)), 0.01),
        mappable=np.ones(len(label), dtype=np.bool_),
    )


def _places_m(random: np.random.Generator, beacons: int) -> NDArray[np.float64]:
    places_m: list[NDArray[np.float64]] = []
    while len(places_m) < beacons:
        place_m = random.uniform(-HALF_WIDTH_M, HALF_WIDTH_M, 2)
        if all(np.hypot(*(place_m - other)) > APART_M for other in places_m):
            places_m.append(place_m)
    return np.array(places_m)


def simulated(scenario: str, seed: int) -> Log:
    """A drive of the simulator whose wheels jitter: the noise for which all programs have a model."""
    return ScenarioSource(scenario, seed, None, "actuation").load()


def text(log: Log, measured: int, *, identities: bool = True) -> str:
    """The log as programs read it: the last so many steps are measured; identities are told or not.

    The log has wheel travel, true poses, and frames at the times of its steps.
    """
    robot, seen, times_us = log.robot, log.sightings, step_times_us(log)
    assert log.truth is not None
    poses, _ = truth_at(log.truth, times_us)
    travel_m = np.concatenate([np.zeros((1, 2)), np.column_stack(wheel_travel(log))])
    label = seen.beacon_id if identities else np.full(len(seen.beacon_id), -1)
    sightings = np.column_stack([label, seen.bearing_rad, seen.range_m])
    bounds = np.searchsorted(seen.time_us, [*times_us, times_us[-1] + 1]).tolist()
    wheel_sd_m = robot.wheel_speed_sigma_mps * robot.step_us * 1e-6
    model = [robot.wheelbase_m, wheel_sd_m, robot.bearing_sigma_rad, robot.range_sigma_floor_m]
    model += [robot.range_sigma_fraction, 1.0 / robot.range_sigma_scale_m]
    lines = [f"{_words(model)} {robot.step_us} {len(times_us)} {len(times_us) - measured}"]
    for step, row in enumerate(np.column_stack([travel_m, poses]).tolist()):
        frame = sightings[bounds[step] : bounds[step + 1]].tolist()
        lines.append(f"{_words(row)} {len(frame)}")
        lines += [f"{int(one[0])} {_words(one[1:])}" for one in frame]
    return "\n".join(lines) + "\n"


def _words(values: list[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
