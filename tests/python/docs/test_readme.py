"""The README's figures are those of the documents that commands write, rounded."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
KB = 1024


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


def rows(text, first):
    """Numbers of the table rows that begin so; what is no number is left out."""
    found = re.findall(rf"^\| {re.escape(first)} \|(.*)\|$", text, re.MULTILINE)
    return [[float(n.replace(",", "")) for n in re.findall(r"[\d,]+(?:\.\d+)?", row)] for row in found]


@pytest.mark.parametrize(("column", "beacons"), list(enumerate(["6", "20", "50"])))
def test_what_it_costs_is_what_was_measured(column, beacons):
    ram, thousands, with_velocity = rows(text_of("README.md"), beacons)[0]
    assert ram == rows(text_of("docs/SIZES.md"), "`bslam_slam_t`")[0][column]
    measured = rows(text_of("docs/BENCHMARKS.md"), beacons)[0]
    assert thousands == round(measured[0] / 1000)
    assert with_velocity == round(measured[-1] / 1000)


def test_flash_is_what_was_measured():
    sizes = text_of("docs/SIZES.md")
    linked = rows(sizes, "known association, or by position and class")[0][0]
    learning = rows(sizes, "and classifiers that learn appearance on the robot")[0][0]
    layers = re.findall(r"^\| [a-z]+ \| (\d+) \|$", sizes.split("## RAM")[0], re.MULTILINE)
    sentence = re.search(
        r"links ([\d.]+) KB .*?, ([\d.]+) KB .*?has (\d+) KB", text_of("README.md"), re.DOTALL
    )
    assert sentence is not None
    told = [float(number) for number in sentence.groups()]
    measured = [linked / KB, learning / KB, sum(map(int, layers)) / KB]
    assert told == pytest.approx(measured, rel=0.02)


@pytest.mark.parametrize(
    ("told", "measured"),
    [
        ("bslam on given reference logs, distance and direction", "distance and bearing"),
        ("the same, `--filter invariant`", "bearing-only, `--filter invariant`"),
        (
            "bslam on given reference logs, direction only: the smoother",
            "bearing-only, smoother (the default)",
        ),
    ],
)
def test_errors_on_the_given_logs_are_those_of_the_results(told, measured):
    row = re.findall(
        r"^\| (?:" + re.escape(measured) + r") \|(.*)\|$", text_of("docs/RESULTS.md"), re.MULTILINE
    )
    errors = [float(re.search(r"[\d.]+", cell)[0]) for cell in row[0].split("|")[:3]]
    assert rows(text_of("README.md"), told)[0] == pytest.approx(errors, abs=0.051)
