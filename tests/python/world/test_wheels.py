"""What the wheels say of the motion."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bslam.world.scenario import Encoders
from bslam.world.wheels import count_ticks, read_travel

travels = st.lists(st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)), min_size=1, max_size=200)


def test_read_travel_is_the_travel_of_every_step() -> None:
    odometry = read_travel(np.array([40_000, 80_000]), np.array([[0.1, 0.2], [0.3, 0.4]]))
    assert odometry.kind == "wheels"
    assert odometry.time_us.tolist() == [40_000, 80_000]
    assert (odometry.a.tolist(), odometry.b.tolist()) == ([0.1, 0.3], [0.2, 0.4])


def test_count_ticks_starts_at_zero_and_counts_whole_ticks() -> None:
    encoders = Encoders(left_radius_m=0.05, right_radius_m=0.1, ticks_per_revolution=1000, counter_bits=16)
    turn_m = 2.0 * math.pi * 0.05
    odometry = count_ticks(encoders, np.array([40_000]), np.array([[1.0005 * turn_m, 1.0011 * turn_m]]))
    assert odometry.kind == "ticks"
    assert odometry.time_us.tolist() == [0, 40_000]
    assert (odometry.a.tolist(), odometry.b.tolist()) == ([0.0, 1000.0], [0.0, 500.0])


def test_count_ticks_rolls_under_zero_when_driving_back() -> None:
    encoders = Encoders(left_radius_m=0.05, right_radius_m=0.05, ticks_per_revolution=1000, counter_bits=8)
    back_m = np.full((1, 2), -2.5 * 2.0 * math.pi * 0.05 / 1000.0)
    assert count_ticks(encoders, np.array([1]), back_m).a.tolist() == [0.0, 253.0]


@given(travels)
def test_count_ticks_differences_modulo_give_the_travel_back(travel: list[tuple[float, float]]) -> None:
    """An 8 bit counter rolls over after 8 cm here: more than a step, less than the way."""
    encoders = Encoders(left_radius_m=0.05, right_radius_m=0.05, ticks_per_revolution=1000, counter_bits=8)
    tick_m = 2.0 * math.pi * 0.05 / 1000.0
    travel_m = np.clip(np.array(travel), -126 * tick_m, 126 * tick_m)  # a counter tells half its range
    odometry = count_ticks(encoders, np.arange(1, len(travel) + 1), travel_m)
    for counter, wheel_m in ((odometry.a, travel_m[:, 0]), (odometry.b, travel_m[:, 1])):
        assert counter.min() >= 0.0
        assert counter.max() <= 255.0
        signed_ticks = np.mod(np.diff(counter) + 128.0, 256.0) - 128.0
        assert np.cumsum(signed_ticks) * tick_m == pytest.approx(np.cumsum(wheel_m), abs=1.001 * tick_m)
