"""What gaps between sightings cost: the map and the pose if no beacon in a picture were missed.

Takes from the renderer what each camera has before it, frame by frame (kept under build/gaps: a minute of
rendering a drive), draws sightings of it with the front end's own errors, and runs the camera's filter on
them, identity known. Whole beacons give direction and distance; what the frame cuts off, and what is half
hidden, a rough direction. No turn rate is told. Prints the mean error of the position beside that of each
drive:

    .venv/bin/python tools/measure_gaps.py --seeds 0:8
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import trange

from bslam.commands.arguments import seeds_range
from bslam.core.vision import SIGNATURE_SIZE
from bslam.core.visual_gyro import VisualGyro
from bslam.experiment.camera import SEEN, TOLD_THRESHOLD, TURNS, CameraDrive, CameraStore, camera_log
from bslam.experiment.metrics import evaluate
from bslam.experiment.options import RunOptions
from bslam.experiment.runner import run_log
from bslam.log import Log
from bslam.rig import Rig, load_rig
from bslam.world.camera import Renderer, dress
from bslam.world.scenario import Scenario
from bslam.world.simulate import load_scenario, true_drive

ROOT = Path(__file__).resolve().parent.parent
VIEW = np.dtype(
    [
        ("step", np.int32),
        ("beacon_id", np.int32),
        ("bearing_rad", np.float64),  # in the robot's frame
        ("range_m", np.float64),
        ("visible_px", np.int32),
        ("own_px", np.int32),  # visible if nothing stood before it
        ("is_cut", np.bool_),  # by the frame's left or right edge
        ("is_whole", np.bool_),  # not cut by any edge
        ("slant_rad", np.float64),
    ]
)
EDGE_PX = 1.5
VISIBLE_PX_MIN, SLANT_RAD_MAX = 150, math.radians(60.0)
WHOLE_MIN, HIDDEN_MIN = 0.9, 0.5  # parts seen of what counts as whole, and as half hidden
BEARING_SD_RAD, RANGE_SD, SCALE_SD = math.radians(0.2), 0.03, 0.05
SETS = {"whole": (), "and cut off": ("cut",), "and half hidden": ("cut", "hidden")}


@dataclass(frozen=True)
class DrawnStore(CameraStore):
    """Drives whose sightings are drawn from what there was to see."""

    kinds: tuple[str, ...]
    rough_rad: float

    def drive(self, scenario: Scenario, seed: int, rig: Rig) -> CameraDrive:
        """Nothing that is in view is missed."""
        views, places = views_of(self.folder, scenario, seed, rig)
        return CameraDrive(places, drawn(views, self.kinds, self.rough_rad, seed), np.empty(0, TURNS))


def views_of(
    folder: Path, scenario: Scenario, seed: int, rig: Rig
) -> tuple[NDArray[np.void], NDArray[np.float64]]:
    """What the cameras have before them (VIEW), one frame a step; and the beacons' places."""
    path = folder / f"{scenario.name}_seed{seed}_{rig.name}.npz"
    if not path.is_file():
        views, places = looked_at(scenario, seed, rig)
        folder.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(path, views=views, places=places)
    with np.load(path) as file:
        return file["views"], file["places"]


def looked_at(scenario: Scenario, seed: int, rig: Rig) -> tuple[NDArray[np.void], NDArray[np.float64]]:
    """The same, rendered."""
    scene, path = dress(scenario, seed), true_drive(scenario, seed)
    renderers = [Renderer(scene, camera, [seed, index]) for index, camera in enumerate(rig.cameras)]
    rows = []
    for step in trange(len(path.x_m), desc=f"rendering seed {seed}", unit="frame"):
        index = step % len(rig.cameras)
        pose = float(path.x_m[step]), float(path.y_m[step]), float(path.theta_rad[step])
        for one in renderers[index].render(pose, step * scenario.step_us * 1e-6).seen:
            right_px = rig.cameras[index].lens.width_px - 1 - EDGE_PX
            is_cut = one.box[0] < EDGE_PX or one.box[2] > right_px
            place = (one.bearing_rad, one.range_m, one.visible_px, one.own_px)
            rows.append((step, one.beacon_id, *place, is_cut, not one.cut, one.slant_rad))
    places = [(one.beacon_id, *one.at) for one in scene.arena.beacons]
    return np.array(rows, VIEW), np.array(places)


