"""A parser whose errors are one line: what is wrong, what is allowed, and the nearest name."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any, NoReturn

from bslam.errors import did_you_mean


class Parser(argparse.ArgumentParser):
    """argparse's, but for what it says of a mistake: no usage of forty lines before the one that helps."""

    def error(self, message: str) -> NoReturn:
        """Exit status 2, and one line."""
        self.exit(2, f"{self.prog}: error: {message}\n")

    def words(self, words: Sequence[str]) -> argparse.Namespace:
        """Options and positional words in any order; a word that no command has is named."""
        found, unknown = self.parse_known_intermixed_args(words)
        for word in unknown:
            name = word.partition("=")[0]
            if name.startswith("-"):
                options = [one for one in self._option_string_actions if one.startswith("--")]
                allowed = ", ".join(options)
                self.error(f"option {name} does not exist; allowed: {allowed}{did_you_mean(name, options)}")
        if unknown:
            self.error(f"'{unknown[0]}' is one word too many; `{self.prog} --help` shows what is allowed")
        return found

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            names = [str(one) for one in action.choices]
            allowed = f"allowed: {', '.join(names)}{did_you_mean(str(value), names)}"
            raise argparse.ArgumentError(action, f"'{value}' does not exist; {allowed}")
