"""Driving: from goal to goal on a planned route, unsteadily, and into a wall now and then."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import cycle, islice

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.world.arena import Point
from bslam.world.crowd import Crowd
from bslam.world.planner import RoutePlanner
from bslam.world.robot import Body
from bslam.world.scenario import Area, Scenario
from bslam.world.untold import NO_MISHAPS, Mishaps

_GOAL_DRAWS = 1000  # so many goals drawn in turn that the robot is at already: there is nowhere to go

# After a bump the robot turns on the spot, to either side, for a random time and a bit slower than it can.
_BUMP_TURN_S = (0.4, 1.8)
_BUMP_TURN_SHARE = 0.9

# What is within this angle of straight ahead is in the way; after so long the robot turns from it.
_AHEAD_RAD = 0.8
_PATIENCE_S = 2.0


@dataclass(frozen=True)
class Drive:
    """The true motion in the arena's frame. Row 0 of the poses is the start, row k of the rest step k + 1."""

    x_m: NDArray[np.float64]  # (steps + 1,)
    y_m: NDArray[np.float64]  # (steps + 1,)
    theta_rad: NDArray[np.float64]  # (steps + 1,)
    left_m: NDArray[np.float64]  # (steps,) how far the wheel truly rolled
    right_m: NDArray[np.float64]  # (steps,)
    stalled: NDArray[np.bool_]  # (steps,) a wall, or whoever was in the way, held the robot
    others_m: NDArray[np.float64]  # (steps + 1, movers, 2) where what moves about was


def drive(
    scenario: Scenario,
    random: np.random.Generator,
    wheel_jitter_m: NDArray[np.float64] | None = None,
    mishaps: Mishaps = NO_MISHAPS,
) -> Drive:
    """Drive all the steps. `wheel_jitter_m` (steps, 2) is added to the left and right wheel's travel.

    A recorded way is gone as it was recorded; whoever moves about gets out of its way.
    """
    if scenario.recorded:
        return _follow(scenario, random)
    step_s = scenario.step_us * 1e-6
    start = (scenario.start.x_m, scenario.start.y_m, scenario.start.heading_rad)
    radius_m, wheelbase_m = scenario.body.diameter_m / 2.0, scenario.body.wheelbase_m
    body = Body(scenario.arena, start, radius_m, wheelbase_m)
    driver = Driver(scenario, body, random)
    crowd = Crowd(scenario.movers, step_s, radius_m, random.spawn(1)[0])
    body.others = crowd.discs()
    others = [body.others]
    jitter_m = [(0.0, 0.0)] * scenario.steps if wheel_jitter_m is None else wheel_jitter_m.tolist()
    grips = [(1.0, 1.0)] * scenario.steps if mishaps.grip is None else mishaps.grip.tolist()
    poses, travels_m, stalls = [start], [], []
    for step, (jitters_m, (left_grip, right_grip)) in enumerate(zip(jitter_m, grips, strict=True)):
        left_jitter_m, right_jitter_m = (0.0, 0.0) if step in mishaps.off else jitters_m
        v_mps, omega_radps = (0.0, 0.0) if step in mishaps.off else driver.command()
        half_turn_m = 0.5 * omega_radps * wheelbase_m * step_s
        left_m = v_mps * step_s - half_turn_m + left_jitter_m
        right_m = v_mps * step_s + half_turn_m + right_jitter_m
        crowd.step(body.pose[:2])
        body.others = crowd.discs()
        others.append(body.others)
        rolled = body.roll(left_m * left_grip, right_m * right_grip)
        driver.feel(stalled=not rolled)
        if step in mishaps.carried:
            driver.carry(mishaps.carried[step])
        poses.append(body.pose)
        travels_m.append((left_m, right_m) if rolled else (0.0, 0.0))
        stalls.append(not rolled)
    x_m, y_m, theta_rad = np.array(poses).T
    left_m, right_m = np.array(travels_m).T
    others_m = np.array(others, dtype=np.float64).reshape(len(poses), -1, 3)[:, :, :2]
    return Drive(x_m, y_m, theta_rad, left_m, right_m, np.array(stalls, dtype=np.bool_), others_m)


