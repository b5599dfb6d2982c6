"""The playground in a browser: the same bits as on the host, logs that are dropped, the words of `check`."""

import csv
import gzip
import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.log import Log
from bslam.logcheck.check import check_folder
from bslam.logcheck.files import check_files
from bslam.options import RunOptions
from bslam.runs.runner import run_log
from logcheck.drives import made_up, with_odometry, with_robot, with_sightings

ROOT = Path(__file__).resolve().parents[3]
FILE = ROOT / "out" / "playground" / "index.html"
BEACONS_MAX = 80  # of mk/playground.mk
FINGERPRINT_START = 0xCBF29CE484222325
DROP = """files => {
    const transfer = new DataTransfer();
    for (const [name, text] of Object.entries(files)) {
        transfer.items.add(new File([text], name));
    }
    window.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, cancelable: true }));
}"""


@pytest.fixture(scope="session")
def built() -> Path:
    subprocess.run(["make", "--silent", str(FILE.relative_to(ROOT))], cwd=ROOT, check=True)
    return FILE


@pytest.fixture
def playground(built: Path, page: Page) -> Page:
    """The page, standing still."""
    page.goto(built.as_uri())
    page.evaluate("setPlaying(false)")
    return page


@pytest.fixture(scope="module")
def functions(built: Path, browser: Browser) -> Iterator[Page]:
    """The page for its functions alone, which leave no trace on it."""
    faults: list[str] = []
    with browser.new_page() as one:
        one.on("pageerror", lambda error: faults.append(str(error)))
        one.goto(built.as_uri())
        one.evaluate("setPlaying(false)")
        yield one
    assert faults == []


def texts_of(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir()}


def folder_of(log, path: Path) -> Path:
    log.write(path)
    return path


def figures(page: Page) -> str:
    return page.locator("#figures").inner_text()


# ---- one file ---------------------------------------------------------------------------------------------


def test_playground_is_one_small_file_that_asks_for_nothing(built, page):
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    began = time.monotonic()
    page.goto(built.as_uri())
    expect(page.locator("#figures")).to_contain_text("beacons in the map")
    assert time.monotonic() - began < 10.0
    assert page.evaluate("page.drive.beacons.length") > 0
    assert asked == [built.as_uri()]
    assert built.stat().st_size <= 400_000


@pytest.mark.parametrize("width", [360, 800, 1920])
def test_playground_fits_its_window(playground, width):
    playground.set_viewport_size({"width": width, "height": 740})
    assert playground.evaluate("document.documentElement.scrollWidth") <= width
    assert playground.locator("#map").bounding_box()["width"] > 0.6 * width


def test_playground_all_of_the_stage_is_on_a_screen(playground, tmp_path):
    playground.set_viewport_size({"width": 1920, "height": 960})
    assert playground.evaluate("document.documentElement.scrollHeight") <= 960
    room = playground.locator("#map").bounding_box()
    assert room["height"] > 400
    for has_truth in (True, False):
        log = made_up(seconds=10.0, has_truth=has_truth)
        playground.evaluate(DROP, texts_of(folder_of(log, tmp_path / str(has_truth))))
        expect(playground.locator("#legend .truePath")).to_be_visible(visible=has_truth)
        expect(playground.locator("#legend .trueBeacons")).to_be_visible(visible=not has_truth)
        expect(playground.locator("#plots")).to_be_visible(visible=has_truth)
        assert playground.evaluate("document.documentElement.scrollHeight") <= 960
    assert playground.locator("#map").bounding_box()["height"] > 1.4 * room["height"]
    playground.get_by_role("button", name="Back to the room").click()
    expect(playground.locator("#legend .trueBeacons")).to_be_visible()
    assert playground.locator("#map").bounding_box() == room


def test_playground_on_a_phone_shows_what_became_of_the_files(playground, tmp_path):
    playground.set_viewport_size({"width": 390, "height": 740})
    (picture := tmp_path / "holiday.png").write_bytes(b"\x89PNG")
    files = playground.locator("#files")
    files.set_input_files(picture)
    expect(playground.locator("#message")).to_contain_text("holiday.png: no file of a log")
    assert playground.evaluate("scrollY") == 0  # where the button is
    expect(playground.locator("#message")).to_be_in_viewport(ratio=1)
    playground.evaluate("scrollTo(0, 600)")
    expect(playground.locator("#message")).to_be_in_viewport(ratio=1)
    playground.evaluate("scrollTo(0, 0)")
    files.set_input_files(sorted(folder_of(made_up(seconds=10.0), tmp_path / "drive").iterdir()))
    expect(playground.locator("#title")).to_have_text("log: 0 findings")
    expect(playground.locator("#map")).to_be_in_viewport(ratio=1)


