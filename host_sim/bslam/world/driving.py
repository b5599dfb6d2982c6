"""Driving: from goal to goal around the walls, unsteadily, and into a wall now and then."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.world.arena import Point
from bslam.world.planner import RoutePlanner
from bslam.world.robot import Body
from bslam.world.scenario import Area, Scenario

_GOAL_DRAWS = 1000  # so many draws without a place that is free and can be reached: there is none
_STALLS_PER_GOAL = 6  # so many on the way, and the goal is given up

# After a stall the robot turns on the spot until it faces its way so well, and first drives to a point a bit
# farther from the wall than a path must be.
_FACING_RAD = 0.5
_STEP_OFF_M = 0.05
_STEP_OFF_REACH_M = 0.03

_FORGET_STALL = 0.25  # seconds of pushing forgotten in a second of rolling: jittering wheels roll on and off


@dataclass(frozen=True)
class Drive:
    """The true motion in the arena's frame. Row 0 of the poses is the start, row k of the rest step k + 1."""

    x_m: NDArray[np.float64]  # (steps + 1,)
    y_m: NDArray[np.float64]  # (steps + 1,)
    theta_rad: NDArray[np.float64]  # (steps + 1,)
    left_m: NDArray[np.float64]  # (steps,) how far the wheel truly rolled
    right_m: NDArray[np.float64]  # (steps,)
    stalled: NDArray[np.bool_]  # (steps,) a wall held the robot


def drive(
    scenario: Scenario, random: np.random.Generator, wheel_jitter_m: NDArray[np.float64] | None = None
) -> Drive:
    """Drive all the steps. `wheel_jitter_m` (steps, 2) is added to the left and right wheel's travel."""
    step_s = scenario.step_us * 1e-6
    start = (scenario.start.x_m, scenario.start.y_m, scenario.start.heading_rad)
    radius_m, wheelbase_m = scenario.body.diameter_m / 2.0, scenario.body.wheelbase_m
    body = Body(scenario.arena, start, radius_m, wheelbase_m)
    driver = Driver(scenario, body, random)
    jitter_m = [(0.0, 0.0)] * scenario.steps if wheel_jitter_m is None else wheel_jitter_m.tolist()
    poses, travels_m, stalls = [start], [], []
    for left_jitter_m, right_jitter_m in jitter_m:
        v_mps, omega_radps = driver.command()
        half_turn_m = 0.5 * omega_radps * wheelbase_m * step_s
        left_m = v_mps * step_s - half_turn_m + left_jitter_m
        right_m = v_mps * step_s + half_turn_m + right_jitter_m
        rolled = body.roll(left_m, right_m)
        driver.feel(stalled=not rolled)
        poses.append(body.pose)
        travels_m.append((left_m, right_m) if rolled else (0.0, 0.0))
        stalls.append(not rolled)
    x_m, y_m, theta_rad = np.array(poses).T
    left_m, right_m = np.array(travels_m).T
    return Drive(x_m, y_m, theta_rad, left_m, right_m, np.array(stalls, dtype=np.bool_))


