"""Writes a film for an emulated board: its robot turns on the spot in a room, and its camera takes pictures.

    .venv/bin/python -m tools.proofs.make_film paper_room out/turn.film
    bslam console qemu:stm32f405:out/turn.film --reset --record drive.mcap --seconds 20
    bslam replay drive.mcap

The film goes round and round: after a turn the robot sees what it saw.
"""

import argparse
import math
import sys
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np

from bslam.core.slam import Slam
from bslam.link.messages import CameraRecord
from bslam.rig import Camera, load_rig
from bslam.target.film import write_film
from bslam.world.camera.renderer import Renderer
from bslam.world.camera.rgb565 import to_rgb565
from bslam.world.camera.worlds import dress
from bslam.world.simulate import load_scenario, true_drive

STEP_US = 40_000


def camera_record(camera: Camera) -> CameraRecord:
    """The camera as it goes over the link."""
    kind, *numbers = astuple(camera.lens)
    mounting = (camera.yaw_rad, camera.pitch_rad, camera.z_m, camera.zoom)
    return CameraRecord(*(0 if kind == "pinhole" else 1, *numbers, *mounting))


def smaller(camera: Camera, factor: int) -> Camera:
    """The same camera with so many times fewer pixels each way."""
    lens = camera.lens
    sides = {name: getattr(lens, name) // factor for name in ("width_px", "height_px")}
    lengths = {name: getattr(lens, name) / factor for name in ("fx_px", "fy_px")}
    centre = {name: (getattr(lens, name) + 0.5) / factor - 0.5 for name in ("cx_px", "cy_px")}
    return replace(camera, lens=replace(lens, **sides, **lengths, **centre))


def turn_ticks(steps: int) -> np.ndarray:
    """(steps, 2): a turn to the left on the spot, in ticks of a robot with default parameters."""
    params = Slam.defaults()
    turns = params["wheelbase_m"] / (2 * params["left_radius_m"])
    gone = np.round(np.arange(steps + 1) / steps * turns * params["ticks_per_revolution"]).astype(np.int64)
    return np.stack([-np.diff(gone), np.diff(gone)], axis=1)


def make_film(
    path: Path,
    scenario_name: str,
    seed: int,
    camera: Camera,
    pictures: int,
    steps: int,
    gyro_sd_radps: float | None = None,
) -> None:
    """Render and write it. The first picture is taken at the first reading, after a step of the turn.

    gyro_sd_radps: the noise of the robot's gyro; None: it has none.
    """
    scenario = load_scenario(scenario_name)
    renderer, drive = Renderer(dress(scenario, seed), camera, [seed, 1]), true_drive(scenario, seed)
    x_m, y_m, theta_rad = (float(column[0]) for column in (drive.x_m, drive.y_m, drive.theta_rad))
    every = steps // pictures
    shots = []
    for number in range(pictures):
        turned_rad = theta_rad + 2 * math.pi * (1 + number * every) / steps
        shots.append(to_rgb565(renderer.render((x_m, y_m, turned_rad), 0.04 * number).rgb))
    rates = None
    if gyro_sd_radps is not None:
        rate_radps = 2 * math.pi / steps / (STEP_US * 1e-6)
        rates = rate_radps + gyro_sd_radps * np.random.default_rng([seed, 2]).standard_normal(steps)
    write_film(path, STEP_US, turn_ticks(steps), camera_record(camera), np.stack(shots), every, rates)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenario", help="the room: paper_room, say")
    parser.add_argument("film", type=Path, help="the file to write")
    parser.add_argument("--seed", type=int, default=0, help="of its dressing and noise (default: 0)")
    parser.add_argument("--rig", default="three60", help="the middle camera of this rig (default: three60)")
    parser.add_argument("--pictures", type=int, default=3, help="a turn (default: 3)")
    parser.add_argument("--steps", type=int, default=96, help="readings a turn (default: 96)")
    parser.add_argument("--smaller", type=int, default=1, help="fewer pixels by this factor each way")
    parser.add_argument("--gyro", type=float, metavar="SD", help="the robot has a gyro of this noise, rad/s")
    options = parser.parse_args(argv)
    cameras = load_rig(options.rig).cameras
    camera = smaller(cameras[len(cameras) // 2], options.smaller)
    options.film.parent.mkdir(parents=True, exist_ok=True)
    sizes = (options.pictures, options.steps)
    make_film(options.film, options.scenario, options.seed, camera, *sizes, options.gyro)
    print(f"{options.film}: {options.film.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
