"""Drives that tell little: what the estimators say of themselves, over seeds."""

import numpy as np
import pytest
from scipy.stats import chi2

from measure_honesty import WAYS, drive, table

SEEDS, STEPS, SIGMA_MPS = range(8), 600, 0.3
POSE_NEES_MAX = chi2.ppf(0.999, 3 * len(SEEDS)) / len(SEEDS)
ALL = [(way, name) for way in WAYS for name in ("invariant", "similarity", "smoother")]
# The others believe in distances that nothing told: docs/EXPERIMENTS.md says how much.
HONEST = [("stands", "invariant"), ("turns", "invariant"), ("drives at a beacon", "invariant")]
HONEST += [("drives at a beacon", "smoother")]
POSE_HONEST = [*HONEST, ("turns", "smoother"), ("turns", "similarity")]


@pytest.fixture(scope="module")
def drives():
    """(seeds, figures of `Ended`) of each way and filter."""
    return {
        (way, name): np.array([drive(name, WAYS[way], seed, STEPS, SIGMA_MPS) for seed in SEEDS])
        for way, name in ALL
    }


@pytest.mark.parametrize(("way", "name"), ALL)
def test_estimate_is_finite_and_every_covariance_definite(drives, way, name):
    assert np.isfinite(drives[way, name]).all()
    assert drives[way, name][:, 4].min() > -np.finfo(np.float32).eps, "what rounding leaves"


@pytest.mark.parametrize(("way", "name"), POSE_HONEST)
def test_pose_is_as_wrong_as_it_says(drives, way, name):
    assert drives[way, name][:, 0].mean() < POSE_NEES_MAX


@pytest.mark.parametrize(("way", "name"), HONEST)
def test_distances_are_as_wrong_as_they_say(drives, way, name):
    _, beacon_nees, doubt_m, error_m, _ = drives[way, name].T
    assert np.median(beacon_nees) < chi2.ppf(0.95, 2)
    assert np.median(error_m) < 2.0 * np.median(doubt_m)


def test_table_has_a_line_for_each_way_and_filter():
    lines = []
    table(["invariant"], range(1), 20, SIGMA_MPS, lines.append)
    assert [line.split(" | ")[0] for line in lines[2:]] == [f"| {way}" for way in WAYS]
