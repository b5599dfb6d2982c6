"""Faults of the application and its image: messages twice and again, a stack that is too small.

They need the application as a process of this computer and an image for a board, which make builds.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from functools import partial

from bslam.errors import BslamError
from bslam.faults.promise import STEP_US, Fault, Measured
from bslam.link import messages
from bslam.link.frames import Decoder, Frame, encode
from bslam.link.messages import ANSWER, Message
from bslam.target.lines import BUILD_DIR, ROOT, ProcessLine, QemuLine, TargetError

_SILENCE_S = 5.0
_REPLAYED = 11
"""Of the session's messages all but HELLO and RESET, which begin it anew."""
_SHALLOW = "microbit/shallow.elf"
"""The application with a stack that its call graph exceeds (mk/images.mk)."""


def is_clone() -> bool:
    """The firmware's sources are here, and what makes them."""
    return (ROOT / "Makefile").is_file()


def _built(name: str) -> None:
    """Has make build a file of build/. Raises BslamError with what it said."""
    done = subprocess.run(
        ["make", "--silent", f"build/{name}"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise BslamError(f"make build/{name}: {done.stderr.strip()}")


def _answers(line: ProcessLine, frames: list[Frame], wanted: int) -> list[bytes]:
    """Sends frames, and waits for so many answers or silence; what they say."""
    line.write(b"".join(encode(one) for one in frames))
    decoder = Decoder()
    said: list[bytes] = []
    while len(said) < wanted and (data := line.read(_SILENCE_S)):
        said += [one.payload for one in decoder.push(data) if one.type & ANSWER]
    return said


def _session() -> list[Frame]:
    """From the start: readings, and an interruption, which adds doubt as often as it is told."""
    hello = messages.hello(7)
    frames = [Frame(Message.HELLO, 1, 0, hello), Frame(Message.RESET, 2, 0, b"")]
    for step in range(1, 11):
        reading = messages.odometry("wheels", 0.02, 0.018, None)
        frames.append(Frame(Message.ODOMETRY, 2 + step, step * STEP_US, reading))
    return [*frames, Frame(Message.RESUME, 13, 0, messages.resume(0.5, 0.1))]


def _again(count: int, protected: bool) -> Measured:
    """The last `count` messages come once more; unprotected: under new numbers, as if they were new."""
    _built("host/robot")
    line = ProcessLine(BUILD_DIR / "host" / "robot")
    try:
        frames = _session()
        before = _answers(line, frames, len(frames))
        repeated = frames[-count:]
        if not protected:
            repeated = [replace(one, sequence=14 + place) for place, one in enumerate(repeated)]
        after = _answers(line, repeated, 1 if protected else count)
    finally:
        line.close()
    same = len(before) == len(frames) and after[-1] == before[-1]
    text = f"{count} sent again, {len(after)} answered; state {'same' if same else 'changed'}"
    return Measured(same, text)


def _stack_overflow(protected: bool) -> Measured:
    """An image whose stack is too small: refused before it is on any board; on one it ends."""
    _built(_SHALLOW)
    image = BUILD_DIR / _SHALLOW
    if protected:
        check = [sys.executable, "-m", "tools.checks.check_image", str(image), "--objects", str(image.parent)]
        done = subprocess.run(check, cwd=ROOT, capture_output=True, text=True, check=False)
        said = done.stderr.strip().removeprefix(f"{image}: ").split(":")[0]
        return Measured(done.returncode == 1 and "bytes of stack at worst" in said, f"refused: {said}")
    try:
        line = QemuLine(f"microbit/{image.stem}")
        try:
            for frame in _session():
                line.write(encode(frame))
                line.read(_SILENCE_S)
        finally:
            line.close()
    except TargetError as error:
        return Measured(False, f"it ends when it is run: {str(error).splitlines()[0]}")
    return Measured(False, "it runs, and nobody has noticed yet")


def device_faults() -> list[Fault]:
    """The rows of the application and its image."""
    number = "the sequence number"
    return [
        Fault("line: message twice", "applied once", number, partial(_again, 1), True),
        Fault("line: replay", "not applied, state unchanged", number, partial(_again, _REPLAYED), True),
        Fault("stack overflow", "refused before it runs", "the image's call graph", _stack_overflow, True),
    ]
