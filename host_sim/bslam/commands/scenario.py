"""`bslam scenario`: begin, check and look at scenario files."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from bslam.errors import BslamError
from bslam.log import Beacons
from bslam.runs.output import write_atomically
from bslam.view.style import png
from bslam.view.world import World, draw_world
from bslam.world.scenario import SCENARIOS, Scenario, load_scenario, scenario_names
from bslam.world.schema import scenario_schema
from bslam.world.simulate import true_drive

SUMMARY = "begin, check and look at scenario files: rooms, beacons, clutter, the robot"
EXAMPLES = """examples:
  bslam scenario new my_room.toml
  bslam scenario new lab.toml --from busy_hall
  bslam scenario check my_room.toml lab.toml
  bslam scenario show my_room.toml --out out/scenario

new copies a scenario to start from (--from, else paper_room) and puts scenario.schema.json beside it, by
which editors complete and check keys. check names what is wrong: file, key, value, and what is allowed; a
drive of 20 s must be possible, too. show draws NAME.png with a drive of seed 0. docs/SCENARIOS.md has every
key."""
SCHEMA_FILE = "scenario.schema.json"
_CHECK_S = 20.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("what", choices=("new", "check", "show", "schema"), help="what to do")
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO", help="names, or paths of TOML files")
    parser.add_argument(
        "--from", dest="source", default="paper_room", metavar="SCENARIO", help="new: what to start from"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out") / "scenario", metavar="DIR", help="show: where pictures go"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    if arguments.what == "schema":
        print(schema_text(), end="")
        return 0
    if not arguments.scenarios:
        raise BslamError(f"{arguments.what}: no scenario; allowed: {', '.join(scenario_names())}, or paths")
    for name in arguments.scenarios:
        if arguments.what == "new":
            _new(Path(name), arguments.source)
        elif arguments.what == "check":
            print(_describe(_checked(name)))
        else:
            _show(_checked(name), arguments.out)
    return 0


def schema_text() -> str:
    """scenario.schema.json."""
    return json.dumps(scenario_schema(), indent=1) + "\n"


def _new(path: Path, source: str) -> None:
    if path.suffix != ".toml":
        raise BslamError(f"new {path}: allowed: a path that ends in .toml")
    if path.exists():
        raise BslamError(f"new {path}: is there already; allowed: a new name")
    load_scenario(source)
    original = Path(source) if source.endswith(".toml") else SCENARIOS / f"{source}.toml"
    text = original.read_text(encoding="utf-8-sig")
    lines = [line for line in text.splitlines() if not line.startswith("#:schema")]
    write_atomically(path, f"#:schema ./{SCHEMA_FILE}\n" + "\n".join(lines) + "\n")
    write_atomically(path.parent / SCHEMA_FILE, schema_text())
    print(f"{path}: a copy of {source}; keys are in {SCHEMA_FILE} beside it and in docs/SCENARIOS.md")


def _checked(name: str) -> Scenario:
    """A scenario in which the robot can drive. Raises BslamError."""
    scenario = load_scenario(name)
    steps = min(scenario.steps, max(1, round(_CHECK_S / (scenario.step_us * 1e-6))))
    true_drive(_shortened(scenario, steps), 0)
    return scenario


def _shortened(scenario: Scenario, steps: int) -> Scenario:
    return Scenario(**(vars(scenario) | {"steps": steps}))


def _describe(scenario: Scenario) -> str:
    arena = scenario.arena
    (low_x, low_y), (high_x, high_y) = arena.low, arena.high
    return (
        f"{scenario.name}: good. {high_x - low_x:g} x {high_y - low_y:g} m, {len(arena.walls)} walls, "
        f"{len(arena.beacons)} beacons, {len(arena.boxes)} boxes, {len(scenario.movers)} that move about, "
        f"{scenario.steps} steps in {scenario.steps * scenario.step_us * 1e-6:g} s"
    )


def _show(scenario: Scenario, out: Path) -> None:
    path = out / f"{scenario.name}.png"
    write_atomically(path, png(draw_world(_world(scenario))))
    print(f"{_describe(scenario)}\n{path}")


def _world(scenario: Scenario) -> World:
    arena, start = scenario.arena, scenario.start
    drive = true_drive(scenario, 0)
    identities = np.array([one.beacon_id for one in arena.beacons], dtype=np.int64)
    return World(
        title=f"{scenario.name}: {scenario.description}" if len(scenario.description) < 70 else scenario.name,
        walls_m=np.array([(*wall.start, *wall.end) for wall in arena.walls]),
        beacons=Beacons(identities, *arena.beacon_xy_m.T),
        start=(start.x_m, start.y_m, start.heading_rad),
        radius_m=scenario.body.diameter_m / 2.0,
        boxes_m=[np.array([side.start for side in box.sides]) for box in arena.boxes],
        movers=[(np.array(mover.path), mover.radius_m) for mover in scenario.movers],
        waypoints_m=scenario.driving.waypoints,
        path_m=np.column_stack([drive.x_m, drive.y_m]),
    )
