"""What is simulated: the arena, the robot, how it drives, and how well it senses; read from a TOML file.

Lengths in metres, angles in radians, positions in the arena's own frame. Every error names the file, the
key, the value and what is allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

from bslam.errors import BslamError
from bslam.log import (
    BEARING_SIGMA_RAD,
    GYRO_SIGMA_RADPS,
    RANGE_SIGMA_FLOOR_M,
    RANGE_SIGMA_FRACTION,
    RANGE_SIGMA_SCALE_M,
    SENSOR_YAW_RAD,
    SIGHTING_DELAY_US,
    WHEEL_NOISES,
    WHEEL_RADIUS_M,
    WHEEL_SPEED_SIGMA_MPS,
    WHEELBASE_M,
    read_truth,
)
from bslam.parsing.identities import BEACON_ID_MAX
from bslam.parsing.settings import (
    ANY,
    FIELD_OF_VIEW,
    NOT_NEGATIVE,
    POSITIVE,
    POSITIVE_OR_INF,
    SHARE,
    Rule,
    check_keys,
    find_toml,
    integer,
    load_toml,
    number,
    one_of,
    parse_table,
    setting,
    toml_names,
)
from bslam.rig import load_rig
from bslam.world.arena import Arena, Beacon, Box, Point, Wall
from bslam.world.crowd import LOOKS, Mover
from bslam.world.kinds import KINDS
from bslam.world.planner import grid_size

_SHORTEST_WALL_M = 0.001
_OUTSIDE_M = 0.05  # a beacon may stand out from the outer side of an outer wall
_CELLS_MAX = 1_000_000  # of the grid that routes are planned on
SCENARIOS = Path(__file__).resolve().parent.parent / "scenarios"

T = TypeVar("T")


def _is_point(value: object) -> bool:
    if not isinstance(value, list) or len(value) != 2:
        return False
    numbers = [one for one in value if isinstance(one, (int, float)) and not isinstance(one, bool)]
    return len(numbers) == 2 and all(math.isfinite(one) for one in numbers)


def _to_point(value: list[Any]) -> Point:
    return float(value[0]), float(value[1])


_TWO_NUMBERS = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_POINT = Rule("[x, y], two finite numbers", list, _is_point, _to_point, _TWO_NUMBERS)
_INTERVAL = Rule(
    "[low, high], two numbers, low < high",
    list,
    lambda v: _is_point(v) and v[0] < v[1],
    _to_point,
    _TWO_NUMBERS,
)
_POINTS = Rule(
    "[[x, y], ...], points, at least one",
    list,
    lambda v: len(v) > 0 and all(map(_is_point, v)),
    lambda v: tuple(map(_to_point, v)),
    {"type": "array", "items": _POINT.schema, "minItems": 1},
)
_PATH = Rule(
    "[[x, y], ...], two points or more, each apart from the one before",
    list,
    lambda v: len(v) > 1 and all(map(_is_point, v)) and all(a != b for a, b in pairwise(v)),
    lambda v: tuple(map(_to_point, v)),
    {"type": "array", "items": _POINT.schema, "minItems": 2},
)
_SIZE = Rule(
    "[width, depth], two numbers from 0.01 to 100",
    list,
    lambda v: _is_point(v) and all(0.01 <= one <= 100.0 for one in v),
    _to_point,
    _POINT.schema,
)
_TRUE_OR_FALSE = Rule("true or false", bool)
_DURATION = Rule(
    "[shortest, longest], two numbers, 0 < shortest <= longest",
    list,
    lambda v: _is_point(v) and 0 < v[0] <= v[1],
    _to_point,
    _TWO_NUMBERS,
)
_SCALE = number(0.5, 2.0)
_DOORS = Rule(
    "[[from, to], ...], stretches along the wall in m, in order, from < to",
    list,
    lambda v: all(_is_point(gap) and gap[0] < gap[1] for gap in v),
    lambda v: tuple(_to_point(gap) for gap in v),
    {"type": "array", "items": _POINT.schema},
)


@dataclass(frozen=True)
class Start:
    x_m: float = setting(ANY)
    y_m: float = setting(ANY)
    heading_rad: float = setting(ANY)


@dataclass(frozen=True)
class BodySettings:
    """A round body, its two wheels on one line through the middle."""

    diameter_m: float = setting(POSITIVE)
    wheelbase_m: float = setting(WHEELBASE_M)


@dataclass(frozen=True)
class Area:
    """A rectangle that goals are drawn from, a room for instance."""

    x_m: tuple[float, float] = setting(_INTERVAL)
    y_m: tuple[float, float] = setting(_INTERVAL)


@dataclass(frozen=True)
class Driving:
    """How the robot goes from goal to goal: on routes over a grid of square cells.

    It heads for the point of the route that is cells_ahead cells on. Its speed is speed_mps times the cosine
    of the heading error, its turning rate is heading_gain_per_s times the error plus noise: a Gauss-Markov
    process of standard deviation turn_noise_radps and correlation time turn_noise_time_s. With an error
    above turn_on_spot_rad it only turns.
    """

    speed_mps: float = setting(POSITIVE)
    acceleration_mps2: float = setting(POSITIVE)
    turn_rate_radps: float = setting(POSITIVE)
    turn_acceleration_radps2: float = setting(POSITIVE)
    heading_gain_per_s: float = setting(POSITIVE)
    turn_noise_radps: float = setting(NOT_NEGATIVE)
    turn_noise_time_s: float = setting(POSITIVE)
    turn_on_spot_rad: float = setting(POSITIVE)
    cell_m: float = setting(number(0.01, 10.0))
    path_clearance_m: float = setting(POSITIVE)  # from the middle of a cell on the route to any wall
    cells_ahead: int = setting(integer(1, 1000))
    reach_m: float = setting(POSITIVE)  # so near to the goal, the next one is headed for
    waypoints: tuple[Point, ...] = setting(_POINTS, ())  # goals, in turn and over again; none: random ones
    keep_off_m: float = setting(NOT_NEGATIVE, 0.0)  # so near to somebody ahead it waits; 0: it runs into them
    recorded: str | None = setting(Rule("the path of a truth.csv", str), None)  # drive as recorded there


@dataclass(frozen=True)
class Wheels:
    """`sigma_mps` is the sd of each wheel's speed, each step: of the reading or of the motion, by `noise`.

    `draw`: above 0 the noise is drawn anew for the same seed, so that with "speedometer" path and sightings
    stay. The filter takes the noise for white.
    """

    sigma_mps: float = setting(WHEEL_SPEED_SIGMA_MPS)
    noise: str = setting(one_of(*WHEEL_NOISES), "speedometer")
    draw: int = setting(integer(0, 1_000_000), 0)
    noise_time_s: float = setting(NOT_NEGATIVE, 0.0)  # correlation time of the noise; 0: it is white


@dataclass(frozen=True)
class Encoders:
    """Counters of ticks on the two wheels; they roll over at 2^counter_bits."""

    left_radius_m: float = setting(WHEEL_RADIUS_M)
    right_radius_m: float = setting(WHEEL_RADIUS_M)
    ticks_per_revolution: int = setting(integer(1, 10_000_000))
    counter_bits: int = setting(integer(2, 32))


@dataclass(frozen=True)
class Gyro:
    """Says how fast the robot turns, in the mean over each step; in a drive it is off by a constant bias."""

    sigma_radps: float = setting(GYRO_SIGMA_RADPS)  # each reading, independent
    bias_sigma_radps: float = setting(number(0.0, 100.0), 0.0)  # of the bias, which the seed draws


@dataclass(frozen=True)
class Sensor:
    """What sees beacons. The sd of a range r is sqrt(floor^2 + (fraction r)^2 + (r^2 / scale)^2)."""

    field_of_view_rad: float = setting(FIELD_OF_VIEW)
    bearing_sigma_rad: float = setting(BEARING_SIGMA_RAD)
    range_sigma_fraction: float = setting(RANGE_SIGMA_FRACTION)
    range_sigma_scale_m: float = setting(RANGE_SIGMA_SCALE_M)
    range_sigma_floor_m: float = setting(RANGE_SIGMA_FLOOR_M, 0.0)
    range_max_m: float = setting(POSITIVE_OR_INF, math.inf)
    x_m: float = setting(ANY, 0.0)  # where it sits on the robot
    y_m: float = setting(ANY, 0.0)
    yaw_rad: float = setting(SENSOR_YAW_RAD, 0.0)
    delay_us: int = setting(SIGHTING_DELAY_US, 0)  # the stamp of a sighting is so much later than the sight
    outlier_share: float = setting(SHARE, 0.0)  # share of sightings with any direction and range
    bearing_outlier_share: float = setting(SHARE, 0.0)  # share with any direction, and the right range
    miss_share: float = setting(SHARE, 0.0)  # share of what is in view that is not reported
    noise_time_s: float = setting(NOT_NEGATIVE, 0.0)  # correlation time of a beacon's noise; 0: it is white


@dataclass(frozen=True)
class Slips:
    """The left wheel, the right one or both roll, and the robot does not follow.

    As with gaps, one lies somewhere in each of `count` equal parts of the middle half of the drive.
    """

    count: int = setting(integer(1, 1000))
    lasts_s: tuple[float, float] = setting(_DURATION, (0.5, 1.5))  # drawn anew each time
    ratio: float = setting(SHARE, 1.0)  # share of a wheel's roll that moves nothing


@dataclass(frozen=True)
class Gaps:
    """Stretches of which no odometry is recorded; the travel of a counter that goes on is not lost.

    The robot drives on, or it may stand and be carried, to a place that it could drive to.
    """

    count: int = setting(integer(1, 1000))
    lasts_s: tuple[float, float] = setting(_DURATION)  # drawn anew each time
    blind: bool = setting(_TRUE_OR_FALSE, False)  # no sightings either
    carried_sd_m: float = setting(number(0.0, 100.0), 0.0)  # in x and in y
    carried_sd_rad: float = setting(number(0.0, 100.0), 0.0)

    @property
    def carries(self) -> bool:
        """Somebody moves the robot."""
        return self.carried_sd_m > 0.0 or self.carried_sd_rad > 0.0


@dataclass(frozen=True)
class Mismatch:
    """What truly is, against what the filter is told in the other tables.

    Scales of wheels are the true value over the told one; what is no scale is added to the told value.
    """

    range_scale: float = setting(_SCALE, 1.0)  # distances are measured so many times too long
    range_scale_sd: float = setting(number(0.0, 0.5), 0.0)  # each beacon's by a factor of its own, too
    sensor_x_m: float = setting(ANY, 0.0)
    sensor_y_m: float = setting(ANY, 0.0)
    sensor_yaw_rad: float = setting(SENSOR_YAW_RAD, 0.0)
    delay_us: int = setting(integer(-10_000_000, 10_000_000), 0)
    left_radius_scale: float = setting(_SCALE, 1.0)
    right_radius_scale: float = setting(_SCALE, 1.0)
    wheelbase_scale: float = setting(_SCALE, 1.0)


@dataclass(frozen=True)
class Scenario:
    """Everything but the seed.

    `areas` are visited in turn; without any, goals are drawn from the whole arena. Without `encoders` the
    odometry is the wheels' travel itself. `recorded` has rows of time_us, x_m, y_m, theta_rad from the start
    pose: the robot goes that way, whatever `driving` says. `rig` names the cameras, if it has any of its own.
    """

    name: str
    description: str
    steps: int
    step_us: int
    arena: Arena
    areas: tuple[Area, ...]
    start: Start
    body: BodySettings
    driving: Driving
    wheels: Wheels
    sensor: Sensor
    encoders: Encoders | None = None
    gyro: Gyro | None = None
    slips: Slips | None = None
    gaps: Gaps | None = None
    mismatch: Mismatch = Mismatch()
    movers: tuple[Mover, ...] = ()
    recorded: tuple[tuple[float, float, float, float], ...] = ()
    rig: str | None = None


@dataclass(frozen=True)
class _BoxTable:
    """Clutter that stands."""

    at: tuple[float, float] = setting(_POINT)  # its middle
    size_m: tuple[float, float] = setting(_SIZE)
    turn_rad: float = setting(ANY, 0.0)
    hides: bool = setting(_TRUE_OR_FALSE, True)  # higher than the sensor


@dataclass(frozen=True)
class _MoverTable:
    """Clutter that moves: people, carts. They go to and fro on a path and wait for the robot."""

    path: tuple[Point, ...] = setting(_PATH)
    speed_mps: float = setting(POSITIVE, 0.8)
    radius_m: float = setting(number(0.01, 10.0), 0.25)
    pause_s: float = setting(NOT_NEGATIVE, 0.0)  # at both ends of the path
    hides: bool = setting(_TRUE_OR_FALSE, True)
    looks: str | None = setting(one_of(*LOOKS), None)  # before a camera; left out: who hides is a person

    def mover(self) -> Mover:
        """What it stands for."""
        looks = self.looks or ("person" if self.hides else "box")
        return Mover(self.path, self.speed_mps, self.radius_m, self.pause_s, self.hides, looks)


@dataclass(frozen=True)
class _WallTable:
    start: tuple[float, float] = setting(_POINT)
    end: tuple[float, float] = setting(_POINT)
    doors: tuple[Point, ...] = setting(_DOORS, ())


@dataclass(frozen=True)
class _BeaconTable:
    id: int = setting(integer(0, BEACON_ID_MAX))
    at: tuple[float, float] = setting(_POINT)
    looks_like: int | None = setting(integer(0, BEACON_ID_MAX), None)
    kind: str | None = setting(one_of(*KINDS), None)  # before a camera; left out: whatever fits the place
    width_m: float | None = setting(number(0.05, 10.0), None)
    texture: int | None = setting(integer(0, 1_000_000), None)  # one kind and texture: one look


TOP_RULES = {
    "description": Rule("text", str),
    "steps": integer(1, 10_000_000),
    "step_us": integer(1, 10_000_000),
    "rig": Rule("the name of a rig, or a path that ends in .toml", str),
}
TABLES: dict[str, type] = {
    "start": Start,
    "body": BodySettings,
    "driving": Driving,
    "wheels": Wheels,
    "encoders": Encoders,
    "gyro": Gyro,
    "sensor": Sensor,
    "slips": Slips,
    "gaps": Gaps,
    "mismatch": Mismatch,
}
OPTIONAL = (
    *("encoders", "gyro", "slips", "gaps", "mismatch"),
    *("areas", "beacons", "boxes", "movers", "rig"),
)
LISTS: dict[str, type] = {
    "walls": _WallTable,
    "beacons": _BeaconTable,
    "areas": Area,
    "boxes": _BoxTable,
    "movers": _MoverTable,
}


def scenario_names() -> list[str]:
    """Names of the scenarios that come with the package."""
    return toml_names(SCENARIOS)


def load_scenario(name_or_path: str | Path) -> Scenario:
    """A scenario by its name or from a path that ends in .toml; BslamError if it is missing or wrong."""
    if Path(name_or_path).is_dir():
        logs = "a log is for bslam replay csv, compare or check"
        raise BslamError(f"scenario '{name_or_path}': is a folder; allowed: a name, or a .toml; {logs}")
    path = find_toml("scenario", name_or_path, SCENARIOS)
    return _parse_scenario(load_toml(path), path)


def _parse_scenario(document: Mapping[str, Any], path: Path) -> Scenario:
    known = {**TOP_RULES, **TABLES, **LISTS}
    check_keys(document, known, str(path))
    for key in known:
        if key not in document and key not in OPTIONAL:
            raise BslamError(f"{path}, key {key}: is missing; allowed: {_allowed(key)}")
    top: dict[str, Any] = {
        key: rule.convert(document[key], f"{path}, key {key}")
        for key, rule in TOP_RULES.items()
        if key in document
    }
    tables: dict[str, Any] = {
        key: _parse_one(cls, document[key], f"{path}, [{key}]")
        for key, cls in TABLES.items()
        if key in document
    }
    lists: dict[str, Any] = {
        key: _parse_list(cls, document.get(key, []), path, key) for key, cls in LISTS.items()
    }
    if "rig" in top:
        top["rig"] = _find_rig(top["rig"], path)
    scenario = Scenario(
        name=path.stem,
        arena=Arena(
            walls=_cut_doors(lists["walls"], path),
            beacons=tuple(
                Beacon(one.id, one.at, one.looks_like, one.kind, one.width_m, one.texture)
                for one in lists["beacons"]
            ),
            boxes=tuple(Box(one.at, one.size_m, one.turn_rad, one.hides) for one in lists["boxes"]),
        ),
        movers=tuple(one.mover() for one in lists["movers"]),
        recorded=_read_recorded(tables["driving"].recorded, path, top["steps"] * top["step_us"]),
        areas=tuple(lists["areas"]),
        **top,
        **tables,
    )
    check_together(scenario, str(path))
    return scenario


def _find_rig(name: str, path: Path) -> str:
    """The rig's name, or its path from the scenario's folder. Raises BslamError if there is none."""
    found = str(path.parent / name) if name.endswith(".toml") else name
    try:
        load_rig(found)
    except BslamError as error:
        raise BslamError(f"{path}, key rig: {error}") from error
    return found


def _read_recorded(
    name: str | None, path: Path, duration_us: int
) -> tuple[tuple[float, float, float, float], ...]:
    """The rows of the true path to follow, beside the scenario's file."""
    if name is None:
        return ()
    where = f"{path}, [driving], key recorded"
    file = path.parent / name
    if not file.is_file():
        raise BslamError(
            f"{where}: there is no file {file}; allowed: a truth.csv, from the scenario's folder"
        )
    truth = read_truth(file, [])
    if not math.isfinite(sum(truth.theta_rad)):
        raise BslamError(f"{where}: {file} has rows without theta_rad; allowed: a heading in each")
    rows = zip(
        truth.time_us.tolist(), truth.x_m.tolist(), truth.y_m.tolist(), truth.theta_rad.tolist(), strict=True
    )
    recorded = tuple(rows)
    span_us = recorded[-1][0] - recorded[0][0]
    if span_us < duration_us:
        allowed = f"steps times step_us up to its {span_us} us"
        raise BslamError(
            f"{where}: {name!r} is shorter than the {duration_us} us of the steps; allowed: {allowed}"
        )
    return recorded


