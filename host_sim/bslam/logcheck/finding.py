"""What a check says of a log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray


@dataclass(frozen=True)
class Curve:
    """Points of a picture, or a line through them."""

    label: str
    x: NDArray[Any]
    y: NDArray[Any]
    is_line: bool = False


@dataclass(frozen=True)
class Picture:
    """Evidence to look at."""

    x_label: str
    y_label: str
    curves: Sequence[Curve]


@dataclass(frozen=True)
class Finding:
    """Something wrong with a log; as a note, something that is usual or harms nobody."""

    kind: str  # in summary.json: "mirrored bearings", "delay"
    what: str
    sure: str  # the figures that say so
    mend: str  # the option or the edit
    figures: dict[str, Any] = field(default_factory=dict)
    picture: Picture | None = None
    is_note: bool = False


@dataclass(frozen=True)
class Report:
    """All that was found in a log, and what could not be tested. As a text: what `bslam check` prints."""

    name: str
    findings: list[Finding]
    untested: list[str]
    estimates: dict[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        found = [one for one in self.findings if not one.is_note]
        notes = [one for one in self.findings if one.is_note]
        lines = [f"{self.name}: {len(found)} finding{'' if len(found) == 1 else 's'}"]
        for word, ones in (("found", found), ("note", notes)):
            for one in ones:
                lines += [
                    f"  {word}: {one.kind}: {one.what}",
                    f"    sure: {one.sure}",
                    f"    mend: {one.mend}",
                ]
        return "\n".join([*lines, *(f"  not tested: {one}" for one in self.untested)])
