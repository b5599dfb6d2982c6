"""Scenario files: the good ones load, and whatever is wrong in another is named."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from bslam.errors import BslamError
from bslam.world.arena import Wall
from bslam.world.scenario import Scenario, load_scenario, scenario_names


def test_scenario_names_are_those_of_the_package() -> None:
    assert {"paper_room", "pairs", "building20", "building50"} <= set(scenario_names())


@pytest.mark.parametrize("name", scenario_names())
def test_load_scenario_by_name(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.arena.beacons


def test_load_scenario_of_the_paper_is_the_reference_scenario(paper_room: Scenario) -> None:
    assert paper_room.steps * paper_room.step_us == 200_000_000
    assert paper_room.step_us == 40_000
    assert paper_room.arena.high == (11.0, 8.0)
    assert {Wall((5.5, 0.0), (5.5, 3.0)), Wall((5.5, 5.0), (5.5, 8.0))} <= set(paper_room.arena.walls)
    assert [beacon.at for beacon in paper_room.arena.beacons] == [
        (1.5, 0.0),
        (4.0, 0.0),
        (8.5, 0.0),
        (2.5, 8.0),
        (7.0, 8.0),
        (9.5, 8.0),
    ]
    assert (paper_room.body.diameter_m, paper_room.body.wheelbase_m) == (0.6, 0.4)
    assert (paper_room.start.x_m, paper_room.start.y_m, paper_room.start.heading_rad) == (1.5, 2.5, 0.0)
    assert (paper_room.wheels.sigma_mps, paper_room.wheels.noise) == (0.3, "speedometer")
    assert paper_room.sensor.field_of_view_rad == pytest.approx(math.pi)
    assert paper_room.encoders is None


def test_load_scenario_pairs_are_the_papers_beacons_split() -> None:
    places = [beacon.at for beacon in load_scenario("pairs").arena.beacons]
    for (x0, y0), (x1, y1), beacon in zip(
        places[::2], places[1::2], load_scenario("paper_room").arena.beacons, strict=True
    ):
        assert x1 - x0 == pytest.approx(0.4)
        assert y0 == y1
        assert ((x0 + x1) / 2.0, y0) == pytest.approx(beacon.at)


@pytest.mark.parametrize(("name", "beacons"), [("building20", 20), ("building50", 50)])
def test_load_scenario_buildings_are_of_the_size_they_say(name: str, beacons: int) -> None:
    arena = load_scenario(name).arena
    assert (arena.low, arena.high) == ((0.0, 0.0), (30.0, 20.0))
    assert len(arena.beacons) == beacons
    for beacon in arena.beacons:
        assert arena.nearest_wall(*beacon.at)[0] <= 0.021


def test_load_scenario_from_a_path_is_named_after_the_file(edited_room: Callable[..., Path]) -> None:
    scenario = load_scenario(edited_room("steps = 5000", "steps = 7"))
    assert (scenario.name, scenario.steps) == ("edited", 7)


def test_load_scenario_takes_encoders(edited_room: Callable[..., Path]) -> None:
    radii = "left_radius_m = 0.05\nright_radius_m = 0.05\n"
    table = f"[encoders]\n{radii}ticks_per_revolution = 1024\ncounter_bits = 16\n"
    scenario = load_scenario(edited_room("[sensor]\n", f"{table}\n[sensor]\n"))
    assert scenario.encoders is not None
    assert scenario.encoders.counter_bits == 16


SENSOR = "[sensor]\n"
FIRST_WALL = "{ start = [0.0, 0.0], end = [11.0, 0.0] }"
FIRST_BEACON = "{ id = 0, at = [1.5, 0.0] }"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("steps = 5000", "steps = ", r"edited\.toml: not TOML"),
        ("steps = 5000", "", r"edited\.toml, key steps: is missing; allowed: an integer from 1"),
        ("steps = 5000", "steps = 0", r"key steps: 0 is not allowed; allowed: an integer from 1"),
        ("steps = 5000", "steps = 5e3", r"key steps: 5000\.0 is not allowed"),
        ("steps = 5000", "steps = true", r"key steps: True is not allowed"),
        ("steps = 5000", "step = 5000", r"edited\.toml, key step: no such key; allowed: description, steps"),
        ("[body]", "[bodies]", r"edited\.toml, key bodies: no such key"),
        (
            "[body]\ndiameter_m = 0.6\nwheelbase_m = 0.4",
            "",
            r"key body: is missing; allowed: a table \[body\]",
        ),
        ("wheelbase_m = 0.4", "", r"\[body\], key wheelbase_m: is missing; allowed: a number from 0"),
        ("wheelbase_m = 0.4", "wheelbase_m = '0.4'", r"\[body\], key wheelbase_m: '0\.4' is not allowed"),
        (
            "wheelbase_m = 0.4",
            "wheel_base_m = 0.4",
            r"\[body\], key wheel_base_m: no such key; .*wheelbase_m",
        ),
        ("speed_mps = 0.4", "speed_mps = nan", r"\[driving\], key speed_mps: nan is not allowed"),
        (
            "path_clearance_m = 0.45",
            "path_clearance_m = 0.3",
            r"path_clearance_m: 0\.3 .*body's radius, 0\.3",
        ),
        ("cell_m = 0.2", "cell_m = 0.5", r"cell_m: 0\.5 .*at most path_clearance_m, 0\.45"),
        ("cell_m = 0.2", "cell_m = 0.001", r"key cell_m: 0\.001 .*a number from 0\.01 to 10"),
        (FIRST_WALL, "{ start = [0.0, 0.0], end = [9e4, 0.0] }", r"key cell_m: 0\.2 .*1000000 cells at most"),
        ("cells_ahead = 4", "cells_ahead = 0", r"key cells_ahead: 0 .*an integer from 1"),
        ('noise = "speedometer"', 'noise = "white"', r"key noise: 'white' .*'speedometer' or 'actuation'"),
        (SENSOR, SENSOR + "x_m = 0.4\n", r"\[sensor\], keys x_m, y_m: \(0\.4, 0\.0\) .*on the robot's body"),
        ("wheelbase_m = 0.4", "wheelbase_m = 40", r"\[body\], key wheelbase_m: 40 .*from 0\.001 to 10"),
        (SENSOR, SENSOR + "outlier_share = 1.5\n", r"outlier_share: 1\.5 is not allowed; allowed: .* 0 to 1"),
        (SENSOR, "[encoders]\ncounter_bits = 64\n" + SENSOR, r"\[encoders\], key left_radius_m: is missing"),
        (
            "x_m = 1.5",
            "x_m = 0.2",
            r"\[start\], keys x_m, y_m: \(0\.2, 2\.5\) .*a place 0\.3 m from every wall",
        ),
        (FIRST_WALL, "3", r"walls\[0\]: 3 is not allowed; allowed: a table of start, end, doors"),
        (
            FIRST_WALL,
            "{ start = [0.0], end = [1, 1] }",
            r"walls\[0\], key start: \[0\.0\] .*two finite numbers",
        ),
        (FIRST_WALL, "{ start = [0, true], end = [1, 1] }", r"walls\[0\], key start: \[0, True\] is not"),
        (
            FIRST_WALL,
            "{ start = [1, 1], end = [1, 1] }",
            r"walls\[0\], key end: \(1\.0, 1\.0\) .*0\.001 m or more from the start",
        ),
        ("[[3.0, 5.0]]", "[[5.0, 3.0]]", r"walls\[4\], key doors: \[\[5\.0, 3\.0\]\] .*from < to"),
        ("[[3.0, 5.0]]", "[[3.0, 9.0]]", r"walls\[4\], key doors: .*without overlap, within 0 to 8"),
        ("[[3.0, 5.0]]", "[[3.0, 5.0], [4, 6]]", r"walls\[4\], key doors: .*without overlap"),
        (FIRST_BEACON, "{ id = 1, at = [1.5, 0.0] }", r"beacons\[1\], key id: 1 .*an id of its own"),
        (FIRST_BEACON, "{ id = -1, at = [1.5, 0.0] }", r"beacons\[0\], key id: -1 .*integer from 0"),
        (FIRST_BEACON, "{ id = 5000000000, at = [1.5, 0.0] }", r"key id: 5000000000 .*0 to 2147483647"),
        (
            "steps = 5000",
            "steps = 5\nareas = [{ x_m = [2, 1], y_m = [0, 1] }]",
            r"areas\[0\], key x_m: \[2, 1\]",
        ),
        ("steps = 5000", "steps = 5\nareas = 3", r"key areas: 3 is not allowed; allowed: a list of tables"),
    ],
)
def test_load_scenario_with_a_fault_names_file_key_value_and_what_is_allowed(
    edited_room: Callable[..., Path], old: str, new: str, expected: str
) -> None:
    path = edited_room(old, new)
    with pytest.raises(BslamError, match=expected) as caught:
        load_scenario(path)
    assert str(path) in str(caught.value)


def test_load_scenario_with_no_walls_left_says_so(tmp_path: Path, edited_room: Callable[..., Path]) -> None:
    text = edited_room("steps", "steps").read_text()
    begin, end = text.index("walls = ["), text.index("beacons = [")
    path = tmp_path / "open.toml"
    open_wall = "walls = [{ start = [0, 0], end = [1, 0], doors = [[0, 1]] }]\n"
    for walls, expected in (
        ("walls = []\n", "at least one"),
        (open_wall, "some wall left between the doors"),
    ):
        path.write_text(text[:begin] + walls + text[end:])
        with pytest.raises(BslamError, match=expected):
            load_scenario(path)


@pytest.mark.parametrize("name", ["nowhere", "nowhere.toml"])
def test_load_scenario_that_is_not_there_lists_those_that_are(name: str) -> None:
    with pytest.raises(BslamError, match=rf"scenario '{name}': .*allowed: building20, .*paper_room.*\.toml"):
        load_scenario(name)
