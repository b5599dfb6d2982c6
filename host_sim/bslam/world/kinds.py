"""The kinds of beacons and their real sizes. Lengths in metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Kind:
    """Heights are known whole, widths vary where a range is given, and so do depths and mounting."""

    height_m: float
    width_m: tuple[float, float]
    bottom_m: tuple[float, float]
    depth_m: tuple[float, float]

    def shallow(self, depth_m: float) -> Kind:
        """The same, standing out from the wall no farther than so."""
        low, high = self.depth_m
        return Kind(self.height_m, self.width_m, self.bottom_m, (min(low, depth_m), min(high, depth_m)))


KINDS: dict[str, Kind] = {
    "extinguisher": Kind(0.60, (0.18, 0.18), (0.5, 1.0), (0.11, 0.14)),
    "radiator": Kind(0.60, (0.8, 1.4), (0.1, 0.1), (0.08, 0.16)),
    "door": Kind(2.00, (0.9, 0.9), (0.0, 0.0), (0.02, 0.05)),
    "window": Kind(1.20, (0.9, 1.6), (0.9, 0.9), (0.02, 0.06)),
    "poster": Kind(0.84, (0.59, 0.59), (1.08, 1.08), (0.01, 0.02)),
    "sign": Kind(0.30, (0.30, 0.30), (1.45, 2.05), (0.01, 0.02)),
    "cabinet": Kind(1.80, (0.8, 1.0), (0.0, 0.0), (0.30, 0.45)),
}
"""By name: the classes that a detector learns. A poster's middle hangs at 1.5 m, a sign's at 1.6 to 2.2."""

ROUND = frozenset({"extinguisher"})
"""As wide from every side: they are drawn turned to the eye."""


class KindDeck:
    """Draws kinds so that all that fit come before any comes again."""

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random
        self._drawn = dict.fromkeys(KINDS, 0)

    def draw(self, free_m: float) -> str | None:
        """Of the kinds that can be as narrow as free_m one of those drawn least; None if none fits."""
        fitting = [name for name, kind in KINDS.items() if kind.width_m[0] <= free_m]
        if not fitting:
            return None
        least = min(self._drawn[name] for name in fitting)
        rare = [name for name in fitting if self._drawn[name] == least]
        name = rare[int(self._random.integers(len(rare)))]
        self._drawn[name] += 1
        return name
