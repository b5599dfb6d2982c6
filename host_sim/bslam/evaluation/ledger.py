"""Books on what became of every sighting, kept against the true identities that only the harness knows."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

import numpy as np

from bslam.evaluation.trace import SightingCounts

CLUTTER = -1  # true identity of a sighting that belongs to no beacon


class AccountLike(Protocol):
    """What the core says of one sighting."""

    @property
    def result(self) -> str:
        """ "matched", "new", "rejected" or "deferred"."""

    @property
    def reason(self) -> str:
        """Why it was rejected, or "none"."""

    @property
    def beacon_uid(self) -> int:
        """The beacon that was matched or made; never used twice in a run."""


class Ledger:
    """Counts associations. A beacon of the map has the true identity that most of its sightings had so far,
    the first of equals.

    wrong_associations  matched with a beacon of another identity; a moving thing or clutter with any
    false_new           a new beacon although one of that identity is in the map
    missed              rejected, deferred or in a refused frame, although its beacon is in the map
    deferred            left undecided, or of a beacon that is on trial
    rejected            gated out, for whatever reason but that the detector calls it a moving thing
    refused             in a frame that the core refused as a whole
    """

    def __init__(self, uids_in_map: Callable[[], Iterable[int]]) -> None:
        self._uids_in_map = uids_in_map
        self._shown: defaultdict[int, Counter[int]] = defaultdict(Counter)  # by beacon, identity: sightings
        self._counts: Counter[str] = Counter()

    def book(
        self, true_id: Sequence[int], mappable: Sequence[bool], accounts: Sequence[AccountLike]
    ) -> list[bool]:
        """Enter one frame, right after the core has worked it off; of each sighting, whether it was wrong:
        matched with another beacon, or a new one of a beacon that is in the map.
        """
        wrong = []
        made = {account.beacon_uid for account in accounts if account.result == "new"}
        unused = any(account.result in ("rejected", "deferred") for account in accounts)
        mapped = self._identities_in_map(made) if made or unused else set()
        for identity, is_mappable, account in zip(true_id, mappable, accounts, strict=True):
            before = self._counts["wrong"] + self._counts["false_new"]
            self._book_one(identity if is_mappable else CLUTTER, account, mapped)
            wrong.append(self._counts["wrong"] + self._counts["false_new"] > before)
            if account.reason == "class":
                self._counts["moving"] += 1
        return wrong

    def book_refused(self, true_id: Sequence[int], mappable: Sequence[bool]) -> None:
        """Enter a frame that the core refused as a whole."""
        mapped = self._identities_in_map(set())
        self._counts["sightings"] += len(true_id)
        self._counts["refused"] += len(true_id)
        self._counts["missed"] += sum(
            use and one in mapped for one, use in zip(true_id, mappable, strict=True)
        )

    def know(self, uid: int, identity: int) -> None:
        """A beacon that was in the map from the start."""
        self._shown[uid][identity] += 1

    def identity(self, uid: int) -> int:
        """True identity of a beacon of the map, CLUTTER if there is none."""
        return self._shown[uid].most_common(1)[0][0] if uid in self._shown else CLUTTER

    def counts(self) -> SightingCounts:
        """The sums so far."""
        counts = self._counts
        return SightingCounts(
            sightings=counts["sightings"],
            wrong_associations=counts["wrong"],
            false_new=counts["false_new"],
            missed=counts["missed"],
            deferred=counts["deferred"],
            rejected=counts["rejected"] - counts["moving"],
            refused=counts["refused"],
        )

    def _identities_in_map(self, made: set[int]) -> set[int]:
        """Identities mapped before this frame and not removed since."""
        return {self.identity(uid) for uid in self._uids_in_map() if uid not in made and uid in self._shown}

    def _book_one(self, identity: int, account: AccountLike, mapped: set[int]) -> None:
        self._counts["sightings"] += 1
        is_beacon = identity != CLUTTER
        if account.result == "matched":
            shown = self.identity(account.beacon_uid) if account.beacon_uid in self._shown else identity
            self._counts["wrong"] += not is_beacon or shown != identity  # begun while in doubt: unheard of
            self._shown[account.beacon_uid][identity] += 1
        elif account.result == "new":
            self._counts["false_new"] += is_beacon and identity in mapped
            self._shown[account.beacon_uid][identity] += 1
            mapped.add(identity)
        else:
            self._counts[account.result] += 1
            self._counts["missed"] += is_beacon and identity in mapped


def corrupt_identities(identity: np.ndarray, rate: float, seed: int) -> np.ndarray:
    """Identities with a share `rate` of them replaced by another one of those that occur; -1 stays.

    identity (m,) int64. Returns a new (m,) int64 array, the same for the same seed.
    """
    known = np.unique(identity[identity >= 0])
    if rate == 0.0 or len(known) < 2:
        return identity.copy()
    rng = np.random.default_rng(seed)
    wrong = (rng.random(len(identity)) < rate) & (identity >= 0)
    place = np.searchsorted(known, identity)
    other = (place + rng.integers(1, len(known), len(identity))) % len(known)
    return np.where(wrong, known[other], identity)
