"""`bslam replay csv` on logs as people have them: what is used, what is chosen, what is said."""

import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from bslam.cli import main
from bslam.commands.drawing import room
from bslam.datasets.mrclam import load_mrclam
from bslam.evaluation.align import Rigid, Similarity
from bslam.log import Beacons, Odometry, Truth
from bslam.view.room import draw_room

REAL = {"wheel_noise": "actuation"}


@pytest.fixture
def replay(tmp_path, capsys):
    """Writes a log, replays it, and gives the exit status, the entry, and what was printed."""

    def run(log, *words, kind="csv", status=0):
        folder = tmp_path / log.name
        log.write(folder)
        return of(folder, *words, kind=kind, status=status)

    def of(folder, *words, kind="csv", status=0):
        out = tmp_path / "out"
        assert main(["replay", kind, str(folder), "--pictures", "0", "--out", str(out), *words]) == status
        (entry,) = json.loads((out / "summary.json").read_text())["runs"]
        written = capsys.readouterr()
        return entry, written.out + written.err

    run.of, run.out = of, tmp_path / "out"
    return run


@pytest.fixture
def drive(made):
    """Twelve seconds on a circle, with the noise of real wheels."""
    log = made.circle_log(steps=300, seed=1)
    return replace(log, robot=replace(log.robot, **REAL))


def elsewhere(log, frame):
    """The same truth in a frame of its own."""
    poses = frame.poses(np.column_stack([log.truth.x_m, log.truth.y_m, log.truth.theta_rad]))
    places = frame.points(np.column_stack([log.beacons.x_m, log.beacons.y_m]))
    return replace(
        log, truth=Truth(log.truth.time_us, *poses.T), beacons=Beacons(log.beacons.beacon_id, *places.T)
    )


def nameless(log):
    """Nobody says whose a sighting is."""
    return replace(log, sightings=replace(log.sightings, beacon_id=np.full(len(log.sightings.time_us), -1)))


def thinned(log, every):
    """Odometry of every so many rows, whose travel it sums up; what is left over at the end is not told."""
    rows = len(log.odometry.time_us) // every
    kept = slice(every - 1, rows * every, every)
    a, b = (one[: rows * every].reshape(rows, every).sum(axis=1) for one in (log.odometry.a, log.odometry.b))
    return replace(log, odometry=Odometry("wheels", log.odometry.time_us[kept], a, b))


# ---- the frame of the truth --------------------------------------------------------------------------------


def test_a_truth_in_a_frame_of_its_own_is_aligned_and_one_that_starts_at_the_robot_is_not(replay, drive):
    entry, _ = replay(drive)
    assert entry["align"] == "none"
    moved = elsewhere(drive, Rigid(2.0, 30.0, -7.0))
    aligned, text = replay(moved)
    assert (aligned["align"], aligned["map_align"]) == ("rigid", "rigid")
    assert "align: rigid\n" in text
    assert aligned["position_error_m"]["mean"] <= entry["position_error_m"]["mean"]
    assert aligned["map_rmse_m"] == pytest.approx(entry["map_rmse_m"])
    assert not aligned["diverged"]
    asked, _ = replay(moved, "--align", "none")
    assert asked["align"] == "none" and asked["diverged"]
    assert asked["map_rmse_m"] > 1.0


def test_the_picture_brings_path_and_beacons_to_the_truth_by_one_transform(drive):
    away = elsewhere(drive, Rigid(2.0, 30.0, -7.0))
    run = replace(away, beacons=None).run(association="known")
    shown = room("away", run.log, run.trace, run.errors, np.empty((0, 4)))
    assert shown.title == "away (rigidly aligned with the truth)"
    with_map = room("away", away, run.trace, run.errors, np.empty((0, 4)))
    assert with_map.title.startswith(f"{shown.title}\nbeacons go with the path; map cm")
    assert np.abs(shown.estimate_m - shown.truth_m).max() < 0.2
    true_m = {str(one): place for one, *place in zip(*vars(away.beacons).values(), strict=True)}
    assert {one.name for one in shown.mapped} == set(true_m)
    for one, beacon in zip(shown.mapped, run.trace.beacons, strict=True):
        assert math.dist((one.x_m, one.y_m), true_m[one.name]) < 0.2
        turn = run.errors.to_truth.rotation
        np.testing.assert_allclose(one.covariance_m2, turn @ beacon.covariance_m2 @ turn.T)
    labels = [text.get_text() for text in draw_room(shown).axes[0].texts]
    assert sorted(labels) == sorted(true_m)