def test_playground_a_path_is_seen_and_so_is_what_it_sees(playground, tmp_path):
    """Also where all is in millimetres, and beacons may be anywhere."""
    good = made_up(seconds=20.0)
    in_all = with_odometry(in_mm(good), a=1e3 * good.odometry.a, b=1e3 * good.odometry.b)
    for number, log in enumerate((good, in_all)):
        playground.evaluate(DROP, texts_of(folder_of(log, tmp_path / str(number))))
        expect(playground.locator("#title")).to_have_text(f"log: {number} finding{'s' * (1 - number)}")
        seen, path, missing = playground.evaluate(
            """() => {
                const { replay, result } = page.shown;
                const [path, scene] = [boundsOf(replay.poses), boundsOfLog(replay, result)];
                const isOut = ({ x, y }) =>
                    x < scene.left || x > scene.right || y < scene.bottom || y > scene.top;
                const missing = result.beacons.filter(isOut).length;
                return [scene.right - scene.left, path.right - path.left, missing];
            }"""
        )
        assert path > 0.2 * seen and (missing == 0 or log is in_all)


def test_playground_names_are_on_top(playground):
    last = playground.evaluate(
        """() => {
            const drawn = [];
            for (const name of ["stroke", "ellipse", "fillText"]) {
                const real = CanvasRenderingContext2D.prototype[name];
                CanvasRenderingContext2D.prototype[name] = function (...given) {
                    if (this.canvas.id === "map") drawn.push(name);
                    return real.apply(this, given);
                };
            }
            show();
            return [drawn.indexOf("fillText"), drawn.lastIndexOf("ellipse"), drawn.lastIndexOf("stroke")];
        }"""
    )
    assert last[0] > max(last[1:]) > 0


def test_playground_legend_has_the_colours_of_the_lines(playground):
    pairs = playground.evaluate(
        """() => ["truth", "estimate", "odometry", "right", "wrong", "new", "rejected"].map(name => {
            const swatch = document.querySelector(`#legend i.line.${name}`);
            const pen = document.createElement("canvas").getContext("2d");
            pen.fillStyle = themeColours()[name];
            const probe = document.createElement("i");
            probe.style.color = pen.fillStyle;
            document.body.append(probe);
            return [getComputedStyle(swatch).borderTopColor, getComputedStyle(probe).color];
        })"""
    )
    assert all(legend == line for legend, line in pairs)
    assert len({legend for legend, _ in pairs}) == 7


# ---- the robot in its room --------------------------------------------------------------------------------


def driven(page: Page, steps: int, **choices) -> dict:
    """A drive with a slip and a kidnapping, and all that went in and came out."""
    return page.evaluate(
        """([steps, choices]) => {
            const drive = new Drive({ ...readChoices(), ...choices, keepsInputs: true });
            for (let step = 0; step < steps; step++) {
                if (step === 100) drive.world.slip();
                if (step === 200) drive.world.kidnap();
                drive.step(step < 60 ? { forward: 1, turn: 0.3 } : null);
            }
            const inputs = drive.estimator.inputs.map(([what, ...rest]) => what === "odometry"
                ? [what, ...rest.slice(0, 4)]
                : [what, rest[0], rest[1].map(one => [one.bearingRad, isNaN(one.rangeM) ? null : one.rangeM,
                    one.label])]);
            return { inputs, settings: drive.settings, pose: drive.estimator.pose(),
                fingerprint: drive.estimator.fingerprint(), beacons: drive.estimator.beacons(),
                states: [...new Set(drive.sightings.map(one => one.verdict))], counts: drive.ledger.counts };
        }""",
        [steps, choices],
    )


def fed(settings: dict, inputs: list) -> Slam:
    """The host's estimator after the same inputs."""
    slam = Slam(settings, beacons_max=BEACONS_MAX)
    for what, *rest in inputs:
        if what == "odometry":
            slam.odometry(*rest)
            continue
        time_us, seen = rest
        bearings, ranges, labels = map(list, zip(*seen, strict=True)) if seen else ([], [], [])
        ranges = [np.nan if one is None else one for one in ranges]
        slam.sightings(time_us, bearings, ranges, labels, [True] * len(seen))
    return slam


