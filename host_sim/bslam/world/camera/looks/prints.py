"""What is printed: posters, signs, and lines that look like text."""

from __future__ import annotations

import math
from collections.abc import Callable

from bslam.world.camera.looks.canvas import Canvas, Colour, hsv, mix, tint
from bslam.world.camera.looks.look import Look
from bslam.world.camera.looks.style import Artist

_POSTER_ASPECT = 0.59 / 0.84
_WHITE: Colour = (0.96, 0.96, 0.95)


def text(
    canvas: Canvas,
    artist: Artist,
    box: tuple[float, float, float, float],
    pitch: float,
    colour: Colour,
) -> None:
    """Lines of words in a box (left, top, right, bottom), so far apart."""
    left, top, right, bottom = box
    y = top
    while y + 0.6 * pitch <= bottom:
        x = left
        end = right - (artist.between(0.0, 0.6) * (right - left) if artist.chance(0.25) else 0.0)
        while x < end:
            word = artist.between(0.05, 0.16) * (right - left)
            canvas.rect(x, y, min(x + word, end), y + 0.55 * pitch, colour, 0.8)
            x += word + 0.03 * (right - left)
        y += pitch


def scribble(canvas: Canvas, artist: Artist, count: int) -> None:
    """So many marks of any shape and colour, anywhere."""
    for _ in range(count):
        ink = artist.pick((artist.accent(), artist.accent(), _WHITE, artist.grey(0.0, 0.4)))
        wide, tall = artist.between(0.04, 0.45), artist.between(0.04, 0.45)
        x, y = artist.between(0.0, 1.0), artist.between(0.0, 1.0)
        box = (max(0.0, x - wide), max(0.0, y - tall), min(1.0, x + wide), min(1.0, y + tall))
        kind = artist.random.random()
        if kind < 0.3:
            canvas.rect(*box, ink, artist.between(0.5, 1.0))
        elif kind < 0.5:
            canvas.ellipse(x, y, wide, tall, ink, artist.between(0.5, 1.0))
        elif kind < 0.65:
            canvas.line((x, y), (artist.between(0.0, 1.0), artist.between(0.0, 1.0)), 0.2 * wide, ink)
        elif kind < 0.8:
            text(canvas, artist, box, artist.between(0.03, 0.15), ink)
        elif kind < 0.9:
            _photo_in(canvas, artist, *box)
        else:
            canvas.polygon(_regular(canvas, x, y, wide, artist.count(3, 6), artist.between(0.0, 6.3)), ink)


def poster(artist: Artist) -> Look:
    ground = artist.pick((_WHITE, artist.accent(), artist.accent(), artist.grey(0.85, 1.0)))
    canvas = Canvas(128, 128, ground, _POSTER_ASPECT)
    _POSTERS[artist.pick(artist.style.posters)](canvas, artist)
    if artist.chance(0.45):
        edge = artist.pick((_WHITE, artist.wood(), (0.08, 0.08, 0.08), artist.metal()))
        canvas.frame(0.0, 0.0, 1.0, 1.0, artist.between(0.015, 0.06), edge)
    canvas.grain(artist.random, 0.02, 4, 4)
    return Look(canvas.picture(), artist.pick((_WHITE, (0.2, 0.2, 0.2))))


def _photo_in(canvas: Canvas, artist: Artist, left: float, top: float, right: float, bottom: float) -> None:
    """Something like a photograph: a horizon, and blobs of all sizes."""
    sky, land = artist.accent(), artist.accent()
    horizon = top + artist.between(0.3, 0.7) * (bottom - top)
    canvas.rect(left, top, right, horizon, mix(sky, _WHITE, 0.4))
    canvas.rect(left, horizon, right, bottom, tint(land, 0.8))
    for _ in range(artist.count(4, 14)):
        wide = artist.between(0.03, 0.22) * (right - left)
        tall = min(wide * artist.between(0.4, 1.6) * canvas.aspect, 0.4 * (bottom - top))
        x, y = artist.between(left + wide, right - wide), artist.between(top + tall, bottom - tall)
        canvas.ellipse(x, y, wide, tall, artist.accent(), artist.between(0.4, 1.0))


