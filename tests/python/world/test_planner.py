"""Ways around walls."""

import math
from itertools import pairwise

import numpy as np
import pytest

from bslam.world.arena import Arena, Point, Wall
from bslam.world.planner import RoutePlanner
from bslam.world.scenario import load_scenario

WALL_WITH_DOOR = Arena((Wall((0.0, -10.0), (0.0, 0.0)), Wall((0.0, 2.0), (0.0, 10.0))), ())


def clearance_m(arena: Arena, way: list[Point]) -> float:
    points = np.array(way)
    return float(arena.path_clearance(points[:-1], points[1:]).min())


def length_m(way: list[Point]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(way))


def test_route_in_the_open_is_straight() -> None:
    assert RoutePlanner(WALL_WITH_DOOR, 0.4).route((1.0, 1.0), (5.0, -3.0)) == [(5.0, -3.0)]


def test_route_through_a_door_keeps_the_distance_and_is_short() -> None:
    start, goal = (-3.0, -4.0), (3.0, -4.0)
    way = [start, *RoutePlanner(WALL_WITH_DOOR, 0.4).route(start, goal)]
    assert way[-1] == goal
    assert clearance_m(WALL_WITH_DOOR, way) >= 0.4
    # The shortest way of all winds around a circle; the octagon around it is a little longer.
    assert 2.0 * math.hypot(3.0, 4.0) < length_m(way) < 2.0 * math.hypot(3.0, 4.0) + 1.0


def test_route_through_a_door_too_narrow_is_none() -> None:
    assert (
        RoutePlanner(WALL_WITH_DOOR, 1.05).route((-3.0, 1.0), (3.0, 1.0)) != []
    )  # around the wall's far ends
    closed = Arena((*load_scenario("paper_room").arena.walls, Wall((5.5, 3.0), (5.5, 5.0))), ())
    assert RoutePlanner(closed, 0.4).route((2.0, 4.0), (9.0, 4.0)) == []


def test_route_to_a_goal_in_a_wall_is_none() -> None:
    assert RoutePlanner(WALL_WITH_DOOR, 0.4).route((-3.0, 0.0), (0.2, -3.0)) == []


@pytest.mark.parametrize("seed", range(5))
def test_route_in_the_building_keeps_the_distance(seed: int) -> None:
    building = load_scenario("building20")
    planner = RoutePlanner(building.arena, 0.45)
    random = np.random.default_rng(seed)
    areas = [building.areas[index] for index in random.permutation(len(building.areas))]
    places = [(float(random.uniform(*a.x_m)), float(random.uniform(*a.y_m))) for a in areas]
    free = [place for place in places if building.arena.nearest_wall(*place)[0] > 0.45]
    for start, goal in pairwise(free):
        way = [start, *planner.route(start, goal)]
        assert way[-1] == goal
        assert clearance_m(building.arena, way) >= 0.45 - 1e-12


def test_step_off_goes_straight_away_from_the_wall() -> None:
    x_m, y_m = RoutePlanner(WALL_WITH_DOOR, 0.4).step_off((0.3, -5.0), 0.1)
    assert 0.5 <= x_m < 0.53
    assert y_m == -5.0


def test_step_off_between_two_walls_finds_the_middle() -> None:
    lane = Arena((Wall((-5.0, 0.0), (5.0, 0.0)), Wall((-5.0, 0.7), (5.0, 0.7))), ())
    assert RoutePlanner(lane, 0.4).step_off((0.0, 0.3), 0.1) == pytest.approx((0.0, 0.35), abs=0.02)
