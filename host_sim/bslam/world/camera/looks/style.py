"""What sets training and test worlds apart: palettes, patterns, layouts; and the artist who draws from them.

Their random streams never meet, so no texture of a training world comes back in a test. Hues and woods are
lists of their own, and so are most layouts, but not all: plain walls, brick, ribbed radiators and others are
in both, as are the standard colours of signs, and an extinguisher is drawn the same way. Both are ordinary
offices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bslam.errors import BslamError
from bslam.world.camera.looks.canvas import Colour, hsv, mix, tint

T = TypeVar("T")


@dataclass(frozen=True)
class Style:
    """Hues in turns, colours as in `canvas`; names of layouts are keys of the painters' tables."""

    name: str
    stream: int  # of random numbers
    wall_hues: tuple[float, ...]
    wall_values: tuple[float, float]
    wall_patterns: tuple[str, ...]
    floor_patterns: tuple[str, ...]
    accent_hues: tuple[float, ...]  # of everything painted or printed
    woods: tuple[Colour, ...]
    posters: tuple[str, ...]
    doors: tuple[str, ...]
    cabinets: tuple[str, ...]
    signs: tuple[str, ...]
    radiators: tuple[str, ...]
    views: tuple[str, ...]  # through a window
    drapes: tuple[str, ...]
    beacon_count: tuple[int, int]  # in a world
    clutter: tuple[str, ...]
    clutter_count: tuple[int, int]
    things: tuple[str, ...]
    thing_count: tuple[int, int]
    lamp_strength: tuple[float, float]
    lamp_warmth: tuple[float, float]  # blue of the lamps' light, red being 1
    ambient: tuple[float, float]


_MOSTLY_PLAIN = ("plain",) * 8  # of thirteen walls: offices are painted, not papered

TRAIN = Style(
    name="train",
    stream=0x7261,
    wall_hues=(0.08, 0.11, 0.14, 0.30, 0.45, 0.56, 0.62, 0.75, 0.95),
    wall_values=(0.72, 0.98),
    wall_patterns=(
        *_MOSTLY_PLAIN,
        *("two_tone", "brick", "stripes", "rough", "blocks"),
        *("wainscot", "wainscot", "wainscot", "bands", "cladding", "cladding", "mottled", "motif"),
    ),
    floor_patterns=("tiles", "planks", "carpet", "checker", "linoleum", "patchwork", "patchwork"),
    accent_hues=(0.0, 0.03, 0.07, 0.12, 0.16, 0.27, 0.36, 0.47, 0.55, 0.61, 0.67, 0.78, 0.91),
    woods=(
        (0.62, 0.43, 0.26),
        (0.45, 0.29, 0.17),
        (0.78, 0.62, 0.42),
        (0.33, 0.21, 0.14),
        (0.70, 0.50, 0.36),
    ),
    posters=(
        *("fields", "article", "photo", "shapes", "grid", "headline", "stripes"),
        *("medley",) * 5,
        *("faded",) * 4,
    ),
    doors=("plain", "panels4", "panels2", "slit", "pane", "kick", "glazed", *("medley",) * 5),
    cabinets=("two_doors", "drawers", "books", "lockers", "half_books", *("medley",) * 4),
    signs=("arrow", "runner", "ring", "triangle", "flame", "text", *("glyph",) * 5),
    radiators=("ribs", "plates", "columns", "slots", *("sections",) * 4),
    views=("sky", "trees", "houses", "dusk"),
    drapes=("none", "none", "blind", "curtains", "roller", "slats"),
    clutter=(
        *("chair", "office_chair", "bush", "palm", "bin", "box"),
        *("figure", "figure", "stand", "heap", "foliage", "foliage"),
    ),
    beacon_count=(8, 22),
    clutter_count=(3, 9),
    things=(
        *("clock", "switch", "pipe", "shelf", "duct", "note", "grille"),
        *("plate", "plate", "plate", "board", "board", "block", "block", "column", "shape"),
    ),
    thing_count=(4, 14),
    lamp_strength=(0.9, 5.0),
    lamp_warmth=(0.5, 1.1),
    ambient=(0.06, 0.4),
)