def _allowed(key: str) -> str:
    if key in TOP_RULES:
        return TOP_RULES[key].allowed
    if key in TABLES:
        return f"a table [{key}]"
    return "a list of tables, at least one"


def _parse_one(cls: type[T], table: object, where: str) -> T:
    if not isinstance(table, Mapping):
        names = ", ".join(one.name for one in fields(cls))  # type: ignore[arg-type]
        raise BslamError(f"{where}: {table!r} is not allowed; allowed: a table of {names}")
    return parse_table(cls, table, where)


def _parse_list(cls: type[T], tables: object, path: Path, key: str) -> list[T]:
    if not isinstance(tables, list) or (key == "walls" and not tables):
        raise BslamError(f"{path}, key {key}: {tables!r} is not allowed; allowed: {_allowed(key)}")
    return [_parse_one(cls, table, f"{path}, {key}[{index}]") for index, table in enumerate(tables)]


def _cut_doors(tables: list[_WallTable], path: Path) -> tuple[Wall, ...]:
    """The solid pieces of walls that have doors."""
    walls: list[Wall] = []
    for index, table in enumerate(tables):
        (x0, y0), (x1, y1) = table.start, table.end
        length_m = math.hypot(x1 - x0, y1 - y0)
        if not _SHORTEST_WALL_M <= length_m < math.inf:
            allowed = f"{_SHORTEST_WALL_M:g} m or more from the start"
            raise BslamError(
                f"{path}, walls[{index}], key end: {table.end!r} is not allowed; allowed: {allowed}"
            )
        cuts_m = [0.0, *(edge for door in table.doors for edge in door), length_m]
        if cuts_m != sorted(cuts_m):
            allowed = f"doors in order, without overlap, within 0 to {length_m:g}"
            raise BslamError(
                f"{path}, walls[{index}], key doors: {table.doors!r} is not allowed; allowed: {allowed}"
            )
        at = [(x0 + (x1 - x0) * cut_m / length_m, y0 + (y1 - y0) * cut_m / length_m) for cut_m in cuts_m]
        pieces = [Wall(a, b) for a, b in zip(at[::2], at[1::2], strict=True)]
        walls += [piece for piece in pieces if math.dist(piece.start, piece.end) >= _SHORTEST_WALL_M]
    return tuple(walls)


