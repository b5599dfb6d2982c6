"""Loading MRCLAM: made files with every trap of the real ones."""

import gzip
import math

import numpy as np
import pytest

from bslam.datasets.mrclam import STEP_US, best_truth, load_mrclam, robots_in
from bslam.errors import BslamError

T0 = 1_248_272_272.841
T0_US = 1_248_272_272_841_000
# Barcodes 5, 6, 9, 14 and 18 are subject numbers too: to replace one after another goes wrong.
BARCODES = {1: 5, 2: 14, 3: 41, 4: 32, 5: 23, 6: 72, 7: 27, 9: 18, 11: 6, 17: 9}
LANDMARKS = {
    6: (5.7, 4.9),
    7: (5.2, 5.5),
    9: (2.3, 3.3),
    11: (3.15071999, 2.38294871),
    17: (0.03596156, -2.84396626),
}


def write(path, rows):
    text = "# made for a test\n" + "".join("\t".join(str(one) for one in row) + "\n" for row in rows)
    if path.suffix == ".gz":
        path.write_bytes(gzip.compress(text.encode()))
    else:
        path.write_text(text)


@pytest.fixture
def folder(tmp_path):
    """Robot 1: 0.1 m/s for 0.1 s, then 0.3 m/s; sightings of landmarks, a robot and a decoding error."""
    write(tmp_path / "Barcodes.dat", BARCODES.items())
    write(
        tmp_path / "Landmark_Groundtruth.dat", [(n, x, y, 0.0001, 0.0001) for n, (x, y) in LANDMARKS.items()]
    )
    write(
        tmp_path / "Robot1_Odometry.dat.gz",
        [
            (f"{T0 + t:.3f}", v, w)
            for t, v, w in ((0.0, 0.1, 0.5), (0.1, 0.7, 9.9), (0.1, 0.3, -0.5), (0.5, 0.0, 0.0))
        ],
    )
    write(
        tmp_path / "Robot1_Measurement.dat",
        [
            (f"{T0 + 0.1:.3f}", 18, 2.0, 0.1),
            (f"{T0 + 0.1:.3f}", 14, 3.0, -0.1),  # robot 2
            (f"{T0 + 0.2:.3f}", 43, 1.0, 0.0),  # in no table
            (f"{T0 + 0.3:.3f}", 9, 4.0, 0.2),  # barcode of 17, and subject 9 has another
            (f"{T0 + 0.3:.3f}", 6, 4.0, 0.2),  # barcode of 11, and subject 6 has another
        ],
    )
    write(tmp_path / "Robot1_Groundtruth.dat", [(f"{T0 + k:.3f}", k, 2.0, 0.1) for k in range(3)])
    write(tmp_path / "Robot1_Groundtruth_rebuilt.dat", [(f"{T0:.3f}", 7.0, 2.0, 0.1)])
    write(tmp_path / "Robot1_Groundtruth_sparse.dat", [(f"{T0:.3f}", 9.0, 2.0, 0.1, 4, 0.2)])
    return tmp_path


def test_odometry_is_resampled_and_keeps_the_way_of_the_held_commands(folder):
    odometry = load_mrclam(folder, 1).odometry
    assert odometry.kind == "velocity"
    assert odometry.time_us[0] == T0_US
    assert set(np.diff(odometry.time_us).tolist()) == {STEP_US}
    dt_s = STEP_US * 1e-6
    # Whole steps cover 0.48 s: 0.1 s at 0.1 m/s, then 0.38 s at 0.3 m/s; nothing is left of the row between.
    assert np.sum(odometry.a[1:]) * dt_s == pytest.approx(0.1 * 0.1 + 0.38 * 0.3)
    assert np.sum(odometry.b[1:]) * dt_s == pytest.approx(0.1 * 0.5 - 0.38 * 0.5)
    assert odometry.a.max() < 0.31


def test_barcodes_are_looked_up_once_even_where_they_are_subject_numbers(folder):
    sightings = load_mrclam(folder, 1).sightings
    assert sightings.beacon_id.tolist() == [9, 2, -1, 17, 11]


def test_other_robots_are_not_mappable_and_decoding_errors_have_no_identity(folder):
    sightings = load_mrclam(folder, 1).sightings
    assert sightings.mappable.tolist() == [True, False, True, True, True]
    assert sightings.time_us.tolist() == [
        T0_US + one for one in (100_000, 100_000, 200_000, 300_000, 300_000)
    ]
    assert sightings.range_m.tolist() == [2.0, 3.0, 1.0, 4.0, 4.0]
    assert sightings.bearing_rad.tolist() == [0.1, -0.1, 0.0, 0.2, 0.2]


def test_the_swapped_landmarks_of_set_1_are_put_right(folder):
    beacons = load_mrclam(folder, 1).beacons
    place = dict(zip(beacons.beacon_id.tolist(), zip(beacons.x_m, beacons.y_m, strict=True), strict=True))
    assert place[11] == LANDMARKS[17]
    assert place[17] == LANDMARKS[11]
    assert place[6] == LANDMARKS[6]


