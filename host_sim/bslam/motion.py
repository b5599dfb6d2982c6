"""How two wheels move a robot in the plane. Metres and radians."""

from __future__ import annotations

import math
from typing import Final

PAUSE_US: Final = 4_000_000
"""A longer pause of odometry interrupts it, as the core has it."""
_UNSEEN_MPS, _UNSEEN_MOST_M, _UNSEEN_RAD = 0.5, 30.0, 3.0

Pose = tuple[float, float, float]
"""x_m, y_m, theta_rad."""


def move_on_arc(pose: Pose, left_m: float, right_m: float, wheelbase_m: float) -> Pose:
    """The pose after the wheels have rolled so far at constant speeds: exact, a circular arc.

    The chord of an arc of length s that turns by a is s sin(a/2) / (a/2), at half the turn.
    """
    x_m, y_m, theta_rad = pose
    forward_m = 0.5 * (left_m + right_m)
    half_turn_rad = 0.5 * (right_m - left_m) / wheelbase_m
    shrink = math.sin(half_turn_rad) / half_turn_rad if half_turn_rad != 0.0 else 1.0
    chord_m = forward_m * shrink
    heading_rad = theta_rad + half_turn_rad
    turned_rad = math.remainder(theta_rad + 2.0 * half_turn_rad, math.tau)
    return x_m + chord_m * math.cos(heading_rad), y_m + chord_m * math.sin(heading_rad), turned_rad


def unseen_sd(pause_us: int) -> tuple[float, float]:
    """By how much the pose is doubtful after such a pause, m and rad: the robot may have driven on."""
    return min(_UNSEEN_MPS * pause_us * 1e-6, _UNSEEN_MOST_M), _UNSEEN_RAD
