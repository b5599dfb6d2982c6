"""A room with AprilTags on its walls, and a drive through it with a camera, for examples/camera_tags."""

import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

TAG_M, HEIGHT_M = 0.16, 0.25  # side of the black square; tags are as high as the camera, or somewhat higher
MODULES = 10  # of a tag of family 36h11 with its white margin, of which the black square has eight
WIDTH_PX, HEIGHT_PX, FOCAL_PX = 640, 480, 520.0
FINER = 2  # pictures are drawn this much finer, then averaged: a camera's pixel is no point
MOUNT_X_M = 0.1
WHEELBASE_M, STEP_US, PICTURE_EVERY = 0.25, 40_000, 5
SPEED_MPS, RADIUS_M, ROUNDS = 0.4, 0.8, 1.5

# Number, x, y, direction into which the tag looks; in the frame of the robot's start.
TAGS = [
    (number, x_m, y_m, facing_rad)
    for number, (x_m, y_m, facing_rad) in enumerate(
        [(2.5, y_m, math.pi) for y_m in (-1.0, 0.3, 1.4, 2.6)]
        + [(x_m, 3.3, -math.pi / 2) for x_m in (1.6, 0.4, -0.9, -1.8)]
        + [(-2.5, y_m, 0.0) for y_m in (2.4, 1.1, 0.2, -0.9)]
        + [(x_m, -1.7, math.pi / 2) for x_m in (-1.7, -0.5, 0.6, 1.8)]
    )
]

Pose = tuple[float, float, float]


def pose_at(step: int) -> Pose:
    """Where the robot is: a circle to the left."""
    turned_rad = SPEED_MPS / RADIUS_M * step * STEP_US * 1e-6
    return RADIUS_M * math.sin(turned_rad), RADIUS_M * (1 - math.cos(turned_rad)), turned_rad


def steps() -> int:
    """Of the drive."""
    return round(ROUNDS * 2 * math.pi * RADIUS_M / SPEED_MPS / (STEP_US * 1e-6))


def picture(pose: Pose) -> NDArray[np.uint8]:
    """What the camera takes, grey, (HEIGHT_PX, WIDTH_PX)."""
    size = (WIDTH_PX * FINER, HEIGHT_PX * FINER)
    drawn = np.full(size[::-1], 150, np.uint8)
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    for number, *place in TAGS:
        corners_px = _corners_px(pose, *place)
        if corners_px is None:
            continue
        module_px = 24
        marker = cv2.aruco.generateImageMarker(family, number, 8 * module_px)
        marker = cv2.copyMakeBorder(marker, *[module_px] * 4, cv2.BORDER_CONSTANT, value=255)
        last = (
            MODULES * module_px - 0.5
        )  # a picture's corner is half a pixel beyond the middle of its last one
        flat = np.array([[-0.5, -0.5], [last, -0.5], [last, last], [-0.5, last]], np.float32)
        fine = ((corners_px + 0.5) * FINER - 0.5).astype(np.float32)
        mapping = cv2.getPerspectiveTransform(flat, fine)
        covered = cv2.warpPerspective(np.full_like(marker, 255), mapping, size)
        drawn = np.where(covered > 127, cv2.warpPerspective(marker, mapping, size), drawn)
    return np.asarray(cv2.resize(drawn, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA), np.uint8)


def _corners_px(pose: Pose, x_m: float, y_m: float, facing_rad: float) -> NDArray[np.float64] | None:
    """Of a tag with its margin, from the upper left one clockwise; None: it cannot be seen."""
    half_m = TAG_M / 8 * MODULES / 2
    left_x, left_y = math.sin(facing_rad), -math.cos(facing_rad)  # to the left of who looks at the tag
    camera_x, camera_y = pose[0] + MOUNT_X_M * math.cos(pose[2]), pose[1] + MOUNT_X_M * math.sin(pose[2])
    if math.cos(facing_rad) * (camera_x - x_m) + math.sin(facing_rad) * (camera_y - y_m) < 0.2:
        return None
    corners = []
    for left, up in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        dx = x_m + left * half_m * left_x - camera_x
        dy = y_m + left * half_m * left_y - camera_y
        ahead_m = math.cos(pose[2]) * dx + math.sin(pose[2]) * dy
        to_left_m = math.cos(pose[2]) * dy - math.sin(pose[2]) * dx
        if ahead_m < 0.3:
            return None
        u_px = WIDTH_PX / 2 - 0.5 - FOCAL_PX * to_left_m / ahead_m
        corners.append((u_px, HEIGHT_PX / 2 - 0.5 - FOCAL_PX * (up * half_m + 0.1) / ahead_m))
    return np.array(corners)


def write_camera(folder: Path) -> None:
    """camera.toml."""
    (folder / "camera.toml").write_text(
        f"fx_px = {FOCAL_PX}\nfy_px = {FOCAL_PX}\ncx_px = {WIDTH_PX / 2 - 0.5}\n"
        f"cy_px = {HEIGHT_PX / 2 - 0.5}\n"
        f"distortion = [0.0, 0.0, 0.0, 0.0, 0.0]\nmount_x_m = {MOUNT_X_M}\nmount_y_m = 0.0\n"
        f"mount_yaw_rad = 0.0\ntag_m = {TAG_M}\nwheelbase_m = {WHEELBASE_M}\n",
        encoding="utf-8",
    )


def write_drive(folder: Path, seed: int) -> None:
    """Pictures, and odometry of wheels that err by 0.05 m/s at each step and of which the left one slips."""
    rng = np.random.default_rng(seed)
    (folder / "pictures").mkdir(parents=True)
    write_camera(folder)
    rows = ["time_us,left_m,right_m"]
    for step in range(steps() + 1):
        if step % PICTURE_EVERY == 0:
            noisy = picture(pose_at(step)) + rng.normal(0, 3, (HEIGHT_PX, WIDTH_PX))
            cv2.imwrite(
                str(folder / "pictures" / f"{step * STEP_US}.png"), np.clip(noisy, 0, 255).astype(np.uint8)
            )
        if step > 0:
            travel_m = SPEED_MPS * STEP_US * 1e-6 * (1 + np.array([-1, 1]) * WHEELBASE_M / 2 / RADIUS_M)
            travel_m = travel_m * (1.02, 1.0) + rng.normal(0, 0.05 * STEP_US * 1e-6, 2)
            rows.append(f"{step * STEP_US},{travel_m[0]:.6f},{travel_m[1]:.6f}")
    (folder / "odometry.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
