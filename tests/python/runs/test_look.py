"""`bslam look`: frames of a drive, a folder and a video with boxes drawn in, and why nothing was seen."""

import re
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from PIL import Image

import bslam
from bslam.cli import main
from bslam.commands import look
from bslam.core.vision import Candidate, Seeing, Told
from bslam.view.frames import RIGHT, UNKNOWN, WRONG, Mark, annotate, contact_sheet

GREEN, RED = (tuple(bytes.fromhex(colour[1:])) for colour in (RIGHT, WRONG))


def candidate(box, **changes):
    """A thing seen."""
    values = {
        "outline": box,
        "bearing_rad": 0.1,
        "bearing_sd_rad": 0.01,
        "range_m": 2.5,
        "range_sd_m": 0.05,
        "range_noise_sd_m": 0.03,
        "beacon_class": 1,
        "kind": "door",
        "class_margin": 1.0,
        "score": 0.7,
        "marks": frozenset(),
        "misplaced_sds": 0.0,
        "signature": np.zeros(71, np.float32),
        "told": Told(0.01, 0.05, 0.02),
    }
    return Candidate(**(values | changes))


@pytest.fixture
def seen(monkeypatch):
    """What a front end that stands in for the C one says of every frame; what it was asked is kept."""
    state = SimpleNamespace(seeing=Seeing((), "nothing"), looked=[])

    class FrontEnd:
        def __init__(self, cameras):
            state.cameras = cameras

        def see(self, rgb, camera, moved):
            state.looked.append((rgb.shape, camera, moved))
            return state.seeing

    monkeypatch.setattr(look, "FrontEnd", FrontEnd)
    return state


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """The paper's room, for ten seconds."""
    text = (Path(bslam.__file__).parent / "scenarios/paper_room.toml").read_text()
    path = tmp_path_factory.mktemp("drive") / "short.toml"
    path.write_text(re.sub(r"(?m)^steps = .*", "steps = 250", text))
    return path


@pytest.fixture
def pictures(tmp_path):
    """A folder with three pictures of one size."""
    folder = tmp_path / "mine"
    folder.mkdir()
    for name in ("b.jpg", "a.png", "c d.png"):
        Image.new("RGB", (640, 480), (90, 120, 150)).save(folder / name)
    return folder


# --- sources ------------------------------------------------------------------------------------------------


def test_look_at_a_drive_takes_the_cameras_in_turn(seen, drive, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["look", str(drive), "--seed", "3", "--frames", "4", "--every", "1", "--out", str(out)]) == 0
    assert [camera for _, camera, _ in seen.looked] == [index % 3 for index in range(len(seen.looked))]
    assert len(seen.looked) == 4 * 5  # five a second, four seconds
    pictures = sorted(path.name for path in out.glob("*.png"))
    assert len(pictures) == 5 and pictures[-1] == "contact_sheet.png"
    printed = capsys.readouterr().out
    assert printed.count("a good frame, nothing seen") == 4
    assert "what came of them: 4 nothing" in printed


def test_look_at_a_drive_green_is_a_beacon_and_red_is_none(seen, drive, tmp_path, monkeypatch):
    seen.seeing = Seeing((candidate((100.0, 60.0, 140.0, 120.0)),), "seen")
    for beacon_id, colour in ((4, GREEN), (-1, RED)):
        monkeypatch.setattr(look, "covering_beacon", lambda outline, identity, found=beacon_id: found)
        assert main(["look", str(drive), "--frames", "1", "--every", "1", "--out", str(tmp_path)]) == 0
        (path,) = tmp_path.glob("0*.png")
        with Image.open(path) as picture:
            side = np.array(picture.convert("RGB"))[3 * 100, 415:425]
        assert np.all(side == colour, axis=1).any()


def test_look_at_a_folder_learns_the_room_first(seen, pictures, tmp_path, capsys):
    assert main(["look", str(pictures), "--out", str(tmp_path / "out")]) == 0
    assert len(seen.looked) == 6 and {shape for shape, _, _ in seen.looked} == {(240, 320, 3)}
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["01_a.png", "02_b.png", "03_c_d.png", "contact_sheet.png"]
    printed = capsys.readouterr().out
    assert "no --rig: directions and distances are those of a camera 60 degrees wide" in printed
    assert "frames shown, by what came of them: 3 nothing\n" in printed


