"""`bslam live`, clicked on in a real browser."""

import contextlib
import json
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

import bslam
from bslam.cli import main
from bslam.options import RunOptions
from bslam.runs.output import tum
from bslam.runs.runner import run_log
from bslam.runs.sources import CameraSource

STATUS = re.compile(r"(running|paused|finished|failed) · step (\d+) of (\d+)")


@dataclass(frozen=True)
class Command:
    process: "subprocess.Popen[str]"
    url: str

    def end(self) -> tuple[int, str]:
        """Exit status after Ctrl-C, and all that was printed since the address."""
        self.process.send_signal(signal.SIGINT)
        output, _ = self.process.communicate(timeout=30)
        return self.process.returncode, output


@contextlib.contextmanager
def live(*words: object, out: Path) -> Iterator[Command]:
    """The command with these words, on any port, from its address on."""
    arguments = [sys.executable, "-m", "bslam", "live", *map(str, words)]
    arguments += ["--port", "0", "--no-browser", "--out", str(out)]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout is not None
        found = re.search(r"http://\S+", line := process.stdout.readline())
        assert found, line
        yield Command(process, found[0].rstrip(";"))
    finally:
        process.kill()
        process.communicate()


def status(page: Page) -> tuple[str, int]:
    """State and step, as the page says."""
    found = STATUS.search(page.get_by_text(STATUS).inner_text())
    assert found
    return found[1], int(found[2])


