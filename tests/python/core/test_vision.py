"""The front end through its Python binding: what it refuses, what it says of pictures that show nothing, and
that it finds beacons in a rendered world."""

import math
import re

import numpy as np
import pytest

from bslam.core import CoreError
from bslam.core.vision import FrontEnd
from bslam.core.visual_gyro import VisualGyro
from bslam.errors import BslamError
from bslam.modelfile import BeaconClass
from bslam.rig import Camera, load_rig
from bslam.world.camera import Renderer, make_world, walk
from bslam_build import FIRMWARE_DIR
from tools.training.front_end import FrontEnd as OpenFrontEnd


@pytest.fixture
def camera() -> Camera:
    return load_rig("three60").cameras[1]


def plain(level: int) -> np.ndarray:
    return np.full((240, 320, 3), level, np.uint8)


@pytest.mark.parametrize(
    "picture",
    [
        np.zeros((120, 160, 3), np.uint8),
        np.zeros((240, 320, 4), np.uint8),
        np.zeros((240, 320, 3), np.float32),
        np.zeros((240, 640, 3), np.uint8)[:, ::2],
        np.zeros((240, 320), np.uint8),
        [[0, 0, 0]],
        None,
    ],
)
def test_see_picture_of_another_kind_is_refused_with_what_is_allowed(
    camera: Camera, picture: np.ndarray
) -> None:
    front_end = FrontEnd([camera])
    with pytest.raises(BslamError, match=r"\(240, 320, 3\) uint8"):
        front_end.see(picture)
    assert sum(front_end.counts().values()) == 0


def test_see_camera_that_is_not_there_is_refused(camera: Camera) -> None:
    with pytest.raises(BslamError, match="0 to 0"):
        FrontEnd([camera]).see(plain(0), camera=1)


def test_front_end_without_cameras_is_refused() -> None:
    with pytest.raises(CoreError):
        FrontEnd([])


def test_point_beyond_half_a_turn_is_refused(camera: Camera) -> None:
    with pytest.raises(CoreError):
        FrontEnd([camera]).point(0, 4.0)


@pytest.mark.parametrize(("level", "reason"), [(0, "black"), (255, "overexposed"), (120, "flat")])
def test_see_picture_of_one_colour_shows_nothing_and_says_why(
    camera: Camera, level: int, reason: str
) -> None:
    front_end = FrontEnd([camera])
    seeing = front_end.see(plain(level))
    assert seeing.candidates == ()
    assert seeing.reason == reason
    assert front_end.counts()[reason] == 1


ROWS, COLUMNS = np.mgrid[:240, :320].astype(float)


def grey(random: np.random.Generator) -> np.ndarray:
    return random.normal(120.0, 3.0, (240, 320))


def half_lost(random: np.random.Generator, level: float) -> np.ndarray:
    lost = random.uniform(20.0, 220.0) < ROWS
    return np.where(lost, level, grey(random))