@pytest.mark.parametrize(
    "choices",
    [
        {"filter": "invariant", "association": "known"},
        {"filter": "standard", "association": "mahalanobis", "wheelNoise": 0.3},
        {"filter": "invariant", "association": "position", "beacons": 8},
        {"filter": "smoother", "association": "known", "observation": "direction"},
    ],
    ids=lambda choices: "-".join(map(str, choices.values())),
)
def test_playground_state_is_the_hosts_to_the_bit(functions, choices):
    drive = driven(functions, 300, **choices)
    slam = fed(drive["settings"], drive["inputs"])
    assert int(drive["fingerprint"], 16) == slam.fingerprint(FINGERPRINT_START)
    pose = drive["pose"]
    assert (pose["x"], pose["y"], pose["theta"]) == slam.pose()
    assert tuple(pose["lower"]) == slam.pose_covariance_lower()
    host = [
        (one.uid, one.label, one.x_m, one.y_m, *one.covariance_m2[[0, 0, 1], [0, 1, 1]])
        for one in slam.beacons()
    ]
    names = ("uid", "label", "x", "y", "xx", "xy", "yy")
    assert [tuple(one[name] for name in names) for one in drive["beacons"]] == host
    assert drive["counts"]["right"] > 300


def test_playground_a_seed_decides_the_drive(functions):
    prints = [driven(functions, 60, seed=seed)["fingerprint"] for seed in (5, 5, 6)]
    assert prints[0] == prints[1] != prints[2]


def test_playground_a_filter_that_is_told_too_little_noise_is_inconsistent(functions):
    nees = [
        functions.evaluate(
            """told => {
                const drive = new Drive({ ...readChoices(), seed: 2, toldNoise: told });
                for (let step = 0; step < 600; step++) drive.step(null);
                return drive.meanNees.value;
            }""",
            told,
        )
        for told in (1, 0.25)
    ]
    assert nees[0] < 5.0 < 8.0 < nees[1]


def test_playground_is_driven_by_keys(playground):
    before = playground.evaluate("page.drive.world.pose")
    playground.keyboard.down("ArrowUp")
    playground.evaluate("takeSteps(50)")
    playground.keyboard.up("ArrowUp")
    after = playground.evaluate("page.drive.world.pose")
    assert after["x"] - before["x"] > 0.8 and abs(after["y"] - before["y"]) < 0.4
    expect(playground.locator("#self")).not_to_be_checked()
    playground.evaluate("takeSteps(60)")  # it brakes, and stands
    stands = playground.evaluate("page.drive.world.pose")
    playground.evaluate("takeSteps(20)")
    assert playground.evaluate("page.drive.world.pose") == stands


def test_playground_pauses_steps_and_starts_anew(playground):
    first = playground.evaluate("page.drive.world.step")
    playground.get_by_role("button", name="Step").click()
    assert playground.evaluate("page.drive.world.step") == first + 1
    text = playground.locator("#figures td").first.inner_text()
    playground.get_by_role("button", name="Go on").click()
    expect(playground.locator("#figures td").first).not_to_have_text(text)
    playground.get_by_role("button", name="Pause").click()
    playground.locator("#association").select_option("mahalanobis")
    assert playground.evaluate("page.drive.world.step === FIRST_STEPS")
    assert playground.evaluate("page.drive.beacons.every(one => one.label === -1)")


def test_playground_the_space_bar_pauses_after_a_click_too(playground):
    slips = "page.drive.world.slipUntilUs"
    for click in ("Slip", "Go on", "turn left"):
        playground.get_by_role("button", name=click).click()
        playground.evaluate(f"setPlaying(true); {slips} = 0")
        playground.keyboard.press("Space")
        assert playground.evaluate(f"[page.isPlaying, {slips}]") == [False, 0]
    playground.locator("#self").click()
    playground.keyboard.press("Space")
    assert playground.evaluate("[page.isPlaying, element('self').checked]") == [True, True]
    playground.evaluate("setPlaying(false)")
    playground.get_by_role("button", name="Slip").press("Space")  # come to by the tab key
    assert playground.evaluate(f"[page.isPlaying, {slips} > 0]") == [False, True]


@pytest.mark.parametrize("seed", ["-5", "", "1.5", "1000000"])
def test_playground_takes_no_other_seed_than_it_shows(playground, seed):
    drive = playground.evaluate_handle("page.drive")
    for again in (lambda: None, playground.get_by_role("button", name="Restart").click):
        playground.locator("#seed").fill(seed)
        again()
        said = f"seed '{seed}' is not allowed; allowed: an integer from 0 to 999999"
        expect(playground.locator("#message")).to_have_text(said)
        assert playground.evaluate("drive => page.drive === drive", drive)
    playground.locator("#seed").fill("4")
    expect(playground.locator("#message")).to_be_hidden()
    assert playground.evaluate("page.drive.choices.seed") == 4


