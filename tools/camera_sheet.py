"""Draws docs/img/camera_frames.png: what the simulated cameras see.

Rows: training worlds, test worlds and a dressed scenario through a 60-degree lens, test worlds through the
180-degree lens, and one frame of each with its identity picture. `.venv/bin/python tools/camera_sheet.py`
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bslam.rig import Camera, load_rig
from bslam.world.camera import CLUTTER, Frame, Renderer, Scene, dress, free_pose, make_world
from bslam.world.scenario import load_scenario

COLUMNS = 4
SCALE = 0.75
DRAWS = 12  # a pose is the one of so many that shows most beacons
SMALL_PX = 300  # what shows less of itself does not count as shown
COLOURS = 224  # of the PNG: the file stays small


def best_frame(scene: Scene, camera: Camera, seed: int) -> Frame:
    """Of several free poses the one that shows most beacons."""
    random = np.random.default_rng(seed)
    poses = [free_pose(scene, random) for _ in range(DRAWS)]
    frames = [Renderer(scene, camera, seed).render(pose, 0.0) for pose in poses]
    return max(frames, key=lambda frame: sum(seen.visible_px > SMALL_PX for seen in frame.seen))


def truth_picture(frame: Frame) -> NDArray[np.uint8]:
    """Each beacon in a colour of its own over the grey picture; clutter white."""
    grey = frame.rgb.mean(axis=2, keepdims=True).repeat(3, axis=2) * 0.5
    for seen in frame.seen:
        colour = np.random.default_rng(seen.beacon_id + 100).integers(40, 255, 3)
        grey[frame.identity == seen.beacon_id] = colour
    grey[frame.identity == CLUTTER] = 255
    return grey.astype(np.uint8)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--into", type=Path, default=Path("docs/img/camera_frames.png"))
    into: Path = parser.parse_args().into
    narrow, wide = load_rig("three60").cameras[1], load_rig("wide180").cameras[0]
    seeds = range(20, 20 + COLUMNS)
    room = load_scenario("paper_room")
    rows = [
        [best_frame(make_world(seed, "train"), narrow, seed) for seed in seeds],
        [best_frame(make_world(seed, "test"), narrow, seed) for seed in seeds],
        [best_frame(dress(room, seed), narrow, seed) for seed in seeds],
        [best_frame(make_world(seed, "test"), wide, seed) for seed in seeds],
    ]
    pictures = [np.hstack([frame.rgb for frame in row]) for row in rows]
    pictures.append(np.hstack([truth_picture(row[0]) for row in rows]))
    sheet = Image.fromarray(np.vstack(pictures))
    small = sheet.resize((round(SCALE * sheet.width), round(SCALE * sheet.height)), Image.Resampling.LANCZOS)
    into.parent.mkdir(parents=True, exist_ok=True)
    small.quantize(COLOURS, dither=Image.Dither.NONE).save(into, optimize=True)


if __name__ == "__main__":
    main()