TEST = Style(
    name="test",
    stream=0x7E57,
    wall_hues=(0.06, 0.10, 0.18, 0.37, 0.52, 0.59, 0.69, 0.88),
    wall_values=(0.75, 0.95),
    wall_patterns=(*_MOSTLY_PLAIN, "two_tone", "dado", "dots", "brick", "rough"),
    floor_patterns=("herringbone", "slabs", "carpet", "terrazzo", "planks"),
    accent_hues=(0.015, 0.05, 0.10, 0.14, 0.22, 0.32, 0.42, 0.51, 0.58, 0.64, 0.72, 0.84, 0.96),
    woods=((0.56, 0.39, 0.25), (0.40, 0.26, 0.18), (0.74, 0.57, 0.36), (0.66, 0.46, 0.29)),
    posters=("columns", "diagonal", "rings", "map", "photo", "mosaic", "headline"),
    doors=("plain", "panels6", "panels3", "round_pane", "slit", "vent", "planked"),
    cabinets=("two_doors", "files", "glass_doors", "sliding", "books"),
    signs=("exit", "cross", "ring", "diamond", "extinguisher", "number"),
    radiators=("ribs", "plates", "bars"),
    views=("sky", "hills", "facade"),
    drapes=("none", "none", "blind", "curtains", "frosted"),
    clutter=("stool_chair", "swivel_chair", "ficus", "bush", "cone", "box"),
    beacon_count=(6, 16),
    clutter_count=(3, 8),
    things=("clock", "socket", "pipe", "shelf", "rail", "note", "alarm"),
    thing_count=(2, 6),
    lamp_strength=(1.5, 4.0),
    lamp_warmth=(0.6, 1.0),
    ambient=(0.10, 0.30),
)

STYLES = {"train": TRAIN, "test": TEST}


def style_of(name: str) -> Style:
    """BslamError unless the name is known."""
    if name not in STYLES:
        raise BslamError(f"style {name!r}: allowed: {', '.join(STYLES)}")
    return STYLES[name]


class Artist:
    """A style and the random numbers to draw from it."""

    def __init__(self, style: Style, random: np.random.Generator) -> None:
        self.style, self.random = style, random

    def between(self, low: float, high: float) -> float:
        return float(self.random.uniform(low, high))

    def count(self, low: int, high: int) -> int:
        """low to high, both included."""
        return int(self.random.integers(low, high + 1))

    def chance(self, share: float) -> bool:
        return bool(self.random.random() < share)

    def pick(self, choices: Sequence[T]) -> T:
        return choices[int(self.random.integers(len(choices)))]

    def hue(self) -> float:
        return (self.pick(self.style.accent_hues) + self.between(-0.012, 0.012)) % 1.0

    def accent(self) -> Colour:
        """A strong colour, now and then a dark or a pale one, or none at all."""
        kind = self.random.random()
        if kind < 0.55:
            return hsv(self.hue(), self.between(0.6, 1.0), self.between(0.5, 0.95))
        if kind < 0.75:
            return hsv(self.hue(), self.between(0.5, 0.95), self.between(0.2, 0.5))
        if kind < 0.88:
            return hsv(self.hue(), self.between(0.15, 0.5), self.between(0.75, 1.0))
        return self.grey(0.08, 0.95)

    def grey(self, low: float, high: float) -> Colour:
        value = self.between(low, high)
        return value, value * self.between(0.97, 1.03), value * self.between(0.95, 1.05)

    def wood(self) -> Colour:
        return tint(self.pick(self.style.woods), self.between(0.8, 1.2))

    def paint(self) -> Colour:
        """Of walls: white, off-white or pastel."""
        value = self.between(*self.style.wall_values)
        saturation = self.between(0.0, 0.06) if self.chance(0.5) else self.between(0.06, 0.28)
        return hsv((self.pick(self.style.wall_hues) + self.between(-0.02, 0.02)) % 1.0, saturation, value)

    def metal(self) -> Colour:
        return mix(self.grey(0.4, 0.9), hsv(self.between(0.5, 0.65), 0.3, 0.8), self.between(0.0, 0.3))

    def varnish(self) -> Colour:
        """Of furniture and doors: wood, white, grey, or a colour."""
        kind = self.random.random()
        if kind < 0.45:
            return self.wood()
        if kind < 0.65:
            return self.grey(0.75, 0.97)
        if kind < 0.8:
            return self.grey(0.3, 0.7)
        return mix(self.accent(), self.grey(0.4, 0.8), self.between(0.1, 0.5))
