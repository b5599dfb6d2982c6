"""What moves about: people, and boxes on wheels."""

from __future__ import annotations

from bslam.world.camera.looks.canvas import Canvas, Colour, hsv, tint
from bslam.world.camera.looks.furniture import cut_out
from bslam.world.camera.looks.piece import Piece
from bslam.world.camera.looks.style import Artist

_HEIGHT_M = (1.55, 1.9)
_TYRE: Colour = (0.06, 0.06, 0.07)


def person(artist: Artist, width_m: float) -> Piece:
    """Somebody who stands upright, so wide at the elbows."""
    height_m = artist.between(*_HEIGHT_M)
    return Piece(cut_out(artist, _person, width_m, height_m), width_m, height_m)


def trolley(artist: Artist, width_m: float, height_m: float) -> Piece:
    """A box on wheels."""
    return Piece(cut_out(artist, _trolley, width_m, height_m), width_m, height_m)


def _person(canvas: Canvas, artist: Artist) -> None:
    skin = hsv(artist.between(0.03, 0.09), artist.between(0.25, 0.7), artist.between(0.3, 0.95))
    hair = artist.pick(
        (artist.grey(0.05, 0.8), hsv(0.08, artist.between(0.4, 0.8), artist.between(0.1, 0.6)))
    )
    coat, trousers = artist.accent(), artist.pick((artist.grey(0.08, 0.5), artist.accent()))
    for left in (0.27, 0.53):  # legs and shoes
        canvas.rect(left, 0.5, left + 0.2, 0.96, trousers)
        canvas.rect(left - 0.03, 0.95, left + 0.2, 1.0, artist.grey(0.03, 0.25))
    hem = artist.between(0.5, 0.66)
    canvas.polygon([(0.28, 0.17), (0.72, 0.17), (0.76, hem), (0.24, hem)], coat)
    sleeve = tint(coat, artist.between(0.75, 0.95))
    for shoulder, hand in ((0.25, 0.09), (0.75, 0.91)):
        canvas.line((shoulder, 0.2), (hand, 0.47), 0.16, sleeve)
        canvas.circle(hand, 0.5, 0.07, skin)
    canvas.rect(0.43, 0.12, 0.57, 0.18, skin)
    _head(canvas, artist, skin, hair)


def _head(canvas: Canvas, artist: Artist, skin: Colour, hair: Colour) -> None:
    """From the front or from behind."""
    canvas.ellipse(0.5, 0.075, 0.17, 0.075, hair)
    if artist.chance(0.5):
        canvas.ellipse(0.5, 0.09, 0.13, 0.055, skin)
        for x in (0.44, 0.56):
            canvas.circle(x, 0.085, 0.018, _TYRE)


def _trolley(canvas: Canvas, artist: Artist) -> None:
    body = artist.pick((artist.varnish(), artist.metal(), artist.accent()))
    canvas.rect(0.0, 0.0, 1.0, 0.88, body)
    for y in (0.28, 0.57):
        canvas.rect(0.0, y, 1.0, y + 0.03, tint(body, 0.6))
    canvas.rect(0.55, 0.08, 0.9, 0.22, artist.pick((artist.accent(), tint(body, 1.3))))
    for x in (0.15, 0.85):
        canvas.circle(x, 0.93, 0.07, _TYRE)
