"""`bslam report`, opened in a real browser: it holds all it shows, and what it shows is what was run."""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from bslam.cli import main
from bslam.commands import compare, report_page
from bslam.runs import batch
from bslam.runs.contest import ContestResult
from tools.proofs import kill_sweep

BOUND = [
    {"method": "bslam", "on_bound_steps_m": 0.051, "ratio_to_bound": 1.02},
    {"method": "map", "on_bound_steps_m": 0.05, "ratio_to_bound": 1.0},
]


@pytest.fixture
def short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario of a few steps, and no real data."""
    monkeypatch.setenv("BSLAM_DATA", str(tmp_path))
    kill_sweep.write_sweep(tmp_path, 2)
    path = tmp_path / "paper_room.toml"
    text = (tmp_path / "short.toml").read_text()
    path.write_text(text.replace(f"steps = {kill_sweep.STEPS}", "steps = 100"))
    return path


def test_report_holds_its_pictures_and_the_figures_of_its_runs(
    page: Page, short: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = ([], [], ContestResult((), interrupted=False), BOUND)
    monkeypatch.setattr(compare, "compare", lambda _: lines)
    words = ["report", "--scenario", str(short), "--seeds", "3:5", "--parts", "tables,bound,real"]
    out = tmp_path / "out"
    assert main([*words, "--jobs", "1", "--out", str(out)]) == 0
    page.goto((out / "report.html").as_uri())
    expect(
        page.get_by_text(f"bslam tables --scenario {short} --association known --seeds 3:5")
    ).to_be_visible()
    widths = page.evaluate("[...document.images].map(one => one.complete && one.naturalWidth)")
    assert len(widths) == 6 and all(width > 500 for width in widths)  # the worst run's two, Figures 6 to 9
    expect(page.get_by_text("Lost means: the error was above 2 m")).to_be_visible()
    runs = json.loads((out / "tables/summary.json").read_text())["runs"]
    cell = [one for one in runs if one["sigma_mps"] == 1.0 and one["observation"] == "distance"]
    worst_m = max(one["position_error_m"]["mean"] for one in runs)
    caption = page.get_by_text("Worst run, error: ").inner_text()
    again = shlex.split(caption.partition("bslam ")[2])
    assert main([*again, "--pictures", "0", "--jobs", "1", "--out", str(tmp_path / "again")]) == 0
    made = json.loads((tmp_path / "again/summary.json").read_text())["runs"][0]
    assert made["position_error_m"]["mean"] == worst_m
    mean_cm = 100.0 * np.mean([one["position_error_m"]["mean"] for one in cell])
    table = page.get_by_role("table").filter(has_text="Table III")
    row = table.get_by_role("row", name="Mean error", exact=False).first
    assert row.get_by_role("cell").all_inner_texts()[1] == "15.1"  # the paper's
    assert row.get_by_role("cell").all_inner_texts()[2] == f"{mean_cm:.2f}"  # of two runs: no interval
    verdict = page.get_by_role("listitem").filter(has_text="Tables I to III")
    expect(verdict).to_contain_text("of 18 right")
    for width in (360, 1260):  # what is too wide scrolls by itself; what is shown is not shrunk
        page.set_viewport_size({"width": width, "height": 740})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    shrunk = page.evaluate("[...document.images].map(one => one.width / one.naturalWidth)")
    assert min(shrunk) > 0.85
    bound = page.get_by_role("row", name="sigma 0.6 m/s")
    assert bound.get_by_role("cell").all_inner_texts()[1:] == ["5.10", "5.00", "1.020"]
    expect(
        page.get_by_text("of the UTIAS MRCLAM data are not at hand; BSLAM_DATA names their place")
    ).to_be_visible()


def test_report_shows_no_picture_of_before_and_says_that_it_was_stopped(
    short: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["report", "--scenario", str(short), "--seeds", "3:4", "--parts", "tables,figure3"]
    words += ["--jobs", "1", "--out", str(tmp_path / "out")]
    make, made = batch._execute, []

    def report(stop_at: int, why: type[BaseException]) -> str:
        def run(job: batch.Job, out: Path) -> batch.Outcome:
            made.append(job.name)
            if len(made) >= stop_at:
                raise why
            return make(job, out)

        made.clear()
        monkeypatch.setattr(batch, "_execute", run)
        assert main(words) == 1
        return (tmp_path / "out/report.html").read_text()

    in_worst = report(10, KeyboardInterrupt)
    assert len(made) == 10
    assert "Stopped: this page lacks" in in_worst
    assert "Worst run" not in in_worst and "Figure 6: path" in in_worst
    nothing = report(1, ValueError)
    assert "<img" not in nothing and "0 of 9 right, 9 FAILED by error" in nothing
    assert "Stopped" not in nothing
    assert "nothing ran" in report(1, KeyboardInterrupt)


def test_report_judges_association_beside_known_as_sweep_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    error_m = {"known": 0.5, "svm": 1.2, "joint": 1.8}

    def run(jobs: Sequence[batch.Job], out: Path, processes: int) -> batch.BatchResult:
        made = []
        for one in jobs:
            mean_m = error_m.get(one.options.association, 0.1)
            reasons = ["off"] if mean_m > 1.0 else []
            entry = {"name": one.name, "association": one.options.association, "sightings": 1}
            entry |= dict.fromkeys(("wrong_associations", "missed", "false_new", "deferred"), 0)
            entry |= {"position_error_m": {"mean": mean_m}, "diverged": False}
            entry |= {"failed_by": reasons, "failed": bool(reasons)}
            series = np.arange(100, dtype=np.float32), np.full(100, mean_m, np.float32)
            made.append(batch.Outcome(one.name, entry, *series))
        return batch.BatchResult(tuple(made), interrupted=False)

    monkeypatch.setattr(report_page, "run_batch", run)
    words = ["report", "--parts", "association", "--seeds", "0:1", "--jobs", "1", "--out", str(tmp_path)]
    assert main(words) == 0
    page = (tmp_path / "report.html").read_text()
    assert "svm: 1 of 1 right" in page
    assert "joint: 0 of 1 right, 1 FAILED by off" in page


def test_report_unknown_part_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["report", "--parts", "tables,weather"])
    assert (
        "'weather' is no part; allowed: tables, bound, figure3, association, real" in capsys.readouterr().err
    )
