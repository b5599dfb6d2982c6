"""The JSON schema of scenario files, for editors that complete and check while one writes."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any

from bslam.world.scenario import LISTS, OPTIONAL, TABLES, TOP_RULES


def scenario_schema() -> dict[str, Any]:
    """The schema: every key, its type and range. What only shows with several keys is `scenario check`'s."""
    properties: dict[str, Any] = {key: rule.schema for key, rule in TOP_RULES.items()}
    properties |= {key: _table(cls) for key, cls in TABLES.items()}
    properties |= {key: {"type": "array", "items": _table(cls)} for key, cls in LISTS.items()}
    properties["walls"]["minItems"] = 1
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "a scenario of bslam",
        "type": "object",
        "additionalProperties": False,
        "required": [key for key in properties if key not in OPTIONAL],
        "properties": properties,
    }


def _table(cls: type) -> dict[str, Any]:
    own = fields(cls)
    properties = {one.name: one.metadata["rule"].schema for one in own}
    for one in own:
        if isinstance(one.default, (int, float, str)) and one.default != float("inf"):
            properties[one.name]["default"] = one.default
    return {
        "type": "object",
        "description": (cls.__doc__ or "").split("\n\n")[0].strip(),
        "additionalProperties": False,
        "required": [one.name for one in own if one.default is MISSING],
        "properties": properties,
    }