def drawn(views: NDArray[np.void], kinds: tuple[str, ...], rough_rad: float, seed: int) -> NDArray[np.void]:
    """Sightings (SEEN) of whole beacons and of those kinds of others, errors drawn with the seed."""
    random = np.random.default_rng([seed, 5])
    good = (views["visible_px"] >= VISIBLE_PX_MIN) & (views["slant_rad"] < SLANT_RAD_MAX)
    share = views["visible_px"] / np.maximum(views["own_px"], 1)
    is_rough = ~views["is_whole"] | (share < WHOLE_MIN)
    allowed = ~is_rough
    allowed |= (views["is_cut"] & (share >= WHOLE_MIN)) if "cut" in kinds else False
    allowed |= (is_rough & (share >= HIDDEN_MIN) & (share < WHOLE_MIN)) if "hidden" in kinds else False
    chosen, is_rough = views[good & allowed], is_rough[good & allowed]
    seen = np.zeros(len(chosen), SEEN)
    sd_rad = np.where(is_rough, rough_rad, BEARING_SD_RAD)
    noise = random.standard_normal((2, len(chosen)))
    seen["frame"], seen["beacon_id"] = chosen["step"], chosen["beacon_id"]
    seen["bearing_rad"] = chosen["bearing_rad"] + sd_rad * noise[0]
    seen["bearing_sd_rad"] = sd_rad
    seen["range_m"] = np.where(is_rough, np.nan, chosen["range_m"] * (1 + RANGE_SD * noise[1]))
    seen["range_sd_m"] = np.where(is_rough, 0.0, RANGE_SD * chosen["range_m"])
    seen["range_scale_sd"] = SCALE_SD
    seen["signature"] = np.zeros((len(chosen), SIGNATURE_SIZE), np.float32)
    seen["score"] = 1.0
    seen["is_cut"] = chosen["is_cut"]
    return seen


def with_gyro(log: Log, seed: int) -> Log:
    """With the turn rate that the cameras tell (bslam.core.visual_gyro), drawn from the truth."""
    assert log.truth is not None
    ends_us = log.odometry.time_us
    starts_us = np.concatenate([log.truth.time_us[:1], ends_us[:-1]])
    theta_rad = np.unwrap(log.truth.theta_rad)
    turned_rad = [np.interp(time_us, log.truth.time_us, theta_rad) for time_us in (starts_us, ends_us)]
    noise = np.random.default_rng([seed, 6]).normal(0.0, VisualGyro.SD_RADPS, len(ends_us))
    rates = (turned_rad[1] - turned_rad[0]) / np.maximum(1e-6 * (ends_us - starts_us), 1e-6) + noise
    return replace(log, odometry=replace(log.odometry, gyro_radps=rates))


def error_cm(
    store: DrawnStore, scenario: Scenario, seed: int, sigma_mps: float, rig: Rig, gyro: bool
) -> float:
    """Mean error of the position over a drive."""
    log = camera_log(scenario, seed, sigma_mps, None, rig, store, TOLD_THRESHOLD)
    log = with_gyro(log, seed) if gyro else log
    options = RunOptions(sensor="camera", sigma_mps=sigma_mps, seed=seed, observation="distance")
    evaluation = evaluate(log, run_log(log, options), options, align=False)
    assert evaluation is not None
    return float(100 * np.mean(evaluation.error_m[1:]))


def main() -> int:
    """Prints a line for each set of sightings and sigma."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenario", default="paper_room")
    parser.add_argument("--rig", default="three60")
    parser.add_argument("--seeds", type=seeds_range, default=range(8), help="A:B (default: 0:8)")
    parser.add_argument("--sigma", type=float, nargs="+", default=(0.3, 0.6, 1.0), help="m/s")
    parser.add_argument(
        "--rough-deg", type=float, default=2.3, help="sd of a rough direction (default: 2.3, as measured)"
    )
    parser.add_argument("--gyro", action="store_true", help="the cameras tell the turn rate, too")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "gaps", help="where views are kept")
    arguments = parser.parse_args()
    scenario, rig = load_scenario(arguments.scenario), load_rig(arguments.rig)
    print(f"mean error of the position, cm, {scenario.name}, seeds {arguments.seeds}")
    for name, kinds in SETS.items():
        store = DrawnStore(arguments.folder, kinds, math.radians(arguments.rough_deg))
        for sigma_mps in arguments.sigma:
            errors = [
                error_cm(store, scenario, seed, sigma_mps, rig, arguments.gyro) for seed in arguments.seeds
            ]
            each = " ".join(f"{error:.0f}" for error in errors)
            print(f"{name:16} sigma {sigma_mps:g}: {np.mean(errors):5.1f} ({each})", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
