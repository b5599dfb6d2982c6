"""The types that a user's program sees: mypy holds them (make lint), and the program runs."""

import tomllib
from pathlib import Path

from api import user_program
from bslam import Run

ROOT = Path(__file__).resolve().parents[3]


def test_the_program_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    x_m, y_m, theta_rad = user_program.drive_one_robot()
    assert 0.0 < x_m < 0.1 and abs(y_m) < 0.1 and abs(theta_rad) < 0.1
    assert isinstance(user_program.run_a_log(0), Run)
    assert (tmp_path / "run.png").stat().st_size > 1000


def test_lint_looks_at_it_as_mypy_strict_does():
    mypy = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["mypy"]
    assert str(Path(user_program.__file__).relative_to(ROOT)) in mypy["files"]
    (strict,) = (one for one in mypy["overrides"] if "user_program" in str(one["module"]))
    assert all(strict[flag] for flag in strict if flag != "module")
    assert {"disallow_untyped_calls", "disallow_any_generics", "warn_return_any"} <= set(strict)