def _fields(canvas: Canvas, artist: Artist) -> None:
    across = artist.chance(0.5)
    at = 0.0
    while at < 1.0:
        step = artist.between(0.12, 0.45)
        box = (at, 0.0, min(1.0, at + step), 1.0) if across else (0.0, at, 1.0, min(1.0, at + step))
        canvas.rect(*box, artist.accent())
        at += step
    if artist.chance(0.5):
        text(canvas, artist, (0.15, 0.75, 0.85, 0.92), 0.06, artist.pick((_WHITE, (0.1, 0.1, 0.1))))


def _article(canvas: Canvas, artist: Artist) -> None:
    canvas.rect(0.0, 0.0, 1.0, artist.between(0.1, 0.22), artist.accent())
    text(canvas, artist, (0.08, 0.04, 0.9, 0.12), 0.07, artist.pick((_WHITE, (0.05, 0.05, 0.1))))
    _photo_in(canvas, artist, 0.08, 0.28, 0.92, artist.between(0.5, 0.62))
    text(canvas, artist, (0.08, 0.66, 0.92, 0.95), artist.between(0.03, 0.05), artist.grey(0.05, 0.35))


def _photo(canvas: Canvas, artist: Artist) -> None:
    _photo_in(canvas, artist, 0.0, 0.0, 1.0, 1.0)
    canvas.grain(artist.random, artist.between(0.08, 0.25), artist.count(3, 12), artist.count(4, 16), 0.5)


def _shapes(canvas: Canvas, artist: Artist) -> None:
    for _ in range(artist.count(2, 7)):
        x, y, size = artist.between(0.15, 0.85), artist.between(0.15, 0.85), artist.between(0.08, 0.35)
        if artist.chance(0.5):
            canvas.circle(x, y, size, artist.accent())
        else:
            turn = artist.between(0.0, math.tau)
            sides = artist.count(3, 5)
            canvas.polygon(_regular(canvas, x, y, size, sides, turn), artist.accent())


def _grid(canvas: Canvas, artist: Artist) -> None:
    columns, rows = artist.count(2, 4), artist.count(2, 5)
    gap = artist.between(0.01, 0.05)
    for column in range(columns):
        for row in range(rows):
            left, top = column / columns + gap, 0.12 + 0.88 * row / rows + gap
            right, bottom = (column + 1) / columns - gap, 0.12 + 0.88 * (row + 1) / rows - gap
            canvas.rect(left, top, right, bottom, artist.accent())


def _headline(canvas: Canvas, artist: Artist) -> None:
    canvas.gradient(artist.accent(), artist.accent(), artist.chance(0.3))
    ink = artist.pick((_WHITE, (0.05, 0.05, 0.08), artist.accent()))
    text(canvas, artist, (0.08, 0.08, 0.92, 0.36), artist.between(0.12, 0.17), ink)
    if artist.chance(0.6):
        canvas.circle(artist.between(0.3, 0.7), 0.62, artist.between(0.15, 0.3), artist.accent())
    text(canvas, artist, (0.1, 0.86, 0.9, 0.96), 0.04, ink)


def _stripes(canvas: Canvas, artist: Artist) -> None:
    inks = [artist.accent() for _ in range(artist.count(2, 4))]
    count = artist.count(5, 16)
    for i in range(count):
        canvas.rect(0.0, i / count, 1.0, (i + 1) / count, inks[i % len(inks)])
    canvas.rect(0.2, 0.3, 0.8, 0.6, artist.pick((_WHITE, artist.accent())))
    text(canvas, artist, (0.25, 0.34, 0.75, 0.56), 0.07, artist.grey(0.0, 0.3))


def _columns(canvas: Canvas, artist: Artist) -> None:
    canvas.rect(0.0, 0.0, 1.0, 0.08, artist.accent())
    canvas.rect(0.0, 0.9, 1.0, 1.0, artist.accent())
    ink = artist.grey(0.0, 0.35)
    count = artist.count(2, 3)
    for column in range(count):
        left, right = column / count + 0.03, (column + 1) / count - 0.03
        split = artist.between(0.3, 0.6)
        text(canvas, artist, (left, 0.13, right, split), 0.035, ink)
        canvas.rect(left, split + 0.02, right, split + 0.2, artist.accent())
        text(canvas, artist, (left, split + 0.24, right, 0.87), 0.035, ink)


