"""Pictures to train and measure detectors on: random worlds, walked through, a file a world.

A file holds what the front end gets and what is true of it: pictures in RGB565, how much of each cell shows
a beacon, and every beacon in view. Files are kept and not made again, so that rendering can be interrupted;
they stand under build/training/<lens>_<style>/.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from bslam.rig import Camera, load_rig
from bslam.world.camera import Renderer, make_world, walk

FRAMES_A_WORLD = 25
FRAMES_HZ = 5
CELL_PX = 4
RIGS = {"pinhole": load_rig("three60"), "wide": load_rig("wide180")}
"""The cameras of each kind of lens that has a detector of its own."""

KINDS = ("extinguisher", "radiator", "door", "window", "poster", "sign", "cabinet")
SEEN = np.dtype(
    [
        ("frame", np.int16),
        ("beacon_id", np.int16),
        ("kind", np.int8),  # index into KINDS
        ("box", np.float32, 4),
        ("visible_px", np.int32),
        ("own_px", np.int32),
        ("cut", np.bool_),
        ("slant_rad", np.float32),
        ("bearing_rad", np.float32),
        ("range_m", np.float32),
    ]
)


@dataclass(frozen=True)
class World:
    """A walk through one world: n frames, in order."""

    seed: int
    pictures: NDArray[np.uint16]  # (n, height, width) RGB565
    cover: NDArray[np.uint8]  # (n, rows, columns) pixels of a cell that show a beacon, 0 to 16
    clutter: NDArray[np.uint8]  # (n, rows, columns) pixels that show clutter
    seen: NDArray[np.void]  # of SEEN


def camera_of(lens: str, seed: int) -> Camera:
    """The camera that walks through a world: those of the rig in turn."""
    cameras = RIGS[lens].cameras
    return cameras[seed % len(cameras)]


def rgb565(rgb: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """(..., 3) uint8 to RGB565, cut off as the C core does."""
    red, green, blue = np.moveaxis(rgb.astype(np.uint16), -1, 0)
    return (red >> 3) << 11 | (green >> 2) << 5 | blue >> 3


def render_world(seed: int, style: str, camera: Camera, frames: int = FRAMES_A_WORLD) -> World:
    """Walks through the world of a seed and style with a camera on the robot."""
    scene = make_world(seed, style)
    poses = walk(scene, np.random.default_rng([seed, 1]), frames, hz=FRAMES_HZ)
    renderer = Renderer(scene, camera, [seed, 2])
    taken = [renderer.render(pose, index / FRAMES_HZ) for index, pose in enumerate(poses)]
    seen = [
        (
            index,
            one.beacon_id,
            KINDS.index(one.kind),
            one.box,
            one.visible_px,
            one.own_px,
            one.cut,
            one.slant_rad,
            one.bearing_rad,
            one.range_m,
        )
        for index, frame in enumerate(taken)
        for one in frame.seen
    ]
    return World(
        seed,
        np.stack([rgb565(frame.rgb) for frame in taken]),
        np.stack([_cell_counts(frame.identity >= 0) for frame in taken]),
        np.stack([_cell_counts(frame.identity == -2) for frame in taken]),
        np.array(seen, dtype=SEEN),
    )


def world_path(folder: Path, lens: str, style: str, seed: int) -> Path:
    """Where the file of a world stands."""
    return folder / f"{lens}_{style}" / f"{seed:06d}.npz"


def render_set(folder: Path, lens: str, style: str, seeds: Iterable[int], processes: int) -> None:
    """Makes the files of these worlds that are missing."""
    missing = [seed for seed in seeds if not world_path(folder, lens, style, seed).is_file()]
    if not missing:
        return
    count = len(missing)
    with ProcessPoolExecutor(processes) as pool:
        made = pool.map(_render_to_file, [folder] * count, [lens] * count, [style] * count, missing)
        for _ in tqdm(made, total=count, desc=f"rendering {lens} {style}", unit="world"):
            pass


def read_world(folder: Path, lens: str, style: str, seed: int) -> World:
    """A world from its file."""
    with np.load(world_path(folder, lens, style, seed)) as file:
        return World(seed, file["pictures"], file["cover"], file["clutter"], file["seen"])


def _cell_counts(mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    rows, columns = mask.shape[0] // CELL_PX, mask.shape[1] // CELL_PX
    return mask.reshape(rows, CELL_PX, columns, CELL_PX).sum(axis=(1, 3)).astype(np.uint8)


def _render_to_file(folder: Path, lens: str, style: str, seed: int) -> None:
    path = world_path(folder, lens, style, seed)
    world = render_world(seed, style, camera_of(lens, seed))
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".part{os.getpid()}.npz")
    np.savez(part, pictures=world.pictures, cover=world.cover, clutter=world.clutter, seen=world.seen)
    part.replace(path)  # whole or not at all
