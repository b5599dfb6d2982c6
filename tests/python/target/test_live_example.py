"""examples/live_robot: it watches a robot over a serial line, and tells it what a detector sees."""

import math
import os
import pty
import re
import subprocess
import sys
import tty
from pathlib import Path

import numpy as np
import pytest

from bslam.target.film import write_film

ROOT = Path(__file__).parents[3]
ROBOT = ROOT / "build" / "host" / "robot"
EXAMPLE = ROOT / "examples" / "live_robot" / "live_robot.py"
STEP_US, READINGS, TICKS = 40_000, 90, (73, 94)
GOING, STANDING = 10, 20  # readings; it looks while it stands: no computer is too slow for that
LOOKING = (GOING + 2, GOING + 5, GOING + 8)
M_PER_TICK, WHEELBASE_M, MOUNT_X_M = 2 * math.pi * 0.033 / 1440, 0.2, 0.05  # as the example has them
SLIP = 0.95  # of the left wheel: odometry alone goes wrong
TAGS = {1: (3.0, 0.2), 2: (2.5, 2.0), 3: (1.5, 3.0), 4: (0.3, 3.2)}


def phase(time_us):
    """Which reading of going and standing ends then."""
    return (round(time_us / STEP_US) - 1) % (GOING + STANDING)


def moved(pose):
    """One reading later, where the wheels turn."""
    x_m, y_m, heading_rad = pose
    left_m, right_m = TICKS[0] * M_PER_TICK * SLIP, TICKS[1] * M_PER_TICK
    turn_rad = (right_m - left_m) / WHEELBASE_M
    half_rad, forward_m = heading_rad + turn_rad / 2, (left_m + right_m) / 2
    return x_m + forward_m * math.cos(half_rad), y_m + forward_m * math.sin(half_rad), heading_rad + turn_rad


def lines_of(pose):
    """What the detector writes of the tags before the camera."""
    x_m, y_m, heading_rad = pose
    for tag, (tag_x, tag_y) in TAGS.items():
        dx = tag_x - x_m - MOUNT_X_M * math.cos(heading_rad)
        dy = tag_y - y_m - MOUNT_X_M * math.sin(heading_rad)
        bearing_rad = math.remainder(math.atan2(dy, dx) - heading_rad, 2 * math.pi)
        if abs(bearing_rad) < 1.5:
            yield f"0 {tag} {round(1e3 * bearing_rad)} {round(1e3 * math.hypot(dx, dy))}\n"


@pytest.fixture
def device(tmp_path):
    """A serial device with the application at its other end, whose wheels turn."""
    write_film(tmp_path / "wheels", STEP_US, np.array([TICKS] * GOING + [(0, 0)] * STANDING))
    ours, theirs = pty.openpty()
    tty.setraw(ours)
    tty.setraw(theirs)
    environment = os.environ | {"BSLAM_FILM": str(tmp_path / "wheels")}
    robot = subprocess.Popen([ROBOT], stdin=ours, stdout=ours, env=environment)
    yield os.ttyname(theirs)
    robot.kill()
    robot.wait()
    os.close(ours)
    os.close(theirs)


def test_it_watches_the_robot_and_tells_it_of_the_tags(device):
    command = [sys.executable, EXAMPLE, f"serial:{device}"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as example:
        example.stdin.write("noise\n")
        truth, time_us, readings = None, 0.0, 0
        while readings < READINGS or phase(time_us) != LOOKING[-1] + 5:  # the last it hears is what is there
            readings += 1
            time_us, x_m, y_m, heading_rad = map(float, example.stdout.readline().split())
            if truth is None:
                truth = (0.0, 0.0, 0.0)  # the first reading is where it starts
            elif phase(time_us) < GOING:
                truth = moved(truth)
            elif phase(time_us) in LOOKING:
                example.stdin.write("".join(lines_of(truth)))
                example.stdin.flush()
        rest, said = example.communicate(timeout=30)
    assert example.returncode == 0, said
    noise, *refused = said.splitlines()
    assert noise == "no sighting: 'noise'; allowed: four whole numbers of 32 bits"
    assert all("BSLAM_E_TIME" in line for line in refused)  # the same again, told between two reports
    assert math.hypot(x_m - truth[0], y_m - truth[1]) < 0.05
    assert abs(math.remainder(heading_rad - truth[2], 2 * math.pi)) < 0.05
    tags = {int(n): (float(x), float(y)) for n, x, y in re.findall(r"tag (\d): x (\S+) m, y (\S+) m", rest)}
    assert set(tags) == set(TAGS)
    assert all(math.dist(tags[n], TAGS[n]) < 0.1 for n in TAGS)


def test_without_wheels_it_ends_with_the_detector():
    """A robot that reports nothing has told no time, which a sighting needs."""
    command = [sys.executable, EXAMPLE, f"process:{ROBOT}"]
    done = subprocess.run(command, input="0 7 0 2000\n", capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr == "tag 7 before the robot said what time it is: left out\n"


def test_noise_of_its_detector_ends_nothing():
    command = [sys.executable, EXAMPLE, f"process:{ROBOT}"]
    environment = os.environ | {"PYTHONIOENCODING": "utf-8:strict"}
    noise = b"\xff\xfe\n99999999999 7 0 2000\n0 7 0 2000\n"
    done = subprocess.run(command, input=noise, capture_output=True, env=environment, check=False, timeout=60)
    lines = done.stderr.decode().splitlines()
    assert [line.split(":")[0] for line in lines[:2]] == ["no sighting"] * 2
    assert lines[2].startswith("tag 7 before the robot said")


def test_a_device_that_is_none_is_one_line():
    command = [sys.executable, EXAMPLE, "serial:/dev/nowhere"]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert "'/dev/nowhere'" in line and "allowed: a device such as" in line


def test_its_figures_are_those_of_the_microbit_s_image():
    image = ROOT / "build" / "microbit" / "robot.elf"
    printed = subprocess.run(["arm-none-eabi-size", image], capture_output=True, text=True, check=True).stdout
    text, data, bss = map(int, printed.splitlines()[1].split()[:3])
    readme = EXAMPLE.with_name("README.md").read_text(encoding="utf-8")
    said = re.search(r"Flash ([\d,]+) bytes, RAM ([\d,]+) bytes", readme)
    assert [int(one.replace(",", "")) for one in said.groups()] == pytest.approx(
        [text + data, data + bss], rel=0.05
    )
