"""The one exception a user sees, and the nearest name for a misspelt one."""

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
    by_plain_name = {_plain(name): name for name in allowed}
    nearest = get_close_matches(_plain(word), by_plain_name, n=1)
    return f"; did you mean {by_plain_name[nearest[0]]!r}?" if nearest else ""


def _plain(name: object) -> str:
    return str(name).casefold().replace("-", "_")
