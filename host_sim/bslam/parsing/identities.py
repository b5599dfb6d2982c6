"""Identities of beacons as a log has them: numbers, or words such as "exit sign", which get numbers here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.parsing.csvtable import Column, Table, is_count, is_number

BEACON_ID: Final = "beacon_id"
BEACON_ID_MAX: Final = 2**31 - 1
"""Labels are 32-bit numbers in the core."""
WORD_MAX: Final = 64
_ALLOWED: Final = f"an integer from 0 to {BEACON_ID_MAX}, a word of up to {WORD_MAX} printable characters"
IDENTITY: Final = Column(_ALLOWED, is_count, words=True)


@dataclass(frozen=True)
class Identities:
    """What the identities of a log stand for. words: by number, where at least one is no number."""

    words: tuple[str, ...]

    def numbers(self, table: Table) -> NDArray[np.int64]:
        """Of the rows of a table; -1: none."""
        if BEACON_ID not in table.texts:
            return np.full(table.rows, -1, dtype=np.int64)
        place = {word: number for number, word in enumerate(self.words)}
        number = {
            text: -1 if not text else place[_name(text)] if self.words else int(float(text))
            for text in set(table.texts[BEACON_ID])
        }
        return np.array([number[text] for text in table.texts[BEACON_ID]], dtype=np.int64)


def read_identities(sightings: Table, beacons: Table | None) -> Identities:
    """Of both files of a log. Raises BslamError for a field that is neither a number, a word, nor, in
    sightings, empty.
    """
    names: set[str] = set()
    for table, or_empty in ((sightings, ", or empty"), (beacons, "")):
        if table is None or BEACON_ID not in table.texts:
            continue
        texts = table.texts[BEACON_ID]
        good = {text: is_identity(text) if text else bool(or_empty) for text in set(texts)}
        table.require(BEACON_ID, np.array([good[text] for text in texts], np.bool_), _ALLOWED + or_empty)
        names |= {_name(text) for text in good if text}
    return Identities(tuple(sorted(names)) if not all(map(is_number, names)) else ())


def is_identity(text: str) -> bool:
    """Whether a log may have it: a count, or a word that is no number."""
    if is_number(text):
        value = np.array([float(text)])
        return bool(is_count(value)[0] and value[0] <= BEACON_ID_MAX)
    return len(text) <= WORD_MAX and text.isprintable()


def _name(text: str) -> str:
    """What is a number, in one way of writing it: 7 for 7.0."""
    return str(int(float(text))) if is_number(text) else text
