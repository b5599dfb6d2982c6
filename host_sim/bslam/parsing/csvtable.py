"""Tables with named columns, of CSV files or of dataframes, read strictly: every error names file, line and
column."""

from __future__ import annotations

import csv
import gzip
import zlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError, did_you_mean


@dataclass(frozen=True)
class Column:
    """What a column may hold: a test over all its values, and the words that describe it."""

    allowed: str
    holds: Callable[[NDArray[np.float64]], NDArray[np.bool_]]
    empty: float | None = None  # what an empty field stands for; None: a field must not be empty
    why: str = ""  # it must be there, and filled
    words: bool = False  # its fields are texts, which somebody else makes sense of

    def error(self, origin: Origin, number: int, name: str, text: str) -> BslamError:
        """That a field of a row is not allowed, and what is."""
        why = f"; {self.why}" if self.why and not text else ""
        return origin.error(number, name, text, self.allowed + why)


def is_count(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Integer, not negative, and small enough to be exact in a double."""
    return (values >= 0) & (values <= 2.0**53) & (np.floor(values) == values)


BYTES_MAX = 256 << 20
"""Of a file's text, unpacked: some days of a drive, and what this computer has room for."""
HEAD_ROWS = 10
"""So many rows at the start may have stamps that the clock has not come to: a logger's buffer of before."""


@dataclass(frozen=True)
class Origin:
    """Where a table comes from, for messages: a file, whose lines count from 1, or a dataframe, whose rows do
    from 0."""

    name: str  # path of the file; "odometry" of a dataframe
    is_file: bool

    @property
    def header(self) -> str:
        """Where the names of the columns stand."""
        return f"{self.name}, line 1" if self.is_file else self.name

    @property
    def first(self) -> int:
        """The number of the first row of values."""
        return 2 if self.is_file else 0

    def line(self, number: int) -> str:
        """A row by its number."""
        return f"line {number}" if self.is_file else f"row {number}"

    def error(self, number: int, column: str, text: str, allowed: str) -> BslamError:
        """That a field is not allowed, and what is."""
        value = repr(text) if text or self.is_file else "a missing value (None, NaN)"
        where = f"{self.name}, {self.line(number)}, column {column}"
        return BslamError(f"{where}: {value} is not allowed; allowed: {allowed}")


@dataclass(frozen=True)
class Table:
    """The columns of one file or dataframe."""

    origin: Origin
    texts: Mapping[str, Sequence[str]]  # the fields as they stand in the file, by column
    values: Mapping[str, NDArray[np.float64]]  # (rows,) each; NaN in a column of words
    line: NDArray[np.int64]  # (rows,) of the file; row of the dataframe

    @property
    def rows(self) -> int:
        return len(self.line)

    def integers(self, column: str) -> NDArray[np.int64]:
        return self.values[column].astype(np.int64)

    def only(self, kept: NDArray[np.bool_]) -> Table:
        """The same without the rows that are not `kept`."""
        texts = {
            name: [one for one, keep in zip(column, kept, strict=True) if keep]
            for name, column in self.texts.items()
        }
        values = {name: one[kept] for name, one in self.values.items()}
        return Table(self.origin, texts, values, self.line[kept])

    def require_rows(self, allowed: str) -> None:
        """Raise BslamError if there is nothing below the header."""
        if self.rows == 0:
            raise BslamError(f"{self.origin.name}: no rows below the header; {allowed}")

    def require(self, column: str, good: NDArray[np.bool_], allowed: str) -> None:
        """Raise BslamError for the first row of `column` that is not `good`."""
        if not good.all():
            raise self.error(int(np.argmin(good)), column, allowed)

    def error(self, row: int, column: str, allowed: str) -> BslamError:
        """That a field is not allowed, and what is."""
        return self.origin.error(int(self.line[row]), column, self.texts[column][row], allowed)

    def require_order(self, column: str, strict: bool) -> None:
        """The values, none negative, must rise from row to row; unless `strict`, they may also stay."""
        step = np.diff(self.values[column], prepend=-1.0)
        good = step > 0 if strict else step >= 0
        self.require(column, good, f"a value {'above' if strict else 'not below'} that of the row before")

    def unrepeated(self, notes: list[str]) -> NDArray[np.bool_]:
        """Which rows do not say once more, in every column, what one above says; notes what is left out."""
        columns = [
            np.array(self.texts[name]) if np.isnan(one).all() else one for name, one in self.values.items()
        ]
        codes = [np.unique(one, return_inverse=True)[1] for one in columns]
        kept = np.zeros(self.rows, dtype=np.bool_)
        kept[np.unique(np.column_stack(codes), axis=0, return_index=True)[1]] = True
        if not kept.all():
            count, first = self.rows - int(kept.sum()), self.origin.line(self.line[int(np.argmin(kept))])
            notes.append(f"{self.origin.name}: left out {rows_text(count)} equal to one above, first {first}")
        return kept

    def begun(self, column: str, notes: list[str]) -> NDArray[np.bool_]:
        """Which rows do not stand at the start with stamps that time then runs back over; notes them."""
        times = self.values[column]
        first = began_at(times)
        if first:
            where = f"{self.origin.line(self.line[first])}, {column} {self.texts[column][first]}"
            left_out = f"left out {rows_text(first)} at the start"
            notes.append(f"{self.origin.name}: {left_out}: time runs back to {where}")
        return np.arange(self.rows) >= first


def rows_text(count: int) -> str:
    """ "1 row", "2 rows"."""
    return f"{count} row{'s' if count > 1 else ''}"


def began_at(times: NDArray[Any]) -> int:
    """The row at which the clock begins: 0, or behind a short head of rows that are all later than it."""
    back = np.flatnonzero(np.diff(times[: HEAD_ROWS + 1]) < 0)
    first = int(back[-1]) + 1 if len(back) else 0
    return first if first and times[:first].min() >= times[first] else 0


def read_table(
    path: Path, layouts: Sequence[Mapping[str, Column]], optional: Mapping[str, Column] | None = None
) -> Table:
    """Read a file with the columns of one of `layouts`, in any order, and perhaps some `optional` ones.

    The file is UTF-8 text, gzipped if it is named so; a field may stand in double quotes. Raises BslamError
    that names file, line, column, value and what is allowed.
    """
    lines = _read_text(path).splitlines()
    names = [name.strip() for name in _fields(lines[0])] if lines else []
    origin = Origin(str(path), is_file=True)
    columns = _match_layout(origin, names, layouts, optional or {})
    return _table(origin, columns, dict(zip(names, _split(path, lines, len(names)), strict=True)))


def table_of_texts(
    name: str,
    texts: Mapping[str, Sequence[str]],
    layouts: Sequence[Mapping[str, Column]],
    optional: Mapping[str, Column] | None = None,
) -> Table:
    """`read_table` of columns at hand, of one length, with their fields as a CSV file would hold them.

    `name` stands for the file. Raises BslamError that names row, column, value and what is allowed.
    """
    origin = Origin(name, is_file=False)
    return _table(origin, _match_layout(origin, list(texts), layouts, optional or {}), texts)


def _table(origin: Origin, columns: Mapping[str, Column], texts: Mapping[str, Sequence[str]]) -> Table:
    values = {name: _parse(origin, name, columns[name], fields) for name, fields in texts.items()}
    rows = len(next(iter(texts.values())))
    return Table(origin, texts, values, origin.first + np.arange(rows, dtype=np.int64))


def _read_text(path: Path) -> str:
    try:
        with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
            content = file.read(BYTES_MAX + 1)
        if len(content) > BYTES_MAX:
            raise BslamError(
                f"{path}: it holds more than {BYTES_MAX >> 20} MB of text; allowed: at most that"
            )
        return content.decode("utf-8-sig")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise BslamError(
            f"{path}: cannot be read: {error}; allowed: UTF-8 text, gzipped if named .gz"
        ) from error


def _match_layout(
    origin: Origin,
    names: Sequence[str],
    layouts: Sequence[Mapping[str, Column]],
    optional: Mapping[str, Column],
) -> dict[str, Column]:
    required = [name for name in names if name not in optional]
    for layout in layouts:
        if sorted(required) == sorted(layout) and len(set(names)) == len(names):
            return {**layout, **optional}
    wanted = " or ".join(",".join(layout) for layout in layouts)
    extra = f" (and perhaps {','.join(optional)})" if optional else ""
    why = "".join(f"; {one.why}" for name, one in layouts[0].items() if one.why and name not in names)
    known = {name for one in (*layouts, optional) for name in one}
    if not any(names):
        where = origin.header if names else origin.name
        raise BslamError(f"{where}: is empty; allowed: columns {wanted}{extra}")
    raise BslamError(
        f"{origin.header}: columns {','.join(names)!r} are not allowed; allowed: {wanted}{extra}{why}"
        + _offender(origin, names, known)
    )


def _offender(origin: Origin, names: Sequence[str], known: Collection[str]) -> str:
    """Which of the names is wrong, as far as one alone is, and how to mend it."""
    if origin.is_file and len(names) == 1 and (found := [one for one in ";\t |" if one in names[0]]):
        return f"; commas separate columns, not {found[0]!r}, and 0.5 is written with a point"
    if origin.is_file and "" in names:
        return f"; column {names.index('') + 1} has no name: of pandas? to_csv(..., index=False)"
    if unknown := [name for name in names if name not in known]:
        said = f"; not one of them: {', '.join(map(repr, unknown))}"
        return said + did_you_mean(unknown[0], set(known) - set(names))
    twice = next((name for name in names if names.count(name) > 1), None)
    return f"; {twice!r} is there twice" if twice else ""


def _fields(line: str) -> list[str]:
    return next(csv.reader([line]), [""]) if '"' in line else line.split(",")


def _split(path: Path, lines: Sequence[str], width: int) -> list[list[str]]:
    """The fields below the header, column by column, without blanks around them."""
    rows = [_fields(line) for line in lines[1:]]
    for line_number, row in enumerate(rows, start=2):
        if len(row) != width:
            text = lines[line_number - 1]
            raise BslamError(f"{path}, line {line_number}: {text!r} has {len(row)} fields; allowed: {width}")
    return [[field.strip() for field in column] for column in zip(*rows, strict=True)] or [
        [] for _ in range(width)
    ]


def _parse(origin: Origin, name: str, column: Column, texts: Sequence[str]) -> NDArray[np.float64]:
    """The numbers of one column; an empty field becomes what the column says it stands for."""
    if column.words:
        return np.full(len(texts), np.nan)
    try:
        values = np.array([float(text or "nan") for text in texts], dtype=np.float64)
    except ValueError:
        row = next(row for row, text in enumerate(texts) if not is_number(text or "nan"))
        raise column.error(origin, row + origin.first, name, texts[row]) from None
    good = column.holds(values)
    if column.empty is not None:
        empty = np.array([text == "" for text in texts], dtype=np.bool_)
        values[empty] = column.empty
        good |= empty
    if not good.all():
        row = int(np.argmin(good))
        raise column.error(origin, row + origin.first, name, texts[row])
    return values


def is_number(text: str) -> bool:
    """Whether Python reads it as a number, nan and inf among them."""
    try:
        float(text)
    except ValueError:
        return False
    return True
