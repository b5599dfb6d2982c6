"""Frames of the link: header, payload and CRC under COBS, a zero between frames."""

from __future__ import annotations

import binascii
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from cobs import cobs

VERSION = 1
_HEADER = struct.Struct("<BBHq")  # version, type, sequence, time in us
_CRC = struct.Struct(">H")
LONGEST = 1 << 16
"""Bytes without a delimiter that no frame has."""


@dataclass(frozen=True)
class Frame:
    """A message: `sequence` counts the sender's frames modulo 2**16, `time_us` is what it tells of."""

    type: int
    sequence: int
    time_us: int
    payload: bytes


def encode(frame: Frame) -> bytes:
    """The frame as it goes over the line, delimiter included."""
    content = _HEADER.pack(VERSION, frame.type, frame.sequence, frame.time_us) + frame.payload
    return cobs.encode(content + _CRC.pack(crc16(content))) + b"\0"


def crc16(data: bytes) -> int:
    """CRC-16/GENIBUS."""
    return binascii.crc_hqx(data, 0xFFFF) ^ 0xFFFF


class Decoder:
    """Bytes in, frames out; what is no frame is counted, by kind, and dropped."""

    def __init__(self) -> None:
        self.dropped: Counter[str] = Counter()
        self._bytes = bytearray()

    def push(self, data: bytes) -> Iterator[Frame]:
        """The frames that these bytes complete."""
        self._bytes += data
        *whole, rest = self._bytes.split(b"\0")
        self._bytes = rest
        for one in whole:
            frame = self._frame(bytes(one)) if one else None
            if frame is not None:
                yield frame
        if len(self._bytes) > LONGEST:
            self.dropped["too_long"] += 1
            self._bytes.clear()

    def _frame(self, stuffed: bytes) -> Frame | None:
        try:
            content = cobs.decode(stuffed)
        except cobs.DecodeError:
            self.dropped["truncated"] += 1
            return None
        if len(content) < _HEADER.size + _CRC.size:
            self.dropped["truncated"] += 1
            return None
        if crc16(content[: -_CRC.size]) != _CRC.unpack(content[-_CRC.size :])[0]:
            self.dropped["bad_crc"] += 1
            return None
        version, kind, sequence, time_us = _HEADER.unpack_from(content)
        if version != VERSION:
            self.dropped["bad_version"] += 1
            return None
        return Frame(kind, sequence, time_us, content[_HEADER.size : -_CRC.size])