class Driver:
    """Steers the body along planned routes to random goals; commands change no faster than the motors can.

    It heads for a point some cells ahead on the route, so it cuts corners, unsteadily, and hits door posts.
    """

    def __init__(self, scenario: Scenario, body: Body, random: np.random.Generator) -> None:
        self._name = scenario.name
        self._settings = settings = scenario.driving
        self._step_s = scenario.step_us * 1e-6
        self._body = body
        self._radius_m = scenario.body.diameter_m / 2.0
        noise_random, goal_random, self._bump_random = random.spawn(3)
        self._turn_noise_radps = iter(_turn_noise(scenario, noise_random))
        start = (scenario.start.x_m, scenario.start.y_m)
        self._planner = RoutePlanner(scenario.arena, settings.cell_m, settings.path_clearance_m, start)
        self._goals = (
            cycle(settings.waypoints)
            if settings.waypoints
            else _draw_goals(scenario, self._planner.places, goal_random)
        )
        self._waited_steps = 0  # for somebody in the way
        self._route: list[Point] = []  # what is left of it, from the cell that the robot is nearest to
        self._v_mps = self._omega_radps = 0.0
        self._bump_turn_radps = 0.0
        self._bump_turn_steps = 0  # what is left of the turn after a bump

    def command(self) -> tuple[float, float]:
        """Forward speed m/s and turning rate rad/s of the next step."""
        settings = self._settings
        v_mps, omega_radps = self._wanted(next(self._turn_noise_radps))
        v_step_mps = settings.acceleration_mps2 * self._step_s
        omega_step_radps = settings.turn_acceleration_radps2 * self._step_s
        self._v_mps += _clip(v_mps - self._v_mps, v_step_mps)
        self._omega_radps += _clip(omega_radps - self._omega_radps, omega_step_radps)
        return self._v_mps, self._omega_radps

    def feel(self, stalled: bool) -> None:
        """What the bumper says of the step just made. At a wall: stop, turn, look for another goal."""
        if stalled and self._bump_turn_steps == 0:
            self._v_mps = self._omega_radps = 0.0
            self._turn_away()

    def carry(self, moves: NDArray[np.float64]) -> None:
        """Somebody puts the robot elsewhere: by the first move (x, y m, turn rad) to where it could drive."""
        x_m, y_m, theta_rad = self._body.pose
        places = self._planner.places
        for dx_m, dy_m, turn_rad in moves.tolist():
            away_m = np.hypot(*(places - (x_m + dx_m, y_m + dy_m)).T)
            if away_m.min() <= self._settings.cell_m:
                new_x_m, new_y_m = places[away_m.argmin()].tolist()
                self._body.pose = (new_x_m, new_y_m, theta_rad + turn_rad)
                self._v_mps = self._omega_radps = 0.0
                self._route = []
                return

    def _turn_away(self) -> None:
        side = self._bump_random.choice((-1.0, 1.0))
        self._bump_turn_radps = side * _BUMP_TURN_SHARE * self._settings.turn_rate_radps
        self._bump_turn_steps = round(self._bump_random.uniform(*_BUMP_TURN_S) / self._step_s)
        self._route = []

    def _must_wait(self) -> bool:
        """Somebody is ahead, nearer than keep_off_m; whoever stays there is driven round after a while."""
        keep_off_m = self._settings.keep_off_m
        x_m, y_m, theta_rad = self._body.pose
        for other_x_m, other_y_m, radius_m in self._body.others if keep_off_m > 0.0 else []:
            aside_rad = math.remainder(math.atan2(other_y_m - y_m, other_x_m - x_m) - theta_rad, math.tau)
            near_m = math.hypot(other_x_m - x_m, other_y_m - y_m) - radius_m - self._radius_m
            if near_m < keep_off_m and abs(aside_rad) < _AHEAD_RAD:
                self._waited_steps += 1
                if self._waited_steps * self._step_s > _PATIENCE_S:
                    self._waited_steps = 0
                    self._turn_away()
                return True
        self._waited_steps = 0
        return False

    def _wanted(self, turn_noise_radps: float) -> tuple[float, float]:
        """The speeds that the motors should reach."""
        if self._bump_turn_steps > 0:
            self._bump_turn_steps -= 1
            return 0.0, self._bump_turn_radps
        settings = self._settings
        error_rad = self._heading_error()
        omega_radps = settings.heading_gain_per_s * error_rad + turn_noise_radps
        if abs(error_rad) > settings.turn_on_spot_rad:
            return 0.0, _clip(omega_radps, settings.turn_rate_radps)
        if self._must_wait():
            return 0.0, 0.0
        v_mps = settings.speed_mps * max(0.0, math.cos(error_rad))
        return v_mps, _clip(omega_radps, settings.turn_rate_radps)

    def _heading_error(self) -> float:
        """Angle from where the robot heads to the point ahead on its route."""
        x_m, y_m, theta_rad = self._body.pose
        self._follow((x_m, y_m))
        ahead_x_m, ahead_y_m = self._route[min(self._settings.cells_ahead, len(self._route) - 1)]
        return math.remainder(math.atan2(ahead_y_m - y_m, ahead_x_m - x_m) - theta_rad, math.tau)

    def _follow(self, place: Point) -> None:
        """Drop the cells that are passed; at the goal, plan the route to another."""
        if not self._route or math.dist(self._route[-1], place) <= self._settings.reach_m:
            self._route = self._plan(place)
        while len(self._route) > 1 and math.dist(self._route[1], place) < math.dist(self._route[0], place):
            del self._route[0]

    def _plan(self, place: Point) -> list[Point]:
        """The route to the next goal that is not where the robot is."""
        for goal in islice(self._goals, _GOAL_DRAWS):
            if math.dist(goal, place) > self._settings.reach_m:
                return self._planner.route(place, goal)
        raise BslamError(
            f"scenario {self._name}: no goal is farther than reach_m from {place!r}; "
            f"allowed: areas with places beyond reach_m, {self._settings.reach_m:g}"
        )


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


