"""Dataframes as the texts that a CSV file would hold, so that one reader looks at both.

Through narwhals, which speaks to pandas, polars, pyarrow, DuckDB and others, and needs none of them.
"""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any

import narwhals as nw
import numpy as np
from narwhals.exceptions import NarwhalsError

from bslam.errors import BslamError


def texts_of(name: str, frame: Any) -> dict[str, list[str]]:
    """By column the fields of a dataframe; a missing value (None, NaN, NA) is an empty one, True is 1.

    `name` is for messages. Raises BslamError for what is no dataframe, and for a label that is no text.
    """
    try:
        known = nw.from_native(frame)
        eager = known.collect() if isinstance(known, nw.LazyFrame) else known
    except (TypeError, NarwhalsError) as error:
        kind, said = type(frame).__name__, " ".join(str(error).split())
        allowed = "a dataframe of pandas, polars, pyarrow or another library that narwhals knows"
        raise BslamError(f"{name}: {kind}: {said}; allowed: {allowed}") from error
    for column in eager.columns:
        if not isinstance(column, str):  # pandas numbers them where nobody names them
            raise BslamError(f"{name}: column label {column!r} is not allowed; allowed: texts")
    return {column: _texts(eager[column]) for column in eager.columns}


def _texts(column: nw.Series[Any]) -> list[str]:
    missing = column.is_null().to_list()
    return ["" if none else _text(value) for value, none in zip(column.to_list(), missing, strict=True)]


def _text(value: Any) -> str:
    if isinstance(value, (bool, np.bool_, Integral)):
        return str(int(value))
    if isinstance(value, Real):
        return "" if math.isnan(value) else repr(float(value))
    return str(value).strip()