def test_playground_a_kidnapped_robot_finds_itself(playground):
    playground.evaluate("takeSteps(700); page.drive.world.kidnap(); takeSteps(5)")
    assert playground.evaluate("lastOf(page.drive.errors, 1)") > 1.0
    playground.evaluate("takeSteps(500)")
    assert playground.evaluate("lastOf(page.drive.errors, 1)") < 0.3
    assert "following" in figures(playground)


# ---- logs -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["wheels", "ticks", "velocity"])
def test_playground_a_dropped_log_ends_where_replay_does(playground, tmp_path, kind):
    folder = folder_of(made_up(kind=kind), tmp_path / "drive")
    playground.evaluate(DROP, texts_of(folder))
    expect(playground.locator("#title")).to_have_text("log: 0 findings")
    trace = run_log(Log.read(folder), RunOptions(sensor="recorded"))
    poses = playground.evaluate("page.shown.replay.poses.map(one => [one.x, one.y, one.theta])")
    assert np.array_equal(np.array(poses), trace.pose)
    beacons = playground.evaluate("page.shown.result.beacons.map(one => [one.x, one.y])")
    assert beacons == [[one.x_m, one.y_m] for one in trace.beacons]
    expect(playground.locator("#figures")).to_contain_text("error of the map")
    playground.get_by_role("button", name="Back to the room").click()
    expect(playground.locator("#title")).to_have_text("A robot in a room")


