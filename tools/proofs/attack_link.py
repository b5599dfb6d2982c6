"""Attacks the link to a robot for as long as asked, and compares its drives with a calm host's.

One robot drives logs again and again, each in a session of its own. Frames are flipped, cut, lost and
doubled both ways; before them come noise, floods without an end, older frames of the session and frames of
other versions. Whatever comes through must be applied once: after every reading and frame the fingerprint
of all states, covariance and machines included, is the host's to the bit, and so are the counters of what
was applied. What was refused is in the robot's own counters.

    python -m tools.proofs.attack_link                       a process of this computer, ten minutes
    python -m tools.proofs.attack_link qemu:mps2_an386 --timeout 1       an emulated board, which is slow

Exit status 0: all drives are the host's, and each kind of damage was counted. 1: not so.
"""

import argparse
import random
import sys
import time
from collections import Counter
from typing import Any

from cobs import cobs

from bslam.core.slam import Slam
from bslam.link import messages
from bslam.link.frames import crc16
from bslam.link.messages import Message
from bslam.log import Log, first_steps
from bslam.options import RunOptions
from bslam.runs.runner import run_log
from bslam.target import client
from bslam.target.client import Client
from bslam.target.lines import Line, open_line
from bslam.target.remote import RemoteSlam
from bslam.world.simulate import load_scenario, simulate
from tools.proofs.same_bits import Noting, first_difference

FLOOD_BYTES = 3000
"""Longer than any frame that an image takes."""
DAMAGES = ("flip", "cut", "lose", "double", "noise", "flood", "replay", "version")
LINK_COUNTERS = ("bad_crc", "truncated", "too_long", "bad_version", "repeated", "replayed")
"""What the robot must have counted."""


def of_another_version(data: bytes, version: int) -> bytes:
    """A frame as a host of that version would send it, whole."""
    content = bytes((version,)) + cobs.decode(data[:-1])[1:-2]
    return bytes(cobs.encode(content + crc16(content).to_bytes(2, "big"))) + b"\0"


class AttackedLine:
    """A line on which each frame either way meets damage with this probability. Sessions do not close it."""

    def __init__(self, line: Line, seed: int, rate: float) -> None:
        self.random, self.rate, self.line = random.Random(seed), rate, line
        self.description, self.ns_per_instruction = line.description, line.ns_per_instruction
        self.attempts = 200
        self.done: Counter[str] = Counter()
        self.sent: list[bytes] = []
        """Frames of this session, older ones first."""

    def write(self, data: bytes) -> None:
        if len(data) > 1 and (not self.sent or self.sent[-1] != data):
            self.sent = [*self.sent[-1000:], data]
        self.line.write(self._damaged(data, DAMAGES) if len(data) > 1 else data)

    def read(self, timeout_s: float) -> bytes:
        data = self.line.read(timeout_s)
        return self._damaged(data, DAMAGES[:5]) if data else data

    def close(self) -> None:
        self.sent = []

    def _damaged(self, data: bytes, kinds: tuple[str, ...]) -> bytes:
        if self.random.random() >= self.rate:
            return data
        kind = self.random.choice(kinds)
        self.done[kind] += 1
        return self._with(kind, data)

    def _with(self, kind: str, data: bytes) -> bytes:
        at = self.random.randrange(len(data))
        match kind:
            case "flip":
                return data[:at] + bytes((data[at] ^ 1 << self.random.randrange(8),)) + data[at + 1 :]
            case "cut":
                return data[:at] + b"\0"
            case "lose":
                return b""
            case "double":
                return data + data
            case "noise":
                return self.random.randbytes(20) + b"\0" + data
            case "flood":
                return b"\xff" * self.random.randrange(1, FLOOD_BYTES) + b"\0" + data
            case "replay":
                return b"".join(self.random.choices(self.sent, k=5)) + data
            case _:
                return of_another_version(data, self.random.choice([0, 2, 255])) + data


