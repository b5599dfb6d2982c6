"""Cabinets, and what stands and hangs about: chairs, plants, clocks, pipes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from bslam.world.camera.looks import oddments
from bslam.world.camera.looks.canvas import Canvas, Colour, hsv, mix, tint
from bslam.world.camera.looks.fittings import wood_grain
from bslam.world.camera.looks.look import Look
from bslam.world.camera.looks.piece import Piece
from bslam.world.camera.looks.prints import text
from bslam.world.camera.looks.style import Artist

_WHITE: Colour = (0.96, 0.96, 0.95)


# --- Cabinets -----------------------------------------------------------------------------------------------


def cabinet(artist: Artist) -> Look:
    body = artist.varnish()
    canvas = Canvas(64, 128, body, 0.9 / 1.8)
    if artist.chance(0.6):
        wood_grain(canvas, artist, artist.chance(0.8))
    _CABINETS[artist.pick(artist.style.cabinets)](canvas, artist, body)
    canvas.frame(0.0, 0.0, 1.0, 1.0, artist.between(0.015, 0.035), tint(body, artist.between(0.7, 1.1)))
    if artist.chance(0.5):
        canvas.rect(0.0, 0.95, 1.0, 1.0, tint(body, 0.4))
    return Look(canvas.picture(), tint(body, artist.between(0.8, 1.0)))


def _doors_in(canvas: Canvas, artist: Artist, top: float, bottom: float, count: int, body: Colour) -> None:
    metal = artist.metal()
    for i in range(count):
        left, right = i / count, (i + 1) / count
        canvas.frame(left, top, right, bottom, 0.012, tint(body, 0.55))
        x = right - 0.08 if i % 2 == 0 else left + 0.05
        middle = 0.5 * (top + bottom)
        canvas.rect(x, middle - 0.04, x + 0.03, middle + 0.04, metal)


def _two_doors(canvas: Canvas, artist: Artist, body: Colour) -> None:
    _doors_in(canvas, artist, 0.0, 0.96, 2, body)


def _drawers(canvas: Canvas, artist: Artist, body: Colour) -> None:
    count, metal = artist.count(3, 6), artist.metal()
    for i in range(count):
        canvas.frame(0.0, i / count, 1.0, (i + 1) / count, 0.015, tint(body, 0.55))
        middle = (i + 0.35) / count
        canvas.rect(0.38, middle, 0.62, middle + 0.02, metal)


def _shelves(canvas: Canvas, artist: Artist, top: float, bottom: float, body: Colour) -> None:
    """Shelves full of books."""
    count = max(1, round((bottom - top) / artist.between(0.15, 0.22)))
    tall = (bottom - top) / count
    for row in range(count):
        low = top + (row + 1) * tall
        canvas.rect(0.03, low - tall, 0.97, low, tint(body, 0.3))
        x, inks = 0.04, [artist.accent() for _ in range(5)]
        end = 0.96 if artist.chance(0.6) else artist.between(0.4, 0.96)
        while x < end:
            wide = artist.between(0.03, 0.09)
            canvas.rect(x, low - tall * artist.between(0.6, 0.9), min(x + wide, end), low, artist.pick(inks))
            x += wide + 0.004
        canvas.rect(0.0, low - 0.02, 1.0, low, body)


def _books(canvas: Canvas, artist: Artist, body: Colour) -> None:
    _shelves(canvas, artist, 0.02, 0.96, body)


def _half_books(canvas: Canvas, artist: Artist, body: Colour) -> None:
    _shelves(canvas, artist, 0.02, 0.58, body)
    _doors_in(canvas, artist, 0.58, 0.96, 2, body)


def _lockers(canvas: Canvas, artist: Artist, body: Colour) -> None:
    count = artist.count(2, 4)
    _doors_in(canvas, artist, 0.0, 0.96, count, body)
    for i in range(count):
        for y in (0.07, 0.095, 0.12, 0.8, 0.825):
            canvas.rect((i + 0.25) / count, y, (i + 0.75) / count, y + 0.01, tint(body, 0.4))


def _files(canvas: Canvas, artist: Artist, body: Colour) -> None:
    rows, columns = artist.count(4, 6), artist.count(1, 2)
    for row in range(rows):
        for column in range(columns):
            left, right = column / columns, (column + 1) / columns
            canvas.frame(left, row / rows, right, (row + 1) / rows, 0.012, tint(body, 0.5))
            middle, y = 0.5 * (left + right), (row + 0.25) / rows
            canvas.rect(middle - 0.08, y, middle + 0.08, y + 0.03, _WHITE)
            canvas.rect(middle - 0.08, y + 0.05, middle + 0.08, y + 0.065, artist.grey(0.2, 0.7))


def _glass_doors(canvas: Canvas, artist: Artist, body: Colour) -> None:
    _shelves(canvas, artist, 0.03, 0.66, body)
    canvas.rect(0.0, 0.03, 1.0, 0.66, (0.75, 0.85, 0.9), artist.between(0.15, 0.4))
    for x in (0.0, 0.48, 0.96):
        canvas.rect(x, 0.0, x + 0.04, 0.68, body)
    _doors_in(canvas, artist, 0.68, 0.96, 2, body)


def _sliding(canvas: Canvas, artist: Artist, body: Colour) -> None:
    for i in range(24):
        canvas.scale((i + 0.5) / 24, 0.03, (i + 1.0) / 24, 0.96, 0.85)
    canvas.rect(artist.between(0.1, 0.9), 0.45, 0.93, 0.5, artist.grey(0.1, 0.4))
    canvas.rect(0.0, 0.0, 1.0, 0.03, tint(body, 0.6))


def _medley(canvas: Canvas, artist: Artist, body: Colour) -> None:
    """Anything above anything: shelves, doors, glass, drawers, bare board."""
    top = 0.01
    while top < 0.9:
        bottom = min(top + artist.between(0.15, 0.9), 0.97)
        if 0.97 - bottom < 0.12:
            bottom = 0.97
        kind = artist.random.random()
        if kind < 0.3:
            _shelves(canvas, artist, top, bottom, body)
            if artist.chance(0.4):
                glass = mix(artist.metal(), _WHITE, 0.4)
                canvas.rect(0.02, top, 0.98, bottom, glass, artist.between(0.1, 0.5))
        elif kind < 0.85:
            tint_of = tint(body, artist.between(0.85, 1.1)) if artist.chance(0.7) else artist.varnish()
            canvas.rect(0.0, top, 1.0, bottom, tint_of)
            _doors_in(canvas, artist, top, bottom, artist.count(1, 4), tint_of)
        top = bottom


_CABINETS: dict[str, Callable[[Canvas, Artist, Colour], None]] = {
    "two_doors": _two_doors,
    "drawers": _drawers,
    "books": _books,
    "lockers": _lockers,
    "half_books": _half_books,
    "files": _files,
    "glass_doors": _glass_doors,
    "sliding": _sliding,
    "medley": _medley,
}

# --- Clutter ------------------------------------------------------------------------------------------------


def clutter(artist: Artist) -> Piece:
    """Something that stands on the floor."""
    paint, width_m, height_m = _CLUTTER[artist.pick(artist.style.clutter)]
    scale = artist.between(0.85, 1.15)
    return Piece(cut_out(artist, paint, width_m, height_m), scale * width_m, scale * height_m)


def cut_out(artist: Artist, paint: Callable[[Canvas, Artist], None], width_m: float, height_m: float) -> Look:
    """What a painter leaves on an empty canvas, cut out of it."""
    canvas = Canvas(64, 128, (0.0, 0.0, 0.0), width_m / height_m)
    canvas.rgb -= 1.0
    ground = canvas.ground()
    paint(canvas, artist)
    outline = canvas.painted_on(ground)
    canvas.grain(artist.random, 0.06, 8, 12)
    canvas.keep(outline)
    # Seen from afar a cut-out mixes with the colour around it: let that be its own.
    canvas.rgb[~outline] = canvas.rgb[outline].mean(axis=0)
    return Look(canvas.picture(), (0.5, 0.5, 0.5), cut_out=True)


def _chair(canvas: Canvas, artist: Artist) -> None:
    seat, legs = artist.accent(), artist.pick((artist.metal(), artist.wood(), artist.grey(0.05, 0.3)))
    for x in (0.08, 0.82):
        canvas.rect(x, 0.5, x + 0.08, 1.0, legs)
    for x in (0.24, 0.68):
        canvas.rect(x, 0.5, x + 0.07, 0.92, tint(legs, 0.7))
    if artist.chance(0.5):
        canvas.rect(0.06, 0.0, 0.94, artist.between(0.25, 0.42), seat)
        canvas.rect(0.1, 0.3, 0.18, 0.55, legs)
        canvas.rect(0.82, 0.3, 0.9, 0.55, legs)
    else:
        canvas.rect(0.06, 0.0, 0.16, 0.5, legs)
        canvas.rect(0.84, 0.0, 0.94, 0.5, legs)
        for y in (0.03, 0.15, 0.27):
            canvas.rect(0.06, y, 0.94, y + 0.06, seat)
    canvas.rect(0.02, 0.48, 0.98, 0.56, tint(seat, 0.8))


def _office_chair(canvas: Canvas, artist: Artist) -> None:
    cloth, black = artist.accent(), artist.grey(0.04, 0.2)
    canvas.ellipse(0.5, 0.2, 0.4, 0.2, cloth)
    canvas.rect(0.1, 0.12, 0.9, 0.4, cloth)
    canvas.rect(0.45, 0.38, 0.55, 0.52, black)
    canvas.ellipse(0.5, 0.53, 0.46, 0.06, tint(cloth, 0.7))
    canvas.rect(0.46, 0.55, 0.54, 0.85, artist.metal())
    canvas.line((0.5, 0.85), (0.08, 0.94), 0.08, black)
    canvas.line((0.5, 0.85), (0.92, 0.94), 0.08, black)
    for x in (0.08, 0.5, 0.92):
        canvas.circle(x, 0.965, 0.06, black)
    if artist.chance(0.6):
        canvas.rect(0.0, 0.38, 0.07, 0.5, black)
        canvas.rect(0.93, 0.38, 1.0, 0.5, black)


def _stool_chair(canvas: Canvas, artist: Artist) -> None:
    wood, seat = artist.wood(), artist.accent()
    for x, foot in ((0.14, 0.04), (0.86, 0.96)):
        canvas.line((x, 0.5), (foot, 0.99), 0.09, wood)
    canvas.line((0.3, 0.5), (0.28, 0.9), 0.07, tint(wood, 0.7))
    canvas.line((0.7, 0.5), (0.72, 0.9), 0.07, tint(wood, 0.7))
    canvas.rect(0.1, 0.72, 0.9, 0.75, wood)
    canvas.ellipse(0.5, 0.5, 0.48, 0.05, seat)
    for x in (0.2, 0.5, 0.8):
        canvas.line((x, 0.48), (x + 0.5 * (x - 0.5) * 0.3, 0.06), 0.05, wood)
    canvas.ellipse(0.5, 0.07, 0.48, 0.07, seat)


def _swivel_chair(canvas: Canvas, artist: Artist) -> None:
    cloth, black = artist.accent(), artist.grey(0.04, 0.2)
    canvas.rect(0.18, 0.0, 0.82, artist.between(0.36, 0.46), cloth)
    canvas.scale(0.18, 0.15, 0.82, 0.18, 0.6)
    canvas.rect(0.44, 0.3, 0.56, 0.8, black)
    canvas.rect(0.04, 0.48, 0.96, 0.58, cloth)
    for x in (0.03, 0.3, 0.7, 0.97):
        canvas.line((0.5, 0.8), (x, 0.95), 0.06, artist.metal())
        canvas.circle(x, 0.96, 0.055, black)


def _pot(canvas: Canvas, artist: Artist, top: float) -> None:
    pot = artist.pick((hsv(0.05, 0.6, 0.65), _WHITE, artist.grey(0.15, 0.6), artist.accent()))
    canvas.polygon([(0.22, top), (0.78, top), (0.7, 1.0), (0.3, 1.0)], pot)
    canvas.rect(0.2, top, 0.8, top + 0.04, tint(pot, 0.8))


def _green(artist: Artist) -> Colour:
    return hsv(artist.between(0.22, 0.4), artist.between(0.45, 0.9), artist.between(0.25, 0.6))


def _bush(canvas: Canvas, artist: Artist) -> None:
    _pot(canvas, artist, 0.74)
    for _ in range(artist.count(30, 60)):
        angle, reach = artist.between(0.0, math.tau), math.sqrt(artist.between(0.0, 1.0))
        x, y = 0.5 + 0.4 * reach * math.cos(angle), 0.4 + 0.32 * reach * math.sin(angle)
        canvas.ellipse(x, y, artist.between(0.04, 0.12), artist.between(0.02, 0.07), _green(artist))


def _palm(canvas: Canvas, artist: Artist) -> None:
    _pot(canvas, artist, 0.78)
    canvas.rect(0.46, 0.4, 0.54, 0.8, artist.wood())
    for _ in range(artist.count(10, 18)):
        angle, reach = artist.between(-0.2, math.pi + 0.2), artist.between(0.25, 0.48)
        tip = (0.5 + reach * math.cos(angle), 0.42 - 0.8 * reach * math.sin(angle) + 0.1)
        canvas.line((0.5, 0.45), tip, artist.between(0.04, 0.09), _green(artist))


def _ficus(canvas: Canvas, artist: Artist) -> None:
    _pot(canvas, artist, 0.8)
    canvas.rect(0.47, 0.3, 0.53, 0.82, artist.wood())
    for _ in range(artist.count(25, 45)):
        x, y = artist.between(0.12, 0.88), artist.between(0.04, 0.6)
        end = (x + artist.between(-0.1, 0.1), y + artist.between(0.02, 0.12))
        canvas.line((x, y), end, artist.between(0.06, 0.14), _green(artist))


def _bin(canvas: Canvas, artist: Artist) -> None:
    body = artist.varnish()
    canvas.polygon([(0.0, 0.0), (1.0, 0.0), (0.88, 1.0), (0.12, 1.0)], body)
    canvas.rect(0.0, 0.0, 1.0, 0.08, tint(body, 0.6))


def _cone(canvas: Canvas, artist: Artist) -> None:
    canvas.polygon([(0.42, 0.0), (0.58, 0.0), (0.86, 0.92), (0.14, 0.92)], (0.9, 0.35, 0.08))
    canvas.polygon([(0.34, 0.3), (0.66, 0.3), (0.72, 0.5), (0.28, 0.5)], _WHITE)
    canvas.rect(0.0, 0.92, 1.0, 1.0, (0.1, 0.1, 0.1))


def _carton(canvas: Canvas, artist: Artist) -> None:
    card = hsv(artist.between(0.07, 0.1), artist.between(0.3, 0.5), artist.between(0.55, 0.8))
    canvas.rect(0.0, 0.0, 1.0, 1.0, card)
    canvas.rect(0.0, 0.45, 1.0, 0.5, tint(card, 1.2))
    canvas.rect(0.6, 0.6, 0.9, 0.8, artist.pick((_WHITE, tint(card, 0.7))))


_CLUTTER: dict[str, tuple[Callable[[Canvas, Artist], None], float, float]] = {
    "chair": (_chair, 0.45, 0.88),
    "office_chair": (_office_chair, 0.58, 0.98),
    "stool_chair": (_stool_chair, 0.46, 0.9),
    "swivel_chair": (_swivel_chair, 0.55, 1.0),
    "bush": (_bush, 0.6, 0.9),
    "palm": (_palm, 0.8, 1.3),
    "ficus": (_ficus, 0.7, 1.4),
    "bin": (_bin, 0.3, 0.4),
    "cone": (_cone, 0.3, 0.55),
    "box": (_carton, 0.45, 0.4),
    "figure": (oddments.figure, 0.5, 1.0),
    "stand": (oddments.figure, 0.35, 1.4),
    "heap": (oddments.figure, 0.8, 0.6),
    "foliage": (oddments.leaves, 0.7, 1.2),
}

# --- Things on the wall -------------------------------------------------------------------------------------


def wall_thing(artist: Artist) -> Piece:
    """Something small that hangs on the wall."""
    return _THINGS[artist.pick(artist.style.things)](artist)


def _clock(artist: Artist) -> Piece:
    canvas = Canvas(64, 64, artist.grey(0.05, 0.4))
    canvas.circle(0.5, 0.5, 0.44, _WHITE)
    for angle in np.linspace(0.0, math.tau, 13)[:-1]:
        canvas.circle(0.5 + 0.37 * math.cos(angle), 0.5 + 0.37 * math.sin(angle), 0.025, (0.0, 0.0, 0.0))
    for reach in (0.22, 0.34):
        angle = artist.between(0.0, math.tau)
        canvas.line(
            (0.5, 0.5), (0.5 + reach * math.cos(angle), 0.5 + reach * math.sin(angle)), 0.04, (0, 0, 0)
        )
    ys, xs = np.mgrid[:64, :64] / 63.0 - 0.5
    canvas.keep(np.hypot(xs, ys) <= 0.5)
    return Piece(Look(canvas.picture(), _WHITE, cut_out=True), 0.28, 0.28, artist.between(1.7, 2.0))


def _small_box(
    artist: Artist, body: Colour, mark: Colour, size_m: tuple[float, float], bottom_m: float
) -> Piece:
    canvas = Canvas(32, 32, body, size_m[0] / size_m[1])
    canvas.frame(0.0, 0.0, 1.0, 1.0, 0.08, tint(body, 0.8))
    canvas.rect(0.3, 0.3, 0.7, 0.7, mark)
    return Piece(Look(canvas.picture(), tint(body, 0.7)), *size_m, bottom_m)


def _switch(artist: Artist) -> Piece:
    size_m = (0.08, 0.08 * artist.count(1, 3))
    return _small_box(artist, artist.grey(0.8, 1.0), artist.grey(0.7, 0.95), size_m, 1.05)


def _socket(artist: Artist) -> Piece:
    size_m = (0.08 * artist.count(1, 4), 0.08)
    return _small_box(artist, artist.grey(0.8, 1.0), artist.grey(0.2, 0.8), size_m, 0.3)


def _alarm(artist: Artist) -> Piece:
    return _small_box(artist, (0.8, 0.1, 0.1), _WHITE, (0.11, 0.11), 1.2)


def _grille(artist: Artist) -> Piece:
    body = artist.grey(0.6, 0.95)
    canvas = Canvas(32, 32, body)
    for y in np.arange(0.1, 0.9, 0.12):
        canvas.rect(0.08, y, 0.92, y + 0.06, tint(body, 0.3))
    return Piece(Look(canvas.picture(), body), 0.3, 0.25, artist.pick((0.1, 2.0)))


def _note(artist: Artist) -> Piece:
    canvas = Canvas(32, 64, artist.grey(0.85, 1.0))
    text(canvas, artist, (0.12, 0.1, 0.88, 0.9), 0.09, artist.grey(0.0, 0.5))
    return Piece(Look(canvas.picture(), _WHITE), 0.21, 0.297, artist.between(1.2, 1.6), 0.005)


def _strip(artist: Artist, upright: bool, size_m: tuple[float, float], bottom_m: float) -> Piece:
    """A pipe, a duct or a rail: a long thing with a light middle."""
    body = artist.pick((artist.grey(0.5, 0.95), artist.paint(), artist.metal(), artist.wood()))
    canvas = Canvas(8, 8, body)
    edges = ((0.0, 0.0, 0.25, 1.0), (0.75, 0.0, 1.0, 1.0))
    if not upright:
        edges = ((0.0, 0.0, 1.0, 0.25), (0.0, 0.75, 1.0, 1.0))
    for edge in edges:
        canvas.scale(*edge, 0.7)
    return Piece(Look(canvas.picture(), tint(body, 0.7)), *size_m, bottom_m, artist.between(0.02, 0.06))


def _pipe(artist: Artist) -> Piece:
    return _strip(artist, True, (artist.between(0.04, 0.1), 2.3), 0.0)


def _duct(artist: Artist) -> Piece:
    return _strip(artist, False, (artist.between(1.0, 2.2), artist.between(0.04, 0.08)), 0.35)


def _rail(artist: Artist) -> Piece:
    return _strip(
        artist, False, (artist.between(1.0, 2.2), artist.between(0.03, 0.07)), artist.between(1.9, 2.1)
    )


def _shelf(artist: Artist) -> Piece:
    wood = artist.varnish()
    canvas = Canvas(64, 32, wood, 2.5)
    canvas.rgb -= 2.0
    ground = canvas.ground()
    x = 0.04
    while x < 0.9:
        wide = artist.between(0.03, 0.09)
        canvas.rect(x, artist.between(0.0, 0.4), x + wide, 0.88, artist.accent())
        x += wide + (artist.between(0.1, 0.3) if artist.chance(0.15) else 0.005)
    canvas.rect(0.0, 0.86, 1.0, 1.0, wood)
    outline = canvas.painted_on(ground)
    canvas.keep(outline)
    canvas.rgb[~outline] = canvas.rgb[outline].mean(axis=0)
    return Piece(Look(canvas.picture(), wood, cut_out=True), 0.75, 0.3, artist.between(1.2, 1.6), 0.2)


_THINGS: dict[str, Callable[[Artist], Piece]] = {
    "clock": _clock,
    "switch": _switch,
    "socket": _socket,
    "alarm": _alarm,
    "grille": _grille,
    "note": _note,
    "pipe": _pipe,
    "duct": _duct,
    "rail": _rail,
    "shelf": _shelf,
    **oddments.THINGS,
}
