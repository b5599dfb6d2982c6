"""docs/TUNING.md: its generated parts are those of the C tables."""

import re

import pytest

from bslam.core import Slam
from docs.reading import column, read, section
from tools.checks import params_doc

TEXT = read("docs/TUNING.md")
PARTS = params_doc.parts()


@pytest.mark.parametrize("name", PARTS)
def test_generated_part_is_that_of_the_c_tables(name):
    first, last = params_doc.markers(name)
    assert TEXT.split(first)[1].split(last)[0].strip() == PARTS[name].strip(), "run `make docs`"


def test_every_setting_that_is_named_first_exists():
    assert column(section(TEXT, "Twelve that matter")) <= {one.name for one in Slam.parameters()}


def test_twelve_are_twelve():
    assert len(re.findall(r"^\| `", section(TEXT, "Twelve that matter"), re.MULTILINE)) == 12


def test_parts_are_put_between_the_markers(tmp_path):
    file = tmp_path / "doc.md"
    stale = ["{}\nstale\n{}\n".format(*params_doc.markers(name)) for name in PARTS]
    file.write_text("above\n" + "between\n".join(stale) + "below\n")
    assert params_doc.main(["--into", str(file)]) == 0
    once = file.read_text()
    assert once.startswith("above\n")
    assert once.endswith("\nbelow\n")
    assert all(part.strip() in once for part in PARTS.values())
    assert "stale" not in once
    assert params_doc.main(["--into", str(file)]) == 0
    assert file.read_text() == once


def test_file_without_markers_is_refused(tmp_path, capsys):
    file = tmp_path / "doc.md"
    file.write_text("nothing here\n")
    assert params_doc.main(["--into", str(file)]) == 1
    assert "doc.md" in capsys.readouterr().err
    assert file.read_text() == "nothing here\n"
