"""A kept map as the C library writes it, byte by byte (docs/MAP.md), without that library."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError

SUFFIX: Final = ".bslam"
VERSION: Final = 3
KINDS: Final = ("point", "ray", "known", "sized")
VALUES_OF: Final = {"point": 2, "ray": 4, "known": 0, "sized": 3}
FEATURES: Final = 71
CLASSES: Final = 8
SEED: Final = 255
_NO_MACHINE: Final = 0xFFFF
_HEADER: Final = struct.Struct("<4sHHIHHHHIHH")
_BEACON: Final = struct.Struct("<IiBBHIfff8BH")
_MACHINE: Final = struct.Struct("<BBHf")
_MAGIC: Final = b"BSLM"
_ORDER: Final = 0x0102
_ROUNDING: Final = 1e-13
"""Of a variance: what a sum of products in double may be off by."""


@dataclass(frozen=True)
class KeptBeacon:
    """A beacon of a kept map. Its position is for whoever reads the map; of a known one it is the place."""

    uid: int
    label: int  # -1: none
    kind: str
    beacon_class: int  # 0: none
    machine: int | None  # which machine tells it from the others
    sightings: int
    scale: float  # its distances come out too long by this factor; 0: nobody knows
    x_m: float
    y_m: float
    seen_as: tuple[int, ...] = (0,) * CLASSES  # how often as class 1, 2, ...


@dataclass(frozen=True)
class KeptMachine:
    """What tells a beacon by its looks. Decision value of features f: unit sum(weights [127 f, 127])."""

    trained: bool
    unit: float
    weights: NDArray[np.int16]  # (72,)
    samples: NDArray[np.int8]  # (k, 71): 127 times the features
    own_alpha: NDArray[np.uint16]  # (k,)
    rivals: tuple[tuple[int, int, int], ...]  # machine (255: seed), sample, dual variable

    def values(self, samples: NDArray[np.int8]) -> NDArray[np.float64]:
        """(n,) decision values of (n, 71) samples."""
        weights = self.weights.astype(np.float64)
        return float(self.unit) * (
            samples.astype(np.float64) @ weights[:FEATURES] + 127.0 * weights[FEATURES]
        )


@dataclass(frozen=True)
class KeptMap:
    """A kept map. Covariance: of the state values, in their order. It must be positive semidefinite."""

    beacons: tuple[KeptBeacon, ...]
    values: NDArray[
        np.float64
    ]  # (n,) by beacon: x, y of a point, and the scale of a sized one; four of a ray
    covariance: NDArray[np.float64]  # (n, n)
    next_uid: int
    machines: tuple[KeptMachine, ...] = field(default=())

    def places(self) -> list[slice]:
        """The state values of each beacon."""
        ends = np.cumsum([VALUES_OF[one.kind] for one in self.beacons], dtype=int).tolist()
        starts = [0, *ends[:-1]]
        return [slice(start, end) for start, end in zip(starts, ends, strict=True)]


def parse(blob: bytes) -> KeptMap:
    """What the bytes say. Raises BslamError for what is no whole map of this version.

    The C library looks closer (`Slam.map_fault`): ask it first whether the bytes are sound.
    """
    try:
        return _parse(blob)
    except (struct.error, ValueError, IndexError) as error:
        raise BslamError(f"map of {len(blob)} bytes: {error}; allowed: a map as `bslam run` saves") from error


def _parse(blob: bytes) -> KeptMap:
    magic, order, version, length, count, values, machines, features, next_uid, columns, _ = (
        _HEADER.unpack_from(blob)
    )
    if (magic, order, version) != (_MAGIC, _ORDER, VERSION):
        raise ValueError("no map, or of another version")
    if (
        length != len(blob)
        or features != FEATURES
        or zlib.crc32(blob[:-4]) != struct.unpack("<I", blob[-4:])[0]
    ):
        raise ValueError("damaged")
    at = _HEADER.size
    beacons = []
    own: list[int] = []  # the columns of the state values, by beacon
    for _ in range(count):
        uid, label, kind, one_class, machine, sightings, scale, x_m, y_m, *seen_as, column = (
            _BEACON.unpack_from(blob, at)
        )
        at += _BEACON.size
        owner = None if machine == _NO_MACHINE else machine
        beacons.append(
            KeptBeacon(uid, label, KINDS[kind], one_class, owner, sightings, scale, x_m, y_m, tuple(seen_as))
        )
        own += range(column, column + VALUES_OF[KINDS[kind]])
    if len(own) != values or len(set(own)) != values or max(own, default=-1) >= columns:
        raise ValueError("columns of two beacons, or of none")
    mean, covariance, at = _parse_values(blob, at, own, columns)
    kept = []
    for _ in range(machines):
        machine_read, at = _parse_machine(blob, at)
        kept.append(machine_read)
    return KeptMap(tuple(beacons), mean, covariance, next_uid, tuple(kept))


def _parse_values(
    blob: bytes, at: int, own: list[int], columns: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Means and covariance of the state values that have these columns, and where the blob goes on."""
    mean, rows = np.zeros(columns), np.eye(columns)
    saved = sorted(own)
    mean[saved] = np.frombuffer(blob, "<f4", len(saved), at)
    at += 4 * len(saved)
    variance = np.frombuffer(blob, "<f4", columns, at).astype(np.float64)
    at += 4 * columns
    for column in saved:
        rows[column, :column] = np.frombuffer(blob, "<f4", column, at)
        at += 4 * column
    return mean[own], (rows[own] * variance) @ rows[own].T, at


