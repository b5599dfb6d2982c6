"""How long the simulated camera takes: makes worlds, walks in them and renders, as a training set does.

Prints CPU seconds for --frames pictures (25 a world) of the 60-degree and the 180-degree camera, the making
of the worlds included. `.venv/bin/python tools/measure_renderer.py [--frames 5000] [--rigs wide180]`
"""

import argparse
import time

import numpy as np

from bslam.rig import load_rig
from bslam.world.camera import Renderer, make_world, walk

FRAMES_A_WORLD = 25
WALK_HZ = 5.0


def measure(rig_name: str, frames: int, first_seed: int) -> tuple[float, float]:
    """CPU seconds for making worlds, and for rendering, with the rig's cameras in turn."""
    cameras = load_rig(rig_name).cameras
    making_s = rendering_s = 0.0
    for seed in range(first_seed, first_seed + frames // FRAMES_A_WORLD):
        start_s = time.process_time()
        scene = make_world(seed)
        renderers = [Renderer(scene, camera, [seed, index]) for index, camera in enumerate(cameras)]
        poses = walk(scene, np.random.default_rng(seed), FRAMES_A_WORLD, WALK_HZ)
        made_s = time.process_time()
        for step, pose in enumerate(poses.tolist()):
            renderers[step % len(cameras)].render((pose[0], pose[1], pose[2]), step / WALK_HZ)
        rendering_s += time.process_time() - made_s
        making_s += made_s - start_s
    return making_s, rendering_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=5000, help="a multiple of 25 (default 5000)")
    parser.add_argument("--seed", type=int, default=0, help="of the first world (default 0)")
    parser.add_argument("--rigs", nargs="+", default=["three60", "wide180"])
    arguments = parser.parse_args()
    for rig_name in arguments.rigs:
        making_s, rendering_s = measure(rig_name, arguments.frames, arguments.seed)
        each_ms = 1000.0 * (making_s + rendering_s) / arguments.frames
        print(
            f"{rig_name}: {arguments.frames} frames in {making_s + rendering_s:.1f} s of CPU "
            f"({making_s:.1f} s for {arguments.frames // FRAMES_A_WORLD} worlds), {each_ms:.1f} ms a frame"
        )


if __name__ == "__main__":
    main()
