"""Alignment in the plane: rotation and shift, and where wanted the scale, which directions do not tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]  # (n, 2) x_m, y_m


@dataclass(frozen=True)
class Rigid:
    """p -> R(turn_rad) p + shift_m."""

    turn_rad: float = 0.0
    shift_x_m: float = 0.0
    shift_y_m: float = 0.0

    @property
    def rotation(self) -> NDArray[np.float64]:
        """R, (2, 2)."""
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        return np.array([[c, -s], [s, c]])

    def points(self, points_m: Points) -> Points:
        """(n, 2) -> (n, 2)."""
        return points_m @ self.rotation.T + (self.shift_x_m, self.shift_y_m)

    def poses(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3) x_m, y_m, theta_rad -> (n, 3), theta in (-pi, pi]."""
        return np.column_stack([self.points(poses[:, :2]), wrap_angle(poses[:, 2] + self.turn_rad)])

    def covariance(self, covariance_m2: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of a point, (2, 2) -> (2, 2)."""
        turned: NDArray[np.float64] = self.rotation @ covariance_m2 @ self.rotation.T
        return turned

    def inverse(self) -> Rigid:
        """The transform that undoes this one."""
        back = Rigid(-self.turn_rad).points(np.array([[self.shift_x_m, self.shift_y_m]]))[0]
        return Rigid(-self.turn_rad, -float(back[0]), -float(back[1]))


@dataclass(frozen=True)
class Similarity(Rigid):
    """p -> scale R(turn_rad) p + shift_m."""

    scale: float = 1.0

    def points(self, points_m: Points) -> Points:
        """(n, 2) -> (n, 2)."""
        return super().points(points_m * self.scale)

    def covariance(self, covariance_m2: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of a point, (2, 2) -> (2, 2)."""
        return self.scale**2 * super().covariance(covariance_m2)

    def inverse(self) -> Similarity:
        """The transform that undoes this one."""
        back = Rigid(-self.turn_rad).points(np.array([[self.shift_x_m, self.shift_y_m]]))[0] / self.scale
        return Similarity(-self.turn_rad, -float(back[0]), -float(back[1]), 1.0 / self.scale)


def fit(kind: str, moving_m: Points, fixed_m: Points) -> Rigid:
    """The transform of a kind, "none", "rigid" or "similarity", that brings one nearest to the other."""
    if kind == "none":
        return Rigid()
    if kind == "rigid":
        return fit_rigid(moving_m, fixed_m)
    scale = fit_scale(moving_m, fixed_m)
    rigid = fit_rigid(scale * moving_m, fixed_m)
    return Similarity(rigid.turn_rad, rigid.shift_x_m, rigid.shift_y_m, scale)


def fit_rigid(moving_m: Points, fixed_m: Points) -> Rigid:
    """The transform that brings `moving_m` nearest to `fixed_m`: least squares over pairs of rows.

    In the plane the closed form needs no SVD: the best angle is that of the sum of conj(moving) fixed, taken
    as complex numbers about their centres. One pair, or none, fixes no angle: the turn is 0 then.
    """
    if len(moving_m) == 0:
        return Rigid()
    moving_mean, fixed_mean = moving_m.mean(axis=0), fixed_m.mean(axis=0)
    p, q = moving_m - moving_mean, fixed_m - fixed_mean
    turn_rad = float(np.arctan2(np.sum(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]), np.sum(p * q)))
    shift_m = fixed_mean - Rigid(turn_rad).points(moving_mean[None])[0]
    return Rigid(turn_rad, float(shift_m[0]), float(shift_m[1]))


def fit_scale(moving_m: Points, fixed_m: Points) -> float:
    """By how much `moving_m` is to be enlarged so that, after `fit_rigid`, it is nearest to `fixed_m`.

    1 where fewer than two different points, on either side, leave it open.
    """
    if len(moving_m) == 0:
        return 1.0
    p = fit_rigid(moving_m, fixed_m).points(moving_m) - fixed_m.mean(axis=0)
    spread_m2, common_m2 = float(np.sum(p**2)), float(np.sum(p * (fixed_m - fixed_m.mean(axis=0))))
    return common_m2 / spread_m2 if spread_m2 > 0.0 and common_m2 > 0.0 else 1.0


def wrap_angle(angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angles in (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle_rad, 2.0 * np.pi)
