"""Tables of settings in TOML files, read strictly into frozen dataclasses.

A dataclass field made by `setting(rule)` says what its key may hold; `parse_table` checks a table against all
fields of a class, and every error names the file, the key, the value and what is allowed.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar

from bslam.errors import BslamError, did_you_mean

T = TypeVar("T")


@dataclass(frozen=True)
class Rule:
    """What a key may hold: its type (`float` takes integers too), a test, and the words for both.

    `make` turns a good value into what the program works with. `more` is what a JSON schema can say of the
    test, for editors.
    """

    allowed: str
    kind: type
    holds: Callable[[Any], bool] = lambda value: True
    make: Callable[[Any], Any] = lambda value: value
    more: Mapping[str, Any] = field(default_factory=dict)

    @property
    def schema(self) -> dict[str, Any]:
        """The rule as JSON schema, as far as that goes; what is allowed stands in the description."""
        return {"type": _SCHEMA_TYPES[self.kind], "description": f"allowed: {self.allowed}", **self.more}

    def convert(self, value: object, where: str) -> Any:
        """The value to work with, or a BslamError that starts with `where` (file and key)."""
        right_type = isinstance(value, _NUMBERS.get(self.kind, self.kind))
        if isinstance(value, bool) and self.kind is not bool:
            right_type = False
        try:
            if right_type and self.holds(typed := self.kind(value)):
                return self.make(typed)
        except OverflowError:  # an integer that no double can hold
            pass
        near = did_you_mean(value, self.more.get("enum", ())) if isinstance(value, str) else ""
        raise BslamError(f"{where}: {value!r} is not allowed; allowed: {self.allowed}{near}")


_NUMBERS: dict[type, type] = {float: Real, int: Integral}
"""Numpy's are numbers, too."""
_SCHEMA_TYPES = {
    float: "number",
    int: "integer",
    str: "string",
    bool: "boolean",
    list: "array",
    dict: "object",
}


def one_of(*words: str) -> Rule:
    allowed = " or ".join(repr(word) for word in words)
    return Rule(allowed, str, lambda value: value in words, more={"enum": list(words)})


def integer(lowest: int, highest: int | None = None) -> Rule:
    if highest is None:
        return Rule(f"an integer from {lowest}", int, lambda value: value >= lowest, more={"minimum": lowest})
    allowed, more = f"an integer from {lowest} to {highest}", {"minimum": lowest, "maximum": highest}
    return Rule(allowed, int, lambda value: lowest <= value <= highest, more=more)


def number(lowest: float, highest: float) -> Rule:
    allowed, more = f"a number from {lowest:g} to {highest:g}", {"minimum": lowest, "maximum": highest}
    return Rule(allowed, float, lambda value: lowest <= value <= highest, more=more)


_ABOVE_0 = {"exclusiveMinimum": 0}
ANY = Rule("a finite number", float, math.isfinite)
POSITIVE = Rule("a finite number above 0", float, lambda value: 0.0 < value < math.inf, more=_ABOVE_0)
NOT_NEGATIVE = Rule(
    "a finite number from 0", float, lambda value: 0.0 <= value < math.inf, more={"minimum": 0}
)
POSITIVE_OR_INF = Rule("a number above 0, or inf", float, lambda value: value > 0.0, more=_ABOVE_0)
SHARE = number(0.0, 1.0)
FIELD_OF_VIEW = Rule(
    "above 0, at most 6.2832 (a full turn)",
    float,
    lambda value: 0.0 < value <= 6.2832,
    more=_ABOVE_0 | {"maximum": 6.2832},
)


def setting(rule: Rule, default: Any = MISSING) -> Any:
    """A dataclass field with its rule; without a default the key must be there."""
    return field(default=default, metadata={"rule": rule})


def toml_names(folder: Path) -> list[str]:
    """Names of the TOML files that come with the package in a folder of it."""
    return sorted(path.stem for path in folder.glob("*.toml"))


def find_toml(what: str, name_or_path: str | Path, folder: Path) -> Path:
    """The file of a name in the folder, or of a path that ends in .toml; BslamError if it is missing.

    `what` it is of, "scenario" say, is for the message.
    """
    text = str(name_or_path)
    path = Path(text) if text.endswith(".toml") else folder / f"{text}.toml"
    if not path.is_file():
        allowed = f"{', '.join(toml_names(folder))}, or a path that ends in .toml"
        near = did_you_mean(text, toml_names(folder))
        raise BslamError(f"{what} {text!r}: there is no such {what} or file; allowed: {allowed}{near}")
    return path


def load_toml(path: Path) -> dict[str, Any]:
    """The document in a TOML file; BslamError if it cannot be read or is not TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        raise BslamError(f"{path}: cannot be read: {error}; allowed: a UTF-8 text file") from error
    except tomllib.TOMLDecodeError as error:
        raise BslamError(f"{path}: not TOML: {error}; allowed: lines of key = value") from error


def parse_table(cls: type[T], table: Mapping[str, object], where: str) -> T:
    """`cls` from a TOML table; `where` (the file, and the table in it) starts every error."""
    known: dict[str, Field[Any]] = {one.name: one for one in fields(cls)}  # type: ignore[arg-type]
    check_keys(table, known, where)
    missing = [one for name, one in known.items() if one.default is MISSING and name not in table]
    if missing:
        first, *others = (one.name for one in missing)
        more = f"; also missing: {', '.join(others)}" if others else ""
        allowed = missing[0].metadata["rule"].allowed
        raise BslamError(f"{where}, key {first}: is missing; allowed: {allowed}{more}")
    values = {
        key: known[key].metadata["rule"].convert(value, f"{where}, key {key}") for key, value in table.items()
    }
    return cls(**values)


def check_keys(table: Mapping[str, object], known: Mapping[str, object], where: str) -> None:
    """Raise BslamError for a key that nobody knows: most often a misspelt one."""
    for key in table:
        if key not in known:
            near = did_you_mean(key, known)
            raise BslamError(f"{where}, key {key}: no such key; allowed: {', '.join(known)}{near}")
