"""detect/imports.py: labels of COCO's json and YOLO's text files become labels.csv."""

import json

import pytest
from PIL import Image

from bslam.cli import main
from bslam.datasets.labels import read_folder
from bslam.detect.imports import import_labels
from bslam.errors import BslamError


@pytest.fixture
def pictures(tmp_path):
    folder = tmp_path / "pictures"
    folder.mkdir()
    for name in ("a.png", "b.png", "c.png"):
        Image.new("RGB", (200, 100)).save(folder / name)
    return folder


def coco(folder, **changes):
    document = {
        "images": [{"id": 7, "file_name": "a.png"}, {"id": 9, "file_name": "b.png"}],
        "categories": [{"id": 1, "name": "door"}],
        "annotations": [{"image_id": 7, "category_id": 1, "bbox": [10, 20, 30, 40]}],
    }
    file = folder / "coco.json"
    file.write_text(json.dumps(document | changes))
    return file


def labels_of(folder):
    return [
        (
            one.path.name,
            [(its.name, its.left_px, its.top_px, its.right_px, its.bottom_px) for its in one.labels],
        )
        for one in read_folder(folder).pictures
    ]


def test_coco(tmp_path, pictures, capsys):
    words = ["detect", "import", "coco", str(coco(tmp_path)), "--pictures", str(pictures)]
    assert main(words) == 0
    assert "1 boxes written" in capsys.readouterr().out
    assert labels_of(pictures) == [("a.png", [("door", 10, 20, 40, 60)]), ("b.png", [])]
    assert main(words) == 2
    assert "is there already" in capsys.readouterr().err


def test_yolo_and_pictures_nobody_looked_at(tmp_path, pictures):
    labels = tmp_path / "labels"
    labels.mkdir()
    (labels / "a.txt").write_text("1 0.5 0.5 0.2 0.4\n0 0.1 0.5 0.2 1.0\n")
    (labels / "b.txt").write_text("")
    (tmp_path / "names.txt").write_text("sign\ndoor\n")
    import_labels("yolo", labels, pictures, tmp_path / "names.txt")
    assert labels_of(pictures) == [
        ("a.png", [("door", 80, 30, 120, 70), ("sign", 0, 0, 40, 100)]),
        ("b.png", []),
    ]


def test_what_is_not_allowed_is_named(tmp_path, pictures):
    def refused(said, kind, source, names=None):
        with pytest.raises(BslamError) as caught:
            import_labels(kind, source, pictures, names)
        assert said in str(caught.value)
        assert not (pictures / "labels.csv").exists()

    outside = [{"image_id": 7, "category_id": 1, "bbox": [150, 20, 80, 40]}]
    refused(
        "annotations[0]: the box 150,20,230,60 is not in a.png, 200x100",
        "coco",
        coco(tmp_path, annotations=outside),
    )
    unknown = [{"image_id": 8, "category_id": 1, "bbox": [1, 2, 3, 4]}]
    refused("annotations[0]: its image_id", "coco", coco(tmp_path, annotations=unknown))
    refused("cannot be read", "coco", coco(tmp_path, images=[{}]))
    refused("allowed: coco, yolo", "voc", tmp_path)
    refused("--names None", "yolo", tmp_path)
    (tmp_path / "names.txt").write_text("sign\n")
    (tmp_path / "a.txt").write_text("1 0.5 0.5 0.2 0.4\n")
    refused("a.txt, line 1: '1 0.5 0.5 0.2 0.4' is not allowed", "yolo", tmp_path, tmp_path / "names.txt")
    (tmp_path / "a.txt").write_text("-1 0.5 0.5 0.2 0.4\n")
    refused("a.txt, line 1", "yolo", tmp_path, tmp_path / "names.txt")
    (tmp_path / "a.txt").write_text("0 nan 0.5 0.2 0.4\n")
    refused("a.txt, line 1: the box nan", "yolo", tmp_path, tmp_path / "names.txt")
    (tmp_path / "elsewhere").mkdir()
    refused("has a file for none of the pictures", "yolo", tmp_path / "elsewhere", tmp_path / "names.txt")
    (tmp_path / "a.txt").write_text("0 0.5 0.5 0.2\n")
    refused("a.txt, line 1", "yolo", tmp_path, tmp_path / "names.txt")