def _check_inside(scenario: Scenario, require: Callable[[bool, str, object, str], None]) -> None:
    """Whatever has a place has it within the walls' bounding box."""
    arena, start = scenario.arena, scenario.start
    (low_x, low_y), (high_x, high_y) = arena.low, arena.high
    allowed = f"within the walls, x {low_x:g} to {high_x:g}, y {low_y:g} to {high_y:g}"

    def check(key: str, *points: Point) -> None:
        for x_m, y_m in points:
            inside = (
                low_x - _OUTSIDE_M <= x_m <= high_x + _OUTSIDE_M
                and low_y - _OUTSIDE_M <= y_m <= high_y + _OUTSIDE_M
            )
            require(inside, key, [x_m, y_m], allowed)

    check("[start], keys x_m, y_m", (start.x_m, start.y_m))
    for index, beacon in enumerate(arena.beacons):
        check(f"beacons[{index}], key at", beacon.at)
    for index, box in enumerate(arena.boxes):
        check(f"boxes[{index}], key at", box.at)
        c, s = math.cos(box.turn_rad), math.sin(box.turn_rad)
        dx, dy = start.x_m - box.at[0], start.y_m - box.at[1]
        in_box = abs(c * dx + s * dy) <= box.size_m[0] / 2 and abs(c * dy - s * dx) <= box.size_m[1] / 2
        place = [start.x_m, start.y_m]
        allowed_start = f"a place outside boxes[{index}]"
        require(not in_box, "[start], keys x_m, y_m", place, allowed_start)
    for index, mover in enumerate(scenario.movers):
        check(f"movers[{index}], key path", *mover.path)
        upright = mover.hides or mover.looks != "person"
        require(upright, f"movers[{index}], key looks", mover.looks, "'box' where hides = false")
    check("[driving], key waypoints", *scenario.driving.waypoints)


