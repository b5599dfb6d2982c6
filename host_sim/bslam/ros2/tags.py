"""The table of tag sizes: side of each tag's square by its number."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from bslam.errors import BslamError
from bslam.parsing.csvtable import Column, read_table
from bslam.parsing.settings import Rule, check_keys, load_toml

SIDE_M: Final = Rule("metres, from 0.001 to 10, as 0.16", float, lambda side: 1e-3 <= side <= 10.0)
_SIDES: Final = Rule("a table, tag = side in metres", dict)
_NAMED_MAX: Final = 8
HELP: Final = (
    'TOML: `default_m = 0.16` for all, below `[side_m]` lines `5 = 0.2` or `"tag36h11:5" = 0.2`; '
    "or csv: id,side_m"
)


@dataclass(frozen=True)
class TagSizes:
    """Sides of tags in m, from edge to edge of what the detector takes for its corners: the black square."""

    side_m: Mapping[str, float]  # by number, or by family and number: "tag36h11:5"
    default_m: float | None = None  # of all others; None: they are not known

    def of(self, identity: str) -> float | None:
        """The side of a tag; None: nobody says."""
        return self.side_m.get(identity, self.side_m.get(identity.rpartition(":")[2], self.default_m))

    def require(self, identities: Iterable[str], where: str) -> None:
        """Raise BslamError that names the tags of unknown size, and what to write."""
        unknown = sorted({one for one in identities if self.of(one) is None}, key=_by_number)
        if unknown:
            more = f" and {len(unknown) - _NAMED_MAX} more" if len(unknown) > _NAMED_MAX else ""
            first = unknown[0].rpartition(":")[2]
            table = f"for all, or --tags FILE.toml with `{first} = 0.16` below `[side_m]`"
            rest = "for these, too, or their rows in the file of --tags"
            mend = f"--tag-size METRES {rest if self.side_m else table}"
            raise BslamError(
                f"{where}: size of tags {', '.join(unknown[:_NAMED_MAX])}{more} unknown; allowed: {mend}"
            )


def _by_number(identity: str) -> tuple[str, int, str]:
    family, _, word = identity.rpartition(":")
    return family, int(word) if word.isdecimal() else -1, word


def read_tag_sizes(path: Path) -> TagSizes:
    """Of a TOML or csv file. Raises BslamError that names the line or key, and what is allowed."""
    if path.suffix == ".csv":
        column = Column("a number from 0.001 to 10", lambda side: (side >= 1e-3) & (side <= 10.0))
        names = Column("the number of a tag, or family:number", lambda one: one >= 0, words=True)
        table = read_table(path, [{"id": names, "side_m": column}])
        table.require_rows(f"allowed: {HELP}")
        first = np.isin(np.arange(table.rows), np.unique(table.texts["id"], return_index=True)[1])
        table.require("id", first, "a tag that no line above has")
        return TagSizes(dict(zip(table.texts["id"], table.values["side_m"].tolist(), strict=True)))
    if path.suffix != ".toml":
        raise BslamError(f"{path}: allowed: FILE.toml or FILE.csv; {HELP}")
    content = load_toml(path)
    check_keys(content, {"default_m": None, "side_m": None}, str(path))
    sides = _SIDES.convert(content.get("side_m", {}), f"{path}, key side_m")
    default = content.get("default_m")
    return TagSizes(
        {one: SIDE_M.convert(side, f"{path}, key side_m.{one}") for one, side in sides.items()},
        None if default is None else SIDE_M.convert(default, f"{path}, key default_m"),
    )