def _parse_machine(blob: bytes, at: int) -> tuple[KeptMachine, int]:
    count, trained, rival_count, unit = _MACHINE.unpack_from(blob, at)
    at += _MACHINE.size
    weights = np.frombuffer(blob, "<i2", FEATURES + 1, at)
    at += 2 * len(weights)
    samples, alphas = np.empty((count, FEATURES), np.int8), np.empty(count, np.uint16)
    for k in range(count):
        samples[k] = np.frombuffer(blob, np.int8, FEATURES, at)
        (alphas[k],) = struct.unpack_from("<H", blob, at + FEATURES)
        at += FEATURES + 2
    rivals = []
    for _ in range(rival_count):
        sample, owner, alpha = struct.unpack_from("<BBH", blob, at)
        rivals.append((owner, sample, alpha))
        at += 4
    return KeptMachine(bool(trained), unit, weights.copy(), samples, alphas, tuple(rivals)), at


def pack(kept: KeptMap) -> bytes:
    """The bytes of a map. Raises BslamError for a covariance that is none."""
    body = bytearray()
    column = 0
    for one in kept.beacons:
        owner = _NO_MACHINE if one.machine is None else one.machine
        kind = KINDS.index(one.kind)
        words = (one.uid, one.label, kind, one.beacon_class, owner, one.sightings)
        body += _BEACON.pack(*words, one.scale, one.x_m, one.y_m, *one.seen_as, column)
        column += VALUES_OF[one.kind]
    rows, variance = _factor(kept.covariance)
    for numbers in (kept.values, variance, rows[np.tril_indices(column, -1)]):
        body += numbers.astype("<f4").tobytes()
    for machine in kept.machines:
        body += _pack_machine(machine)
    counts = (len(kept.beacons), len(kept.values), len(kept.machines), FEATURES)
    length = _HEADER.size + len(body) + 4
    whole = _HEADER.pack(_MAGIC, _ORDER, VERSION, length, *counts, kept.next_uid, column, 0) + bytes(body)
    return whole + struct.pack("<I", zlib.crc32(whole))


def _factor(covariance: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """L and D of L D Lᵀ. Raises BslamError where a value has less variance than it shares with others."""
    own = np.diag(covariance)
    rows, variance, rest = np.eye(len(own)), np.zeros(len(own)), covariance.copy()
    for k, rounding in enumerate(_ROUNDING * own):
        left = rest[k:, k].copy()
        fits = left[0] >= -rounding
        if left[0] > rounding:
            variance[k], rows[k:, k] = left[0], left / left[0]
            rest[k:, k:] -= np.outer(left, rows[k:, k])
        else:
            fits &= (left[1:] ** 2 <= rounding * own[k + 1 :]).all()
        if not fits:
            raise BslamError(
                f"covariance: value {k} is left {left[0]:.1e} of its variance; allowed: 0 or more"
            )
    return rows, variance


def _pack_machine(machine: KeptMachine) -> bytes:
    count, rivals = len(machine.samples), machine.rivals
    body = bytearray(_MACHINE.pack(count, int(machine.trained), len(rivals), machine.unit))
    body += machine.weights.astype("<i2").tobytes()
    for sample, alpha in zip(machine.samples, machine.own_alpha.tolist(), strict=True):
        body += sample.astype(np.int8).tobytes() + struct.pack("<H", alpha)
    for owner, place, alpha in rivals:
        body += struct.pack("<BBH", place, owner, alpha)
    return bytes(body)


def from_lower(lower: NDArray[np.floating], size: int) -> NDArray[np.float64]:
    """(n, n) of the lower triangle, row by row."""
    full = np.zeros((size, size))
    full[np.tril_indices(size)] = lower
    return full + np.tril(full, -1).T
