"""Writes the generated parts of docs/TUNING.md from the C tables: `make docs`.

Prints them, or with --into FILE puts each between its two markers.

Exit status 0: printed, or written. 1: the file lacks markers.
"""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bslam.core.presets import preset_settings
from bslam.core.raw import library

HEAD = ("| setting | default | range | meaning |", "|---|---:|---|---|")
KNOWN, SVM = 0, 3
INVARIANT, SMOOTHER = 1, 2
GROUPS = {"settings": "Settings", "expert": "For who knows the filter"}


def settings_tables() -> str:
    """Settings and expert settings as Markdown tables, in the order of firmware/bslam/settings.h."""
    raw = library("double", 1)
    parts = []
    for group, title in GROUPS.items():
        rows = [row(raw.text, info) for info in raw.settings_infos() if raw.text(info.group) == group]
        parts += [f"### {title}", "", *HEAD, *rows, ""]
    return "\n".join(parts)


def row(text: Any, info: Any) -> str:
    """One setting."""
    default, low, high = (number(value) for value in (info.initial, info.low, info.high))
    return f"| `{text(info.name)}` | {default} | {low}..{high} | {text(info.meaning)} |"


def number(value: float) -> str:
    """As one would write it: 0.05, 1000000, 1e-06."""
    return f"{value:.0f}" if value == int(value) else f"{value:g}"


def presets_table() -> str:
    """What each preset changes of what it goes on top of."""
    wheels = preset_settings([], KNOWN, INVARIANT)
    known_speeds = preset_settings(["commanded"], KNOWN, INVARIANT)
    other_speeds = preset_settings(["commanded"], SVM, INVARIANT) | {"association": KNOWN}
    known_camera = preset_settings(["camera"], KNOWN, INVARIANT)
    other_camera = preset_settings(["camera"], SVM, INVARIANT) | {"association": KNOWN}
    smoother = preset_settings([], KNOWN, SMOOTHER)
    cases = {
        "`real-wheels`": "nothing: they are the defaults",
        "`paper`": changes(wheels, preset_settings(["paper"], KNOWN, INVARIANT)),
        "`commanded`": changes(wheels, known_speeds),
        "with unknown identity": changes(known_speeds, other_speeds),
        "`camera`": changes(wheels, known_camera),
        "and with unknown identity": changes(known_camera, other_camera),
        "`bearing-only`": changes(wheels, preset_settings(["bearing-only"], KNOWN, INVARIANT)),
        "and with the smoother": changes(smoother, preset_settings(["bearing-only"], KNOWN, SMOOTHER)),
    }
    rows = (f"| {name} | {what} |" for name, what in cases.items())
    return "\n".join(["| preset | what it changes |", "|---|---|", *rows]) + "\n"


def changes(before: Mapping[str, float], after: Mapping[str, float]) -> str:
    """ "`name` = value, ..." of the settings that differ."""
    found = [f"`{name}` = {number(value)}" for name, value in after.items() if value != before[name]]
    return ", ".join(found) or "nothing"


def parts() -> dict[str, str]:
    """The generated parts by the names of their markers."""
    return {"presets": presets_table(), "settings": settings_tables()}


def markers(name: str) -> tuple[str, str]:
    """What stands before and behind a part."""
    return f"<!-- {name}: begin, written by `make docs` -->", f"<!-- {name}: end -->"


def put_between_markers(text: str, name: str, content: str) -> str:
    """`text` with `content` between the markers of a part. Raises ValueError if they are missing."""
    first, last = markers(name)
    before, begin, rest = text.partition(first)
    _, end, after = rest.partition(last)
    if not (begin and end):
        raise ValueError(f"no markers {first} and {last}")
    return f"{before}{begin}\n\n{content.rstrip()}\n\n{end}{after}"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--into", type=Path, metavar="FILE", help="write them there, between the markers")
    file: Path | None = parser.parse_args(argv).into
    if file is None:
        print("\n".join(parts().values()), end="")
        return 0
    text = file.read_text(encoding="utf-8")
    try:
        for name, content in parts().items():
            text = put_between_markers(text, name, content)
    except ValueError as error:
        print(f"{file}: {error}", file=sys.stderr)
        return 1
    file.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
