"""Labelled pictures become training samples: signatures that the C core itself computes.

A picture is scaled to a frame that the front end takes. What is in its boxes, and every candidate that lies
on one, is an example of the box's class; candidates that lie on no box are examples of what is none of the
objects, and so are the generic seeds that come with the library.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bslam.core.appearance import rendered_seeds
from bslam.core.vision import BeaconModel, Candidate
from bslam.datasets.labels import FILE, Folder, Label
from bslam.datasets.pictures import Box, Scaled, camera_for, load_picture
from bslam.errors import BslamError
from bslam.rig import Camera
from tools.training.front_end import FrontEnd
from tools.training.truth import areas, intersections, overlaps

NONE = -1
"""The label of what is none of the objects."""

SAME_OVERLAP = 0.5  # intersection over union from which a candidate is of a box
TOUCH = 0.1  # share of a candidate on a box above which it is no example of something else
# A box drawn by hand is not the detector's: each is also taken with its sides moved by this share of it.
SHAKES = 4
SHAKE = 0.06


@dataclass(frozen=True)
class Samples:
    """Signatures (n, 71) with labels (n,), an index into the folder's objects or NONE, and picture (n,).

    `counts` (n,) is False for the extra samples of shaken boxes, which would count a box several times;
    `generic` (n,) is True for the seeds that come with the library.
    """

    signatures: NDArray[np.float32]
    labels: NDArray[np.int64]
    pictures: NDArray[np.int64]
    counts: NDArray[np.bool_]
    generic: NDArray[np.bool_]
    boxes: Counter[str]  # labelled boxes by class
    found: Counter[str]  # and how many of them the front end found by itself
    useless: dict[str, str]  # pictures that the front end sees nothing in, and its reason


@dataclass
class _Collected:
    signatures: list[NDArray[np.float32]] = field(default_factory=list)
    labels: list[int] = field(default_factory=list)
    pictures: list[int] = field(default_factory=list)
    counts: list[bool] = field(default_factory=list)

    def add(
        self, signature: NDArray[np.float32] | None, label: int, picture: int, counts: bool = True
    ) -> None:
        if signature is not None and signature.any():
            self.signatures.append(signature)
            self.labels.append(label)
            self.pictures.append(picture)
            self.counts.append(counts)


def collect(folder: Folder, camera: Camera | None = None, model: BeaconModel | None = None) -> Samples:
    """The samples of all pictures, taken by `camera`, or by one 60 degrees wide that looks straight ahead.

    `model` finds candidates (the built-in one unless given).
    The pictures are taken for one room, and are looked at twice in the order of their names: first the front
    end learns the room's colours, which signatures are measured against, as it does on a robot.
    BslamError if an object has no sample at all, or samples from one picture only.
    """
    frames = [load_picture(picture.path, camera) for picture in folder.pictures]
    sizes = {frame.size_px for frame in frames}
    front_ends = {size: FrontEnd([camera or camera_for(*size)], model) for size in sizes}
    for frame in frames:
        front_ends[frame.size_px].see(frame.rgb)
    collected, found = _Collected(), Counter[str]()
    useless = {}
    for index, (picture, frame) in enumerate(zip(folder.pictures, frames, strict=True)):
        front_end = front_ends[frame.size_px]
        seeing = front_end.see(frame.rgb)
        if seeing.reason in ("seen", "nothing"):
            boxes = [_in_frame(frame, label) for label in picture.labels]
            names = [label.name for label in picture.labels]
            view = _View(front_end, boxes, [_index_of(folder, name) for name in names], index)
            _add_boxes(collected, view)
            owners = _add_candidates(collected, view, seeing.candidates)
            found.update(names[owner] for owner in owners)
        else:
            useless[picture.path.name] = seeing.reason
    own = len(collected.labels)
    for index, seed in enumerate(rendered_seeds()):
        collected.add(seed, NONE, index % len(frames))
    drawn = Counter(label.name for picture in folder.pictures for label in picture.labels)
    _check(folder, collected, drawn)
    return Samples(
        np.array(collected.signatures, dtype=np.float32),
        np.array(collected.labels, dtype=np.int64),
        np.array(collected.pictures, dtype=np.int64),
        np.array(collected.counts, dtype=np.bool_),
        np.arange(len(collected.labels)) >= own,
        drawn,
        found,
        useless,
    )


@dataclass(frozen=True)
class _View:
    """A picture that the front end has just looked at: its labelled boxes, and their indices of objects."""

    front_end: FrontEnd
    boxes: list[Box]
    objects: list[int]
    picture: int


def _in_frame(frame: Scaled, label: Label) -> Box:
    return frame.box(label.left_px, label.top_px, label.right_px, label.bottom_px)


def _index_of(folder: Folder, name: str) -> int:
    return next(index for index, one in enumerate(folder.objects) if one.name == name)


def _add_boxes(collected: _Collected, view: _View) -> None:
    """Labelled boxes, as drawn and shaken."""
    random = np.random.default_rng(view.picture)
    for box, label in zip(view.boxes, view.objects, strict=True):
        collected.add(view.front_end.signature(box), label, view.picture)
        for one in _shaken(box, random):
            collected.add(view.front_end.signature(one), label, view.picture, counts=False)


def _add_candidates(collected: _Collected, view: _View, candidates: Sequence[Candidate]) -> set[int]:
    """What the front end found by itself; the labelled boxes that are among it."""
    owners = _owners(candidates, view.boxes)
    for candidate, owner in zip(candidates, owners, strict=True):
        if owner is not None:
            label = NONE if owner == NONE else view.objects[owner]
            collected.add(candidate.signature, label, view.picture)
    return {owner for owner in owners if owner is not None and owner != NONE}


def folder_sha256(folder: Folder) -> str:
    """Of the labels file and the pictures, in the order of their names."""
    digest = hashlib.sha256((folder.path / FILE).read_bytes())
    for picture in folder.pictures:
        digest.update(picture.path.read_bytes())
    return digest.hexdigest()


def _owners(candidates: Sequence[Candidate], boxes: list[Box]) -> list[int | None]:
    """For each candidate the index of the box that it is of, NONE, or None where it is neither.

    One that is cut off by the frame or lies on a part of a box says nothing of either.
    """
    if not candidates:
        return []
    if not boxes:
        return [None if _is_cut(one) else NONE for one in candidates]
    outlines, targets = np.array([one.outline for one in candidates]), np.array(boxes)
    overlap = overlaps(outlines, targets)
    shares = intersections(outlines, targets) / areas(outlines)[:, None]
    touches: NDArray[np.bool_] = np.any(shares > TOUCH, axis=1)
    owners: list[int | None] = []
    for one, row, touching in zip(candidates, overlap, touches, strict=True):
        best = int(row.argmax())
        if row[best] >= SAME_OVERLAP:
            owners.append(best)
        else:
            owners.append(None if touching or _is_cut(one) else NONE)
    return owners


def _is_cut(candidate: Candidate) -> bool:
    return any(mark.startswith("cut") for mark in candidate.marks)


def _shaken(box: Box, random: np.random.Generator) -> list[Box]:
    left, top, right, bottom = box
    sides = np.array(box)
    size = np.array([right - left, bottom - top] * 2)
    moved = sides + SHAKE * size * random.uniform(-1.0, 1.0, (SHAKES, 4))
    return [(float(a), float(b), float(c), float(d)) for a, b, c, d in moved]


def _check(folder: Folder, collected: _Collected, boxes: Counter[str]) -> None:
    labels, pictures = np.array(collected.labels), np.array(collected.pictures)
    names = [one.name for one in folder.objects]
    for index, name in enumerate(names):
        of_it = len(np.unique(pictures[labels == index])) if len(labels) else 0
        if of_it < 2:
            what = f"{boxes[name]} boxes give signatures in {of_it} pictures"
            raise BslamError(
                f"{folder.path / FILE}, class {name!r}: {what} (too small, too dark or hardly in the frame "
                "gives none); allowed: at least 2 pictures of each class"
            )
