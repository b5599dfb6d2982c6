"""`bslam compare` as a user meets it: strangers' code in processes of its own."""

import json
import resource
import subprocess
import sys
from dataclasses import replace

import pytest

from bslam.cli import main
from bslam.runs.methods import Method, shipped_methods

STRANGERS = """
import os, time

class Still:
    def __init__(self, setup): print("said on standard output")
    def reset(self, seed): self.n = 0
    def odometry(self, time_us, left_m, right_m): self.n += 1
    def observe(self, time_us, sightings): pass
    def pose(self): return 0.0, 0.0, 0.0
    def map(self): return []

class Raises(Still):
    def observe(self, time_us, sightings):
        if self.n > 9: raise ValueError("no idea")

class Nan(Still):
    def pose(self): return 0.0, float("nan") if self.n > 9 else 0.0, 0.0

class Dies(Still):
    def observe(self, time_us, sightings): os.abort()

class Hangs(Still):
    def odometry(self, time_us, left_m, right_m):
        self.n += 1
        if self.n == 10: time.sleep(1000)
"""


@pytest.fixture
def scene(made, tmp_path, monkeypatch):
    """A short log and a file of algorithms, in the working directory."""
    monkeypatch.chdir(tmp_path)
    made.circle_log(40, seed=1).write(tmp_path / "drive")
    (tmp_path / "strangers_of_compare.py").write_text(STRANGERS)
    return tmp_path


def lines_of(folder):
    return {one["method"]: one for one in json.loads((folder / "compare.json").read_text())["methods"]}


def test_with_names_classes_of_ones_own_and_none_that_comes_with_bslam(scene, capsys, monkeypatch):
    monkeypatch.setattr(Method, "is_here", property(lambda one: one.name != "isam2"))
    install = f"is not installed; allowed: {sys.executable} -m pip install gtsam"
    for name, why in (("isam2", install), ("map", "comes with bslam")):
        assert main(["compare", "drive", "--out", "out", "--with", name]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert f"--with {name}: {why}" in line


def test_bad_algorithms_are_named_and_the_others_go_on(scene, capfd):
    own = [f"--with=strangers_of_compare:{name}" for name in ("Raises", "Nan", "Dies", "Still")]
    own.append("--with=strangers_of_compare.py:Hangs")
    words = ["compare", "drive", "--out", "out", "--only", "bslam,map", "--call-limit", "1", "--jobs", "2"]
    assert main([*words, *own]) == 1
    said = capfd.readouterr()
    lines = lines_of(scene / "out")
    assert {name for name, line in lines.items() if line["failed"]} == {"Raises", "Nan", "Dies", "Hangs"}
    for name, part in {
        "Raises": "ValueError: no idea at step 10 (observe, time_us ",
        "Nan": "step 10",
        "Dies": "signal 6",
        "Hangs": "after step 9",
    }.items():
        (error,) = lines[name]["errors"]
        assert f":{name}: " in error
        assert part in error
        assert f"drive_seed0.{name} failed: {error}" in said.err
    assert "said on standard output" not in said.out
    assert lines["bslam"]["ratio_to_bound"] < lines["Still"]["ratio_to_bound"]
    assert lines["map"]["ratio_to_bound"] == 1.0
    assert (scene / "out" / "drive_seed0.Still.estimate.tum").is_file()
    assert (scene / "out" / "compare.png").is_file()
    runs = json.loads((scene / "out" / "summary.json").read_text())["runs"]
    assert [run["method"] for run in runs] == ["bslam", "map", "Raises", "Nan", "Dies", "Still", "Hangs"]


def test_all_well_exits_0(scene, capsys):
    assert main(["compare", "drive", "--out", "out", "--only", "dead_reckoning", "--seeds", "0:2"]) == 0
    assert lines_of(scene / "out")["dead_reckoning"]["runs"] == 2
    assert capsys.readouterr().out.splitlines()[1].startswith("dead_reckoning")


def test_picture_is_of_what_has_an_error_and_named_only_where_it_is(scene, made, capsys, recwarn):
    log = made.circle_log(40, seed=1)
    truth = replace(log.truth, **{name: one[::10] for name, one in vars(log.truth).items()})
    replace(log, truth=truth).write(scene / "sparse")
    replace(log, truth=None).write(scene / "mapped")
    words = ["--only", "dead_reckoning,map", "--association", "known", "--map-every", "1000", "--out", "out"]
    for drive, more, is_drawn in (
        ("sparse", [], True),
        ("mapped", [], False),
        ("drive", [], True),
        ("drive", ["--pictures", "0"], False),
    ):
        assert main(["compare", drive, *words, *more]) == 0
        assert ("compare.png" in capsys.readouterr().out) == is_drawn
        assert (scene / "out" / "compare.png").is_file() == is_drawn
    assert not [one for one in recwarn if issubclass(one.category, RuntimeWarning)]


def test_several_logs_are_a_drive_each(scene, made, capsys):
    made.circle_log(60, seed=2).write(scene / "other")
    assert main(["compare", "drive", "other", "--out", "out", "--only", "bslam", "--jobs", "1"]) == 0
    assert lines_of(scene / "out")["bslam"]["runs"] == 2
    said = capsys.readouterr().out
    assert "compare.png" not in said and not (scene / "out" / "compare.png").exists()  # of two lengths
    assert {path.name for path in (scene / "out").glob("*.tum")} >= {"drive_seed0.bslam.estimate.tum"}
    (scene / "pairs_0").symlink_to("drive")  # is no reason to doubt the scenario's name
    assert main(["compare", "pairs", "--only", "orb"]) == 2
    assert "--only orb" in capsys.readouterr().err
    for words, said in {
        ("csv", "drive"): "csv: is no log folder; allowed: paths of log folders, or one SCENARIO",
        ("drvie",): "drvie: is no log folder; allowed: paths of log folders, or one SCENARIO; did you mean "
        "'drive'?",
        ("drive", "./drive"): "another log has its name; allowed: folders of different names",
    }.items():
        assert main(["compare", *words]) == 2
        assert capsys.readouterr().err.strip().endswith(said)
    assert main(["sweep", "drive"]) == 2
    assert "'drive': is a folder; allowed: a name, or a .toml; a log is for " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["--only", "bslam,orb"], ["'orb'", "dead_reckoning"]),
        (["--with", "nowhere_at_all:A"], ["nowhere_at_all", "module:Class"]),
        ([f"--with=strangers_of_compare{tail}:Still" for tail in ("", ".py")], ["Still", "own"]),
        (["--target", "qemu:mps2_an386"], ["--target", "run"]),
        (["--known-map"], ["--known-map", "run"]),
        (["--call-limit", "0"], ["--call-limit", "above 0"]),
    ],
)  # fmt: skip
def test_bad_words_exit_2_and_the_last_line_says_what_is_allowed(scene, capsys, words, parts):
    try:
        status = main(["compare", "drive", *words])
    except SystemExit as error:
        status = error.code
    assert status == 2
    last = capsys.readouterr().err.strip().splitlines()[-1]
    for part in [*parts, "allowed"]:
        assert part.strip("'") in last