def _diagonal(canvas: Canvas, artist: Artist) -> None:
    for _ in range(artist.count(2, 5)):
        a, b, c = artist.between(-0.2, 1.0), artist.between(-0.2, 1.0), artist.between(0.08, 0.4)
        canvas.polygon([(0.0, a), (1.0, b), (1.0, b + c), (0.0, a + c)], artist.accent())
    if artist.chance(0.6):
        text(canvas, artist, (0.1, 0.1, 0.7, 0.3), 0.09, artist.pick((_WHITE, (0.1, 0.1, 0.1))))


def _rings(canvas: Canvas, artist: Artist) -> None:
    for _ in range(artist.count(1, 4)):
        x, y, radius = artist.between(0.2, 0.8), artist.between(0.2, 0.8), artist.between(0.15, 0.5)
        for share in (1.0, 0.75, 0.5, 0.25)[: artist.count(1, 4)]:
            canvas.circle(x, y, radius * share, artist.accent())


def _map(canvas: Canvas, artist: Artist) -> None:
    land = hsv(artist.hue(), 0.25, 0.9)
    canvas.rect(0.0, 0.0, 1.0, 1.0, land)
    canvas.grain(artist.random, 0.12, 6, 8, 0.6)
    for _ in range(artist.count(4, 9)):
        start = (artist.between(0.0, 1.0), 0.0 if artist.chance(0.5) else 1.0)
        end = (0.0 if artist.chance(0.5) else 1.0, artist.between(0.0, 1.0))
        canvas.line(start, end, artist.between(0.01, 0.04), artist.accent())
    canvas.rect(0.55, 0.8, 0.97, 0.97, _WHITE)
    text(canvas, artist, (0.6, 0.83, 0.95, 0.95), 0.035, (0.1, 0.1, 0.1))


def _mosaic(canvas: Canvas, artist: Artist) -> None:
    inks = [artist.accent() for _ in range(artist.count(3, 5))]
    columns, rows = artist.count(3, 7), artist.count(4, 10)
    for column in range(columns):
        for row in range(rows):
            box = (column / columns, row / rows, (column + 1) / columns, (row + 1) / rows)
            canvas.rect(*box, artist.pick(inks))


def _medley(canvas: Canvas, artist: Artist) -> None:
    if artist.chance(0.3):
        canvas.gradient(artist.accent(), artist.accent(), artist.chance(0.5))
    scribble(canvas, artist, artist.count(3, 12))
    if artist.chance(0.3):
        canvas.grain(artist.random, artist.between(0.05, 0.3), artist.count(3, 20), artist.count(3, 20), 0.5)


def _faded(canvas: Canvas, artist: Artist) -> None:
    """Few pale inks on a pale ground: a drawing, a plan, or what the sun has left of anything else."""
    ground = mix(
        hsv(artist.hue(), artist.between(0.0, 0.4), 1.0), artist.grey(0.6, 1.0), artist.between(0, 1)
    )
    if artist.chance(0.5):
        canvas.rect(0.0, 0.0, 1.0, 1.0, ground)
    if artist.chance(0.5):
        canvas.grain(artist.random, artist.between(0.03, 0.2), artist.count(2, 16), artist.count(2, 16), 0.6)
    scribble(canvas, artist, artist.count(0, 6))
    for _ in range(artist.count(0, 6)):
        ends = [(artist.between(0.0, 1.0), artist.between(0.0, 1.0)) for _ in range(2)]
        canvas.line(ends[0], ends[1], artist.between(0.005, 0.05), artist.accent())
    canvas.rect(0.0, 0.0, 1.0, 1.0, ground, artist.between(0.1, 0.7))
    if artist.chance(0.3):
        left, top = artist.between(0.0, 0.6), artist.between(0.0, 0.8)
        box = (left, top, artist.between(left + 0.1, 1.0), artist.between(top + 0.05, 1.0))
        text(canvas, artist, box, artist.between(0.03, 0.1), artist.accent())


_POSTERS: dict[str, Callable[[Canvas, Artist], None]] = {
    "fields": _fields,
    "article": _article,
    "photo": _photo,
    "shapes": _shapes,
    "grid": _grid,
    "headline": _headline,
    "stripes": _stripes,
    "columns": _columns,
    "diagonal": _diagonal,
    "rings": _rings,
    "map": _map,
    "mosaic": _mosaic,
    "medley": _medley,
    "faded": _faded,
}

