"""`bslam run --film`: a picture that moves, the same for the same seed."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageColor

import bslam
from bslam.cli import main
from bslam.commands.report import verdict
from bslam.view.style import RESULT_COLOURS, SECOND

STEPS = 12


@pytest.fixture
def short(tmp_path: Path) -> Path:
    world = (Path(bslam.__file__).parent / "scenarios/paper_room.toml").read_text(encoding="utf-8")
    assert "steps = 5000\n" in world
    path = tmp_path / "short.toml"
    path.write_text(world.replace("steps = 5000\n", f"steps = {STEPS}\n"), encoding="utf-8")
    return path


def count(frame: Image.Image, rgb: Sequence[float] | NDArray[np.float64]) -> int:
    pixels = np.asarray(frame.convert("RGB")).astype(int)
    return int((np.abs(pixels - rgb).max(axis=2) < 8).sum())


def shows(frame: Image.Image, colour: str) -> bool:
    return count(frame, ImageColor.getrgb(colour)) > 0


def test_film_shows_the_run_step_by_step_and_has_the_same_bits_again(short: Path, tmp_path: Path) -> None:
    words = ["run", str(short), "--pictures", "0", "--association", "known"]
    for name in ("one.gif", "two.gif"):
        assert main([*words, "--film", str(tmp_path / name), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()
    with Image.open(tmp_path / "one.gif") as film:
        assert film.n_frames == STEPS + 1
        assert film.info["loop"] == 0
        # The legend has each colour; rays of fused sightings come later.
        counts = []
        for frame in (0, STEPS):
            film.seek(frame)
            counts.append(count(film, ImageColor.getrgb(RESULT_COLOURS["matched"])))
            assert all(shows(film, RESULT_COLOURS[one]) for one in ("matched", "wrong", "new"))
        assert counts[1] > 2 * counts[0]
        # Tentative beacons are in the legend when none is in the room any more.
        pale = 255 - 0.4 * (255 - np.array(ImageColor.getrgb(SECOND)))
        assert count(film, pale) > 25


def test_film_is_of_the_first_run_whatever_becomes_of_others(short: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    (out / "short_seed1.map.csv").mkdir(parents=True)  # which that run cannot replace
    words = ["run", str(short), "--pictures", "0", "--seeds", "0:2", "--jobs", "1", "--out", str(out)]
    assert main([*words, "--film", str(tmp_path / "one.webp")]) == 2
    assert (tmp_path / "one.webp").is_file()


def test_film_may_be_webp(short: Path, tmp_path: Path) -> None:
    short.write_text(short.read_text(encoding="utf-8").replace(f"steps = {STEPS}\n", "steps = 2\n"))
    words = ["run", str(short), "--pictures", "0", "--out", str(tmp_path / "out")]
    assert main([*words, "--film", str(tmp_path / "one.webp")]) == 0
    with Image.open(tmp_path / "one.webp") as film:
        assert (film.format, film.n_frames, film.info["loop"]) == ("WEBP", 3, 0)
        film.seek(2)
        assert shows(film, RESULT_COLOURS["matched"])


def test_film_of_another_kind_is_refused_before_anything_runs(
    short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["run", str(short), "--film", "drive.mp4", "--out", str(tmp_path / "out")])
    assert "'drive.mp4' is no picture that moves; allowed: FILE.gif, FILE.webp" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_film_in_a_place_that_is_none_is_refused_before_anything_runs(
    short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.gif").mkdir()
    for place in ("file/x.gif", "file/deeper/x.gif", "folder.gif"):
        with pytest.raises(SystemExit):
            main(["run", str(short), "--film", str(tmp_path / place), "--out", str(tmp_path / "out")])
        assert "cannot be written; allowed: a file in a folder" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_verdict_says_how_many_by_what_and_the_worst(
    short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(short), "--pictures", "0", "--out", str(tmp_path)]) == 0
    (entry,) = json.loads((tmp_path / "summary.json").read_text())["runs"]
    said = verdict([entry])
    assert f"verdict: {said}\n" in capsys.readouterr().out
    assert f"cm, {entry['name']}" in said
    good = {"name": "a", "diverged": False, "failed": False, "position_error_m": {"mean": 0.05}}
    bad = good | {
        "name": "b",
        "failed": True,
        "failed_by": ["map", "nees"],
        "position_error_m": {"mean": 0.3},
    }
    broken = {"name": "c", "diverged": True, "failed": True, "error": "no such file"}
    assert verdict([good]) == "1 of 1 right; worst mean error 5.0 cm, a"
    assert verdict([good, bad, broken]) == (
        "1 of 3 right, 2 FAILED by map (1), nees (1), error (1): b, c; worst mean error 30.0 cm, b"
    )
    untold = {"name": "d", "diverged": False, "failed": False}
    assert verdict([untold]) == "1 of 1 ran; no truth tells whether it is right"
    assert verdict([good, untold]).startswith("1 of 2 right; no truth tells of 1 whether it is right; worst")
    assert verdict([untold, broken]) == (
        "1 of 2 ran, 1 FAILED by error (1): c; no truth tells whether it is right"
    )
    unused = {"problems": ["most of the log was not used"]}
    assert verdict([good | unused]) == "0 of 1 right, 1 in doubt: a; worst mean error 5.0 cm, a"
    assert verdict([untold | unused]) == "1 of 1 ran, 1 in doubt: d; no truth tells whether it is right"