def test_a_picture_that_is_not_aligned_does_not_say_so_and_names_each_beacon_once(drive):
    run = drive.run(association="known")
    assert run.errors.map_align == "rigid"  # that of map_rmse_m is no business of the picture
    shown = room("here", run.log, run.trace, run.errors, np.empty((0, 4)))
    assert shown.title == "here"
    assert [(one.x_m, one.y_m) for one in shown.mapped] == [(one.x_m, one.y_m) for one in run.trace.beacons]
    labels = [text.get_text() for text in draw_room(shown).axes[0].texts]
    assert sorted(labels) == sorted(map(str, drive.beacons.beacon_id.tolist()))


def test_a_truth_that_begins_later_than_the_drive_says_nothing_of_the_start(replay, drive):
    late = elsewhere(drive, Rigid(0.3, 0.0, 0.0))
    rows = slice(10, None)
    truth = [late.truth.time_us[rows], late.truth.x_m[rows], late.truth.y_m[rows], late.truth.theta_rad[rows]]
    truth[1], truth[2] = truth[1] - truth[1][0], truth[2] - truth[2][0]
    truth[3] = truth[3] - truth[3][0]  # its first pose is its origin, 0.4 s after the start
    assert replay(replace(late, truth=Truth(*truth)))[0]["align"] == "rigid"


def test_similarity_takes_the_scale_away_too(replay, drive):
    scaled = elsewhere(drive, Similarity(1.0, 3.0, 4.0, 1.25))
    rigid, similar = (replay(scaled, "--align", kind)[0] for kind in ("rigid", "similarity"))
    assert similar["align"] == similar["map_align"] == "similarity"
    assert similar["position_error_m"]["mean"] < 0.1 < rigid["position_error_m"]["mean"]
    assert similar["map_rmse_m"] < 0.1 < rigid["map_rmse_m"]
    assert similar["nees_mean"] < 10.0 < rigid["nees_mean"]


def test_a_truth_without_headings_is_as_good_for_positions(replay, drive):
    moved = elsewhere(drive, Rigid(2.0, 30.0, -7.0))
    whole, _ = replay(moved)
    places = replace(moved, truth=replace(moved.truth, theta_rad=np.full(len(moved.truth.x_m), math.nan)))
    entry, _ = replay(places)
    assert entry["position_error_m"] == whole["position_error_m"]
    assert entry["align"] == "rigid"
    assert "nees_mean" not in entry
    assert np.isfinite(np.loadtxt(replay.out / "circle.truth.tum")).all()


def test_a_truth_of_another_time_is_said_to_be(replay, drive):
    later = replace(drive, truth=replace(drive.truth, time_us=drive.truth.time_us + 60_000_000))
    entry, text = replay(later)
    assert "position_error_m" not in entry
    assert (
        "circle: the truth, 60.000 to 72.000 s, is of another time than odometry, 0.040 to 12.000 s\n" in text
    )


def test_a_map_without_truth_has_an_error(replay, drive):
    moved = elsewhere(drive, Rigid(2.0, 30.0, -7.0))
    whole, _ = replay(moved)
    entry, text = replay(replace(moved, truth=None), "--pictures", "1")
    assert entry["map_rmse_m"] == pytest.approx(whole["map_rmse_m"])
    assert (entry["truth"], entry["align"]) == ("none", "rigid")
    assert "position_error_m" not in entry
    assert not (replay.out / "circle.truth.tum").exists() and "truth.tum" not in text
    assert (replay.out / "circle.map.png").exists() and not (replay.out / "circle.error.png").exists()
    assert f"{100 * entry['map_rmse_m']:.2f}" in text


def test_beacons_that_nobody_measured_are_said_and_not_judged(replay, drive):
    partial = replace(drive, beacons=Beacons(*(column[:2] for column in vars(drive.beacons).values())))
    entry, text = replay(partial)
    assert entry["map_one_to_one"] == {"matched": 2, "doubled": 0, "missing": 0, "false": 0}
    assert entry["map_rmse_m"] < 0.1
    assert "circle: the true map lacks 1 of 3 beacons, which are not judged: 8\n" in text


