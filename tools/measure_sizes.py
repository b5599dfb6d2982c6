"""What not knowing a thing's size costs: rendered drives with every size known exactly.

Takes the sightings that the front end made of rendered drives, and divides the distances to each beacon, by
what it was taken for, by what they are too long by as the truth has it (their median): what is left errs from
frame to frame alone. The filter is told so. Identity known. Prints the position's mean error, cm, and pose
NEES with the distances as they are, and so:

    .venv/bin/python tools/measure_sizes.py --seeds 1000:1020
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bslam.experiment.camera import TOLD_THRESHOLD, CameraDrive, CameraStore, camera_log
from bslam.experiment.metrics import evaluate
from bslam.experiment.options import RunOptions
from bslam.experiment.runner import run_log
from bslam.rig import Rig, load_rig
from bslam.world.scenario import Scenario
from bslam.world.simulate import load_scenario, true_drive
from camera_drives import arguments

KNOWN_SCALE_SD = 0.01
SIGMAS_MPS = (0.3, 0.6, 1.0)


@dataclass(frozen=True)
class SizedStore(CameraStore):
    """Drives whose distances have no factor in common with the truth any more."""

    def drive(self, scenario: Scenario, seed: int, rig: Rig) -> CameraDrive:
        """The drive as it is kept, its distances by the right sizes."""
        drive = super().drive(scenario, seed, rig)
        return replace(drive, seen=rightly_sized(drive, scenario, seed, rig))


def rightly_sized(
    drive: CameraDrive, scenario: Scenario, seed: int, rig: Rig
) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """The drive's sightings (SEEN) with distances that are right in the median of each thing and kind."""
    path, seen, camera = true_drive(scenario, seed), drive.seen.copy(), rig.cameras[0]
    frames = seen["frame"]
    cos, sin = np.cos(path.theta_rad[frames]), np.sin(path.theta_rad[frames])
    x_m = path.x_m[frames] + camera.x_m * cos - camera.y_m * sin
    y_m = path.y_m[frames] + camera.x_m * sin + camera.y_m * cos
    for beacon, at_x_m, at_y_m in drive.places:
        of_beacon = (seen["beacon_id"] == beacon) & (seen["range_sd_m"] > 0)
        for kind in np.unique(seen["beacon_class"][of_beacon]):
            chosen = of_beacon & (seen["beacon_class"] == kind)
            true_m = np.hypot(at_x_m - x_m[chosen], at_y_m - y_m[chosen])
            seen["range_m"][chosen] /= np.median(seen["range_m"][chosen] / true_m)
            seen["range_scale_sd"][chosen] = KNOWN_SCALE_SD
    return seen


def of_drives(
    store: CameraStore, scenario: Scenario, seeds: range, sigma_mps: float, rig: Rig
) -> tuple[float, float]:
    """Mean error of the position, cm, and mean pose NEES over the drives."""
    errors_cm, nees = [], []
    for seed in seeds:
        log = camera_log(scenario, seed, sigma_mps, None, rig, store, TOLD_THRESHOLD)
        options = RunOptions(sensor="camera", sigma_mps=sigma_mps, seed=seed, observation="distance")
        found = evaluate(log, run_log(log, options), options, align=False)
        assert found is not None
        errors_cm.append(100 * np.mean(found.error_m[1:]))
        nees.append(np.nanmean(found.nees))
    return float(np.mean(errors_cm)), float(np.mean(nees))


def main() -> int:
    """Prints a line for each kind of distances and sigma."""
    asked = arguments(__doc__, range(8))
    scenario, rig = load_scenario(asked.scenario), load_rig(asked.rig)
    folder: Path = asked.store
    for name, store in (("as measured", CameraStore(folder)), ("sizes known", SizedStore(folder))):
        for sigma_mps in SIGMAS_MPS:
            error_cm, nees = of_drives(store, scenario, asked.seeds, sigma_mps, rig)
            print(f"{name} sigma {sigma_mps:g}: {error_cm:5.1f} cm, NEES {nees:.1f}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
