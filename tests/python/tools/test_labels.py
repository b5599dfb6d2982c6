"""bslam/datasets/labels.py: a labels file is read, or refused with line, column and what is allowed."""

from pathlib import Path

import pytest
from PIL import ExifTags, Image

from bslam.datasets.labels import COLUMNS, Label, read_folder
from bslam.errors import BslamError
from bslam.modelfile import BeaconClass

HEADER = ",".join(COLUMNS)
HEIGHTS = HEADER.removesuffix(",depth_m")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two pictures of 100 x 80 and no labels yet."""
    for name in ("a.png", "b.jpg"):
        Image.new("RGB", (100, 80), (200, 180, 160)).save(tmp_path / name)
    return tmp_path


def write_labels(folder: Path, *lines: str, header: str = HEADER) -> Path:
    (folder / "labels.csv").write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return folder


def test_read_folder_gives_boxes_by_picture_and_objects_by_name(folder: Path) -> None:
    write_labels(
        folder,
        "b.jpg,red box,10,20,30,40,0.3,0.1",
        'a.png,"door, left",0,0,100,80,,',
        "",
        "b.jpg,red box,50.5,20,60,79.25,0.3,0.1",
    )
    read = read_folder(folder)
    assert read.objects == (BeaconClass("door, left", 0.0), BeaconClass("red box", 0.3, 0.1))
    assert [picture.path.name for picture in read.pictures] == ["a.png", "b.jpg"]
    assert read.pictures[0].labels == (Label("door, left", 0, 0, 100, 80),)
    assert read.pictures[1].labels[1] == Label("red box", 50.5, 20, 60, 79.25)
    assert (read.pictures[1].width_px, read.pictures[1].height_px) == (100, 80)


def test_read_folder_depth_that_contradicts_is_refused(folder: Path) -> None:
    write_labels(folder, "a.png,door,1,2,3,4,2,0.1", "b.jpg,door,1,2,3,4,2,")
    with pytest.raises(BslamError, match=r"line 3, column depth_m: '' is .* allowed: 0\.1, as on other"):
        read_folder(folder)


def test_read_folder_without_sizes_and_in_another_order_of_columns(folder: Path) -> None:
    header = "class,picture,right_px,left_px,bottom_px,top_px"
    write_labels(folder, "door,a.png,30,10,40,20", header=header)
    read = read_folder(folder)
    assert read.objects == (BeaconClass("door", 0.0),)
    assert read.pictures[0].labels == (Label("door", 10, 20, 30, 40),)


def test_read_folder_picture_alone_has_nothing_in_it(folder: Path) -> None:
    write_labels(folder, "a.png,,,,,,,", "b.jpg,door,1,2,3,4,2,")
    assert [len(picture.labels) for picture in read_folder(folder).pictures] == [0, 1]


def test_read_folder_picture_on_its_side_is_measured_upright(folder: Path) -> None:
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 6
    Image.new("RGB", (100, 80)).save(folder / "a.png", exif=exif)
    read = read_folder(write_labels(folder, "a.png,door,0,0,80,100,,"))
    assert (read.pictures[0].width_px, read.pictures[0].height_px) == (80, 100)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("c.png,door,1,2,3,4,", "line 3, column picture: 'c.png' is not allowed; allowed: a picture in"),
        (",door,1,2,3,4,", "line 3, column picture: '' is not allowed; allowed: the name of a picture"),
        ("labels.csv,door,1,2,3,4,", "line 3, column picture: 'labels.csv' is not allowed"),
        ("a.png,,1,2,3,4,", "line 3, column class: '' is not allowed; allowed: the name of an object"),
        ("a.png,door,-1,2,3,4,", "column left_px: '-1' is not allowed; allowed: a number from 0 to 100"),
        ("a.png,door,1,2,101,4,", "column right_px: '101' is not allowed; allowed: a number from 0 to 100"),
        ("a.png,door,1,2,3,81,", "column bottom_px: '81' is not allowed; allowed: a number from 0 to 80"),
        ("a.png,door,1,nan,3,4,", "column top_px: 'nan' is not allowed; allowed: a number from 0 to 80"),
        ("a.png,door,1,2,,4,", "column right_px: '' is not allowed"),
        ("a.png,door,3,2,3,4,", "column right_px: '3' is not allowed; allowed: a number above left_px, 3"),
        ("a.png,door,1,4,3,2,", "column bottom_px: '2' is not allowed; allowed: a number above top_px, 4"),
        ("a.png,door,1,2,3,4,-2", "column height_m: '-2' is not allowed; allowed: a number from 0 to 10"),
        ("a.png,sign,1,2,3,4,0.4", "column height_m: '0.4' is .* allowed: 0.3, as on other lines of 'sign'"),
        ("a.png,door,1,2,3,4", "line 3: 'a.png,door,1,2,3,4' has 6 fields; allowed: 7"),
    ],
)
def test_read_folder_bad_line_is_refused(folder: Path, line: str, complaint: str) -> None:
    write_labels(folder, "a.png,sign,1,2,3,4,0.3", line, header=HEIGHTS)
    with pytest.raises(BslamError, match=complaint) as caught:
        read_folder(folder)
    assert str(caught.value).startswith(str(folder / "labels.csv"))


@pytest.mark.parametrize(
    ("header", "complaint"),
    [
        ("", "line 1: columns '' are not allowed; allowed: picture,class,"),
        ("picture,left_px,top_px,right_px,bottom_px", "line 1: columns 'picture,left_px"),
        (HEADER + ",colour", "line 1: columns"),
    ],
)
def test_read_folder_bad_header_is_refused(folder: Path, header: str, complaint: str) -> None:
    with pytest.raises(BslamError, match=complaint):
        read_folder(write_labels(folder, header=header))


def test_read_folder_without_any_box_shows_none(folder: Path) -> None:
    found = read_folder(write_labels(folder, "a.png,,,,,,,"))
    assert found.objects == () and [one.labels for one in found.pictures] == [()]


def test_read_folder_takes_no_picture_from_elsewhere(folder: Path) -> None:
    for name in (folder / "a.png", "../a.png"):
        with pytest.raises(BslamError, match="column picture"):
            read_folder(write_labels(folder, f"{name},,,,,,,"))


def test_read_folder_without_labels_file_is_refused(folder: Path) -> None:
    with pytest.raises(BslamError, match=r"there is no labels\.csv in it; allowed: one of picture,"):
        read_folder(folder)
    with pytest.raises(BslamError, match=r"none: there is no such folder; allowed: one with pictures"):
        read_folder(folder / "none")


def test_read_folder_truncated_picture_is_refused_by_its_header(folder: Path) -> None:
    (folder / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(BslamError, match=r"column picture: 'a\.png' is not allowed"):
        read_folder(write_labels(folder, "a.png,door,1,2,3,4,,"))
