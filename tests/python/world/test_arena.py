"""Geometry of walls and sight lines."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bslam.world.arena import Arena, Beacon, Wall

coordinate = st.floats(-10.0, 10.0)
point = st.tuples(coordinate, coordinate)
ONE_WALL = Arena((Wall((0.0, 0.0), (4.0, 0.0)),), ())


@pytest.mark.parametrize(
    ("at", "distance_m", "away"),
    [
        ((2.0, 3.0), 3.0, (0.0, 1.0)),  # beside the wall
        ((2.0, -3.0), 3.0, (0.0, -1.0)),
        ((7.0, 4.0), 5.0, (0.6, 0.8)),  # beyond one end
        ((-3.0, -4.0), 5.0, (-0.6, -0.8)),  # beyond the other
        ((1.0, 0.0), 0.0, (0.0, 0.0)),  # on it
    ],
)
def test_nearest_wall_is_the_foot_of_the_perpendicular_or_an_end(
    at: tuple[float, float], distance_m: float, away: tuple[float, float]
) -> None:
    assert ONE_WALL.nearest_wall(*at) == pytest.approx((distance_m, *away))


def test_nearest_wall_without_walls_is_infinitely_far() -> None:
    assert Arena((), ()).nearest_wall(0.0, 0.0) == (math.inf, 0.0, 0.0)


@given(point, point, point, point)
def test_path_clearance_is_the_least_distance_of_any_two_points(a, b, p, q) -> None:
    assume(math.dist(p, q) > 1e-3)
    arena = Arena((Wall(p, q),), ())
    clearance_m = float(arena.path_clearance(np.array([a]), np.array([b]))[0])
    share = np.linspace(0.0, 1.0, 400)
    on_path = np.array(a) + share[:, np.newaxis] * (np.array(b) - np.array(a))
    sampled_m = min(arena.nearest_wall(x_m, y_m)[0] for x_m, y_m in on_path.tolist())
    spacing_m = math.dist(a, b) / 399
    assert sampled_m - spacing_m - 1e-6 <= clearance_m <= sampled_m + 1e-6


def sees(arena: Arena, eye: tuple[float, float], target: tuple[float, float]) -> bool:
    return bool(arena.in_sight(np.array([eye]), np.array([target]))[0])


@pytest.mark.parametrize(
    ("eye", "target", "visible"),
    [
        ((2.0, -1.0), (2.0, 1.0), False),  # straight through
        ((0.0, -1.0), (5.0, 1.0), False),  # aslant
        ((3.0, -1.0), (6.0, 1.0), True),  # past the end
        ((2.0, 1.0), (3.0, 2.0), True),  # on this side of it
        ((2.0, -1.0), (2.0, 0.0), True),  # a beacon that hangs on the wall
        ((2.0, -1.0), (2.0, 0.02), False),  # a beacon 2 cm before its other side
        ((2.0, -1.0), (4.0, 0.0), True),  # a beacon at its end
        ((-1.0, 0.0), (5.0, 0.0), True),  # along it: a wall has no thickness
        ((2.0, -1.0), (2.0, -1.0), False),  # nothing is seen from its own place
    ],
)
def test_in_sight_needs_a_line_that_no_wall_crosses(
    eye: tuple[float, float], target: tuple[float, float], visible: bool
) -> None:
    assert sees(ONE_WALL, eye, target) is visible


@given(eye=st.tuples(coordinate, st.floats(-10.0, -0.1)), target=st.tuples(coordinate, st.floats(0.1, 10.0)))
def test_in_sight_across_the_wall_is_blocked_where_the_line_meets_it(eye, target) -> None:
    meets_x_m = eye[0] + (target[0] - eye[0]) * -eye[1] / (target[1] - eye[1])
    if min(abs(meets_x_m), abs(meets_x_m - 4.0)) > 1e-6:
        assert sees(ONE_WALL, eye, target) is not (0.0 < meets_x_m < 4.0)
        assert sees(ONE_WALL, target, eye) is sees(ONE_WALL, eye, target)


def test_bounding_box_and_beacon_places() -> None:
    arena = Arena((Wall((1.0, 2.0), (3.0, -4.0)), Wall((0.0, 0.0), (1.0, 5.0))), (Beacon(3, (1.5, 2.5)),))
    assert (arena.low, arena.high) == ((0.0, -4.0), (3.0, 5.0))
    assert arena.beacon_xy_m.tolist() == [[1.5, 2.5]]
    assert Arena(arena.walls, ()).beacon_xy_m.shape == (0, 2)