def _check_untold(scenario: Scenario, require: Callable[[bool, str, object, str], None]) -> None:
    """What the filter is not told is possible, too."""
    off, sensor, radius_m = scenario.mismatch, scenario.sensor, scenario.body.diameter_m / 2.0
    on_body = math.hypot(sensor.x_m + off.sensor_x_m, sensor.y_m + off.sensor_y_m) <= radius_m
    place = (off.sensor_x_m, off.sensor_y_m)
    allowed = "what added to [sensor] is a place on the robot's body"
    require(on_body, "[mismatch], keys sensor_x_m, sensor_y_m", place, allowed)
    allowed = "what added to that of [sensor] is not negative"
    require(sensor.delay_us + off.delay_us >= 0, "[mismatch], key delay_us", off.delay_us, allowed)
    room_us = scenario.steps * scenario.step_us / 4  # half of the part of the drive in which they lie
    for name, one in (("slips", scenario.slips), ("gaps", scenario.gaps)):
        if one is not None:
            fits = one.count * one.lasts_s[1] * 1e6 <= room_us
            allowed = f"{room_us * 1e-6:g} s at most in all, a quarter of the drive"
            require(fits, f"[{name}], keys count, lasts_s", (one.count, *one.lasts_s), allowed)
    allowed = "not where [driving] has recorded, since it changes the way"
    moved = scenario.gaps is not None and scenario.gaps.carries
    require(scenario.slips is None or not scenario.recorded, "[slips]", scenario.slips, allowed)
    require(not moved or not scenario.recorded, "[gaps], keys carried_sd_m, carried_sd_rad", True, allowed)


