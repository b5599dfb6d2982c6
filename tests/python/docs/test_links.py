"""The documents of the repository: their links lead to files, and what they tell one to type exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
DOCUMENTS = [
    path
    for path in [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    if path.is_file()
]
RELATIVE_LINK = re.compile(r"\]\((?!\w+:|#)([^)#\s]+)(?:#([^)\s]+))?\)")


def anchors(text):
    """How GitHub names headings in links."""
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_relative_links_resolve(document):
    for target, anchor in RELATIVE_LINK.findall(document.read_text(encoding="utf-8")):
        path = (document.parent / target).resolve()
        assert path.exists(), target
        assert path.is_relative_to(ROOT), target
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path.read_text(encoding="utf-8")), f"{target}#{anchor}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_make_target_that_is_documented_exists(document):
    makefiles = [ROOT / "Makefile", *sorted((ROOT / "mk").glob("*.mk"))]
    rules = "\n".join(path.read_text(encoding="utf-8") for path in makefiles)
    text = document.read_text(encoding="utf-8")
    for target in re.findall(r"(?:`|^    )make ([a-z][a-z-]*)(?=[\s`,.;:)]|$)", text, re.MULTILINE):
        assert re.search(rf"^(?:[a-z-]+ )*{target}(?: [a-z-]+)*:", rules, re.MULTILINE), target
