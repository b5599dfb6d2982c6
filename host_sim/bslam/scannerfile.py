"""The model of a scanner, and the file that it stands in: JSON, read strictly, as bslam.modelfile says.

All that decides is whole numbers, as in the C header beside it: the file gives them back to the bit.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.modelfile import SIZE_MAX_M as SIZE_MAX_M
from bslam.modelfile import Document, load_document

FORMAT = "bslam scanner"
VERSION = 3
CHANNELS = 8
"""Values of a cell, as BSLAM_CHANNELS in firmware/vision/model.h."""
LOWEST = -0.6
"""The lowest score that windows are scanned for; thresholds are higher."""
SIDE_MAX = 20
WINDOWS_MAX = 32
KINDS_MAX = 16
BLOCK = 2
"""Cells across and down of what the coarse SVM and the edges are read from."""


@dataclass(frozen=True)
class Kind:
    """A kind of thing that is found, as bslam_scan_kind_t describes it. height_m, width_m 0: not known."""

    name: str
    height_m: float
    width_m: float
    threshold: float
    slope: float
    offset: float
    middle_sd: float
    height_sd: float


@dataclass(frozen=True)
class Window:
    """A window and its linear SVM, as bslam_window_t describes it."""

    kind: int
    box_columns: float
    box_rows: float
    weights: NDArray[np.int8]  # (rows, columns, CHANNELS)
    scale: float
    bias: int
    coarse: NDArray[np.int8]  # (rows // BLOCK, columns // BLOCK, CHANNELS)
    coarse_bias: int
    order: NDArray[np.uint8]  # (rows // BLOCK,)
    floors: NDArray[np.int32]  # (rows // BLOCK,)
    edges: NDArray[np.int8]  # (4, rows // BLOCK, columns // BLOCK, CHANNELS)
    edge_scale: NDArray[np.float32]  # (4,)
    edge_bias: NDArray[np.float32]  # (4,)

    @property
    def rows(self) -> int:
        return self.weights.shape[0]

    @property
    def columns(self) -> int:
        return self.weights.shape[1]


@dataclass(frozen=True)
class ScannerModel:
    """All that a scanner finds. notes: how it came about: pictures, settings, figures."""

    kinds: tuple[Kind, ...]
    windows: tuple[Window, ...]
    notes: Mapping[str, str] = field(default_factory=dict)


def write_scanner(path: Path, model: ScannerModel) -> None:
    """Write the model file; the same model gives the same bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(scanner_text(model), encoding="utf-8")


def scanner_text(model: ScannerModel) -> str:
    """The content of the model file."""
    head = {
        "format": FORMAT,
        "version": VERSION,
        "channels": CHANNELS,
        "notes": dict(model.notes),
        "kinds": [
            {key: value if key == "name" else _rounded(value) for key, value in vars(kind).items()}
            for kind in model.kinds
        ],
    }
    opening = json.dumps(head, indent=1, ensure_ascii=False).removesuffix("\n}")
    windows = ",\n".join(json.dumps(_window_table(one)) for one in model.windows)
    return f'{opening},\n "windows": [\n{windows}\n ]\n}}\n'


def read_scanner(path: Path) -> ScannerModel:
    """The model in a file. Raises BslamError that names file, key, value and what is allowed."""
    document = Document(path, load_document(path))
    document.equal("format", FORMAT)
    document.equal("version", VERSION)
    document.equal("channels", CHANNELS)
    kinds = tuple(_kind(one) for one in document.children("kinds", KINDS_MAX))
    windows = tuple(_window(one, len(kinds)) for one in document.children("windows", WINDOWS_MAX))
    notes = {str(key): str(value) for key, value in document.mapping("notes").items()}
    return ScannerModel(kinds, windows, notes)


def _kind(table: Document) -> Kind:
    return Kind(
        name=table.text("name"),
        height_m=table.number("height_m", 0.0, SIZE_MAX_M),
        width_m=table.number("width_m", 0.0, SIZE_MAX_M),
        threshold=table.number("threshold", -1e6, 1e6),
        slope=table.number("slope", 0.0, 1e6),
        offset=table.number("offset", -1e6, 1e6),
        middle_sd=table.number("middle_sd", 1e-3, 10.0),
        height_sd=table.number("height_sd", 1e-3, 10.0),
    )


def _window(table: Document, kinds: int) -> Window:
    columns, rows = (_side(table, key) for key in ("columns", "rows"))
    blocks = (rows // BLOCK, columns // BLOCK, CHANNELS)
    order = table.integers("order", rows // BLOCK, np.uint8)
    if sorted(order.tolist()) != list(range(rows // BLOCK)):
        raise BslamError(f"{table.path}, key {table.prefix}order: allowed: each row once")
    return Window(
        kind=table.whole("kind", 0, kinds - 1),
        box_columns=table.number("box_columns", 0.1, columns),
        box_rows=table.number("box_rows", 0.1, rows),
        weights=table.integers("weights", rows * columns * CHANNELS, np.int8).reshape(
            rows, columns, CHANNELS
        ),
        scale=table.number("scale", 1e-12, 1e6),
        bias=table.whole("bias", -(2**30), 2**30),
        coarse=table.integers("coarse", int(np.prod(blocks)), np.int8).reshape(blocks),
        coarse_bias=table.whole("coarse_bias", -(2**30), 2**30),
        order=order,
        floors=table.integers("floors", rows // BLOCK, np.int32),
        edges=table.integers("edges", 4 * int(np.prod(blocks)), np.int8).reshape(4, *blocks),
        edge_scale=table.array("edge_scale", 4),
        edge_bias=table.array("edge_bias", 4),
    )


def _side(table: Document, key: str) -> int:
    side = table.whole(key, BLOCK, SIDE_MAX)
    if side % BLOCK != 0:
        raise BslamError(f"{table.path}, key {table.prefix}{key}: {side}; allowed: an even number")
    return side


def _window_table(window: Window) -> dict[str, Any]:
    sides = {"columns": window.columns, "rows": window.rows}
    values: dict[str, Any] = {}
    for key, value in vars(window).items():
        if isinstance(value, np.ndarray):
            flat = value.ravel().tolist()
            values[key] = [_rounded(one) for one in flat] if value.dtype == np.float32 else flat
        else:
            values[key] = value if isinstance(value, int) else _rounded(value)
    return sides | values


def _rounded(value: float) -> float:
    """To the nearest float32, which is what C computes with."""
    return float(f"{float(np.float32(value)):.9g}")