def check_together(scenario: Scenario, where: str) -> None:
    """What no value shows by itself. Raises BslamError that starts with `where`."""
    radius_m = scenario.body.diameter_m / 2.0
    driving, sensor, start = scenario.driving, scenario.sensor, scenario.start

    def require(good: bool, key: str, value: object, allowed: str) -> None:
        if not good:
            raise BslamError(f"{where}, {key}: {value!r} is not allowed; allowed: {allowed}")

    require(bool(scenario.arena.walls), "key walls", scenario.arena.walls, "some wall left between the doors")
    seen: set[int] = set()
    for index, beacon in enumerate(scenario.arena.beacons):
        require(
            beacon.beacon_id not in seen, f"beacons[{index}], key id", beacon.beacon_id, "an id of its own"
        )
        seen.add(beacon.beacon_id)
    own_looks = {beacon.beacon_id for beacon in scenario.arena.beacons if beacon.looks_like is None}
    for index, beacon in enumerate(scenario.arena.beacons):
        like = beacon.looks_like
        allowed = "the id of a beacon with looks of its own"
        require(like is None or like in own_looks, f"beacons[{index}], key looks_like", like, allowed)
    to_wall_m = scenario.arena.nearest_wall(start.x_m, start.y_m)[0]
    place = (start.x_m, start.y_m)
    free = f"a place {radius_m:g} m from every wall and box"
    require(to_wall_m >= radius_m, "[start], keys x_m, y_m", place, free)
    _check_inside(scenario, require)
    mount = (sensor.x_m, sensor.y_m)
    require(math.hypot(*mount) <= radius_m, "[sensor], keys x_m, y_m", mount, "a place on the robot's body")
    _check_untold(scenario, require)
    path_m, cell_m = driving.path_clearance_m, driving.cell_m
    require(
        path_m > radius_m, "[driving], key path_clearance_m", path_m, f"above the body's radius, {radius_m:g}"
    )
    # Cells wider than that could lie on two sides of a wall, next to each other.
    require(cell_m <= path_m, "[driving], key cell_m", cell_m, f"at most path_clearance_m, {path_m:g}")
    cells = math.prod(grid_size(scenario.arena, cell_m))
    require(cells <= _CELLS_MAX, "[driving], key cell_m", cell_m, f"{_CELLS_MAX} cells at most, not {cells}")
