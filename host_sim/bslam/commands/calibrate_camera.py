"""`bslam calibrate camera`: a lens from pictures of a checkerboard, and how the camera sits on the robot."""

from __future__ import annotations

import argparse
import math
import re
from pathlib import Path

from bslam.calibration.calibrate import Estimate
from bslam.calibration.calibrate_camera import (
    Board,
    LensCalibration,
    Mounting,
    as_toml,
    calibrate_lens,
    find_boards,
    find_mounting,
)
from bslam.calibration.camera_pitch import find_pitch, load_drive
from bslam.calibration.sensor_yaw import find_yaw
from bslam.commands.report import table_of
from bslam.errors import BslamError
from bslam.log import Log
from bslam.rig import LENS_KINDS, Camera
from bslam.runs.output import write_atomically

_ROLL_SEEN_RAD = math.radians(1.0)


def add_camera_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the camera's calibration."""
    group = parser.add_argument_group("camera")
    group.add_argument(
        "--lens", choices=LENS_KINDS, default="pinhole", help="kind of lens (default: pinhole)"
    )
    group.add_argument(
        "--board",
        type=_corners,
        default=(9, 6),
        metavar="AxB",
        help="inner corners of the board, across and down (default: 9x6)",
    )
    group.add_argument(
        "--square", type=_metres, default=0.025, metavar="M", help="side of a square (default: 0.025)"
    )
    group.add_argument(
        "--plumb",
        type=Path,
        metavar="DIR",
        help="pictures of the board hanging plumb, rows level, the robot on level floor: gives the pitch",
    )
    group.add_argument(
        "--board-height",
        type=_metres,
        metavar="M",
        help="height of the plumb board's lowest inner corners above the floor: gives the camera's height",
    )
    group.add_argument(
        "--drive",
        type=Path,
        metavar="DIR",
        help="in place of --plumb: pictures of a drive past doors, cabinets and the like, in the order of "
        "their names; with --height they give the pitch",
    )
    group.add_argument(
        "--height", type=_metres, metavar="M", help="height of the camera above the floor, with --drive"
    )
    group.add_argument(
        "--log",
        type=Path,
        metavar="FOLDER",
        help="a drive with distances to told beacons: gives the yaw, with the log's truth or its odometry",
    )


def execute_camera(arguments: argparse.Namespace) -> int:
    """Run the calibration; the exit status."""
    across, down = arguments.board
    board = Board(across, down, arguments.square)
    folder = Path(arguments.directory)
    calibration = calibrate_lens(find_boards(folder, board), board, arguments.lens)
    mounting = yaw = None
    if (arguments.drive is None) != (arguments.height is None):
        raise BslamError("--drive and --height: one says nothing by itself; allowed: both")
    if arguments.drive is not None and arguments.plumb is not None:
        raise BslamError("--drive and --plumb: both give the pitch; allowed: one")
    if arguments.drive is not None:
        camera = Camera(calibration.lens, z_m=arguments.height)
        pitch = find_pitch(load_drive(arguments.drive, camera), camera)
        mounting = Mounting(pitch, 0.0, arguments.height)
    elif arguments.plumb is not None:
        plumb = find_boards(arguments.plumb, board)
        mounting = find_mounting(plumb, board, calibration.lens, arguments.board_height)
    elif arguments.board_height is not None:
        raise BslamError("--board-height: says nothing by itself; allowed: together with --plumb DIR")
    if arguments.log is not None:
        yaw = find_yaw(Log.read(arguments.log))
    file = arguments.out / "camera.toml"
    write_atomically(file, as_toml(calibration, mounting, yaw, str(folder)))
    print("\n".join(_describe(calibration, mounting, yaw)))
    print(f"written: {file}")
    return 0


def _describe(calibration: LensCalibration, mounting: Mounting | None, yaw: Estimate | None) -> list[str]:
    lens = calibration.lens
    lines = [
        f"{lens.kind} lens, {lens.width_px}x{lens.height_px}, from {len(calibration.view_errors_px)} "
        f"pictures: reprojection error {calibration.error_px:.3f} px rms"
    ]
    lines += [f"  left out, does not fit: {name}, {e:.1f} px" for name, e in calibration.left_out_px.items()]
    rows = [
        [f"  {name}", f"{getattr(lens, name):.4f}", ""]
        for name in ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2")
    ]
    if mounting is not None:
        rows.append(_degrees("pitch_deg (down)", mounting.pitch))
        if mounting.z_m is not None:
            rows.append(["  z_m", f"{mounting.z_m:.4f}", ""])
    if yaw is not None:
        rows.append(_degrees("yaw_deg (left)", yaw))
    lines.append(table_of(rows))
    if mounting is not None and abs(mounting.roll_rad) > _ROLL_SEEN_RAD:
        lines.append(
            f"the camera is rolled by {math.degrees(mounting.roll_rad):.1f} degrees: turn it level, the lens "
            "model has no roll"
        )
    return lines


def _degrees(name: str, estimate: Estimate) -> list[str]:
    error = f"+- {math.degrees(estimate.error):.3f}" if math.isfinite(estimate.error) else ""
    return [f"  {name}", f"{math.degrees(estimate.value):.3f}", error]


def _corners(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,2})x(\d{1,2})", text)
    if match is None or not (int(match[1]) > int(match[2]) >= 3):
        raise argparse.ArgumentTypeError(
            f"'{text}' is not allowed; allowed: AxB inner corners, A above B, B from 3, as 9x6"
        )
    return int(match[1]), int(match[2])


def _metres(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value <= 10.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: metres above 0, at most 10")
    return value