_GREEN, _BLUE, _YELLOW, _RED = (0.0, 0.33, 0.16), (0.0, 0.38, 0.72), (0.98, 0.8, 0.0), (0.8, 0.05, 0.08)


def _near(artist: Artist, colour: Colour) -> Colour:
    """As some other printer makes it, or after years of sun."""
    shifted = [one + artist.between(-0.07, 0.07) for one in colour]
    faded = mix((shifted[0], shifted[1], shifted[2]), _WHITE, artist.between(0.0, 0.12))
    return tuple(min(1.0, max(0.0, one)) for one in faded)  # type: ignore[return-value]


def sign(artist: Artist) -> Look:
    canvas = Canvas(64, 64, _WHITE)
    _SIGNS[artist.pick(artist.style.signs)](canvas, artist)
    if artist.chance(0.3):
        canvas.frame(0.0, 0.0, 1.0, 1.0, artist.between(0.03, 0.07), _near(artist, _WHITE))
    return Look(canvas.picture(), artist.grey(0.5, 0.95))


def _plate(canvas: Canvas, artist: Artist, *colours: Colour) -> None:
    canvas.rect(0.0, 0.0, 1.0, 1.0, _near(artist, artist.pick(colours)))


def _arrow(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _GREEN, _BLUE, _RED)
    side = 1.0 if artist.chance(0.5) else -1.0
    canvas.rect(0.25, 0.42, 0.75, 0.58, _WHITE)
    tip = 0.5 + 0.38 * side
    canvas.polygon([(tip, 0.5), (0.5 + 0.1 * side, 0.22), (0.5 + 0.1 * side, 0.78)], _WHITE)


def _runner(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _GREEN, _GREEN, _BLUE)
    canvas.rect(0.6, 0.15, 0.9, 0.85, _WHITE)
    canvas.circle(0.36, 0.22, 0.08, _WHITE)
    for start, end in (((0.36, 0.3), (0.3, 0.58)), ((0.3, 0.58), (0.45, 0.85)), ((0.3, 0.58), (0.1, 0.7))):
        canvas.line(start, end, 0.1, _WHITE)
    canvas.line((0.35, 0.36), (0.55, 0.5), 0.07, _WHITE)
    canvas.line((0.35, 0.36), (0.14, 0.46), 0.07, _WHITE)


def _ring(canvas: Canvas, artist: Artist) -> None:
    rim = _near(artist, artist.pick((_RED, _BLUE)))
    canvas.circle(0.5, 0.5, 0.46, rim)
    canvas.circle(0.5, 0.5, 0.34, artist.pick((_WHITE, _near(artist, _BLUE), _WHITE)))
    ink = (0.05, 0.05, 0.05)
    canvas.rect(0.44, artist.between(0.28, 0.36), 0.56, 0.72, ink)
    canvas.rect(0.34, 0.44, artist.between(0.55, 0.68), 0.54, ink)
    if artist.chance(0.5):
        canvas.line((0.22, 0.22), (0.78, 0.78), 0.09, rim)


def _triangle(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _WHITE, _YELLOW)
    canvas.polygon([(0.5, 0.06), (0.96, 0.9), (0.04, 0.9)], (0.05, 0.05, 0.05))
    canvas.polygon([(0.5, 0.18), (0.86, 0.84), (0.14, 0.84)], _near(artist, _YELLOW))
    canvas.polygon(
        [(0.55, 0.32), (0.42, 0.58), (0.5, 0.58), (0.45, 0.8), (0.6, 0.52), (0.52, 0.52)], (0, 0, 0)
    )


def _flame(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _RED)
    canvas.ellipse(0.66, 0.66, 0.18, 0.22, _WHITE)
    canvas.polygon([(0.5, 0.6), (0.62, 0.15), (0.84, 0.62)], _WHITE)
    canvas.rect(0.18, 0.35, 0.36, 0.88, _WHITE)
    canvas.rect(0.23, 0.2, 0.31, 0.36, _WHITE)


