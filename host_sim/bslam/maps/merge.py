"""Two kept maps of one place made one: which beacons are the same, by looks and geometry, then least squares.

Beacon by beacon the maps are compared in what does not come from place: labels, classes, machines. Any two
pairs that may be the same and stand as far apart in both maps give a motion from one map to the other; the
motion by which most pairs meet is taken if it is clear. Both maps, as measurements with their full
covariance, then give places, scales and motion together.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.maps.blob import CLASSES, SEED, KeptBeacon, KeptMachine, KeptMap

Floats = NDArray[np.float64]
_RECOGNISED: Final = 0.3  # mean decision value of each machine on the other's samples
_STRANGE: Final = -0.5
_GATE_D2: Final = 13.8  # one right pair in 1000 is farther apart
_EXACT_VAR: Final = 1e-8  # of what is exact, so that it has an inverse
_ENOUGH: Final = 4  # a pair counts 1, and up to 1 more or less by whether its beacons look alike
_CLEAR: Final = 1.0  # another way to fit them must count less by this
_SAME_MOVE: Final = np.array([0.5, 0.5, 0.2])  # m, m, rad
_STEPS: Final = 10
_COUNT_MAX: Final = 255
_UID_END: Final = 2**32 - 1  # the core gives no uid from here on


@dataclass(frozen=True)
class Merged:
    """The map of both in the frame of the first."""

    kept: KeptMap
    shared: tuple[tuple[int, int], ...]  # uids in the first and in the second
    move: tuple[float, float, float]  # x_m, y_m, theta_rad of the second map's origin
    move_sd: tuple[float, float, float]
    rays_left_out: int


@dataclass(frozen=True)
class _Points:
    """The beacons of a map that have a place, and how sure it is."""

    beacons: list[KeptBeacon]
    at: Floats  # (n, 2)
    covariance: Floats  # (2 n + scales, ...): all x, y, then the scales of sized ones
    scale_of: list[int]  # index of each sized beacon
    scales: Floats

    @property
    def values(self) -> Floats:
        return np.concatenate([self.at.ravel(), self.scales])

    def of(self, index: int) -> Floats:
        """(2, 2) of a place."""
        return self.covariance[2 * index : 2 * index + 2, 2 * index : 2 * index + 2]


def merge(first: KeptMap, second: KeptMap) -> Merged:
    """Both maps in one. Raises BslamError if nothing says that they are of one place, or two ways do."""
    a, b = _points(first), _points(second)
    alike = _likeness(first, second, a, b)
    pairs, move = _meet(a, b, alike)
    layout = _Layout(a, b, pairs)
    values, covariance, move, move_sd = _solve(a, b, layout, move)
    kept = _join(first, second, layout, values, covariance)
    shared = tuple((a.beacons[i].uid, b.beacons[j].uid) for i, j in pairs)
    rays = sum(one.kind == "ray" for one in (*first.beacons, *second.beacons))
    return Merged(kept, shared, (move[0], move[1], move[2]), (move_sd[0], move_sd[1], move_sd[2]), rays)


def _points(kept: KeptMap) -> _Points:
    placed = [
        (one, place) for one, place in zip(kept.beacons, kept.places(), strict=True) if one.kind != "ray"
    ]
    beacons = [one for one, _ in placed]
    sized = [index for index, one in enumerate(beacons) if one.kind == "sized"]
    at = np.array([[one.x_m, one.y_m] for one in beacons]).reshape(-1, 2)
    source = np.full(2 * len(beacons) + len(sized), -1)  # where each value stands in the map's own state
    for index, (one, place) in enumerate(placed):
        if one.kind != "known":
            at[index] = kept.values[place][:2]
            source[2 * index : 2 * index + 2] = place.start, place.start + 1
    for k, index in enumerate(sized):
        source[2 * len(beacons) + k] = placed[index][1].start + 2
    covariance = np.diag(np.full(len(source), _EXACT_VAR))
    held = np.flatnonzero(source >= 0)
    covariance[np.ix_(held, held)] += kept.covariance[np.ix_(source[held], source[held])]
    scales = np.array([kept.values[source[2 * len(beacons) + k]] for k in range(len(sized))])
    return _Points(beacons, at, covariance, sized, scales)


# ---- which are the same ------------------------------------------------------------------------------------


def _likeness(first: KeptMap, second: KeptMap, a: _Points, b: _Points) -> Floats:
    """(n, m): 1 they recognise each other, 0 nothing is known, below 0 they look different; -inf: two."""
    alike = np.zeros((len(a.beacons), len(b.beacons)))
    for (i, one), (j, other) in itertools.product(enumerate(a.beacons), enumerate(b.beacons)):
        alike[i, j] = _compare(first, second, one, other)
    # A beacon that recognises two, or is by two, tells neither of them.
    clear = (
        (alike == 1) & ((alike == 1).sum(0, keepdims=True) == 1) & ((alike == 1).sum(1, keepdims=True) == 1)
    )
    alike[(alike == 1) & ~clear] = 0
    return alike


def _compare(first: KeptMap, second: KeptMap, one: KeptBeacon, other: KeptBeacon) -> float:
    if one.label >= 0 and other.label >= 0:
        return 1.0 if one.label == other.label else -math.inf
    seen = np.array([one.seen_as, other.seen_as])
    if seen.any(axis=1).all() and not seen.all(axis=0).any():
        return -math.inf
    if one.machine is None or other.machine is None:
        return 0.0
    mine, theirs = first.machines[one.machine], second.machines[other.machine]
    if not (mine.trained and theirs.trained and len(mine.samples) and len(theirs.samples)):
        return 0.0
    values = [float(mine.values(theirs.samples).mean()), float(theirs.values(mine.samples).mean())]
    if max(values) < _STRANGE:
        return -math.inf
    return 1.0 if min(values) > _RECOGNISED else min(max(sum(values) / 2, -1.0), 0.0)


def _turned(points: Floats, move: Floats) -> Floats:
    """Points of the second map in the first."""
    return points @ _rotation(move[2]).T + move[:2]


def _rotation(angle_rad: float) -> Floats:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s], [s, c]])


def _moves(a: _Points, b: _Points, alike: Floats) -> Iterator[tuple[Floats, Floats]]:
    """Every motion by which two pairs meet, and its covariance."""
    possible = list(zip(*np.nonzero(alike > -math.inf), strict=True))
    for (i, j), (k, n) in itertools.combinations(possible, 2):
        if i == k or j == n:
            continue
        here, there = a.at[k] - a.at[i], b.at[n] - b.at[j]
        base_m = float(np.linalg.norm(here))
        variance = float(np.trace(a.of(i) + a.of(k) + b.of(j) + b.of(n)))
        if base_m < 0.3 or (base_m - float(np.linalg.norm(there))) ** 2 > _GATE_D2 * variance:
            continue
        angle = np.arctan2(here[1], here[0]) - np.arctan2(there[1], there[0])
        middle = (b.at[j] + b.at[n]) / 2
        x, y = (a.at[i] + a.at[k]) / 2 - _rotation(angle) @ middle
        spread = np.diag([variance / 4, variance / 4, variance / base_m**2])
        # The motion is sure about the middle of the two, and turns the rest.
        lever = np.eye(3)
        lever[:2, 2] = -_by_angle(middle, angle)
        yield np.array([x, y, _wrapped(angle)]), lever @ spread @ lever.T


def _by_angle(point: Floats, angle: float) -> Floats:
    return _rotation(angle + np.pi / 2) @ point


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def _pairs_at(a: _Points, b: _Points, alike: Floats, move: Floats, spread: Floats) -> list[tuple[int, int]]:
    """Pairs that meet by this motion, the nearest first, each beacon once."""
    turn, there = _rotation(move[2]), _turned(b.at, move)
    found = []
    for i, j in zip(*np.nonzero(alike > -math.inf), strict=True):
        by_move = np.column_stack([np.eye(2), _by_angle(b.at[j], move[2])])
        s = a.of(i) + turn @ b.of(j) @ turn.T + by_move @ spread @ by_move.T
        away = a.at[i] - there[j]
        d2 = float(away @ np.linalg.solve(s, away))
        if d2 <= _GATE_D2:
            found.append((d2, int(i), int(j)))
    pairs: list[tuple[int, int]] = []
    for _, i, j in sorted(found):
        if all(i != k and j != n for k, n in pairs):
            pairs.append((i, j))
    return pairs


def _meet(a: _Points, b: _Points, alike: Floats) -> tuple[list[tuple[int, int]], Floats]:
    """The pairs that are the same, and the motion. Raises BslamError."""
    tried = []
    for move, spread in _moves(a, b, alike):
        pairs = _pairs_at(a, b, alike, move, spread)
        score = sum(1.0 + float(alike[pair]) for pair in pairs)
        tried.append((score, -float(np.trace(spread)), tuple(pairs), move))
    nothing: tuple[float, float, tuple[tuple[int, int], ...], Floats] = (0, 0.0, (), np.zeros(3))
    score, _, chosen, move = max(tried, key=lambda one: one[:2], default=nothing)
    needs = "allowed: maps that share two beacons which recognise each other, or four that stand alike"
    if score < _ENOUGH:
        raise BslamError(f"the maps share too little to be laid together ({score:.1f} of {_ENOUGH}); {needs}")
    for other_score, _, other_pairs, other in tried:
        away = np.abs([*(other - move)[:2], _wrapped(float(other[2] - move[2]))])
        if other_score > score - _CLEAR and set(other_pairs) != set(chosen) and (away > _SAME_MOVE).any():
            raise BslamError(f"the maps fit together in two ways, {len(chosen)} beacons in each; {needs}")
    return list(chosen), move


# ---- places ------------------------------------------------------------------------------------------------


class _Layout:
    """Where everything stands in the map of both: the first map's beacons, then the second's own.

    Its values: x, y of each, then the scales of the sized ones.
    """

    def __init__(self, a: _Points, b: _Points, pairs: list[tuple[int, int]]) -> None:
        self.a, self.b, self.pairs = a, b, pairs
        there = {j: i for i, j in pairs}
        self.only = [j for j in range(len(b.beacons)) if j not in there]
        self.slot = there | {j: len(a.beacons) + k for k, j in enumerate(self.only)}
        self.count = len(a.beacons) + len(self.only)
        indices = dict.fromkeys([*a.scale_of, *(self.slot[j] for j in b.scale_of)])
        self.scale_at = {index: 2 * self.count + k for k, index in enumerate(indices)}
        self.size = 2 * self.count + len(self.scale_at)

    def start(self, move: Floats) -> Floats:
        """Values before the first step, the motion behind them."""
        x = np.zeros(self.size + 3)
        x[: 2 * self.count] = np.concatenate([self.a.at, _turned(self.b.at[self.only], move)]).ravel()
        for j, scale in zip(self.b.scale_of, self.b.scales, strict=True):
            x[self.scale_at[self.slot[j]]] = scale
        for index, scale in zip(self.a.scale_of, self.a.scales, strict=True):
            x[self.scale_at[index]] = scale
        x[self.size :] = move
        return x

    def of_first(self) -> Floats:
        """The first map's values by those of both, a selection."""
        by = np.zeros((len(self.a.values), self.size + 3))
        places = 2 * len(self.a.beacons)
        by[:places, :places] = np.eye(places)
        for k, index in enumerate(self.a.scale_of):
            by[places + k, self.scale_at[index]] = 1
        return by

    def of_second(self, x: Floats) -> tuple[Floats, Floats]:
        """The second map's values as those of both would have them, and their derivatives."""
        b, origin = self.b, slice(self.size, self.size + 2)
        by, seen = np.zeros((len(b.values), self.size + 3)), np.empty(len(b.values))
        back = _rotation(-x[self.size + 2])
        for j in range(len(b.beacons)):
            place, rows = slice(2 * self.slot[j], 2 * self.slot[j] + 2), slice(2 * j, 2 * j + 2)
            away = x[place] - x[origin]
            seen[rows] = back @ away
            by[rows, place] = back
            by[rows, origin] = -back
            by[rows, self.size + 2] = -_by_angle(away, -x[self.size + 2])
        for k, j in enumerate(b.scale_of):
            row, column = 2 * len(b.beacons) + k, self.scale_at[self.slot[j]]
            seen[row], by[row, column] = x[column], 1
        return seen, by