def click(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


@pytest.fixture
def short(tmp_path: Path) -> Path:
    """The paper's room for 60 steps."""
    world = (Path(bslam.__file__).parent / "scenarios/paper_room.toml").read_text(encoding="utf-8")
    assert "steps = 5000\n" in world
    path = tmp_path / "short.toml"
    path.write_text(world.replace("steps = 5000\n", "steps = 60\n"), encoding="utf-8")
    return path


def test_live_pause_step_and_speed_act_on_the_running_filter(page: Page, tmp_path: Path) -> None:
    with live("paper_room", "--paused", "--association", "known", out=tmp_path) as command:
        page.goto(command.url)
        expect(page.get_by_text("paused · step 0 of 5000")).to_be_visible()
        for step in (1, 2, 3):
            click(page, "Step")
            expect(
                page.get_by_text(f"paused · step {step} of 5000 · time {0.04 * step:.2f} s")
            ).to_be_visible()
        click(page, "Play")
        expect(page.get_by_text(re.compile(r"running · step \d\d"))).to_be_visible()
        click(page, "Pause")
        expect(page.get_by_text("paused · step")).to_be_visible()
        state, paused_at = status(page)
        page.wait_for_timeout(300)
        assert status(page) == (state, paused_at)
        assert page.get_by_text("fused").count() > 0  # the account of each sighting
        click(page, "Step")
        expect(page.get_by_text(f"paused · step {paused_at + 1} of")).to_be_visible()
        click(page, "as fast as it goes")
        click(page, "Play")
        expect(page.get_by_text("finished · step 5000 of 5000")).to_be_visible()
        returned, output = command.end()
    assert returned == 0
    assert "paper_room_seed0" in output
    # What was watched is what `bslam run` gives.
    run = ["run", "paper_room", "--association", "known", "--pictures", "0", "--out", str(tmp_path / "run")]
    assert main(run) == 0
    watched, alone = (
        (folder / "paper_room_seed0.estimate.tum").read_text() for folder in (tmp_path, tmp_path / "run")
    )
    assert watched == alone
    assert json.loads((tmp_path / "summary.json").read_text())["runs"][0]["steps"] == 5000


def test_live_camera_shows_its_frames_and_what_became_of_what_it_saw(
    page: Page, short: Path, tmp_path: Path
) -> None:
    with live(short, "--sensor", "camera", "--speed", "inf", out=tmp_path) as command:
        page.goto(command.url)
        expect(page.get_by_text("finished · step 60 of 60")).to_be_visible()
        picture = page.get_by_role("img", name="camera")
        assert picture.evaluate("image => image.naturalWidth") == 960
        expect(page.get_by_text("fused").first).to_be_visible()
        assert command.end()[0] == 0
    # What the eye sees step by step is what a drive that was rendered first has.
    source = CameraSource(str(short), 0, None, None, "three60", tmp_path / "store")
    options = RunOptions(
        association="svm", sensor="camera", rig="three60", noise="speedometer", sigma_mps=0.3
    )
    log = source.load()
    assert len(log.sightings.time_us) > 5
    trace = run_log(log, options)
    watched = (tmp_path / "short_seed0.estimate.tum").read_text()
    assert watched == tum(trace.time_us, trace.pose)
    entry = json.loads((tmp_path / "summary.json").read_text())["runs"][0]
    assert entry["sightings"] == len(log.sightings.time_us)


def test_live_recording_plays_as_it_was_recorded(page: Page, short: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    assert main(["run", str(short), "--record", "--pictures", "0", "--out", str(out)]) == 0
    with live(out / "short_seed0.mcap", "--paused", out=tmp_path / "live") as command:
        page.goto(command.url)
        click(page, "Step")
        expect(page.get_by_text("paused · step 1 of 60 · time 0.04 s")).to_be_visible()
        click(page, "as fast as it goes")
        click(page, "Play")
        expect(page.get_by_text("finished · step 60 of 60")).to_be_visible()
        assert command.end()[0] == 0
    recorded = (out / "short_seed0.estimate.tum").read_text()
    assert (tmp_path / "live/short_seed0.estimate.tum").read_text() == recorded
    entry = json.loads((tmp_path / "live/summary.json").read_text())["runs"][0]
    assert entry["recording"]["different"] == 0 and entry["recording"]["states"] > 50


def test_live_says_what_was_wrong_and_fits_a_phone(page: Page, short: Path, tmp_path: Path) -> None:
    words = [short, "--association", "known:0.4", "--set", "gate_d2=0", "--speed", "inf"]
    page.set_viewport_size({"width": 360, "height": 740})
    with live(*words, out=tmp_path) as command:
        page.goto(command.url)
        expect(page.get_by_text("finished · step 60 of 60")).to_be_visible()
        expect(page.get_by_role("heading", name="bslam live: short_seed0: known:0.4")).to_be_visible()
        wrong = page.get_by_text(re.compile(r"(fused|new beacon), WRONG")).first
        right = page.get_by_text("fused", exact=True).nth(1)  # the first is the legend's
        expect(wrong).to_be_visible()
        colours = [one.evaluate("one => getComputedStyle(one).color") for one in (wrong, right)]
        assert colours[0] != colours[1]
        # The legend has the colours that rows and rays have.
        drawn = page.locator(".key line").evaluate_all("all => all.map(one => getComputedStyle(one).stroke)")
        assert set(colours) <= set(drawn)
        for width in (360, 700, 1920):
            page.set_viewport_size({"width": width, "height": 740})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert command.end()[0] == 0


def test_live_waits_for_a_browser_and_begins_again(page: Page, short: Path, tmp_path: Path) -> None:
    with live(short, "--speed", "inf", out=tmp_path) as command:
        with urllib.request.urlopen(command.url) as answer:  # asks for the page and shows it nobody
            answer.read()
        time.sleep(0.5)
        assert not (tmp_path / "summary.json").exists()
        page.goto(command.url)
        expect(page.get_by_text("finished · step 60 of 60")).to_be_visible()
        (tmp_path / "summary.json").unlink()
        click(page, "1/4")
        click(page, "Again")
        expect(page.get_by_text(re.compile("running · step [12345] of 60"))).to_be_visible()
        click(page, "as fast as it goes")
        expect(page.get_by_text("finished · step 60 of 60")).to_be_visible()
        page.set_viewport_size({"width": 1920, "height": 1000})  # all of both plots
        assert page.evaluate("document.documentElement.scrollHeight") <= 1000
        rights = page.locator(".parts > div").evaluate_all(
            "all => all.map(one => one.getBoundingClientRect().right)"
        )
        assert max(rights) > 1600  # and no third of the screen is empty
        assert command.end()[0] == 0
    assert (tmp_path / "summary.json").exists()


def test_live_two_pages_show_one_run(page: Page, tmp_path: Path) -> None:
    with live("paper_room", "--paused", out=tmp_path) as command:
        page.goto(command.url)
        second = page.context.new_page()
        second.goto(command.url)
        expect(second.get_by_text("paused · step 0 of 5000")).to_be_visible()
        click(page, "Step")
        expect(second.get_by_text("paused · step 1 of 5000")).to_be_visible()
        returned, output = command.end()
    assert returned == 1
    assert "stopped at step 1 of 5000" in output


def test_live_names_are_texts_and_a_lost_connection_comes_back(
    page: Page, short: Path, tmp_path: Path
) -> None:
    named = short.rename(short.with_name("<i>short.toml"))
    connections: list[tuple[WebSocketRoute, WebSocketRoute]] = []
    page.route_web_socket(re.compile(""), lambda one: connections.append((one, one.connect_to_server())))
    with live(named, "--paused", out=tmp_path / "out") as command:
        page.goto(command.url)
        expect(page.get_by_role("heading", name="bslam live: <i>short_seed0: ")).to_be_visible()
        second = page.context.new_page()
        second.goto(command.url)
        chosen = second.locator("button.bk-active")
        expect(chosen).to_have_text("1")
        click(page, "16")
        click(page, "Step")
        expect(second.get_by_text("paused · step 1 of 60")).to_be_visible()
        expect(chosen).to_have_text("16")
        for end in connections[-1]:
            end.close(code=1001)
        click(second, "Step")
        expect(page.get_by_text("paused · step 2 of 60")).to_be_visible()
        click(page, "Step")
        expect(second.get_by_text("paused · step 3 of 60")).to_be_visible()
        command.end()


def test_live_busy_port_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        words = ["live", "paper_room", "--no-browser", "--port", str(port), "--out", str(tmp_path)]
        assert main(words) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith(f"bslam live: error: --port {port}: another program has it; allowed: ")