MADE_UP = {
    "noise": lambda random: random.uniform(0.0, 255.0, (240, 320)),
    "soft noise": lambda random: random.normal(120.0, random.uniform(2.0, 30.0), (240, 320)),
    "gradient": lambda random: 60.0 + COLUMNS * random.uniform(0.0, 0.3) + ROWS * random.uniform(0.0, 0.3),
    "stripes": lambda random: np.where(COLUMNS // random.integers(2, 40) % 2, 200.0, 60.0),
    "bands": lambda random: np.where(ROWS // random.integers(2, 40) % 2, 200.0, 60.0),
    "board": lambda random: np.where((COLUMNS // 20 + ROWS // random.integers(2, 40)) % 2, 200.0, 60.0),
    "cut short": lambda random: half_lost(random, 0.0),
    "half overexposed": lambda random: half_lost(random, 255.0),
    "half covered": lambda random: np.where(random.uniform(80, 240) < COLUMNS, 0.0, grey(random)),
}


@pytest.mark.parametrize("rig", ["three60", "wide180"])
@pytest.mark.parametrize("kind", MADE_UP)
def test_see_picture_that_shows_nothing_makes_no_sighting_up(rig: str, kind: str) -> None:
    """With the trained detectors, at their own thresholds; each picture twice, the room known and not."""
    random, front_end = np.random.default_rng(3), FrontEnd(load_rig(rig).cameras[:1])
    for _ in range(3):
        values = np.clip(MADE_UP[kind](random), 0.0, 255.0).astype(np.uint8)
        picture = np.ascontiguousarray(np.repeat(values[:, :, None], 3, axis=2))
        for _ in range(2):
            assert front_end.see(picture).candidates == ()


def test_see_packed_picture_is_as_the_unpacked_one(camera: Camera) -> None:
    random = np.random.default_rng(0)
    packed = random.integers(0, 2**16, (240, 320), dtype=np.uint16)
    rgb = np.stack([(packed >> 11) << 3, (packed >> 5 & 63) << 2, (packed & 31) << 3], axis=-1)
    values = []
    for picture in (packed, rgb.astype(np.uint8)):
        front_end = OpenFrontEnd([camera])
        front_end.see(picture)
        values.append(front_end.cell_values())
    assert np.array_equal(*values)


def test_see_finds_beacons_of_a_rendered_world_where_they_are(camera: Camera) -> None:
    found, hits = 0, 0
    for seed in range(11, 27):
        scene = make_world(seed, "train")
        renderer = Renderer(scene, camera, seed)
        front_end = FrontEnd([camera])
        for index, pose in enumerate(walk(scene, np.random.default_rng(seed), 6, hz=1)):
            picture = renderer.render(pose, float(index))
            for candidate in front_end.see(picture.rgb).candidates:
                left, top, right, bottom = (round(edge) for edge in candidate.outline)
                inside = picture.identity[max(top, 0) : bottom, max(left, 0) : right]
                found += 1
                hits += (inside >= 0).mean() > 0.4
                assert candidate.range_m is None or candidate.range_m > 0.0
    # Worlds of the training set: nearly everything said is on a beacon.
    assert found >= 60
    assert hits >= 0.85 * found


def test_threshold_decides_how_much_is_a_candidate(camera: Camera) -> None:
    scene = make_world(14, "train")
    picture = Renderer(scene, camera, 14).render(walk(scene, np.random.default_rng(14), 1, hz=5)[0], 0.0)
    counts = []
    for threshold in (-4.0, FrontEnd([camera]).threshold(), 50.0):
        counts.append(len(FrontEnd([camera], threshold=threshold).see(picture.rgb).candidates))
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 0


def test_see_tells_how_far_the_robot_turned_in_a_rendered_world() -> None:
    camera = load_rig("three60").cameras[1]
    scene = make_world(21, "test")
    renderer, front_end = Renderer(scene, camera, 21), FrontEnd([camera])
    x_m, y_m, theta_rad = walk(scene, np.random.default_rng(21), 1, hz=5)[0]
    errors_rad = []
    assert front_end.see(renderer.render((x_m, y_m, theta_rad), 0.0).rgb).turn is None
    for step in range(1, 25):  # turning on the spot, ever faster
        turned_rad = 0.004 * step
        theta_rad += turned_rad
        turn = front_end.see(renderer.render((x_m, y_m, theta_rad), 0.04 * step).rgb).turn
        if turn is not None:
            errors_rad.append(turn.turn_rad - turned_rad)
    assert len(errors_rad) >= 18
    assert np.median(np.abs(errors_rad)) < 0.001
    assert np.max(np.abs(errors_rad)) < 0.005


def test_a_black_frame_tells_no_turn() -> None:
    camera = load_rig("three60").cameras[1]
    front_end = FrontEnd([camera])
    black = np.zeros((240, 320, 3), np.uint8)
    assert front_end.see(black).turn is None
    assert front_end.see(black).turn is None


def test_the_gyro_s_noise_is_the_header_s() -> None:
    header = (FIRMWARE_DIR / "vision" / "vision.h").read_text(encoding="utf-8")
    values = re.findall(r"#define BSLAM_VISUAL_GYRO_(?:WIDE_)?SD_RADPS ([0-9.]+)f", header)
    assert [float(value) for value in values] == [VisualGyro.SD_RADPS, VisualGyro.WIDE_SD_RADPS]


def test_measure_of_a_box_gives_what_a_sighting_needs(camera: Camera) -> None:
    picture = plain(170)
    picture[180:] = 80
    picture[90:150, 120:170] = (150, 20, 20)
    front_end = OpenFrontEnd([camera])
    front_end.see(picture)
    found = front_end.measure((119.5, 89.5, 169.5, 149.5), BeaconClass("red", 0.6))
    assert found is not None and found.bearing_rad is not None
    assert found.bearing_rad == pytest.approx(math.atan((159.5 - 144.5) / 277.1), abs=0.004)
    assert found.range_m == pytest.approx(0.6 * 277.1 / 60.0, rel=0.03)
