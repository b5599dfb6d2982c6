"""How things look: textures painted by numpy, in endless variety, from a style and random numbers."""

from bslam.world.camera.looks.fittings import door, extinguisher, radiator, window
from bslam.world.camera.looks.furniture import cabinet, clutter, wall_thing
from bslam.world.camera.looks.look import Look
from bslam.world.camera.looks.people import person, trolley
from bslam.world.camera.looks.piece import Piece
from bslam.world.camera.looks.prints import poster, sign
from bslam.world.camera.looks.style import STYLES, Artist, style_of
from bslam.world.camera.looks.surfaces import ceiling, floor, lamp, wall, wall_style

BEACONS = {
    "extinguisher": extinguisher,
    "radiator": radiator,
    "door": door,
    "window": window,
    "poster": poster,
    "sign": sign,
    "cabinet": cabinet,
}
"""Kind of beacon -> its painter."""

__all__ = [
    "BEACONS",
    "STYLES",
    "Artist",
    "Look",
    "Piece",
    "ceiling",
    "clutter",
    "floor",
    "lamp",
    "person",
    "style_of",
    "trolley",
    "wall",
    "wall_style",
    "wall_thing",
]