def test_playground_takes_a_folder_that_is_dropped(playground, tmp_path):
    folder = folder_of(made_up(seconds=20.0), tmp_path / "my_drive")
    (folder / "notes.txt").write_text("no part of a log")
    (folder / "deeper").mkdir()
    session = playground.context.new_cdp_session(playground)
    dragged = {"items": [], "files": [str(folder)], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        session.send("Input.dispatchDragEvent", {"type": kind, "x": 99, "y": 99, "data": dragged})
    expect(playground.locator("#title")).to_have_text("my_drive: 0 findings")
    assert playground.evaluate("document.body.className") == ""


def test_playground_other_choices_run_the_log_anew(playground, tmp_path):
    folder = folder_of(made_up(), tmp_path / "drive")
    playground.evaluate(DROP, texts_of(folder))
    expect(playground.locator("#title")).to_have_text("log: 0 findings")
    playground.locator("#filter").select_option("standard")
    playground.locator("#association").select_option("joint")
    expect(playground.locator("#message")).to_be_hidden()
    options = RunOptions(sensor="recorded", filter="standard", association="joint")
    last = run_log(Log.read(folder), options).pose[-1]
    playground.wait_for_timeout(300)
    poses = playground.evaluate("page.shown.replay.poses.map(one => [one.x, one.y, one.theta])")
    assert poses[-1] == last.tolist()


MEANWHILE = {
    "back while it runs": ("runLog(page.shown.checked, other)", "element('room').click()"),
    "back while it is read": ("loadFiles(again)", "element('room').click()"),
    "back while it is checked": (
        "loadFiles(again)",
        """new MutationObserver((_, observer) => {
            observer.disconnect();
            element("room").click();
        }).observe(element("message"), { childList: true })""",
    ),
    "a bad drop while it runs": ("runLog(page.shown.checked, other)", "loadFiles(bad)"),
    "a bad drop, then choices": ("loadFiles(bad)", "runLog(page.shown.checked, other)"),
}


def test_playground_what_is_asked_last_stays(playground, tmp_path):
    texts = texts_of(folder_of(made_up(seconds=10.0), tmp_path / "drive"))
    shown = {}
    for name, (first, then) in MEANWHILE.items():
        playground.evaluate(DROP, texts)
        expect(playground.locator("#title")).to_have_text("log: 0 findings")
        shown[name] = playground.evaluate(
            f"""async texts => {{
                const files = Object.entries(texts).map(([name, text]) => new File([text], name));
                const again = {{ name: "again", files }};
                const bad = {{ name: "bad", files: [new File([""], "holiday.csv")] }};
                const other = {{ ...readChoices(), filter: "standard" }};
                writeChoices(other);
                await Promise.all([{first}, {then}]);
                const texted = ["title", "message"].map(id => element(id).textContent.slice(0, 15));
                return [...texted, element("filter").value, page.shown?.replay.choices.filter];
            }}""",
            texts,
        )
        playground.evaluate("page.shown && backToRoom()")
        expect(playground.locator("#message")).to_be_hidden()
    assert shown == {
        "back while it runs": ["A robot in a ro", "", "invariant", None],
        "back while it is read": ["A robot in a ro", "", "invariant", None],
        "back while it is checked": ["A robot in a ro", "", "invariant", None],
        "a bad drop while it runs": ["log: 0 findings", "holiday.csv: no", "invariant", "invariant"],
        "a bad drop, then choices": ["log: 0 findings", "", "standard", "standard"],
    }


def test_playground_a_log_leaves_the_keys_to_the_browser(playground, tmp_path):
    pressed = """() => ["Space", "ArrowDown"].map(code => document.body.dispatchEvent(
        new KeyboardEvent("keydown", { code, bubbles: true, cancelable: true })))"""
    playground.evaluate(DROP, texts_of(folder_of(made_up(seconds=10.0), tmp_path / "drive")))
    expect(playground.locator("#title")).to_have_text("log: 0 findings")
    expect(playground.locator("#help")).not_to_contain_text("arrow keys", use_inner_text=True)
    assert playground.evaluate(pressed) == [True, True]
    assert playground.evaluate("[page.isPlaying, element('self').checked]") == [False, True]
    playground.get_by_role("button", name="Back to the room").click()
    assert playground.evaluate(pressed) == [False, False]


def test_playground_a_message_goes_when_the_room_starts_anew(playground):
    for anew in ("element('restart').click()", "onChoice()"):
        playground.evaluate(DROP, {"holiday.csv": "a,b"})
        expect(playground.locator("#message")).to_contain_text("holiday.csv: no file of a log")
        playground.evaluate(anew)
        expect(playground.locator("#message")).to_be_hidden()


def test_playground_counts_the_text_that_a_packed_file_holds(functions):
    said = functions.evaluate(
        """async ([text, packed]) => {
            const file = new File([new Uint8Array(packed)], "truth.csv.gz");
            const whole = (await textOf(file)) === text;
            return [whole, await textOf(file, 1).catch(error => error.message)];
        }""",
        [text := "\u00b5" * 600_000, list(gzip.compress(text.encode()))],
    )
    assert said == [
        True,
        "truth.csv.gz: cannot be read: it holds too much text; allowed: at most 1 MB of UTF-8 text, "
        "gzipped if named .gz",
    ]


def without(name):
    return lambda texts: {key: text for key, text in texts.items() if key != name}


def instead(name, change):
    return lambda texts: {**texts, name: change(texts[name])}


BAD_DROPS = {
    "another file": (lambda _: {"holiday.csv": "a,b\n1,2\n"}, "holiday.csv: no file of a log"),
    "no robot.toml": (
        without("robot.toml"),
        "robot.toml is missing; a log needs odometry.csv, sightings.csv, robot.toml, all at once; "
        "docs/LOG-FORMAT.md, 'Your own robot's log', has one to copy",
    ),
    "a name in capitals": (
        lambda texts: {key.replace("odometry.csv", "Odometry.CSV"): text for key, text in texts.items()},
        "Odometry.CSV: is no name of a log's file; allowed: odometry.csv",
    ),
    "an empty file": (instead("odometry.csv", lambda _: ""), "odometry.csv: is empty; allowed: columns time"),
    "semicolons": (
        instead("odometry.csv", lambda text: text.replace(",", ";").replace(".", ",")),
        "; commas separate columns, not ';', and 0.5 is written with a point",
    ),
    "tabs": (instead("odometry.csv", lambda text: text.replace(",", "\t")), r"columns, not '\t', and 0.5"),
    "a column without a name": (
        instead("odometry.csv", lambda text: text.replace("time_us", ",time_us", 1)),
        "; column 1 has no name: of pandas? to_csv(..., index=False)",
    ),
    "a column twice": (
        instead("odometry.csv", lambda text: text.replace("right_m", "left_m", 1)),
        "; 'left_m' is there twice",
    ),
    "no sightings": (without("sightings.csv"), "sightings.csv is missing"),
    "no rows": (instead("odometry.csv", lambda text: text.splitlines()[0]), "odometry.csv: no rows below"),
    "columns": (
        instead("odometry.csv", lambda text: text.replace("left_m", "lef_m")),
        "odometry.csv, line 1: columns 'time_us,lef_m,right_m' are not allowed; allowed: time_us,",
    ),
    "a word": (
        instead("sightings.csv", lambda text: text.replace("0.", "zero", 1)),
        "sightings.csv, line 2, column",
    ),
    "a short row": (instead("odometry.csv", lambda text: text + "1,2\n"), "'1,2' has 2 fields; allowed: 3"),
    "a picture": (instead("odometry.csv", lambda _: "\x89PNG\0"), "odometry.csv, line 1: columns"),
    "no TOML": (instead("robot.toml", lambda _: "wheels: 2"), "robot.toml: not TOML: 'wheels: 2' (line 1)"),
    "a key": (
        instead("robot.toml", lambda text: text.replace("wheelbase_m", "wheelbase")),
        "robot.toml, key wheelbase: no such key; allowed: wheelbase_m,",
    ),
    "beyond its range": (
        instead("robot.toml", lambda text: text.replace("wheelbase_m = 0.3", "wheelbase_m = 300")),
        "robot.toml, key wheelbase_m: 300 is not allowed; allowed: a number from 0.001 to 10",
    ),
    "a key twice": (
        instead("robot.toml", lambda text: text + "wheelbase_m = 0.5\n"),
        "robot.toml: not TOML: 'wheelbase_m = 0.5' (line 17); allowed: each key once",
    ),
    "a table twice": (
        instead("robot.toml", lambda text: text + "[settings]\ngate_d2 = 9\n[settings]\n"),
        "robot.toml: not TOML: '[settings]' (line 19); allowed: each key once",
    ),
    "no number of TOML": (
        instead("robot.toml", lambda text: text.replace("wheelbase_m = 0.3", "wheelbase_m = .3")),
        "robot.toml: not TOML: 'wheelbase_m = .3' (line 1); allowed: lines of key = value",
    ),
    "a name of JavaScript": (
        instead("robot.toml", lambda text: text + "__proto__ = 9\n"),
        "robot.toml, key __proto__: no such key; allowed: wheelbase_m,",
    ),
    "a setting's word": (
        instead("robot.toml", lambda text: text + "[settings]\ngate_d2 = '9'\n"),
        "robot.toml, key settings: {'gate_d2': '9'} is not allowed; allowed: a table of",
    ),
    "a setting": (
        instead("robot.toml", lambda text: text + "[settings]\nfilte = 1\n"),
        "robot.toml, [settings], key filte: no such setting; allowed: wheelbase_m,",
    ),
}


def test_playground_names_what_is_no_log_and_stays_as_it_is(playground, tmp_path):
    good = texts_of(folder_of(made_up(seconds=10.0), tmp_path / "drive"))
    before = figures(playground)
    for change, message in BAD_DROPS.values():
        playground.evaluate("say('')")
        playground.evaluate(DROP, change(good))
        expect(playground.locator("#message")).to_contain_text(message)
        assert "allowed" in (said := playground.locator("#message").inner_text()) or "needs" in said
        assert "\n" not in said
        assert figures(playground) == before
        expect(playground.locator("#title")).to_have_text("A robot in a room")


def test_playground_reads_quotes_as_the_strict_reader_does(functions):
    lines = ["".join(letters) for count in range(1, 7) for letters in product('a,"', repeat=count)]
    fields = [next(csv.reader([line]), [""]) if '"' in line else line.split(",") for line in lines]
    assert functions.evaluate("lines => lines.map(fieldsOf)", lines) == fields


def test_playground_identities_with_commas_outlast_what_is_put_right(functions, tmp_path):
    texts = texts_of(folder_of(made_up(seconds=10.0), tmp_path / "drive"))
    head, *rows = scaled(texts["sightings.csv"], "bearing_rad", 180.0 / np.pi).splitlines()
    quoted = [",".join((time_us, f'"shelf {one}, ""left"""', *rest)) for time_us, one, *rest in
              (row.split(",") for row in rows)]  # fmt: skip
    texts["sightings.csv"] = "\n".join([head, *quoted]) + "\n"
    del texts["beacons.csv"]
    found = functions.evaluate(
        """texts => {
            const findings = checkFiles(texts);
            const log = readLog("log", texts);
            return [findings[0].kind, log.words[0], log.sightings.id.length];
        }""",
        texts,
    )
    assert found == ["degrees", 'shelf 0, "left"', len(rows)]


@pytest.mark.parametrize("name", ["nanoseconds", "repeated", "degrees", "clock back"])
def test_playground_draws_no_log_other_than_it_is(playground, tmp_path, name):
    file, spoil = SPOILT_FILES[name]
    folder = folder_of(made_up(seconds=25.0), tmp_path / "drive")
    (folder / file).write_text(spoil((folder / file).read_text()))
    found = check_files(folder, tmp_path / "copy")
    try:
        trace = run_log(Log.read(folder), RunOptions(sensor="recorded"))
    except BslamError as refused:
        before = figures(playground)
        playground.evaluate(DROP, texts_of(folder))
        said = str(refused).replace(f"{folder}/", "")
        said += "".join(f"; check finds: {one.what}; mend: {one.mend}" for one in found)
        expect(playground.locator("#message")).to_have_text(said)
        expect(playground.locator("#title")).to_have_text("A robot in a room")
        assert figures(playground) == before and name in ("degrees", "clock back")
    else:
        playground.evaluate(DROP, texts_of(folder))
        expect(playground.locator("#findings")).to_contain_text(found[0].what)
        poses = playground.evaluate("page.shown.replay.poses.map(one => [one.x, one.y, one.theta])")
        assert np.array_equal(np.array(poses), trace.pose) and name in ("nanoseconds", "repeated")


def test_playground_a_replay_ends_where_nobody_wants_it(functions, tmp_path):
    texts = texts_of(folder_of(made_up(seconds=90.0), tmp_path / "drive"))
    steps = functions.evaluate(
        """async texts => {
            const log = readLog("log", texts);
            const run = isWanted => new Replay(log, usualChoices(log)).run(isWanted);
            return [(await run(() => false)).poses.length, (await run(() => true)).poses.length];
        }""",
        texts,
    )
    assert steps[0] < steps[1] == 90 * 25 + 1


def test_playground_says_what_the_strict_reader_says(playground, tmp_path):
    good = folder_of(made_up(seconds=10.0), tmp_path / "drive")
    texts = texts_of(good)
    for name in (
        "no rows",
        "columns",
        "a word",
        "a short row",
        "a key",
        "beyond its range",
        "a name in capitals",
        "an empty file",
        "semicolons",
        "tabs",
        "a column without a name",
        "a column twice",
    ):
        changed = BAD_DROPS[name][0](texts)
        for path in good.iterdir():
            path.unlink()
        for file, text in changed.items():
            (good / file).write_text(text)
        with pytest.raises(BslamError) as refused:
            Log.read(good)
        playground.evaluate("say('')")
        playground.evaluate(DROP, changed)
        expect(playground.locator("#message")).to_contain_text("allowed")
        said = playground.locator("#message").inner_text()
        assert str(refused.value).replace(f"{good}/", "").split("; a log needs")[0].split(": ", 1)[1] in said


def scaled(text: str, column: str, factor: float, whole: bool = False) -> str:
    """The text of a csv file with a column multiplied."""
    head, *lines = text.splitlines()
    place = head.split(",").index(column)
    rows = [line.split(",") for line in lines]
    for row in rows:
        value = factor * float(row[place])
        row[place] = str(round(value)) if whole else repr(value)
    return "\n".join([head, *(",".join(row) for row in rows)]) + "\n"


def cut(text: str, *parts: slice) -> str:
    """The text of a csv file with these rows of it."""
    head, *lines = text.splitlines()
    return "\n".join([head, *(line for part in parts for line in lines[part])]) + "\n"


def mirrored(log):
    return with_sightings(log, bearing_rad=-log.sightings.bearing_rad)


def swapped(log):
    return with_odometry(log, a=log.odometry.b, b=log.odometry.a)


def backward(log):
    return with_odometry(log, a=-log.odometry.b, b=-log.odometry.a)


def in_mm(log):
    return with_sightings(log, range_m=1e3 * log.sightings.range_m)


def turned(log):
    yaw = np.pi - np.mod(-log.sightings.bearing_rad, 2 * np.pi)
    return with_sightings(log, bearing_rad=yaw)


def hanging(log):
    s = log.sightings
    first = [int(np.argmax(s.beacon_id == one)) for one in s.beacon_id]
    return with_sightings(log, bearing_rad=s.bearing_rad[first], range_m=s.range_m[first])


SPOILT_LOGS = {
    "mirrored": mirrored,
    "mirrored, no truth": lambda log: replace(mirrored(log), beacons=None),
    "swapped": swapped,
    "backward": backward,
    "sensor looks backward": turned,
    "a mirrored map": lambda log: replace(log, beacons=replace(log.beacons, y_m=-log.beacons.y_m)),
    "millimetres": in_mm,
    "millimetres and mirrored": lambda log: mirrored(in_mm(log)),
    "odometry in centimetres": lambda log: with_odometry(log, a=1e2 * log.odometry.a, b=1e2 * log.odometry.b),
    "sums of travel": lambda log: with_odometry(log, a=log.odometry.a.cumsum(), b=log.odometry.b.cumsum()),
    "speeds of wheels": lambda log: with_odometry(log, a=25 * log.odometry.a, b=25 * log.odometry.b),
    "ticks as metres": lambda log: with_odometry(log, a=5e3 * log.odometry.a, b=5e3 * log.odometry.b),
    "no identities": lambda log: with_sightings(log, beacon_id=np.full_like(log.sightings.beacon_id, -1)),
    "a detector that hangs": hanging,
    "another time": lambda log: with_sightings(log, time_us=log.sightings.time_us + 10**9),
    "at rest": lambda log: with_odometry(log, a=0 * log.odometry.a, b=0 * log.odometry.b),
    "good": lambda log: log,
}
SPOILT_FILES = {
    "degrees": ("sightings.csv", lambda text: scaled(text, "bearing_rad", 180.0 / np.pi)),
    "nanoseconds": ("sightings.csv", lambda text: scaled(text, "time_us", 1e3, True)),
    "odometry in seconds": ("odometry.csv", lambda text: scaled(text, "time_us", 1e-6)),
    "milliseconds": ("odometry.csv", lambda text: scaled(text, "time_us", 1e-3, True)),
    "repeated": ("odometry.csv", lambda text: cut(text, slice(300), slice(297, None))),
    "clock back": ("sightings.csv", lambda text: cut(text, slice(300, None), slice(300))),
    "gap": ("odometry.csv", lambda text: cut(text, slice(500), slice(600, None))),
}


def words(findings) -> list[tuple[str, ...]]:
    return [tuple(one[name] for name in ("kind", "what", "sure", "mend")) for one in findings]


@pytest.mark.parametrize("name", SPOILT_LOGS)
def test_playground_says_of_a_spoilt_log_what_check_says(functions, tmp_path, name):
    folder = folder_of(SPOILT_LOGS[name](made_up(seconds=40.0)), tmp_path / "drive")
    found = functions.evaluate("async texts => (await checkLog('log', texts)).findings", texts_of(folder))
    host = [vars(one) for one in check_folder(folder).findings if not one.is_note]
    assert words(found) == words(host)  # and the figures in them
    assert (found == []) == (name in ("good", "at rest"))


@pytest.mark.parametrize("name", SPOILT_FILES)
def test_playground_says_of_spoilt_files_what_check_says(functions, tmp_path, name):
    file, spoil = SPOILT_FILES[name]
    folder = folder_of(made_up(seconds=25.0), tmp_path / "drive")
    (folder / file).write_text(spoil((folder / file).read_text()))
    found = functions.evaluate("texts => checkFiles(texts)", texts_of(folder))
    host = [vars(one) for one in check_files(folder, tmp_path / "copy")]
    assert words(found) == words(host) != []


@pytest.mark.parametrize("delay_s", [0.12, 0.35])
def test_playground_a_delay_is_named_nearly_as_check_names_it(functions, tmp_path, delay_s):
    log = made_up()
    late = with_sightings(log, time_us=log.sightings.time_us + round(1e6 * delay_s))
    texts = texts_of(folder_of(late, tmp_path / "drive"))
    (found,) = functions.evaluate("async texts => (await checkLog('log', texts)).findings", texts)
    assert found["kind"] == "delay" and "ms late against odometry" in found["what"]
    setting, value_us = found["mend"].split("=")
    assert setting == "--set sighting_delay_us"
    assert int(value_us) == pytest.approx(1e6 * delay_s, abs=30_000)


def test_playground_takes_files_that_are_chosen_and_packed(playground, tmp_path):
    folder = folder_of(with_robot(made_up(seconds=20.0), sensor_yaw_rad=0.5), tmp_path / "drive")
    packed = folder / "odometry.csv.gz"
    packed.write_bytes(gzip.compress((folder / "odometry.csv").read_bytes()))
    (folder / "odometry.csv").unlink()
    playground.locator("#files").set_input_files(sorted(folder.iterdir()))
    expect(playground.locator("#back")).to_be_visible()
    trace = run_log(Log.read(folder), RunOptions(sensor="recorded"))
    poses = playground.evaluate("page.shown.replay.poses.map(one => [one.x, one.y, one.theta])")
    assert poses[-1] == trace.pose[-1].tolist()
