"""An MCAP file of ours back into entries."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Footer, Message
from mcap.stream_reader import CRCValidationError, StreamReader
from zstandard import ZstdError

from bslam.errors import BslamError
from bslam.recording.entries import FORMATS, Entry, Start

SUFFIX = ".mcap"
_BY_TOPIC = {form.topic: form for form in FORMATS.values()}
_ALLOWED = "allowed: a recording that `bslam run --record` or `bslam console --record` made"


@dataclass(frozen=True)
class Recording:
    """A recording as it was read. complete: it was closed; else its end may be missing."""

    path: Path
    start: Start
    entries: tuple[Entry, ...]  # without the start, in the order in which they happened
    complete: bool


def load(path: str | Path) -> Recording:
    """Read a recording, one that was cut short as far as it goes. Raises BslamError for what is none."""
    path = Path(path)
    try:
        with path.open("rb") as file:
            entries, complete = _read(path, file)
    except OSError as error:
        raise BslamError(f"{path}: cannot be read: {error}; {_ALLOWED}") from error
    if not entries or not isinstance(entries[0], Start):
        raise BslamError(f"{path}: it does not begin with /start; {_ALLOWED}")
    return Recording(path, entries[0], tuple(entries[1:]), complete)


def _read(path: Path, file: Any) -> tuple[list[Entry], bool]:
    entries: list[Entry] = []
    complete = False
    topics: dict[int, str] = {}
    try:
        for record in _records(file):
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message) and topics.get(record.channel_id) in _BY_TOPIC:
                entries.append(_entry(path, topics[record.channel_id], record))
            complete = complete or isinstance(record, Footer)
    except (McapError, CRCValidationError, ZstdError, ValueError) as error:
        raise BslamError(f"{path}: {type(error).__name__}: {error}; {_ALLOWED}") from error
    return entries, complete


def _records(file: Any) -> Iterator[Any]:
    """All records up to the end, or to where the file was cut."""
    try:
        yield from StreamReader(file, validate_crcs=True).records
    except (EndOfFile, struct.error, zlib.error):
        return


def _entry(path: Path, topic: str, record: Message) -> Entry:
    try:
        return _BY_TOPIC[topic].read(json.loads(record.data))
    except (ValueError, KeyError, TypeError) as error:
        where = f"{path}: {topic}, message {record.sequence}"
        raise BslamError(f"{where}: {type(error).__name__}: {error}; {_ALLOWED}") from error
