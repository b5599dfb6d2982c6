"""How simulated sightings look: a signature each, as if a camera had seen the beacon.

Every beacon has a look: a few colours, the shape of its outline, contrasts. A sighting is that look from the
side it is seen from (slant and distance shift the shares of the colours, and shift them alike from places
that are near each other), with some wall taken in, and noise of its own. No two sightings look the same.
How strongly, is set so that machines tell beacons apart as well as they do the camera's own signatures.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bslam.log import SIGNATURE_SIZE
from bslam.world.arena import Arena

_BINS_A_SIDE = 4
_COLOURS = (2, 6)  # of a look
_COLOUR_WIDTH = 0.30  # of a colour's blot among the bins, in bins
_WALL_COLOUR = 2.2  # where the wall's own colour is on each axis, in bins: brighter than the middle
_NEAR_WALL = 0.35  # how near a look's colours keep to it: 0 anywhere, 1 all are the wall's
_GENERIC_LOOKS, _GENERIC_STREAM = 64, 710064
_KINDS = 7  # of beacons
_KIND_COLOUR_SD = 0.2  # by which beacons of a kind differ in each colour, in bins
_KIND_SHARE_SD = 0.3  # in the logarithm of its share
_KIND_SHAPE_SD = 0.03  # in outline and contrasts
_PART_SHARE = 0.06  # of sightings that show a part, or much else
_HISTOGRAM_SCALE = 1.4
_WAVES = 4  # of which a slow change with the side is made
_WAVE_TURNS = 2.0  # so often a change comes and goes over the half circle, and from near to far
_CHANGE_SD = 1.0  # of the logarithm of a colour's share, with the side
_SHAPE_SD = 0.10  # of the outline and the contrasts, with the side
_OWN_SD = 0.3  # of the logarithm of a colour's share, in each sighting
_VALUE_SD = 0.02  # of each value
_WALL_SHARE = 0.12  # of a box, in the mean

Floats = NDArray[np.float64]


class Looks:
    """The looks of an arena's beacons; `random` draws them."""

    def __init__(self, arena: Arena, random: np.random.Generator) -> None:
        kinds = [_Kind(random) for _ in range(_KINDS)]
        drawn = {one.beacon_id: _Look(kinds[random.integers(_KINDS)], random) for one in arena.beacons}
        whose = [one.beacon_id if one.looks_like is None else one.looks_like for one in arena.beacons]
        self._looks = [drawn[beacon_id] for beacon_id in whose]

    def see(
        self, beacon: NDArray[np.int64], side_rad: Floats, range_m: Floats, random: np.random.Generator
    ) -> NDArray[np.float32]:
        """Signatures (m, 71) of sightings (m,): which beacon, by its place in the arena, and from where."""
        seen = np.empty((len(beacon), SIGNATURE_SIZE))
        for place in np.unique(beacon):
            rows = beacon == place
            seen[rows] = self._looks[place].seen(side_rad[rows], range_m[rows], random)
        return seen.astype(np.float32)


def generic_looks() -> NDArray[np.float32]:
    """Signatures (64, 71) of things that are in no arena: what a machine is told at first not to take.

    The same for every seed, as what stands in a robot's flash is.
    """
    random = np.random.default_rng(_GENERIC_STREAM)
    one_each = [_Look(_Kind(random), random) for _ in range(_GENERIC_LOOKS)]
    side_rad, range_m = (
        random.uniform(-np.pi, np.pi, (_GENERIC_LOOKS, 1)),
        random.uniform(1.0, 6.0, (_GENERIC_LOOKS, 1)),
    )
    seen = [look.seen(side_rad[i], range_m[i], random)[0] for i, look in enumerate(one_each)]
    return np.array(seen, dtype=np.float32)


class _Kind:
    """What beacons of a kind have in common: doors are much like doors."""

    def __init__(self, random: np.random.Generator) -> None:
        count = int(random.integers(*_COLOURS, endpoint=True))
        anywhere = random.uniform(-0.5, _BINS_A_SIDE - 0.5, (count, 3))
        self.colours = anywhere + _NEAR_WALL * (_WALL_COLOUR - anywhere)
        self.log_share = np.log(random.dirichlet(np.full(count, 1.5)) + 0.02)
        self.shape = np.array([random.normal(0.0, 0.4), *random.uniform(0.05, 0.7, 6)])


class _Look:
    """One look, and how it changes with the side."""

    def __init__(self, kind: _Kind, random: np.random.Generator) -> None:
        self._blots = np.stack(
            [_blot(one + _KIND_COLOUR_SD * random.standard_normal(3)) for one in kind.colours]
        )
        self._wall = _blot(np.full(3, _WALL_COLOUR))
        self._log_share = random.normal(kind.log_share, _KIND_SHARE_SD)
        self._shape = random.normal(kind.shape, _KIND_SHAPE_SD)
        self._changes = [_Change(random) for _ in range(len(self._log_share) + len(self._shape))]

    def seen(self, side_rad: Floats, range_m: Floats, random: np.random.Generator) -> Floats:
        """Signatures (m, 71) of sightings from these sides and distances (m,)."""
        sights, colours = len(side_rad), len(self._log_share)
        change = np.stack([one.at(side_rad, range_m) for one in self._changes], axis=1)
        own = random.standard_normal((sights, colours))
        share = np.exp(self._log_share + _CHANGE_SD * change[:, :colours] + _OWN_SD * own)
        share /= share.sum(axis=1, keepdims=True)
        wall = _WALL_SHARE * random.exponential(1.0, (sights, 1))
        is_part = random.random((sights, 1)) < _PART_SHARE
        wall += np.where(is_part, random.uniform(0.0, 3.0, (sights, 1)), 0.0)
        histogram = share @ self._blots + wall * self._wall
        histogram /= histogram.sum(axis=1, keepdims=True)
        shape = self._shape + _SHAPE_SD * change[:, colours:]
        shape[:, 0] += np.where(is_part, random.normal(0.0, 0.4, (sights, 1)), 0.0)[:, 0]
        values = np.concatenate([_HISTOGRAM_SCALE * np.sqrt(histogram), shape], axis=1)
        values += _VALUE_SD * random.standard_normal(values.shape)
        low = np.zeros(SIGNATURE_SIZE)
        low[_BINS_A_SIDE**3] = -1.0  # the outline's
        return np.clip(values, low, 1.0)


class _Change:
    """A smooth random function of side and distance, of unit variance."""

    def __init__(self, random: np.random.Generator) -> None:
        self._turns = random.normal(0.0, _WAVE_TURNS, (_WAVES, 2))
        self._phase_rad = random.uniform(0.0, 2.0 * np.pi, _WAVES)

    def at(self, side_rad: Floats, range_m: Floats) -> Floats:
        """Its values (m,)."""
        place = np.stack([side_rad, np.log(np.maximum(range_m, 0.1))])
        waves = np.cos(self._turns @ place + self._phase_rad[:, np.newaxis])
        values: Floats = np.sqrt(2.0 / _WAVES) * waves.sum(axis=0)
        return values


def _blot(colour: Floats) -> Floats:
    """Shares (64,) of the bins that a colour (3,), in bins, falls into."""
    axis = np.arange(_BINS_A_SIDE)
    near = np.exp(-0.5 * ((axis - colour[:, np.newaxis]) / (_COLOUR_WIDTH + 0.2)) ** 2)
    near /= near.sum(axis=1, keepdims=True)
    blot: Floats = np.einsum("i,j,k->ijk", *near).ravel()
    return blot
