"""examples/live_robot: when it says that a picture was taken. tests/python/target has it watch a robot."""

import queue
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from examples.building import EXAMPLES


class Robot:
    """Reports once. A line comes 30 ms later, 10 ms after its picture, and is looked at after 5 ms more."""

    def __init__(self, live_robot: Any, clock: SimpleNamespace) -> None:
        self._example, self._clock, self._calls = live_robot, clock, 0
        self.told: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.stamps_us: list[int] = []

    def reports(self, _: float) -> list[Any]:
        self._calls += 1
        if self._calls == 1:
            return [SimpleNamespace(time_us=1_000_000, report=SimpleNamespace(step=Robot))]
        if self._calls == 2:
            self._clock.now_s += 0.03
            self.told.put(self._example.read_line("10 7 0 2000"))
            self._clock.now_s += 0.005
        else:
            self.told.put(None)
        return []

    pose = (0.0, 0.0, 0.0)

    def sightings(self, time_us: int, *_: object) -> None:
        self.stamps_us.append(time_us)


def test_the_age_of_a_tag_counts_from_when_its_line_came(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES / "live_robot"))
    live_robot = __import__("live_robot")
    monkeypatch.delitem(sys.modules, "live_robot")
    clock = SimpleNamespace(now_s=100.0)
    monkeypatch.setattr(live_robot, "time", SimpleNamespace(monotonic=lambda: clock.now_s), raising=False)
    robot = Robot(live_robot, clock)
    live_robot.follow(robot, robot.told)
    assert robot.stamps_us == [1_020_000]
