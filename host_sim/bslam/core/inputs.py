"""What Python hands to the C library, as C can be told it: whatever else is refused here, by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from numbers import Real
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError

NOT_MAPPABLE: Final = 255
"""BSLAM_CLASS_NOT_MAPPABLE."""
INT32: Final = (-(2**31), 2**31 - 1)
INT64: Final = (-(2**63), 2**63 - 1)
_WHOLE: Final = {"label": (-1, INT32[1]), "beacon_class": (0, NOT_MAPPABLE)}
_FIELDS: Final = (
    *("bearing_rad", "range_m", "label", "beacon_class"),
    *("bearing_sd_rad", "range_sd_m", "range_scale_sd", "score"),
)

_TURN: Final = 2.0 * math.pi
# What C allows (bslam.h), in words and as a test: C refuses, and these say which field it was.
_ALLOWED: Final[dict[str, tuple[str, Callable[[float], bool]]]] = {
    "bearing_rad": ("radians from -2 pi to 2 pi", lambda value: abs(value) <= _TURN),
    "range_m": (
        "0.001 to 10000 m, or NaN for none",
        lambda value: 1e-3 <= value <= 1e4,
    ),
    "label": ("a whole number from 0, or -1 for no identity", lambda value: value >= -1),
    "beacon_class": ("a whole number from 1 to 254, or 0 for none", lambda value: True),
    "bearing_sd_rad": ("0 or 1e-5 to pi", lambda value: value == 0.0 or 1e-5 <= value <= math.pi),
    "range_sd_m": ("0 or 0.001 to 10000 m", lambda value: value == 0.0 or 1e-3 <= value <= 1e4),
    "range_scale_sd": ("0 to 1", lambda value: 0.0 <= value <= 1.0),
    "score": ("-1e6 to 1e6", lambda value: abs(value) <= 1e6),
}

Row = tuple[float, float, int, int, float, float, float, float]
"""A sighting, as `_FIELDS` has it."""


def whole(value: Any, what: str, limits: tuple[int, int] = INT64) -> int:
    """A whole number, 7.0 and numpy's among them. Raises BslamError."""
    low, high = limits
    given: Any = value if isinstance(value, Real) else None
    if given is not None and low <= given <= high and given == int(given):
        return int(given)
    raise BslamError(f"{what} {value!r}: allowed is a whole number from {low} to {high}")


def number(value: Any, what: str, allowed: str = "a number") -> float:
    """Any number; whether it is finite, the core looks. Raises BslamError with what is `allowed`."""
    if isinstance(value, Real):
        try:
            return float(value)
        except OverflowError:
            pass
    raise BslamError(f"{what} {value!r}: allowed is {allowed}")


def refused_field(row: Row) -> str:
    """Of a sighting that C refuses, the field that is why, and what is allowed there."""
    for name, value in zip(_FIELDS, row, strict=True):
        allowed, holds = _ALLOWED[name]
        is_read = not (name.startswith("range_") and math.isnan(row[1]))
        if is_read and not holds(value):
            return f"{name} {value}: allowed is {allowed}"
    return "signature: allowed are finite numbers"


def frame_rows(where: str, **columns: Sequence[Any] | NDArray[Any] | None) -> list[Row]:
    """Sightings from the columns of a frame; what is None counts as 0 throughout.

    Raises BslamError for columns that are no lists, or of unequal length. The numbers themselves are looked
    at by cffi, which is quick: `checked_rows` says what it does not like.
    """
    count = len(_as_list(where, "bearing_rad", columns["bearing_rad"]))
    optional = ("bearing_sd_rad", "range_sd_m", "range_scale_sd", "beacon_class", "score")
    lists = {
        name: [0] * count if one is None and name in optional else _as_list(where, name, one)
        for name, one in columns.items()
    }
    for name, one in lists.items():
        if len(one) != count:
            raise BslamError(f"{where}: {len(one)} values of {name}; allowed: {count}, as of bearing_rad")
    mappable = lists.pop("mappable")
    if not all(isinstance(use, (bool, int, np.bool_)) for use in mappable):
        raise BslamError(f"{where}: mappable {mappable!r}; allowed: True or False of each")
    for name, limits in _WHOLE.items():  # cffi would cut numpy's 0.5 to 0
        if any(type(one) is not int for one in lists[name]):
            what = f"{where}, sighting {{}}: {name}".format
            lists[name] = [whole(one, what(index), limits) for index, one in enumerate(lists[name])]
    told = lists["beacon_class"]
    lists["beacon_class"] = [one if use else NOT_MAPPABLE for one, use in zip(told, mappable, strict=True)]
    return list(zip(*(lists[name] for name in _FIELDS), strict=True))


def checked_rows(where: str, rows: Sequence[Row]) -> list[Row]:
    """The same rows as plain numbers. Raises BslamError for the first that is none."""
    checked: list[Any] = []
    for index, row in enumerate(rows):
        values = []
        for name, value in zip(_FIELDS, row, strict=True):
            what = f"{where}, sighting {index}: {name}"
            values.append(whole(value, what, _WHOLE[name]) if name in _WHOLE else number(value, what))
        checked.append(tuple(values))
    return checked


def _as_list(where: str, name: str, values: Any) -> list[Any]:
    if type(values) is list:
        return values
    try:
        array = np.asarray(values)
    except ValueError:
        array = np.empty((0, 0))
    if array.ndim != 1:
        raise BslamError(f"{where}: {name} of shape {array.shape}; allowed: a list, one value a sighting")
    column: list[Any] = array.tolist()
    return column