def test_look_shows_all_pictures_of_a_folder_unless_told_how_many(seen, tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    for index in range(14):
        Image.new("RGB", (320, 240), (90, 120, 150)).save(folder / f"{index:02}.png")
    for words, shown in (([], 14), (["--frames", "3"], 3)):
        out = tmp_path / f"out{shown}"
        assert main(["look", str(folder), *words, "--out", str(out)]) == 0
        assert len(list(out.glob("[0-9]*.png"))) == shown


def test_look_with_a_rig_uses_its_camera_and_has_no_caution(seen, pictures, tmp_path, capsys):
    assert main(["look", str(pictures), "--rig", "wide180", "--out", str(tmp_path / "out")]) == 0
    assert seen.cameras[0].lens.kind == "equidistant"
    assert "no --rig" not in capsys.readouterr().out


def test_look_at_a_video_shows_a_frame_every_so_often(seen, tmp_path):
    writer = cv2.VideoWriter(str(tmp_path / "a.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (640, 480))
    for shade in range(60):
        writer.write(np.full((480, 640, 3), 3 * shade, np.uint8))
    writer.release()
    out = tmp_path / "out"
    assert main(["look", str(tmp_path / "a.avi"), "--every", "2", "--out", str(out)]) == 0
    assert len(list(out.glob("0*.png"))) == 3  # of six seconds
    assert len(seen.looked) == 30  # five a second


# --- what is said -------------------------------------------------------------------------------------------


def test_look_says_name_place_and_marks(seen, pictures, tmp_path, capsys):
    seen.seeing = Seeing(
        (
            candidate((10, 10, 50, 90)),
            candidate((60, 10, 90, 90), kind="poster", range_m=None, range_sd_m=None, range_noise_sd_m=None),
            candidate((0, 10, 9, 90), bearing_rad=None, range_m=None, marks=frozenset({"cut_left"})),
        ),
        "seen",
    )
    assert main(["look", str(pictures), "--out", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert "01_a.png: 3 seen\n  door: 2.50 m +5.7° +- 0.6° +- 0.05 m score 0.70\n" in printed
    assert "  poster: +5.7° +- 0.6° score 0.70\n" in printed
    assert "  door: not measured score 0.70 (cut_left)\n" in printed


@pytest.mark.parametrize("reason", ["black", "overexposed"])
def test_look_says_why_nothing_is_seen(seen, pictures, tmp_path, capsys, reason):
    seen.seeing = Seeing((), reason)
    assert main(["look", str(pictures), "--out", str(tmp_path / "out")]) == 0
    assert f"nothing seen: the frame is {reason}" in capsys.readouterr().out


def test_every_reason_of_the_core_has_words():
    from bslam.core.raw import vision_library

    library = vision_library()
    names = {
        library.ffi.string(library.lib.bslam_vision_reason_name(number)).decode()
        for number in range(library.lib.BSLAM_VISION_REASON_COUNT)
    }
    assert names - {"seen"} == set(look._REASONS)


# --- what is refused ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["nowhere"], "nowhere"),
        (["{folder}", "--rig", "nowhere"], "rig 'nowhere': there is no such rig or file"),
        (["{empty}"], "no picture in it; allowed: files named .png"),
        (["{video}"], "cannot be read as a video"),
        (
            ["{folder}/../small", "--rig", "wide180"],
            "is 100x80; allowed: 320x240, its camera's frame, or larger",
        ),
        (["paper_room", "--every", "3000"], "lasts 200 s; allowed: an --every up to that"),
    ],
)
def test_look_bad_source_is_refused(seen, pictures, tmp_path, capsys, words, complaint):
    (tmp_path / "empty").mkdir()
    (tmp_path / "video.mp4").write_bytes(b"no video")
    (tmp_path / "small").mkdir()
    Image.new("RGB", (100, 80)).save(tmp_path / "small/a.png")
    places = {"folder": pictures, "empty": tmp_path / "empty", "video": tmp_path / "video.mp4"}
    out = tmp_path / "out"
    assert main(["look", *(word.format(**places) for word in words), "--out", str(out)]) == 2
    assert complaint in capsys.readouterr().err
    assert not out.exists()


def test_look_picture_of_another_size_is_refused(seen, pictures, tmp_path, capsys):
    Image.new("RGB", (400, 200)).save(pictures / "z.png")
    assert main(["look", str(pictures), "--out", str(tmp_path / "out")]) == 2
    assert "z.png: is 400x200; allowed: 320x240" in capsys.readouterr().err


# --- drawing ------------------------------------------------------------------------------------------------


def test_annotate_draws_the_box_where_it_is():
    rgb = np.full((240, 320, 3), 60, np.uint8)
    mark = Mark((99.5, 59.5, 139.5, 119.5), ("door", "2.50 m"), RIGHT)
    picture = np.array(annotate(rgb, [mark], "a frame"))
    assert picture.shape == (3 * 240 + 30, 3 * 320, 3)
    green = np.all(picture == GREEN, axis=2)
    assert green[180, 300:420].all() and green[360, 300:420].all()
    assert green[180:360, 300].all() and green[180:360, 420].all()
    assert not green[190:350, 310:410].any()


def test_annotate_keeps_words_in_the_frame():
    rgb = np.zeros((240, 320, 3), np.uint8)
    picture = np.array(annotate(rgb, [Mark((310, -0.5, 319, 239), ("a long name", "9.99 m"), UNKNOWN)], ""))
    yellow = np.all(picture[:720] == tuple(bytes.fromhex(UNKNOWN[1:])), axis=2)
    assert yellow[:60, :900].any()  # words stand left of the box, which starts at column 931


@pytest.mark.parametrize(("count", "size"), [(1, (480, 384)), (4, (1938, 384)), (5, (1938, 774))])
def test_contact_sheet_has_rows_of_four(count, size):
    pictures = [Image.new("RGB", (960, 768), (10 * index, 0, 0)) for index in range(count)]
    assert contact_sheet(pictures).size == size
