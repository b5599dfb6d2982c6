"""Where things are in the picture, against projection by hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bslam.errors import BslamError
from bslam.rig import Camera, Lens
from bslam.world.arena import Wall
from bslam.world.camera import CLUTTER, Renderer
from bslam.world.camera.furnish import Furnisher
from bslam.world.camera.lens import project, unproject
from bslam.world.camera.looks import Look, Piece
from bslam.world.camera.scene import Scene
from world.camera.conftest import flat_kind, hang_ahead

Triple = tuple[float, float, float]

DISTORTED = Lens("pinhole", 320, 240, 200.0, 190.0, 155.0, 121.0, -0.08, 0.01)
BENT_FISHEYE = Lens("equidistant", 320, 240, 110.0, 108.0, 158.0, 118.0, -0.03, 0.002)


def by_hand(
    camera: Camera, pose: tuple[float, float, float], point: tuple[float, float, float]
) -> np.ndarray:
    """Pixel of a point of the arena: the formulas of the lens kinds, one step after the other."""
    turn = pose[2]
    eye_x = pose[0] + math.cos(turn) * camera.x_m - math.sin(turn) * camera.y_m
    eye_y = pose[1] + math.sin(turn) * camera.x_m + math.cos(turn) * camera.y_m
    look = turn + camera.yaw_rad
    dx, dy, dz = point[0] - eye_x, point[1] - eye_y, point[2] - camera.z_m
    level_x, y = math.cos(look) * dx + math.sin(look) * dy, -math.sin(look) * dx + math.cos(look) * dy
    # Looking down by the pitch, the axis x dips: forward and down mix.
    x = math.cos(camera.pitch_rad) * level_x - math.sin(camera.pitch_rad) * dz
    z = math.sin(camera.pitch_rad) * level_x + math.cos(camera.pitch_rad) * dz
    lens = camera.lens
    if lens.kind == "pinhole":
        m = np.array([-y / x, -z / x])
        r2 = float(m @ m)
        bent = m * (1.0 + lens.k1 * r2 + lens.k2 * r2 * r2)
    else:
        theta = math.atan2(math.hypot(y, z), x)
        bent = theta * (1.0 + lens.k1 * theta**2 + lens.k2 * theta**4) * np.array([-y, -z]) / math.hypot(y, z)
    return np.array([lens.cx_px + lens.fx_px * bent[0], lens.cy_px + lens.fy_px * bent[1]])


def cameras(pinhole: Lens, fisheye: Lens) -> list[Camera]:
    return [
        Camera(pinhole),
        Camera(pinhole, 0.1, -0.05, 0.4, 0.2, 0.1),
        Camera(DISTORTED, z_m=0.7),
        Camera(fisheye, 0.0, 0.1, 0.6, -0.4, -0.05),
        Camera(BENT_FISHEYE, yaw_rad=0.3),
    ]


@pytest.mark.parametrize("index", range(5))
@pytest.mark.parametrize("pose", [(3.0, 2.0, 0.0), (3.4, 1.4, 0.15), (2.5, 2.9, -0.25)])
def test_render_beacon_corners_are_where_the_lens_formula_says(
    poster_room: Scene, pinhole: Lens, fisheye: Lens, index: int, pose: tuple[float, float, float]
) -> None:
    camera = cameras(pinhole, fisheye)[index]
    frame = Renderer(poster_room, camera, 0).render(pose, 0.0)
    corners = [by_hand(camera, pose, (5.99, y, z)) for y in (1.7, 2.3) for z in (0.2, 1.0)]
    rows, columns = np.nonzero(frame.identity == 7)
    found = [columns.min() - 0.5, rows.min() - 0.5, columns.max() + 0.5, rows.max() + 0.5]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    assert low.min() > 0.0 and high[0] < 319.0 and high[1] < 239.0  # whole, or this tests nothing
    # Pixel centres: the outermost lies within a pixel of the edge. A fisheye's edges bulge beyond corners.
    bulge_px = 0.0 if camera.lens == pinhole else 1.5
    assert_allclose(found, [*low, *high], rtol=0.0, atol=1.0 + bulge_px)
    (seen,) = frame.seen
    assert_allclose(seen.box, [*low, *high], rtol=0.0, atol=1e-3 + bulge_px)
    assert seen.beacon_id == 7 and not seen.cut
    assert seen.visible_px == seen.own_px == len(rows)


@pytest.mark.parametrize("index", range(5))
def test_render_depth_is_the_distance_to_the_plane(
    poster_room: Scene, pinhole: Lens, fisheye: Lens, index: int
) -> None:
    camera = replace(cameras(pinhole, fisheye)[index], x_m=0.0, y_m=0.0)
    pose = (2.0, 1.5, 0.35)
    frame = Renderer(poster_room, camera, 0).render(pose, 0.0)
    lens = camera.lens
    checked = {"wall": 0, "poster": 0, "floor": 0}
    for v in range(5, lens.height_px, 23):
        for u in range(5, lens.width_px, 23):
            depth_m = float(frame.depth_m[v, u])
            if not math.isfinite(depth_m):
                continue
            # The point that the depth claims must project back to the pixel's centre, and lie on a plane.
            ray = unproject(camera, np.array(u, float), np.array(v, float))
            turn = pose[2] + camera.yaw_rad
            x_m = pose[0] + depth_m * (math.cos(turn) * ray[0] - math.sin(turn) * ray[1])
            y_m = pose[1] + depth_m * (math.sin(turn) * ray[0] + math.cos(turn) * ray[1])
            z_m = camera.z_m + depth_m * ray[2]
            assert_allclose(by_hand(camera, pose, (x_m, y_m, z_m)), [u, v], rtol=0.0, atol=1e-3)
            planes = {"wall": min(abs(x_m - 6.0), abs(y_m), abs(y_m - 4.0)), "poster": abs(x_m - 5.99)}
            planes["floor"] = abs(z_m)
            name = "poster" if frame.identity[v, u] == 7 else min(planes, key=lambda key: planes[key])
            if z_m > 2.3:
                continue  # ceiling and lamps, whose height is drawn
            assert planes[name] < 1e-4 * depth_m
            checked[name] += 1
    assert checked["wall"] > 5 and checked["floor"] > 5


def test_render_depth_straight_ahead_is_exact(poster_room: Scene, pinhole: Lens) -> None:
    lens = replace(pinhole, cx_px=160.0, cy_px=120.0)
    frame = Renderer(poster_room, Camera(lens), 0).render((2.0, 2.0, 0.0), 0.0)
    assert frame.depth_m[120, 160] == pytest.approx(3.99, rel=1e-6)
    assert frame.identity[120, 160] == 7


def test_render_fisheye_sees_nothing_beyond_90_degrees(poster_room: Scene, fisheye: Lens) -> None:
    frame = Renderer(poster_room, Camera(fisheye), 0).render((3.0, 2.0, 0.0), 0.0)
    v, u = np.mgrid[:240, :320]
    beyond = np.hypot(u - 159.5, v - 119.5) > 160.5
    within = np.hypot(u - 159.5, v - 119.5) < 159.5
    assert np.isinf(frame.depth_m[beyond]).all() and np.isfinite(frame.depth_m[within]).all()
    dark = np.hypot(u - 159.5, v - 119.5) > 165.0  # beyond what the blur reaches
    assert frame.rgb[dark].max() < 40  # noise only
    assert (frame.identity[beyond] == -1).all()


@given(
    st.sampled_from([DISTORTED, BENT_FISHEYE, Lens("equidistant", 320, 240, 101.9, 101.9, 159.5, 119.5)]),
    st.floats(-1.0, 1.0),
    st.floats(0.0, 319.0),
    st.floats(0.0, 239.0),
)
def test_project_undoes_unproject(lens: Lens, pitch_rad: float, u_px: float, v_px: float) -> None:
    camera = Camera(lens, pitch_rad=pitch_rad)
    ray = unproject(camera, np.array(u_px), np.array(v_px))
    if np.any(ray):
        assert_allclose(np.linalg.norm(ray), 1.0, rtol=1e-12)
        assert_allclose(project(camera, 3.0 * ray), [u_px, v_px], rtol=0.0, atol=1e-6)


def test_unproject_distortion_that_turns_back_is_refused(poster_room: Scene) -> None:
    lens = Lens("pinhole", 320, 240, 150.0, 150.0, 159.5, 119.5, -0.9, 0.0)
    with pytest.raises(BslamError, match=r"k1 and k2: -0\.9, 0 do not reach the corners"):
        Renderer(poster_room, Camera(lens), 0)


# --- What Seen says -----------------------------------------------------------------------------------------


def test_seen_slant_bearing_and_range_are_those_of_the_front(poster_room: Scene, pinhole: Lens) -> None:
    camera = Camera(pinhole, x_m=0.2, y_m=-0.1, yaw_rad=0.3)
    pose = (4.0, 1.0, 0.5)
    (seen,) = Renderer(poster_room, camera, 0).render(pose, 0.0).seen
    eye = (4.0 + 0.2 * math.cos(0.5) + 0.1 * math.sin(0.5), 1.0 + 0.2 * math.sin(0.5) - 0.1 * math.cos(0.5))
    to = (5.99 - eye[0], 2.0 - eye[1])
    assert seen.range_m == pytest.approx(math.hypot(*to))
    assert seen.bearing_rad == pytest.approx(math.atan2(to[1], to[0]) - 0.5)
    assert seen.slant_rad == pytest.approx(abs(math.atan2(to[1], to[0])))  # the normal is -x


def test_seen_cut_and_box_at_the_border(poster_room: Scene, ahead: Camera) -> None:
    pose = (4.0, 2.0, 0.45)  # half of the poster is beyond the right border
    (seen,) = Renderer(poster_room, ahead, 0).render(pose, 0.0).seen
    left_px = by_hand(ahead, pose, (5.99, 2.3, 0.6))[0]
    assert seen.cut
    assert seen.box[2] == 319.5
    assert seen.box[0] == pytest.approx(left_px, abs=1e-3)
    assert seen.visible_px == seen.own_px  # nothing stands before the part that is in the frame


def test_seen_object_that_reaches_behind_the_lens_is_cut(
    furnisher: Callable[..., Furnisher], pinhole: Lens
) -> None:
    room = furnisher()
    hang_ahead(room, 3, 2.0, flat_kind(3.6, 1.0, 0.1))
    scene = room.finish(0)
    (seen,) = Renderer(scene, Camera(pinhole), 0).render((5.7, 2.0, 1.2), 0.0).seen
    assert seen.cut and seen.box[0] >= -0.5 and seen.box[2] == 319.5


def test_seen_clutter_before_a_beacon_takes_from_visible_not_from_own(
    furnisher: Callable[..., Furnisher], ahead: Camera
) -> None:
    counts = []
    for with_clutter in (False, True):
        room = furnisher()
        hang_ahead(room, 1, 2.0, flat_kind(0.6, 0.8, 0.2))
        if with_clutter:
            board = np.full((8, 8, 4), 255, dtype=np.uint8)
            # 0.4 m wide at 2 m covers 0.8 m at 4 m: all but what is above its 0.75 m.
            room.add_clutter(Piece(Look(board, (1.0, 1.0, 1.0), cut_out=True), 0.4, 0.5), 4.0, 2.0)
        frame = Renderer(room.finish(0), ahead, 0).render((2.0, 2.0, 0.0), 0.0)
        counts.append([(seen.visible_px, seen.own_px) for seen in frame.seen])
        assert (frame.identity == CLUTTER).any() == with_clutter
    (bare,), (behind,) = counts
    assert bare[0] == bare[1] == behind[1]
    # Eye and the board's top are at 0.5 m, so the poster shows from 0.5 m up: 0.5 of its 0.8 m.
    assert behind[0] == pytest.approx(bare[0] * 0.5 / 0.8, rel=0.02)


def test_seen_clutter_with_holes_lets_through(furnisher: Callable[..., Furnisher], ahead: Camera) -> None:
    board = np.full((8, 8, 4), 255, dtype=np.uint8)
    board[:, :4, 3] = 0
    room = furnisher()
    room.add_clutter(Piece(Look(board, (1.0, 1.0, 1.0), cut_out=True), 0.4, 1.0), 4.0, 2.0)
    identity = Renderer(room.finish(0), ahead, 0).render((2.0, 2.0, 0.0), 0.0).identity
    columns = np.nonzero((identity == CLUTTER).any(axis=0))[0]
    middle_px, half_px = 159.5, 277.1 * 0.2 / 2.0
    assert_allclose([columns.min(), columns.max()], [middle_px, middle_px + half_px], rtol=0.0, atol=1.0)


@pytest.mark.parametrize("gap", [False, True])
def test_seen_wall_between_hides_all_but_its_gap(
    furnisher: Callable[..., Furnisher], ahead: Camera, gap: bool
) -> None:
    pieces = [Wall((4.0, 0.0), (4.0, 2.0)), Wall((4.0, 3.0), (4.0, 4.0))] if gap else []
    room = furnisher(*(pieces or [Wall((4.0, 0.0), (4.0, 4.0))]))
    hang_ahead(room, 1, 2.0, flat_kind(0.6, 0.8, 0.2))
    frame = Renderer(room.finish(0), ahead, 0).render((2.0, 2.0, 0.0), 0.0)
    if not gap:
        assert frame.seen == () and not (frame.identity == 1).any()
        return
    (seen,) = frame.seen
    # The wall ends straight ahead: the left half shows.
    assert seen.visible_px == pytest.approx(0.5 * seen.own_px, rel=0.03)
    columns = np.nonzero((frame.identity == 1).any(axis=0))[0]
    assert columns.max() == 159


def test_seen_body_with_depth_shows_its_side(furnisher: Callable[..., Furnisher], ahead: Camera) -> None:
    room = furnisher()
    hang_ahead(room, 1, 3.0, flat_kind(0.8, 1.0, 0.0, depth_m=0.4), "cabinet")
    scene = room.finish(0)
    (beacon,) = scene.beacons
    assert (beacon.x_m, beacon.y_m) == (pytest.approx(5.6), pytest.approx(3.0))
    assert beacon.foot == (pytest.approx(6.0), pytest.approx(3.0))
    assert scene.arena.beacons[0].at == (beacon.x_m, beacon.y_m)
    pose = (3.0, 2.0, 0.3)
    (seen,) = Renderer(scene, ahead, 0).render(pose, 0.0).seen
    # From below its y, the side towards us ends at the wall, farther right than the front does.
    front_px, wall_px = (by_hand(ahead, pose, (x_m, 2.6, 0.5))[0] for x_m in (5.6, 6.0))
    assert wall_px > front_px + 5.0
    assert seen.box[2] == pytest.approx(wall_px, abs=1e-3)


def test_seen_round_body_is_as_wide_from_the_side(furnisher: Callable[..., Furnisher], ahead: Camera) -> None:
    room = furnisher()
    hang_ahead(room, 1, 2.0, flat_kind(0.18, 0.6, 0.2, depth_m=0.12), "extinguisher")
    scene = room.finish(0)
    x_m, y_m = 5.88, 2.0
    for side_rad in (0.0, 0.9):
        pose = (x_m - 2.0 * math.cos(side_rad), y_m - 2.0 * math.sin(side_rad), side_rad)
        (seen,) = Renderer(scene, ahead, 0).render(pose, 0.0).seen
        assert seen.box[2] - seen.box[0] == pytest.approx(277.1 * 0.18 / 2.0, rel=1e-5)
        assert seen.slant_rad == pytest.approx(side_rad, abs=1e-9)
