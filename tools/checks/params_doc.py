"""Prints the table of run-time parameters for docs/API.md, from the C table: `make docs`.

With --into FILE the table replaces what stands there between the two markers.

Exit status 0: printed, or written. 1: the file has no markers.
"""

import argparse
import sys
from pathlib import Path

from bslam.core import Parameter, Slam

BEGIN = "<!-- parameters: begin, written by `make docs` -->"
END = "<!-- parameters: end -->"


def table() -> str:
    """Every parameter as a row of a Markdown table, in the order of firmware/bslam/settings.h."""
    lines = ["| parameter | type | default | from | to | meaning |", "|---|---|---:|---:|---:|---|"]
    return "\n".join([*lines, *map(row, Slam.parameters())]) + "\n"


def row(parameter: Parameter) -> str:
    """One parameter, with the type of its field in bslam_settings_t."""
    values = (parameter.default, parameter.low, parameter.high)
    shown = [f"{int(value)}" if parameter.is_integer else f"{value:g}" for value in values]
    kind = "integer" if parameter.is_integer else "real"
    return f"| `{parameter.name}` | {kind} | {' | '.join(shown)} | {parameter.meaning} |"


def put_between_markers(text: str, content: str) -> str:
    """`text` with `content` between the markers. Raises ValueError if they are missing."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"no markers {BEGIN} and {END}")
    return f"{before}{begin}\n\n{content}\n{end}{after}"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--into", type=Path, metavar="FILE", help="write it there, between the markers")
    file: Path | None = parser.parse_args(argv).into
    if file is None:
        print(table(), end="")
        return 0
    text = file.read_text(encoding="utf-8")
    try:
        file.write_text(put_between_markers(text, table()), encoding="utf-8")
    except ValueError as error:
        print(f"{file}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
