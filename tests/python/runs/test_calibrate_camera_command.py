"""`bslam calibrate camera` from pictures and a log to a rig that loads, and what it refuses."""

import math
from dataclasses import replace

import cv2
import pytest

from bslam.cli import main
from bslam.rig import Lens, load_rig
from runs import boards
from runs.test_calibrate_camera import views_of

LENS = Lens("pinhole", 320, 240, 270.0, 270.0, 158.0, 122.0, -0.1)
BOARD = ["--board", f"{boards.ACROSS}x{boards.DOWN}", "--square", str(boards.SQUARE_M)]


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """Folders with boards from all sides, and with one that hangs plumb before a camera that looks down."""
    root = tmp_path_factory.mktemp("camera")
    views_of(LENS, root / "boards")
    (root / "plumb").mkdir()
    tip = boards.rotation(0.0, 0.1, 0.05)
    picture = boards.picture(LENS, tip, tip @ [0.02, 0.0, 0.8], 1)
    cv2.imwrite(str(root / "plumb/1.jpg"), picture, [cv2.IMWRITE_JPEG_QUALITY, 95])
    return root


def test_calibrate_camera_writes_a_rig_with_lens_and_mounting(pictures, tmp_path, made, capsys):
    log = made.circle_log(steps=600)
    sightings = replace(log.sightings, bearing_rad=log.sightings.bearing_rad - math.radians(7.0))
    replace(log, sightings=sightings).write(tmp_path / "drive")
    words = ["calibrate", "camera", str(pictures / "boards"), *BOARD, "--plumb", str(pictures / "plumb")]
    words += ["--board-height", "0.4", "--log", str(tmp_path / "drive"), "--out", str(tmp_path)]
    assert main(words) == 0
    camera = load_rig(tmp_path / "camera.toml").cameras[0]
    assert camera.lens.fx_px == pytest.approx(270.0, rel=0.01)
    assert math.degrees(camera.yaw_rad) == pytest.approx(7.0, abs=1e-3)
    assert camera.pitch_rad == pytest.approx(0.1, abs=math.radians(0.3))
    # The board's middle is as high as the camera.
    assert camera.z_m == pytest.approx(0.4 + 0.5 * (boards.DOWN - 1) * boards.SQUARE_M, abs=0.005)
    printed = capsys.readouterr().out
    assert "reprojection error 0.0" in printed and "yaw_deg (left)" in printed
    assert "the camera is rolled by 2." in printed or "the camera is rolled by 3." in printed


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--board-height", "1.0"], "--board-height: says nothing by itself; allowed: together with --plumb"),
        (["--plumb", "nowhere"], "nowhere: no such folder"),
        (["--drive", "nowhere"], "--drive and --height: one says nothing by itself; allowed: both"),
        (["--drive", "nowhere", "--height", "0.5"], "nowhere: no pictures; allowed: a folder with"),
        (["--drive", "x", "--height", "0.5", "--plumb", "y"], "--drive and --plumb: both give the pitch"),
        (["--log", "nowhere"], "nowhere: no such folder; a log is a folder with"),
    ],
)
def test_calibrate_camera_bad_request_is_refused(pictures, tmp_path, capsys, words, complaint):
    out = ["--out", str(tmp_path / "out")]
    assert main(["calibrate", "camera", str(pictures / "boards"), *BOARD, *words, *out]) == 2
    assert complaint in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("words", [["--board", "6x6"], ["--board", "9x"], ["--square", "0"], ["--lens", "x"]])
def test_calibrate_camera_bad_option_is_refused(tmp_path, words):
    with pytest.raises(SystemExit) as stop:
        main(["calibrate", "camera", str(tmp_path), *words])
    assert stop.value.code == 2