def test_landmarks_of_other_sets_stay_as_they_are(folder):
    moved = LANDMARKS | {11: (1.0, 1.0)}
    write(folder / "Landmark_Groundtruth.dat", [(n, x, y, 0.0001, 0.0001) for n, (x, y) in moved.items()])
    beacons = load_mrclam(folder, 1).beacons
    assert beacons.beacon_id.tolist() == list(moved)
    assert beacons.x_m.tolist() == [x for x, _ in moved.values()]


def test_the_best_truth_is_taken(folder):
    for kind, first_x_m, name in (
        ("full", 0.0, "Robot1_Groundtruth.dat"),
        ("rebuilt", 7.0, "Robot1_Groundtruth_rebuilt.dat"),
        ("sparse", 9.0, "Robot1_Groundtruth_sparse.dat"),
    ):
        assert best_truth(folder, 1)[0] == kind
        assert load_mrclam(folder, 1).truth.x_m[0] == first_x_m
        (folder / name).unlink()
    assert best_truth(folder, 1)[0] == "none"
    assert load_mrclam(folder, 1).truth is None


def test_the_name_and_the_noise_of_the_robot(folder):
    log = load_mrclam(folder, 1)
    assert log.name == f"{folder.name}_robot1"
    assert math.hypot(log.robot.range_sigma_floor_m, log.robot.range_sigma_fraction) > 0.0


def test_a_robot_that_is_not_there_is_named_with_those_that_are(folder):
    assert robots_in(folder) == [1]
    with pytest.raises(BslamError, match=r"no robot 4; allowed: 1$"):
        load_mrclam(folder, 4)


def test_a_folder_of_something_else_is_refused(tmp_path):
    with pytest.raises(BslamError, match=r"no MRCLAM data set; allowed: a folder with Robot1_Odometry\.dat"):
        load_mrclam(tmp_path, 1)


def test_rows_at_the_start_that_time_runs_back_over_are_left_out_and_noted(folder):
    """As four of the published recordings have them."""
    whole = load_mrclam(folder, 1)
    for name, row in (("Odometry", "0.9 9.9"), ("Measurement", "5 9.9 0.1"), ("Groundtruth", "9.0 9.0 0.0")):
        path = next(folder.glob(f"Robot1_{name}.dat*"))
        text = gzip.decompress(path.read_bytes()).decode() if path.suffix == ".gz" else path.read_text()
        path.unlink()
        (folder / f"Robot1_{name}.dat").write_text(f"{T0 + 0.11:.3f} {row}\n{T0 + 0.105:.3f} {row}\n{text}")
    log = load_mrclam(folder, 1)
    for part in ("odometry", "sightings", "truth"):
        for name, theirs in vars(getattr(whole, part)).items():
            np.testing.assert_array_equal(vars(getattr(log, part))[name], theirs)
    assert len(log.notes) == 3
    assert "Robot1_Odometry.dat: left out 2 rows at the start: time runs back to" in log.notes[0]


def test_of_true_poses_with_one_stamp_the_first_counts(folder):
    (folder / "Robot1_Groundtruth.dat").write_text("1.0 5 1 0\n1.0 6 1 0\n2.0 7 1 0\n")
    log = load_mrclam(folder, 1)
    assert log.truth.x_m.tolist() == [5.0, 7.0]
    assert log.notes == (f"{folder}/Robot1_Groundtruth.dat: left out 1 row stamped as the row above",)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("Barcodes.dat", "# nothing\n", r"Barcodes\.dat: holds no data; allowed: lines of 2 numbers"),
        ("Barcodes.dat", "1 5\n2\n", r"Barcodes\.dat, line 2: '2'; allowed: 2 finite numbers"),
        (
            "Robot1_Measurement.dat",
            "# a\n1.0 5 x 0.1\n",
            r"Measurement\.dat, line 2: .* allowed: 4 finite numbers",
        ),
        ("Robot1_Measurement.dat", "1.0 5 nan 0.1\n", r"line 1: .* allowed: 4 finite numbers"),
        (
            "Robot1_Measurement.dat",
            "2.0 5 1 0\n3.0 5 1 0\n2.5 5 1 0\n",
            r"data row 3: time 2\.500 does not come after 3\.000",
        ),
        (
            "Robot1_Groundtruth.dat",
            "1.0 5 1 0\n3.0 5 1 0\n2.0 5 1 0\n",
            r"data row 3: time 2\.000 does not come after 3\.000",
        ),
    ],
)
def test_a_malformed_file_is_named_with_its_line(folder, name, content, message):
    (folder / name).write_text(content)
    with pytest.raises(BslamError, match=message):
        load_mrclam(folder, 1)


def test_a_broken_archive_is_named(folder):
    (folder / "Robot1_Odometry.dat.gz").write_bytes(b"not gzip")
    with pytest.raises(
        BslamError, match=r"Odometry\.dat\.gz: cannot be read: .*; allowed: text, plain or gzipped"
    ):
        load_mrclam(folder, 1)


def test_a_missing_file_is_named(folder):
    (folder / "Barcodes.dat").unlink()
    with pytest.raises(BslamError, match=r"Barcodes\.dat is missing"):
        load_mrclam(folder, 1)
