"""The slips planted in a real log, where one is at hand; see bslam.datasets.datasets."""

from dataclasses import replace

import numpy as np
import pytest

from bslam.datasets.datasets import data_root
from bslam.datasets.mrclam import load_mrclam
from bslam.log import first_steps
from bslam.logcheck.check import check_log
from logcheck.drives import exchanged, with_odometry, with_sightings

ROOT = data_root()
pytestmark = pytest.mark.skipif(
    ROOT is None or not (ROOT / "mrclam" / "MRCLAM_Dataset6").is_dir(),
    reason="no MRCLAM set 6 on this machine: BSLAM_DATA is not set, and ../shared/data is not there",
)


@pytest.fixture(scope="module")
def log():
    """Seven minutes of a robot that drives less than it is told."""
    return first_steps(load_mrclam(ROOT / "mrclam" / "MRCLAM_Dataset6", 3), 10_000)


def noisier(log):
    s, random = log.sightings, np.random.default_rng(0)
    noise = 3.0 * random.standard_normal((2, len(s.range_m)))
    ranges = s.range_m + np.hypot(0.02, 0.035 * s.range_m) * noise[1]
    return with_sightings(log, bearing_rad=s.bearing_rad + 0.02 * noise[0], range_m=np.maximum(ranges, 0.05))


SLIPS = {
    "mirrored bearings": lambda log: with_sightings(log, bearing_rad=-log.sightings.bearing_rad),
    "swapped wheels": lambda log: with_odometry(log, b=-log.odometry.b),
    "degrees": lambda log: with_sightings(log, bearing_rad=np.degrees(log.sightings.bearing_rad)),
    "units": lambda log: with_sightings(log, range_m=1e3 * log.sightings.range_m),
    "delay": lambda log: with_sightings(log, time_us=log.sightings.time_us + 200_000),
    "scale": lambda log: with_odometry(log, a=1.1 * log.odometry.a, b=1.1 * log.odometry.b),
    "noise": noisier,
}


def found(log):
    return {one.kind for one in check_log(log).findings if not one.is_note}


def test_check_a_real_log_as_it_is_finds_nothing(log):
    assert found(log) == set()
    assert found(replace(log, beacons=None, truth=None)) == set()


@pytest.mark.parametrize("kind", SLIPS)
def test_check_a_slip_planted_in_a_real_log_is_named(kind, log):
    assert {kind} <= found(SLIPS[kind](log)) <= {kind, "scale"}  # it drives less than its commands say


def test_check_labels_exchanged_in_a_real_log_are_named(log):
    ids, counts = np.unique(log.sightings.beacon_id[log.sightings.mappable], return_counts=True)
    a, b = ids[np.argsort(-counts)][:2].tolist()
    start_s = 1e-6 * float(log.sightings.time_us[0])
    assert "identities" in found(exchanged(log, a, b, start_s + 200.0, start_s + 1e4))