class Driver:
    """Steers the body along planned routes to random goals; commands change no faster than the motors can."""

    def __init__(self, scenario: Scenario, body: Body, random: np.random.Generator) -> None:
        self._name = scenario.name
        self._settings = scenario.driving
        self._step_s = scenario.step_us * 1e-6
        self._body = body
        noise_random, goal_random = random.spawn(2)
        self._turn_noise_radps = iter(_turn_noise(scenario, noise_random))
        self._goals = _draw_goals(scenario, goal_random)
        self._planner = RoutePlanner(scenario.arena, scenario.driving.path_clearance_m)
        self._route: list[tuple[Point, float]] = []  # the points ahead, and how near is near enough
        self._v_mps = self._omega_radps = 0.0
        self._pushing_s = 0.0
        self._stalls = 0  # on the way to this goal
        self._facing = False  # only turning, to face the next point

    def command(self) -> tuple[float, float]:
        """Forward speed m/s and turning rate rad/s of the next step."""
        settings = self._settings
        error_rad = self._heading_error()
        self._facing = self._facing and abs(error_rad) > _FACING_RAD
        v_mps = 0.0 if self._facing else settings.speed_mps * max(0.0, math.cos(error_rad))
        omega_radps = settings.heading_gain_per_s * error_rad + next(self._turn_noise_radps)
        omega_radps = _clip(omega_radps, settings.turn_rate_radps)
        v_step_mps = settings.acceleration_mps2 * self._step_s
        omega_step_radps = settings.turn_acceleration_radps2 * self._step_s
        self._v_mps += _clip(v_mps - self._v_mps, v_step_mps)
        self._omega_radps += _clip(omega_radps - self._omega_radps, omega_step_radps)
        return self._v_mps, self._omega_radps

    def feel(self, stalled: bool) -> None:
        """What the bumper says of the step just made: after enough pushing, stop and look for a way."""
        change_s = self._step_s if stalled else -_FORGET_STALL * self._step_s
        self._pushing_s = max(0.0, self._pushing_s + change_s)
        if stalled and self._pushing_s >= self._settings.stall_time_s:
            self._v_mps = self._omega_radps = self._pushing_s = 0.0
            self._facing = True
            self._stalls += 1
            self._route = self._plan(self._route[-1][0]) if self._stalls < _STALLS_PER_GOAL else []

    def _heading_error(self) -> float:
        """Angle from where the robot heads to where it should: to the next point, but away from walls."""
        x_m, y_m, theta_rad = self._body.pose
        target_x_m, target_y_m = self._next_point(x_m, y_m)
        to_x, to_y = target_x_m - x_m, target_y_m - y_m
        wall = self._body.feeler.nearest_within(x_m, y_m, self._settings.avoid_clearance_m)
        if wall is not None:
            distance_m, away_x, away_y = wall
            push = (1.0 - distance_m / self._settings.avoid_clearance_m) * math.hypot(to_x, to_y)
            to_x, to_y = to_x + push * away_x, to_y + push * away_y
        return math.remainder(math.atan2(to_y, to_x) - theta_rad, math.tau)

    def _next_point(self, x_m: float, y_m: float) -> Point:
        while True:
            for passed, (point, reach_m) in enumerate(self._route):
                if math.hypot(point[0] - x_m, point[1] - y_m) > reach_m:
                    del self._route[:passed]
                    return point
            self._route = self._plan_new()

    def _plan_new(self) -> list[tuple[Point, float]]:
        """The route to the next goal that can be reached."""
        for goal in islice(self._goals, _GOAL_DRAWS):
            x_m, y_m, _ = self._body.pose
            if math.hypot(goal[0] - x_m, goal[1] - y_m) <= self._settings.reach_m:
                continue
            route = self._plan(goal)
            if route:
                self._stalls = 0
                return route
        raise BslamError(
            f"scenario {self._name}: no goal can be reached from {self._body.pose[:2]!r}; "
            f"allowed: an arena with ways that keep path_clearance_m, {self._settings.path_clearance_m:g}"
        )

    def _plan(self, goal: Point) -> list[tuple[Point, float]]:
        """The points to pass on the way to the goal, at a wall first one away from it; empty: no way."""
        x_m, y_m, _ = self._body.pose
        settings = self._settings
        if self._body.feeler.nearest_within(x_m, y_m, settings.path_clearance_m) is None:
            return [(point, settings.reach_m) for point in self._planner.route((x_m, y_m), goal)]
        free = self._planner.step_off((x_m, y_m), _STEP_OFF_M)
        way = [(point, settings.reach_m) for point in self._planner.route(free, goal)]
        return [(free, _STEP_OFF_REACH_M), *way] if way else []


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def _turn_noise(scenario: Scenario, random: np.random.Generator) -> list[float]:
    """A Gauss-Markov process, rad/s, one value a step."""
    settings = scenario.driving
    keep = math.exp(-scenario.step_us * 1e-6 / settings.turn_noise_time_s)
    fresh_radps = settings.turn_noise_radps * math.sqrt(1.0 - keep * keep)
    noise_radps, values = 0.0, []
    for draw in random.standard_normal(scenario.steps).tolist():
        noise_radps = keep * noise_radps + fresh_radps * draw
        values.append(noise_radps)
    return values


def _draw_goals(scenario: Scenario, random: np.random.Generator) -> Iterator[Point]:
    """Endless random places: one in each area, the areas in a new order every time round."""
    (low_x, low_y), (high_x, high_y) = scenario.arena.low, scenario.arena.high
    areas = scenario.areas or (Area((low_x, high_x), (low_y, high_y)),)
    while True:
        for index in random.permutation(len(areas)).tolist():
            yield _draw_place(scenario, areas[index], random)


def _draw_place(scenario: Scenario, area: Area, random: np.random.Generator) -> Point:
    """A random place in the area that is far enough from all walls."""
    clearance_m = scenario.driving.goal_clearance_m
    for _ in range(_GOAL_DRAWS):
        x_m, y_m = random.uniform(*area.x_m), random.uniform(*area.y_m)
        if scenario.arena.nearest_wall(x_m, y_m)[0] >= clearance_m:
            return x_m, y_m
    raise BslamError(
        f"scenario {scenario.name}: no free place in the area x {area.x_m}, y {area.y_m}; "
        f"allowed: one with places that are goal_clearance_m, {clearance_m:g}, from every wall"
    )