# ---- identities --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("with_truth", [True, False])
def test_a_log_without_identities_is_associated_by_place_and_said_to_be(replay, drive, with_truth):
    moved = elsewhere(drive, Rigid(2.0, 30.0, -7.0))
    known, _ = replay(moved)
    log = nameless(moved) if with_truth else replace(nameless(moved), truth=None)
    entry, text = replay(log)
    assert entry["association"] == "mahalanobis"
    assert "circle: no sighting has an identity: --association mahalanobis tells whose each is\n" in text
    assert entry["beacons_mapped"] == 3
    # The nearest true beacon to each after alignment is its own.
    assert entry["map_rmse_m"] == pytest.approx(known["map_rmse_m"], abs=0.02)
    assert not {"wrong_associations", "false_new", "missed", "beacons_true"} & set(entry)


def test_known_association_without_identities_has_used_nothing_and_says_so(replay, drive):
    entry, text = replay(nameless(drive), "--association", "known", status=1)
    assert "no sighting has an identity: --association mahalanobis, joint or nearest needs none" in text
    assert entry["problems"][0].startswith(
        "most of the log was not used: 0 of 601 inputs refused, 903 of 903"
    )


def test_sightings_without_identity_beside_others_are_said_not_to_be_used(replay, drive):
    some = drive.sightings.beacon_id.copy()
    some[drive.sightings.beacon_id == 5] = -1
    partial = replace(drive, sightings=replace(drive.sightings, beacon_id=some))
    _, text = replay(partial)
    assert "circle: 301 of 903 sightings have no identity, and are not used by --association known\n" in text
    assert "no identity" not in replay(partial, "--association", "mahalanobis")[1]


