"""What the tests of the world share: small scenarios made from the paper's room."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from bslam.world.arena import Arena, Beacon, Wall
from bslam.world.scenario import Scenario, load_scenario


@pytest.fixture(scope="session")
def paper_room() -> Scenario:
    return load_scenario("paper_room")


@pytest.fixture(scope="session")
def short_room(paper_room: Scenario) -> Scenario:
    """The paper's room, 20 s long."""
    return replace(paper_room, steps=500)


@pytest.fixture(scope="session")
def square() -> Arena:
    """A room of 4 x 4 m around the origin, with one beacon in the middle of the wall ahead (x = 2)."""
    corners = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]
    walls = tuple(Wall(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    return Arena(walls, (Beacon(7, (2.0, 0.0)),))


@pytest.fixture
def edited_room(tmp_path: Path) -> Callable[..., Path]:
    """A function: the paper's room as a file of its own, with one text in it replaced by another."""
    source = Path(load_scenario.__code__.co_filename).parents[1] / "scenarios" / "paper_room.toml"

    def edit(old: str, new: str) -> Path:
        text = source.read_text(encoding="utf-8")
        assert old in text
        path = tmp_path / "edited.toml"
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
        return path

    return edit
