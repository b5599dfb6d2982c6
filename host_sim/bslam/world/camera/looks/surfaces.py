"""Walls, floors and ceilings: textures that repeat sideways, and floors both ways."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bslam.world.camera.looks.canvas import Canvas, Colour, hsv, mix, tint
from bslam.world.camera.looks.style import Artist


@dataclass(frozen=True)
class Covering:
    """A texture and how wide it is before it repeats; a wall's is as high as the wall."""

    picture: NDArray[np.uint8]
    period_m: float


# --- Walls --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class WallStyle:
    """What the walls of a scene share: their skirting."""

    skirting: Colour | None
    skirting_m: float


def wall_style(artist: Artist) -> WallStyle:
    skirting = artist.pick(
        (artist.grey(0.85, 1.0), artist.wood(), artist.grey(0.1, 0.5), artist.wood(), None)
    )
    return WallStyle(skirting, artist.between(0.05, 0.12))


def wall(artist: Artist, style: WallStyle, height_m: float) -> Covering:
    period_m = artist.between(2.0, 3.0)
    canvas = Canvas(128, 256, artist.paint(), period_m / height_m)
    _WALLS[artist.pick(artist.style.wall_patterns)](canvas, artist)
    canvas.grain(artist.random, artist.between(0.0, 0.02), 5, 8)
    if style.skirting is not None:
        top = 1.0 - style.skirting_m / height_m
        canvas.rect(0.0, top, 1.0, 1.0, style.skirting)
        canvas.scale(0.0, top, 1.0, top + 0.004, 0.7)
    return Covering(canvas.picture(), period_m)


def _plain(canvas: Canvas, artist: Artist) -> None:
    """Paint, and nothing else."""


def _two_tone(canvas: Canvas, artist: Artist) -> None:
    top = artist.between(0.45, 0.7)
    below = mix(artist.accent(), artist.paint(), artist.between(0.3, 0.8))
    canvas.rect(0.0, top, 1.0, 1.0, below)
    if artist.chance(0.5):
        canvas.rect(0.0, top, 1.0, top + 0.012, tint(below, 0.6))


def _dado(canvas: Canvas, artist: Artist) -> None:
    wood, top, count = artist.wood(), artist.between(0.6, 0.72), artist.count(10, 20)
    canvas.rect(0.0, top, 1.0, 1.0, wood)
    for i in range(count):
        canvas.scale(i / count, top, (i + 0.12) / count, 1.0, 0.7)
    canvas.rect(0.0, top, 1.0, top + 0.02, tint(wood, 0.8))


def _bricks(
    canvas: Canvas, artist: Artist, rows: int, columns: int, brick: Colour, mortar: Colour, spread: float
) -> None:
    canvas.rect(0.0, 0.0, 1.0, 1.0, mortar)
    for row in range(rows):
        shift = 0.5 * (row % 2)
        for column in range(-1, columns):
            left = (column + shift + 0.05) / columns
            right = (column + shift + 0.97) / columns
            if right <= 0.0:
                continue
            shade = artist.between(1.0 - spread, 1.0 + spread)
            canvas.rect(
                max(0.0, left), (row + 0.08) / rows, min(1.0, right), (row + 0.95) / rows, tint(brick, shade)
            )


def _brick(canvas: Canvas, artist: Artist) -> None:
    brick = artist.pick((hsv(artist.between(0.02, 0.06), 0.5, artist.between(0.45, 0.7)), artist.paint()))
    _bricks(canvas, artist, 32, 10, brick, mix(brick, artist.grey(0.6, 0.9), 0.6), 0.12)


def _blocks(canvas: Canvas, artist: Artist) -> None:
    paint = artist.paint()
    _bricks(canvas, artist, 12, 5, paint, tint(paint, 0.85), 0.02)


def _stripes(canvas: Canvas, artist: Artist) -> None:
    count, other = artist.count(5, 16), mix(artist.paint(), artist.accent(), artist.between(0.05, 0.25))
    for i in range(count):
        canvas.rect(i / count, 0.0, (i + artist.between(0.3, 0.5)) / count, 1.0, other)


def _dots(canvas: Canvas, artist: Artist) -> None:
    count, other = artist.count(6, 12), mix(artist.paint(), artist.accent(), artist.between(0.1, 0.3))
    for row in range(count):
        for column in range(count):
            canvas.circle((column + 0.25 + 0.5 * (row % 2)) / count, (row + 0.5) / count, 0.2 / count, other)


def _rough(canvas: Canvas, artist: Artist) -> None:
    canvas.grain(artist.random, artist.between(0.02, 0.06), 100, 150)


def _material(artist: Artist) -> Colour:
    return artist.pick(
        (artist.varnish(), artist.wood(), artist.accent(), artist.paint(), artist.grey(0.2, 0.9))
    )


