"""A scanner's model as the C core wants it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

from bslam.core.raw import VisionLibrary
from bslam.scannerfile import Kind, ScannerModel, Window


class ScannerTables:
    """A model's tables in C: they last as long as this does."""

    def __init__(self, library: VisionLibrary, model: ScannerModel) -> None:
        self._library = library
        self._keep: list[Any] = []
        self.names = [one.name for one in model.kinds]
        self.model = library.new_filled(
            "bslam_scanner_model_t",
            kind_count=len(model.kinds),
            kinds=self._kinds(model.kinds),
            window_count=len(model.windows),
            windows=self._windows(model.windows),
        )

    def _kinds(self, kinds: Sequence[Kind]) -> Any:
        ffi = self._library.ffi
        names = [ffi.new("char[]", one.name.encode()) for one in kinds]
        made = ffi.new(
            "bslam_scan_kind_t[]", [(name, *astuple(one)[1:]) for name, one in zip(names, kinds, strict=True)]
        )
        self._keep += [names, made]
        return made

    def _windows(self, windows: Sequence[Window]) -> Any:
        library, keep = self._library, self._keep
        made = library.ffi.new("bslam_window_t[]", len(windows))
        for view, one in zip(made, windows, strict=True):
            view.kind, view.columns, view.rows = one.kind, one.columns, one.rows
            view.box_columns, view.box_rows = one.box_columns, one.box_rows
            view.scale, view.bias = one.scale, one.bias
            view.weights = library.table("int8_t", one.weights, keep)
            view.coarse = library.table("int8_t", one.coarse, keep)
            view.coarse_bias = one.coarse_bias
            view.order = library.table("uint8_t", one.order, keep)
            view.floors = library.table("int32_t", one.floors, keep)
            view.edges = library.table("int8_t", one.edges, keep)
            view.edge_scale = library.table("float", one.edge_scale, keep)
            view.edge_bias = library.table("float", one.edge_bias, keep)
        keep.append(made)
        return made
