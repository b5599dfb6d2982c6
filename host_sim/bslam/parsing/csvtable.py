"""CSV files with a header and numbers below it, read strictly: every error names file, line and column."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError


@dataclass(frozen=True)
class Column:
    """What a column may hold: a test over all its values, and the words that describe it."""

    allowed: str
    holds: Callable[[NDArray[np.float64]], NDArray[np.bool_]]
    empty: float | None = None  # what an empty field stands for; None: a field must not be empty


def is_count(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Integer, not negative, and small enough to be exact in a double."""
    return (values >= 0) & (values <= 2.0**53) & (np.floor(values) == values)


@dataclass(frozen=True)
class Table:
    """The columns of one file."""

    path: Path
    texts: Mapping[str, Sequence[str]]  # the fields as they stand in the file, by column
    values: Mapping[str, NDArray[np.float64]]  # (rows,) each

    @property
    def rows(self) -> int:
        return len(next(iter(self.values.values())))

    def integers(self, column: str) -> NDArray[np.int64]:
        return self.values[column].astype(np.int64)

    def require_rows(self, allowed: str) -> None:
        """Raise BslamError if there is nothing below the header."""
        if self.rows == 0:
            raise BslamError(f"{self.path}: no rows below the header; {allowed}")

    def require(self, column: str, good: NDArray[np.bool_], allowed: str) -> None:
        """Raise BslamError for the first row of `column` that is not `good`."""
        if not good.all():
            row = int(np.argmin(good))
            raise _field_error(self.path, row, column, self.texts[column][row], allowed)

    def require_order(self, column: str, strict: bool) -> None:
        """The values, none negative, must rise from row to row; unless `strict`, they may also stay."""
        step = np.diff(self.values[column], prepend=-1.0)
        good = step > 0 if strict else step >= 0
        self.require(column, good, f"a value {'above' if strict else 'not below'} that of the row before")


def read_table(
    path: Path, layouts: Sequence[Mapping[str, Column]], optional: Mapping[str, Column] | None = None
) -> Table:
    """Read a file with the columns of one of `layouts`, in any order, and perhaps some `optional` ones.

    The file is UTF-8 text, gzipped if it is named so. Raises BslamError that names file, line, column, value
    and what is allowed.
    """
    lines = _read_text(path).splitlines()
    names = [name.strip() for name in lines[0].split(",")] if lines else []
    columns = _match_layout(path, names, layouts, optional or {})
    texts = dict(zip(names, _split(path, lines, len(names)), strict=True))
    return Table(path, texts, {name: _parse(path, name, columns[name], texts[name]) for name in names})


def _read_text(path: Path) -> str:
    try:
        content = path.read_bytes()
        if path.suffix == ".gz":
            content = gzip.decompress(content)
        return content.decode("utf-8-sig")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise BslamError(
            f"{path}: cannot be read: {error}; allowed: UTF-8 text, gzipped if named .gz"
        ) from error


def _match_layout(
    path: Path, names: Sequence[str], layouts: Sequence[Mapping[str, Column]], optional: Mapping[str, Column]
) -> dict[str, Column]:
    required = [name for name in names if name not in optional]
    for layout in layouts:
        if sorted(required) == sorted(layout) and len(set(names)) == len(names):
            return {**layout, **optional}
    wanted = " or ".join(",".join(layout) for layout in layouts)
    extra = f" (and perhaps {','.join(optional)})" if optional else ""
    raise BslamError(f"{path}, line 1: columns {','.join(names)!r} are not allowed; allowed: {wanted}{extra}")


def _split(path: Path, lines: Sequence[str], width: int) -> list[tuple[str, ...]]:
    """The fields below the header, column by column."""
    rows = [line.split(",") for line in lines[1:]]
    for line_number, row in enumerate(rows, start=2):
        if len(row) != width:
            text = lines[line_number - 1]
            raise BslamError(f"{path}, line {line_number}: {text!r} has {len(row)} fields; allowed: {width}")
    return list(zip(*rows, strict=True)) or [()] * width


def _parse(path: Path, name: str, column: Column, texts: Sequence[str]) -> NDArray[np.float64]:
    """The numbers of one column; an empty field becomes what the column says it stands for."""
    try:
        values = np.array([float(text or "nan") for text in texts], dtype=np.float64)
    except ValueError:
        row = next(row for row, text in enumerate(texts) if not _is_number(text))
        raise _field_error(path, row, name, texts[row], column.allowed) from None
    good = column.holds(values)
    if column.empty is not None:
        empty = np.array([text == "" for text in texts], dtype=np.bool_)
        values[empty] = column.empty
        good |= empty
    table = Table(path, {name: texts}, {name: values})
    table.require(name, good, column.allowed)
    return values


def _is_number(text: str) -> bool:
    try:
        float(text or "nan")
    except ValueError:
        return False
    return True


def _field_error(path: Path, row: int, name: str, text: str, allowed: str) -> BslamError:
    """The error for one field; row 0 is the first below the header, which is line 2 of the file."""
    return BslamError(f"{path}, line {row + 2}, column {name}: {text!r} is not allowed; allowed: {allowed}")
