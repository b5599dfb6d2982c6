"""A lens and its mounting come out of rendered checkerboards, within the tolerances stated."""

import math
import tomllib
from dataclasses import replace

import cv2
import numpy as np
import pytest

from bslam.calibration import calibrate_camera
from bslam.calibration.calibrate import Estimate
from bslam.calibration.calibrate_camera import (
    Board,
    Mounting,
    Views,
    as_toml,
    calibrate_lens,
    find_boards,
    find_mounting,
)
from bslam.errors import BslamError
from bslam.rig import Lens, load_rig
from runs import boards

BOARD = Board(boards.ACROSS, boards.DOWN, boards.SQUARE_M)
PINHOLE = Lens("pinhole", 320, 240, 280.0, 276.0, 163.0, 117.0, -0.12, 0.05)
FISHEYE = Lens("equidistant", 320, 240, 103.0, 102.0, 161.0, 118.5, -0.02, 0.004)


def views_of(lens, folder):
    """Boards to all sides of the lens, near enough that a square has some 10 pixels; one frame without."""
    folder.mkdir(exist_ok=True)
    far_m, spread = (0.95, 0.2) if lens.kind == "pinhole" else (0.33, 0.8)
    random = np.random.default_rng(5)
    for index in range(14):
        aside, up = spread * math.cos(2.4 * index), 0.6 * spread * math.sin(2.4 * index)
        facing = boards.rotation(aside, -up, random.uniform(-0.2, 0.2))
        slant = boards.rotation(*random.uniform(-0.55, 0.55, 2), 0.0)
        middle_m = far_m * random.uniform(0.9, 1.2) * facing[:, 2]
        cv2.imwrite(str(folder / f"{index:02}.png"), boards.picture(lens, facing @ slant, middle_m, index))
    cv2.imwrite(str(folder / "none.png"), np.full((240, 320), 90, np.uint8))
    return find_boards(folder, BOARD)


@pytest.fixture(scope="module", params=[PINHOLE, FISHEYE], ids=["pinhole", "equidistant"])
def calibrated(request, tmp_path_factory):
    """The true lens, what the pictures gave, and the pictures."""
    views = views_of(request.param, tmp_path_factory.mktemp("boards"))
    return request.param, calibrate_lens(views, BOARD, request.param.kind), views


def test_find_boards_says_which_pictures_have_none(calibrated):
    views = calibrated[2]
    assert "none.png" in views.without_board
    assert len(views.names) >= 10 and len(views.names) + len(views.without_board) == 15


def test_calibrate_lens_recovers_the_lens(calibrated):
    true, found, _ = calibrated
    assert found.error_px < 0.15
    # Directions count, not single parameters, which trade against each other: compare them over the frame.
    u, v = np.meshgrid(np.linspace(10, 309, 14), np.linspace(10, 229, 10))
    cosine = np.sum(boards.rays(true, u, v) * boards.rays(found.lens, u, v), axis=-1)
    angles = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert np.nanmax(angles) < 0.4 and np.nanmedian(angles) < 0.15
    assert found.lens.fx_px == pytest.approx(true.fx_px, rel=0.01)
    assert found.lens.cx_px == pytest.approx(true.cx_px, abs=1.0)
    assert found.lens.cy_px == pytest.approx(true.cy_px, abs=1.0)


def test_calibrate_lens_leaves_out_a_board_that_does_not_fit(calibrated):
    true, found, views = calibrated
    shaken = views.corners_px[0] + np.random.default_rng(1).normal(0, 6, views.corners_px[0].shape)
    corners_px = (shaken.astype(np.float32), *views.corners_px[1:])
    again = calibrate_lens(replace(views, corners_px=corners_px), BOARD, true.kind)
    assert views.names[0] in again.left_out_px and again.left_out_px[views.names[0]] > 1.0
    assert again.error_px < 0.15
    assert again.lens.fx_px == pytest.approx(found.lens.fx_px, rel=0.01)


def test_calibrate_lens_of_the_wrong_kind_fits_worse(calibrated):
    true, found, views = calibrated
    other = "equidistant" if true.kind == "pinhole" else "pinhole"
    try:
        wrong = calibrate_lens(views, BOARD, other)
    except BslamError:
        return  # refused: as good
    assert wrong.error_px > found.error_px


