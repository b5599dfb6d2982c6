"""A camera's lens from pictures of a checkerboard, its pitch and height from a board that hangs plumb.

The lens by OpenCV, in its two models: calib3d's with k1 and k2, and fisheye's with k1 and k2. Inside, camera
axes are OpenCV's: x right, y down, z forward.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.calibration.calibrate import Estimate
from bslam.datasets.pictures import SUFFIXES
from bslam.errors import BslamError, pip_install
from bslam.rig import Camera, Lens

try:
    import cv2
except ImportError:  # an extra
    cv2 = None  # type: ignore[assignment]

_FEWEST_VIEWS: Final = 4
# A view whose error is above both is not of the lens that the others show.
_OUTLIER_PX: Final = 1.0
_OUTLIER_FACTOR: Final = 4.0


@dataclass(frozen=True)
class Board:
    """A checkerboard by its inner corners; across and down differ, so that a picture tells them apart."""

    across: int
    down: int
    square_m: float

    def points_m(self) -> NDArray[np.float32]:
        """Corners (across * down, 3), row by row, x to the right and y down in the board's plane."""
        down, across = np.mgrid[: self.down, : self.across]
        flat = np.zeros_like(across)
        return (np.stack([across, down, flat], axis=-1).reshape(-1, 3) * self.square_m).astype(np.float32)


@dataclass(frozen=True)
class Views:
    """Boards found in pictures of one size."""

    names: tuple[str, ...]
    corners_px: tuple[NDArray[np.float32], ...]  # (across * down, 2) each
    width_px: int
    height_px: int
    without_board: tuple[str, ...]


@dataclass(frozen=True)
class LensCalibration:
    """A lens, how well it reproduces the corners, and the views that it had to leave out."""

    lens: Lens
    error_px: float  # rms over all corners
    view_errors_px: dict[str, float]
    left_out_px: dict[str, float]


@dataclass(frozen=True)
class Mounting:
    """How a camera sits, from pictures of a plumb board; roll is what the lens model has no place for."""

    pitch: Estimate  # rad, positive looks down
    roll_rad: float
    z_m: float | None  # above the floor, if the board's height was given


def find_boards(folder: Path, board: Board) -> Views:
    """The boards in a folder's pictures.

    BslamError if there is no picture, one that cannot be read, or one of another size.
    """
    if not folder.is_dir():
        raise BslamError(f"{folder}: no such folder; allowed: one with pictures of a checkerboard")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise BslamError(f"{folder}: no picture in it; allowed: files named {', '.join(SUFFIXES)}")
    opencv = _opencv()
    found: dict[str, NDArray[np.float32]] = {}
    size: tuple[int, int] | None = None
    for path in paths:
        picture = opencv.imread(str(path), opencv.IMREAD_GRAYSCALE)
        if picture is None:
            raise BslamError(f"{path}: cannot be read as a picture; allowed: PNG, JPEG, BMP or PPM")
        size = size or picture.shape
        if picture.shape != size:
            shapes = f"{picture.shape[1]}x{picture.shape[0]}; allowed: {size[1]}x{size[0]}"
            raise BslamError(f"{path}: is {shapes}, as the picture before it: one camera, one size")
        corners = _corners(opencv, picture, board)
        if corners is not None:
            found[path.name] = corners
    assert size is not None
    without = tuple(path.name for path in paths if path.name not in found)
    return Views(tuple(found), tuple(found.values()), size[1], size[0], without)


def calibrate_lens(views: Views, board: Board, kind: str) -> LensCalibration:
    """The lens of that kind that reproduces the corners best.

    Views that fit far worse than the others (a board past the lens's edge, a blurred one) are left out.
    BslamError if the views are too few, or the solution does not converge.
    """
    left_out: dict[str, float] = {}
    while True:
        lens, errors = _fit_lens(views, board, kind)
        limit_px = max(_OUTLIER_PX, _OUTLIER_FACTOR * float(np.median(list(errors.values()))))
        outliers = {name: error for name, error in errors.items() if not error <= limit_px}
        if not outliers:
            error_px = math.sqrt(float(np.mean(np.square(list(errors.values())))))
            return LensCalibration(lens, error_px, errors, left_out)
        left_out |= outliers
        views = _without(views, outliers)


def _without(views: Views, outliers: Container[str]) -> Views:
    pairs = zip(views.names, views.corners_px, strict=True)
    kept = {name: corners for name, corners in pairs if name not in outliers}
    dropped = tuple(name for name in views.names if name not in kept)
    return replace(
        views,
        names=tuple(kept),
        corners_px=tuple(kept.values()),
        without_board=views.without_board + dropped,
    )


