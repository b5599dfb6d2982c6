"""How hard is a recorded path? Gives the given logs' true paths fresh noise and runs the filter on them.

For each `paper_room` log of the reference data: its own error, and the mean error over several draws of wheel
and sensing noise along the same path, made by our own simulator. Separates what the path makes hard from what
a log's one draw of noise does. `.venv/bin/python tools/fresh_noise.py [--draws 12] [--sigma 1.0]`
"""

import argparse
from dataclasses import replace

import numpy as np

from bslam.experiment.datasets import data_root
from bslam.experiment.metrics import evaluate
from bslam.experiment.options import RunOptions
from bslam.experiment.runner import run_log
from bslam.log import Log, Odometry, read_folder
from bslam.world.scenario import load_scenario
from bslam.world.sensor import see


def with_fresh_noise(log: Log, seed: int, sigma_mps: float) -> Log:
    """The log's true path with new noise on wheels and sightings."""
    scenario = load_scenario("paper_room")
    random = np.random.default_rng(seed)
    truth, half_base_m = log.truth, scenario.body.wheelbase_m / 2.0
    assert truth is not None
    poses = np.stack(
        [truth.x_m + scenario.start.x_m, truth.y_m + scenario.start.y_m, truth.theta_rad], axis=1
    )
    turn_rad = np.diff(np.unwrap(truth.theta_rad))
    chord_m = np.hypot(np.diff(truth.x_m), np.diff(truth.y_m))
    arc_m = chord_m / np.sinc(turn_rad / (2.0 * np.pi))
    noise_m = sigma_mps * scenario.step_us * 1e-6 * random.standard_normal((2, len(turn_rad)))
    left_m, right_m = arc_m - half_base_m * turn_rad + noise_m[0], arc_m + half_base_m * turn_rad + noise_m[1]
    return replace(
        log,
        odometry=Odometry("wheels", truth.time_us[1:], left_m, right_m),
        sightings=see(scenario.arena, scenario.sensor, truth.time_us, poses, random),
        robot=replace(log.robot, wheel_speed_sigma_mps=sigma_mps),
    )


def mean_error_cm(log: Log) -> float:
    """Mean position error of the invariant filter without velocity states."""
    options = RunOptions(velocity_states=False)
    evaluation = evaluate(log, run_log(log, options), options, align=False)
    assert evaluation is not None
    return 100.0 * float(np.mean(evaluation.error_m[1:]))


def main() -> None:
    """Prints a line a path and the means."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=12, help="draws of noise a path (default: 12)")
    parser.add_argument("--sigma", type=float, default=1.0, help="wheel-speed sigma, m/s (default: 1.0)")
    arguments = parser.parse_args()
    root = data_root()
    if root is None:
        raise SystemExit("fresh_noise: no data: BSLAM_DATA names no directory with paper_room in it")
    folders = sorted((root / "paper_room").glob(f"paper_room_*_sigma{arguments.sigma}"))
    own, fresh = [], []
    for folder in folders:
        log = read_folder(folder)
        draws = [
            mean_error_cm(with_fresh_noise(log, seed, arguments.sigma)) for seed in range(arguments.draws)
        ]
        own.append(mean_error_cm(log))
        fresh.append(float(np.mean(draws)))
        print(f"{folder.name}: as given {own[-1]:.2f} cm, fresh noise {fresh[-1]:.2f} cm", flush=True)
    spread = np.std(fresh, ddof=1) / np.sqrt(len(fresh))
    print(f"mean: as given {np.mean(own):.2f} cm, fresh noise {np.mean(fresh):.2f} +- {spread:.2f} cm")


if __name__ == "__main__":
    main()
