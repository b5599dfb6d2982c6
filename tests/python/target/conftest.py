"""For tests of robots that run in real time: what they show does not depend on how fast this computer is."""

from types import SimpleNamespace

import pytest

from bslam.commands import console
from bslam.target.remote import RemoteSlam


@pytest.fixture
def robots_clock(monkeypatch):
    """A console's seconds are those that its robot tells of."""
    clock = SimpleNamespace(now_s=0.0)
    reports = RemoteSlam.reports

    def read(slam, timeout_s):
        found = reports(slam, timeout_s)
        clock.now_s = found[-1].time_us * 1e-6 if found else clock.now_s
        return found

    monkeypatch.setattr(RemoteSlam, "reports", read)
    monkeypatch.setattr(console, "time", SimpleNamespace(monotonic=lambda: clock.now_s))