def _fit_lens(views: Views, board: Board, kind: str) -> tuple[Lens, dict[str, float]]:
    """The best lens, and each view's error, px rms."""
    if len(views.names) < _FEWEST_VIEWS:
        others = ", ".join(views.without_board) or "in others"
        raise BslamError(
            f"a board of {board.across}x{board.down} inner corners was found in {len(views.names)} pictures "
            f"that fit (not {others}); allowed: at least {_FEWEST_VIEWS}"
        )
    opencv = _opencv()
    solve = _solve_pinhole if kind == "pinhole" else _solve_equidistant
    try:
        matrix, distortion, turns, shifts = solve(opencv, views, board)
    except opencv.error as error:
        reason = str(error).strip().splitlines()[-1]
        raise BslamError(
            f"the pictures do not fit a {kind} lens: {reason}; allowed: sharp pictures of the board from "
            "different sides, all over the frame"
        ) from error
    k1, k2 = (float(one) for one in distortion.ravel()[:2])
    lens = Lens(
        kind,
        views.width_px,
        views.height_px,
        fx_px=float(matrix[0, 0]),
        fy_px=float(matrix[1, 1]),
        cx_px=float(matrix[0, 2]),
        cy_px=float(matrix[1, 2]),
        k1=k1,
        k2=k2,
    )
    errors = {}
    for name, corners, turn, shift in zip(views.names, views.corners_px, turns, shifts, strict=True):
        residual = _project(opencv, lens, board.points_m(), turn, shift) - corners
        errors[name] = math.sqrt(float(np.mean(np.sum(residual**2, axis=1))))
    return lens, errors


def find_mounting(views: Views, board: Board, lens: Lens, lowest_m: float | None) -> Mounting:
    """Pitch and roll from boards that hang plumb, rows level; `lowest_m`: height of the lowest corners."""
    if not views.names:
        raise BslamError(
            f"no board of {board.across}x{board.down} inner corners in {', '.join(views.without_board)}"
        )
    if (views.width_px, views.height_px) != (lens.width_px, lens.height_px):
        sizes = f"{views.width_px}x{views.height_px}; allowed: {lens.width_px}x{lens.height_px}"
        raise BslamError(f"the plumb board's pictures are {sizes}, as those that the lens is from")
    poses = [_board_pose(lens, board, corners) for corners in views.corners_px]
    down = np.array([rotation[:, 1] for rotation, _ in poses])  # plumb line in camera axes
    pitches = np.arcsin(np.clip(down[:, 2], -1.0, 1.0))
    error = float(np.std(pitches, ddof=1) / math.sqrt(len(pitches))) if len(pitches) > 1 else math.nan
    heights = [float(rotation[:, 1] @ (rotation @ board.points_m()[-1] + shift)) for rotation, shift in poses]
    return Mounting(
        pitch=Estimate(float(np.mean(pitches)), error),
        roll_rad=float(np.mean(np.arctan2(-down[:, 0], down[:, 1]))),
        z_m=None if lowest_m is None else lowest_m + float(np.mean(heights)),
    )


def as_toml(
    calibration: LensCalibration, mounting: Mounting | None, yaw: Estimate | None, source: str
) -> str:
    """A rig of this one camera for load_rig, with the same as bslam_camera_t in a comment."""
    lens = calibration.lens
    numbers = {
        name: f"{getattr(lens, name):.7g}" for name in ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2")
    }
    place = {}
    if mounting is not None and mounting.z_m is not None:
        place["z_m"] = mounting.z_m
    if yaw is not None:
        place["yaw_deg"] = math.degrees(yaw.value)
    if mounting is not None:
        place["pitch_deg"] = math.degrees(mounting.pitch.value)
    lines = [
        f"# Camera calibrated on {source}: {len(calibration.view_errors_px)} pictures, reprojection error "
        f"{calibration.error_px:.3f} px rms.",
        "",
        "[lens]",
        f'kind = "{lens.kind}"',
        f"width_px = {lens.width_px}",
        f"height_px = {lens.height_px}",
        *(f"{name} = {value}" for name, value in numbers.items()),
        "",
        "[[cameras]]",
        *(f"{name} = {value:.6g}" for name, value in place.items()),
        "",
        "# The same for the C core:",
        *(f"# {line}" for line in _c_initialiser(lens, numbers, place)),
    ]
    return "\n".join(lines) + "\n"


# --- boards in pictures -------------------------------------------------------------------------------------


