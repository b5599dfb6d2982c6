"""Signatures of many rendered beacons, to learn from and to test with."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bslam.rig import load_rig
from bslam.world.camera import Renderer, Scene, Seen, dress, free_pose, make_world
from bslam.world.scenario import load_scenario
from tools.training.detector_samples import blank_detector, model_of
from tools.training.front_end import FrontEnd

SEEN_PX_MIN = 150
SEEN_SHARE_MIN = 0.7
SLANT_MAX_RAD = math.radians(60)
BOX_SD_PX = 1.0  # how far a detector's box is off, each side
NEAR_M = 6.0
FRAMES_FIRST = 20  # in which the front end gets to know the room
SECONDS_A_FRAME = 0.2


@dataclass(frozen=True)
class Views:
    """Signatures (n, 71) of objects, each view with the object's number (n,)."""

    signatures: NDArray[np.float32]
    objects: NDArray[np.int64]

    @property
    def object_count(self) -> int:
        return int(self.objects.max()) + 1


def rendered(scenario: str, seed: int, frames: int, least: int) -> Views:
    """Beacons of a dressed scenario, seen from all over it; those with at least `least` views."""
    scene = dress(load_scenario(scenario), seed)
    random = np.random.default_rng([seed, 1])
    camera = load_rig("three60").cameras[1]
    renderer = Renderer(scene, camera, seed)
    front_end = FrontEnd([camera], model_of(blank_detector()))
    signatures, names = [], []
    for frame in range(frames):
        pose = _pose(scene, random, aimed=frame % 2 == 0)
        for name, signature in _look(renderer, front_end, pose, frame, random):
            if frame >= FRAMES_FIRST:
                signatures.append(signature)
                names.append(name)
    kept = [name for name in sorted(set(names)) if names.count(name) >= least]
    chosen = [index for index, name in enumerate(names) if name in kept]
    objects = np.array([kept.index(names[index]) for index in chosen], np.int64)
    return Views(np.array(signatures, np.float32)[chosen], objects)


def generic(count: int, first_world: int) -> NDArray[np.float32]:
    """(count, 71) signatures of beacons of as many worlds made for training, one of each."""
    signatures: list[NDArray[np.float32]] = []
    world = first_world
    while len(signatures) < count:
        one = _one_of_world(world)
        signatures += [one] if one is not None else []
        world += 1
    return np.array(signatures)


def _one_of_world(world: int) -> NDArray[np.float32] | None:
    scene = make_world(world)
    random = np.random.default_rng([world, 2])
    camera = load_rig("three60").cameras[1]
    renderer = Renderer(scene, camera, world)
    front_end = FrontEnd([camera], model_of(blank_detector()))
    found: list[NDArray[np.float32]] = []
    for frame in range(FRAMES_FIRST):
        pose = _pose(scene, random, aimed=frame % 2 == 0)
        found += [one for _, one in _look(renderer, front_end, pose, frame, random)]
    return found[-1] if found else None


def _pose(scene: Scene, random: np.random.Generator, aimed: bool) -> tuple[float, float, float]:
    """A free pose; an aimed one looks towards a beacon that is not far."""
    x_m, y_m, theta_rad = free_pose(scene, random)
    if aimed and scene.beacons:
        near = [one for one in scene.beacons if math.hypot(one.x_m - x_m, one.y_m - y_m) < NEAR_M]
        if near:
            beacon = near[int(random.integers(len(near)))]
            theta_rad = math.atan2(beacon.y_m - y_m, beacon.x_m - x_m) + random.normal(0.0, 0.2)
    return x_m, y_m, theta_rad


def _look(
    renderer: Renderer,
    front_end: FrontEnd,
    pose: tuple[float, float, float],
    frame: int,
    random: np.random.Generator,
) -> list[tuple[int, NDArray[np.float32]]]:
    """Beacon ids and signatures of the beacons that a frame shows well."""
    picture = renderer.render(pose, SECONDS_A_FRAME * frame)
    front_end.see(picture.rgb)
    found = []
    for seen in picture.seen:
        if _is_good(seen):
            left, top, right, bottom = (np.array(seen.box) + random.normal(0.0, BOX_SD_PX, 4)).tolist()
            signature = front_end.signature((left, top, right, bottom))
            found += [(seen.beacon_id, signature)] if signature is not None else []
    return found


def _is_good(seen: Seen) -> bool:
    """Whole, large enough, hardly hidden and not too slanted."""
    visible = seen.visible_px >= max(SEEN_PX_MIN, SEEN_SHARE_MIN * seen.own_px)
    return visible and not seen.cut and seen.slant_rad < SLANT_MAX_RAD
