"""How well a scanner's signature tells objects apart: before the same wall, in other light, before another.

    .venv/bin/python -m tools.proofs.signatures ETH80.tar [--clutter PICTURES]

ETH80.tar holds pictures of objects with masks as alpha, OBJECT-ELEVATION-AZIMUTH.png. Each is put before a
wall into a frame of 320x240, in a box that is 5 % off. A linear SVM an object learns ten views, spread over
all directions, before one wall, and before three others each; the other views are tried. --clutter:
photographs stand behind, too.
"""

from __future__ import annotations

import argparse
import io
import sys
import tarfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from sklearn.svm import LinearSVC

from bslam.core.scanner import NOTHING
from bslam.core.scanner_tables import ScannerTables
from bslam.core.vision import SIGNATURE_SIZE
from bslam.datasets.pictures import SUFFIXES
from tools.checks.markdown import table
from tools.training.front_end import open_library

WIDTH, HEIGHT = 320, 240
HIGH_PX = (40.0, 130.0)
JITTER, NOISE = 0.05, 2.5
VIEWS = 10
WALL = (196, 186, 164)
LEARNED = ((235, 235, 235), (120, 150, 190), (90, 90, 95), (150, 180, 140), (190, 120, 100), (70, 60, 90))
OTHERS = ((60, 80, 150), (40, 110, 70), (150, 50, 45), (50, 50, 50), (255, 255, 250), (215, 150, 60))
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """A picture of an object (h, w, 4) uint8, cut to it, and where it is seen from."""

    name: str
    direction: Floats  # (3,)
    rgba: NDArray[np.uint8]


def read_views(path: Path) -> list[View]:
    """All of them, by name."""
    views = []
    with tarfile.open(path) as archive:
        for member in sorted(archive.getmembers(), key=lambda one: one.name):
            file = archive.extractfile(member)
            if file is not None and member.name.endswith(".png"):
                name, elevation, azimuth = Path(member.name).stem.split("-")
                rgba = np.asarray(Image.open(io.BytesIO(file.read())).convert("RGBA"))
                rows, columns = np.nonzero(rgba[..., 3] > 127)
                cut = rgba[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
                polar, turn = np.radians([float(elevation), float(azimuth)])
                at = [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)]
                views.append(View(name, np.array(at), cut))
    return views


def spread(views: Sequence[View]) -> set[int]:
    """Which ten views of one object are learned: each next one is farthest from those before."""
    directions = np.array([one.direction for one in views])
    taken = [0]
    while len(taken) < min(VIEWS, len(views)):
        taken.append(int((directions @ directions[taken].T).max(axis=1).argmin()))
    return set(taken)


class Describer:
    """Signatures of boxes, by the C core."""

    def __init__(self) -> None:
        self._library = open_library()
        self._tables = ScannerTables(self._library, NOTHING)
        self._scanner = self._library.ffi.new("bslam_scanner_t *")
        size = self._library.size_of("bslam_scanner_t")
        begun = self._library.lib.bslam_scanner_init_sized(self._scanner, *size, self._tables.model)
        self._library.ensure(begun, "the scanner refuses its model")
        self._points = self._library.ffi.new("bslam_box_points_t *")

    def describe(self, rgb: NDArray[np.uint8], box: Sequence[float]) -> NDArray[np.float32]:
        """box: left, top, right, bottom, px from the frame's own edges."""
        lib, ffi = self._library.lib, self._library.ffi
        format_ = lib.BSLAM_PIXELS_RGB888
        self._library.ensure(lib.bslam_scanner_begin(self._scanner, format_, WIDTH, HEIGHT), "a frame")
        pixels = self._library.pixels(rgb)
        for row in range(HEIGHT):
            self._library.ensure(lib.bslam_scanner_row(self._scanner, pixels + row * 3 * WIDTH), "a row")
        lib.bslam_scanner_end(self._scanner)
        its: Any = ffi.new("bslam_box_t *", [edge - 0.5 for edge in box])
        inside = ffi.cast("bslam_scanner_instance_t *", self._scanner)
        found = np.empty(SIGNATURE_SIZE, np.float32)
        lib.bslam_box_signature(
            ffi.addressof(inside, "channels"), its, self._points, self._library.floats(found)
        )
        return found


