"""Robots whose machines know the truth, so that a run shows what machines could bring: bound_looks.py."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.svm import LinearSVC

from bslam.core.learner import encode
from bslam.core.slam import Account, Slam
from bslam.log import Log
from measure_learner import COST

SURE = 1.2  # a decision value: looks say all that they may for a match, and more against one
NO_LOOK = -1
# A machine is trained with about so many sightings of its own look and of each other.
_OWN_MOST, _RIVAL_MOST = 60, 25
_GROWN = 1.3  # a machine is trained anew when its beacon was seen so many times as often,
_STALE_US = 20_000_000  # and after this time, for what else was seen
_SIGHTINGS_A_SAMPLE = 5  # so many sightings make a machine know as much as a sample that is kept


class SureSlam(Slam):
    """A robot whose machines are told, and sure.

    look_of: of each true identity which look it has. log: what it is going to see, with true identities.
    """

    def __init__(self, look_of: Mapping[int, int], log: Log, **options: Any) -> None:
        super().__init__(looks=True, seeds=log.seeds, **options)
        assert log.sightings.signature is not None
        self._look_of = look_of
        self._signatures = np.ascontiguousarray(log.sightings.signature, np.float32)
        self._identities: list[int] = log.sightings.beacon_id.tolist()
        self._row_of = {one.tobytes(): i for i, one in enumerate(self._signatures)}
        samples = encode(self._raw, self._signatures)
        self._row_of_sample = {self._key(samples + i): i for i in range(len(self._identities))}
        self._shown: defaultdict[int, Counter[int]] = defaultdict(Counter)
        self._looks_now: list[int] = []  # of the beacons, in the order of the map
        self._look_of_sample = self._looks_of_samples(samples)
        self._ask_machines = self._slam.learning.answers.ask
        self._attach_sure()

    def _looks_of_samples(self, samples: Any) -> dict[bytes, int]:
        """By what the core makes of a signature; NO_LOOK where two looks have the same."""
        look_of: dict[bytes, int] = {}
        for i, identity in enumerate(self._identities):
            key = self._key(samples + i)
            look = self._look_of.get(identity, NO_LOOK)
            look_of[key] = look if look_of.get(key, look) == look else NO_LOOK
        return look_of

    def _key(self, sample: Any) -> bytes:
        return bytes(self._ffi.buffer(sample, self._ffi.sizeof("bslam_sample_t")))

    def _attach_sure(self) -> None:
        """In place of what the core asks machines by."""
        ffi, learning = self._ffi, self._slam.learning
        ask_type = dict(ffi.typeof("bslam_looks_answers_t").fields)["ask"].type
        self._ask = ffi.callback(ask_type, self._answer)
        self._answers = ffi.new("bslam_looks_answers_t *", learning.answers[0])
        self._answers.ask = self._ask
        self._learning = ffi.new("bslam_learning_t *", learning[0])
        self._learning.answers = self._answers
        self._slam.learning = self._learning

    def _answer(self, looks: Any, params: Any, index: int, sample: Any) -> Any:
        """What looks say: all, where truth knows the look of both."""
        seen = self._look_of_sample.get(self._key(sample), NO_LOOK)
        mapped = self._looks_now[index]
        if NO_LOOK in (seen, mapped):
            return self._ask_machines(looks, params, index, sample)
        value = SURE if seen == mapped else -SURE
        return self._ffi.new("bslam_opinion_t *", {"value": value, "weight": 1.0})[0]

    def look_of_beacon(self, uid: int) -> int:
        """Which look a beacon of the map has, by what most of its sightings showed."""
        shown = self._shown.get(uid)
        return NO_LOOK if shown is None else self._look_of.get(shown.most_common(1)[0][0], NO_LOOK)

    def sightings(self, time_us: int, *columns: Any, **named: Any) -> list[Account]:
        """As Slam has it."""
        ekf = self._slam.ekf
        self._looks_now = [self.look_of_beacon(ekf.beacons[b].uid) for b in range(ekf.beacon_count)]
        accounts = super().sightings(time_us, *columns, **named)
        for row, account in zip(self._rows_in(columns, named), accounts, strict=True):
            if account.beacon_uid is not None and account.result in ("matched", "new"):
                self._shown[account.beacon_uid][self._identities[row]] += 1
        return accounts

    def _rows_in(self, columns: tuple[Any, ...], named: Mapping[str, Any]) -> list[int]:
        """Which sightings of the log these are, by their signatures."""
        signature = named.get("signature", columns[7] if len(columns) > 7 else None)
        if signature is None:
            return []
        return [self._row_of[one.tobytes()] for one in np.ascontiguousarray(signature, np.float32)]


@dataclass(frozen=True)
class _Machine:
    """A trained machine: its decision value is weights @ signature + bias."""

    weights: NDArray[np.float64]
    bias: float
    sightings: int  # of its beacon, by then
    time_us: int


class TaughtSlam(SureSlam):
    """A robot whose machines were taught the truth: a LinearSVC for each look, trained while it drives.

    Each has seen all sightings so far of its look and of all others, matched or not, by their true
    identities, and the seeds; it is as sure as the robot's own is with that many samples. Before its first
    training, and of what is no beacon, the robot's own are asked.
    """

    def __init__(self, look_of: Mapping[int, int], log: Log, **options: Any) -> None:
        super().__init__(look_of, log, **options)
        self._generic = log.seeds
        self._seen: defaultdict[int, list[int]] = defaultdict(list)  # rows of each look's sightings so far
        self._machines: dict[int, _Machine] = {}
        self._samples_most = len(self._slam.looks.learner.machines[0].own_alpha)

    def _answer(self, looks: Any, params: Any, index: int, sample: Any) -> Any:
        """What the beacon's machine says."""
        row = self._row_of_sample.get(self._key(sample))
        machine = self._machines.get(self._looks_now[index])
        if row is None or machine is None:
            return self._ask_machines(looks, params, index, sample)
        value = float(machine.weights @ self._signatures[row]) + machine.bias
        samples = min(machine.sightings / _SIGHTINGS_A_SAMPLE, self._samples_most)
        weight = samples / (samples + float(params.looks_samples))
        return self._ffi.new("bslam_opinion_t *", {"value": value, "weight": weight})[0]

    def sightings(self, time_us: int, *columns: Any, **named: Any) -> list[Account]:
        """As Slam has it."""
        accounts = super().sightings(time_us, *columns, **named)
        for row in self._rows_in(columns, named):
            look = self._look_of.get(self._identities[row], NO_LOOK)
            if look != NO_LOOK:
                self._seen[look].append(row)
        for look in self._seen:
            if self._wants_training(look, time_us):
                self._train(look, time_us)
        return accounts

    def _wants_training(self, look: int, time_us: int) -> bool:
        machine, sightings = self._machines.get(look), len(self._seen[look])
        if machine is None:
            return True
        has_grown = sightings > machine.sightings and sightings >= _GROWN * machine.sightings
        return has_grown or time_us - machine.time_us > _STALE_US

    def _train(self, look: int, time_us: int) -> None:
        own = _thinned(self._seen[look], _OWN_MOST)
        rivals = [_thinned(rows, _RIVAL_MOST) for other, rows in self._seen.items() if other != look]
        shown = np.concatenate([self._signatures[np.concatenate([own, *rivals])], self._generic])
        is_own = np.arange(len(shown)) < len(own)
        if is_own.all():
            return
        svc = LinearSVC(C=COST, dual=False).fit(shown, is_own)
        sightings = len(self._seen[look])
        self._machines[look] = _Machine(svc.coef_[0], float(svc.intercept_[0]), sightings, time_us)


def _thinned(rows: list[int], count: int) -> NDArray[np.int64]:
    """`count` of them or a few more, evenly over the drive; all if there are no more."""
    return np.array(rows[:: max(1, len(rows) // count)])
