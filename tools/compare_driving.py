"""Does the simulated robot drive like the reference's? Statistics of the given paths beside those of our own.

The given paths are those of the reference data's `paper_room` logs, ours those of the scenario `paper_room`.
A row is the mean over the paths with its standard error.
`.venv/bin/python tools/compare_driving.py [--seeds 200]`
"""

import argparse

import numpy as np
from numpy.typing import NDArray

from bslam.experiment.datasets import data_root
from bslam.log import read_folder
from bslam.world.scenario import Scenario, load_scenario
from bslam.world.sensor import is_visible, look
from bslam.world.simulate import true_drive

Poses = NDArray[np.float64]  # (steps + 1, 3): x_m, y_m, theta_rad in the arena's frame


def seen_beacons(scenario: Scenario, poses: Poses) -> NDArray[np.int64]:
    """How many beacons the robot sees in each step."""
    bearing_rad, range_m = look(scenario.arena, scenario.sensor, poses)
    return is_visible(scenario.arena, scenario.sensor, poses, bearing_rad, range_m).sum(axis=1)


def statistics(scenario: Scenario, poses: Poses) -> dict[str, float]:
    """What one path is like."""
    x_m, y_m, theta_rad = poses.T
    step_s = scenario.step_us * 1e-6
    v_mps = np.hypot(np.diff(x_m), np.diff(y_m)) / step_s
    omega_radps = np.diff(np.unwrap(theta_rad)) / step_s
    beacons = seen_beacons(scenario, poses)
    clearance_m = scenario.arena.path_clearance(poses[:, :2], poses[:, :2])
    return {
        "path, m": v_mps.sum() * step_s,
        "sd of the turning rate, rad/s": omega_radps.std(),
        "its correlation over 1 s": np.corrcoef(omega_radps[:-25], omega_radps[25:])[0, 1],
        "standing or turning on the spot, share": (v_mps < 0.02).mean(),
        "faster than 0.38 m/s, share": (v_mps > 0.38).mean(),
        "bumps": (np.diff(v_mps) < -0.05).sum(),  # no motor brakes so hard
        "within 0.8 m of a wall, share": (clearance_m < 0.8).mean(),
        "changes of room": (np.diff(np.sign(x_m - 5.5)) != 0).sum(),
        "at most one beacon in sight, share": (beacons <= 1).mean(),
        "beacons in sight": beacons.mean(),
        "beacons in sight in the first 40 s": beacons[:1000].mean(),
        "beacons in sight in the first 10 s": beacons[:250].mean(),
    }


def given_paths(scenario: Scenario) -> list[Poses]:
    """The true paths of the reference logs; the noise of a log does not touch its path."""
    root = data_root()
    if root is None:
        raise SystemExit("compare_driving: no data: BSLAM_DATA names no directory with paper_room in it")
    truths = [read_folder(one).truth for one in sorted((root / "paper_room").glob("paper_room_*_sigma0.3"))]
    start = scenario.start
    return [
        np.stack([one.x_m + start.x_m, one.y_m + start.y_m, one.theta_rad], axis=1) for one in truths if one
    ]


def own_paths(scenario: Scenario, seeds: int) -> list[Poses]:
    """Paths that our own driver makes, seeds from 0."""
    drives = [true_drive(scenario, seed) for seed in range(seeds)]
    return [np.stack([one.x_m, one.y_m, one.theta_rad], axis=1) for one in drives]


def main() -> None:
    """Prints a line for each statistic."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=200, help="how many of our own drives (default: 200)")
    scenario = load_scenario("paper_room")
    groups = (given_paths(scenario), own_paths(scenario, parser.parse_args().seeds))
    given, own = ([statistics(scenario, poses) for poses in group] for group in groups)
    print(f"{'':40}{'given':>18}{'ours':>18}")
    for name in given[0]:
        columns = [np.array([one[name] for one in group]) for group in (given, own)]
        shown = [f"{each.mean():.3f} +- {each.std(ddof=1) / np.sqrt(len(each)):.3f}" for each in columns]
        print(f"{name:40}{shown[0]:>18}{shown[1]:>18}")


if __name__ == "__main__":
    main()