@pytest.mark.parametrize("lens", [PINHOLE, FISHEYE], ids=["pinhole", "equidistant"])
def test_find_mounting_gives_pitch_and_height_of_a_plumb_board(tmp_path, lens):
    pitch_rad, roll_rad, z_m, middle_above_floor_m = 0.12, 0.01, 0.5, 0.45
    tip = boards.rotation(0.0, pitch_rad, 0.0) @ boards.rotation(0.0, 0.0, roll_rad)  # room to camera
    for index, aside_rad in enumerate((-0.15, 0.0, 0.12)):
        turn = tip @ boards.rotation(0.4 * index - 0.4, 0.0, 0.0)
        away_m = 0.7 if lens.kind == "pinhole" else 0.35
        ahead = np.array(
            [away_m * math.sin(aside_rad), z_m - middle_above_floor_m, away_m * math.cos(aside_rad)]
        )
        cv2.imwrite(str(tmp_path / f"{index}.png"), boards.picture(lens, turn, tip @ ahead, index))
    lowest_m = middle_above_floor_m - 0.5 * (boards.DOWN - 1) * boards.SQUARE_M
    views = find_boards(tmp_path, BOARD)
    assert len(views.names) == 3
    found = find_mounting(views, BOARD, lens, lowest_m)
    assert found.pitch.value == pytest.approx(pitch_rad, abs=math.radians(0.3))
    assert found.pitch.error < math.radians(0.3)
    assert found.roll_rad == pytest.approx(roll_rad, abs=math.radians(0.3))
    assert found.z_m == pytest.approx(z_m, abs=0.005)
    assert find_mounting(views, BOARD, lens, None).z_m is None


def test_as_toml_is_a_rig_and_a_camera_of_the_core(calibrated, tmp_path):
    _, found, _ = calibrated
    mounting = Mounting(Estimate(math.radians(-4.0), 0.001), 0.0, 0.42)
    text = as_toml(found, mounting, Estimate(math.radians(2.5), 0.001), "boards/")
    (tmp_path / "mine.toml").write_text(text)
    camera = load_rig(tmp_path / "mine.toml").cameras[0]
    assert camera.lens.fx_px == pytest.approx(found.lens.fx_px, rel=1e-6)
    assert camera.lens.k2 == pytest.approx(found.lens.k2, rel=1e-6)
    assert math.degrees(camera.yaw_rad) == pytest.approx(2.5) and camera.z_m == 0.42
    assert math.degrees(camera.pitch_rad) == pytest.approx(-4.0)
    assert ".pitch_rad = -0.06981317f" in text and f".width_px = {camera.lens.width_px}" in text
    assert set(tomllib.loads(as_toml(found, None, None, "x"))["cameras"][0]) == set()


def test_find_boards_bad_folder_is_refused(tmp_path):
    with pytest.raises(BslamError, match=r"missing: no such folder; allowed"):
        find_boards(tmp_path / "missing", BOARD)
    with pytest.raises(BslamError, match=r"no picture in it; allowed: files named \.png"):
        find_boards(tmp_path, BOARD)
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((240, 320), np.uint8))
    cv2.imwrite(str(tmp_path / "b.png"), np.zeros((480, 640), np.uint8))
    with pytest.raises(BslamError, match=r"b\.png: is 640x480; allowed: 320x240"):
        find_boards(tmp_path, BOARD)
    (tmp_path / "b.png").write_bytes(b"no picture")
    with pytest.raises(BslamError, match=r"b\.png: cannot be read as a picture"):
        find_boards(tmp_path, BOARD)


def test_calibrate_lens_with_too_few_boards_is_refused(calibrated):
    views = calibrated[2]
    few = Views(views.names[:3], views.corners_px[:3], 320, 240, ("x.png",))
    with pytest.raises(BslamError, match=r"found in 3 pictures that fit \(not x\.png\); allowed: at least 4"):
        calibrate_lens(few, BOARD, "pinhole")


def test_find_mounting_of_another_size_or_without_board_is_refused(calibrated):
    lens, _, views = calibrated
    other = Views(views.names, views.corners_px, 640, 480, ())
    with pytest.raises(BslamError, match=r"are 640x480; allowed: 320x240"):
        find_mounting(other, BOARD, lens, None)
    with pytest.raises(BslamError, match=r"no board of 8x5 inner corners in y\.png"):
        find_mounting(Views((), (), 320, 240, ("y.png",)), BOARD, lens, None)


def test_without_opencv_it_says_how_to_get_it(tmp_path, monkeypatch):
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((240, 320), np.uint8))
    monkeypatch.setattr(calibrate_camera, "cv2", None)
    with pytest.raises(BslamError, match=r"OpenCV is missing; allowed: .* -m pip install opencv"):
        find_boards(tmp_path, BOARD)