def _text_sign(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _BLUE, _GREEN, _YELLOW, _RED)
    text(canvas, artist, (0.12, 0.2, 0.88, 0.8), artist.between(0.16, 0.24), _WHITE)


def _exit(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _GREEN)
    canvas.rect(0.12, 0.14, 0.4, 0.86, _WHITE)
    canvas.rect(0.18, 0.2, 0.4, 0.86, _near(artist, _GREEN))
    canvas.rect(0.45, 0.45, 0.7, 0.57, _WHITE)
    canvas.polygon([(0.92, 0.51), (0.68, 0.3), (0.68, 0.72)], _WHITE)


def _cross(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _GREEN, _BLUE, _RED)
    thick = artist.between(0.1, 0.14)
    canvas.rect(0.5 - thick, 0.15, 0.5 + thick, 0.85, _WHITE)
    canvas.rect(0.15, 0.5 - thick, 0.85, 0.5 + thick, _WHITE)


def _diamond(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _WHITE, _YELLOW)
    canvas.polygon([(0.5, 0.04), (0.96, 0.5), (0.5, 0.96), (0.04, 0.5)], (0.04, 0.04, 0.04))
    canvas.polygon(
        [(0.5, 0.12), (0.88, 0.5), (0.5, 0.88), (0.12, 0.5)],
        _near(artist, artist.pick((_YELLOW, _RED, _BLUE))),
    )
    canvas.circle(0.5, 0.5, artist.between(0.08, 0.16), (0.03, 0.03, 0.03))


def _extinguisher_sign(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _RED)
    canvas.rect(0.4, 0.34, 0.66, 0.88, _WHITE)
    canvas.rect(0.47, 0.2, 0.59, 0.36, _WHITE)
    canvas.line((0.5, 0.2), (0.24, 0.28), 0.07, _WHITE)
    canvas.line((0.24, 0.28), (0.24, 0.6), 0.07, _WHITE)


def _number(canvas: Canvas, artist: Artist) -> None:
    _plate(canvas, artist, _BLUE, _YELLOW, _GREEN)
    ink = artist.pick((_WHITE, (0.05, 0.05, 0.05)))
    for left in (0.2, 0.55):
        canvas.frame(left, 0.22, left + 0.25, 0.78, 0.07, ink)
        if artist.chance(0.5):
            canvas.rect(left, 0.47, left + 0.25, 0.54, ink)


def _glyph(canvas: Canvas, artist: Artist) -> None:
    """Marks of one ink on a plate of another."""
    plates = (_GREEN, _BLUE, _YELLOW, _RED, _WHITE, artist.accent())
    _plate(canvas, artist, *plates)
    ink = artist.pick((_WHITE, _WHITE, (0.05, 0.05, 0.05), _near(artist, artist.pick(plates))))
    for _ in range(artist.count(1, 5)):
        wide, tall = artist.between(0.06, 0.35), artist.between(0.06, 0.35)
        x, y = artist.between(0.1 + wide, 0.9 - wide), artist.between(0.1 + tall, 0.9 - tall)
        kind = artist.random.random()
        if kind < 0.4:
            canvas.rect(x - wide, y - tall, x + wide, y + tall, ink)
        elif kind < 0.7:
            canvas.ellipse(x, y, wide, tall, ink)
        else:
            canvas.polygon([(x - wide, y - tall), (x + wide, y), (x - wide, y + tall)], ink)
    if artist.chance(0.3):
        canvas.frame(0.0, 0.0, 1.0, 1.0, artist.between(0.05, 0.14), ink)


_SIGNS: dict[str, Callable[[Canvas, Artist], None]] = {
    "arrow": _arrow,
    "runner": _runner,
    "ring": _ring,
    "triangle": _triangle,
    "flame": _flame,
    "text": _text_sign,
    "exit": _exit,
    "cross": _cross,
    "diamond": _diamond,
    "extinguisher": _extinguisher_sign,
    "number": _number,
    "glyph": _glyph,
}


def _regular(
    canvas: Canvas, x: float, y: float, radius: float, sides: int, turn_rad: float
) -> list[tuple[float, float]]:
    angles = [turn_rad + math.tau * i / sides for i in range(sides)]
    return [(x + radius * math.cos(a), y + radius * canvas.aspect * math.sin(a)) for a in angles]
