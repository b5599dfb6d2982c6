"""A map of AprilTags from a camera's pictures and the wheels' odometry. OpenCV finds the tags.

    python camera_tags.py DRIVE

DRIVE is a folder with `odometry.csv` (time_us, left_m, right_m: travel of each wheel since the row before),
`camera.toml` and `pictures/TIME_US.png`, on the same clock.
"""

from __future__ import annotations

import csv
import math
import statistics
import sys
import tomllib
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from bslam import CoreError, Slam

CORNER_SD_PX = 0.5  # how far off the detector's corners are: let it look at a tag while nothing moves
RANGE_SCALE_SD = 0.015  # and by what part a tag's distances err alike: its corners come out a little inside

Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Camera:
    """What camera.toml says: the lens, the camera's place on the robot, the tags, the wheels."""

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, ...]  # k1, k2, p1, p2, k3 of OpenCV
    mount_x_m: float
    mount_y_m: float
    mount_yaw_rad: float
    tag_m: float  # side of a tag's black square
    wheelbase_m: float


class Seen(NamedTuple):
    """A tag in a picture: number, direction (left positive) and distance in the plane, with their noise."""

    label: int
    bearing_rad: float
    range_m: float
    bearing_sd_rad: float
    range_sd_m: float


class TagDetector:
    """Finds AprilTags of the family 36h11 in grey pictures."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        matrix = np.array(
            [[camera.fx_px, 0, camera.cx_px], [0, camera.fy_px, camera.cy_px], [0, 0, 1]], np.float64
        )
        self._lens = matrix, np.array(camera.distortion)
        half_m = camera.tag_m / 2  # x right, y up on the tag; from the upper left corner clockwise
        self._corners_m = half_m * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], np.float64)
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        self._detector = cv2.aruco.ArucoDetector(family, parameters)

    def find(self, picture: Picture) -> list[Seen]:
        """The tags in a picture."""
        corners, numbers, _ = self._detector.detectMarkers(picture)
        found = [] if numbers is None else [int(number) for number in numbers.ravel()]
        return [self._seen(label, four) for label, four in zip(found, corners, strict=True)]

    def _seen(self, label: int, corners_px: NDArray[Any]) -> Seen:
        """From the tag's place alone, x right, z ahead. Its orientation is left out: it has two solutions."""
        flags = cv2.SOLVEPNP_IPPE_SQUARE
        _, _, place = cv2.solvePnP(self._corners_m, corners_px.astype(float), *self._lens, flags=flags)
        x_m, _, z_m = place.ravel().tolist()
        range_m = math.hypot(x_m, z_m)
        bearing_sd_rad = CORNER_SD_PX / self._camera.fx_px
        range_sd_m = range_m**2 * bearing_sd_rad / self._camera.tag_m  # by the tag's size in the picture
        return Seen(label, math.atan2(-x_m, z_m), range_m, bearing_sd_rad, max(range_sd_m, 0.005))


def read_grey(path: Path) -> Picture:
    """A picture, (height, width)."""
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        raise SystemExit(f"{path}: no picture that OpenCV reads")
    return np.asarray(picture, np.uint8)


def feed(slam: Slam, time_us: int, seen: list[Seen]) -> None:
    """What one picture shows; none is news, too."""
    labels, bearings, ranges, bearing_sds, range_sds = np.reshape(seen, (-1, len(Seen._fields))).T.tolist()
    slam.sightings(
        time_us, bearings, ranges, list(map(int, labels)), [True] * len(seen), bearing_sds, range_sds
    )


def start_clock(slam: Slam, first_picture_us: int, rows_us: list[int]) -> None:
    """By an empty frame: the first row's travel began at a picture before it, else one usual step before."""
    step_us = round(statistics.median([later - earlier for earlier, later in pairwise(rows_us)] or [40_000]))
    start_us = first_picture_us if first_picture_us < rows_us[0] else rows_us[0] - step_us
    if start_us >= 0:  # else there is no such time, and the first row starts the clock
        slam.sightings(start_us, [], [], [], [])


def map_drive(drive: Path) -> Slam:
    """The filter after the drive."""
    camera = Camera(**tomllib.loads((drive / "camera.toml").read_text(encoding="utf-8")))
    detector = TagDetector(camera)
    names = ("wheelbase_m", "mount_x_m", "mount_y_m", "mount_yaw_rad")
    slam = Slam({name: getattr(camera, name) for name in names} | {"range_scale_sd": RANGE_SCALE_SD})
    pictures = sorted((int(path.stem), path) for path in (drive / "pictures").glob("*.png"))
    if not pictures:
        raise SystemExit(f"{drive}/pictures: no picture there; allowed: TIME_US.png on odometry.csv's clock")
    with (drive / "odometry.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise SystemExit(f"{drive}/odometry.csv: no row; allowed: time_us,left_m,right_m")
    start_clock(slam, pictures[0][0], [int(row["time_us"]) for row in rows])
    for row in rows:
        time_us = int(row["time_us"])
        slam.odometry("wheels", time_us, float(row["left_m"]), float(row["right_m"]))
        while pictures and pictures[0][0] <= time_us:  # a picture after the reading that covers it
            taken_us, path = pictures.pop(0)
            feed(slam, taken_us, detector.find(read_grey(path)))
    return slam


if __name__ == "__main__":
    try:
        slam = map_drive(Path(sys.argv[1]))
    except CoreError as error:
        sys.exit(f"camera_tags: {error}")
    print("robot: x {:.3f} m, y {:.3f} m, heading {:.3f} rad".format(*slam.pose()))
    for beacon in slam.beacons():
        sd_m = math.sqrt(max(beacon.covariance_m2[0][0], beacon.covariance_m2[1][1]))
        print(f"tag {beacon.label}: x {beacon.x_m:.3f} m, y {beacon.y_m:.3f} m, sd {sd_m:.3f} m")
