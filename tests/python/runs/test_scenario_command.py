"""`bslam scenario`: what a user starts from, and what is said of a bad file."""

import pytest

from bslam.cli import main
from bslam.world.scenario import load_scenario


@pytest.fixture
def room(tmp_path, monkeypatch, capsys):
    """A new scenario file in the working directory."""
    monkeypatch.chdir(tmp_path)
    assert main(["scenario", "new", "mine.toml", "--from", "busy_hall"]) == 0
    capsys.readouterr()
    return tmp_path / "mine.toml"


def test_new_is_a_copy_with_its_schema_beside_it(room):
    assert room.read_text().startswith("#:schema ./scenario.schema.json\n")
    assert (room.parent / "scenario.schema.json").is_file()
    mine, original = load_scenario(room), load_scenario("busy_hall")
    assert vars(mine) == vars(original) | {"name": "mine"}


def test_new_replaces_nothing(room, capsys):
    before = room.read_text()
    assert main(["scenario", "new", "mine.toml"]) == 2
    assert "mine.toml: is there already; allowed" in capsys.readouterr().err
    assert room.read_text() == before


def test_check_and_show_say_what_there_is(room, capsys):
    room.write_text(room.read_text().replace("steps = 7500", "steps = 250"))
    assert main(["scenario", "check", "mine.toml", "pairs"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("mine: good. 16 x 13 m, 8 walls, 11 beacons, 5 boxes, 6 that move about")
    assert said[1].startswith("pairs: good.")
    assert main(["scenario", "show", "mine.toml", "--out", "pictures"]) == 0
    assert (room.parent / "pictures" / "mine.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("steps = 7500", "stebs = 7500", ["key stebs", "no such key", "steps"]),
        ("x_m = 2.0\n", "x_m = 5.2\n", None),
        ("x_m = 2.0\ny_m = 2.6", "x_m = 5.25\ny_m = 5.05", ["[start]", "5.25", "outside boxes[0]"]),
        ("x_m = 2.0\ny_m = 2.6", "x_m = 0.1\ny_m = 2.6", ["[start]", "0.1", "every wall and box"]),
        ("x_m = 2.0\ny_m = 2.6", "x_m = 20.0\ny_m = 2.6", ["[start]", "20.0", "within the walls, x 0 to 16"]),
        ("at = [2.0, 0.0]", "at = [2.0, 30.0]", ["beacons[0], key at", "[2.0, 30.0]", "y -3 to 10"]),
        ("size_m = [0.6, 0.6]", "size_m = [12.0, 9.0]", ["[start]", "outside boxes[0]"]),
        ('kind = "sign"', 'kind = "clock"', ["beacons[9], key kind", "'clock'", "'sign'"]),
        ("path = [[1.2, 1.5], [14.5, 1.5]]", "path = [[1.2, 1.5]]", ["movers[0], key path", "two points"]),
        ("path = [[1.2, 1.5],", "path = [[1.2, 99],", ["movers[0], key path", "99", "within the walls"]),
        ("pause_s = 4.0", "looks = 'dog'", ["movers[0], key looks", "dog", "person", "box"]),
        ("radius_m = 0.4,", "looks = 'person',", ["movers[5], key looks", "hides = false"]),
        ("keep_off_m = 0.5", "waypoints = [[1.0, 77.0]]", ["[driving], key waypoints", "77.0", "within"]),
        ("step_us = 40_000", 'step_us = 40_000\nrig = "six"', ["key rig", "'six'", "three60"]),
    ],
)  # fmt: skip
def test_bad_file_exits_2_and_the_last_line_names_key_value_and_what_is_allowed(
    room, capsys, old, new, parts
):
    text = room.read_text()
    assert old in text
    room.write_text(text.replace(old, new, 1))
    assert main(["scenario", "check", "mine.toml"]) == (0 if parts is None else 2)
    last = (capsys.readouterr().err.strip().splitlines() or [""])[-1]
    for part in [] if parts is None else ["mine.toml", *parts, "allowed"]:
        assert part in last


def test_nothing_named_is_bad_input(capsys):
    assert main(["scenario", "check"]) == 2
    assert "allowed: building20" in capsys.readouterr().err.splitlines()[-1]


def test_rig_of_the_scenario_is_the_one_of_the_camera(room):
    room.write_text(room.read_text().replace("step_us = 40_000", 'step_us = 40_000\nrig = "wide180"', 1))
    assert load_scenario(room).rig == "wide180"
