"""What is no beacon and on nobody's list: things of random size, shape, colour and print.

A detector believes in what it has never been shown. No list of furniture is ever complete; these have in
common only that none is about as large as a beacon that is drawn the same way.
"""

from __future__ import annotations

import math

from bslam.world.camera.looks.canvas import Canvas, Colour, mix, tint
from bslam.world.camera.looks.look import Look
from bslam.world.camera.looks.piece import Piece
from bslam.world.camera.looks.prints import scribble, text
from bslam.world.camera.looks.style import Artist
from bslam.world.kinds import KINDS

_WHITE: Colour = (0.96, 0.96, 0.95)
_SIZE_TOLERANCE = 1.35
_REACH_M = 2.35  # nothing hangs or stands higher than that: ceilings begin at 2.4 m


def is_beacon_sized(width_m: float, height_m: float) -> bool:
    """Whether something of this size might be taken for a beacon of some kind, and rightly."""
    return any(
        kind.height_m / _SIZE_TOLERANCE < height_m < kind.height_m * _SIZE_TOLERANCE
        and kind.width_m[0] / _SIZE_TOLERANCE < width_m < kind.width_m[1] * _SIZE_TOLERANCE
        for kind in KINDS.values()
    )


def _size(artist: Artist, least_m: float, most_m: float, stretch: float) -> tuple[float, float]:
    """Width and height of no beacon; up to `stretch` times as wide as high, or as high as wide."""
    while True:
        side_m = math.exp(artist.between(math.log(least_m), math.log(most_m)))
        root = math.exp(0.5 * artist.between(-math.log(stretch), math.log(stretch)))
        width_m, height_m = side_m * root, min(side_m / root, _REACH_M)
        if not is_beacon_sized(width_m, height_m):
            return width_m, height_m


def _ground(artist: Artist) -> Colour:
    return artist.pick((_WHITE, artist.accent(), artist.accent(), artist.varnish(), artist.metal()))


def _printed(artist: Artist, width_m: float, height_m: float) -> Canvas:
    """A plate of some colour with anything on it."""
    ground = _ground(artist)
    canvas = Canvas(64, 64, ground, width_m / height_m)
    kind = artist.random.random()
    if kind < 0.35:
        scribble(canvas, artist, artist.count(1, 6))
    elif kind < 0.5:
        text(canvas, artist, (0.1, 0.1, 0.9, 0.9), artist.between(0.08, 0.25), artist.accent())
    elif kind < 0.65:
        _divide(canvas, artist, ground)
    elif kind < 0.8:
        _symbol(canvas, artist)
    if artist.chance(0.5):
        canvas.frame(0.0, 0.0, 1.0, 1.0, artist.between(0.02, 0.12), artist.pick((tint(ground, 0.7), _WHITE)))
    return canvas


def _divide(canvas: Canvas, artist: Artist, ground: Colour) -> None:
    """Fields with joints between them: lids, drawers, slots, slats."""
    columns, rows = artist.pick(((1, 1), (1, 3), (2, 1), (2, 2), (1, 8), (10, 1), (3, 4)))
    gap, joint = artist.between(0.03, 0.15), tint(ground, artist.between(0.3, 0.85))
    for column in range(columns):
        canvas.rect((column + 1 - gap) / columns, 0.0, (column + 1) / columns, 1.0, joint)
    for row in range(rows):
        canvas.rect(0.0, (row + 1 - gap) / rows, 1.0, (row + 1) / rows, joint)


def _symbol(canvas: Canvas, artist: Artist) -> None:
    """One mark in the middle."""
    ink, size = artist.pick((_WHITE, (0.05, 0.05, 0.05), artist.accent())), artist.between(0.12, 0.35)
    if artist.chance(0.5):
        canvas.ellipse(0.5, 0.5, size, size * artist.between(0.7, 1.3), ink)
    else:
        tall = size * artist.between(0.5, 1.5)
        canvas.rect(0.5 - size, 0.5 - tall, 0.5 + size, 0.5 + tall, ink)


def plate(artist: Artist) -> Piece:
    """A small thing on the wall: a switch, a call point, a thermostat, a name plate, a meter."""
    width_m, height_m = _size(artist, 0.06, 0.24, 2.5)
    canvas = _printed(artist, width_m, height_m)
    bottom_m = artist.between(0.2, _REACH_M - height_m)
    side = artist.grey(0.3, 0.9)
    return Piece(Look(canvas.picture(), side), width_m, height_m, bottom_m, artist.between(0.005, 0.1))


def board(artist: Artist) -> Piece:
    """A larger one: a notice board, a fuse box, a screen, a mirror, a wall cupboard."""
    width_m, height_m = _size(artist, 0.25, 1.6, 4.0)
    canvas = _printed(artist, width_m, height_m)
    canvas.grain(artist.random, 0.03, 4, 4)
    bottom_m = artist.between(0.0, _REACH_M - height_m)
    depth_m = artist.between(0.005, 0.05) if artist.chance(0.6) else artist.between(0.05, 0.35)
    return Piece(Look(canvas.picture(), _ground(artist)), width_m, height_m, bottom_m, depth_m)


