"""Labelled pictures as a scanner sees them: reduced to a frame, boxes in the frame's pixels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.datasets.labels import Folder, Picture, read_folder
from bslam.datasets.pictures import Scaled, load_picture
from bslam.detect.boxes import Floats
from bslam.errors import BslamError


@dataclass(frozen=True)
class Example:
    """A picture reduced to a frame; boxes (n, 4) of each class in it."""

    name: str
    frame: NDArray[np.uint8]  # (h, w, 3)
    boxes: Mapping[str, Floats]
    scaled: Scaled

    def of(self, kind: str) -> Floats:
        """The boxes of a class."""
        return self.boxes.get(kind, np.empty((0, 4)))

    def in_picture(self, box: Sequence[float]) -> tuple[float, float, float, float]:
        """A box of the frame in the pixels of the picture as it is."""
        left, top, right, bottom = (edge / self.scaled.scale for edge in box)
        x, y = self.scaled.left_px, self.scaled.top_px
        return left + x, top + y, right + x, bottom + y


@dataclass(frozen=True)
class Collection:
    """All pictures of some folders. heights_m: of each class; 0: not known."""

    examples: tuple[Example, ...]
    heights_m: Mapping[str, float]

    @property
    def kinds(self) -> tuple[str, ...]:
        return tuple(sorted(self.heights_m))


def read_collection(paths: Sequence[Path], wanted: Sequence[str] = ()) -> Collection:
    """The pictures of folders with labels.csv; of the wanted classes, all unless given.

    Boxes of other classes are no examples: what is in them is none of the wanted. BslamError names folder,
    file, line, and what is allowed.
    """
    examples: list[Example] = []
    heights_m: dict[str, float] = {}
    for path in paths:
        folder = read_folder(path)
        for one in folder.objects:
            known = heights_m.setdefault(one.name, one.height_m)
            if known != one.height_m:
                raise BslamError(
                    f"{path}: {one.name!r} is {one.height_m:g} m high, in a folder before {known:g} m; "
                    "allowed: one height a class, or two names"
                )
        examples += [_example(folder, one) for one in folder.pictures]
    if not heights_m:
        raise BslamError(f"{paths[0]}: no box in it; allowed: a box in one of the folders at least")
    missing = sorted(set(wanted) - set(heights_m))
    if missing:
        raise BslamError(f"class {missing[0]!r} is in no folder; allowed: {', '.join(sorted(heights_m))}")
    kept = {name: height_m for name, height_m in heights_m.items() if not wanted or name in wanted}
    return Collection(tuple(examples), kept)


def _example(folder: Folder, picture: Picture) -> Example:
    scaled = load_picture(picture.path)
    height, width = scaled.rgb.shape[:2]
    boxes: dict[str, list[Floats]] = {}
    for label in picture.labels:
        edges = scaled.box(label.left_px, label.top_px, label.right_px, label.bottom_px)
        clipped = np.clip(np.array(edges) + 0.5, 0.0, [width, height, width, height])
        if clipped[2] > clipped[0] and clipped[3] > clipped[1]:  # else it is in what was cut off
            boxes.setdefault(label.name, []).append(clipped)
    name = str(picture.path.relative_to(folder.path))
    return Example(name, scaled.rgb, {kind: np.array(its) for kind, its in boxes.items()}, scaled)
