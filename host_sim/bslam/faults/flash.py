"""A flash whose power may fail."""

from __future__ import annotations

from collections.abc import Callable

from bslam.core.errors import CoreError
from bslam.core.slam import Slam


class Flash:
    """Two slots of flash in memory. `left`: bytes that are erased or written before the power fails."""

    def __init__(self, slot_bytes: int = 4096) -> None:
        self.slot_bytes = slot_bytes
        self.slots = [bytearray(b"\xff" * slot_bytes) for _ in range(2)]
        self.left = 1 << 30
        self.used = 0

    def save(self, slam: Slam) -> bool:
        """Saves the map; False if the flash failed."""
        return _is_done(slam.save_to_flash, self)

    def load(self, slam: Slam) -> bool:
        """Loads the newest whole map; False if there is none."""
        return _is_done(slam.load_from_flash, self)

    def _spend(self, count: int) -> int:
        spent = min(count, self.left)
        self.left -= spent
        self.used += spent
        return spent

    def erase(self, slot: int) -> bool:
        """As `core.raw.Flash`."""
        area = self.slots[slot]
        spent = self._spend(len(area))
        area[:spent] = b"\xff" * spent
        return spent == len(area)

    def write(self, slot: int, at: int, data: bytes) -> bool:
        """As `core.raw.Flash`."""
        spent = self._spend(len(data))
        self.slots[slot][at : at + spent] = data[:spent]
        return spent == len(data)

    def read(self, slot: int, at: int, size: int) -> bytes:
        """As `core.raw.Flash`."""
        return bytes(self.slots[slot][at : at + size])


def _is_done(call: Callable[[Flash], None], flash: Flash) -> bool:
    try:
        call(flash)
    except CoreError:
        return False
    return True
