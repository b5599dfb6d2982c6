"""The DLR Spatial Cognition format: frames, noise, reference; and a map that rolls along."""

import gzip
import math

import numpy as np
import pytest
from scipy.io import savemat

from bslam.core.slam import Slam
from bslam.datasets.dlr import STEP_US, load_dlr
from bslam.errors import BslamError
from bslam.evaluation.truth import dead_reckoning
from bslam.options import RunOptions, core_params
from bslam.runs.local_map import LocalMap

ODOMETRY_NOISE = "1e-5 0 1e-5 0 0 1e-4"


@pytest.fixture
def folder(tmp_path):
    """Half a metre ahead and a bit to the left, then back and round to the left; two circles and a thing."""
    lines = [
        "# a comment",
        f"STEP a.ppm -0.10 -0.50 -0.20 {ODOMETRY_NOISE}",
        "LANDMARK_C -1.0 -2.0 0.9 0.0004 0 0.0009 7",
        "LANDMARK_C 0.0 -3.0 0.9 0.0004 0 0.0009 23003 12",
        f"STEP b.ppm 0.0 0.20 -0.30 {ODOMETRY_NOISE}",
        "LANDMARK_C 1.0 -1.0 0.5 0.0004 0 0.0004 -1",
    ]
    with gzip.open(tmp_path / "map.circles.gz", "wt") as file:
        file.write("\n".join(lines) + "\n")
    # The same steps, chained by hand: the second goes 0.2 m backwards at the file's heading of -0.2.
    c, s = math.cos(-0.2), math.sin(-0.2)
    second = (-0.10 - s * 0.20, -0.50 + c * 0.20, -0.5)
    rows = [(v, 1, 1) for v in (-0.10, -0.50, -0.20)] + [(v, 1, 2) for v in second]
    rows += [(-1.1, 2, 7), (-2.4, 2, 7)]
    savemat(tmp_path / "LS_result_x.mat", {"Xstate_LS": np.array(rows, dtype=np.float64)})
    return tmp_path


def test_forward_is_minus_y_and_left_is_minus_x(folder):
    sightings = load_dlr(folder).sightings
    assert sightings.bearing_rad.tolist() == pytest.approx([math.atan2(1.0, 2.0), 0.0, math.atan2(-1.0, 1.0)])
    assert sightings.range_m.tolist() == pytest.approx([math.sqrt(5.0), 3.0, math.sqrt(2.0)])
    assert sightings.beacon_id.tolist() == [7, 23003, -1]
    assert sightings.mappable.tolist() == [True, True, False]
    assert sightings.time_us.tolist() == [STEP_US, STEP_US, 2 * STEP_US]


def test_noise_is_that_of_the_file_along_and_across_the_ray(folder):
    sightings = load_dlr(folder).sightings
    assert sightings.range_sd_m[1] == pytest.approx(0.03)
    assert sightings.bearing_sd_rad[1] == pytest.approx(0.02 / 3.0)
    assert sightings.range_sd_m[2] == pytest.approx(0.02)


def test_odometry_goes_sideways_and_backwards_as_the_file_does(folder):
    log = load_dlr(folder)
    assert log.truth is not None
    ends = dead_reckoning(log)[::3]
    truth = np.column_stack([log.truth.x_m, log.truth.y_m, log.truth.theta_rad])
    np.testing.assert_allclose(ends, truth, atol=1e-12)
    assert truth[1].tolist() == pytest.approx([0.5, 0.1, 0.2])


def test_solution_gives_the_true_beacons_and_without_it_there_are_none(folder):
    beacons = load_dlr(folder).beacons
    assert beacons is not None
    assert (beacons.beacon_id[0], beacons.x_m[0], beacons.y_m[0]) == (7, 2.4, 1.1)
    (folder / "LS_result_x.mat").unlink()
    assert load_dlr(folder).beacons is None
    assert load_dlr(folder).truth is None


def test_model_has_no_steady_speed(folder):
    params = core_params(RunOptions(), load_dlr(folder))
    assert params["velocity_states"] == 0
    Slam(params)


@pytest.mark.parametrize(
    ("line", "part"),
    [
        ("STEP a.ppm 1 2", "line 1: 'STEP a.ppm 1 2'"),
        ("LANDMARK_C 1 1 1 1 1 1 7", "LANDMARK"),
        (f"STEP a.ppm nan 0 0 {ODOMETRY_NOISE}", "nan"),
        ("WALL 1 2", "'WALL 1 2'"),
        ("# nothing", "holds no STEP"),
    ],
)
def test_bad_line_is_named(tmp_path, line, part):
    (tmp_path / "map.circles").write_text(line + "\n")
    with pytest.raises(BslamError, match="allowed") as caught:
        load_dlr(tmp_path)
    assert part in str(caught.value)


def test_folder_without_the_data_is_named(tmp_path):
    with pytest.raises(BslamError, match=r"no DLR data set; allowed: a folder with map\.circles"):
        load_dlr(tmp_path)


def test_map_that_rolls_along_drops_what_was_not_seen_for_longest():
    slam = LocalMap(Slam(beacons_max=20, params={"confirm_sightings": 1}), room=4)
    slam.sightings(0, [0.0, 0.5], [2.0, 2.0], [1, 2], [True] * 2)
    for step in range(1, 6):
        slam.odometry("wheels", step * 40_000, 0.01, 0.01)
        slam.sightings(step * 40_000, [0.5, -0.5], [2.0, 2.0], [2, 10 + step], [True] * 2)
    inside = {one.label for one in slam._slam.beacons()}
    assert len(inside) <= 4
    assert 1 not in inside
    assert {2, 15} <= inside
    assert sorted(one.label for one in slam.beacons()) == [1, 2, 11, 12, 13, 14, 15]
    slam.odometry("wheels", 6 * 40_000, 0.01, 0.01)
    slam.sightings(6 * 40_000, [0.0], [1.9], [1], [True])
    assert sorted(one.label for one in slam.beacons()) == [1, 2, 11, 12, 13, 14, 15], "one of each identity"
