"""Watches a robot that drives by itself over the serial link, and tells it what a detector beside it sees.

    my_detector | python live_robot.py serial:/dev/ttyUSB0

The robot runs firmware/robot/main.c: encoders, filter and link are its own. The detector runs here, on a
companion computer say, and writes a line for each tag: AGE_MS TAG BEARING_MRAD RANGE_MM, left positive.
For each reading of its encoders the robot reports its pose: TIME_US X_M Y_M HEADING_RAD.
"""

from __future__ import annotations

import io
import queue
import sys
import threading
import time
from dataclasses import dataclass
from typing import TextIO

from bslam import CoreError
from bslam.errors import BslamError
from bslam.target.lines import TargetError
from bslam.target.remote import RemoteSlam, connect

# Your robot: docs/TUNING.md says how to find these.
SETTINGS = {
    "wheelbase_m": 0.2,
    "left_radius_m": 0.033,
    "right_radius_m": 0.033,
    "ticks_per_revolution": 1440,
    "counter_bits": 16,
    "mount_x_m": 0.05,
}
BEACONS = 6  # the robot's image must have room for them: BSLAM_BEACONS_MAX


@dataclass(frozen=True)
class Seen:
    """A tag, and when its picture was taken, on this computer's clock."""

    taken_s: float
    label: int
    bearing_rad: float
    range_m: float


def read_line(line: str) -> Seen:
    """Raises ValueError for what is no such line."""
    now_s = time.monotonic()
    age_ms, label, bearing_mrad, range_mm = numbers = [int(word) for word in line.split()]
    if max(map(abs, numbers)) >= 2**31:
        raise ValueError(line)
    return Seen(now_s - 1e-3 * age_ms, label, 1e-3 * bearing_mrad, 1e-3 * range_mm)


def listen(detector: TextIO) -> queue.SimpleQueue[Seen | None]:
    """What the detector says, from a thread of its own: reading a pipe waits. None: it has ended."""
    told: queue.SimpleQueue[Seen | None] = queue.SimpleQueue()

    def read() -> None:
        for line in detector:
            try:
                told.put(read_line(line))
            except ValueError:
                print(
                    f"no sighting: {line.rstrip()!r}; allowed: four whole numbers of 32 bits", file=sys.stderr
                )
        told.put(None)

    threading.Thread(target=read, daemon=True).start()
    return told


def follow(robot: RemoteSlam, told: queue.SimpleQueue[Seen | None]) -> None:
    """Until the detector ends."""
    ahead_s: float | None = None  # this computer's clock, ahead of the robot's by its last report
    while True:
        for one in robot.reports(0.1):
            ahead_s = time.monotonic() - 1e-6 * one.time_us
            x_m, y_m, heading_rad = one.report.step.pose
            print(f"{one.time_us} {x_m:.3f} {y_m:.3f} {heading_rad:.3f}", flush=True)
        while not told.empty():
            seen = told.get()
            if seen is None:
                return
            if ahead_s is None:
                print(f"tag {seen.label} before the robot said what time it is: left out", file=sys.stderr)
                continue
            taken_us = round(1e6 * (seen.taken_s - ahead_s))
            try:
                robot.sightings(taken_us, [seen.bearing_rad], [seen.range_m], [seen.label], [True])
            except CoreError as refusal:  # too old, impossible: the robot is then as it was
                print(refusal, file=sys.stderr)


def main(target: str) -> int:
    """The exit status."""
    detector = io.TextIOWrapper(sys.stdin.buffer, "utf-8", "replace")  # noise is named, and ends nothing
    try:
        with connect(target, SETTINGS, BEACONS) as robot:
            follow(robot, listen(detector))
            robot.update()
            for beacon in robot.beacons():
                print(f"tag {beacon.label}: x {beacon.x_m:.3f} m, y {beacon.y_m:.3f} m", flush=True)
    except (BslamError, TargetError) as error:
        print(f"live_robot: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("allowed: live_robot.py TARGET, as serial:/dev/ttyUSB0")
    sys.exit(main(sys.argv[1]))
