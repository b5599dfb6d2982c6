"""Poses that a robot could have in a scene, for training and testing detectors."""

from __future__ import annotations

import math

import numpy as np

from bslam.errors import BslamError
from bslam.world.camera.scene import Floats, Scene

_CLEARANCE_M = 0.45  # of the middle of the robot from walls and things
_DRAWS = 2000
_SPEED_MPS = (0.3, 0.7)
_TURN_RADPS = (0.5, 1.2)
_REACH_M = 0.2
_FACING_RAD = 0.7


def free_pose(scene: Scene, random: np.random.Generator) -> tuple[float, float, float]:
    """A random pose (x m, y m, theta rad) clear of walls and things; BslamError if none is found."""
    for _ in range(_DRAWS):
        x0, y0, x1, y1 = scene.areas[int(random.integers(len(scene.areas)))]
        x_m, y_m = random.uniform(x0, x1), random.uniform(y0, y1)
        if _is_clear(scene, x_m, y_m):
            return x_m, y_m, random.uniform(-math.pi, math.pi)
    raise BslamError(f"scene of seed {scene.seed}: no place is {_CLEARANCE_M:g} m from every wall and thing")


def walk(scene: Scene, random: np.random.Generator, frames: int, hz: float = 5.0) -> Floats:
    """Poses (frames, 3) of a drive from place to place, hz of them a second."""
    if frames < 1 or not hz > 0.0:
        raise BslamError(f"frames {frames!r}, hz {hz!r}: allowed: 1 and up, above 0")
    x_m, y_m, theta_rad = free_pose(scene, random)
    speed_mps, turn_radps = random.uniform(*_SPEED_MPS), random.uniform(*_TURN_RADPS)
    goal = (x_m, y_m)
    poses = []
    for _ in range(frames):
        poses.append((x_m, y_m, theta_rad))
        if math.hypot(goal[0] - x_m, goal[1] - y_m) < _REACH_M + speed_mps / hz:
            goal = _next_goal(scene, random, (x_m, y_m))
        error_rad = math.remainder(math.atan2(goal[1] - y_m, goal[0] - x_m) - theta_rad, math.tau)
        most_rad = turn_radps / hz
        theta_rad += max(-most_rad, min(most_rad, error_rad + random.normal(0.0, 0.05)))
        if abs(error_rad) < _FACING_RAD:
            step_m = speed_mps / hz
            ahead = x_m + step_m * math.cos(theta_rad), y_m + step_m * math.sin(theta_rad)
            if _is_clear(scene, *ahead):
                x_m, y_m = ahead
            else:
                goal = _next_goal(scene, random, (x_m, y_m))
    return np.array(poses)


def _is_clear(scene: Scene, x_m: float, y_m: float) -> bool:
    return scene.arena.nearest_wall(x_m, y_m)[0] >= _CLEARANCE_M and all(
        math.hypot(one.x_m - x_m, one.y_m - y_m) >= _CLEARANCE_M + one.radius_m for one in scene.obstacles
    )


def _next_goal(scene: Scene, random: np.random.Generator, start: tuple[float, float]) -> tuple[float, float]:
    """A place that can be reached straight ahead; after too many draws any place."""
    goal = free_pose(scene, random)[:2]
    for _ in range(30):
        way = np.array([start]), np.array([goal])
        if scene.arena.path_clearance(*way)[0] >= _CLEARANCE_M:
            break
        goal = free_pose(scene, random)[:2]
    return goal
