"""Light, exposure and noise; and that a seed decides all of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bslam.errors import BslamError
from bslam.rig import Camera
from bslam.world.camera import Renderer, from_rgb565, make_world, to_rgb565
from bslam.world.camera.scene import Drift, Scene

POSE = (3.0, 2.0, 0.0)
STEADY = Drift(0.0, 10.0, 0.0)


def lit(scene: Scene, level: float) -> Scene:
    """The scene in steady light of a given level."""
    rgb = (level, level, level)
    return replace(scene, lighting=replace(scene.lighting, lamp_rgb=rgb, sky_rgb=rgb, lamp_drift=STEADY))


def test_render_same_seed_and_calls_give_the_same_bits(poster_room: Scene, ahead: Camera) -> None:
    runs = []
    for _ in range(2):
        renderer = Renderer(poster_room, ahead, 5)
        runs.append([renderer.render((3.0, 2.0, 0.1 * i), 0.2 * i) for i in range(4)])
    for first, second in zip(*runs, strict=True):
        assert np.array_equal(first.rgb, second.rgb)
        assert np.array_equal(first.identity, second.identity)
        assert np.array_equal(first.depth_m, second.depth_m)
        assert first.seen == second.seen


def test_render_another_seed_changes_the_picture_but_not_the_truth(poster_room: Scene, ahead: Camera) -> None:
    first, second = (Renderer(poster_room, ahead, seed).render(POSE, 0.0) for seed in (1, [1, 2]))
    assert (first.rgb != second.rgb).mean() > 0.3
    assert np.array_equal(first.depth_m, second.depth_m) and np.array_equal(first.identity, second.identity)


def test_render_noise_is_fresh_in_each_frame(poster_room: Scene, ahead: Camera) -> None:
    renderer = Renderer(lit(poster_room, 1.0), ahead, 5)
    first, second = (renderer.render(POSE, 0.0).rgb.astype(int) for _ in range(2))
    difference = second - first
    assert 0.3 < difference.std() < 12.0
    assert abs(difference.mean()) < 0.2  # nothing but noise has changed


def test_render_exposure_settles_to_the_same_brightness_in_any_light(
    poster_room: Scene, ahead: Camera
) -> None:
    means = [Renderer(lit(poster_room, level), ahead, 5).render(POSE, 0.0).rgb.mean() for level in (0.2, 5.0)]
    assert means[0] == pytest.approx(means[1], rel=0.03)


def test_render_exposure_lags_behind_a_change_of_light(poster_room: Scene, ahead: Camera) -> None:
    scene = lit(poster_room, 1.0)
    # The lamps' level is 1 at 0 s and 1.8 from a little later on.
    jump = Drift(0.8 / (0.7 + 0.3 * np.sin(2.7 * np.pi / 2.0)), 0.004, 0.0)
    scene = replace(scene, lighting=replace(scene.lighting, lamp_drift=jump, sky_rgb=(0.0, 0.0, 0.0)))
    renderer = Renderer(scene, ahead, 5)
    before = renderer.render(POSE, 0.0).rgb.mean()
    after = [renderer.render(POSE, 0.001 + 0.04 * i).rgb.mean() for i in range(80)]
    assert after[0] > 1.15 * before
    assert after[5] < after[0]
    assert after[-1] == pytest.approx(before, rel=0.05)


def test_render_balance_drifts(poster_room: Scene, ahead: Camera) -> None:
    renderer = Renderer(lit(poster_room, 1.0), ahead, 5)
    ratios = []
    for time_s in np.arange(0.0, 60.0, 5.0):
        mean = renderer.render(POSE, float(time_s)).rgb.reshape(-1, 3).mean(axis=0)
        ratios.append(mean[0] / mean[2])
    assert 0.01 < np.ptp(ratios) < 0.3


def test_render_turning_blurs_along_the_row(ahead: Camera) -> None:
    scene = make_world(3)
    sharp = Renderer(scene, ahead, 5)
    sharp.render((2.0, 2.0, 0.0), 0.0)
    still = sharp.render((2.0, 2.0, 0.0), 0.2).rgb.astype(float)
    turning = Renderer(scene, ahead, 5)
    turning.render((2.0, 2.0, -0.3), 0.0)
    moved = turning.render((2.0, 2.0, 0.0), 0.2).rgb.astype(float)

    def roughness(picture: np.ndarray) -> float:
        return float(np.abs(np.diff(picture, axis=1)).mean())

    assert roughness(moved) < 0.97 * roughness(still)


@pytest.mark.parametrize(
    ("pose", "time_s"), [((np.nan, 0.0, 0.0), 0.0), ((0.0, np.inf, 0.0), 0.0), (POSE, np.nan)]
)
def test_render_what_is_not_finite_is_refused(
    poster_room: Scene, ahead: Camera, pose: tuple[float, float, float], time_s: float
) -> None:
    renderer = Renderer(poster_room, ahead, 5)
    with pytest.raises(BslamError, match=r"allowed: finite numbers"):
        renderer.render(pose, time_s)
    # And nothing has changed by it.
    assert np.array_equal(
        renderer.render(POSE, 0.0).rgb, Renderer(poster_room, ahead, 5).render(POSE, 0.0).rgb
    )


def test_rgb565_is_within_half_a_step_and_keeps_black_and_white() -> None:
    every = np.stack([np.arange(256, dtype=np.uint8)] * 3, axis=-1)[np.newaxis]
    packed = to_rgb565(every)
    assert packed.dtype == np.uint16 and packed[0, 0] == 0 and packed[0, 255] == 0xFFFF
    error = np.abs(from_rgb565(packed).astype(int) - every)
    assert error[..., 1].max() <= 3 and error[..., [0, 2]].max() <= 5
    assert np.array_equal(to_rgb565(from_rgb565(packed)), packed)