def picture(view: View, behind: Floats, light: bool, rng: np.random.Generator) -> tuple[Any, list[float]]:
    """The object before what is behind (HEIGHT, WIDTH, 3), and about the box that it is in."""
    high = np.exp(rng.uniform(*np.log(HIGH_PX)))
    scale = min(high / view.rgba.shape[0], (WIDTH - 16) / view.rgba.shape[1])
    height, width = (max(1, round(side * scale)) for side in view.rgba.shape[:2])
    small = np.asarray(Image.fromarray(view.rgba).resize((width, height), Image.Resampling.BICUBIC), float)
    left, top = rng.integers(8, WIDTH - width - 7), rng.integers(8, HEIGHT - height - 7)
    frame, alpha = behind.copy(), small[..., 3:] / 255
    part = frame[top : top + height, left : left + width]
    part[:] = part * (1 - alpha) + small[..., :3] * alpha
    if light:
        gain, warm = np.exp(rng.uniform(np.log(0.5), np.log(1.4))), np.exp(rng.uniform(-0.22, 0.22))
        frame = 255 * (frame / 255) ** rng.uniform(0.8, 1.25) * gain * np.array([warm, 1, 1 / warm])
    frame = np.clip(frame + rng.normal(0, NOISE, frame.shape), 0, 255).astype(np.uint8)
    off = rng.uniform(-JITTER, JITTER, 4) * [width, height, width, height]
    return np.ascontiguousarray(frame), list(np.array([left, top, left + width, top + height]) + off)


def wall(colour: Sequence[float], rng: np.random.Generator) -> Floats:
    """A plain wall, a little brighter to one side."""
    x, y = rng.uniform(-0.08, 0.08, 2)
    ramp = 1 + x * np.linspace(-1, 1, WIDTH) + y * np.linspace(-1, 1, HEIGHT)[:, None]
    return np.clip(np.array(colour) * ramp[..., None], 0, 255)


def clutter(files: Sequence[Path], rng: np.random.Generator) -> Floats:
    """A part of a photograph."""
    image = Image.open(files[int(rng.integers(len(files)))]).convert("RGB")
    side = rng.uniform(0.5, 1.0) * min(image.width / WIDTH, image.height / HEIGHT)
    width, height = side * WIDTH, side * HEIGHT
    left, top = rng.uniform(0, image.width - width), rng.uniform(0, image.height - height)
    cut = (left, top, left + width, top + height)
    return np.asarray(image.resize((WIDTH, HEIGHT), Image.Resampling.BILINEAR, box=cut), float)


def rows(views: Sequence[View], files: Sequence[Path], rng: np.random.Generator) -> Iterator[list[str]]:
    """What each way of training names rightly, percent."""
    describer, names = Describer(), sorted({one.name for one in views})
    by_name = [[one for one in views if one.name == name] for name in names]
    learned = [spread(its) for its in by_name]

    def signatures(chosen: bool, behinds: Sequence[Any], light: bool = False) -> tuple[Any, Any]:
        x, y = [], []
        for number, its in enumerate(by_name):
            for index, one in enumerate(its):
                if (index in learned[number]) == chosen:
                    for make in behinds:
                        x.append(describer.describe(*picture(one, make(), light, rng)))
                        y.append(number)
        return np.array(x), np.array(y)

    def any_of(colours: Sequence[Sequence[float]]) -> Any:
        return lambda: wall(colours[int(rng.integers(len(colours)))], rng)

    tests = [
        signatures(False, [any_of([WALL])]),
        signatures(False, [any_of([WALL])], light=True),
        signatures(False, [any_of(OTHERS)]),
    ]
    if files:
        tests.append(signatures(False, [lambda: clutter(files, rng)]))
    for what, behinds in (("one wall", [any_of([WALL])]), ("three walls", 3 * [any_of(LEARNED)])):
        x, y = signatures(True, behinds)
        machine = LinearSVC(C=1.0, max_iter=5000, random_state=0).fit(x - x.mean(axis=0), y)
        right = [float((machine.predict(its - x.mean(axis=0)) == of).mean()) for its, of in tests]
        yield [what, *(f"{100 * one:.0f}" for one in right)]


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("archive", type=Path, metavar="ETH80.tar")
    parser.add_argument("--clutter", type=Path, metavar="PICTURES", help="a folder of photographs")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(argv)
    views = read_views(options.archive)
    files = sorted(
        one for one in (options.clutter.iterdir() if options.clutter else ()) if one.suffix in SUFFIXES
    )
    heads = ["trained before", "one wall", "other light", "other walls", *(["clutter"] if files else [])]
    print(table(heads, rows(views, files, np.random.default_rng(options.seed))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
