"""How wheel travel moves the body, and how walls hold it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bslam.world.arena import Arena, Wall
from bslam.world.robot import Body, Feeler, move_on_arc

travel = st.floats(-0.5, 0.5)
START = (1.0, 2.0, 0.5)


def test_move_on_arc_straight_goes_ahead() -> None:
    x_m, y_m, theta_rad = move_on_arc(START, 0.3, 0.3, 0.4)
    assert (x_m, y_m) == pytest.approx((1.0 + 0.3 * math.cos(0.5), 2.0 + 0.3 * math.sin(0.5)))
    assert theta_rad == 0.5


def test_move_on_arc_against_each_other_turns_on_the_spot() -> None:
    assert move_on_arc(START, -0.1, 0.1, 0.4) == pytest.approx((1.0, 2.0, 1.0))


def test_move_on_arc_around_one_wheel_makes_a_quarter_circle() -> None:
    """The left wheel stands: the middle goes around it, half a wheelbase away."""
    x_m, y_m, theta_rad = move_on_arc((0.0, 0.0, 0.0), 0.0, 0.4 * math.pi / 2.0, 0.4)
    assert (x_m, y_m, theta_rad) == pytest.approx((0.2, 0.2, math.pi / 2.0))


@given(travel, travel)
def test_move_on_arc_is_the_limit_of_many_small_moves(left_m: float, right_m: float) -> None:
    pose = START
    for _ in range(2000):
        x_m, y_m, theta_rad = pose
        forward_m = 0.5 * (left_m + right_m) / 2000
        theta_rad += 0.5 * (right_m - left_m) / 0.4 / 2000  # midpoint rule: the error falls with the square
        x_m, y_m = x_m + forward_m * math.cos(theta_rad), y_m + forward_m * math.sin(theta_rad)
        pose = (x_m, y_m, theta_rad + 0.5 * (right_m - left_m) / 0.4 / 2000)
    assert move_on_arc(START, left_m, right_m, 0.4) == pytest.approx(pose, abs=1e-6)


@given(travel, travel)
def test_move_on_arc_back_is_the_way_it_came(left_m: float, right_m: float) -> None:
    there = move_on_arc(START, left_m, right_m, 0.4)
    assert move_on_arc(there, -left_m, -right_m, 0.4) == pytest.approx(START, abs=1e-12)


def test_roll_into_a_wall_stalls_and_moves_nothing(square: Arena) -> None:
    body = Body(square, (1.69, 0.0, 0.3), radius_m=0.3, wheelbase_m=0.4)
    assert not body.roll(0.02, 0.02)
    assert body.pose == (1.69, 0.0, 0.3)


def test_roll_at_a_wall_still_turns_and_leaves(square: Arena) -> None:
    body = Body(square, (1.7, 0.0, 0.0), radius_m=0.3, wheelbase_m=0.4)
    assert body.roll(-0.01, 0.01)
    assert body.roll(-0.02, -0.02)
    assert body.pose[0] < 1.7


def test_roll_does_not_jump_a_wall_in_one_long_step() -> None:
    body = Body(Arena((Wall((1.0, -5.0), (1.0, 5.0)),), ()), (0.0, 0.0, 0.0), radius_m=0.3, wheelbase_m=0.4)
    assert not body.roll(3.0, 3.0)
    assert body.roll(-3.0, -3.0)


@given(st.lists(st.tuples(travel, travel), max_size=60))
def test_roll_never_brings_the_body_into_a_wall(travels: list[tuple[float, float]]) -> None:
    corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    arena = Arena(tuple(Wall(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)), ())
    body = Body(arena, (0.0, 0.0, 0.0), radius_m=0.3, wheelbase_m=0.4)
    for left_m, right_m in travels:
        body.roll(left_m, right_m)
        assert max(abs(body.pose[0]), abs(body.pose[1])) <= 0.7


@given(st.lists(st.tuples(st.floats(-1.9, 1.9), st.floats(-1.9, 1.9)), max_size=30), st.floats(0.1, 2.0))
def test_nearest_within_is_what_a_fresh_measurement_says(
    places: list[tuple[float, float]], reach_m: float
) -> None:
    arena = Arena((Wall((-2.0, 2.0), (2.0, 2.0)), Wall((0.5, -1.0), (0.5, 0.0))), ())
    feeler = Feeler(arena)
    for x_m, y_m in places:
        measured = arena.nearest_wall(x_m, y_m)
        felt = feeler.nearest_within(x_m, y_m, reach_m)
        assert felt == (measured if measured[0] < reach_m else None)
