"""The one exception a user sees, the nearest name for a misspelt one, and what brings a missing package."""

import shlex
import sys
from collections.abc import Iterable
from difflib import get_close_matches


class BslamError(Exception):
    """Bad input. The message says what is wrong, where (file, line or key), and what is allowed.

    The command line prints the message as the last line on stderr and exits with status 2.
    """


def did_you_mean(word: object, allowed: Iterable[str]) -> str:
    """What to append to a message about `word`: "; did you mean 'NAME'?" with the nearest allowed name.

    "" where none is near. Case and "-" for "_" count as no difference.
    """
    name = nearest(word, allowed)
    return "" if name is None else f"; did you mean {name!r}?"


def pip_install(*packages: str) -> str:
    """The command that brings packages to the Python that runs, which need not be the one on PATH."""
    return shlex.join([sys.executable, "-m", "pip", "install", *packages])


def nearest(word: object, allowed: Iterable[str]) -> str | None:
    """The allowed name that is most like `word`; None where none is near."""
    found = _nearest_few(word, allowed, 1)
    return found[0] if found else None


def setting_instead(word: object, settings: Iterable[str]) -> str:
    """What is allowed in place of a setting that does not exist: the nearest ones, and who lists all."""
    near = _nearest_few(word, settings, 3)
    allowed = f"{', '.join(near)}{' or another' if near else 'one'} that `bslam params --all` lists"
    return f"allowed: {allowed}{did_you_mean(word, settings)}"


def _nearest_few(word: object, allowed: Iterable[str], most: int) -> list[str]:
    by_plain_name = {_plain(name): name for name in allowed}
    return [by_plain_name[one] for one in get_close_matches(_plain(word), by_plain_name, n=most)]


def _plain(name: object) -> str:
    return str(name).casefold().replace("-", "_")