def test_who_is_not_installed_or_cannot_do_it_is_left_out(scene, monkeypatch, capsys):
    """MRPT: directions alone are not for it; where it is not installed the command that brings it is said."""
    words = ["compare", "drive", "--association", "known", "--jobs", "1"]
    _, ours, *_, mrpt = shipped_methods(25)
    missing = replace(mrpt, files=("/nowhere/at/all.h",))
    monkeypatch.setattr("bslam.commands.compare.shipped_methods", lambda _every: [ours, missing])
    assert main([*words, "--out", "here"]) == 0
    assert "left out: mrpt (not installed: apt-get install libmrpt-slam-dev)" in capsys.readouterr().err
    assert main([*words, "--only", "mrpt"]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert "mrpt" in last and "allowed: apt-get install libmrpt-slam-dev" in last
    here = replace(mrpt, files=())
    monkeypatch.setattr("bslam.commands.compare.shipped_methods", lambda _every: [ours, here])
    assert main([*words, "--observation", "direction", "--out", "there"]) == 0
    assert "left out: mrpt (only with --observation distance)" in capsys.readouterr().err


def test_full_disk_is_named_by_its_file_and_what_fits_is_kept(scene, made):
    def no_room():  # no file may grow beyond this: the table does not, a trajectory does
        resource.setrlimit(resource.RLIMIT_FSIZE, (16_000, 16_000))

    made.circle_log(300, seed=1).write(scene / "long")
    words = ["compare", "long", "--only", "dead_reckoning", "--jobs", "1", "--pictures", "0", "--out", "out"]
    command = [sys.executable, "-m", "bslam", *words]
    result = subprocess.run(command, preexec_fn=no_room, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    (error,) = lines_of(scene / "out")["dead_reckoning"]["errors"]
    assert "long_seed0.dead_reckoning.estimate.tum: cannot be written: " in error
    assert error in result.stderr
    assert sorted(path.name for path in (scene / "out").iterdir()) == ["compare.json", "summary.json"]


def test_drives_in_direction_only_have_the_bound_below_the_table(tmp_path, capsys):
    words = ["compare", "paper_room", "--observation", "direction", "--only", "bslam,dead_reckoning"]
    assert main([*words, "--association", "known", "--jobs", "1", "--out", str(tmp_path)]) == 0
    bound_m = lines_of(tmp_path)["bslam"]["bound_error_m"]
    assert bound_m == lines_of(tmp_path)["dead_reckoning"]["bound_error_m"] > 0.0
    assert f"bound, a filter linearised at the truth: {100.0 * bound_m:.2f} cm" in capsys.readouterr().out
