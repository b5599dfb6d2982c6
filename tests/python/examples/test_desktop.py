"""examples/desktop_csv, keep_the_map and camera_tags: built and run as their READMEs say."""

import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bslam.cli import main
from bslam.log import Log, Odometry, first_steps
from bslam.world.simulate import load_scenario, simulate
from examples import tag_room
from examples.building import EXAMPLES, FIRMWARE, STRICT, build_as_its_readme_says, run

# ---- desktop_csv -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def desktop_csv(tmp_path_factory: pytest.TempPathFactory, library: Path) -> Path:
    return build_as_its_readme_says("desktop_csv", library, tmp_path_factory.mktemp("desktop_csv"))


def log_of(kind: str) -> Log:
    """A drive with real wheels' noise, the defaults; by wheel travel or by encoder counts. Its last frame
    comes after the last row of odometry.
    """
    log = first_steps(simulate(load_scenario("paper_room"), 4, sigma_mps=0.05), 400)
    robot = replace(
        log.robot, wheel_noise="actuation", bearing_sigma_rad=0.0136, range_sigma_scale_m=1 / 0.009
    )
    rows = {name: getattr(log.odometry, name)[:-1] for name in ("time_us", "a", "b")}
    sightings, odometry = replace(log.sightings, signature=None), replace(log.odometry, **rows)
    log = replace(log, robot=robot, seeds=None, sightings=sightings, odometry=odometry)
    if kind == "wheels":
        return log
    ticks_per_m = 20_000 / (2 * math.pi * 0.05)
    counts = ((travel_m.cumsum() * ticks_per_m).round() % 2**16 for travel_m in (odometry.a, odometry.b))
    robot = replace(
        robot, left_radius_m=0.05, right_radius_m=0.05, ticks_per_revolution=20_000, counter_bits=16
    )
    return replace(log, robot=robot, odometry=Odometry("ticks", odometry.time_us, *counts))


@pytest.mark.parametrize(
    ("kind", "settings", "refuses"),
    [
        ("wheels", ["gate_d2=9"], 0),
        ("ticks", ["ticks_per_revolution=20000"], 1),  # a frame before the counters' first row
    ],
)
def test_desktop_csv_gives_what_replay_gives(
    tmp_path: Path, desktop_csv: Path, kind: str, settings: list[str], refuses: int
) -> None:
    log_of(kind).write(tmp_path / "drive")
    words = [word for one in settings for word in ("--set", one)]
    out = tmp_path / "out"
    replayed = ["replay", "csv", str(tmp_path / "drive"), "--out", str(out), "--pictures", "0"]
    assert main([*replayed, "--association", "known", *words]) == 0
    done = run(desktop_csv, "drive", *settings, folder=tmp_path, expect=1 if refuses else 0)
    path = (out / "drive.estimate.tum").read_text().splitlines()
    assert done.stdout.splitlines() == path[-len(done.stdout.splitlines()) :]
    assert len(done.stdout.splitlines()) == 399
    *beacons, refused = done.stderr.splitlines()
    rows = [row.split(",") for row in (out / "drive.map.csv").read_text().splitlines()[1:]]
    assert beacons == [f"beacon {label}: x {x_m} m, y {y_m} m" for label, x_m, y_m, *_ in rows]
    assert len(beacons) >= 4 and refused == f"{refuses} rows and frames refused"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "arguments: allowed: FOLDER"),
        (["nowhere"], "nowhere/odometry.csv: its header: the file does not exist, or cannot be read"),
        (["drive", "wheelbase=0.3"], "setting: wheelbase=0.3: allowed: NAME=VALUE"),
        (["drive", "wheelbase_m=-1"], "setting: wheelbase_m=-1: allowed: NAME=VALUE"),
        (["drive", "wheelbase_m=0.3abc"], "setting: wheelbase_m=0.3abc: allowed: NAME=VALUE"),
        (["bad"], "bad/odometry.csv: left_m: 40000,1 cm,0.1"),
        (["gyro"], "gyro/odometry.csv: gyro_radps: allowed: time_us,left_m,right_m,left_ticks,right_ticks"),
        (["halves"], "halves/sightings.csv: beacon_id: 0,1.5,0.1"),
        (["left"], "left/odometry.csv: left: allowed: time_us,left_m"),
    ],
)
def test_desktop_csv_says_in_a_line_what_is_bad(
    tmp_path: Path, desktop_csv: Path, words: list[str], says: str
) -> None:
    drives = {
        "drive": "left_m,right_m\n40000,0.1,0.1",
        "bad": "left_m,right_m\n40000,1 cm,0.1",
        "gyro": "left_m,right_m,gyro_radps\n40000,0.1,0.1,0",
        "left": "left,right\n40000,0.1,0.1",
    }
    drives["halves"] = drives["drive"]
    for folder, rows in drives.items():
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "odometry.csv").write_text(f"time_us,{rows}\n")
        one = "1.5" if folder == "halves" else "1"
        (tmp_path / folder / "sightings.csv").write_text(f"time_us,beacon_id,bearing_rad\n0,{one},0.1\n")
    done = run(desktop_csv, *words, folder=tmp_path, expect=2)
    assert done.stderr.startswith(f"desktop_csv: {says}")
    assert len(done.stderr.strip().splitlines()) == 1


