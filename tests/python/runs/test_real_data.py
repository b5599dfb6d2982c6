"""The real recordings and the reference logs, where they are at hand; see bslam.datasets.datasets."""

import csv

import numpy as np
import pytest

from bslam.datasets.datasets import data_root
from bslam.datasets.mrclam import best_truth, load_mrclam
from bslam.evaluation.metrics import evaluate, summarise
from bslam.log import Log
from bslam.options import RunOptions
from bslam.runs.runner import run_log

ROOT = data_root()
pytestmark = pytest.mark.skipif(
    ROOT is None,
    reason="no data sets on this machine: BSLAM_DATA is not set, and ../shared/data is not there",
)


def replay(log, options):
    trace = run_log(log, options)
    return summarise(log, trace, options, evaluate(log, trace, options))


@pytest.mark.parametrize("filter_name", ["standard", "invariant"])
def test_filters_reach_what_an_independent_prototype_reached(filter_name):
    folder = ROOT / "paper_room"
    with (folder / "reference.csv").open() as file:
        reference = {
            row["log"]: row
            for row in csv.DictReader(file)
            if (row["observation"], row["filter"]) == ("distance", filter_name)
        }
    options = RunOptions(filter=filter_name, velocity_states=False)
    for name in ("paper_room_700_sigma0.3", "paper_room_704_sigma0.6"):
        entry = replay(Log.read(folder / name), options)
        # The same filter, but not the same program: 5 % and a millimetre.
        expected_cm = float(reference[name]["mean_cm"])
        assert 100.0 * entry["position_error_m"]["mean"] == pytest.approx(expected_cm, rel=0.05, abs=0.1)
        assert entry["nees_mean"] == pytest.approx(float(reference[name]["nees_mean"]), rel=0.1)


def test_a_real_robot_is_not_lost_and_its_map_is_right():
    folder = ROOT / "mrclam" / "MRCLAM_Dataset6"
    log = load_mrclam(folder, 1)
    assert best_truth(folder, 1)[0] == "full"
    assert np.sum(log.sightings.beacon_id == -1) == 1  # one decoding error
    assert set(log.sightings.beacon_id[~log.sightings.mappable].tolist()) <= {1, 2, 3, 4, 5}
    entry = replay(log, RunOptions())
    assert entry["diverged"] is False
    assert entry["beacons_mapped"] == entry["beacons_true"] == 15
    assert (
        entry["map_rmse_m"] < 0.13
    )  # plain EKF-SLAM with calibrated odometry: 0.04 to 0.13 m over these sets
    assert entry["position_error_m"]["rmse"] < 0.48  # the same: 0.06 to 0.48 m
    assert entry["dead_reckoning_error_m"] > 1.0


@pytest.mark.parametrize(("data_set", "robot"), [(2, 1), (2, 2), (6, 1)])
def test_a_real_robot_that_sees_directions_for_seconds_minutes_apart_is_not_lost(data_set, robot):
    """What was seen last is settled while nothing is seen: with work in frames alone maps shrank."""
    log = load_mrclam(ROOT / "mrclam" / f"MRCLAM_Dataset{data_set}", robot)
    entry = replay(log, RunOptions(observation="direction", filter="smoother"))
    assert entry["diverged"] is False
    assert entry["beacons_mapped"] == 15
    assert entry["map_scale"] == pytest.approx(1.0, abs=0.4)
    assert entry["map_rmse_scaled_m"] < 0.35
