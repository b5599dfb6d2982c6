"""Dataframes as the texts that a CSV file would hold, so that one reader looks at both.

Through narwhals, which speaks to pandas, polars, pyarrow, DuckDB and others, and needs none of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

import narwhals as nw
import numpy as np
from narwhals.exceptions import NarwhalsError

from bslam.errors import BslamError


def texts_of(name: str, frame: Any) -> dict[str, list[str]]:
    """By column the fields of a dataframe; a missing value (None, NaN, NA) is an empty one, True is 1.

    `name` is for messages. Raises BslamError for what is no dataframe, for a label that is no text, and for a
    value that is several.
    """
    try:
        known = nw.from_native(frame)
        eager = known.collect() if isinstance(known, nw.LazyFrame) else known
    except (TypeError, NarwhalsError) as error:
        kind, said = type(frame).__name__, " ".join(str(error).split())
        allowed = "a dataframe of pandas, polars, pyarrow or another library that narwhals knows"
        allowed += f", as pandas.DataFrame({name})" if isinstance(frame, (dict, list, np.ndarray)) else ""
        raise BslamError(f"{name}: {kind}: {said}; allowed: {allowed}") from error
    for column in eager.columns:
        if not isinstance(column, str):  # pandas numbers them where nobody names them
            raise BslamError(f"{name}: column label {column!r} is not allowed; allowed: texts")
    return {column: _texts(name, eager[column]) for column in eager.columns}


def _texts(name: str, column: nw.Series[Any]) -> list[str]:
    values, missing = column.to_list(), column.is_null().to_list()
    for row, value in enumerate(values):
        if isinstance(value, Iterable) and not isinstance(value, str):  # bytes, lists: no beacon's name
            where = f"{name}, row {row}, column {column.name}"
            raise BslamError(f"{where}: {value!r} is not allowed; allowed: a number, a text, or missing")
    return ["" if none else _text(value) for value, none in zip(values, missing, strict=True)]


def _text(value: Any) -> str:
    if isinstance(value, (bool, np.bool_, Integral)):
        return str(int(value))
    if isinstance(value, Real):
        return "" if math.isnan(value) else repr(float(value))
    return str(value).strip()