def test_desktop_csv_says_that_its_path_is_not_written(tmp_path: Path, desktop_csv: Path) -> None:
    log_of("wheels").write(tmp_path / "drive")
    done = run("sh", "-c", f"{desktop_csv} drive > /dev/full", folder=tmp_path, expect=1)
    assert done.stderr.splitlines()[-1] == "0 rows and frames refused; path cut short"


# ---- keep_the_map ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def keep_the_map(tmp_path_factory: pytest.TempPathFactory, library: Path) -> Path:
    return build_as_its_readme_says("keep_the_map", library, tmp_path_factory.mktemp("keep_the_map"))


def errors_of(printed: str) -> tuple[float, float]:
    """Position, m, and heading, rad."""
    (line,) = (line for line in printed.splitlines() if line.startswith("at x"))
    x, y, heading, true_x, true_y, true_heading = map(float, re.findall(r"-?\d+\.\d+", line))
    return math.dist((x, y), (true_x, true_y)), abs(math.remainder(heading - true_heading, 2 * math.pi))


def test_keep_the_map_saves_loads_and_finds_itself(tmp_path: Path, keep_the_map: Path) -> None:
    first = run(keep_the_map, folder=tmp_path).stdout
    assert "at the start: following" in first and "after" not in first
    assert re.search(r"room.bslam: saved, 5 beacons, \d+ bytes", first)
    kept = (tmp_path / "room.bslam").read_bytes()
    readme = (EXAMPLES / "keep_the_map/README.md").read_text(encoding="utf-8")
    assert kept.startswith(b"BSLM") and not (tmp_path / "room.bslam.new").exists()
    for _ in range(2):
        again = run(keep_the_map, folder=tmp_path).stdout
        assert again.startswith("room.bslam: BSLAM_OK")
        assert f"```text\n{again}```" in readme
        assert "at the start: lost" in again
        found = re.search(r"after (\d+\.\d+) s: following", again)
        assert found is not None and float(found[1]) < 10
        position_m, heading_rad = errors_of(again)
        assert position_m < 0.05 and heading_rad < 0.05


def test_keep_the_map_refuses_a_damaged_map_and_leaves_it(tmp_path: Path, keep_the_map: Path) -> None:
    run(keep_the_map, folder=tmp_path)
    path = tmp_path / "room.bslam"
    damaged = bytearray(path.read_bytes())
    damaged[100] ^= 1
    path.write_bytes(damaged)
    said = run(keep_the_map, folder=tmp_path, expect=1).stdout
    assert said == "room.bslam: BSLAM_E_MAP, bslam_map_fault_t 6, 0 beacons\n"  # BSLAM_MAP_BAD_CRC
    assert path.read_bytes() == damaged
    said = run(keep_the_map, "nowhere/room.bslam", folder=tmp_path, expect=1).stdout
    assert said == "nowhere/room.bslam.new: No such file or directory\n"  # before it drives


