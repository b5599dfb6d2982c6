"""Short seeded runs to feed a filter with: a robot that drives within a ring of beacons and sees them.

Nothing here is a model of anything in particular; the simulator of the experiments is bslam.world.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from reference.dense_ekf import Sighting, wrap

STEP_US = 40_000
STEP_S = STEP_US * 1e-6

PARAMS: dict[str, float] = {
    "filter": 0,
    "correlation_m": -1.0,
    "motion": 1,
    "velocity_states": 0,
    "scale_states": 0,
    "velocity_sd_mps": 0.3,
    "velocity_walk_mps_sqrt_s": 0.2,
    "velocity_decay_s": 8.0,
    "turn_rate_sd_radps": 0.4,
    "turn_rate_walk_radps_sqrt_s": 0.6,
    "turn_rate_decay_s": 5.0,
    "forward_scale": 1.0,
    "turn_scale": 1.0,
    "scale_sd": 0.1,
    "scale_walk_sqrt_s": 0.002,
    "wheelbase_m": 0.4,
    "left_speed_sd_mps": 0.3,
    "right_speed_sd_mps": 0.2,
    "travel_sd_per_sqrt_m": 0.02,
    "forward_sd_per_sqrt_s": 0.005,
    "forward_sd_per_sqrt_m": 0.01,
    "turn_sd_per_sqrt_s": 0.004,
    "turn_sd_per_sqrt_m": 0.01,
    "turn_sd_per_sqrt_rad": 0.02,
    "mount_x_m": 0.15,
    "mount_y_m": -0.05,
    "mount_yaw_rad": 0.3,
    "bearing_sd_rad": 0.02,
    "range_sd_floor_m": 0.01,
    "range_sd_fraction": 0.02,
    "range_sd_per_m": 0.009,
    "range_scale_sd": 0.0,
    "bearing_only_variance_factor": 2.0,
    "bearing_only_curvature_factor": 1.0,
    "gate_d2": 0.0,
    "huber_d": 0.0,
    "ray_inverse_distance_per_m": 0.2,
    "ray_inverse_distance_sd_per_m": 0.1,
    "ray_linear_limit": 0.3,
    "association": 0,
    "sighting_delay_us": 0,
    "confirm_window_us": 0,
    "speed_max_mps": 1000.0,
}
"""Every value that the reference reads or that could make the C core do something else, whatever its
default.
"""


@dataclass(frozen=True)
class Step:
    """One step of a run: what the wheels report since the step before, and what is seen then."""

    time_us: int
    left_m: float
    right_m: float
    sightings: list[Sighting]


def mount(params: dict[str, float]) -> tuple[float, float, float]:
    """The sensor on the robot."""
    return params["mount_x_m"], params["mount_y_m"], params["mount_yaw_rad"]


def places(count: int) -> list[tuple[float, float]]:
    """Beacons in a ring of 3 to 6 m around the middle of the robot's circle."""
    angles = 2 * np.pi * np.arange(count) / count
    radii = 3 + 3 * (np.arange(count) * 0.618 % 1)
    return [(r * np.cos(a), 1.5 + r * np.sin(a)) for r, a in zip(radii, angles, strict=True)]


def _look(
    rng: np.random.Generator,
    params: dict[str, float],
    pose: tuple[float, float, float],
    label: int,
    place: tuple[float, float],
) -> Sighting:
    """What the sensor reports of a beacon: every third one in direction only."""
    mount_x, mount_y, yaw = mount(params)
    x, y, theta = pose
    dx = place[0] - (x + np.cos(theta) * mount_x - np.sin(theta) * mount_y)
    dy = place[1] - (y + np.sin(theta) * mount_x + np.cos(theta) * mount_y)
    bearing = np.arctan2(dy, dx) - theta - yaw + rng.normal(0, params["bearing_sd_rad"])
    range_m = np.hypot(dx, dy) * (1 + rng.normal(0, 0.03))
    return Sighting(label, wrap(bearing), None if label % 3 == 2 else float(range_m))


def run(seed: int, steps: int, beacons: int, params: dict[str, float]) -> Iterator[Step]:
    """The steps of one run. The robot drives circles of about 1.5 m; a beacon in three is seen in direction
    only, and each is seen in half the frames.
    """
    rng = np.random.default_rng(seed)
    x = y = theta = 0.0
    half_base = params["wheelbase_m"] / 2
    for k in range(steps):
        v = 0.5 + 0.2 * np.sin(0.05 * k)
        omega = v / 1.5 + 0.3 * np.sin(0.11 * k)
        if k > 0:
            middle = theta + omega * STEP_S / 2
            x, y = x + v * STEP_S * np.cos(middle), y + v * STEP_S * np.sin(middle)
            theta = wrap(theta + omega * STEP_S)
        wheels = np.array([v - omega * half_base, v + omega * half_base]) * STEP_S
        errors = rng.normal(0, [params["left_speed_sd_mps"], params["right_speed_sd_mps"]]) * STEP_S
        left_m, right_m = (wheels + errors).tolist()
        sightings = [
            _look(rng, params, (x, y, theta), label, place)
            for label, place in enumerate(places(beacons))
            if k == 0 or rng.random() < 0.5
        ]
        yield Step(k * STEP_US, left_m, right_m, sightings)