def _solve(a: _Points, b: _Points, layout: _Layout, move: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Gauss-Newton over all values and the motion; both maps are measurements of them.

    Gives values, their covariance, the motion and its standard deviations.
    """
    x, by_a = layout.start(move), layout.of_first()
    weight_a, weight_b = np.linalg.inv(a.covariance), np.linalg.inv(b.covariance)
    for _ in range(_STEPS):
        seen_b, by_b = layout.of_second(x)
        normal = by_a.T @ weight_a @ by_a + by_b.T @ weight_b @ by_b
        right = by_a.T @ weight_a @ (a.values - by_a @ x) + by_b.T @ weight_b @ (b.values - seen_b)
        x = x + np.linalg.solve(normal, right)
    root = np.linalg.inv(np.linalg.cholesky(normal))
    covariance: Floats = root.T @ root
    end = layout.size
    x[end + 2] = _wrapped(float(x[end + 2]))
    return x[:end], covariance[:end, :end], x[end:], np.sqrt(np.diag(covariance)[end:])


# ---- the map of both ---------------------------------------------------------------------------------------


def _join(first: KeptMap, second: KeptMap, layout: _Layout, values: Floats, covariance: Floats) -> KeptMap:
    machines, number = _machines(first, second, layout)
    free_uid = max(first.next_uid, second.next_uid)
    if free_uid + len(layout.only) > _UID_END:
        raise BslamError(f"{len(layout.only)} uids from {free_uid} on; allowed are those below {_UID_END}")
    source: list[int] = []
    beacons = []
    for index, one in enumerate(_beacons(free_uid, layout, number)):
        x_m, y_m = values[2 * index : 2 * index + 2].tolist()
        kind = "sized" if index in layout.scale_at and one.kind != "known" else one.kind
        if kind != "known":
            source += [2 * index, 2 * index + 1]
        scale = one.scale
        if kind == "sized":
            source.append(layout.scale_at[index])
            scale = max(float(values[source[-1]]), 0.0)
        beacons.append(replace(one, x_m=x_m, y_m=y_m, kind=kind, scale=scale))
    return KeptMap(
        tuple(beacons),
        values[source],
        covariance[np.ix_(source, source)],
        free_uid + len(layout.only),
        machines,
    )


def _beacons(free_uid: int, layout: _Layout, number: dict[int, int]) -> list[KeptBeacon]:
    """All beacons as their maps have them, renamed; uids from `free_uid` on neither map has given."""
    partner = {i: layout.b.beacons[j] for i, j in layout.pairs}
    beacons = [_united(one, partner.get(i), number) for i, one in enumerate(layout.a.beacons)]
    for k, j in enumerate(layout.only):
        new = layout.b.beacons[j]
        machine = None if new.machine is None else number[new.machine]
        kind = "point" if new.kind == "known" else new.kind  # it is as sure as the motion is
        beacons.append(replace(new, uid=free_uid + k, machine=machine, kind=kind))
    return beacons


def _machines(
    first: KeptMap, second: KeptMap, layout: _Layout
) -> tuple[tuple[KeptMachine, ...], dict[int, int]]:
    """The first map's machines, and those of the second whose beacons have none else; their new numbers."""
    a, b = layout.a.beacons, layout.b.beacons
    needing = [*layout.only] + [j for i, j in layout.pairs if a[i].machine is None]
    wanted = sorted({one for j in needing if (one := b[j].machine) is not None})
    number = {old: len(first.machines) + k for k, old in enumerate(wanted)}
    return (*first.machines, *(_renamed(second.machines[old], number) for old in wanted)), number


def _united(one: KeptBeacon, other: KeptBeacon | None, number: dict[int, int]) -> KeptBeacon:
    """What both maps have of a beacon."""
    if other is None:
        return one
    machine = one.machine
    if machine is None and other.machine is not None:
        machine = number[other.machine]
    seen = np.array(one.seen_as) + np.array(other.seen_as)
    while seen.max() > _COUNT_MAX:
        seen //= 2
    return replace(
        one,
        label=one.label if one.label >= 0 else other.label,
        beacon_class=one.beacon_class or other.beacon_class,
        machine=machine,
        sightings=one.sightings + other.sightings,
        scale=one.scale or other.scale,
        seen_as=tuple(int(seen[k]) for k in range(CLASSES)),
    )


def _renamed(machine: KeptMachine, number: dict[int, int]) -> KeptMachine:
    """The second map's machine among all; rivals whose machine is not taken over are left out."""
    rivals = tuple(
        (owner if owner == SEED else number[owner], place, alpha)
        for owner, place, alpha in machine.rivals
        if owner == SEED or owner in number
    )
    return replace(machine, rivals=rivals)
