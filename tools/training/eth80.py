"""ETH-80, photographs of real objects from all sides, and drives on which they are the beacons' looks.

The archive holds <object>-<degrees from above>-<degrees round>.png, 64x64 RGBA, transparent round the object.
"""

from __future__ import annotations

import functools
import io
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from bslam.core.learner import flash_seeds
from bslam.core.vision import FrontEnd
from bslam.errors import BslamError
from bslam.experiment.datasets import data_root
from bslam.experiment.sources import ScenarioSource
from bslam.experiment.truth import truth_at
from bslam.log import Beacons, Log, Sightings
from bslam.rig import load_rig
from training.detector_samples import blank_detector, model_of

ARCHIVE = Path("eth80/eth80_half_64px_rgba.tar")
WALL_GREY = 166
HEIGHT_M = 0.8  # of a photograph, as a poster hangs
SIDE_PX = (32, 70)  # of a photograph in a frame: the least that mostly has a signature, the most for a cell
CELL_PX = 80
NEAR_M = 2.5  # from nearer an object is seen from above
SHAKE = 0.04  # how far a detector's box is off, each side, of its size
GAIN_SD, TINT_SD, NOISE = 0.12, 0.03, 4.0  # light of a frame, of its colours, and of each value, of 255
FIRST_FRAMES = 10  # in which the front end gets to know the wall

View = tuple[str, int, int]
Picture = NDArray[np.uint8]


def read_photographs(archive: Path) -> dict[View, Picture]:
    """The photographs (64, 64, 4) by object, degrees from above and degrees round."""
    views: dict[View, Picture] = {}
    with tarfile.open(archive) as files:
        for member in files.getmembers():
            file = files.extractfile(member)
            if file is not None and member.name.endswith(".png"):
                name, polar, azimuth = Path(member.name).stem.rsplit("-", 2)
                views[name, int(polar), int(azimuth)] = np.array(Image.open(io.BytesIO(file.read())))
    return views


def archive_path() -> Path:
    """Where the archive is. BslamError if it is not at hand."""
    root = data_root()
    if root is None or not (root / ARCHIVE).is_file():
        raise BslamError(f"{ARCHIVE}: not at hand; allowed: a folder that holds it, named by BSLAM_DATA")
    return root / ARCHIVE


@dataclass(frozen=True)
class PhotographedSource(ScenarioSource):
    """A simulated drive whose beacons look like ETH-80's objects, one each; those beyond are not there.

    Every sighting has a picture of its own: the photograph from the side it is seen from, as large as it
    appears, in that frame's light, with noise and a shaken box, through the C front end.
    """

    def load(self) -> Log:
        log = super().load()
        views = _views(archive_path())
        objects = sorted({name for name, _, _ in views})
        there = log.beacons
        assert there is not None
        names = dict(zip(there.beacon_id.tolist(), objects, strict=False))
        log = _only(log, np.array(list(names)))
        signatures = _signatures(self.scenario, self.seed, log, names)
        seen = replace(log.sightings, signature=signatures)
        return replace(log, sightings=seen, seeds=flash_seeds())


def _only(log: Log, beacon_id: NDArray[np.int64]) -> Log:
    """The log without other beacons."""
    there, seen = log.beacons, log.sightings
    assert there is not None
    kept, rows = np.isin(there.beacon_id, beacon_id), np.isin(seen.beacon_id, beacon_id)
    beacons = Beacons(there.beacon_id[kept], there.x_m[kept], there.y_m[kept])
    sightings = Sightings(
        time_us=seen.time_us[rows],
        beacon_id=seen.beacon_id[rows],
        bearing_rad=seen.bearing_rad[rows],
        range_m=seen.range_m[rows],
        mappable=seen.mappable[rows],
    )
    return replace(log, beacons=beacons, sightings=sightings)


_DRAWN: dict[tuple[str, int], NDArray[np.float32]] = {}


def _signatures(scenario: str, seed: int, log: Log, names: dict[int, str]) -> NDArray[np.float32]:
    """Signatures (m, 71) of a log's sightings; wheel noise changes none, so they are made once a drive."""
    if (scenario, seed) not in _DRAWN:
        photographer = Photographer(_views(archive_path()), np.random.default_rng([seed, 80]))
        rows = list(photographer.take(_asked(log, names)))
        _DRAWN[scenario, seed] = np.array(rows, np.float32)
    return _DRAWN[scenario, seed]


