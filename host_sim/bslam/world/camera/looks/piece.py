"""A thing that is no beacon."""

from __future__ import annotations

from dataclasses import dataclass

from bslam.world.camera.looks.look import Look


@dataclass(frozen=True)
class Piece:
    """Something that is no beacon; bottom_m: how high it hangs, out_m: how far it stands out."""

    look: Look
    width_m: float
    height_m: float
    bottom_m: float = 0.0
    out_m: float = 0.02
