"""How well the cameras tell the robot's turn: frame by frame, and as a gyroscope over seconds.

Takes drives as `bslam tables --sensor camera` keeps them (out/camera; rendered if they are not there, a
minute each). Printed over all drives: how many frames tell a turn, the error of a frame's turn once the true
way is taken off (median, 90 %), and by how much the heading is wrong after some seconds by the rates alone
(rms, one in a hundred, and the worst), and by the wheels alone:

    .venv/bin/python tools/measure_turns.py --seeds 1000:1008
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bslam.experiment.camera import CameraStore, camera_log
from bslam.experiment.truth import odometry_increments
from bslam.rig import load_rig
from bslam.world.simulate import load_scenario
from camera_drives import arguments

SPANS_S = (1, 3, 30)


def main() -> int:
    """Measures and prints."""
    args = arguments(__doc__, range(1000, 1008))
    scenario, rig, store = load_scenario(args.scenario), load_rig(args.rig), CameraStore(args.store)
    frames: list[NDArray[np.float64]] = []
    rates: list[NDArray[np.float64]] = []
    wheels: list[NDArray[np.float64]] = []
    for seed in args.seeds:
        log = camera_log(scenario, seed, args.sigma, None, rig, store)
        assert log.truth is not None and log.odometry.gyro_radps is not None
        heading_rad = np.unwrap(log.truth.theta_rad)
        place_m = np.stack([log.truth.x_m, log.truth.y_m])
        frames.append(_frame_errors(store.drive(scenario, seed, rig).turns, heading_rad, place_m))
        turned_rad = np.diff(heading_rad)
        told_rad = log.odometry.gyro_radps * scenario.step_us * 1e-6
        rates.append(np.nan_to_num(told_rad) - turned_rad)
        wheels.append(odometry_increments(log)[1] - turned_rad)
    print(f"{args.scenario}, {rig.name}, seeds {args.seeds.start}:{args.seeds.stop}, sigma {args.sigma}")
    for camera in range(len(rig.cameras)):
        errors = np.concatenate([one[camera :: len(rig.cameras)] for one in frames])
        told = np.abs(errors[~np.isnan(errors)])
        share = len(told) / len(errors)
        median, most = np.degrees(np.quantile(told, [0.5, 0.9]))
        print(
            f"camera {camera}: {share:.2f} of frames tell, error {median:.3f} deg median, {most:.3f} for 90 %"
        )
    for span_s in SPANS_S:
        steps = round(span_s * 1e6 / scenario.step_us)
        by_eye, by_wheels = (np.degrees(_drift_rad(one, steps)) for one in (rates, wheels))
        most, worst = np.quantile(by_eye, 0.99), by_eye.max()
        print(
            f"heading after {span_s:2d} s: {_rms(by_eye):6.2f} deg rms by cameras, "
            f"one in 100 above {most:5.1f}, worst {worst:4.0f}; {_rms(by_wheels):6.2f} rms by the wheels"
        )
    return 0


def _frame_errors(
    turns: NDArray[np.void], heading_rad: NDArray[np.float64], place_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Error of each frame's turn, rad; NaN where it told none."""
    errors = np.full(len(turns), np.nan)
    before: dict[int, int] = {}
    for i, row in enumerate(turns):
        step, camera = int(row["frame"]), int(row["camera"])
        if camera in before:
            start = before[camera]
            way_m = float(np.hypot(*(place_m[:, step] - place_m[:, start])))
            parallax_rad = way_m * float(row["parallax_rad_per_m"])
            errors[i] = float(row["turn_rad"]) + parallax_rad - (heading_rad[step] - heading_rad[start])
        before[camera] = step
    return errors


def _drift_rad(errors_rad: list[NDArray[np.float64]], steps: int) -> NDArray[np.float64]:
    """The sums of so many steps' errors in a row, without their signs."""
    sums = [np.cumsum(one) for one in errors_rad]
    return np.abs(np.concatenate([one[steps:] - one[:-steps] for one in sums]))


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    raise SystemExit(main())