def _fields(canvas: Canvas, artist: Artist, top: float, bottom: float, colour: Colour) -> None:
    """A part of a wall in fields: boards, slats, battens, frames, tiles."""
    columns, rows = artist.count(1, 24), artist.pick((1, 1, 1, 2, 3, 8))
    joint, depth, spread = artist.between(0.03, 0.25), artist.between(0.1, 0.5), artist.between(0.0, 0.12)
    tall = (bottom - top) / rows
    for row in range(rows):
        for column in range(columns):
            box = (column / columns, top + row * tall, (column + 1) / columns, top + (row + 1) * tall)
            canvas.rect(*box, tint(colour, artist.between(1.0 - spread, 1.0 + spread)))
    framed = artist.chance(0.4)
    for row in range(rows):
        for column in range(columns):
            left, right = (column + joint) / columns, (column + 1 - joint) / columns
            high, low = top + (row + joint) * tall, top + (row + 1 - joint) * tall
            if framed:
                canvas.bevel(left, high, right, low, 0.1 / columns, depth)
            else:
                canvas.scale((column + 1 - joint) / columns, top, (column + 1) / columns, bottom, 1.0 - depth)


def _wainscot(canvas: Canvas, artist: Artist) -> None:
    """Panelling of any make to any height, up to the ceiling."""
    colour, top = _material(artist), artist.pick((artist.between(0.4, 0.85), artist.between(0.0, 0.4)))
    _fields(canvas, artist, top, 1.0, colour)
    if artist.chance(0.7):
        canvas.rect(0.0, top, 1.0, top + artist.between(0.01, 0.04), tint(colour, artist.between(0.6, 1.2)))


def _bands(canvas: Canvas, artist: Artist) -> None:
    """Stripes across, anywhere."""
    for _ in range(artist.count(1, 4)):
        top = artist.between(0.0, 0.95)
        canvas.rect(0.0, top, 1.0, min(1.0, top + artist.between(0.02, 0.4)), _material(artist))


def _cladding(canvas: Canvas, artist: Artist) -> None:
    """All of it in fields with joints: tiles, sheets, boards."""
    colour = _material(artist)
    canvas.rect(0.0, 0.0, 1.0, 1.0, colour)
    _fields(canvas, artist, 0.0, 1.0, colour)


def _mottled(canvas: Canvas, artist: Artist) -> None:
    """Stains of all sizes, in any colour."""
    canvas.rect(0.0, 0.0, 1.0, 1.0, mix(artist.paint(), _material(artist), artist.between(0.0, 1.0)))
    for cells in (4, 16, 60):
        canvas.grain(artist.random, artist.between(0.0, 0.1), cells, cells, artist.between(0.0, 0.6))


def _motif(canvas: Canvas, artist: Artist) -> None:
    """Paper with a print that comes again and again."""
    columns, rows, ink = artist.count(3, 9), artist.count(4, 14), mix(artist.paint(), artist.accent(), 0.4)
    for row in range(rows):
        for column in range(columns):
            x, y = (column + 0.5) / columns, (row + 0.5) / rows
            if (row + column) % 2:
                canvas.rect(x - 0.2 / columns, y - 0.3 / rows, x + 0.2 / columns, y + 0.3 / rows, ink)
            else:
                canvas.ellipse(x, y, 0.3 / columns, 0.2 / rows, ink)


_WALLS: dict[str, Callable[[Canvas, Artist], None]] = {
    "plain": _plain,
    "two_tone": _two_tone,
    "dado": _dado,
    "brick": _brick,
    "blocks": _blocks,
    "stripes": _stripes,
    "dots": _dots,
    "rough": _rough,
    "wainscot": _wainscot,
    "bands": _bands,
    "cladding": _cladding,
    "mottled": _mottled,
    "motif": _motif,
}

# --- Floors -------------------------------------------------------------------------------------------------


def floor(artist: Artist) -> Covering:
    return _FLOORS[artist.pick(artist.style.floor_patterns)](artist)


def _stone(artist: Artist) -> Colour:
    warm = hsv(artist.between(0.03, 0.15), artist.between(0.05, 0.5), artist.between(0.3, 0.85))
    return artist.pick((artist.grey(0.25, 0.85), warm, mix(artist.accent(), artist.grey(0.4, 0.7), 0.8)))


def _grid_floor(artist: Artist, count: int, spread: float, period_m: float, checker: bool) -> Covering:
    stone = _stone(artist)
    other = tint(stone, artist.between(0.35, 0.8)) if checker else stone
    joint = tint(stone, artist.between(0.5, 1.15))
    canvas = Canvas(128, 128, joint)
    gap = artist.between(0.02, 0.06)
    for row in range(count):
        for column in range(count):
            colour = tint(other if (row + column) % 2 else stone, artist.between(1.0 - spread, 1.0 + spread))
            box = (column + gap, row + gap, column + 1.0 - gap, row + 1.0 - gap)
            canvas.rect(box[0] / count, box[1] / count, box[2] / count, box[3] / count, colour)
    canvas.grain(artist.random, 0.03, 24, 24)
    return Covering(canvas.picture(), period_m)


