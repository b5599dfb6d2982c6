"""A user's program, which `mypy --strict` takes (pyproject.toml) and test_typed.py runs."""

from typing import Any, assert_type

import numpy as np
import polars as pl
from numpy.typing import NDArray

import bslam
from bslam import BslamError, CoreError, Log, Report, Robot, Run, Slam


def drive_one_robot() -> tuple[float, float, float]:
    """Reading by reading."""
    slam = Slam({"wheelbase_m": 0.3}, beacons_max=20)
    slam.sightings(0, [], [], [], [])
    slam.odometry("wheels", 40_000, 0.02, 0.02)
    accounts = slam.sightings(40_000, np.array([0.3]), (3.1,), [7], [True])
    assert_type(accounts[0].beacon_uid, int | None)
    assert_type(slam.beacons()[0].covariance_m2, NDArray[np.float64])
    try:
        slam.odometry("wheels", 40_000, 0.02, 0.02)
    except CoreError as refusal:
        assert_type(refusal.status, str)
    return slam.pose()


def run_a_log(seed: int) -> Run:
    """From tables to a picture."""
    drive = bslam.simulate("pairs", seed)
    moved = {"time_us": drive.odometry.time_us, "left_m": drive.odometry.a, "right_m": drive.odometry.b}
    seen = {"time_us": drive.sightings.time_us, "bearing_rad": drive.sightings.bearing_rad}
    log = Log.from_dataframe(pl.DataFrame(moved), pl.DataFrame(seen), robot=drive.robot, name="mine")
    assert_type(log.robot, Robot)
    run = log.run(association="nearest", parameters={"gate_d2": 9.0})
    assert_type(run.trace.pose, NDArray[np.float64])
    assert_type(run.summary, dict[str, Any])
    bslam.plot(run).savefig("run.png")
    return run


def kinds(report: Report) -> list[str]:
    """What a check found."""
    return [one.kind for one in report.findings if not one.is_note]


if __name__ == "__main__":
    print(drive_one_robot(), run_a_log(0), BslamError, bslam.__version__)
