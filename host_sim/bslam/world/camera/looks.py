"""Skeleton looks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bslam.world.camera.scene import Picture


@dataclass(frozen=True)
class Look:
    """Pictures of a thing: its front (h, w, 4) and its sides; `cut_out`: the front's alpha is its outline.

    glow: what the front sends out where alpha is 0, as multiples of the lamps' and the sky's light.
    """

    front: Picture
    side: Picture
    cut_out: bool = False
    glow: tuple[float, float] = (0.0, 0.0)


def flat(rgb: tuple[int, int, int], width: int = 64, height: int = 64) -> Picture:
    picture = np.full((height, width, 4), 255, dtype=np.uint8)
    picture[..., :3] = rgb
    return picture


def beacon_look(kind: str, style: str, random: np.random.Generator) -> Look:
    rgb = random.integers(30, 220, 3)
    front = flat(tuple(rgb), 64, 128)
    front[:4] = front[-4:] = (20, 20, 20, 255)
    return Look(front, flat(tuple(rgb // 2)))


def wall_look(style: str, random: np.random.Generator) -> Picture:
    picture = flat(tuple(random.integers(190, 240, 3)), 64, 256)
    picture[-8:] = (80, 60, 50, 255)
    return picture


def floor_look(style: str, random: np.random.Generator) -> Picture:
    picture = flat(tuple(random.integers(90, 180, 3)), 128, 128)
    picture[:2] = picture[:, :2] = (60, 60, 60, 255)
    return picture


def ceiling_look(style: str, random: np.random.Generator) -> Picture:
    return flat((235, 235, 235), 64, 64)


def clutter_look(style: str, random: np.random.Generator) -> tuple[Look, float, float]:
    """And its width and height in m."""
    picture = flat(tuple(random.integers(20, 150, 3)), 64, 64)
    picture[40:, 16:48, 3] = 0
    return Look(picture, picture, cut_out=True), 0.5, 0.9


def wall_thing_look(style: str, random: np.random.Generator) -> tuple[Look, float, float, float]:
    """And its width, height and bottom in m."""
    return Look(flat((230, 230, 230)), flat((200, 200, 200))), 0.08, 0.08, 1.1