def test_keep_the_map_leaves_a_map_that_it_cannot_open(tmp_path: Path, keep_the_map: Path) -> None:
    path = tmp_path / "room.bslam"
    path.symlink_to(path)  # to itself
    said = run(keep_the_map, folder=tmp_path, expect=1).stdout
    assert said == "room.bslam: Too many levels of symbolic links\n"
    assert path.is_symlink()


FAILS = """#include "bslam/bslam.h"
bslam_status_t __wrap_bslam_save_map(bslam_t *robot, const bslam_map_sink_t *sink, uint32_t *bytes);
bslam_status_t __wrap_bslam_save_map(bslam_t *robot, const bslam_map_sink_t *sink, uint32_t *bytes)
{
    (void)robot, (void)bytes;
    return sink->write(sink->context, "half", 4) ? BSLAM_E_STATE : BSLAM_E_MAP;
}
"""


def test_keep_the_map_names_the_status_of_a_map_that_is_not_saved(tmp_path: Path, library: Path) -> None:
    (tmp_path / "fails.c").write_text(FAILS, encoding="utf-8")
    source = EXAMPLES / "keep_the_map/keep_the_map.c"
    words = ("-Wl,--wrap=bslam_save_map", library, "-lm", "-o", "keep_the_map")
    run("cc", "-std=c11", *STRICT, f"-I{FIRMWARE}", source, "fails.c", *words, folder=tmp_path)
    said = run("./keep_the_map", folder=tmp_path, expect=1).stdout
    assert said.splitlines()[-1] == "room.bslam: not saved: BSLAM_E_STATE"
    assert not list(tmp_path.glob("room.bslam*"))


# ---- camera_tags -------------------------------------------------------------------------------------------

CAMERA_TAGS = EXAMPLES / "camera_tags" / "camera_tags.py"


def test_camera_tags_maps_the_room(tmp_path: Path) -> None:
    tag_room.write_drive(tmp_path, seed=1)
    printed = run(sys.executable, CAMERA_TAGS, tmp_path, folder=tmp_path).stdout
    x_m, y_m, heading_rad = map(float, re.findall(r"-?\d+\.\d+", printed.splitlines()[0]))
    true_x, true_y, true_heading = tag_room.pose_at(tag_room.steps())
    # The left wheel slips by 2 %: by odometry alone the heading would be 0.6 rad off.
    assert math.dist((x_m, y_m), (true_x, true_y)) < 0.06
    assert abs(math.remainder(heading_rad - true_heading, 2 * math.pi)) < 0.03
    rows = re.findall(r"tag (\d+): x (\S+) m, y (\S+) m, sd (\S+) m", printed)
    tags = {int(number): (float(x), float(y), float(sd)) for number, x, y, sd in rows}
    true_tags = {number: (x, y) for number, x, y, _ in tag_room.TAGS}
    assert set(tags) == set(true_tags)
    for number, (tag_x, tag_y, sd_m) in tags.items():
        error_m = math.dist((tag_x, tag_y), true_tags[number])
        assert error_m < 0.08 and error_m < 3 * sd_m


def test_two_orientations_of_a_tag_share_its_place() -> None:
    """What the README gives as the reason to take bearing and distance alone."""
    half_m, place_m = tag_room.TAG_M / 2, np.array([0.0, 0.0, 2.5])
    corners_m = half_m * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float64)
    seen_px = []
    for lean_rad in (0.3, -0.3):  # 34 degrees apart
        turn = np.array([[math.cos(lean_rad), 0, math.sin(lean_rad)], [0, 1, 0], [-math.sin(lean_rad), 0, 1]])
        at_m = corners_m @ turn.T + place_m
        seen_px.append(tag_room.FOCAL_PX * at_m[:, :2] / at_m[:, 2:])
    assert np.abs(seen_px[0] - seen_px[1]).max() < 0.5  # as far as a detector's corners are off


