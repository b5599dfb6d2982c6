"""A serial line on which no robot speaks: the console ends with a word, whatever comes."""

import contextlib
import os
import pty
import random
import struct
import threading
import tty

import pytest

from bslam.cli import main
from bslam.link.frames import Decoder, Frame, encode
from bslam.link.messages import ANSWER, Message, Report
from bslam.target import client
from bslam.target.client import Client
from bslam.target.lines import SerialLine, TargetError

RANDOM = random.Random(3)
NOISES = {
    "random": lambda: RANDOM.randbytes(2000),
    "no delimiter": lambda: RANDOM.randbytes(2000).replace(b"\0", b"\1"),
    "delimiters": lambda: bytes(2000),
    "escapes": lambda: b"\x1b]0;owned\x07\x1b[2J\0" * 100,
    "frames of nobody": lambda: encode(Frame(0x55, 1, 2, b"\x1b[2J")) * 20,
}


@pytest.fixture
def device(monkeypatch):
    """Makes a serial device that says, time and again, what a function gives for what it is told."""
    monkeypatch.setattr(client, "ANSWER_TIMEOUT_S", 0.3)
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    stop = threading.Event()

    def speak(answer):
        def run():
            while not stop.wait(0.005):
                try:
                    told = os.read(ours, 4096)
                except BlockingIOError:
                    told = b""
                with contextlib.suppress(BlockingIOError):
                    os.write(ours, answer(told))

        threading.Thread(target=run, daemon=True).start()
        return os.ttyname(theirs)

    yield speak
    stop.set()


@pytest.mark.parametrize("noise", NOISES)
def test_a_console_on_a_noisy_line_ends_with_a_word(device, capsys, noise):
    name = device(lambda told: NOISES[noise]())
    assert main(["console", f"serial:{name}"]) == 1
    written = capsys.readouterr()
    said = written.err.splitlines()[-1]
    assert "no answer to HELLO after" in said
    assert noise == "frames of nobody" or said.endswith("bytes came that are no message of a robot")
    assert "\x1b" not in written.out + written.err


def test_a_console_on_a_silent_line_ends_with_a_word(device, capsys):
    assert main(["console", f"serial:{device(lambda told: b'')}"]) == 1
    assert capsys.readouterr().err.splitlines()[-1].endswith("no answer to HELLO after 5 attempts")


@pytest.mark.parametrize("body", [b"", b"\0\0", b"\0\0short"])
def test_an_answer_that_is_none_ends_with_a_word(device, body):
    decoder = Decoder()

    def answer(told):
        asked = [one for one in decoder.push(told) if one.type == Message.HELLO]
        return b"".join(encode(Frame(Message.HELLO | ANSWER, one.sequence, 0, body)) for one in asked)

    line = SerialLine(device(answer))
    with pytest.raises(TargetError, match=r"HELLO"):
        Client(line)
    line.close()


def test_a_device_that_takes_nothing_ends_with_a_word(monkeypatch):
    monkeypatch.setattr(SerialLine, "WRITE_TIMEOUT_S", 0.2)
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    line = SerialLine(os.ttyname(theirs))
    with pytest.raises(TargetError, match="imeout"):
        line.write(bytes(1 << 20))
    line.close()
    os.close(ours)


def test_a_start_that_nobody_knows_is_said_without_its_bytes():
    ready = Frame(Report.READY, 1, 0, struct.pack("BB", 0, 200))
    assert str(client._started_anew(ready)).startswith("the target started anew, and says so in another way")
