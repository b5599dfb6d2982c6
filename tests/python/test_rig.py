"""Rigs from their files, and what a bad file is refused for."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest

from bslam.errors import BslamError
from bslam.rig import Camera, Lens, Pan, load_rig, rig_names

GOOD = """
[lens]
kind = "pinhole"
width_px = 160
height_px = 120
fx_px = 140.0
fy_px = 140.0
cx_px = 79.5
cy_px = 59.5

[[cameras]]
yaw_deg = 30.0
pitch_deg = 5.0
x_m = 0.1

[pan]
reach_deg = 45.0
speed_deg_per_s = 90.0
"""


def test_load_rig_reads_what_a_file_says(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD, encoding="utf-8")
    rig = load_rig(path)
    assert rig.name == "mine"
    (camera,) = rig.cameras
    assert camera.lens == Lens("pinhole", 160, 120, 140.0, 140.0, 79.5, 59.5)
    assert camera.yaw_rad == pytest.approx(math.pi / 6.0) and camera.pitch_rad == pytest.approx(0.0872665)
    assert (camera.x_m, camera.y_m, camera.z_m) == (0.1, 0.0, 0.5)
    assert rig.pan == Pan(math.radians(45.0), math.radians(90.0))


def test_rigs_of_the_package() -> None:
    assert rig_names() == ["pan60", "three60", "wide180"]
    three, wide, pan = (load_rig(name) for name in ("three60", "wide180", "pan60"))
    assert [round(math.degrees(camera.yaw_rad)) for camera in three.cameras] == [60, 0, -60]
    lens = three.cameras[0].lens
    assert 2.0 * math.degrees(math.atan(0.5 * lens.width_px / lens.fx_px)) == pytest.approx(60.0, abs=0.01)
    (fisheye,) = wide.cameras
    assert math.degrees(fisheye.lens.width_px / fisheye.lens.fx_px) == pytest.approx(180.0, abs=0.01)
    assert pan.pan is not None and three.pan is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"pinhole"', '"mirror"', r"\[lens\], key kind: 'mirror' .* 'pinhole' or 'equidistant'"),
        ("width_px = 160", "width_px = 15", r"key width_px: 15 .* 16 to 2048"),
        ("height_px = 120", "height_px = 1e3", r"key height_px: 1000\.0 .* integer"),
        ("fx_px = 140.0", "fx_px = nan", r"key fx_px: nan .* above 0"),
        ("fy_px = 140.0\n", "", r"key fy_px: is missing"),
        ("cx_px", "cx", r"key cx: no such key"),
        ("cy_px = 59.5", "cy_px = 59.5\nk1 = 2.0", r"key k1: 2\.0 .* -1 to 1"),
        ("yaw_deg = 30.0", "yaw_deg = 300.0", r"cameras\[0\], key yaw_deg: 300\.0"),
        ("x_m = 0.1", "x_m = 0.1\nz_m = 0.0", r"key z_m: 0\.0 .* above 0"),
        ("[[cameras]]", "[camera]", r"key camera: no such key"),
        ("speed_deg_per_s = 90.0", "speed_deg_per_s = 0.0", r"\[pan\], key speed_deg_per_s: 0\.0"),
        ("[lens]", "[[lens]]", r"key lens: .* a table \[lens\]"),
        ("[lens]", "[lens", r"not TOML"),
    ],
)
def test_load_rig_bad_file_is_refused_with_key_and_value(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    path = tmp_path / "bad.toml"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(BslamError, match=words) as error:
        load_rig(path)
    assert "bad.toml" in str(error.value)


def test_load_rig_unknown_name_lists_the_known() -> None:
    with pytest.raises(BslamError, match=r"rig 'two60'.* pan60, three60, wide180"):
        load_rig("two60")


def test_lens_and_camera_made_in_code_are_checked_too() -> None:
    with pytest.raises(BslamError, match=r"lens, kind: 'mirror'"):
        Lens("mirror", 320, 240, 277.1, 277.1, 159.5, 119.5)
    with pytest.raises(BslamError, match=r"camera, pitch_rad: nan"):
        Camera(Lens("pinhole", 320, 240, 277.1, 277.1, 159.5, 119.5), pitch_rad=math.nan)


def test_pan_step_keeps_speed_and_reach() -> None:
    pan = Pan(reach_rad=1.0, speed_radps=2.0)
    assert pan.step(0.0, 5.0, 0.1) == pytest.approx(0.2)
    assert pan.step(0.95, 5.0, 0.1) == 1.0
    assert pan.step(-0.95, -5.0, 0.1) == -1.0
    assert pan.step(0.5, 0.45, 0.1) == 0.45


def test_pan_sweep_goes_to_and_fro_at_its_speed() -> None:
    pan = Pan(reach_rad=1.0, speed_radps=2.0)
    angles = [pan.sweep(0.01 * i) for i in range(400)]
    assert angles[0] == 0.0 and max(angles) == pytest.approx(1.0) and min(angles) == pytest.approx(-1.0)
    assert all(abs(b - a) <= 0.02 + 1e-12 for a, b in pairwise(angles))
    assert pan.sweep(2.0) == pytest.approx(0.0, abs=1e-12)
