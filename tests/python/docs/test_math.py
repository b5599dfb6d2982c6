"""docs/MATH.md, docs/MATH-CAMERA.md, the code that they name, and the code that names them, hold together."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"
MATH = (DOCS / "MATH.md").read_text(encoding="utf-8")
CAMERA = (DOCS / "MATH-CAMERA.md").read_text(encoding="utf-8")
BOTH = {"MATH": MATH, "MATH-CAMERA": CAMERA}
C_FILES = sorted((ROOT / "firmware").rglob("*.[ch]"))

# The estimator's equations are numbered 1, 2, ..., the camera's C1, C2, ...
EQUATION = re.compile(r"\\qquad \\mathrm\{\((C?\d+)\)\}")
EQUATION_NAMED = re.compile(r"\((C?\d+[a-z]?)\)")
LINKED_FUNCTION = re.compile(r"\[`(\w+)\(\)`\]\(([^)]+)\)")
NAMED_FUNCTION = re.compile(r"`(\w+)\(\)`")
# MATH "Section", "Section" or MATH 24 or MATH (24), in a comment or in the text of a parameter.
REFERENCE = re.compile(r'\b(MATH(?:-CAMERA)?) ((?:"[^"]+"(?:, )?)+|\(?C?\d+\)?)')


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


def references():
    """(file, (document, what it names)) of every reference in the firmware and its tests."""
    files = C_FILES + sorted((ROOT / "tests" / "unit").rglob("*.[ch]"))
    return [
        (path.relative_to(ROOT), found)
        for path in files
        for found in REFERENCE.findall(joined_comments(path))
    ]


def equations(text):
    return EQUATION.findall(text)


def test_equations_are_numbered_in_order():
    assert equations(MATH) == [str(number + 1) for number in range(len(equations(MATH)))]
    assert equations(CAMERA) == [f"C{number + 1}" for number in range(len(equations(CAMERA)))]


def test_every_equation_has_a_number():
    for name, text in BOTH.items():
        displays = re.split(r"^\$\$$", text, flags=re.MULTILINE)[1::2]
        assert len(displays) == len(equations(text)), name


def test_every_function_that_math_names_exists():
    python_files = sorted((ROOT / "host_sim" / "bslam").rglob("*.py"))
    for name in set(NAMED_FUNCTION.findall(MATH + CAMERA)):
        assert any(defines(path, name) for path in [*C_FILES, *python_files]), name


def test_every_function_that_math_links_stands_in_the_file():
    links = set(LINKED_FUNCTION.findall(MATH + CAMERA))
    assert len(links) > 100
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
    numbers = set(equations(MATH))
    for row in re.findall(r"^\| (?:\(\d+\)|augment|found or novel) \|[^|]*\|([^|]*)\|", MATH, re.MULTILINE):
        assert set(EQUATION_NAMED.findall(row)) <= numbers, row
        assert EQUATION_NAMED.search(row), row


def test_every_equation_that_the_text_refers_to_exists():
    text = re.sub(r"^(\$\$|```)(?:math)?$.*?^\1$", "", MATH + CAMERA, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"paper(?: equation)? \(\d+\)(?:(?:-| and |, )\(\d+\))*", "", text)
    text = re.sub(r"^\| (?:\(\d+\)) \|", "", text, flags=re.MULTILINE)
    assert set(EQUATION_NAMED.findall(text)) <= {*equations(MATH), *equations(CAMERA)}


def test_every_section_that_the_text_refers_to_exists():
    for name, words in REFERENCE.findall(CAMERA):
        if words.startswith('"'):
            assert set(re.findall(r'"([^"]+)"', words)) <= headings(BOTH[name]), words


def test_every_reference_of_the_code_to_math_resolves():
    found = references()
    assert len(found) > 10
    for path, (name, words) in found:
        if words.startswith('"'):
            assert set(re.findall(r'"([^"]+)"', words)) <= headings(BOTH[name]), (path, words)
        else:
            assert words.strip("()") in equations(BOTH[name]), (path, words)


def test_the_bend_of_the_model_is_equation_24():
    """bearing_only_curvature_factor's meaning says so."""
    before = MATH.split(r"\mathrm{(24)}")[0]
    assert before.count("$$") % 2 == 1  # inside a block
    assert "S_{\\epsilon\\epsilon} S_{bb}" in before.rsplit("$$", 1)[1]


def check_maths(text):
    """Inline maths within a line; no backslash that Markdown takes; no macro that GitHub refuses."""
    refused = re.compile(r"\\(?:operatorname|mbox|phantom|tag|newcommand|require)\b|\\[^a-zA-Z]|\\$")
    for number, part in enumerate(re.split(r"^\$\$$", text, flags=re.MULTILINE)):
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


def test_maths_is_what_github_renders():
    for text in BOTH.values():
        check_maths(text)
