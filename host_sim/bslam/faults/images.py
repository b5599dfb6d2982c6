"""Faults of a camera's pictures: cut short, too dark, too bright, blurred, covered."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from bslam.core.vision import Candidate, FrontEnd
from bslam.faults.promise import Fault, Measured
from bslam.rig import Camera, load_rig

if TYPE_CHECKING:
    from bslam.world.camera import Frame

Picture = NDArray[np.uint8]

_FIRST_WORLD, _WORLDS, _FRAMES = 500, 16, 6
_MADE_UP_SHARE = 0.15  # of the candidates; of undisturbed pictures 0.04
_ON_BEACON = 0.4  # of the pixels within an outline: what stands before a beacon may hide the rest
_ALL_BOXES = -4.0  # a threshold that each box looked at reaches


def _camera() -> Camera:
    return load_rig("three60").cameras[1]


@cache
def _frames() -> tuple[Frame, ...]:
    """Of walks through rendered worlds of the test set."""
    from bslam.world.camera import Renderer, make_world, walk  # here: most commands need no ray caster

    frames = []
    for seed in range(_FIRST_WORLD, _FIRST_WORLD + _WORLDS):
        scene = make_world(seed, "test")
        renderer = Renderer(scene, _camera(), seed)
        path = walk(scene, np.random.default_rng(seed), _FRAMES, hz=1)
        frames += [renderer.render(pose, float(index)) for index, pose in enumerate(path)]
    return tuple(frames)


def _scaled(rgb: Picture, factor: float) -> Picture:
    return (rgb.astype(np.float64) * factor).clip(0, 255).astype(np.uint8)


def _is_on_beacon(frame: Frame, candidate: Candidate) -> bool:
    left, top, right, bottom = (round(edge) for edge in candidate.outline)
    inside = frame.identity[max(top, 0) : bottom, max(left, 0) : right]
    return inside.size > 0 and float((inside >= 0).mean()) > _ON_BEACON


def _cut_short(protected: bool) -> Measured:
    """Half of a picture, then the end; and a whole one after it."""
    rgb = next(one.rgb for one in _frames() if FrontEnd([_camera()]).see(one.rgb).candidates)
    half = rgb.shape[0] // 2
    front_end = FrontEnd([_camera()])
    if protected:
        status, reason = front_end.see_part(rgb, half)
    else:  # what did not come is taken to be black
        rest = rgb.copy()
        rest[half:] = 0
        status, reason = "taken", front_end.see(rest).reason
    again, fresh = (one.see(rgb) for one in (front_end, FrontEnd([_camera()])))
    same = [one.outline for one in again.candidates] == [one.outline for one in fresh.candidates]
    text = f"{status}, {reason}; the next one shows {'what it does by itself' if same else 'something else'}"
    return Measured(status != "taken" and reason == "unfinished" and same, text)


class _Light(NamedTuple):
    """A picture's light gone wrong, and what a camera without a check of it would pass on."""

    reason: str
    spoil: Callable[[Picture], Picture]
    pass_on: Callable[[Picture], Picture]


def _covered(rgb: Picture) -> Picture:
    """A lens with a hand on it: its noise."""
    noise = np.random.default_rng(0).normal(60, 1, rgb.shape)
    return noise.clip(0, 255).astype(np.uint8)


_LIGHTS = {
    # A gain makes a picture of the last few steps again.
    "black": _Light("black", partial(_scaled, factor=0.02), partial(_scaled, factor=50)),
    # Saturated below the brightest value.
    "overexposed": _Light("overexposed", partial(_scaled, factor=12), partial(_scaled, factor=0.7)),
    # A gain about the middle.
    "covered": _Light("flat", _covered, lambda rgb: (120 + 40 * (rgb - 60.0)).clip(0, 255).astype(np.uint8)),
}


def _bad_light(name: str, protected: bool) -> Measured:
    light, seen, candidates = _LIGHTS[name], 0, 0
    for frame in _frames():
        spoiled = light.spoil(frame.rgb)
        seeing = FrontEnd([_camera()]).see(spoiled if protected else light.pass_on(spoiled))
        seen += seeing.reason == light.reason
        candidates += len(seeing.candidates)
    text = f"'{light.reason}' said of {seen} of {len(_frames())} pictures, {candidates} candidates"
    return Measured(seen == len(_frames()) and candidates == 0, text)


def _blurred(rgb: Picture) -> Picture:
    return np.ascontiguousarray(gaussian_filter(rgb, (8, 8, 0)))


def _half_covered(rgb: Picture) -> Picture:
    covered = rgb.copy()
    covered[:, : rgb.shape[1] // 2] = _scaled(_covered(rgb[:, : rgb.shape[1] // 2]), 0.5)
    return covered


def _bad_view(spoil: Callable[[Picture], Picture], protected: bool) -> Measured:
    """What is still seen is there; nothing is made up."""
    threshold = None if protected else _ALL_BOXES
    found = right = 0
    for frame in _frames():
        for candidate in FrontEnd([_camera()], threshold=threshold).see(spoil(frame.rgb)).candidates:
            found += 1
            right += _is_on_beacon(frame, candidate)
    return Measured(
        found >= 1 and found - right <= _MADE_UP_SHARE * found,
        f"{found} candidates in {len(_frames())} pictures, {right} of them on a beacon",
    )


def image_faults() -> list[Fault]:
    """The rows of pictures."""
    light = "the look at a picture's light"
    detector = "the detector's threshold"
    made_up = f"at most {100 * _MADE_UP_SHARE:g} % of what is seen is no beacon"
    return [
        Fault("image: truncated", "refused, the next one is whole", "the count of rows", _cut_short),
        *(
            Fault(f"image: {name}", "no candidate, and why", light, partial(_bad_light, name))
            for name in _LIGHTS
        ),
        Fault("image: blurred", made_up, detector, partial(_bad_view, _blurred)),
        Fault("image: half covered", made_up, detector, partial(_bad_view, _half_covered)),
    ]
