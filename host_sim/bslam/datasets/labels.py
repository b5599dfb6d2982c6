"""A user's folder of pictures with `labels.csv`: what is in which picture, read strictly.

One line a box, in any order:

    picture,class,left_px,top_px,right_px,bottom_px,height_m,depth_m
    kitchen_01.jpg,red box,812,400,1033,911,0.3,0.1

`picture` is a file in the folder (or below it), `class` the name of one object or kind. Edges count from the
upper left corner of the upright picture: 0 to its width and height. `height_m` is the real height, `depth_m`
how far the object stands out from the wall, both the same on every line of a class; either may be empty, and
its column may be missing: without a height the class has no distance. A picture with nothing in it stands on
a line with its name alone: what is seen in it is none of the objects.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import ExifTags, Image

from bslam.errors import BslamError
from bslam.modelfile import SIZE_MAX_M, BeaconClass

FILE = "labels.csv"
SIZES = ("height_m", "depth_m")
REQUIRED = ("picture", "class", "left_px", "top_px", "right_px", "bottom_px")
COLUMNS = (*REQUIRED, *SIZES)
EDGES = REQUIRED[2:]


@dataclass(frozen=True)
class Label:
    """A box round one object, edges in pixels from the picture's upper left corner."""

    name: str
    left_px: float
    top_px: float
    right_px: float
    bottom_px: float


@dataclass(frozen=True)
class Picture:
    """One picture of the folder and what is in it."""

    path: Path
    width_px: int
    height_px: int
    labels: tuple[Label, ...]


@dataclass(frozen=True)
class Folder:
    """All that the labels file says; objects in the order of their names."""

    path: Path
    pictures: tuple[Picture, ...]
    objects: tuple[BeaconClass, ...]


def read_folder(path: Path) -> Folder:
    """The labelled pictures of a folder.

    Raises BslamError that names file, line, column, value and what is allowed.
    """
    file = path / FILE
    if not path.is_dir():
        raise BslamError(f"{path}: there is no such folder; allowed: one with pictures and {FILE}")
    if not file.exists():
        allowed = f"one of {', '.join(COLUMNS)}, as tools/label.html or bslam detect import writes it"
        raise BslamError(f"{path}: there is no {FILE} in it; allowed: {allowed}")
    rows = _read_rows(file)
    sizes: dict[str, tuple[int, int]] = {}
    labels: dict[str, list[Label]] = {}
    objects: dict[str, BeaconClass] = {}
    for row in rows:
        name = row.text("picture", "the name of a picture in the folder")
        if name not in sizes:
            sizes[name] = _picture_size(path, row)
            labels[name] = []
        if row.is_picture_alone():
            continue
        label = _label(row, sizes[name])
        labels[name].append(label)
        size = {column: row.size_m(column) for column in SIZES}
        known = objects.setdefault(label.name, BeaconClass(label.name, **size))
        for column in SIZES:
            if size[column] != getattr(known, column):
                allowed = f"{getattr(known, column):g}, as on other lines of {label.name!r}"
                raise row.error(column, allowed)
    pictures = tuple(Picture(path / name, *sizes[name], tuple(labels[name])) for name in sorted(sizes))
    return Folder(path, pictures, tuple(objects[name] for name in sorted(objects)))


@dataclass(frozen=True)
class _Row:
    """A line below the header."""

    file: Path
    line: int
    fields: Mapping[str, str]

    def error(self, column: str, allowed: str) -> BslamError:
        value = self.fields.get(column, "")
        place = f"{self.file}, line {self.line}, column {column}"
        return BslamError(f"{place}: {value!r} is not allowed; allowed: {allowed}")

    def text(self, column: str, allowed: str) -> str:
        text = self.fields[column].strip()
        if not text:
            raise self.error(column, allowed)
        return text

    def number(self, column: str, low: float, high: float) -> float:
        allowed = f"a number from {low:g} to {high:g}"
        try:
            value = float(self.fields[column])
        except ValueError:
            raise self.error(column, allowed) from None
        if not low <= value <= high:
            raise self.error(column, allowed)
        return value

    def size_m(self, column: str) -> float:
        """0 where none is given."""
        return self.number(column, 0.0, SIZE_MAX_M) if self.fields.get(column, "").strip() else 0.0

    def is_picture_alone(self) -> bool:
        return not any(self.fields.get(column, "").strip() for column in COLUMNS[1:])


def _read_rows(file: Path) -> list[_Row]:
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise BslamError(f"{file}: cannot be read: {error}; allowed: a UTF-8 text file") from error
    reader = csv.reader(text.splitlines())
    names = [name.strip() for name in next(reader, [])]
    if sorted(name for name in names if name not in SIZES) != sorted(REQUIRED) or len({*names}) < len(names):
        allowed = f"{','.join(REQUIRED)} and perhaps {','.join(SIZES)}"
        raise BslamError(f"{file}, line 1: columns {','.join(names)!r} are not allowed; allowed: {allowed}")
    return [_row(file, reader.line_num, names, fields) for fields in reader if fields]


def _row(file: Path, line: int, names: Sequence[str], fields: Sequence[str]) -> _Row:
    if len(fields) != len(names):
        place = f"{file}, line {line}"
        raise BslamError(f"{place}: {','.join(fields)!r} has {len(fields)} fields; allowed: {len(names)}")
    return _Row(file, line, dict(zip(names, fields, strict=True)))


def _picture_size(folder: Path, row: _Row) -> tuple[int, int]:
    """Width and height once upright; opening the picture is also the proof that it is there."""
    try:
        name = Path(row.fields["picture"].strip())
        if name.is_absolute() or ".." in name.parts:
            raise row.error("picture", f"a path below {folder}")
        with Image.open(folder / name) as picture:
            # EXIF orientations from 5 on lie on their side.
            lies = picture.getexif().get(ExifTags.Base.Orientation, 1) >= 5
            return picture.size[::-1] if lies else picture.size
    except (OSError, SyntaxError, Image.DecompressionBombError):
        raise row.error("picture", f"a picture in {folder} that can be read (PNG, JPEG)") from None


def _label(row: _Row, size: tuple[int, int]) -> Label:
    name = row.text("class", "the name of an object or kind; a picture without boxes has no edges either")
    sides = (size[0], size[1], size[0], size[1])
    left, top, right, bottom = (
        row.number(column, 0.0, side) for column, side in zip(EDGES, sides, strict=True)
    )
    if not right > left:
        raise row.error("right_px", f"a number above left_px, {left:g}")
    if not bottom > top:
        raise row.error("bottom_px", f"a number above top_px, {top:g}")
    return Label(name, left, top, right, bottom)
