"""The pitch of a rendered camera is found, whatever it was believed to be."""

import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from bslam.calibration.camera_pitch import find_pitch, load_drive
from bslam.errors import BslamError
from bslam.rig import load_rig
from bslam.world.camera import Renderer, make_world, walk

LEVEL = load_rig("three60").cameras[0]
SEED = 7109


def drive(pitch_rad, frames):
    scene = make_world(SEED, "test")
    poses = walk(scene, np.random.default_rng([SEED, 1]), frames, hz=5)
    renderer = Renderer(scene, replace(LEVEL, pitch_rad=pitch_rad), [SEED, 2])
    return [renderer.render(pose, index / 5).rgb for index, pose in enumerate(poses)]


def test_find_pitch_of_a_camera_that_was_believed_to_be_level():
    found = find_pitch(drive(math.radians(3.0), 120), LEVEL)
    assert math.degrees(found.value) == pytest.approx(3.0, abs=0.3)
    assert 0.0 < math.degrees(found.error) < 0.5


def test_find_pitch_where_nothing_is_seen_is_refused():
    with pytest.raises(
        BslamError, match=r"^0 doors, cabinets and the like, whole and well seen, in 3 pictures"
    ):
        find_pitch([np.full((240, 320, 3), 128, np.uint8)] * 3, LEVEL)


def test_find_pitch_from_a_moment_of_a_drive_is_refused_for_it_has_no_error_bar():
    moment = drive(math.radians(3.0), 29)[-1]
    grey = np.full((240, 320, 3), 128, np.uint8)
    with pytest.raises(BslamError, match=r"what is seen does not agree on a pitch: .* known to inf"):
        find_pitch([moment] * 14 + [grey] * 130, LEVEL)


def test_load_drive_takes_pictures_in_order_and_refuses_none(tmp_path):
    for name, grey in (("b.png", 20), ("a.png", 10)):
        Image.fromarray(np.full((240, 320, 3), grey, np.uint8)).save(tmp_path / name)
    assert [int(picture[0, 0, 0]) for picture in load_drive(tmp_path, LEVEL)] == [10, 20]
    with pytest.raises(BslamError, match="no pictures; allowed: a folder with"):
        load_drive(tmp_path / "nowhere", LEVEL)
