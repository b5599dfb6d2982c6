"""The front end with its inside open: what it measures of given boxes, and features of boxes and cells.

Nothing that runs on a robot needs it, so it has a build of its own, from vision/internal.h, in
build/training.
"""

from __future__ import annotations

import fcntl
import importlib.util
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core import vision
from bslam.core.raw import VisionLibrary
from bslam.core.vision import SIGNATURE_SIZE, Candidate
from bslam.modelfile import BeaconClass
from bslam_build import build
from bslam_build import vision as vision_extension

EXTENSION = "_vision_training"
HEADER = "vision/internal.h"
FOLDER = Path(__file__).resolve().parents[2] / "build" / "training"
UNKNOWN = BeaconClass("")
"""A kind of which no size is known."""


@dataclass(frozen=True)
class Proposals:
    """The boxes of a frame that were looked at more closely: for training."""

    boxes: NDArray[np.float32]  # (n, 4) left, top, right, bottom, px
    segmentations: NDArray[np.int64]  # (n,) which segmentation found each first
    features: NDArray[np.float32]  # (n, blob features), not normalised
    glances: NDArray[np.float32]  # (n, glance features)


@cache
def open_library() -> VisionLibrary:
    """The build that shows what is inside: all that the product's has, and more. Made where it is missing or
    old.
    """
    FOLDER.mkdir(parents=True, exist_ok=True)
    with (FOLDER / f"{EXTENSION}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another process may be at it
        path = build(vision_extension(EXTENSION, HEADER), FOLDER)
    spec = importlib.util.spec_from_file_location(EXTENSION, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return VisionLibrary(module)


class FrontEnd(vision.FrontEnd):
    """A front end that tells how it comes to its candidates."""

    @staticmethod
    def _open() -> VisionLibrary:
        return open_library()

    def _inside(self) -> Any:
        ffi = self._library.ffi
        return ffi.addressof(ffi.cast("bslam_vision_instance_t *", self._vision), "front_end")

    def signature(self, box: tuple[float, float, float, float]) -> NDArray[np.float32] | None:
        """The signature (71,) of what a box (left, top, right, bottom, px) in the last frame holds.

        None: none can be taken there, the box is too small, dark or outside.
        """
        found = self._measured(box, UNKNOWN)
        if found is None:
            return None
        signature = self._library.copy_of(found.signature, SIGNATURE_SIZE, np.float32)
        return signature if signature.any() else None

    def measure(
        self, box: tuple[float, float, float, float], kind: BeaconClass = UNKNOWN
    ) -> Candidate | None:
        """What is measured of a rough box (left, top, right, bottom, px) in the last frame, of an object of
        the kind's size and place. It has no class. None: nothing can be measured there.
        """
        found = self._measured(box, kind)
        return None if found is None else self._candidate(found[0])

    def _measured(self, box: tuple[float, float, float, float], kind: BeaconClass) -> Any:
        library = self._library
        sides = dict(zip(("left_px", "top_px", "right_px", "bottom_px"), box, strict=True))
        rough = library.new_filled("bslam_box_t", **sides)
        sizes = {name: value for name, value in asdict(kind).items() if name != "name"}
        size = library.new_filled("bslam_size_t", **sizes)
        found = library.new_filled("bslam_candidate_t")
        status = library.lib.bslam_front_end_measure(self._inside(), rough, size, found)
        return found if status == library.lib.BSLAM_OK else None

    def proposals(self) -> Proposals:
        """The proposals of the last frame."""
        inside = self._inside()
        found = inside.proposals
        items = [found.items[i] for i in range(found.count)]
        boxes = [self._library.lib.bslam_front_end_proposal_box(inside, i) for i in range(found.count)]
        sides = ("left_px", "top_px", "right_px", "bottom_px")
        features = np.empty((found.count, self._library.lib.BSLAM_BLOB_FEATURES), dtype=np.float32)
        glances = np.empty((found.count, self._library.lib.BSLAM_GLANCE_FEATURES), dtype=np.float32)
        for i in range(found.count):
            self._library.lib.bslam_front_end_blob_features(inside, i, self._library.floats(features[i]))
            self._library.lib.bslam_front_end_prefilter(inside, i, self._library.floats(glances[i]))
        return Proposals(
            boxes=np.array([[getattr(box, side) for side in sides] for box in boxes], np.float32).reshape(
                -1, 4
            ),
            segmentations=np.array([item.segmentation for item in items], np.int64),
            features=features,
            glances=glances,
        )

    def close_features(self, chosen: Sequence[int]) -> NDArray[np.uint8]:
        """What the closer look's machine would be told (n, close features) of chosen proposals of the last
        frame."""
        inside = self._inside()
        features = np.empty((len(chosen), self._library.lib.BSLAM_CLOSE_FEATURES), dtype=np.uint8)
        for row, index in zip(features, chosen, strict=True):
            self._library.lib.bslam_front_end_close_features(inside, index, self._library.bytes(row))
        return features

    def cell_features(self, rows: NDArray[np.integer], columns: NDArray[np.integer]) -> NDArray[np.int16]:
        """Features (n, cell features) of cells of the last frame."""
        features = np.empty((len(rows), self._library.lib.BSLAM_CELL_FEATURES), dtype=np.int16)
        write = self._library.lib.bslam_front_end_cell_features
        for i, (row, column) in enumerate(zip(rows.tolist(), columns.tolist(), strict=True)):
            write(self._inside(), row, column, self._library.shorts(features[i]))
        return features

    def cell_values(self) -> NDArray[np.int8]:
        """Decision values (rows, columns) of the last frame's cells, 32 steps for 1."""
        thumbnail = self._inside().thumbnail
        shape = (thumbnail.height_px // 4, thumbnail.width_px // 4)
        return self._library.copy_of(thumbnail.notes.values, shape[0] * shape[1], np.int8).reshape(shape)


def feature_counts() -> tuple[int, int, int, int]:
    """Features of a cell, of a glance at a proposal, of a proposal, and of a closer look at it."""
    lib = open_library().lib
    counts = lib.BSLAM_CELL_FEATURES, lib.BSLAM_GLANCE_FEATURES, lib.BSLAM_BLOB_FEATURES
    return *map(int, counts), int(lib.BSLAM_CLOSE_FEATURES)  # type: ignore[return-value]
