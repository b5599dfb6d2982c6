"""Stamps of messages: put in order where that is safe, refused where it is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.parsing.csvtable import began_at

BACK_MAX_NS = 1_000_000_000
"""Messages may stand this far out of order; more, and the clock itself was set back."""


def in_order(stamps_ns: list[int], topic: str, notes: list[str]) -> NDArray[np.int64]:
    """The messages, by their place in the bag, in order of their stamps; notes what is moved or left out.

    A short head of messages that are all later than what follows is left out, as in a log folder. Raises
    BslamError where nobody fills the stamps, or time runs back.
    """
    stamps = np.array(stamps_ns, dtype=np.int64)
    if (stamps <= 0).any():
        raise BslamError(
            f"{topic}: header.stamp of message {int(np.argmin(stamps > 0))} is 0; allowed: a time"
        )
    first = began_at(stamps)
    if first:
        notes.append(f"{topic}: left out {first} messages at the start: time runs back after them")
    kept = np.arange(first, len(stamps), dtype=np.int64)
    behind = np.maximum.accumulate(stamps[kept]) - stamps[kept]
    if behind.size and behind.max() > BACK_MAX_NS:
        row = int(np.argmax(behind > BACK_MAX_NS))
        after_s = (stamps[kept[row - 1]] - stamps[first]) * 1e-9
        raise BslamError(
            f"{topic}: header.stamp of message {first + row} runs back by {behind[row] * 1e-9:.3f} s; "
            f"allowed: {BACK_MAX_NS * 1e-9:g} s; a simulation that starts anew makes two drives of one "
            f"bag: --end S takes the first, --start S the second, S: seconds of the bag; it is about "
            f"{after_s:.1f} s after the first message taken"
        )
    if (behind > 0).any():
        notes.append(f"{topic}: {int((behind > 0).sum())} messages came out of order and were sorted")
    return kept[np.argsort(stamps[kept], kind="stable")]


def without_repeats(time_us: NDArray[np.int64], topic: str, notes: list[str]) -> NDArray[np.bool_]:
    """Which of these times in order are not that of the one before; notes how many are left out."""
    new = np.diff(time_us, prepend=time_us[:1] - 1) > 0
    if not new.all():
        notes.append(f"{topic}: left out {int((~new).sum())} messages with the stamp of the one before")
    return new
