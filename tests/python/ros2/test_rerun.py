"""`bslam live --rerun` with a stub of rerun-sdk, which is too large to be installed for a test."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

import bslam
from bslam.cli import main

SCENARIOS = Path(bslam.__file__).parent / "scenarios"


class Stream:
    """Keeps what is logged: time, entity, kind, and what it was made of."""

    made: ClassVar["list[Stream]"] = []

    def __init__(self, name: str) -> None:
        self.name, self.time_s, self.saved = name, -1.0, ""
        self.logged: list[tuple[float, str, Any]] = []
        Stream.made.append(self)

    def save(self, path: str) -> None:
        Path(path).write_bytes(b"")  # as rerun-sdk does, at once
        self.saved = path

    def set_time(self, timeline: str, *, duration: float) -> None:
        assert timeline == "drive" and duration >= self.time_s
        self.time_s = duration

    def log(self, entity: str, content: Any, static: bool = False) -> None:
        self.logged.append((-1.0 if static else self.time_s, entity, content))

    def spawn(self) -> None:
        self.saved = "viewer"

    def flush(self, *, timeout_sec: float) -> None:
        assert timeout_sec < 60.0
        if self.saved == "viewer":
            raise RuntimeError("gRPC connection severed: Unknown error, uri: x")
        self.flushed = True

    def disconnect(self) -> None:
        self.disconnected = True

    def of(self, entity: str) -> list[tuple[float, Any]]:
        return [(time_s, content) for time_s, name, content in self.logged if name == entity]


@pytest.fixture
def rerun(monkeypatch: pytest.MonkeyPatch) -> type[Stream]:
    module = ModuleType("rerun")

    def kind(name: str) -> Any:
        return lambda *values, **more: SimpleNamespace(kind=name, values=values, **more)

    for name in ("LineStrips3D", "Points3D", "Arrows3D", "Transform3D", "RotationAxisAngle", "Scalars"):
        setattr(module, name, kind(name))
    module.RecordingStream = Stream  # type: ignore[attr-defined]
    module.ViewCoordinates = SimpleNamespace(RIGHT_HAND_Z_UP="up")  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "rerun", module)
    Stream.made = []
    return Stream


def short_room(folder: Path) -> Path:
    path = folder / "room.toml"
    path.write_text((SCENARIOS / "paper_room.toml").read_text().replace("steps = 5000", "steps = 200"))
    return path


def test_a_run_is_followed_to_its_end(tmp_path: Path, rerun: type[Stream]) -> None:
    room, file = short_room(tmp_path), tmp_path / "room.rrd"
    words = ["live", str(room), "--rerun", str(file), "--speed", "inf", "--out", str(tmp_path / "out")]
    assert main(words) == 0
    (stream,) = rerun.made
    assert stream.saved == str(file) and stream.flushed and stream.disconnected
    robot = [(time_s, one) for time_s, one in stream.of("world/robot") if one.kind == "Transform3D"]
    assert len(robot) == 201  # every step and the start
    assert robot[-1][0] == pytest.approx(8.0)
    estimate = np.loadtxt(next((tmp_path / "out").glob("*.estimate.tum")))
    np.testing.assert_allclose([one.translation[:2] for _, one in robot], estimate[:, 1:3], atol=1e-6)
    assert len(stream.of("plots/error_m")) == 201
    _, rings = stream.of("world/map/ellipses")[-1]
    _, spots = stream.of("world/map")[-1]
    assert rings.values[0].shape == (len(spots.labels), 25, 3)
    middles = rings.values[0][:, :24].mean(axis=1)
    np.testing.assert_allclose(middles, spots.values[0], atol=1e-9)
    _, path = stream.of("world/path")[-1]
    assert path.values[0].shape == (1, 201, 3)


@pytest.mark.parametrize(
    ("target", "said"),
    [("x.txt", "FILE.rrd"), ("x.rrd", "which is missing: {python} -m pip install rerun-sdk")],
)
def test_what_cannot_be_followed_is_one_line(
    target: str, said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert main(["live", "paper_room", "--rerun", target]) == 2
    told = capsys.readouterr().err
    assert said.format(python=sys.executable) in told and told.count("\n") == 1


def test_without_a_screen_a_file_is_offered(
    tmp_path: Path,
    rerun: type[Stream],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    words = ["live", str(short_room(tmp_path)), "--speed", "inf", "--out", str(tmp_path / "out"), "--rerun"]
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    assert main(words) == 2
    assert "--rerun: no screen for its viewer here; allowed: --rerun FILE.rrd" in capsys.readouterr().err
    assert rerun.made == []
    monkeypatch.setenv("DISPLAY", ":0")
    assert main(words) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "its viewer has gone (gRPC connection severed: Unknown error); allowed: --rerun FILE.rrd" in told


def test_a_stopped_run_says_what_is_left(
    tmp_path: Path,
    rerun: type[Stream],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bslam.commands.live.follow", stop)
    file = tmp_path / "room.rrd"
    words = ["live", str(short_room(tmp_path)), "--rerun", str(file), "--out", str(tmp_path / "out")]
    assert main(words) == 1
    assert f": {file} ends there\n" in capsys.readouterr().out


def test_a_run_that_cannot_be_leaves_the_file(tmp_path: Path, rerun: type[Stream]) -> None:
    file = tmp_path / "keep.rrd"
    file.write_text("mine")
    assert main(["live", "paper_rom", "--rerun", str(file)]) == 2
    assert main(["live", "csv", str(tmp_path), "--rerun", str(file)]) == 2
    assert file.read_text() == "mine" and rerun.made == []
