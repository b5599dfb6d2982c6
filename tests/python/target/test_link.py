"""The link in C against that in Python: each takes what the other makes, and neither what is bad."""

import struct

from cobs import cobs
from hypothesis import given, settings
from hypothesis import strategies as st

from bslam.link.frames import Decoder, Frame, crc16, encode
from bslam.link.messages import LINK_COUNTERS
from internals import link_library

FFI, LIB = link_library().ffi, link_library().lib

frames = st.builds(
    Frame,
    type=st.integers(0, 255),
    sequence=st.integers(0, 2**16 - 1),
    time_us=st.integers(-(2**63), 2**63 - 1),
    payload=st.one_of(
        st.binary(max_size=300),
        st.binary(min_size=1, max_size=2).map(lambda b: (b * 1000)[:1000]),  # long, with and without zeros
    ),
)


class CParser:
    """A parser of the C library."""

    def __init__(self):
        self.parser = FFI.new("bslam_link_parser_t *")

    def push(self, data):
        found = []
        for byte in data:
            if LIB.bslam_link_push(self.parser, byte):
                reader = LIB.bslam_link_payload(self.parser)
                header = self.parser.header
                payload = bytes(FFI.buffer(reader.bytes, reader.left)) if reader.left else b""
                found.append(Frame(header.type, header.sequence, header.time_us, payload))
        return found

    @property
    def dropped(self):
        counters = self.parser.counters
        return sum(getattr(counters, name) for name in LINK_COUNTERS) - counters.frames


def c_encode(frame):
    """The frame as C writes it."""
    room = len(frame.payload) + 64
    out = FFI.new("uint8_t[]", room)
    writer = FFI.new("bslam_link_writer_t *")
    header = FFI.new("bslam_link_header_t *", [frame.type, frame.sequence, frame.time_us])
    LIB.bslam_link_begin(writer, out, room, header)
    for byte in frame.payload:
        LIB.bslam_link_put_u8(writer, byte)
    length = LIB.bslam_link_end(writer)
    assert length > 0
    return bytes(FFI.buffer(out, length))


def test_the_counters_of_the_link_are_those_of_the_parser():
    assert tuple(name for name, _ in FFI.typeof("bslam_link_counters_t").fields) == LINK_COUNTERS


@given(frames)
def test_python_and_c_write_the_same_bytes(frame):
    assert c_encode(frame) == encode(frame)


@given(st.lists(frames, max_size=4))
def test_what_python_writes_c_reads(sent):
    parser = CParser()
    assert parser.push(b"".join(map(encode, sent))) == sent
    assert parser.dropped == 0


@given(st.lists(frames, max_size=4), st.integers(1, 50))
def test_what_c_writes_python_reads_in_any_pieces(sent, piece):
    data = b"".join(map(c_encode, sent))
    decoder = Decoder()
    found = [f for at in range(0, len(data), piece) for f in decoder.push(data[at : at + piece])]
    assert found == sent
    assert not decoder.dropped


damages = st.lists(
    st.tuples(st.sampled_from(["flip", "drop", "insert"]), st.integers(0, 10**6), st.integers(0, 255)),
    min_size=1,
    max_size=6,
)


def damaged(data, damage):
    data = bytearray(data)
    for kind, at, value in damage:
        at %= max(1, len(data))
        if kind == "flip" and data:
            data[at] ^= 1 << value % 8
        elif kind == "drop":
            del data[at : at + 1 + value % 8]
        else:
            data[at:at] = bytes((value,))
    return bytes(data)


@settings(max_examples=400)
@given(st.lists(frames, min_size=1, max_size=4), damages, frames)
def test_after_any_damage_both_agree_and_take_the_next_frame(sent, damage, last):
    data = damaged(b"".join(map(encode, sent)), damage) + b"\0" + encode(last)
    parser, decoder = CParser(), Decoder()
    found = parser.push(data)
    assert found == list(decoder.push(data))
    assert parser.dropped == sum(decoder.dropped.values())
    assert found[-1] == last
    # What was damaged is gone, and nothing is made up: 6 faults meet a 16-bit CRC once in 65536.
    assert all(frame in sent or frame == last for frame in found)


@given(st.binary(max_size=400))
def test_noise_is_taken_by_neither(noise):
    parser, decoder = CParser(), Decoder()
    found = parser.push(noise + b"\0")
    assert found == list(decoder.push(noise + b"\0"))
    assert found == []


def test_a_flood_is_counted_once_and_keeps_no_memory():
    parser, decoder = CParser(), Decoder()
    flood = b"\xff" * 70_000
    assert parser.push(flood) == []
    assert list(decoder.push(flood)) == []
    assert parser.dropped == 1
    assert decoder.dropped["too_long"] == 1


def test_another_version_is_dropped():
    frame = bytearray(encode(Frame(1, 0x0101, 0x0101010101010101, b"x"))[1:-1])  # one block without zeros
    content = b"\x02" + bytes(frame[1:-2])
    data = cobs.encode(content + struct.pack(">H", crc16(content))) + b"\0"
    parser, decoder = CParser(), Decoder()
    assert parser.push(data) == list(decoder.push(data)) == []
    assert parser.parser.counters.bad_version == decoder.dropped["bad_version"] == 1