def block(artist: Artist) -> Piece:
    """What stands at the wall: a sideboard, a copier, a pile of boxes, a freezer, a machine."""
    width_m, height_m = _size(artist, 0.35, 1.4, 3.5)
    canvas = _printed(artist, width_m, height_m)
    canvas.grain(artist.random, 0.04, 5, 5)
    side = tint(_ground(artist), artist.between(0.6, 1.0))
    return Piece(Look(canvas.picture(), side), width_m, height_m, 0.0, artist.between(0.15, 0.6))


def column(artist: Artist) -> Piece:
    """What runs up a wall: a pillar, a chase, a curtain, a stack of pipes."""
    width_m = math.exp(artist.between(math.log(0.06), math.log(2.0)))
    body = artist.pick((artist.paint(), artist.accent(), artist.varnish(), artist.metal()))
    canvas = Canvas(64, 32, body, width_m / _REACH_M)
    folds, deep = artist.count(1, 14), artist.between(0.55, 0.95)
    if artist.chance(0.7):
        for fold in range(folds):
            start = (fold + artist.between(0.3, 0.6)) / folds
            canvas.scale(start, 0.0, (fold + 0.98) / folds, 1.0, deep)
    height_m = artist.pick((_REACH_M, artist.between(2.05 * _SIZE_TOLERANCE / 1.3, _REACH_M)))
    return Piece(Look(canvas.picture(), tint(body, 0.8)), width_m, height_m, 0.0, artist.between(0.01, 0.3))


def shape(artist: Artist) -> Piece:
    """A cut-out on the wall that is no rectangle: hooks, coats, a lamp, a wreath, things on a board."""
    width_m, height_m = _size(artist, 0.12, 0.9, 4.0)
    canvas = Canvas(64, 64, (0.0, 0.0, 0.0), width_m / height_m)
    cut(canvas, artist)
    bottom_m = artist.between(0.3, _REACH_M - height_m)
    look = Look(canvas.picture(), artist.grey(0.2, 0.8), cut_out=True)
    return Piece(look, width_m, height_m, bottom_m, artist.between(0.01, 0.2))


def figure(canvas: Canvas, artist: Artist) -> None:
    """Something that stands on the floor: parts one above the other on a stem or on legs."""
    inks = [_ground(artist) for _ in range(3)]
    for x in {artist.between(0.1, 0.45), 0.5, artist.between(0.55, 0.9)}:
        if artist.chance(0.6):
            canvas.line((0.5, artist.between(0.3, 0.7)), (x, 0.98), artist.between(0.03, 0.12), inks[0])
    for _ in range(artist.count(1, 6)):
        wide, tall = artist.between(0.08, 0.48), artist.between(0.03, 0.3)
        x, y = artist.between(wide, 1.0 - wide), artist.between(tall, 0.98 - tall)
        _part(canvas, artist, (x, y, wide, tall), artist.pick(inks))
    foot = artist.between(0.15, 0.5)
    canvas.rect(0.5 - foot, artist.between(0.7, 0.97), 0.5 + foot, 1.0, inks[1])


def leaves(canvas: Canvas, artist: Artist) -> None:
    """A heap of like parts over a foot: foliage of any colour and size of leaf."""
    ink, middle = artist.accent(), artist.between(0.3, 0.5)
    wide, tall = artist.between(0.02, 0.16), artist.between(0.02, 0.12)
    for _ in range(artist.count(8, 50)):
        x, y = artist.between(0.0, 1.0), artist.between(0.0, 2.0 * middle)
        size = (x, y, wide * artist.between(0.5, 1.5), tall * artist.between(0.5, 1.5))
        _part(canvas, artist, size, tint(ink, artist.between(0.5, 1.3)))
    canvas.rect(0.47, middle, 0.53, 0.9, artist.wood())
    foot = artist.between(0.1, 0.35)
    canvas.rect(0.5 - foot, artist.between(0.7, 0.9), 0.5 + foot, 1.0, _ground(artist))


def cut(canvas: Canvas, artist: Artist) -> None:
    """Makes of an empty canvas parts of any shape, and cuts them out."""
    canvas.rgb -= 1.0
    ground = canvas.ground()
    for _ in range(artist.count(1, 7)):
        wide, tall = artist.between(0.06, 0.45), artist.between(0.06, 0.45)
        x, y = artist.between(wide, 1.0 - wide), artist.between(tall, 1.0 - tall)
        _part(canvas, artist, (x, y, wide, tall), _ground(artist))
    outline = canvas.painted_on(ground)
    canvas.keep(outline)
    canvas.rgb[~outline] = canvas.rgb[outline].mean(axis=0)


def _part(canvas: Canvas, artist: Artist, size: tuple[float, float, float, float], ink: Colour) -> None:
    x, y, wide, tall = size
    kind = artist.random.random()
    if kind < 0.4:
        canvas.ellipse(x, y, wide, tall, ink)
    elif kind < 0.75:
        canvas.rect(x - wide, y - tall, x + wide, y + tall, ink)
        if artist.chance(0.4):
            canvas.rect(x - 0.6 * wide, y - 0.5 * tall, x + 0.6 * wide, y + 0.5 * tall, mix(ink, _WHITE, 0.5))
    else:
        other = (x + wide, y + artist.between(-1, 1) * tall)
        canvas.polygon([(x - wide, y + tall), other, (x, y - tall)], ink)


THINGS = {"plate": plate, "board": board, "block": block, "column": column, "shape": shape}
"""Things on the wall or at it."""
