"""From a board to a log: the lines that a robot's README adds to its program, and the one that sorts them."""

import re
import sys
from pathlib import Path

import pytest

from bslam.cli import main
from examples.building import EXAMPLES, run
from examples.test_robots import ESP_IDF, ROBOTS, SKETCH, Build

SIGHTINGS = "const bslam_status_t status = bslam_sightings"
BEFORE = {
    SKETCH: ("}\n", SIGHTINGS),
    ESP_IDF / "main.c": ("const bslam_status_t status = bslam_odom", SIGHTINGS),
}
"""Where its README has the rows of odometry and of sightings printed: ahead of the last of these texts."""


def blocks(readme: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", readme.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize(("build", "source"), ROBOTS, ids=["arduino", "esp_idf"])
def test_what_the_serial_line_says_becomes_a_log(
    tmp_path: Path, library: Path, build: Build, source: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readme = EXAMPLES / source.relative_to(EXAMPLES).parts[0] / "README.md"
    text = source.read_text(encoding="utf-8")
    for place, lines in zip(BEFORE[source], blocks(readme, "cpp" if source == SKETCH else "c"), strict=True):
        head, found, tail = text.rpartition(place)
        assert found
        text = f"{head}{lines}{found}{tail}"
    changed = tmp_path / f"changed{source.suffix}"
    changed.write_text(text, encoding="utf-8")
    build(tmp_path, changed, library)
    before, cut = "S -35-123,1,0e-3,2000e-3\nS -1,1,0e-3,2000e-3\n", "S 12\nO 41960000,7\nO 41970000,7,7"
    said = run("./robot", folder=tmp_path).stdout
    (tmp_path / "serial.txt").write_text(f"{before}{said}{cut}", encoding="utf-8")

    (program,) = blocks(EXAMPLES / "README.md", "python")
    (robot,) = blocks(EXAMPLES / "README.md", "toml")
    run(sys.executable, "-c", program, folder=tmp_path)
    drive = tmp_path / "my_drive"
    (drive / "robot.toml").write_text(robot, encoding="utf-8")
    status = main(["check", str(drive), "--out", str(tmp_path / "check")])
    told = capsys.readouterr()
    assert status == 0, told.err
    assert told.out.startswith("my_drive: 0 findings\n")