def _asked(log: Log, names: dict[int, str]) -> list[tuple[str, float, float]]:
    """Of each sighting the object, from which side it is seen, degrees, and from how far, m."""
    there, seen, truth = log.beacons, log.sightings, log.truth
    assert there is not None and truth is not None
    at = np.searchsorted(there.beacon_id, seen.beacon_id)
    poses = truth_at(truth, seen.time_us)[0]
    away_m = poses[:, :2] - np.stack([there.x_m, there.y_m], axis=1)[at]
    side_deg = np.degrees(np.arctan2(away_m[:, 1], away_m[:, 0]))
    range_m = np.hypot(*away_m.T)
    objects = [names[one] for one in seen.beacon_id.tolist()]
    return list(zip(objects, side_deg.tolist(), range_m.tolist(), strict=True))


@functools.cache
def _views(archive: Path) -> dict[View, Picture]:
    return read_photographs(archive)


class Photographer:
    """Puts photographs on a wall, a dozen to a frame, and has the front end look at them."""

    def __init__(self, views: dict[View, Picture], random: np.random.Generator) -> None:
        self._views, self._random = views, random
        self._directions = sorted({(polar, azimuth) for _, polar, azimuth in views})
        camera = load_rig("three60").cameras[1]
        self._size_px = (camera.lens.height_px, camera.lens.width_px)
        self._focal_px = camera.lens.fx_px
        self._front_end = FrontEnd([camera], model_of(blank_detector()))
        for _ in range(FIRST_FRAMES):
            self._front_end.see(self._light(self._wall()))

    def take(self, asked: list[tuple[str, float, float]]) -> Iterator[NDArray[np.float32]]:
        """Signatures (71,) of objects seen from a side, degrees, and a distance, m."""
        rows, columns = (side // CELL_PX for side in self._size_px)
        cells = [(CELL_PX * row, CELL_PX * column) for row in range(rows) for column in range(columns)]
        for first in range(0, len(asked), len(cells)):
            frame, boxes = self._wall(), []
            for (name, side_deg, range_m), corner in zip(asked[first:], cells, strict=False):
                boxes.append(self._put(frame, corner, self._nearest(name, side_deg, range_m), range_m))
            self._front_end.see(self._light(frame))
            for box in boxes:
                signature = self._front_end.signature(box)
                yield np.zeros(71, np.float32) if signature is None else signature

    def _nearest(self, name: str, side_deg: float, range_m: float) -> Picture:
        """The photograph from the nearest direction."""
        wanted = np.array([[68.0 if range_m < NEAR_M else 90.0, side_deg]])
        polar, azimuth = np.radians(np.concatenate([wanted, np.array(self._directions)])).T
        z, x, y = np.cos(polar), np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
        nearest = int((x[1:] * x[0] + y[1:] * y[0] + z[1:] * z[0]).argmax())
        return self._views[name, *self._directions[nearest]]

    def _wall(self) -> Picture:
        return np.full((*self._size_px, 3), WALL_GREY, np.uint8)

    def _put(
        self, frame: Picture, corner: tuple[int, int], photograph: Picture, range_m: float
    ) -> tuple[float, float, float, float]:
        """Puts a photograph into a cell, as large as it appears; returns its box, shaken."""
        side_px = int(np.clip(self._focal_px * HEIGHT_M / range_m, *SIDE_PX))
        small = np.array(Image.fromarray(photograph).resize((side_px, side_px), Image.Resampling.BOX))
        inside = small[..., 3] > 127
        top, left = (one + (CELL_PX - side_px) // 2 for one in corner)
        frame[top : top + side_px, left : left + side_px][inside] = small[..., :3][inside]
        rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
        shake = SHAKE * side_px * self._random.standard_normal(4)
        return (
            left + columns[0] - 0.5 + shake[0],
            top + rows[0] - 0.5 + shake[1],
            left + columns[-1] + 0.5 + shake[2],
            top + rows[-1] + 0.5 + shake[3],
        )

    def _light(self, frame: Picture) -> Picture:
        """The frame in a light of its own, with noise."""
        gain = np.exp(GAIN_SD * self._random.standard_normal() + TINT_SD * self._random.standard_normal(3))
        noise = NOISE * self._random.standard_normal(frame.shape, dtype=np.float32)
        lit: Picture = np.clip(frame * gain.astype(np.float32) + noise, 0, 255).astype(np.uint8)
        return lit
