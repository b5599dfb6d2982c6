"""Labels of other tools' formats as labels.csv: COCO's json and YOLO's text files."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from PIL import Image, ImageOps

from bslam.datasets.labels import FILE, REQUIRED
from bslam.datasets.pictures import SUFFIXES
from bslam.errors import BslamError

Row = tuple[str, str, str, str, str, str]


def import_labels(kind: str, source: Path, pictures: Path, names: Path | None) -> tuple[Path, int]:
    """Writes labels.csv into the folder of pictures; where, and how many boxes.

    BslamError: an unknown format, a file that cannot be read, a bad label, labels.csv is there.
    """
    if not pictures.is_dir():
        raise BslamError(f"{pictures}: is no folder; allowed: the folder of the pictures")
    target = pictures / FILE
    if target.exists():
        raise BslamError(f"{target}: is there already; allowed: a folder without one")
    if kind == "coco":
        rows = list(_coco(source, pictures))
    elif kind == "yolo":
        rows = list(_yolo(source, pictures, names))
    else:
        raise BslamError(f"detect import {kind}: is not allowed; allowed: coco, yolo")
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([REQUIRED, *rows])
    part = target.with_suffix(".part")
    part.write_text(text.getvalue(), encoding="utf-8")
    part.replace(target)  # a file cut short would stand in the way of the next try
    return target, sum(bool(row[1]) for row in rows)


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BslamError(f"{file}: cannot be read: {error}; allowed: a UTF-8 text file") from error


def _size(picture: Path) -> tuple[int, int]:
    try:
        with Image.open(picture) as opened:
            return ImageOps.exif_transpose(opened).size
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise BslamError(f"{picture}: cannot be read: {error}; allowed: a picture (PNG, JPEG)") from error


def _row(
    name: str, kind: str, box: tuple[float, float, float, float], size: tuple[int, int], where: str
) -> Row:
    """Boxes that reach over the edge by what was rounded end there; what is farther out is refused."""
    left, top, right, bottom = box
    width, height = size
    is_inside = left >= -1.0 and top >= -1.0 and right <= width + 1.0 and bottom <= height + 1.0
    if not (is_inside and right > left and bottom > top):
        raise BslamError(
            f"{where}: the box {left:g},{top:g},{right:g},{bottom:g} is not in {name}, {width}x{height}"
        )
    edges = (max(left, 0.0), max(top, 0.0), min(right, float(width)), min(bottom, float(height)))
    first, second, third, last = (f"{edge:.2f}" for edge in edges)
    return name, kind, first, second, third, last


def _coco(source: Path, pictures: Path) -> Iterator[Row]:
    try:
        document = json.loads(source.read_text(encoding="utf-8"))
        kinds = {one["id"]: str(one["name"]) for one in document["categories"]}
        images: Mapping[Any, str] = {one["id"]: str(one["file_name"]) for one in document["images"]}
        boxes = [
            (one["image_id"], one["category_id"], [float(x) for x in one["bbox"]])
            for one in document["annotations"]
        ]
    except (OSError, UnicodeDecodeError, ValueError, KeyError, TypeError) as error:
        allowed = "COCO's json with images, categories and annotations"
        raise BslamError(f"{source}: cannot be read: {error!r}; allowed: {allowed}") from error
    by: dict[Any, list[tuple[int, str, list[float]]]] = {one: [] for one in images}
    for number, (image, category, box) in enumerate(boxes):
        where = f"{source}, annotations[{number}]"
        if image not in images or category not in kinds or len(box) != 4:
            raise BslamError(f"{where}: its image_id, category_id or bbox is not allowed")
        by[image].append((number, kinds[category], box))
    for image, name in sorted(images.items(), key=lambda pair: pair[1]):
        size = _size(pictures / name)
        if not by[image]:
            yield name, "", "", "", "", ""
        for number, kind, (left, top, width, height) in by[image]:
            where = f"{source}, annotations[{number}]"
            yield _row(name, kind, (left, top, left + width, top + height), size, where)


def _yolo(source: Path, pictures: Path, names: Path | None) -> Iterator[Row]:
    if names is None or not names.is_file():
        raise BslamError(f"--names {names}: allowed: a text file with the classes' names, a line each")
    kinds = [one.strip() for one in _text(names).splitlines()]
    files = sorted(one for one in pictures.iterdir() if one.suffix.lower() in SUFFIXES)
    if not files:
        raise BslamError(f"{pictures}: no picture in it; allowed: files named {', '.join(SUFFIXES)}")
    # Of a picture without a file nobody said what is in it.
    pairs = [(one, source / f"{one.stem}.txt") for one in files if (source / f"{one.stem}.txt").is_file()]
    if not pairs:
        raise BslamError(f"{source}: has a file for none of the pictures; allowed: NAME.txt beside NAME.jpg")
    for picture, labels in pairs:
        size = _size(picture)
        lines = [line for line in _text(labels).splitlines() if line.strip()]
        if not lines:
            yield picture.name, "", "", "", "", ""
        for number, line in enumerate(lines):
            yield _yolo_row(line, f"{labels}, line {number + 1}", kinds, picture.name, size)


def _yolo_row(line: str, where: str, kinds: list[str], name: str, size: tuple[int, int]) -> Row:
    try:
        index, *values = line.split()
        kind = kinds[int(index)] if int(index) >= 0 else ""
        x, y, width, height = (float(value) for value in values)
        if not kind:
            raise ValueError
    except (ValueError, IndexError):
        allowed = f"class 0 to {len(kinds) - 1}, then x, y, width, height as shares of the picture"
        raise BslamError(f"{where}: {line!r} is not allowed; allowed: {allowed}") from None
    left, top = (x - width / 2) * size[0], (y - height / 2) * size[1]
    return _row(name, kind, (left, top, left + width * size[0], top + height * size[1]), size, where)