def _draw_goals(
    scenario: Scenario, places: NDArray[np.float64], random: np.random.Generator
) -> Iterator[Point]:
    """Endless random places: one in each area, the areas in a new order every time round."""
    (low_x, low_y), (high_x, high_y) = scenario.arena.low, scenario.arena.high
    areas = scenario.areas or (Area((low_x, high_x), (low_y, high_y)),)
    choices = [_places_in(scenario, area, places) for area in areas]
    while True:
        for index in random.permutation(len(areas)).tolist():
            x_m, y_m = random.choice(choices[index]).tolist()
            yield x_m, y_m


def _places_in(scenario: Scenario, area: Area, places: NDArray[np.float64]) -> NDArray[np.float64]:
    (low_x, high_x), (low_y, high_y) = area.x_m, area.y_m
    x_m, y_m = places.T
    inside = places[(x_m >= low_x) & (x_m <= high_x) & (y_m >= low_y) & (y_m <= high_y)]
    if len(inside) > 0:
        return inside
    raise BslamError(
        f"scenario {scenario.name}: no goal can be reached in the area x {area.x_m}, y {area.y_m}; "
        f"allowed: one with ways there that keep path_clearance_m, {scenario.driving.path_clearance_m:g}"
    )


def _follow(scenario: Scenario, random: np.random.Generator) -> Drive:
    """The recorded way: between its poses on a straight line, each step by the arc that leads there."""
    time_us, x_m, y_m, theta_rad = np.array(scenario.recorded).T
    at_us = time_us[0] + scenario.step_us * np.arange(scenario.steps + 1)
    x_m, y_m = np.interp(at_us, time_us, x_m), np.interp(at_us, time_us, y_m)
    theta_rad = np.interp(at_us, time_us, np.unwrap(theta_rad))
    start = scenario.start
    c, s = math.cos(start.heading_rad), math.sin(start.heading_rad)
    x_m, y_m = start.x_m + c * x_m - s * y_m, start.y_m + s * x_m + c * y_m
    theta_rad = theta_rad + start.heading_rad
    turn_rad = np.diff(theta_rad)
    course_rad = theta_rad[:-1] + 0.5 * turn_rad
    chord_m = np.cos(course_rad) * np.diff(x_m) + np.sin(course_rad) * np.diff(y_m)
    travelled_m = chord_m / np.sinc(turn_rad / (2.0 * np.pi))  # numpy's sinc(x) is sin(pi x) / (pi x)
    half_m = 0.5 * scenario.body.wheelbase_m * turn_rad
    crowd = Crowd(
        scenario.movers, scenario.step_us * 1e-6, scenario.body.diameter_m / 2.0, random.spawn(1)[0]
    )
    others = [crowd.discs()]
    for place in zip(x_m[1:].tolist(), y_m[1:].tolist(), strict=True):
        crowd.step(place)
        others.append(crowd.discs())
    others_m = np.array(others, dtype=np.float64).reshape(len(x_m), -1, 3)[:, :, :2]
    stalled = np.zeros(scenario.steps, dtype=np.bool_)
    return Drive(x_m, y_m, theta_rad, travelled_m - half_m, travelled_m + half_m, stalled, others_m)
