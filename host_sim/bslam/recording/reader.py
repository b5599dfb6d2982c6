"""An MCAP file of ours back into entries."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, Footer, Message
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from zstandard import ZstdDecompressor, ZstdError

from bslam.errors import BslamError
from bslam.recording.entries import FORMATS, Entry, Start

SUFFIX = ".mcap"
CHUNK_BYTES_MAX = 16 << 20
"""A chunk of ours has 128 KB, or one message, the longest of which holds a kept map."""
BYTES_MAX = 1 << 30
"""Of all chunks, unpacked: some hours of a drive, and what this computer has room for."""
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
        cut, bag = "it was cut short, and", ""
        if complete:
            cut, bag = "it", f"; for a bag of ROS 2: bslam import ros2 {path}"
        raise BslamError(f"{path}: {cut} does not begin with /start; {_ALLOWED}{bag}")
    return Recording(path, entries[0], tuple(entries[1:]), complete)


def _read(path: Path, file: Any) -> tuple[list[Entry], bool]:
    entries: list[Entry] = []
    complete = False
    topics: dict[int, str] = {}
    try:
        for record in _records(path, file):
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message) and topics.get(record.channel_id) in _BY_TOPIC:
                entries.append(_entry(path, topics[record.channel_id], record))
            complete = complete or isinstance(record, Footer)
    except (McapError, CRCValidationError, ZstdError, ValueError) as error:
        raise BslamError(f"{path}: {type(error).__name__}: {error}; {_ALLOWED}") from error
    return entries, complete


def _records(path: Path, file: Any) -> Iterator[Any]:
    """All records up to the end, or to where the file was cut."""
    unpacked = 0
    reader = StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=CHUNK_BYTES_MAX)
    try:
        for record in reader.records:
            if not isinstance(record, Chunk):
                yield record
                continue
            data = _unpacked(path, record)
            unpacked += len(data)
            if unpacked > BYTES_MAX:
                raise BslamError(
                    f"{path}: it unpacks to more than {BYTES_MAX >> 20} MB; allowed: at most that"
                )
            yield from breakup_chunk(replace(record, data=data, compression=""), validate_crc=True)
    except (EndOfFile, struct.error, zlib.error):
        return


def _unpacked(path: Path, chunk: Chunk) -> bytes:
    """The chunk's content, of which no more is unpacked than may be there, whatever it says of itself."""
    if chunk.compression not in ("zstd", ""):
        raise BslamError(f"{path}: a chunk packed by {chunk.compression!r}; {_ALLOWED}")
    data = chunk.data
    if chunk.compression:
        with ZstdDecompressor().stream_reader(BytesIO(chunk.data)) as stream:
            data = stream.read(CHUNK_BYTES_MAX + 1)
    if len(data) > CHUNK_BYTES_MAX:
        raise BslamError(f"{path}: a chunk unpacks to more than {CHUNK_BYTES_MAX >> 20} MB; {_ALLOWED}")
    return data


def _entry(path: Path, topic: str, record: Message) -> Entry:
    try:
        return _BY_TOPIC[topic].read(json.loads(record.data))
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        where = f"{path}: {topic}, message {record.sequence}"
        raise BslamError(f"{where}: {type(error).__name__}: {error}; {_ALLOWED}") from error
