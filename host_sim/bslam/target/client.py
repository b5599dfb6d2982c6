"""A session with a robot: one message out, its answer back, sent again if that does not come."""

from __future__ import annotations

import secrets
import struct
import time
from collections import deque
from dataclasses import dataclass

from bslam.link import messages
from bslam.link.frames import Decoder, Frame, encode
from bslam.link.messages import ANSWER, LINK_STATUSES, Info, Message, Report
from bslam.target.lines import Line, TargetError

ANSWER_TIMEOUT_S = 2.0
NOISE_MAX = 100_000  # bytes without a frame among them: some seconds of a serial line
_PATIENCE = 5  # so many times that, while a robot speaks of other things
_MEANING = {
    "STORE": ": the board keeps nothing over a restart, or has no room for such a map",
    "TYPE": ": the image has no such message",
}


@dataclass(frozen=True)
class Answer:
    """`status` of the library, what it is about (`messages.NO_DETAIL`: nothing), and the rest."""

    status: int
    detail: int
    body: bytes


def _started_anew(ready: Frame) -> TargetError:
    try:
        return TargetError(f"the target started anew: {messages.read_start(ready.payload)}")
    except (IndexError, KeyError):
        return TargetError("the target started anew, and says so in another way than this program")


class Client:
    """The host's side of the link. A message is applied once, however often its frame or answer is lost."""

    def __init__(self, line: Line, *, fingerprints: bool = False, as_it_is: bool = False) -> None:
        self._line = line
        self._decoder = Decoder()
        self._frames: deque[Frame] = deque()
        self._sequence = secrets.randbelow(1 << 16)
        self.repeats = 0
        self._noise = 0  # bytes since the last frame
        self._reports: deque[Frame] = deque()
        self._last_report: int | None = None
        self.reports_lost = 0
        session = secrets.randbits(32)
        line.write(b"\0")
        payload = messages.hello(session, fingerprints=fingerprints, as_it_is=as_it_is)
        answer = self.ask(Message.HELLO, payload)
        try:
            self.info: Info = messages.read_info(answer.body)
        except struct.error:
            raise TargetError(f"{len(answer.body)} bytes answer HELLO: not as this program speaks") from None
        self._open = True

    _open = False

    def ask(self, message: Message, payload: bytes = b"", time_us: int = 0) -> Answer:
        """Send a message and wait for its answer. Raises TargetError if none comes, or the robot restarts."""
        self._sequence = (self._sequence + 1) % (1 << 16)
        data = encode(Frame(message, self._sequence, time_us, payload))
        for attempt in range(self._line.attempts):
            self.repeats += attempt > 0
            self._line.write(data)
            frame = self._answer(message)
            if frame is not None:
                return self._checked(message, frame)
            if self._noise > NOISE_MAX:
                break
        noise = f"; {self._noise} bytes came that are no message of a robot" if self._noise else ""
        raise TargetError(f"no answer to {message.name} after {attempt + 1} attempts{noise}")

    def _answer(self, message: Message) -> Frame | None:
        """The answer to the last message; None if it did not come in time. Noise is not waited for, a robot
        that speaks is, for a while.
        """
        end_s = time.monotonic() + ANSWER_TIMEOUT_S
        last_s = time.monotonic() + _PATIENCE * ANSWER_TIMEOUT_S
        while True:
            while self._frames:
                frame = self._frames.popleft()
                if frame.type == Report.READY and self._open:
                    raise _started_anew(frame)
                self._keep_report(frame)
                if frame.type == message | ANSWER and frame.sequence == self._sequence:
                    return frame
            data = self._line.read(max(end_s - time.monotonic(), 0.0))
            self._take(data)
            if self._frames:
                end_s = min(time.monotonic() + ANSWER_TIMEOUT_S, last_s)
            elif not data or time.monotonic() > end_s or self._noise > NOISE_MAX:
                return None

    def _take(self, data: bytes) -> None:
        """What came, frames or not."""
        before = len(self._frames)
        self._frames.extend(self._decoder.push(data))
        self._noise = 0 if len(self._frames) > before else self._noise + len(data)

    def listen(self, timeout_s: float | None) -> list[Frame]:
        """What the robot has reported of itself, at once or within the time-out; None: what it had reported
        before its last answer. Raises TargetError.
        """
        if not self._reports and timeout_s is not None:
            self._take(self._line.read(timeout_s))
        while self._frames and timeout_s is not None:
            frame = self._frames.popleft()
            if frame.type == Report.READY:
                raise _started_anew(frame)
            self._keep_report(frame)
        reports = list(self._reports)
        self._reports.clear()
        return reports

    def drop_reports(self) -> None:
        """Forget those that came before the last answer."""
        self._reports.clear()

    def _keep_report(self, frame: Frame) -> None:
        if frame.type in (Report.POSE, Report.SIGHTED, Report.LOOKED):
            if self._last_report is not None:
                self.reports_lost += (frame.sequence - self._last_report - 1) % (1 << 16)
            self._last_report = frame.sequence
            self._reports.append(frame)

    def _checked(self, message: Message, frame: Frame) -> Answer:
        if len(frame.payload) < 2:
            raise TargetError(f"an empty answer to {message.name}")
        answer = Answer(frame.payload[0], frame.payload[1], frame.payload[2:])
        if answer.status in LINK_STATUSES:
            name = LINK_STATUSES[answer.status]
            raise TargetError(f"{message.name} was refused: {name}{_MEANING.get(name, '')}")
        return answer

    def close(self) -> None:
        self._line.close()
