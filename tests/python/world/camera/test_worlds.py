"""Random worlds and dressed scenarios."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.rig import load_rig
from bslam.world.arena import Beacon
from bslam.world.camera import CLUTTER, KINDS, Renderer, Scene, dress, free_pose, looks, make_world, walk
from bslam.world.camera.looks import oddments, style_of
from bslam.world.scenario import Scenario, load_scenario, scenario_names

SEEDS = range(12)


def sight(scene: Scene, frames: int = 6) -> list:
    renderer = Renderer(scene, load_rig("three60").cameras[1], 1)
    return [renderer.render(free_pose(scene, np.random.default_rng(i)), float(i)) for i in range(frames)]


@pytest.fixture(scope="module", params=["train", "test"])
def worlds(request: pytest.FixtureRequest) -> list[Scene]:
    return [make_world(seed, request.param) for seed in SEEDS]


def test_make_world_has_the_beacons_it_promises(worlds: list[Scene]) -> None:
    kinds = set()
    for scene in worlds:
        assert 4 <= len(scene.beacons) <= style_of(scene.style).beacon_count[1]
        assert [one.beacon_id for one in scene.beacons] == list(range(len(scene.beacons)))
        for one in scene.beacons:
            kind = KINDS[one.kind]
            kinds.add(one.kind)
            assert one.height_m == kind.height_m
            assert kind.width_m[0] <= one.width_m <= kind.width_m[1]
            assert one.bottom_m + one.height_m < scene.height_m
            assert scene.arena.nearest_wall(*one.foot)[0] < 1e-6
            assert scene.arena.nearest_wall(one.x_m, one.y_m)[0] == pytest.approx(one.depth_m, abs=1e-6)
    assert kinds == set(KINDS)


@pytest.mark.parametrize("name", ["train", "test"])
def test_every_layout_of_a_style_can_be_painted(name: str) -> None:
    style, random = style_of(name), np.random.default_rng(5)
    for kind, lists in {"poster": "posters", "door": "doors", "cabinet": "cabinets", "sign": "signs"}.items():
        _paint_each(style, lists, kind, random)
    for lists in ("views", "drapes"):
        _paint_each(style, lists, "window", random)
    _paint_each(style, "radiators", "radiator", random)


def _paint_each(style: looks.style.Style, lists: str, kind: str, random: np.random.Generator) -> None:
    for layout in dict.fromkeys(getattr(style, lists)):
        artist = looks.Artist(replace(style, **{lists: (layout,)}), random)
        fronts = [looks.BEACONS[kind](artist).front for _ in range(4)]
        for front in fronts:
            assert front.dtype == np.uint8 and front.ndim == 3 and front.shape[2] == 4
        assert any((front != fronts[0]).any() for front in fronts[1:]), (lists, layout)  # drawn anew


def test_make_world_beacons_never_overlap(worlds: list[Scene]) -> None:
    for scene in worlds:
        boxes = []
        for one in scene.beacons:
            along = np.array([-math.sin(one.facing_rad), math.cos(one.facing_rad)]) * 0.5 * one.width_m
            corners = [
                np.array(at) + side * along for at in (one.foot, (one.x_m, one.y_m)) for side in (-1, 1)
            ]
            boxes.append((np.min(corners, axis=0), np.max(corners, axis=0)))
        for i, (low, high) in enumerate(boxes):
            for other_low, other_high in boxes[:i]:
                assert not ((low < other_high) & (other_low < high)).all()


def test_make_world_shows_beacons_and_clutter(worlds: list[Scene]) -> None:
    frames = [frame for scene in worlds[:6] for frame in sight(scene)]
    assert np.mean([len(frame.seen) for frame in frames]) > 0.7
    assert any((frame.identity == CLUTTER).any() for frame in frames)


def test_make_world_is_decided_by_seed_and_style() -> None:
    def picture(seed: int, style: str) -> np.ndarray:
        scene = make_world(seed, style)
        return Renderer(scene, load_rig("three60").cameras[1], 1).render((2.5, 2.5, 0.3), 0.0).rgb

    one = picture(4, "train")
    assert np.array_equal(one, picture(4, "train"))
    assert not np.array_equal(one, picture(5, "train"))
    assert not np.array_equal(one, picture(4, "test"))


@pytest.mark.parametrize(("seed", "style", "word"), [(-1, "train", "seed -1"), (0, "sepia", "'sepia'")])
def test_make_world_bad_seed_or_style_is_refused(seed: int, style: str, word: str) -> None:
    with pytest.raises(BslamError, match=word):
        make_world(seed, style)


@pytest.mark.parametrize("name", scenario_names())
def test_dress_every_scenario_has_its_beacons_in_place(name: str) -> None:
    scenario = load_scenario(name)
    for seed in range(3):
        scene = dress(scenario, seed)
        by_id = {one.beacon_id: one for one in scene.beacons}
        assert list(by_id) == [one.beacon_id for one in scenario.arena.beacons]
        for beacon in scenario.arena.beacons:
            look = by_id[beacon.beacon_id]
            # On inner walls a scenario's beacon hangs 2 cm before the wall.
            assert math.dist(look.foot, beacon.at) < 0.021
            assert look.depth_m <= 0.25
            assert scene.arena.nearest_wall(look.x_m, look.y_m)[0] == pytest.approx(look.depth_m, abs=1e-6)


def test_dress_pairs_leave_room_for_each_other() -> None:
    scene = dress(load_scenario("pairs"), 1)
    for one in scene.beacons:
        for other in scene.beacons:
            if one is not other and math.dist(one.foot, other.foot) < 1.0:
                assert 0.5 * (one.width_m + other.width_m) < math.dist(one.foot, other.foot)


def test_dress_another_seed_draws_other_kinds(paper_room: Scenario) -> None:
    drawn = {tuple(one.kind for one in dress(paper_room, seed).beacons) for seed in range(8)}
    assert len(drawn) > 4
    assert all(len(set(kinds)) == len(kinds) for kinds in drawn)  # six places, seven kinds: none twice


@pytest.mark.parametrize(
    ("beacons", "words"),
    [
        ((Beacon(3, (3.0, 3.0)),), r"beacon 3 at \(3\.0, 3\.0\): hangs on no wall"),
        ((Beacon(3, (3.0, 0.0)), Beacon(4, (3.1, 0.0))), r"beacon 3 .* 0\.09 m of free wall"),
        ((Beacon(40_000, (3.0, 0.0)),), r"beacon 40000 .* ids up to 32767"),
    ],
)
def test_dress_beacon_that_cannot_hang_is_refused(
    paper_room: Scenario, beacons: tuple[Beacon, ...], words: str
) -> None:
    scenario = replace(paper_room, arena=replace(paper_room.arena, beacons=beacons))
    with pytest.raises(BslamError, match=words):
        dress(scenario, 0)


def test_dress_robot_looks_from_the_start_pose(paper_room: Scenario) -> None:
    scene = dress(paper_room, 3)
    start = paper_room.start
    renderer = Renderer(scene, load_rig("wide180").cameras[0], 1)
    turns = np.arange(0.0, 6.2, 0.5)
    frames = [renderer.render((start.x_m, start.y_m, float(turn)), float(turn)) for turn in turns]
    assert {seen.beacon_id for frame in frames for seen in frame.seen} >= {0, 1, 3}


def test_free_pose_is_clear_of_walls_and_things(worlds: list[Scene]) -> None:
    random = np.random.default_rng(1)
    for scene in worlds:
        for _ in range(5):
            x_m, y_m, theta_rad = free_pose(scene, random)
            assert scene.arena.nearest_wall(x_m, y_m)[0] > 0.4
            assert all(math.hypot(o.x_m - x_m, o.y_m - y_m) > o.radius_m + 0.4 for o in scene.obstacles)
            assert -math.pi <= theta_rad <= math.pi


def test_walk_moves_as_a_robot_does(worlds: list[Scene]) -> None:
    moved_m = []
    for scene in worlds:
        poses = walk(scene, np.random.default_rng(2), 50, hz=5.0)
        assert poses.shape == (50, 3)
        steps_m = np.hypot(*np.diff(poses[:, :2], axis=0).T)
        assert steps_m.max() <= 0.7 / 5.0 + 1e-9
        assert np.abs(np.diff(poses[:, 2])).max() <= 1.2 / 5.0 + 1e-9
        assert all(scene.arena.nearest_wall(x, y)[0] > 0.4 for x, y, _ in poses)
        moved_m.append(steps_m.sum())
    assert np.mean(moved_m) > 1.5


@pytest.mark.parametrize(("frames", "hz"), [(0, 5.0), (5, 0.0), (5, math.nan)])
def test_walk_bad_length_or_rate_is_refused(worlds: list[Scene], frames: int, hz: float) -> None:
    with pytest.raises(BslamError, match="frames"):
        walk(worlds[0], np.random.default_rng(2), frames, hz)


@pytest.mark.parametrize("name", list(oddments.THINGS))
def test_unlisted_things_are_never_as_large_as_a_beacon_and_stay_below_the_ceiling(name: str) -> None:
    artist = looks.Artist(style_of("train"), np.random.default_rng(5))
    pieces = [oddments.THINGS[name](artist) for _ in range(40)]
    for piece in pieces:
        assert name == "column" or not oddments.is_beacon_sized(piece.width_m, piece.height_m)
        assert piece.bottom_m >= 0.0
        assert piece.bottom_m + piece.height_m < 2.4
    assert len({piece.look.front.tobytes() for piece in pieces}) > 30
    assert np.ptp([piece.width_m for piece in pieces]) > 0.05


def test_beacon_sizes_are_known_as_such() -> None:
    for kind in KINDS.values():
        assert oddments.is_beacon_sized(float(np.mean(kind.width_m)), kind.height_m)
    assert not oddments.is_beacon_sized(0.1, 0.1)
