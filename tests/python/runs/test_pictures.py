"""Picture files as the front end takes them: upright, scaled, boxes still round what they are of."""

import numpy as np
import pytest
from PIL import Image

from bslam.datasets.pictures import camera_for, load_picture
from bslam.errors import BslamError
from bslam.rig import load_rig


@pytest.mark.parametrize("size", [(320, 240), (1280, 960), (641, 483), (200, 400), (64, 48)])
def test_load_picture_keeps_boxes_on_what_they_were_drawn_round(tmp_path, size):
    pixels = np.full((size[1], size[0], 3), 200, np.uint8)
    left, top, right, bottom = (
        int(share * side) for share, side in zip((0.3, 0.2, 0.6, 0.7), size * 2, strict=True)
    )
    pixels[top:bottom, left:right] = (250, 10, 10)
    Image.fromarray(pixels).save(tmp_path / "a.png")
    frame = load_picture(tmp_path / "a.png")
    height, width = frame.rgb.shape[:2]
    assert width % 4 == 0 and height % 4 == 0 and width <= 320 and height <= 240
    red = frame.rgb[:, :, 1] < 105  # more than half of the pixel
    columns, rows = np.flatnonzero(red.any(axis=0)), np.flatnonzero(red.any(axis=1))
    found = (columns[0] - 0.5, rows[0] - 0.5, columns[-1] + 0.5, rows[-1] + 0.5)
    assert frame.box(left, top, right, bottom) == pytest.approx(found, abs=0.6)  # found to a pixel


def test_load_picture_turns_a_picture_upright(tmp_path):
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera lay on its right side
    pixels = np.zeros((40, 80, 3), np.uint8)
    pixels[:20] = 255
    Image.fromarray(pixels).save(tmp_path / "a.png", exif=exif)
    rgb = load_picture(tmp_path / "a.png").rgb
    assert rgb.shape == (80, 40, 3)
    assert rgb[:, 30].min() == 255 and rgb[:, 5].max() == 0


@pytest.mark.parametrize("size", [(12, 12), (4000, 16)])
def test_load_picture_picture_of_no_use_is_refused(tmp_path, size):
    Image.new("RGB", size).save(tmp_path / "a.png")
    with pytest.raises(BslamError, match=rf"a\.png: is {size[0]}x{size[1]}; allowed: sides from 32 px"):
        load_picture(tmp_path / "a.png")


def test_load_picture_truncated_picture_is_refused(tmp_path):
    noise = np.random.default_rng(1).integers(0, 255, (60, 80, 3), np.uint8)
    Image.fromarray(noise).save(tmp_path / "a.png")
    content = (tmp_path / "a.png").read_bytes()
    (tmp_path / "a.png").write_bytes(content[: len(content) // 2])
    with pytest.raises(BslamError, match=r"a\.png: cannot be read"):
        load_picture(tmp_path / "a.png")


@pytest.mark.parametrize("size", [(320, 240), (640, 480), (1601, 1200)])
def test_load_picture_of_a_camera_has_its_frame(tmp_path, size):
    camera = load_rig("wide180").cameras[0]
    Image.new("RGB", size, (10, 20, 30)).save(tmp_path / "a.png")
    scaled = load_picture(tmp_path / "a.png", camera)
    assert scaled.size_px == (320, 240)
    assert scaled.box(0, 0, *size) == pytest.approx((-0.5, -0.5, 319.5, 239.5), abs=0.2)


@pytest.mark.parametrize("size", [(319, 240), (160, 120), (640, 360), (240, 320)])
def test_load_picture_of_another_shape_than_its_camera_is_refused(tmp_path, size):
    Image.new("RGB", size).save(tmp_path / "a.png")
    allowed = r"allowed: 320x240, its camera's frame, or larger in the same proportion"
    with pytest.raises(BslamError, match=rf"a\.png: is {size[0]}x{size[1]}; {allowed}"):
        load_picture(tmp_path / "a.png", load_rig("wide180").cameras[0])


def test_camera_for_sees_60_degrees():
    lens = camera_for(320, 240).lens
    assert 160 / lens.fx_px == pytest.approx(np.tan(np.pi / 6))
    assert (lens.cx_px, lens.cy_px) == (159.5, 119.5)
