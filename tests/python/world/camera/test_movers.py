"""People and boxes that move about, in pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.rig import Camera, load_rig
from bslam.world.arena import Wall
from bslam.world.camera import CLUTTER, Frame, Renderer, Scene, dress, looks
from bslam.world.camera.furnish import Furnisher
from bslam.world.camera.looks import Artist, Piece, style_of
from bslam.world.scenario import Scenario, load_scenario
from bslam.world.simulate import true_drive
from world.camera.conftest import flat_kind, hang_ahead

EYE = (2.0, 2.0, 0.0)
BETWEEN, ASIDE = (4.2, 2.0), (4.2, 3.2)  # the poster ahead and the eye; beside that line


def somebody() -> Piece:
    return looks.person(Artist(style_of("train"), np.random.default_rng(3)), 0.5)


@pytest.fixture
def walked_room(furnisher: Callable[..., Furnisher]) -> Scene:
    """A poster on the wall ahead, id 7, half as wide as the one person there."""
    room = furnisher()
    hang_ahead(room, 7, 2.0, flat_kind(0.25, 0.8, 1.2))
    room.add_mover(somebody(), *ASIDE)
    return room.finish(0)


def shown(scene: Scene, camera: Camera, at_m: tuple[float, float] | None) -> Frame:
    return Renderer(scene, camera, 1).render(EYE, 0.0, movers_m=None if at_m is None else np.array([at_m]))


def test_somebody_between_hides_a_beacon_and_is_no_beacon(walked_room: Scene, ahead: Camera) -> None:
    free, hidden = (shown(walked_room, ahead, at_m) for at_m in (ASIDE, BETWEEN))
    assert [one.visible_px for one in free.seen] == [free.seen[0].own_px]
    left = [one.visible_px for one in hidden.seen if one.beacon_id == 7]
    assert sum(left) < 0.05 * free.seen[0].own_px
    assert (hidden.identity[free.identity == 7] == CLUTTER).mean() > 0.9


def test_what_nobody_stands_before_looks_as_it_did(walked_room: Scene, ahead: Camera) -> None:
    here, there = (shown(walked_room, ahead, at_m) for at_m in (ASIDE, BETWEEN))
    neither = (here.identity != CLUTTER) & (there.identity != CLUTTER)
    assert 0.5 < neither.mean() < 1.0
    np.testing.assert_array_equal(here.depth_m[neither], there.depth_m[neither])
    assert (here.identity == CLUTTER).sum() > 500 and (there.identity == CLUTTER).sum() > 500


def test_somebody_is_as_far_and_as_high_as_the_place_says(walked_room: Scene, ahead: Camera) -> None:
    near, far = (shown(walked_room, ahead, at_m) for at_m in ((4.0, 2.0), (5.5, 2.0)))
    rows = [np.ptp(np.flatnonzero((one.identity == CLUTTER).any(axis=1))) + 1 for one in (near, far)]
    columns = [np.ptp(np.flatnonzero((one.identity == CLUTTER).any(axis=0))) + 1 for one in (near, far)]
    assert columns[0] / columns[1] == pytest.approx(3.5 / 2.0, rel=0.1)
    assert columns[0] == pytest.approx(ahead.lens.fx_px * 0.5 / 2.0, abs=3.0)
    assert rows[1] == pytest.approx(ahead.lens.fx_px * 1.72 / 3.5, rel=0.12)  # 1.55 to 1.9 m


def test_who_moved_looks_as_one_who_stood_there_from_the_start(
    furnisher: Callable[..., Furnisher], ahead: Camera
) -> None:
    """In shape, place and light; the dark wall between two lamps makes light differ from place to place."""
    scenes = []
    for place in (ASIDE, BETWEEN):
        room = furnisher(Wall((3.0, 2.6), (6.0, 2.6)))
        room.add_mover(somebody(), *place)
        scenes.append(room.finish(0))
    moved, stood = shown(scenes[0], ahead, BETWEEN), shown(scenes[1], ahead, None)
    np.testing.assert_array_equal(moved.rgb, stood.rgb)
    unmoved = shown(scenes[0], ahead, None)
    assert (moved.rgb != unmoved.rgb).any()


def test_two_cameras_of_one_scene_do_not_move_each_others_people(walked_room: Scene, ahead: Camera) -> None:
    before = shown(walked_room, ahead, None)
    shown(walked_room, ahead, BETWEEN)
    np.testing.assert_array_equal(shown(walked_room, ahead, None).rgb, before.rgb)


def test_a_place_that_is_no_number_is_refused(walked_room: Scene, ahead: Camera) -> None:
    with pytest.raises(BslamError, match=r"movers .*nan.*allowed: finite"):
        shown(walked_room, ahead, (np.nan, 1.0))


@pytest.fixture(scope="module")
def hall() -> Scenario:
    return replace(load_scenario("busy_hall"), steps=400)


def test_with_people_all_else_in_a_dressed_room_is_as_without(hall: Scenario) -> None:
    eye, camera = (2.0, 2.6, 0.0), load_rig("three60").cameras[1]
    full, empty = dress(hall, 3), dress(replace(hall, movers=()), 3)
    assert len(full.movers) == len(hall.movers) == 6 and empty.movers == ()
    outside = np.full((6, 2), -50.0)
    with_people = Renderer(full, camera, 1).render(eye, 0.0, movers_m=outside)
    without = Renderer(empty, camera, 1).render(eye, 0.0)
    np.testing.assert_array_equal(with_people.rgb, without.rgb)
    np.testing.assert_array_equal(with_people.identity, without.identity)


def test_people_on_their_ways_hide_beacons_now_and_then(hall: Scenario) -> None:
    """A camera that stands still: what a beacon loses of itself is covered by somebody."""
    path, camera = true_drive(hall, 2), load_rig("wide180").cameras[0]
    scene, eye = dress(hall, 2), (2.0, 2.6, 0.8)
    renderer = Renderer(scene, camera, 1)
    outside = renderer.render(eye, 0.0, movers_m=np.full((6, 2), -50.0))
    whole = {one.beacon_id: one.visible_px for one in outside.seen}
    lost = 0
    for others_m in path.others_m[::20]:
        frame = renderer.render(eye, 0.0, movers_m=others_m)
        left = {one.beacon_id: one.visible_px for one in frame.seen}
        for beacon_id, own_px in whole.items():
            gone = (outside.identity == beacon_id) & (frame.identity != beacon_id)
            assert gone.sum() == own_px - left.get(beacon_id, 0)
            assert (frame.identity[gone] == CLUTTER).all()
            lost += left.get(beacon_id, 0) < 0.2 * own_px
    assert lost >= 2