def drive_there(log: Log, line: AttackedLine) -> tuple[Noting, dict[str, Any]]:
    """The log's drive by the robot at the other end, and the parameters with which a host does the same."""
    made: list[tuple[Noting, RemoteSlam]] = []

    def factory(params: Any, beacons: int) -> Noting:
        slam = connected(line, params, beacons)
        made.append((Noting(slam), slam))
        return made[0][0]

    run_log(log, RunOptions(), factory)
    return made[0][0], made[0][1].host_params


def drive_here(log: Log, params: dict[str, Any]) -> Noting:
    """The same by this host, which remembers no more of the way than the robot does."""
    made: list[Noting] = []

    def factory(_: Any, beacons: int) -> Noting:
        made.append(Noting(Slam(params, beacons_max=beacons)))
        return made[0]

    run_log(log, RunOptions(), factory)
    return made[0]


def connected(line: AttackedLine, params: Any, beacons: int) -> RemoteSlam:
    """A session of its own on the same robot."""
    line.sent = []
    return RemoteSlam(line, params, beacons, fingerprints=True)


def link_counters(line: Line) -> dict[str, int]:
    """What the robot says of its link, by name, over a calm line."""
    names = [*messages.LINK_COUNTERS, "repeated", "replayed"]
    values = messages.read_counters(Client(line).ask(Message.COUNTERS).body)
    return dict(zip(names, values[-len(names) :], strict=True))


def attack(options: argparse.Namespace) -> int:
    """Drives until the time is up; how many were not the host's, or None of them counted."""
    calm = open_line(options.target)
    line = AttackedLine(calm, options.seed, options.rate)
    client.ANSWER_TIMEOUT_S = options.timeout  # a lost frame costs so long
    drives = states = different = 0
    started = time.monotonic()
    try:
        while time.monotonic() - started < 60 * options.minutes:
            log = first_steps(simulate(load_scenario("paper_room"), options.seed + drives), options.steps)
            there, params = drive_there(log, line)
            here = drive_here(log, params)
            place = first_difference(here.notes, there.notes)
            wanted, found = here.counters(), there.counters()
            alike = place is None and wanted == found
            drives, states, different = drives + 1, states + len(here.notes), different + (not alike)
            others = {name: (wanted[name], found[name]) for name in wanted if wanted[name] != found[name]}
            said = "the host's" if alike else f"differs from state {place} on, counters {others}"
            print(f"drive {drives}: {said}; {line.done.total()} attacks so far", flush=True)
        client.ANSWER_TIMEOUT_S = 2.0
        counted = link_counters(calm)
    finally:
        calm.close()
    print("attacks: " + ", ".join(f"{kind} {line.done[kind]}" for kind in DAMAGES))
    print("the robot counted: " + ", ".join(f"{name} {count}" for name, count in counted.items()))
    silent = [name for name in LINK_COUNTERS if counted[name] == 0]
    minutes = (time.monotonic() - started) / 60
    never = f"; never counted: {', '.join(silent)}" if silent else ""
    print(
        f"attack on {options.target}: {minutes:.1f} minutes, {line.done.total()} attacks,"
        f" {drives - different} of {drives} drives ({states} states) the host's to the bit{never}"
    )
    return different + len(silent)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "target", nargs="?", default="process:build/host/robot", help="default: process:build/host/robot"
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="default: 10")
    parser.add_argument("--steps", type=int, default=500, help="of a drive (default: 500)")
    parser.add_argument("--rate", type=float, default=0.2, help="of frames that are attacked (default: 0.2)")
    parser.add_argument("--seed", type=int, default=0, help="of attacks and the first drive (default: 0)")
    parser.add_argument(
        "--timeout", type=float, default=0.1, help="seconds until a frame is sent again (0.1)"
    )
    return 1 if attack(parser.parse_args(argv)) > 0 else 0


if __name__ == "__main__":
    sys.exit(main())
