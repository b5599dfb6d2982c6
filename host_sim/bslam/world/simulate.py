"""One drive through a scenario: from a scenario and a seed to a log."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.log import (
    WHEEL_NOISES,
    WHEEL_SPEED_SIGMA_MPS,
    Beacons,
    Log,
    Odometry,
    Robot,
    Sightings,
    Truth,
    wrap_rad,
)
from bslam.world.crowd import Screens
from bslam.world.driving import Drive, drive
from bslam.world.scenario import Scenario, Start, load_scenario, scenario_names
from bslam.world.sensor import see
from bslam.world.signatures import generic_looks
from bslam.world.untold import as_built, coloured, gaps_us, mishaps, within
from bslam.world.wheels import count_ticks, read_gyro, read_travel

__all__ = ["load_scenario", "scenario_names", "simulate", "true_drive", "with_noise"]

_DRIVING, _WHEELS, _SENSING, _GYRO, _SLIPS, _GAPS = range(6)  # streams of random numbers
_REDRAW_STREAM = 77  # of wheels whose noise is drawn anew
_BIAS_AS_NOISE_S = 2.0


def simulate(scenario: Scenario, seed: int, sigma_mps: float | None = None, noise: str | None = None) -> Log:
    """Drive, and record what the wheels and the sensor say.

    The seed makes the drive, the wheel noise and the sensing noise, each on its own: speedometer noise
    changes neither the path nor the sightings. `sigma_mps` and `noise` ("speedometer", "actuation") stand in
    for the scenario's. Raises BslamError if they are not allowed, or if there is nowhere to go in the arena.
    """
    scenario = with_noise(scenario, sigma_mps, noise)
    time_us = np.arange(scenario.steps + 1, dtype=np.int64) * scenario.step_us
    path = true_drive(scenario, seed)
    poses = np.stack([path.x_m, path.y_m, path.theta_rad], axis=1)
    stream, screens = _random_streams(seed)[_SENSING], _screens(scenario, path)
    true_sensor = as_built(scenario).sensor
    sightings = see(scenario.arena, true_sensor, time_us, poses, stream, screens, scenario.mismatch)
    missing_us = gaps_us(scenario, _random_streams(seed)[_GAPS])
    blind_us = missing_us if scenario.gaps is not None and scenario.gaps.blind else missing_us[:0]
    in_time = sightings.time_us <= time_us[-1]  # those that are delayed arrive after the end
    x_m, y_m = _to_map_frame(scenario.start, path.x_m, path.y_m)
    return Log(
        name=f"{scenario.name}_seed{seed}",
        odometry=_without(_read_odometry(scenario, seed, time_us[1:], path), missing_us),
        sightings=_kept(sightings, in_time & ~within(sightings.time_us, blind_us)),
        truth=Truth(time_us, x_m, y_m, wrap_rad(path.theta_rad - scenario.start.heading_rad)),
        beacons=_true_map(scenario),
        robot=_describe_robot(scenario),
        seeds=generic_looks(),
    )


def _screens(scenario: Scenario, path: Drive) -> Screens | None:
    """Whoever may have stood in the way of a sight."""
    hiding = [index for index, mover in enumerate(scenario.movers) if mover.hides]
    if not hiding:
        return None
    radius_m = np.array([scenario.movers[index].radius_m for index in hiding])
    return Screens(path.others_m[:, hiding], radius_m)


def true_drive(scenario: Scenario, seed: int) -> Drive:
    """The motion behind the log that `simulate` makes, in the arena's frame."""
    jitter_m = _wheel_noise_m(scenario, seed) if scenario.wheels.noise == "actuation" else None
    streams = _random_streams(seed)
    untold = mishaps(scenario, streams[_SLIPS], streams[_GAPS])
    return drive(as_built(scenario), streams[_DRIVING], jitter_m, untold)


def with_noise(scenario: Scenario, sigma_mps: float | None, noise: str | None) -> Scenario:
    """The scenario with this wheel noise where it is not None. Raises BslamError if it is not allowed."""
    wheels = scenario.wheels
    sigma_mps = wheels.sigma_mps if sigma_mps is None else sigma_mps
    noise = wheels.noise if noise is None else noise
    sigma_mps = WHEEL_SPEED_SIGMA_MPS.convert(sigma_mps, "wheel-speed sigma, m/s")
    if noise not in WHEEL_NOISES:
        raise BslamError(f"wheel noise: {noise!r} is not allowed; allowed: {' or '.join(WHEEL_NOISES)}")
    return replace(scenario, wheels=replace(wheels, sigma_mps=sigma_mps, noise=noise))


def _random_streams(seed: int) -> list[np.random.Generator]:
    """One for each of _DRIVING to _GAPS: more of them leave the first ones as they are."""
    if seed < 0:
        raise BslamError(f"seed: {seed!r} is not allowed; allowed: an integer from 0")
    return np.random.default_rng(seed).spawn(6)


