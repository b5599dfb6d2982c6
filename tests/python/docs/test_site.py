"""The site: every page is in its navigation, no link is dead, headers and notebooks come out whole.

mkdocs is not needed for that and not installed for it: 60 MB that nothing else uses. `make site` runs it with
--strict, which holds the same and the anchors against what it has built.
"""

import json
import posixpath
import re

import pytest

from docs.reading import ROOT, read
from tools.site_pages import CODE, HEADERS, LINK, MATHS, gallery, linked, notebook, pages, reference

PAGES = pages()
PLACES = {path: place for path, (place, _) in PAGES.items()}
CONFIGURATION = read("mkdocs.yml")
NAVIGATION = re.findall(r"^ +- (?:[^:\n]+: )?(\S+\.(?:md|html))$", CONFIGURATION, re.MULTILINE)


def test_every_page_is_in_the_navigation_once():
    named = [name for name in NAVIGATION if name.endswith(".md")]
    assert sorted(named) == sorted([*PLACES.values(), "gallery.md"]), "edit `nav` of mkdocs.yml"


@pytest.mark.parametrize("path", PAGES)
def test_links_lead_to_pages_or_files(path):
    place, text = PAGES[path]
    moved, files = linked(path, text, PLACES)
    for source in files:
        assert (ROOT / source).is_file(), source
    there = {*PLACES.values(), *files.values()}
    targets = LINK.findall(moved)
    assert len(targets) == len(LINK.findall(text))
    for target in targets:
        assert posixpath.normpath(posixpath.join(posixpath.dirname(place), target)) in there, target


@pytest.mark.parametrize("header", HEADERS)
def test_reference_has_every_function_and_type_of_the_header(header):
    text = read(header)
    declared = set(re.findall(r"^(?:[A-Z_]+ )?[a-z]\w*[ *]+(\w+)\(", text, re.MULTILINE))
    declared |= set(re.findall(r"^\} (\w+);", text, re.MULTILINE))
    page = reference(ROOT / header)
    blocks = "".join(re.findall(r"```c\n(.*?)```", page, re.DOTALL))
    missing = {name for name in declared if not re.search(rf"\b{name}\b", blocks)}
    assert len(declared) > 20
    assert not missing
    assert len(re.findall(r"^### ", page, re.MULTILINE)) > 20


def test_notebook_shows_cells_and_what_they_printed_and_drew(tmp_path):
    outputs = [{"text": ["3\n"]}, {"data": {"image/png": "aGk=\n", "text/plain": "<Figure>"}}]
    cells = [
        {"cell_type": "markdown", "source": ["# Title\n", "words"]},
        {"cell_type": "code", "source": ["print(3)"], "outputs": outputs},
    ]
    (tmp_path / "one.ipynb").write_text(json.dumps({"cells": cells}))
    assert list(notebook(tmp_path / "one.ipynb")) == [
        "# Title\nwords",
        "```python\nprint(3)\n```",
        "```text\n3\n```",
        "![drawn](data:image/png;base64,aGk=)",
    ]


def test_equations_are_found_as_documents_and_notebooks_write_them():
    found = [one.groups() for one in MATHS.finditer("with $e$:\n\n$$a = b,$$\n\n$$\nc\n$$\n")]
    assert found == [(None, "e"), ("a = b,", None), ("\nc\n", None)]
    for path, (_, text) in PAGES.items():
        assert "$$" not in MATHS.sub("", CODE.sub("", text)), path


def test_gallery_has_every_picture_that_is_there():
    shown = re.findall(r"\]\((docs/img/[^)]+)\)", gallery({path: text for path, (_, text) in PAGES.items()}))
    there = {str(path.relative_to(ROOT)) for path in (ROOT / "docs/img").rglob("*") if path.is_file()}
    assert sorted(shown) == sorted(set(shown))
    assert set(shown) == there


def test_nothing_is_asked_of_other_servers():
    assert "font: false" in CONFIGURATION
    assert not re.search(r"https?://", CONFIGURATION + read("docs/site.css"))
