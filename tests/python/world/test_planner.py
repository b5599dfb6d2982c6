"""Ways around walls."""

import math
from itertools import pairwise

import numpy as np
import pytest

from bslam.world.arena import Arena, Point, Wall
from bslam.world.planner import RoutePlanner, grid_size
from bslam.world.scenario import Scenario, load_scenario

CELL_M = 0.2
CLEARANCE_M = 0.45


def planner(arena: Arena, start: Point = (1.5, 2.5)) -> RoutePlanner:
    return RoutePlanner(arena, CELL_M, CLEARANCE_M, start)


def length_m(way: list[Point]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(way))


def test_grid_size_counts_a_border_around_the_arena(square: Arena) -> None:
    assert grid_size(square, 0.5) == (10, 10)
    assert grid_size(square, 0.6) == (9, 9)


def test_places_in_a_room_with_a_door_are_those_far_from_walls(paper_room: Scenario) -> None:
    arena = paper_room.arena
    places = planner(arena).places
    assert all(arena.nearest_wall(x_m, y_m)[0] >= CLEARANCE_M for x_m, y_m in places.tolist())
    # Each room is 5.5 x 8 m, its cells lie from 0.5 m off the walls on; in the door's line y is 3.5 to 4.5 m.
    assert (abs(places[:, 0] - 5.5) > 0.5).sum() == 2 * 23 * 36
    assert (abs(places[:, 0] - 5.5) < 0.1).sum() == 6


def test_places_behind_a_closed_door_are_left_out(paper_room: Scenario) -> None:
    closed = Arena((*paper_room.arena.walls, Wall((5.5, 3.0), (5.5, 5.0))), ())
    assert planner(closed).places[:, 0].max() < 5.5
    assert planner(closed, start=(7.0, 2.0)).places[:, 0].min() > 5.5


def test_places_where_nothing_is_free_are_none(square: Arena) -> None:
    assert RoutePlanner(square, 0.2, 2.5, (0.0, 0.0)).places.shape == (0, 2)


def test_route_in_the_open_goes_diagonally_first(square: Arena) -> None:
    way = planner(square, start=(0.0, 0.0)).route((-0.5, -0.5), (0.9, 0.1))
    assert np.array(way).ravel() == pytest.approx(
        [-0.5, -0.5, -0.3, -0.3, -0.1, -0.1, 0.1, 0.1, 0.3, 0.1, 0.5, 0.1, 0.7, 0.1, 0.9, 0.1]
    )


def test_route_to_the_same_place_is_one_cell(square: Arena) -> None:
    assert np.array(
        planner(square, start=(0.0, 0.0)).route((0.1, 0.1), (0.12, 0.08))
    ).ravel() == pytest.approx([0.1, 0.1])


def test_route_from_beside_a_wall_starts_at_the_nearest_free_cell(square: Arena) -> None:
    way = planner(square, start=(0.0, 0.0)).route((1.7, 0.08), (0.1, 0.1))
    assert way[0] == pytest.approx((1.5, 0.1))


def test_route_through_a_door_is_short(paper_room: Scenario) -> None:
    way = planner(paper_room.arena).route((4.9, 1.5), (6.1, 1.5))
    # Straight up to (4.9, 3.1), two diagonals to (5.3, 3.5), one cell to (5.5, 3.5), and back the same way.
    assert length_m(way) == pytest.approx(2.0 * (1.6 + 0.4 * math.sqrt(2.0) + 0.2))


@pytest.mark.parametrize("seed", range(5))
def test_route_in_the_building_goes_from_cell_to_cell_and_keeps_off_the_walls(seed: int) -> None:
    building = load_scenario("building20")
    ways = planner(building.arena, (building.start.x_m, building.start.y_m))
    places = np.random.default_rng(seed).choice(ways.places, size=8).tolist()
    for start, goal in pairwise((x_m, y_m) for x_m, y_m in places):
        way = ways.route(start, goal)
        assert (way[0], way[-1]) == (pytest.approx(start), pytest.approx(goal))
        points = np.array(way)
        assert np.hypot(*np.diff(points, axis=0).T).max() <= CELL_M * math.sqrt(2.0) + 1e-9
        # Between two cells the way is nearer to a wall than in them by half a diagonal at most.
        least_m = building.arena.path_clearance(points[:-1], points[1:]).min()
        assert least_m >= CLEARANCE_M - CELL_M * math.sqrt(0.5)