def test_identities_that_are_words_come_out_as_they_went_in(replay, drive):
    words = ("$x^", "door, left", "exit sign")
    number = {3: 1, 5: 2, 8: 0}
    log = replace(
        drive,
        sightings=replace(
            drive.sightings, beacon_id=np.array([number[i] for i in drive.sightings.beacon_id.tolist()])
        ),
        beacons=replace(drive.beacons, beacon_id=np.array([1, 2, 0])),
        words=words,
    )
    numbered, _ = replay(drive)
    entry, _ = replay(log, "--pictures", "1")
    assert entry["map_rmse_m"] == numbered["map_rmse_m"]
    with (replay.out / "circle.map.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert sorted(row["beacon"] for row in rows) == sorted(words)
    assert all(row["beacon"] == row["true_beacon"] for row in rows)


# ---- odometry and time -------------------------------------------------------------------------------------


@pytest.mark.parametrize("every", [5, 10, 25])
def test_no_frame_is_refused_however_slow_odometry_is(replay, drive, every):
    whole, _ = replay(drive)
    entry, text = replay(thinned(replace(drive, truth=None), every))
    assert entry["refused_inputs"] == 0
    assert "inputs refused" not in text
    assert entry["sightings"] == whole["sightings"]
    assert entry["map_rmse_m"] < whole["map_rmse_m"] + 0.02


def test_what_is_refused_is_said_by_status(replay, drive):
    late = drive.sightings.time_us >= drive.sightings.time_us[-1] - 80_000
    times_us = np.where(late, drive.sightings.time_us + 3_000_000, drive.sightings.time_us)
    entry, text = replay(replace(drive, sightings=replace(drive.sightings, time_us=times_us)))
    assert entry["refused_inputs"] == 3
    assert entry["refused"] == 9
    assert "circle: 3 of 601 inputs refused: BSLAM_E_TIME 3\n" in text


def test_rows_written_twice_are_said(replay, drive, tmp_path):
    whole, _ = replay(drive)
    lines = (tmp_path / "circle" / "odometry.csv").read_text().splitlines(keepends=True)
    (tmp_path / "circle" / "odometry.csv").write_text("".join([*lines[:9], lines[8], *lines[9:]]))
    entry, text = replay.of(tmp_path / "circle")
    assert entry["map_rmse_m"] == whole["map_rmse_m"]
    assert "odometry.csv: left out 1 row equal to one above, first line 10\n" in text


def test_odometry_without_noise_is_said_to_count_as_exact(replay, drive):
    exact = replace(drive, robot=replace(drive.robot, wheel_speed_sigma_mps=0.0))
    _, text = replay(exact)
    assert (
        "circle: odometry counts as free of error; allowed in robot.toml: wheel_speed_sigma_mps above 0\n"
        in text
    )
    assert "free of error" not in replay(drive)[1]


# ---- what the log says of itself ---------------------------------------------------------------------------


def collection(folder, drive):
    """The drive as a data set of the collection: commands that the robot follows 0.175 s later."""
    codes = {6: 60, 7: 70, 8: 80}
    landmark = dict(zip(drive.beacons.beacon_id.tolist(), codes, strict=True))
    folder.mkdir()
    seen = drive.sightings
    tables = {
        "Barcodes": codes.items(),
        "Landmark_Groundtruth": zip(
            codes, drive.beacons.x_m, drive.beacons.y_m, [0] * 3, [0] * 3, strict=True
        ),
        "Robot1_Odometry": [(100 + 0.02 * k - 0.175, 0.5, 0.5) for k in range(600)],
        "Robot1_Measurement": [
            (100 + time_us * 1e-6, codes[landmark[identity]], range_m, bearing_rad)
            for time_us, identity, range_m, bearing_rad in zip(
                *(one.tolist() for one in (seen.time_us, seen.beacon_id, seen.range_m, seen.bearing_rad)),
                strict=True,
            )
        ],
        "Robot1_Groundtruth": [
            (100 + row[0] * 1e-6, *row[1:])
            for row in zip(*(one.tolist() for one in vars(drive.truth).values()), strict=True)
        ],
    }
    for name, rows in tables.items():
        text = "".join(
            " ".join(f"{value:.9g}" if value != row[0] else f"{value:.6f}" for value in row) + "\n"
            for row in rows
        )
        (folder / f"{name}.dat").write_text(text)
    return folder


@pytest.mark.parametrize("words", [[], ["--association", "mahalanobis"], ["--observation", "direction"]])
def test_a_collection_s_log_gives_the_same_as_csv(replay, drive, tmp_path, words):
    folder = collection(tmp_path / "set", drive)
    first, text = replay.of(folder, *words, kind="mrclam")
    assert first["presets"][:2] == ["real-wheels", "commanded"]
    assert (
        "speeds with wheel_speed_sigma_mps = 0 count as commands; for measured ones, give their noise" in text
    )
    second, _ = replay(load_mrclam(folder, 1), *words)
    for key in ("presets", "parameters", "align", "position_error_m", "map_rmse_m", "counters", "nees_mean"):
        assert second.get(key) == first.get(key), key


def test_a_log_without_ranges_is_seen_by_directions_alone(replay, drive):
    nothing = np.full(len(drive.sightings.time_us), math.nan)
    entry, text = replay(replace(drive, sightings=replace(drive.sightings, range_m=nothing)))
    assert (entry["observation"], entry["filter"]) == ("direction", "smoother")
    assert "presets: real-wheels, bearing-only\n" in text
    asked, _ = replay(drive, "--preset", "paper")
    assert asked["presets"] == ["paper"]


@pytest.mark.parametrize("column", ["bearing_sd_rad", "range_sd_m"])
def test_one_column_of_noise_alone_counts(replay, drive, column):
    plain, _ = replay(drive)
    told = {column: np.full(len(drive.sightings.time_us), 1.5)}
    entry, _ = replay(replace(drive, sightings=replace(drive.sightings, **told)))
    assert entry["position_error_m"]["mean"] > 1.05 * plain["position_error_m"]["mean"]
    as_told = "bearing_sd_rad" if column == "bearing_sd_rad" else "range_sd_floor_m"
    same, _ = replay(
        drive,
        "--set",
        f"{as_told}=1.5",
        "--set",
        "range_sd_fraction=0" if column != "bearing_sd_rad" else "huber_d=0",
    )
    assert entry["position_error_m"]["mean"] == pytest.approx(same["position_error_m"]["mean"], rel=0.1)


def test_settings_that_the_log_brings_along_are_in_force(replay, drive):
    entry, _ = replay(replace(drive, robot=replace(drive.robot, settings=(("huber_d", 2.5),))))
    assert entry["parameters"]["huber_d"] == 2.5
    wrong = replace(drive, robot=replace(drive.robot, settings=(("huber", 2.5),)))
    _, text = replay(wrong, status=2)
    assert text.splitlines()[-1].startswith(
        "bslam replay: error: circle: robot.toml, [settings], key huber: no such"
    )


# ---- what cannot be used -----------------------------------------------------------------------------------


def test_a_log_in_millimetres_has_used_nothing_and_says_so(replay, drive):
    far = replace(drive.sightings, range_m=1000.0 * drive.sightings.range_m)
    log = replace(
        drive,
        odometry=replace(drive.odometry, a=1000.0 * drive.odometry.a, b=1000.0 * drive.odometry.b),
        sightings=far,
    )
    entry, text = replay(log, status=1)
    assert "circle: most of the log was not used: " in text
    assert entry["problems"]


def test_sightings_that_are_mostly_gated_are_said_to_be(replay, drive):
    random = np.random.default_rng(0).uniform(-3.0, 3.0, len(drive.sightings.time_us))
    entry, text = replay(
        replace(drive, sightings=replace(drive.sightings, bearing_rad=random)), "--set", "huber_d=0", status=1
    )
    assert entry["rejected"] > 0.5 * entry["sightings"]
    assert f"0 of 601 inputs refused, {entry['rejected']} of 903 sightings gated or in refused frames" in text


def ring(made, beacons, laps, seed=0):
    """Drives round a ring of beacons, with a few in view at a time."""
    steps, radius_m, dt_s = 40 * laps * 6, 12.0, 0.5
    turn_rad = math.tau * laps / steps
    theta = turn_rad * np.arange(steps + 1)
    x, y = radius_m * np.sin(theta), radius_m * (1.0 - np.cos(theta))
    angle = math.tau * np.arange(beacons) / beacons
    bx, by = (radius_m + 1.5) * np.sin(angle), radius_m - (radius_m + 1.5) * np.cos(angle)
    rng = np.random.default_rng(seed)
    time_us = np.round(1e6 * dt_s * np.arange(steps + 1)).astype(np.int64)
    rows = []
    for k in range(steps + 1):
        range_m = np.hypot(bx - x[k], by - y[k])
        bearing = np.remainder(np.arctan2(by - y[k], bx - x[k]) - theta[k] + math.pi, math.tau) - math.pi
        for one in np.flatnonzero((range_m < 4.0) & (np.abs(bearing) < 1.5)):
            noisy = bearing[one] + 0.01 * rng.standard_normal()
            rows.append((time_us[k], one, noisy, range_m[one] * (1 + 0.02 * rng.standard_normal()), True))
    log = made.circle_log(steps=1)
    wheels_m = np.array([radius_m - 0.2, radius_m + 0.2]) * turn_rad + 0.02 * dt_s * rng.standard_normal(
        (steps, 2)
    )
    return replace(
        log,
        name="ring",
        odometry=Odometry("wheels", time_us[1:], *wheels_m.T),
        sightings=made.sightings(rows),
        truth=Truth(time_us, x, y, np.remainder(theta + math.pi, math.tau) - math.pi),
        beacons=Beacons(np.arange(beacons), bx, by),
        robot=replace(log.robot, wheel_speed_sigma_mps=0.02, step_us=500_000, **REAL),
    )


def test_a_hundred_beacons_are_held_and_the_loop_closes(replay, made):
    entry, text = replay(ring(made, 100, 2))
    assert (entry["beacons_mapped"], entry["beacons_true"]) == (100, 100)
    assert entry["map_rmse_m"] < 0.15
    assert entry["counters"]["map_full"] == 0
    assert "full" not in text


def test_a_map_that_does_not_fit_is_said_to_be_full(replay, made):
    entry, text = replay(ring(made, 260, 1), status=1)
    assert entry["counters"]["map_full"] >= 10
    assert "ring: the map was full: " in text


def test_a_log_of_one_row_each_is_replayed(replay, made, drive):
    one = replace(
        drive,
        odometry=Odometry("wheels", np.array([40_000]), np.array([0.01]), np.array([0.01])),
        sightings=made.sightings([(40_000, 3, 0.1, 2.0, True)]),
        truth=Truth(np.array([0]), np.zeros(1), np.zeros(1), np.zeros(1)),
    )
    assert replay(one)[0]["steps"] == 1
    still = replace(one, odometry=Odometry("velocity", np.array([40_000]), np.zeros(1), np.zeros(1)))
    assert replay(still)[0]["steps"] == 0
