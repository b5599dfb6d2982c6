"""Helps that fit on a screen: what a command's user needs first, and the rest by name.

As with Jupyter, curl or ripgrep there are two: `--help` only names what few users change, `--help-all`
explains it. argparse's own formatter writes both.
"""

from __future__ import annotations

import argparse
import shutil
import textwrap
from collections.abc import Iterable
from typing import Any, Final
from weakref import WeakKeyDictionary

_COLUMNS_MOST: Final = 100
_MORE: Final = "more options"


class ShortHelp(argparse.RawDescriptionHelpFormatter):
    """Of the group that `more_options` makes it gives the names, of the text after examples the beginning."""

    _fold = True

    def __init__(self, prog: str, **more: Any) -> None:
        width = min(shutil.get_terminal_size((_COLUMNS_MOST, 24)).columns, _COLUMNS_MOST)
        super().__init__(prog, width=width, **more)
        self._columns = width
        self._names: list[str] = []  # of the options that were folded
        self._folding = False

    def add_usage(
        self,
        usage: str | None,
        actions: Iterable[argparse.Action],
        groups: Iterable[Any],
        prefix: str | None = None,
    ) -> None:
        """The words that have to be there, and `[options]` for all others."""
        words = [f"{_shown(one)}..." if one.nargs == "+" else _shown(one) for one in _words(actions)]
        super().add_usage(usage or " ".join(["%(prog)s", *words, "[options]"]), actions, groups, prefix)

    def start_section(self, heading: str | None) -> None:
        self._folding = self._fold and heading == _MORE
        super().start_section(heading)

    def add_argument(self, action: argparse.Action) -> None:
        if self._folding:
            self._names.append(action.option_strings[0])
        else:
            super().add_argument(action)

    def add_text(self, text: str | None) -> None:
        """Sentences are filled; what is indented, as examples are, stays as it is."""
        if text is not None and self._names and text.startswith("examples:"):
            text = "\n\n".join(text.split("\n\n")[:2])
            first, *rest = self._names
            super().add_text(self._filled(f"more options, explained by {first}:\n{', '.join(rest)}"))
        super().add_text(None if text is None else self._filled(text))

    def _filled(self, text: str) -> str:
        lines: list[str] = []
        goes_on = False  # the next line may be appended to the last of `lines`
        for line in text.splitlines():
            is_prose = line[:1] not in ("", " ")
            if goes_on and is_prose:
                lines[-1] += f" {line}"
            else:
                lines.append(line)
            goes_on = is_prose and line[-1] not in ".:"
        return "\n".join(line if line[:1] in ("", " ") else self._fill(line) for line in lines)

    def _fill(self, line: str) -> str:
        return textwrap.fill(line, self._columns, break_on_hyphens=False)


class FullHelp(ShortHelp):
    """Everything."""

    _fold = False


class _HelpAll(argparse.Action):
    def __init__(self, option_strings: list[str], dest: str, **words: Any) -> None:
        super().__init__(option_strings, dest, nargs=0, default=argparse.SUPPRESS, **words)

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        parser.formatter_class = FullHelp
        parser.print_help()
        parser.exit()


_groups: WeakKeyDictionary[argparse.ArgumentParser, Any] = WeakKeyDictionary()


def more_options(parser: argparse.ArgumentParser) -> Any:
    """The parser's group of options that `--help` only names and `--help-all` explains."""
    if parser not in _groups:
        _groups[parser] = parser.add_argument_group(_MORE)
        _groups[parser].add_argument("--help-all", action=_HelpAll, help="this help, with all of these")
    return _groups[parser]


def _words(actions: Iterable[argparse.Action]) -> list[argparse.Action]:
    """Those that are no options."""
    return [one for one in actions if not one.option_strings]


def _shown(word: argparse.Action) -> str:
    """As the usage has it: its name, or the words that it may be."""
    return str(word.metavar) if word.metavar else f"{{{','.join(map(str, word.choices or [word.dest]))}}}"