def _opencv() -> Any:
    if cv2 is None:
        allowed = pip_install("opencv-python-headless")
        raise BslamError(f"calibrate camera: OpenCV is missing; allowed: {allowed}")
    return cv2


def _corners(opencv: Any, picture: NDArray[np.uint8], board: Board) -> NDArray[np.float32] | None:
    """Corners (n, 2) row by row from the board's upper left, or None."""
    found, corners = opencv.findChessboardCornersSB(
        picture, (board.across, board.down), flags=opencv.CALIB_CB_ACCURACY | opencv.CALIB_CB_EXHAUSTIVE
    )
    if not found:
        return None
    corners = corners.reshape(board.down, board.across, 2)
    if corners[-1, :, 1].mean() < corners[0, :, 1].mean():  # found from the other end
        corners = corners[::-1, ::-1]
    return np.ascontiguousarray(corners.reshape(-1, 2), dtype=np.float32)


def _solve_pinhole(opencv: Any, views: Views, board: Board) -> tuple[Any, Any, Any, Any]:
    flags = opencv.CALIB_ZERO_TANGENT_DIST | opencv.CALIB_FIX_K3
    points = [board.points_m()] * len(views.names)
    size = (views.width_px, views.height_px)
    return opencv.calibrateCamera(points, list(views.corners_px), size, None, None, flags=flags)[1:]


def _solve_equidistant(opencv: Any, views: Views, board: Board) -> tuple[Any, Any, Any, Any]:
    flags = opencv.CALIB_FIX_SKEW | opencv.CALIB_RECOMPUTE_EXTRINSIC
    flags |= opencv.CALIB_FIX_K3 | opencv.CALIB_FIX_K4
    points = [board.points_m()[None].astype(np.float64)] * len(views.names)
    corners = [one[None].astype(np.float64) for one in views.corners_px]
    size = (views.width_px, views.height_px)
    return opencv.fisheye.calibrate(points, corners, size, np.eye(3), np.zeros(4), flags=flags)[1:]


def _matrix(lens: Lens) -> NDArray[np.float64]:
    return np.array([[lens.fx_px, 0.0, lens.cx_px], [0.0, lens.fy_px, lens.cy_px], [0.0, 0.0, 1.0]])


def _project(
    opencv: Any, lens: Lens, points_m: NDArray[np.float32], turn: Any, shift: Any
) -> NDArray[np.float64]:
    """Pixels (n, 2) of a board's points; turn is a rotation vector."""
    project: Callable[..., Any] = (
        opencv.projectPoints if lens.kind == "pinhole" else opencv.fisheye.projectPoints
    )
    points = points_m[None].astype(np.float64)
    distortion = np.array([lens.k1, lens.k2, 0.0, 0.0])
    pixels, _ = project(points, np.ravel(turn), np.ravel(shift), _matrix(lens), distortion)
    return pixels.reshape(-1, 2)


def _board_pose(
    lens: Lens, board: Board, corners_px: NDArray[np.float32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation (3, 3) and shift (3,) from the board's axes to the camera's."""
    opencv = _opencv()
    distortion = np.array([lens.k1, lens.k2, 0.0, 0.0])
    undistort = opencv.undistortPoints if lens.kind == "pinhole" else opencv.fisheye.undistortPoints
    rays = undistort(corners_px[:, None].astype(np.float64), _matrix(lens), distortion)
    good, turn, shift = opencv.solvePnP(board.points_m().astype(np.float64), rays, np.eye(3), None)
    if not good:
        raise BslamError("a plumb board's picture has no solution; allowed: a board nearer to the middle")
    return opencv.Rodrigues(turn)[0], shift.ravel()


def _c_initialiser(lens: Lens, numbers: dict[str, str], place: dict[str, float]) -> list[str]:
    """Lines of a bslam_camera_t."""
    name = "BSLAM_LENS_PINHOLE" if lens.kind == "pinhole" else "BSLAM_LENS_EQUIDISTANT"
    yaw_rad, pitch_rad = (math.radians(place.get(f"{word}_deg", 0.0)) for word in ("yaw", "pitch"))
    z_m = place.get("z_m", Camera.z_m)
    inner = [f"{key} = {float(value):#.7g}f" for key, value in numbers.items()]
    return [
        "static const bslam_camera_t camera = {",
        f"    .lens = {name}, .width_px = {lens.width_px}, .height_px = {lens.height_px},",
        f"    {', '.join(f'.{one}' for one in inner)},",
        f"    .yaw_rad = {yaw_rad:#.7g}f, .pitch_rad = {pitch_rad:#.7g}f, .z_m = {z_m:#.7g}f,",
        "};",
    ]
