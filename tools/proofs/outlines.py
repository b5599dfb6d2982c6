"""What the built-in chain's outlines add to a scanner's boxes: both look at the same drive, and what both see
of a beacon in one frame is compared with the truth. Prints RESULTS' rows.
`.venv/bin/python -m tools.proofs.outlines firmware/models/own_room.json [--seed 0]`
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.commands.arguments import CAMERA_STORE
from bslam.rig import load_rig
from bslam.runs.camera import CameraDrive, CameraStore
from bslam.scannerfile import read_scanner
from bslam.world.scenario import load_scenario
from bslam.world.simulate import Drive, true_drive

FROM_M, TO_M = (2.5, 3.5, 5.0), (3.5, 5.0, 7.0)


def errors(seen: CameraDrive, path: Drive, at_m: tuple[float, float]) -> dict[tuple[int, int], list[float]]:
    """By frame and beacon: distance m, error of the bearing rad, and of the range as a part of it."""
    places = {int(number): (x_m, y_m) for number, x_m, y_m in seen.places.tolist()}
    found: dict[tuple[int, int], list[float]] = {}
    for one in seen.seen[(seen.seen["beacon_id"] >= 0) & ~seen.seen["is_cut"]]:
        step, number = int(one["frame"]), int(one["beacon_id"])
        x_m, y_m = np.subtract(places[number], (path.x_m[step], path.y_m[step]))
        cos, sin = np.cos(path.theta_rad[step]), np.sin(path.theta_rad[step])
        ahead_m, left_m = cos * x_m + sin * y_m - at_m[0], cos * y_m - sin * x_m - at_m[1]
        off_rad = one["bearing_rad"] - np.arctan2(left_m, ahead_m)
        range_m = float(np.hypot(ahead_m, left_m))
        wrapped_rad = float(np.arctan2(np.sin(off_rad), np.cos(off_rad)))
        found.setdefault((step, number), [range_m, wrapped_rad, float(one["range_m"]) / range_m - 1.0])
    return found


def rms(values: NDArray[np.float64]) -> float:
    """Of the numbers among them."""
    return float(np.sqrt(np.nanmean(values**2)))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path, metavar="MODEL")
    parser.add_argument("--seed", type=int, default=0, help="of the drive in paper_room (default: 0)")
    words = parser.parse_args()
    scenario, rig, store = load_scenario("paper_room"), load_rig("three60"), CameraStore(CAMERA_STORE)
    path, eye = true_drive(scenario, words.seed), (rig.cameras[0].x_m, rig.cameras[0].y_m)
    boxes = errors(store.drive(scenario, words.seed, rig, read_scanner(words.model)), path, eye)
    outlines = errors(store.drive(scenario, words.seed, rig), path, eye)
    both = sorted(boxes.keys() & outlines.keys())
    print(f"{len(boxes)} by boxes, {len(outlines)} by outlines, {len(both)} by both")
    tables = {
        name: np.array([one[key] for key in both]) for name, one in (("boxes", boxes), ("outlines", outlines))
    }
    measured = np.isfinite([one[:, 2] for one in tables.values()]).all(axis=0)
    for name, table in tables.items():
        near = [(table[:, 0] >= low) & (table[:, 0] < high) for low, high in zip(FROM_M, TO_M, strict=True)]
        directions = ", ".join(f"{np.degrees(rms(table[one, 1])):.2f}" for one in near)
        print(
            f"{name}: direction rms {directions} degrees, distance rms {100 * rms(table[measured, 2]):.1f} %"
        )


if __name__ == "__main__":
    main()
