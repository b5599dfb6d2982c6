"""docs/MATH.md, the code that it names, and the code that names it, hold together."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"
MATH = (DOCS / "MATH.md").read_text(encoding="utf-8")
FIRMWARE = ROOT / "firmware" / "bslam"
CORE_FILES = sorted(FIRMWARE.rglob("*.[ch]"))

EQUATION = re.compile(r"\\qquad \\mathrm\{\((\d+)\)\}")
LINKED_FUNCTION = re.compile(r"\[`(\w+)\(\)`\]\(([^)]+)\)")
NAMED_FUNCTION = re.compile(r"`(\w+)\(\)`")
# MATH "Section", "Section" or MATH 24, in a comment or in the text of a parameter.
REFERENCE = re.compile(r'\bMATH ((?:"[^"]+"(?:, )?)+|\d+)')
DESIGN_REFERENCE = re.compile(r'docs/DESIGN\.md, "([^"]+)"')


def headings(text):
    return set(re.findall(r"^#+ (.+)$", text, re.MULTILINE))


def defines(path, name):
    """A C function with a body or a prototype, or a Python function."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return re.search(rf"^\s*def {name}\(", text, re.MULTILINE) is not None
    return re.search(rf"^(?:static )?(?:inline )?[a-z]\w*[ *]+{name}\s*\(", text, re.MULTILINE) is not None


def joined_comments(path):
    """The file with each run of // comments on one line, so that no reference is split."""
    text = path.read_text(encoding="utf-8")
    return re.sub(r"\n\s*///? ?", " ", text)


def references(pattern):
    """(file, what the match names) of every reference in the firmware and its tests."""
    files = CORE_FILES + sorted((ROOT / "tests" / "unit").rglob("*.[ch]"))
    return [
        (path.relative_to(ROOT), found) for path in files for found in pattern.findall(joined_comments(path))
    ]


def test_equations_are_numbered_from_1_in_order():
    numbers = [int(number) for number in EQUATION.findall(MATH)]
    assert numbers == list(range(1, len(numbers) + 1))


def test_every_function_that_math_names_exists():
    python_files = sorted((ROOT / "host_sim" / "bslam").rglob("*.py"))
    for name in set(NAMED_FUNCTION.findall(MATH)):
        assert any(defines(path, name) for path in [*CORE_FILES, *python_files]), name


def test_every_function_that_math_links_stands_in_the_file():
    links = set(LINKED_FUNCTION.findall(MATH))
    assert len(links) > 40
    for name, target in links:
        assert defines((DOCS / target).resolve(), name), (name, target)


def test_every_equation_of_the_paper_has_a_row_with_a_function():
    rows = {
        int(match[1]): match[0]
        for match in re.finditer(r"^\| \((\d+)\) \|.*$", MATH, re.MULTILINE)
        if NAMED_FUNCTION.search(match[0])
    }
    assert sorted(rows) == list(range(1, 16))
    assert re.search(r"^\| augment \|.*bslam_ekf_add\(\)", MATH, re.MULTILINE)


def test_every_row_of_that_table_names_equations_that_exist():
    numbers = set(EQUATION.findall(MATH))
    for row in re.findall(r"^\| (?:\(\d+\)|augment|found or novel) \|[^|]*\|([^|]*)\|", MATH, re.MULTILINE):
        assert set(re.findall(r"\((\d+)\)", row)) <= numbers, row
        assert re.search(r"\(\d+\)", row), row


def test_every_equation_that_the_text_refers_to_exists():
    numbers = {int(number) for number in EQUATION.findall(MATH)}
    text = re.sub(r"paper(?: equation)? \(\d+\)(?:(?:-| and |, )\(\d+\))*", "", MATH)
    text = re.sub(r"^\| (?:\(\d+\)) \|", "", text, flags=re.MULTILINE)
    assert {int(number) for number in re.findall(r"\((\d+)\)", text)} <= numbers


def test_every_reference_of_the_code_to_math_resolves():
    sections, numbers = headings(MATH), set(EQUATION.findall(MATH))
    found = references(REFERENCE)
    assert len(found) > 10
    for path, words in found:
        if words.isdigit():
            assert words in numbers, (path, words)
        else:
            assert set(re.findall(r'"([^"]+)"', words)) <= sections, (path, words)


def test_every_reference_of_the_code_to_design_resolves():
    sections = headings((DOCS / "DESIGN.md").read_text(encoding="utf-8"))
    for path, section in references(DESIGN_REFERENCE):
        assert section in sections, (path, section)


def test_the_bend_of_the_model_is_equation_24():
    """bearing_only_curvature_factor's meaning says so."""
    before = MATH.split(r"\mathrm{(24)}")[0]
    assert before.count("$$") % 2 == 1  # inside a block
    assert "S_{\\epsilon\\epsilon} S_{bb}" in before.rsplit("$$", 1)[1]


def test_maths_is_what_github_renders():
    """Inline maths within a line; no backslash that Markdown takes; no macro that GitHub refuses."""
    refused = re.compile(r"\\(?:operatorname|mbox|phantom|tag|newcommand|require)\b|\\[^a-zA-Z]|\\$")
    for number, part in enumerate(re.split(r"^\$\$$", MATH, flags=re.MULTILINE)):
        if number % 2:
            assert not refused.search(part), part
            assert "\n\n" not in part.strip("\n"), part
            assert not re.search(r"^(?:[-+*>#]|\d+[.)]) ", part, re.MULTILINE), part  # a list, to Markdown
            continue
        for line in part.splitlines():
            plain = re.sub(r"`[^`]*`", "", line)
            assert plain.count("$") % 2 == 0, line
            for inline in re.findall(r"\$([^$]*)\$", plain):
                assert inline == inline.strip(), line
                assert not refused.search(inline), line
