"""The JSON schema of scenario files: as committed, true of every good file, and against bad ones."""

import copy
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from bslam.commands.scenario import schema_text
from bslam.world.scenario import SCENARIOS, scenario_names
from bslam.world.schema import scenario_schema

CHECKER = jsonschema.Draft7Validator(scenario_schema())


def document(name: str) -> dict[str, Any]:
    return tomllib.loads((SCENARIOS / f"{name}.toml").read_text(encoding="utf-8"))


def test_schema_is_one_and_is_the_committed_one() -> None:
    jsonschema.Draft7Validator.check_schema(scenario_schema())
    committed = Path(SCENARIOS / "scenario.schema.json").read_text(encoding="utf-8")
    assert committed == schema_text(), "bslam scenario schema > host_sim/bslam/scenarios/scenario.schema.json"


@pytest.mark.parametrize("name", scenario_names())
def test_schema_takes_every_scenario_of_the_package(name: str) -> None:
    CHECKER.validate(document(name))


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (["step"], 5000),
        (["steps"], 0),
        (["steps"], 5000.5),
        (["steps"], None),
        (["walls"], []),
        (["walls", 0, "start"], [1.0]),
        (["walls", 0, "colour"], "red"),
        (["beacons", 0, "id"], -1),
        (["beacons", 0, "kind"], "clock"),
        (["boxes", 0, "hides"], 1),
        (["movers", 0, "path"], [[0.0, 0.0]]),
        (["movers", 0, "speed_mps"], 0),
        (["wheels", "noise"], "both"),
        (["sensor", "outlier_share"], 1.5),
        (["sensor", "field_of_view_rad"], None),
        (["driving", "keep_off_m"], -1),
    ],
)
def test_schema_refuses(place: list[Any], value: Any) -> None:
    """None: the key is left out."""
    edited = copy.deepcopy(document("busy_hall"))
    table: Any = edited
    for key in place[:-1]:
        table = table[key]
    if value is None:
        del table[place[-1]]
    else:
        table[place[-1]] = value
    assert not CHECKER.is_valid(edited)
