"""The scanner of the C core: pictures in, boxes of a user's own kinds of things out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.raw import vision_library
from bslam.core.scanner_tables import ScannerTables
from bslam.core.vision import MARKS
from bslam.errors import BslamError
from bslam.scannerfile import BLOCK, CHANNELS, Kind, ScannerModel, Window

LEVEL_PAD = 2
"""Cells by which a level goes on beyond the picture on every side."""


@dataclass(frozen=True)
class Detection:
    """A thing that was found, as bslam_detection_t describes it."""

    kind: str
    box: tuple[
        float, float, float, float
    ]  # left, top, right, bottom, px of the frame; its edges are 0 and its sides
    score: float
    log_odds: float
    marks: frozenset[str]


@dataclass(frozen=True)
class Detections:
    """What came of a picture: surest first; "seen", or why there is none ("black" say)."""

    items: tuple[Detection, ...]
    reason: str
    dropped: int


@dataclass(frozen=True)
class Level:
    """A picture at one size: cells (rows, columns, CHANNELS) uint8, padded by LEVEL_PAD."""

    cells: NDArray[np.uint8]
    cell_px: float  # side of a cell in the picture


class Scanner:
    """One scanner: it keeps nothing between pictures. Without a model it finds nothing: for training."""

    def __init__(self, model: ScannerModel | None = None) -> None:
        """BslamError if the library refuses the model."""
        self._library = vision_library()
        self._tables = ScannerTables(self._library, model or NOTHING)
        self._scanner = self._library.ffi.new("bslam_scanner_t *")
        self._library.ensure(
            self._library.lib.bslam_scanner_init_sized(
                self._scanner, *self._library.size_of("bslam_scanner_t"), self._tables.model
            ),
            "the scanner refuses its model",
        )

    def see(self, rgb: NDArray[np.uint8]) -> Detections:
        """Looks at a picture (height, width, 3) uint8, C-contiguous. BslamError for another shape or size."""
        found = self._look(rgb)
        lib, ffi = self._library.lib, self._library.ffi
        return Detections(
            items=tuple(self._detection(found.items[i]) for i in range(found.count)),
            reason=ffi.string(lib.bslam_vision_reason_name(found.reason)).decode(),
            dropped=found.dropped,
        )

    def levels(self, rgb: NDArray[np.uint8]) -> list[Level]:
        """The cells that windows slide over, of all sizes, largest first."""
        self._look(rgb)
        found: list[Level] = []
        while (level := self._level(len(found))) is not None:
            found.append(level)
        return found

    def first_level(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The cells of the picture at its own size."""
        self._look(rgb)
        level = self._level(0)
        assert level is not None  # every picture has one
        return level.cells

    def _look(self, rgb: NDArray[np.uint8]) -> Any:
        lib = self._library.lib
        if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or not rgb.flags.c_contiguous:
            raise BslamError(
                f"a picture of shape {rgb.shape}, {rgb.dtype}: allowed: (height, width, 3) uint8, contiguous"
            )
        height, width = rgb.shape[:2]
        begun = lib.bslam_scanner_begin(self._scanner, lib.BSLAM_PIXELS_RGB888, width, height)
        self._library.ensure(
            begun, f"a frame of {width}x{height}: allowed: 32 to 640 wide, by 8, and 32 to 480 high, by 4"
        )
        pixels = self._library.pixels(rgb)
        for row in range(height):
            self._library.ensure(
                lib.bslam_scanner_row(self._scanner, pixels + row * rgb.strides[0]), f"row {row}"
            )
        return lib.bslam_scanner_end(self._scanner)

    def _level(self, index: int) -> Level | None:
        ffi, cells_of = self._library.ffi, self._library.lib.bslam_scanner_cells
        size = ffi.new("bslam_scanner_level_t *")
        if not cells_of(self._scanner, index, size, 0, ffi.NULL):
            return None
        cells = np.empty((size.rows, size.columns, CHANNELS), dtype=np.uint8)
        for row in range(size.rows):
            cells_of(self._scanner, index, size, row, self._library.bytes(cells[row]))
        return Level(cells, size.cell_px)

    def _detection(self, found: Any) -> Detection:
        box = found.box
        edges = (box.left_px + 0.5, box.top_px + 0.5, box.right_px + 0.5, box.bottom_px + 0.5)
        marks = frozenset(name for bit, name in enumerate(MARKS) if found.marks >> bit & 1)
        return Detection(self._tables.names[found.kind], edges, found.score, found.log_odds, marks)


NOTHING = ScannerModel(
    kinds=(Kind("nothing", 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0),),
    windows=(
        Window(
            kind=0,
            box_columns=1.0,
            box_rows=1.0,
            weights=np.zeros((BLOCK, BLOCK, CHANNELS), np.int8),
            scale=1.0,
            bias=0,
            coarse=np.zeros((1, 1, CHANNELS), np.int8),
            coarse_bias=0,
            order=np.zeros(1, np.uint8),
            floors=np.full(1, 2**31 - 1, np.int32),
            edges=np.zeros((4, 1, 1, CHANNELS), np.int8),
            edge_scale=np.zeros(4, np.float32),
            edge_bias=np.zeros(4, np.float32),
        ),
    ),
)
"""A window that is given up everywhere."""
