"""The README's figures are those of docs/RESULTS.md, and it stays short."""

import re

import pytest

from docs.reading import read


def errors(document: str, first: str) -> list[str]:
    """The first three cells of the table row that begins so, each up to its first semicolon."""
    (row,) = re.findall(rf"^\| {re.escape(first)} \|(.*)\|$", read(document), re.MULTILINE)
    return [cell.split(";")[0].strip() for cell in row.split("|")[:3]]


@pytest.mark.parametrize(
    ("told", "measured"),
    [
        ("bslam, distance and bearing", "distance and bearing"),
        ("bslam, bearing-only, smoother", "bearing-only, smoother (the default)"),
        ("bslam, bearing-only, `--filter invariant`", "bearing-only, `--filter invariant`"),
    ],
)
def test_errors_on_the_given_logs_are_those_of_the_results(told, measured):
    assert errors("README.md", told) == errors("docs/RESULTS.md", measured)


@pytest.mark.parametrize("observation", ["distance and bearing", "bearing-only"])
def test_errors_of_the_paper_are_those_of_the_results(observation):
    printed = errors("README.md", f"the paper, {observation}")
    rows = rf"^\| (?:0.3|0.6|1.0), {observation} \| known \| ([\d.]+) \|"
    measured = re.findall(rows, read("docs/RESULTS.md").split("## Camera rooms")[0], re.MULTILINE)
    assert printed == [f"{float(error):.1f}" for error in measured]


def test_it_has_110_lines_at_most():
    assert len(read("README.md").splitlines()) <= 110
