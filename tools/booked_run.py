"""What tools that judge single associations watch a run with."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from bslam.experiment.ledger import Ledger


class BookedRun(ABC):
    """Keeps the books of a run: a `Watcher`. Who derives from it is told each frame before it is booked."""

    def __init__(self) -> None:
        self.sightings = 0
        """So far; the number of a frame's first one in the log, before it is entered."""
        self.ledger = Ledger(self.uids)
        self._slam: Any = None

    def uids(self) -> list[int]:
        """Of the beacons in the map."""
        return [] if self._slam is None else [one.uid for one in self._slam.beacons()]

    @abstractmethod
    def enter(self, time_us: int, true_id: Sequence[int], accounts: Sequence[Any]) -> None:
        """A frame. No accounts: it was refused."""

    def step(self, time_us: int, pose: tuple[float, float, float], slam: Any) -> None:
        """Keeps hold of the filter."""
        del time_us, pose
        self._slam = slam

    def frame(
        self, time_us: int, true_id: Sequence[int], columns: Sequence[Any], accounts: Sequence[Any] | None
    ) -> None:
        """Enters a frame, then books it."""
        del columns
        self.enter(time_us, true_id, accounts or ())
        self.sightings += len(true_id)
        if accounts is not None:
            self.ledger.book(true_id, [True] * len(true_id), accounts)
