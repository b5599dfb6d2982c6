"""docs/SCENARIOS.md: every key and every ready world is in it."""

import re
from dataclasses import fields
from pathlib import Path

from bslam.world.scenario import LISTS, TABLES, TOP_RULES, scenario_names

ROOT = Path(__file__).resolve().parents[3]
TEXT = (ROOT / "docs" / "SCENARIOS.md").read_text(encoding="utf-8")


def test_every_key_is_listed_with_what_is_allowed() -> None:
    for key in TOP_RULES:
        assert f"`{key}`" in TEXT
    for name, cls in {**TABLES, **LISTS}.items():
        heading = f"`{name} = [" if name in LISTS else f"`[{name}]`:"
        rows = TEXT.split(heading)[1].split("\n\n")[1]
        for one in fields(cls):
            assert f"| `{one.name}` | {one.metadata['rule'].allowed} |" in rows, f"{name}.{one.name}"


def test_every_ready_world_is_shown() -> None:
    shown = set(re.findall(r"img/scenarios/(\w+)\.png", TEXT))
    assert shown == set(scenario_names())
    for name in shown:
        assert (ROOT / "docs" / "img" / "scenarios" / f"{name}.png").is_file()
