"""What a building comes with: doors, windows, radiators, fire extinguishers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bslam.world.camera.looks.canvas import Canvas, Colour, hsv, mix, tint
from bslam.world.camera.looks.look import Look
from bslam.world.camera.looks.prints import text
from bslam.world.camera.looks.style import Artist

_WHITE: Colour = (0.96, 0.96, 0.95)


def wood_grain(canvas: Canvas, artist: Artist, upright: bool = True) -> None:
    """Streaks along the wood."""
    across, along = artist.count(12, 32), artist.count(1, 3)
    cells = (across, along) if upright else (along, across)
    canvas.grain(artist.random, artist.between(0.03, 0.1), *cells)


# --- Doors --------------------------------------------------------------------------------------------------


def door(artist: Artist) -> Look:
    leaf = artist.varnish()
    canvas = Canvas(64, 128, leaf, 0.9 / 2.0)
    if artist.chance(0.6):
        wood_grain(canvas, artist)
    _DOORS[artist.pick(artist.style.doors)](canvas, artist, leaf)
    _handle(canvas, artist)
    jamb = artist.pick((_WHITE, tint(leaf, 0.75), artist.grey(0.3, 0.8), artist.wood()))
    thick = artist.between(0.05, 0.1)
    canvas.rect(0.0, 0.0, thick, 1.0, jamb)
    canvas.rect(1.0 - thick, 0.0, 1.0, 1.0, jamb)
    canvas.rect(0.0, 0.0, 1.0, thick * canvas.aspect, jamb)
    for x in (thick, 1.0 - thick - 0.012):
        canvas.scale(x, thick * canvas.aspect, x + 0.012, 1.0, 0.6)
    return Look(canvas.picture(), tint(jamb, 0.8))


def _handle(canvas: Canvas, artist: Artist) -> None:
    x, y = (0.84 if artist.chance(0.5) else 0.16), artist.between(0.47, 0.53)
    metal = artist.metal()
    if artist.chance(0.5):
        canvas.rect(x - 0.025, y - 0.05, x + 0.025, y + 0.06, tint(metal, 0.8))
    inward = -0.1 if x > 0.5 else 0.1
    canvas.rect(min(x, x + inward), y - 0.008, max(x, x + inward), y + 0.01, metal)


def _plain(canvas: Canvas, artist: Artist, leaf: Colour) -> None:
    if artist.chance(0.4):
        canvas.rect(0.3, 0.3, 0.7, artist.between(0.33, 0.37), artist.grey(0.6, 1.0))


def _panels(columns: int, rows: int) -> Callable[[Canvas, Artist, Colour], None]:
    def paint(canvas: Canvas, artist: Artist, leaf: Colour) -> None:
        depth = artist.between(0.12, 0.35)
        for column in range(columns):
            for row in range(rows):
                left, right = 0.14 + 0.74 * column / columns, 0.12 + 0.74 * (column + 1) / columns
                top, bottom = 0.07 + 0.86 * row / rows, 0.05 + 0.86 * (row + 1) / rows
                canvas.bevel(left, top, right, bottom, 0.02, depth)

    return paint


def _pane(left: float, top: float, right: float, bottom: float) -> Callable[[Canvas, Artist, Colour], None]:
    def paint(canvas: Canvas, artist: Artist, leaf: Colour) -> None:
        canvas.rect(left - 0.03, top - 0.015, right + 0.03, bottom + 0.015, tint(leaf, 0.7))
        canvas.rect(left, top, right, bottom, mix(artist.grey(0.15, 0.85), (0.6, 0.75, 0.8), 0.4))
        middle = artist.between(top, bottom)
        canvas.rect(left, top, right, middle, artist.grey(0.4, 0.9), 0.4)

    return paint


def _kick(canvas: Canvas, artist: Artist, leaf: Colour) -> None:
    canvas.rect(0.12, 0.82, 0.88, 0.98, artist.metal())
    canvas.rect(0.25, 0.28, 0.75, 0.36, artist.grey(0.7, 1.0))
    text(canvas, artist, (0.29, 0.29, 0.71, 0.35), 0.03, (0.1, 0.1, 0.1))


def _round_pane(canvas: Canvas, artist: Artist, leaf: Colour) -> None:
    canvas.circle(0.5, 0.27, 0.2, artist.metal())
    canvas.circle(0.5, 0.27, 0.16, artist.grey(0.2, 0.8))


def _vent(canvas: Canvas, artist: Artist, leaf: Colour) -> None:
    for i in range(7):
        canvas.rect(0.2, 0.78 + 0.025 * i, 0.8, 0.79 + 0.025 * i, tint(leaf, 0.5))


def _planked(canvas: Canvas, artist: Artist, leaf: Colour) -> None:
    count = artist.count(4, 8)
    for i in range(1, count):
        canvas.scale(i / count - 0.008, 0.0, i / count + 0.008, 1.0, 0.65)
    for y in (0.2, 0.8):
        canvas.scale(0.0, y, 1.0, y + 0.04, 0.85)


def _medley(canvas: Canvas, artist: Artist, leaf: Colour) -> None:
    """Panels, panes, plates and notices in any number."""
    if artist.chance(0.5):
        _panels(artist.count(1, 3), artist.count(1, 4))(canvas, artist, leaf)
    if artist.chance(0.15):
        canvas.rect(0.49, 0.0, 0.51, 1.0, tint(leaf, 0.5))  # two leaves
    if artist.chance(0.4):
        left, top = artist.between(0.14, 0.6), artist.between(0.06, 0.4)
        right, bottom = artist.between(left + 0.08, 0.88), artist.between(top + 0.06, 0.9)
        _pane(left, top, right, bottom)(canvas, artist, leaf)
    for _ in range(artist.count(0, 2)):
        left, top = artist.between(0.12, 0.7), artist.between(0.1, 0.9)
        right, bottom = left + artist.between(0.05, 0.5), top + artist.between(0.01, 0.12)
        canvas.rect(left, top, right, bottom, artist.accent())
    if artist.chance(0.2):
        canvas.rect(0.12, 0.5, 0.88, 0.53, artist.metal())  # a push bar


_DOORS: dict[str, Callable[[Canvas, Artist, Colour], None]] = {
    "plain": _plain,
    "panels2": _panels(1, 2),
    "panels3": _panels(1, 3),
    "panels4": _panels(2, 2),
    "panels6": _panels(2, 3),
    "slit": _pane(0.66, 0.14, 0.76, 0.62),
    "pane": _pane(0.24, 0.1, 0.76, 0.4),
    "glazed": _pane(0.16, 0.07, 0.84, 0.85),
    "kick": _kick,
    "round_pane": _round_pane,
    "vent": _vent,
    "planked": _planked,
    "medley": _medley,
}

# --- Windows ------------------------------------------------------------------------------------------------


def window(artist: Artist) -> Look:
    canvas = Canvas(128, 128, (0.8, 0.9, 1.0), 1.0)
    _VIEWS[artist.pick(artist.style.views)](canvas, artist)
    canvas.alpha[:] = 0.0  # what is outside shines
    _DRAPES[artist.pick(artist.style.drapes)](canvas, artist)
    bars = artist.pick((_WHITE, _WHITE, artist.grey(0.2, 0.8), artist.wood()))
    columns, rows = artist.pick(((1, 1), (2, 1), (2, 1), (2, 2), (3, 1), (1, 2)))
    thick = artist.between(0.025, 0.05)
    edges = [(x, 0.0, x + thick, 1.0) for x in _bars(columns, thick)]
    edges += [(0.0, y, 1.0, y + thick) for y in _bars(rows, thick)]
    edges += [(0.0, 0.0, 1.0, 1.6 * thick), (0.0, 1.0 - 1.6 * thick, 1.0, 1.0)]
    edges += [(0.0, 0.0, 1.6 * thick, 1.0), (1.0 - 1.6 * thick, 0.0, 1.0, 1.0)]
    for edge in edges:
        canvas.rect(*edge, bars)
        canvas.hole(*edge, alpha=1.0)
    brightness = artist.between(0.3, 1.6)
    return Look(canvas.picture(), tint(bars, 0.85), glow=(0.0, brightness))


def _bars(count: int, thick: float) -> list[float]:
    return [i / count - 0.5 * thick for i in range(1, count)]


def _sky(canvas: Canvas, artist: Artist) -> None:
    high = hsv(artist.between(0.53, 0.62), artist.between(0.0, 0.55), artist.between(0.7, 1.0))
    canvas.gradient(high, mix(high, (1.0, 1.0, 1.0), artist.between(0.3, 0.9)))
    canvas.grain(artist.random, artist.between(0.02, 0.1), 4, 5)


def _trees(canvas: Canvas, artist: Artist) -> None:
    _sky(canvas, artist)
    top = artist.between(0.35, 0.75)
    green = hsv(artist.between(0.2, 0.38), artist.between(0.3, 0.7), artist.between(0.2, 0.5))
    canvas.rect(0.0, top + 0.08, 1.0, 1.0, green)
    for _ in range(artist.count(6, 14)):
        x, y = artist.between(0.0, 1.0), artist.between(top, top + 0.12)
        canvas.ellipse(
            x,
            y,
            artist.between(0.06, 0.16),
            artist.between(0.06, 0.14),
            tint(green, artist.between(0.7, 1.3)),
        )
    canvas.grain(artist.random, 0.12, 20, 20)


def _houses(canvas: Canvas, artist: Artist) -> None:
    _sky(canvas, artist)
    x = 0.0
    while x < 1.0:
        wide, top = artist.between(0.2, 0.5), artist.between(0.25, 0.75)
        front = artist.pick(
            (artist.grey(0.4, 0.8), hsv(artist.between(0.0, 0.12), 0.4, artist.between(0.4, 0.8)))
        )
        canvas.rect(x, top, min(1.0, x + wide), 1.0, front)
        for column in np.arange(x + 0.04, min(1.0, x + wide) - 0.06, 0.09):
            for row in np.arange(top + 0.05, 0.95, 0.12):
                canvas.rect(column, row, column + 0.045, row + 0.06, tint(front, 0.5))
        x += wide


def _hills(canvas: Canvas, artist: Artist) -> None:
    _sky(canvas, artist)
    for level in (0.5, 0.65, 0.8):
        green = hsv(artist.between(0.22, 0.5), artist.between(0.2, 0.5), artist.between(0.3, 0.65))
        x, y = artist.between(0.1, 0.9), level + artist.between(0.1, 0.3)
        canvas.ellipse(x, y + 0.2, artist.between(0.5, 0.9), 0.4, green)


def _facade(canvas: Canvas, artist: Artist) -> None:
    canvas.rect(0.0, 0.0, 1.0, 1.0, artist.grey(0.45, 0.85))
    step = artist.between(0.14, 0.25)
    for column in np.arange(0.05, 0.95, step):
        for row in np.arange(0.05, 0.95, 1.2 * step):
            canvas.rect(column, row, column + 0.55 * step, row + 0.8 * step, artist.grey(0.2, 0.6))


def _dusk(canvas: Canvas, artist: Artist) -> None:
    canvas.gradient(artist.accent(), artist.grey(0.05, 0.4), artist.chance(0.2))
    for _ in range(artist.count(0, 12)):
        wide, tall = artist.between(0.02, 0.2), artist.between(0.02, 0.3)
        x, y = artist.between(0.0, 1.0), artist.between(0.2, 1.0)
        canvas.ellipse(x, y, wide, tall, tint(artist.accent(), artist.between(0.3, 1.2)))


_VIEWS: dict[str, Callable[[Canvas, Artist], None]] = {
    "sky": _sky,
    "trees": _trees,
    "houses": _houses,
    "hills": _hills,
    "facade": _facade,
    "dusk": _dusk,
}


def _no_drapes(canvas: Canvas, artist: Artist) -> None:
    """The bare window."""


def _blind(canvas: Canvas, artist: Artist) -> None:
    slat, end = artist.grey(0.6, 0.95), artist.between(0.2, 0.9)
    for y in np.arange(0.02, end, 0.05):
        canvas.rect(0.0, y, 1.0, y + 0.035, slat)
        canvas.hole(0.0, y, 1.0, y + 0.035, alpha=artist.between(0.7, 0.9))


def _curtains(canvas: Canvas, artist: Artist) -> None:
    cloth, wide = artist.accent(), artist.between(0.12, 0.3)
    for left, right in ((0.0, wide), (1.0 - wide, 1.0)):
        canvas.rect(left, 0.0, right, 1.0, cloth)
        canvas.hole(left, 0.0, right, 1.0, alpha=0.85)
        for x in np.arange(left, right - 0.02, 0.045):
            canvas.scale(x, 0.0, x + 0.02, 1.0, 0.75)


def _roller(canvas: Canvas, artist: Artist) -> None:
    end = artist.between(0.2, 0.8)
    canvas.rect(0.0, 0.0, 1.0, end, mix(artist.accent(), _WHITE, artist.between(0.2, 0.8)))
    canvas.hole(0.0, 0.0, 1.0, end, alpha=0.8)


def _frosted(canvas: Canvas, artist: Artist) -> None:
    top = artist.between(0.0, 0.6)
    canvas.rect(0.0, top, 1.0, 1.0, artist.grey(0.75, 0.95), 0.85)


def _slats(canvas: Canvas, artist: Artist) -> None:
    """Upright ones, over some of it."""
    cloth, count = artist.grey(0.5, 1.0), artist.count(6, 18)
    start, end = sorted((artist.between(0.0, 1.0), artist.between(0.0, 1.0)))
    for i in range(count):
        x = start + (end - start) * i / count
        canvas.rect(x, 0.0, x + 0.7 * (end - start) / count, 1.0, cloth)
        canvas.hole(x, 0.0, x + 0.7 * (end - start) / count, 1.0, alpha=artist.between(0.6, 0.95))


_DRAPES: dict[str, Callable[[Canvas, Artist], None]] = {
    "none": _no_drapes,
    "blind": _blind,
    "curtains": _curtains,
    "roller": _roller,
    "frosted": _frosted,
    "slats": _slats,
}

# --- Radiators and extinguishers ----------------------------------------------------------------------------


def radiator(artist: Artist) -> Look:
    kind = artist.random.random()
    body = (
        artist.grey(0.82, 0.98) if kind < 0.65 else artist.grey(0.3, 0.75) if kind < 0.85 else artist.accent()
    )
    canvas = Canvas(128, 64, body, artist.between(0.8, 1.4) / 0.6)
    _RADIATORS[artist.pick(artist.style.radiators)](canvas, artist, body)
    side = 0.0 if artist.chance(0.5) else 0.97
    canvas.rect(side, 0.1, side + 0.03, 0.25, artist.pick((_WHITE, artist.metal(), (0.15, 0.15, 0.15))))
    canvas.grain(artist.random, 0.04, 3, 2)
    return Look(canvas.picture(), tint(body, 0.85))


def _ribs(canvas: Canvas, artist: Artist, body: Colour) -> None:
    count, deep = artist.count(10, 30), artist.between(0.45, 0.85)
    for i in range(count):
        canvas.scale((i + 0.72) / count, 0.04, (i + 1.0) / count, 0.96, deep)
    for y in (0.06, 0.9):
        canvas.rect(0.0, y, 1.0, y + 0.04, tint(body, 0.95))


def _plates(canvas: Canvas, artist: Artist, body: Colour) -> None:
    count, deep = artist.count(12, 36), artist.between(0.8, 0.94)
    for i in range(count):
        canvas.scale((i + 0.6) / count, 0.1, (i + 1.0) / count, 0.93, deep)
    canvas.rect(0.0, 0.0, 1.0, 0.05, tint(body, 0.7))
    for x in np.arange(0.01, 0.99, 0.03):
        canvas.rect(x, 0.005, x + 0.015, 0.045, tint(body, 0.35))
    canvas.frame(0.0, 0.05, 1.0, 1.0, 0.008, tint(body, 0.85))


def _columns(canvas: Canvas, artist: Artist, body: Colour) -> None:
    count = artist.count(8, 18)
    for i in range(count):
        canvas.rect((i + 0.8) / count, 0.0, (i + 1.0) / count, 1.0, tint(body, 0.35))
        canvas.scale((i + 0.1) / count, 0.0, (i + 0.3) / count, 1.0, 1.1)
    canvas.rect(0.0, 0.12, 1.0, 0.17, body)
    canvas.rect(0.0, 0.83, 1.0, 0.88, body)


def _bars_across(canvas: Canvas, artist: Artist, body: Colour) -> None:
    count = artist.count(6, 12)
    for i in range(count):
        canvas.rect(0.0, (i + 0.72) / count, 1.0, (i + 1.0) / count, tint(body, 0.5))
    for x in (0.04, 0.92):
        canvas.rect(x, 0.0, x + 0.04, 1.0, tint(body, 0.9))


def _slots(canvas: Canvas, artist: Artist, body: Colour) -> None:
    """Slots across, or a grating of both, or a bare front."""
    rows, columns, deep = artist.count(0, 9), artist.count(0, 30), artist.between(0.5, 0.95)
    for i in range(rows):
        canvas.scale(0.03, (i + 0.5) / rows, 0.97, (i + 0.8) / rows, deep)
    for i in range(columns if artist.chance(0.6) else 0):
        canvas.scale((i + 0.5) / columns, 0.05, (i + 0.8) / columns, 0.95, deep)
    if artist.chance(0.5):
        canvas.frame(0.0, 0.0, 1.0, 1.0, artist.between(0.005, 0.02), tint(body, artist.between(0.6, 1.1)))


def _sections(canvas: Canvas, artist: Artist, body: Colour) -> None:
    """Rows and columns of anything: slots, gaps, flutes, rails before them, a cover over them."""
    for upright in (True, False):
        if artist.chance(0.6):
            _repeat(canvas, artist, body, artist.count(3, 40) if upright else artist.count(2, 16), upright)
    for _ in range(artist.count(0, 3)):
        at, thick = artist.between(0.0, 0.95), artist.between(0.01, 0.12)
        box = (at, 0.0, at + thick, 1.0) if artist.chance(0.4) else (0.0, at, 1.0, at + thick)
        canvas.rect(*box, tint(body, artist.between(0.3, 1.1)), artist.between(0.4, 1.0))
    if artist.chance(0.5):
        canvas.frame(0.0, 0.0, 1.0, 1.0, artist.between(0.005, 0.05), tint(body, artist.between(0.5, 1.15)))


def _repeat(canvas: Canvas, artist: Artist, body: Colour, count: int, upright: bool) -> None:
    """So many equal sections, side by side or stacked: a stretch of each is darker, another paler."""
    low, high = artist.between(0.0, 0.15), artist.between(0.85, 1.0)
    starts = artist.between(0.0, 0.5), artist.between(0.0, 0.5)
    widths = artist.between(0.1, 0.5), artist.between(0.1, 0.5)
    factors = artist.between(0.3, 0.95), artist.between(1.0, 1.15)
    for i in range(count):
        for start, width, factor in zip(starts, widths, factors, strict=True):
            first, last = (i + start) / count, (i + start + width) / count
            box = (first, low, last, high) if upright else (low, first, high, last)
            canvas.scale(*box, factor)


_RADIATORS: dict[str, Callable[[Canvas, Artist, Colour], None]] = {
    "ribs": _ribs,
    "plates": _plates,
    "columns": _columns,
    "bars": _bars_across,
    "slots": _slots,
    "sections": _sections,
}


def extinguisher(artist: Artist) -> Look:
    red = hsv(artist.between(-0.02, 0.03) % 1.0, artist.between(0.8, 1.0), artist.between(0.55, 0.9))
    other = artist.pick(
        ((0.1, 0.3, 0.6), (0.12, 0.12, 0.13), (0.9, 0.75, 0.1), (0.15, 0.45, 0.2), (0.75, 0.75, 0.75))
    )
    body = other if artist.chance(0.15) else red
    canvas = Canvas(64, 128, (0.0, 0.0, 0.0), 0.18 / 0.6)
    ground = canvas.ground() - 1.0
    canvas.rgb[:] = ground
    canvas.rect(0.0, 0.3, 1.0, 1.0, body)
    canvas.ellipse(0.5, 0.3, 0.5, 0.1, body)
    black = artist.grey(0.04, 0.15)
    canvas.rect(0.36, 0.08, 0.64, 0.22, artist.pick((black, artist.metal())))
    canvas.rect(0.2, 0.0, 0.85, 0.05, black)
    canvas.rect(0.3, 0.06, 0.95, 0.1, black)
    label = artist.pick((_WHITE, (0.95, 0.9, 0.6), (0.8, 0.85, 0.9), (0.1, 0.1, 0.1)))
    top, bottom = artist.between(0.42, 0.5), artist.between(0.66, 0.82)
    canvas.rect(0.14, top, 0.86, bottom, label)
    text(canvas, artist, (0.2, top + 0.02, 0.8, bottom - 0.02), 0.05, artist.pick((body, (0.1, 0.1, 0.1))))
    if artist.chance(0.5):
        canvas.rect(0.0, 0.88, 1.0, 0.93, artist.pick((black, artist.accent())))
    side = 1.0 if artist.chance(0.5) else 0.0
    inner = abs(side - 0.08)
    canvas.line((0.5, 0.12), (inner, 0.25), 0.12, black)
    canvas.line((inner, 0.25), (inner, artist.between(0.6, 0.85)), 0.12, black)
    outline = canvas.painted_on(ground)
    turn = np.cos(np.linspace(-1.25, 1.05, canvas.rgb.shape[1]))  # a cylinder, lit from one side
    canvas.rgb *= np.maximum(0.35, turn[np.newaxis, :, np.newaxis])
    canvas.keep(outline)
    return Look(canvas.picture(), body, cut_out=True)