def write_straight(folder: Path, first_row_us: int, picture_us: int) -> None:
    """20 rows of 1 cm, and one picture of nothing."""
    (folder / "pictures").mkdir(parents=True)
    tag_room.write_camera(folder)
    grey = np.full((tag_room.HEIGHT_PX, tag_room.WIDTH_PX), 150, np.uint8)
    cv2.imwrite(str(folder / "pictures" / f"{picture_us}.png"), grey)
    rows = [f"{first_row_us + 40_000 * row},0.01,0.01" for row in range(20)]
    (folder / "odometry.csv").write_text(
        "\n".join(["time_us,left_m,right_m", *rows]) + "\n", encoding="utf-8"
    )


@pytest.mark.parametrize("picture_us", [80_000, 400_000])
def test_camera_tags_takes_pictures_that_begin_before_or_after_the_wheels(
    tmp_path: Path, picture_us: int
) -> None:
    write_straight(tmp_path, 90_000, picture_us)
    printed = run(sys.executable, CAMERA_TAGS, tmp_path, folder=tmp_path).stdout
    assert printed.startswith("robot: x 0.200 m, y 0.000 m")  # the first row's travel is in it


def test_camera_tags_says_in_a_line_what_the_filter_refuses(tmp_path: Path) -> None:
    write_straight(tmp_path, 10_000_000, 0)
    done = run(sys.executable, CAMERA_TAGS, tmp_path, folder=tmp_path, expect=1)
    (line,) = done.stderr.splitlines()
    assert line.startswith("camera_tags: odometry at 10000000 us") and "BSLAM_E_TIME" in line


def test_a_live_camera_s_tags_are_said_as_the_robots_hear_them(tmp_path: Path) -> None:
    """By the program of its README, with two pictures for a camera."""
    readme = (CAMERA_TAGS.parent / "README.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    assert program.count("VideoCapture(0)") == 1
    colour = cv2.cvtColor(tag_room.picture(tag_room.pose_at(0)), cv2.COLOR_GRAY2BGR)
    for number in (0, 1):
        cv2.imwrite(str(tmp_path / f"film_{number}.png"), colour)
    tag_room.write_camera(tmp_path)
    (tmp_path / "say_tags.py").write_text(
        program.replace("VideoCapture(0)", 'VideoCapture("film_%d.png", cv2.CAP_IMAGES)'), encoding="utf-8"
    )
    (tmp_path / "camera_tags.py").write_text(CAMERA_TAGS.read_text(encoding="utf-8"), encoding="utf-8")
    lines = run(sys.executable, "say_tags.py", folder=tmp_path).stdout.splitlines()
    assert len(lines) % 2 == 0 and len(lines) >= 4
    true_tags = {number: (x_m, y_m) for number, x_m, y_m, _ in tag_room.TAGS}
    for line in lines:
        age_ms, tag, mrad, mm = map(int, line.split(" "))
        x_m, y_m = true_tags[tag]
        x_m -= tag_room.MOUNT_X_M
        assert 30 <= age_ms < 5000
        assert math.isclose(1e-3 * mrad, math.atan2(y_m, x_m), abs_tol=0.01)
        assert math.isclose(1e-3 * mm, math.hypot(x_m, y_m), rel_tol=0.03)


def test_camera_tags_says_that_there_is_no_picture(tmp_path: Path) -> None:
    tag_room.write_camera(tmp_path)
    done = run(sys.executable, CAMERA_TAGS, tmp_path, folder=tmp_path, expect=1)
    assert "no picture there; allowed: TIME_US.png" in done.stderr
