"""tools/label.html, the labelling aid: what its script saves is what training reads. Run by QuickJS."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
import quickjs
from PIL import Image

from bslam.datasets.labels import COLUMNS, Label, read_folder
from bslam.modelfile import BeaconClass

PAGE = (Path(__file__).parents[3] / "tools/label.html").read_text(encoding="utf-8")


def script(name: str) -> str:
    match = re.search(rf'<script id="{name}">(.*?)</script>', PAGE, re.DOTALL)
    assert match is not None
    return match[1]


@pytest.fixture
def page() -> quickjs.Context:
    context = quickjs.Context()
    context.eval(script("table"))
    return context


def call(page: quickjs.Context, function: str, *arguments: object) -> Any:
    """The value of a function of the page, both ways as JSON."""
    return json.loads(page.eval(f"JSON.stringify({function}(...{json.dumps(arguments)}))"))


BOXES = {
    "b.png": [
        {"name": 'a "red", big box', "left": 1, "top": 2.25, "right": 30, "bottom": 40},
        {"name": "Tür", "left": 5, "top": 6, "right": 100, "bottom": 80},
    ],
    "a, first.png": [{"name": "Tür", "left": 0, "top": 0, "right": 9.96, "bottom": 8}],
    "c.png": [],
}
SIZES = {"Tür": ["2.0", "0.05"]}


def test_to_csv_is_what_training_reads(page: quickjs.Context, tmp_path: Path) -> None:
    for name in BOXES:
        Image.new("RGB", (100, 80)).save(tmp_path / name)
    (tmp_path / "labels.csv").write_text(call(page, "toCsv", BOXES, SIZES), encoding="utf-8")
    folder = read_folder(tmp_path)
    assert folder.objects == (BeaconClass("Tür", 2.0, 0.05), BeaconClass('a "red", big box'))
    assert [picture.path.name for picture in folder.pictures] == ["a, first.png", "b.png", "c.png"]
    assert folder.pictures[0].labels == (Label("Tür", 0, 0, 10, 8),)
    assert folder.pictures[1].labels[0] == Label('a "red", big box', 1, 2.3, 30, 40)
    assert folder.pictures[2].labels == ()


def test_from_csv_goes_on_where_to_csv_ended(page: quickjs.Context) -> None:
    text = call(page, "toCsv", BOXES, SIZES)
    read = call(page, "fromCsv", text)
    assert read["sizes"] == {'a "red", big box': ["", ""], **SIZES}
    assert set(read["boxes"]) == set(BOXES)
    assert call(page, "toCsv", read["boxes"], read["sizes"]) == text


@pytest.mark.parametrize(
    ("line", "fields"),
    [
        ("a,b,c", ["a", "b", "c"]),
        ("a,,", ["a", "", ""]),
        (",,", ["", "", ""]),
        ('"a,b",c', ["a,b", "c"]),
        ('x,"he said ""no"""', ["x", 'he said "no"']),
        ("one", ["one"]),
    ],
)
def test_split_line_knows_quotes_and_empty_fields(
    page: quickjs.Context, line: str, fields: list[str]
) -> None:
    assert call(page, "splitLine", line) == fields


def test_columns_are_those_of_the_training(page: quickjs.Context) -> None:
    assert json.loads(page.eval("JSON.stringify(COLUMNS)")) == list(COLUMNS)


def test_box_between_keeps_corners_in_order_and_inside(page: quickjs.Context) -> None:
    box = call(page, "boxBetween", "door", 90, 70, -5, 20, 80, 60)
    assert box == {"name": "door", "left": 0, "top": 20, "right": 80, "bottom": 60}
    assert call(page, "boxBetween", "door", 10, 10, 11, 50, 80, 60) is None  # a click, not a box


def test_box_at_is_the_smallest_that_holds_the_point(page: quickjs.Context) -> None:
    boxes = [
        {"name": "a", "left": 0, "top": 0, "right": 50, "bottom": 50},
        {"name": "b", "left": 10, "top": 10, "right": 20, "bottom": 20},
    ]
    assert call(page, "boxAt", boxes, 15, 15) == 1
    assert call(page, "boxAt", boxes, 30, 30) == 0
    assert call(page, "boxAt", boxes, 60, 30) == -1


def test_page_is_self_contained_and_its_script_parses() -> None:
    assert not re.search(r"(src|href)\s*=\s*[\"']|https?:|import\s", PAGE)
    quickjs.Context().eval(f"(async () => {{ if (false) {{ {script('page')} }} }})()")
