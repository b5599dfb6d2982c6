"""Where a robot keeps its map, and what watches over its memory: flash and guard, as the faults need them."""

from __future__ import annotations

from typing import Any

from bslam.core.slam import Slam


class Flash:
    """Two slots of flash in memory. `left`: bytes that are erased or written before the power fails."""

    def __init__(self, slam: Slam, slot_bytes: int = 4096) -> None:
        self._raw, ffi = slam._raw, slam._ffi
        self.slots = [bytearray(b"\xff" * slot_bytes) for _ in range(2)]
        self.left = 1 << 30
        self.used = 0
        self._keep = (
            ffi.callback("bool(void *, int)", self._erase),
            ffi.callback("bool(void *, int, uint32_t, const void *, uint32_t)", self._write),
            ffi.callback("bool(void *, int, uint32_t, void *, uint32_t)", self._read),
        )
        self._flash = ffi.new("bslam_flash_t *", (*self._keep, ffi.NULL, slot_bytes))
        self._fault = ffi.new("bslam_map_fault_t *")

    def save(self, slam: Slam) -> bool:
        """Saves the map; False if the flash failed."""
        return bool(slam._lib.bslam_slots_save(self._flash, slam._slam, self._fault) == 0)

    def load(self, slam: Slam) -> bool:
        """Loads the newest whole map; False if there is none."""
        mode = slam._lib.BSLAM_MAP_LIVING
        return bool(slam._lib.bslam_slots_load(self._flash, slam._slam, mode, self._fault) == 0)

    def _spend(self, count: int) -> int:
        spent = min(count, self.left)
        self.left -= spent
        self.used += spent
        return spent

    def _erase(self, _: Any, slot: int) -> bool:
        area = self.slots[slot]
        spent = self._spend(len(area))
        area[:spent] = b"\xff" * spent
        return spent == len(area)

    def _write(self, _: Any, slot: int, at: int, data: Any, count: int) -> bool:
        spent = self._spend(count)
        self.slots[slot][at : at + spent] = bytes(self._raw.ffi.buffer(data, count))[:spent]
        return spent == count

    def _read(self, _: Any, slot: int, at: int, data: Any, count: int) -> bool:
        self._raw.ffi.buffer(data, count)[:] = bytes(self.slots[slot][at : at + count])
        return True


class Guard:
    """Watches over the memory of one pipeline, and keeps a copy to fall back to."""

    def __init__(self, slam: Slam) -> None:
        self._slam, self._lib, ffi = slam, slam._lib, slam._ffi
        self._copy = ffi.new("bslam_slam_t *")
        self._guard = ffi.new("bslam_guard_t *")
        self._lib.bslam_guard_init(self._guard, self._copy)

    def seal(self) -> None:
        """The state is good as it is now."""
        self._lib.bslam_guard_seal(self._guard, self._slam._slam)

    def is_good(self) -> bool:
        """The state is as it was sealed."""
        return bool(self._lib.bslam_guard_check(self._guard, self._slam._slam) == 0)

    def restore(self) -> bool:
        """Puts the copy in its place; False if that is not good either."""
        return bool(self._lib.bslam_guard_restore(self._guard, self._slam._slam) == 0)


def memory_of(slam: Slam) -> memoryview:
    """The bytes of the C instance, to be damaged."""
    return memoryview(slam._ffi.buffer(slam._slam)).cast("B")


def offset_of(slam: Slam, *path: str) -> int:
    """Where a member stands in them: offset_of(slam, "ekf", "mean")."""
    return int(slam._ffi.offsetof("bslam_slam_t", *path))


def force_motion(slam: Slam, dt_s: float, forward_m: float) -> None:
    """A motion straight into the filter, past every check."""
    ffi = slam._ffi
    motion = ffi.new("bslam_motion_t *", (dt_s, forward_m, 0.0, 1e-4, 1e-4, 0.0))
    moved = ffi.new("bslam_motion_t *")
    slam._lib.bslam_ekf_predict(
        ffi.addressof(slam._slam, "ekf"), ffi.addressof(slam._slam, "params"), motion, moved
    )


def force_beacon(slam: Slam, bearing_rad: float, range_m: float) -> None:
    """A new beacon straight into the filter, past every check."""
    ffi = slam._ffi
    sighting = ffi.new(
        "bslam_sighting_t *", {"bearing_rad": bearing_rad, "range_m": range_m, "has_range": True}
    )
    mount, index = ffi.new("bslam_pose_t *"), ffi.new("int *")
    slam._lib.bslam_ekf_add(
        ffi.addressof(slam._slam, "ekf"), ffi.addressof(slam._slam, "params"), mount, sighting, index
    )