def _tiles(artist: Artist) -> Covering:
    return _grid_floor(artist, 4, 0.05, artist.between(1.0, 2.0), False)


def _checker(artist: Artist) -> Covering:
    return _grid_floor(artist, 4, 0.03, artist.between(1.2, 2.0), True)


def _slabs(artist: Artist) -> Covering:
    return _grid_floor(artist, 2, 0.06, artist.between(1.2, 2.0), False)


def _planks(artist: Artist) -> Covering:
    wood = artist.wood()
    canvas = Canvas(128, 128, wood)
    rows = artist.count(8, 14)
    for row in range(rows):
        cut = artist.between(0.0, 1.0)
        for left, right in ((0.0, cut), (cut, 1.0)):
            canvas.rect(left, row / rows, right, (row + 1) / rows, tint(wood, artist.between(0.85, 1.15)))
        canvas.scale(0.0, row / rows, 1.0, row / rows + 0.008, 0.6)
    canvas.grain(artist.random, 0.05, 4, 64)
    return Covering(canvas.picture(), artist.between(1.2, 2.0))


def _herringbone(artist: Artist) -> Covering:
    wood = artist.wood()
    canvas = Canvas(128, 128, wood)
    count = 8
    for row in range(count):
        for column in range(count):
            x, y, step = column / count, row / count, 1.0 / count
            rising = (row + column) % 2 == 0
            colour = tint(wood, artist.between(0.8, 0.95) if rising else artist.between(1.0, 1.15))
            points = [(x, y), (x + step, y + step), (x + step, y + 2 * step), (x, y + step)]
            if not rising:
                points = [(x, y + step), (x + step, y), (x + step, y + step), (x, y + 2 * step)]
            canvas.polygon(points, colour)
    canvas.grain(artist.random, 0.05, 32, 32)
    return Covering(canvas.picture(), artist.between(1.0, 1.8))


def _speckled(artist: Artist, colour: Colour, grain: float, cells: int, hue: float) -> Covering:
    canvas = Canvas(128, 128, colour)
    canvas.grain(artist.random, grain, cells, cells, hue)
    canvas.grain(artist.random, 0.03, 5, 5)
    return Covering(canvas.picture(), artist.between(1.0, 2.0))


def _carpet(artist: Artist) -> Covering:
    colour = mix(artist.accent(), artist.grey(0.25, 0.6), artist.between(0.45, 0.95))
    return _speckled(artist, colour, artist.between(0.04, 0.12), 96, 0.15)


def _linoleum(artist: Artist) -> Covering:
    return _speckled(artist, _stone(artist), artist.between(0.02, 0.06), 40, 0.4)


def _terrazzo(artist: Artist) -> Covering:
    return _speckled(artist, _stone(artist), artist.between(0.06, 0.14), 64, 0.4)


def _patchwork(artist: Artist) -> Covering:
    """Fields of a few colours in any order: mosaics, carpet tiles, painted concrete."""
    inks = [mix(_stone(artist), artist.accent(), artist.between(0.0, 0.8)) for _ in range(artist.count(1, 4))]
    canvas = Canvas(128, 128, inks[0])
    columns, rows = artist.count(1, 16), artist.count(1, 16)
    for row in range(rows):
        for column in range(columns):
            box = (column / columns, row / rows, (column + 1) / columns, (row + 1) / rows)
            canvas.rect(*box, artist.pick(inks))
    canvas.grain(artist.random, artist.between(0.0, 0.1), artist.count(4, 64), artist.count(4, 64), 0.3)
    return Covering(canvas.picture(), artist.between(0.8, 2.4))


_FLOORS: dict[str, Callable[[Artist], Covering]] = {
    "tiles": _tiles,
    "checker": _checker,
    "slabs": _slabs,
    "planks": _planks,
    "herringbone": _herringbone,
    "carpet": _carpet,
    "linoleum": _linoleum,
    "terrazzo": _terrazzo,
    "patchwork": _patchwork,
}


def ceiling(artist: Artist) -> Covering:
    canvas = Canvas(64, 64, artist.grey(0.82, 0.98))
    if artist.chance(0.5):
        for i in range(2):
            canvas.scale(0.5 * i, 0.0, 0.5 * i + 0.02, 1.0, 0.8)
            canvas.scale(0.0, 0.5 * i, 1.0, 0.5 * i + 0.02, 0.8)
        canvas.grain(artist.random, 0.03, 40, 40)
    return Covering(canvas.picture(), 1.2)


def lamp(artist: Artist) -> NDArray[np.uint8]:
    """A luminous panel; all of it glows but its edge."""
    canvas = Canvas(32, 32, (1.0, 1.0, 1.0))
    canvas.hole(0.05, 0.05, 0.95, 0.95)
    return canvas.picture()
