"""Clutter that stands and clutter that moves: what they hide, what they stop, and who gives way."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.world.arena import Arena, Beacon, Box, Wall
from bslam.world.camera import dress
from bslam.world.crowd import Crowd, Mover, Screens
from bslam.world.robot import Body
from bslam.world.scenario import Scenario, load_scenario
from bslam.world.simulate import simulate, true_drive

STEP_S = 0.04
WALLS = (Wall((-9.0, -9.0), (9.0, -9.0)),)


def seen_past(box: Box) -> list[bool]:
    """Whether (4, 0), behind the box, and (0, 4), beside it, are seen from (0, 0)."""
    arena = Arena(WALLS, (Beacon(0, (4.0, 0.0)),), (box,))
    return arena.in_sight(np.zeros((2, 2)), np.array([[4.0, 0.0], [0.0, 4.0]])).tolist()


def test_high_box_hides_what_is_behind_and_a_low_one_does_not() -> None:
    assert seen_past(Box((2.0, 0.0), (0.5, 0.5))) == [False, True]
    assert seen_past(Box((2.0, 0.0), (0.5, 0.5), hides=False)) == [True, True]


def test_box_is_turned_about_its_middle() -> None:
    long = Box((2.0, 0.0), (3.0, 0.1), turn_rad=math.pi / 2)
    ends = np.array([side.start for side in long.sides])
    assert np.abs(ends[:, 0] - 2.0).max() == pytest.approx(0.05)
    assert np.abs(ends[:, 1]).max() == pytest.approx(1.5)


@pytest.mark.parametrize("hides", [True, False])
def test_box_stops_a_robot_whether_it_hides_or_not(hides: bool) -> None:
    body = Body(Arena(WALLS, (), (Box((1.0, 0.0), (0.4, 0.4), 0.0, hides),)), (0.0, 0.0, 0.0), 0.3, 0.4)
    rolled = 0
    while body.roll(0.01, 0.01):
        rolled += 1
    assert body.pose[0] == pytest.approx(1.0 - 0.2 - 0.3, abs=0.011)


def mover(**changes: object) -> Mover:
    settings = {
        "path": ((0.0, 0.0), (2.0, 0.0)),
        "speed_mps": 1.0,
        "radius_m": 0.25,
        "pause_s": 1.0,
        "hides": True,
        "looks": "person",
    }
    return Mover(**(settings | changes))  # type: ignore[arg-type]


def test_mover_goes_to_and_fro_at_its_speed_and_pauses_at_the_ends() -> None:
    crowd = Crowd([mover()], STEP_S, 0.3, np.random.default_rng(0))
    places = []
    for _ in range(round(6.0 / STEP_S)):  # 2 s there, 1 s pause, 2 s back, 1 s pause
        crowd.step((50.0, 50.0))
        places.append(crowd.discs()[0][0])
    ways = np.abs(np.diff(places))
    assert min(places) == pytest.approx(0.0, abs=1e-9)
    assert max(places) == pytest.approx(2.0, abs=1e-9)
    assert ways.max() == pytest.approx(STEP_S)
    assert np.mean(ways < 1e-9) == pytest.approx(1 / 3, abs=0.03)


def test_mover_waits_for_the_robot_and_goes_on_when_it_has_gone() -> None:
    crowd = Crowd([mover(pause_s=0.0)], STEP_S, 0.3, np.random.default_rng(0))
    nearest = math.inf
    for _ in range(500):
        crowd.step((1.0, 0.0))
        nearest = min(nearest, abs(crowd.discs()[0][0] - 1.0))
    assert nearest >= 0.25 + 0.3 or nearest < 0.65
    stood = crowd.discs()[0][0]
    crowd.step((1.0, 0.0))
    assert crowd.discs()[0][0] == stood
    crowd.step((9.0, 9.0))
    assert crowd.discs()[0][0] != stood


def test_robot_bumps_into_who_is_in_the_way_but_can_turn_from_them() -> None:
    body = Body(Arena(WALLS, ()), (0.0, 0.0, 0.0), 0.3, 0.4)
    body.others = [(0.56, 0.0, 0.25)]
    assert not body.roll(0.02, 0.02)
    assert body.pose == (0.0, 0.0, 0.0)
    assert body.roll(-0.02, 0.02)
    assert body.roll(-0.02, -0.02)


def test_screen_hides_what_is_behind_it_at_that_pose_only() -> None:
    screens = Screens(np.array([[[2.0, 0.1]], [[2.0, 3.0]]]), np.array([0.25]))
    eye, target = np.zeros((2, 2)), np.array([[4.0, 0.0], [4.0, 0.0]])
    assert screens.hide(np.array([0, 1]), eye, target).tolist() == [True, False]
    assert screens.hide(np.array([0]), eye[:1], np.array([[1.0, 0.0]])).tolist() == [False]


@pytest.fixture
def hall() -> Scenario:
    return Scenario(**(vars(load_scenario("busy_hall")) | {"steps": 1500}))


def test_people_hide_beacons_and_change_nothing_of_a_hall_without_them(hall: Scenario) -> None:
    def ghosts(scenario: Scenario) -> Scenario:
        return Scenario(
            **(
                vars(scenario)
                | {"movers": tuple(mover(**vars(one) | {"hides": False}) for one in hall.movers)}
            )
        )

    with_people, with_ghosts = simulate(hall, 3), simulate(ghosts(hall), 3)
    assert with_people.truth is not None
    assert with_ghosts.truth is not None
    assert with_people.truth.x_m.tolist() == with_ghosts.truth.x_m.tolist()
    assert 0.5 * len(with_ghosts.sightings.time_us) < len(with_people.sightings.time_us)
    assert len(with_people.sightings.time_us) < len(with_ghosts.sightings.time_us)


def test_robot_in_a_crowd_never_gets_into_anybody(hall: Scenario) -> None:
    path = true_drive(hall, 5)
    robot = np.stack([path.x_m, path.y_m], axis=1)
    radius_m = np.array([one.radius_m for one in hall.movers]) + hall.body.diameter_m / 2.0
    distance_m = np.hypot(*(path.others_m - robot[:, np.newaxis]).T).T
    start_m = distance_m[0]
    assert (distance_m >= np.minimum(radius_m, start_m) - 0.02).all()
    assert np.ptp(robot, axis=0).min() > 2.0, "it gets about all the same"


def test_same_seed_same_crowd_and_another_seed_another(hall: Scenario) -> None:
    first, again, other = (true_drive(hall, seed).others_m for seed in (1, 1, 2))
    assert first.tolist() == again.tolist()
    assert first[0].tolist() != other[0].tolist()


def test_way_points_are_visited_in_turn(edited_room: Callable[..., Path]) -> None:
    goals = [(3.0, 6.0), (9.0, 1.5)]
    waypoints = f"waypoints = {[list(one) for one in goals]}\n"
    path = true_drive(load_scenario(edited_room("[driving]\n", f"[driving]\n{waypoints}")), 0)
    near = [np.hypot(path.x_m - x, path.y_m - y) < 0.6 for x, y in goals]
    order = [index for flags in np.stack(near, axis=1) for index in np.flatnonzero(flags)]
    visits = [one for at, one in enumerate(order) if at == 0 or order[at - 1] != one]
    assert visits[:4] == [0, 1, 0, 1]


def test_recorded_way_is_gone_as_recorded(
    edited_room: Callable[..., Path], tmp_path: Path, paper_room: Scenario
) -> None:
    short = Scenario(**(vars(paper_room) | {"steps": 400}))
    log = simulate(short, 8)
    log.write(tmp_path / "drive")
    file = edited_room("[driving]\n", f'[driving]\nrecorded = "{tmp_path / "drive" / "truth.csv"}"\n')
    file.write_text(file.read_text().replace("steps = 5000", "steps = 400"))
    again = simulate(load_scenario(file), 99)
    assert log.truth is not None
    assert again.truth is not None
    np.testing.assert_allclose(again.truth.x_m, log.truth.x_m, atol=1e-9)
    np.testing.assert_allclose(again.truth.theta_rad, log.truth.theta_rad, atol=1e-9)
    wheels_m = true_drive(short, 8)
    follow = true_drive(load_scenario(file), 99)
    np.testing.assert_allclose(follow.left_m, wheels_m.left_m, atol=1e-9)
    assert len(again.sightings.time_us) == pytest.approx(len(log.sightings.time_us), rel=0.02)


def test_recorded_way_that_is_missing_or_too_short_is_named(
    edited_room: Callable[..., Path], tmp_path: Path, paper_room: Scenario
) -> None:
    with pytest.raises(BslamError, match=r"key recorded: there is no file .*nowhere\.csv; allowed"):
        load_scenario(edited_room("[driving]\n", '[driving]\nrecorded = "nowhere.csv"\n'))
    simulate(Scenario(**(vars(paper_room) | {"steps": 40})), 8).write(tmp_path / "drive")
    with pytest.raises(
        BslamError,
        match=r"key recorded: .* is shorter than the 200000000 us of the steps; allowed: .* 1600000 us",
    ):
        load_scenario(
            edited_room("[driving]\n", f'[driving]\nrecorded = "{tmp_path / "drive" / "truth.csv"}"\n')
        )


def test_camera_scene_has_the_kinds_widths_and_textures_that_the_scenario_says(
    edited_room: Callable[..., Path],
) -> None:
    file = edited_room(
        "{ id = 0, at = [1.5, 0.0] }",
        '{ id = 0, at = [1.5, 0.0], kind = "radiator", width_m = 1.3, texture = 4 }',
    )
    for seed in (0, 1):
        first = dress(load_scenario(file), seed).beacons[0]
        assert (first.kind, first.width_m) == ("radiator", 1.3)


def test_camera_scene_without_room_for_a_kind_is_refused(edited_room: Callable[..., Path]) -> None:
    file = edited_room("{ id = 0, at = [1.5, 0.0] }", '{ id = 0, at = [0.2, 0.0], kind = "door" }')
    with pytest.raises(
        BslamError, match=r"beacon 0 at .*0\.40 m of free wall; allowed: enough for a beacon, 0\.9 m"
    ):
        dress(load_scenario(file), 0)
