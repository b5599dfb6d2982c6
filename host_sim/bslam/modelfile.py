"""Trained models: what a support vector machine and a kind of beacon hold, and how a model's file is read.

The file is JSON, so that it can be read, compared and kept in version control. Reading is strict: a file that
is cut short, of another version, or with a number that is none is refused whole, and the error names file,
key, value and what is allowed. Numbers have nine significant digits, which give every float back to the bit.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError

SIZE_MAX_M = 10.0


def weights_in_row(features: int, quadratic: bool) -> int:
    """As BSLAM_SVM_WEIGHTS in firmware/vision/built_in/classifiers/svm.h."""
    return features + (features * (features + 1) // 2 if quadratic else 0)


@dataclass(frozen=True)
class Svm:
    """A machine as bslam_svm_t takes it: weights (rows, weights_in_row) of float32, or of int8 to scale."""

    features: int
    quadratic: bool
    weights: NDArray[np.float32] | NDArray[np.int8]
    bias: NDArray[np.float32]  # (rows,)
    byte_scale: NDArray[np.float32] | None = None  # (rows,), with int8 weights only

    @property
    def rows(self) -> int:
        return len(self.bias)


@dataclass(frozen=True)
class AdditiveSvm:
    """A machine as bslam_additive_t takes it: curves of single features, surfaces of crossed pairs."""

    knots: NDArray[np.float32]  # (features, KNOTS), rising
    crossed: NDArray[np.uint8]  # features that have a grid with each other
    weights: NDArray[np.int8]  # (rows, weights)
    byte_scale: NDArray[np.float32]  # (rows,)
    bias: NDArray[np.float32]  # (rows,)

    @property
    def rows(self) -> int:
        return len(self.bias)

    @property
    def features(self) -> int:
        return len(self.knots)

    @property
    def paired(self) -> NDArray[np.int8]:
        """The weights as BSLAM_ADDITIVE_BYTES has them: (pairs of rows, weights, 2)."""
        rows = np.concatenate([self.weights, np.zeros((self.rows % 2, self.weights.shape[1]), np.int8)])
        return np.ascontiguousarray(rows.reshape(-1, 2, rows.shape[1]).transpose(0, 2, 1))


@dataclass(frozen=True)
class HingedSvm:
    """A machine as bslam_hinged_t takes it: each byte counts, and by how much it exceeds a knot."""

    knots: NDArray[np.uint8]  # (features,)
    weights: NDArray[np.int8]  # (rows, features, 2): of the byte, of what is above the knot
    byte_scale: NDArray[np.float32]  # (rows,)
    bias: NDArray[np.float32]  # (rows,)

    @property
    def rows(self) -> int:
        return len(self.bias)

    @property
    def features(self) -> int:
        return len(self.knots)

    @property
    def paired(self) -> NDArray[np.int8]:
        """The weights as BSLAM_HINGED_BYTES has them: (pairs of rows, features, 2, 2)."""
        rows = np.concatenate([self.weights, np.zeros((self.rows % 2, self.features, 2), np.int8)])
        return np.ascontiguousarray(rows.reshape(-1, 2, self.features, 2).transpose(0, 2, 3, 1))


@dataclass(frozen=True)
class BeaconClass:
    """A kind of beacon.

    height_m 0: not known. depth_m: how far it stands out from the wall; 0: flat, or not known. top_low_m to
    top_high_m: how high its upper side is above the floor; 0: not known. looks_sd: by what part a distance
    from its height errs because of its looks, a pale rim say. width_m: of what is as wide from every side.
    body_m: its height where only the body below its neck is found; 0: it has none. narrow_m to wide_m: how
    wide its front is; 0: not known. scale_sd: by what part all distances of one thing err alike, what it may
    be mistaken for included; 0: not known.
    """

    name: str
    height_m: float = 0.0
    depth_m: float = 0.0
    top_low_m: float = 0.0
    top_high_m: float = 0.0
    looks_sd: float = 0.0
    width_m: float = 0.0
    body_m: float = 0.0
    narrow_m: float = 0.0
    wide_m: float = 0.0
    scale_sd: float = 0.0


def load_document(path: Path) -> Mapping[str, Any]:
    if not path.exists():
        raise BslamError(f"{path}: there is no such file; allowed: a model that bslam detect train wrote")
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise BslamError(f"{path}: cannot be read: {error}; allowed: a UTF-8 text file") from error
    except ValueError as error:
        allowed = "a whole model file, as bslam detect train writes it"
        raise BslamError(f"{path}: not JSON, or cut short: {error}; allowed: {allowed}") from error
    if not isinstance(document, dict):
        raise BslamError(f"{path}: holds no table; allowed: a model file, as bslam detect train writes it")
    return document


@dataclass(frozen=True)
class Document:
    """A JSON table that is asked for its keys one by one, each with what it may hold."""

    path: Path
    table: Mapping[str, Any]
    prefix: str = ""

    def _get(self, key: str, allowed: str) -> Any:
        if key not in self.table:
            raise BslamError(f"{self.path}, key {self.prefix}{key}: is missing; allowed: {allowed}")
        return self.table[key]

    def _error(self, key: str, value: object, allowed: str) -> BslamError:
        shown = repr(value) if len(repr(value)) < 60 else f"{repr(value)[:57]}..."
        return BslamError(f"{self.path}, key {self.prefix}{key}: {shown} is not allowed; allowed: {allowed}")

    def equal(self, key: str, wanted: str | int) -> None:
        value = self._get(key, repr(wanted))
        if type(value) is not type(wanted) or value != wanted:
            raise self._error(key, value, repr(wanted))

    def text(self, key: str) -> str:
        value = self._get(key, "a name")
        if not isinstance(value, str) or not value:
            raise self._error(key, value, "a name")
        return value

    def number(self, key: str, low: float, high: float) -> float:
        allowed = f"a number from {low:g} to {high:g}"
        value = self._get(key, allowed)
        if not _is_number(value) or not low <= value <= high:
            raise self._error(key, value, allowed)
        return float(value)

    def whole(self, key: str, low: int, high: int) -> int:
        allowed = f"a whole number from {low} to {high}"
        value = self._get(key, allowed)
        if type(value) is not int or not low <= value <= high:
            raise self._error(key, value, allowed)
        return value

    def mapping(self, key: str) -> Mapping[str, Any]:
        value = self._get(key, "a table")
        if not isinstance(value, dict):
            raise self._error(key, value, "a table")
        return value

    def children(self, key: str, most: int) -> list[Document]:
        allowed = f"a list of 1 to {most} tables"
        value = self._get(key, allowed)
        if not isinstance(value, list) or not 1 <= len(value) <= most:
            raise self._error(key, value, allowed)
        for index, one in enumerate(value):
            if not isinstance(one, dict):
                raise self._error(f"{key}[{index}]", one, "a table")
        return [Document(self.path, one, f"{self.prefix}{key}[{i}].") for i, one in enumerate(value)]

    def array(self, key: str, count: int) -> NDArray[np.float32]:
        """So many finite numbers."""
        value = self._list(key, count)
        for index, one in enumerate(value):
            if not _is_number(one) or not abs(one) <= 1e12:
                raise self._error(f"{key}[{index}]", one, "a number from -1e12 to 1e12")
        return np.array(value, dtype=np.float32)

    def integers(
        self, key: str, count: int, dtype: type[np.signedinteger[Any] | np.unsignedinteger[Any]]
    ) -> NDArray[Any]:
        """So many whole numbers that the dtype holds."""
        value = self._list(key, count)
        limits = np.iinfo(dtype)
        low, high = int(limits.min), int(limits.max)
        for index, one in enumerate(value):
            if type(one) is not int or not low <= one <= high:
                raise self._error(f"{key}[{index}]", one, f"a whole number from {low} to {high}")
        return np.array(value, dtype=dtype)

    def _list(self, key: str, count: int) -> list[Any]:
        value = self._get(key, f"a list of {count}")
        if not isinstance(value, list) or len(value) != count:
            shown = f"{len(value)} entries" if isinstance(value, list) else value
            raise self._error(key, shown, f"a list of {count}")
        return value


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
