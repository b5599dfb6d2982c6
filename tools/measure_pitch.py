"""How well `bslam calibrate camera --drive` finds a camera's pitch, and whether its error bar holds.

Walks through worlds of style "test" with a camera whose pitch is drawn from -4 to 4 degrees and which is
believed to be level. Prints each drive's pitch, what was found and its error bar, then over all: rms and
median error, and the rms of error over error bar: 1 if it holds.

    .venv/bin/python tools/measure_pitch.py --worlds 7120:7130
"""

import argparse
import math
from dataclasses import replace

import numpy as np

from bslam.errors import BslamError
from bslam.experiment.calibrate import Estimate
from bslam.experiment.camera_pitch import find_pitch
from bslam.rig import Camera, load_rig
from bslam.world.camera import Renderer, make_world, walk

WALK_HZ = 5.0
PITCH_MAX_DEG = 4.0
MEDIAN_TO_SD = 1.4826


def found_pitch(seed: int, true_rad: float, level: Camera, frames: int) -> Estimate:
    """What a drive through a world tells of a camera of that pitch."""
    scene = make_world(seed, "test")
    poses = walk(scene, np.random.default_rng([seed, 1]), frames, hz=WALK_HZ).tolist()
    renderer = Renderer(scene, replace(level, pitch_rad=true_rad), [seed, 2])
    pictures = [
        renderer.render((x, y, theta), index / WALK_HZ).rgb for index, (x, y, theta) in enumerate(poses)
    ]
    return find_pitch(pictures, level)


def main() -> int:
    """Measures and prints."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--worlds", default="7120:7130", help="seeds FIRST:END (default 7120:7130)")
    parser.add_argument("--frames", type=int, default=240, help="of a drive (default 240)")
    arguments = parser.parse_args()
    first, end = (int(part) for part in arguments.worlds.split(":"))
    level = load_rig("three60").cameras[0]
    errors, bars = [], []
    for seed in range(first, end):
        true_deg = float(np.random.default_rng([seed, 5]).uniform(-PITCH_MAX_DEG, PITCH_MAX_DEG))
        try:
            found = found_pitch(seed, math.radians(true_deg), level, arguments.frames)
        except BslamError as error:
            print(f"{seed}: {true_deg:6.2f} deg, refused: {error}", flush=True)
            continue
        value_deg, bar_deg = math.degrees(found.value), math.degrees(found.error)
        print(f"{seed}: {true_deg:6.2f} deg, found {value_deg:6.2f} +- {bar_deg:.2f}", flush=True)
        errors.append(value_deg - true_deg)
        bars.append(bar_deg)
    off, told = np.array(errors), np.array(bars)
    print(
        f"{len(off)} of {end - first}: error rms {np.sqrt(np.mean(off**2)):.2f} deg, "
        f"{MEDIAN_TO_SD} median {MEDIAN_TO_SD * np.median(np.abs(off)):.2f}; "
        f"over its bar rms {np.sqrt(np.mean((off / told) ** 2)):.2f}, "
        f"beyond two of them {np.mean(np.abs(off) > 2 * told):.2f}"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
