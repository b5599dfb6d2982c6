"""More beacons than a build of the core holds: those near the robot are in the filter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bslam.core.slam import Account, Beacon, Slam


class LocalMap:
    """The core with a map that rolls along: the beacon not seen for longest makes room for a new one.

    What left the filter stays in the final map where it was last, without any further correction, and is a
    new beacon when it is seen again: so a loop that is wider than the filter's map is not closed. All else
    is the core's.
    """

    def __init__(self, slam: Slam, room: int) -> None:
        self._slam = slam
        self._room = room
        self._left: dict[int, Beacon] = {}  # by uid
        self._removed = 0
        self._last_seen: dict[int, int] = {}
        self._frame = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._slam, name)

    def sightings(self, time_us: int, bearing_rad: Sequence[float], *more: Any) -> list[Account]:
        """As the core's; before it, room is made for every sighting of the frame."""
        self._make_room(len(bearing_rad))
        accounts = self._slam.sightings(time_us, bearing_rad, *more)
        self._frame += 1
        for account in accounts:
            if account.beacon_uid is not None:
                self._last_seen[account.beacon_uid] = self._frame
        return accounts

    def _make_room(self, needed: int) -> None:
        beacons = self._slam.beacons()
        surplus = len(beacons) + needed - self._room
        oldest = sorted(beacons, key=lambda one: self._last_seen.get(one.uid, 0))
        for one in oldest[: max(surplus, 0)]:
            if one.confirmed:
                self._left[one.uid] = one
            self._slam.remove_beacon(one.uid)
            self._removed += 1

    def counters(self) -> dict[str, int]:
        """As the core's; the map was full for each beacon that had to leave, too."""
        counts = dict(self._slam.counters())
        return counts | {"map_full": counts["map_full"] + self._removed}

    def beacons(self) -> list[Beacon]:
        """The filter's beacons, and those that left it and are not in it again by their label."""
        inside = self._slam.beacons()
        labels = {one.label for one in inside if one.label >= 0}
        newest = {one.label if one.label >= 0 else -1 - one.uid: one for one in self._left.values()}
        return [*(one for key, one in newest.items() if key not in labels), *inside]