def _wheel_noise_m(scenario: Scenario, seed: int) -> NDArray[np.float64]:
    """Noise of the left and right wheel's travel in each step, (steps, 2)."""
    sigma_m = scenario.wheels.sigma_mps * scenario.step_us * 1e-6
    first, draw = _random_streams(seed)[_WHEELS], scenario.wheels.draw
    stream = np.random.default_rng([seed, _REDRAW_STREAM, draw]) if draw > 0 else first
    white = stream.standard_normal((scenario.steps, 2))
    return sigma_m * coloured(white, scenario.step_us * 1e-6, scenario.wheels.noise_time_s)


def _read_odometry(scenario: Scenario, seed: int, time_us: NDArray[np.int64], path: Drive) -> Odometry:
    """What the wheels' sensors say: the travel with noise, or the travel without the jitter that it had.

    A wheel that is larger than told turns less on its way.
    """
    travel_m = np.stack([path.left_m, path.right_m], axis=1)
    off = scenario.mismatch
    told_over_true = 1.0 / np.array([off.left_radius_scale, off.right_radius_scale])
    noise_m = _wheel_noise_m(scenario, seed)
    if scenario.wheels.noise == "speedometer":
        travel_m = travel_m * told_over_true + noise_m
    else:
        travel_m = (travel_m - np.where(path.stalled[:, np.newaxis], 0.0, noise_m)) * told_over_true
    if scenario.encoders is None:
        odometry = read_travel(time_us, travel_m)
    else:
        odometry = count_ticks(scenario.encoders, time_us, travel_m)
    if scenario.gyro is None:
        return odometry
    rate_radps = read_gyro(scenario.gyro, _random_streams(seed)[_GYRO], path.theta_rad, scenario.step_us)
    unsaid = np.full(len(odometry.time_us) - len(rate_radps), np.nan)  # the counters' first row moves nothing
    return replace(odometry, gyro_radps=np.concatenate([unsaid, rate_radps]))


def _without(odometry: Odometry, missing_us: NDArray[np.int64]) -> Odometry:
    """The rows that are not in a gap."""
    kept = ~within(odometry.time_us, missing_us)
    gyro_radps = None if odometry.gyro_radps is None else odometry.gyro_radps[kept]
    columns = (odometry.time_us[kept], odometry.a[kept], odometry.b[kept])
    return Odometry(odometry.kind, *columns, gyro_radps)


def _kept(sightings: Sightings, kept: NDArray[np.bool_]) -> Sightings:
    """Those rows of what `see` gives."""
    assert sightings.signature is not None
    return Sightings(
        time_us=sightings.time_us[kept],
        beacon_id=sightings.beacon_id[kept],
        bearing_rad=sightings.bearing_rad[kept],
        range_m=sightings.range_m[kept],
        mappable=sightings.mappable[kept],
        signature=sightings.signature[kept],
    )


def _to_map_frame(
    start: Start, x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """From the arena's frame to that of the start pose, in which the estimator works."""
    cos, sin = math.cos(start.heading_rad), math.sin(start.heading_rad)
    east_m, north_m = x_m - start.x_m, y_m - start.y_m
    return cos * east_m + sin * north_m, cos * north_m - sin * east_m


def _true_map(scenario: Scenario) -> Beacons:
    beacons = scenario.arena.beacons
    beacon_id = np.array([one.beacon_id for one in beacons], dtype=np.int64)
    x_m, y_m = scenario.arena.beacon_xy_m.T
    return Beacons(beacon_id, *_to_map_frame(scenario.start, x_m, y_m))


def _describe_robot(scenario: Scenario) -> Robot:
    sensor, encoders = scenario.sensor, scenario.encoders
    return Robot(
        wheelbase_m=scenario.body.wheelbase_m,
        wheel_speed_sigma_mps=scenario.wheels.sigma_mps,
        wheel_noise=scenario.wheels.noise,
        step_us=scenario.step_us,
        field_of_view_rad=sensor.field_of_view_rad,
        bearing_sigma_rad=sensor.bearing_sigma_rad,
        range_sigma_fraction=sensor.range_sigma_fraction,
        range_sigma_scale_m=sensor.range_sigma_scale_m,
        range_sigma_floor_m=sensor.range_sigma_floor_m,
        sensor_x_m=sensor.x_m,
        sensor_y_m=sensor.y_m,
        sensor_yaw_rad=sensor.yaw_rad,
        sighting_delay_us=sensor.delay_us,
        gyro_sigma_radps=_gyro_sigma_radps(scenario),
        left_radius_m=None if encoders is None else encoders.left_radius_m,
        right_radius_m=None if encoders is None else encoders.right_radius_m,
        ticks_per_revolution=None if encoders is None else encoders.ticks_per_revolution,
        counter_bits=None if encoders is None else encoders.counter_bits,
    )


def _gyro_sigma_radps(scenario: Scenario) -> float:
    """What the filter is told, which has no state for the bias: noise as bad after _BIAS_AS_NOISE_S."""
    gyro = scenario.gyro
    if gyro is None:
        return float(Robot.gyro_sigma_radps)  # the default of what plays no part
    steps = _BIAS_AS_NOISE_S / (scenario.step_us * 1e-6)
    return math.hypot(gyro.sigma_radps, gyro.bias_sigma_radps * math.sqrt(steps))
