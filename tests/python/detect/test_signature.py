"""What the scanner tells of a thing's appearance: C against numpy, and what it does not change with."""

import numpy as np
import pytest

from bslam.core.scanner import LEVEL_PAD, Scanner
from bslam.core.vision import FrontEnd
from bslam.rig import load_rig
from bslam.scannerfile import Kind, ScannerModel, Window

GRID, OUT = 16, 3
LOG = np.rint(32 * np.log2((np.arange(256) + 8) / 8)).astype(np.int64)
CENTRE = np.rint(64 * np.exp(-((((np.arange(16) + 0.5) / 16 - 0.5) / 0.27) ** 2) / 2)).astype(np.int64)


def red_model():
    """One window that likes red within and none around."""
    weights = np.full((6, 6, 8), 0, np.int8)
    weights[..., 1] = -4
    weights[1:-1, 1:-1, 1] = 5
    window = Window(
        kind=0,
        box_columns=4.0,
        box_rows=4.0,
        weights=weights,
        scale=0.001,
        bias=-3000,
        coarse=np.zeros((3, 3, 8), np.int8),
        coarse_bias=0,
        order=np.arange(3, dtype=np.uint8),
        floors=np.zeros(3, np.int32),
        edges=np.zeros((4, 3, 3, 8), np.int8),
        edge_scale=np.zeros(4, np.float32),
        edge_bias=np.zeros(4, np.float32),
    )
    return ScannerModel((Kind("red", 0.3, 0.0, 0.0, 1.0, 0.0, 0.05, 0.05),), (window,))


def scene(wall, things, seed=0):
    """A frame of a wall of a colour, with things: (left, top, side)."""
    rng = np.random.default_rng(seed)
    frame = np.clip(np.array(wall) + rng.normal(0, 3, (240, 320, 3)), 0, 255).astype(np.uint8)
    for left, top, side in things:
        frame[top : top + side, left : left + side] = (190, 30, 40)
        band = side // 4
        frame[top + band : top + 2 * band, left : left + side] = (210, 180, 170)
    return frame


@pytest.mark.parametrize("seed", range(3))
def test_c_computes_what_numpy_does(seed):
    rng = np.random.default_rng(seed)
    sides = rng.integers(20, 90, 3)
    things = [(10 + 100 * i, int(rng.integers(0, 140)), int(side)) for i, side in enumerate(sides)]
    frame = scene(rng.integers(60, 200, 3), things, seed)
    octaves = {
        round(level.cell_px): level.cells[LEVEL_PAD:-LEVEL_PAD, LEVEL_PAD:-LEVEL_PAD]
        for level in Scanner().levels(frame)[::4]
    }
    found = FrontEnd(load_rig("three60").cameras[:1], red_model()).see(frame).candidates
    assert len(found) >= 3
    for one in found:
        wanted = reference(octaves, [edge + 0.5 for edge in one.outline])
        assert one.signature[: len(wanted)] == pytest.approx(np.clip(wanted / 80, -1, 1), abs=1e-6)
        assert not one.signature[len(wanted) :].any()


def test_wall_and_light_change_it_less_than_another_thing_does():
    camera = load_rig("three60").cameras[:1]
    at = [(100, 60, 64)]
    plain = scene((150, 150, 150), at)

    def signature(frame):
        return FrontEnd(camera, red_model()).see(frame).candidates[0].signature

    its = signature(plain)
    wall = signature(scene((90, 130, 180), at))
    dim = signature((plain * 0.85).astype(np.uint8))
    warm = signature(np.clip(plain * [1.1, 1.0, 0.85], 0, 255).astype(np.uint8))
    other = plain.copy()
    other[76:92, 100:164] = (20, 60, 20)
    far = np.linalg.norm(signature(other) - its)
    for same in (wall, dim, warm):
        assert np.linalg.norm(same - its) < far / 2


def truncated(a, b):
    """As C divides."""
    return int(a) // int(b) if a >= 0 else -(-int(a) // int(b))


def root(square):
    return np.floor(np.sqrt(np.asarray(square, np.float64) + 1e-9)).astype(np.int64)


def soft(value, first, step, count):
    at = np.clip((value - first) * 16 // step, 0, 16 * (count - 1))
    low = np.minimum(at >> 4, count - 2)
    return low, at - (low << 4)


def tones(cells):
    cells = cells.astype(np.int64)
    u, v = cells[..., 1] - 128, cells[..., 2] - 128
    green = (270 * cells[..., 0] - 180 * u + 65 * v) >> 8
    r, g, b = (LOG[np.clip(x, 0, 255)] for x in (green + 2 * u, green, green + u - 2 * v))
    return r + 2 * g + b, r - g, b - g


def reference(octaves, box):
    """The 66 values before they are divided: MATH-CAMERA "Signature of a box", in other words than C's."""
    left, top, right, bottom = (int(edge * 16 + 0.5) for edge in box)
    width, height = right - left, bottom - top
    px = max((px for px in octaves if width * height >= (256 * px) ** 2), default=min(octaves))
    cells = octaves[px]
    k = np.array([-OUT, *range(GRID), GRID + OUT - 1])
    columns = np.clip((left * 32 + (2 * k + 1) * width) // (512 * px), 0, cells.shape[1] - 1)
    rows = np.clip((top * 32 + (2 * k + 1) * height) // (512 * px), 0, cells.shape[0] - 1)
    points = cells[rows][:, columns]
    light, red, blue = tones(points)

    def apart(y, x):
        inner = [tone[1:-1, 1:-1] for tone in (light, red, blue)]
        away = [np.abs(a - tone[y, x]) for a, tone in zip(inner, (light, red, blue), strict=True)]
        return away[0] + 4 * (away[1] + away[2])

    inside, first, last = slice(1, -1), slice(None, 1), slice(-1, None)
    away = np.minimum.reduce(
        [apart(*one) for one in ((inside, first), (inside, last), (first, inside), (last, inside))]
    )
    mask = np.clip((away - 12) * 255 // 40, 0, 255)
    padded = np.pad(mask, 1, constant_values=255)
    eroded = np.min([padded[i : i + GRID, j : j + GRID] for i in range(3) for j in range(3)], axis=0)
    weights = (eroded + 3) * (CENTRE[:, None] * CENTRE >> 6)
    light, warm, green = light[1:-1, 1:-1], (red - blue)[1:-1, 1:-1], (red + blue)[1:-1, 1:-1]
    light = light - truncated((weights * light).sum(), weights.sum())
    warm = warm - truncated((weights * warm).sum(), weights.sum())
    counts = np.zeros((2, 3, 6), np.int64)
    bins = [soft(light >> 2, -16, 20, 2), soft(warm, -20, 20, 3), soft(green, -36, 12, 6)]
    for corner in np.ndindex(2, 2, 2):
        at = tuple(low + step for (low, _), step in zip(bins, corner, strict=True))
        shares = [upper if step else 16 - upper for (_, upper), step in zip(bins, corner, strict=True)]
        np.add.at(counts, at, weights * shares[0] * shares[1] * shares[2] >> 8)
    colours = root(counts.ravel() * 93**2 // counts.sum())
    shape = (mask.reshape(4, 4, 4, 4).sum(axis=(1, 3)).ravel() * 13 + 2040) // 4080
    deviation = root((weights * light**2).sum() // weights.sum() + 164)
    parts = []
    for y, x in np.ndindex(3, 3):
        part = np.s_[5 * y : 5 * y + 6, 5 * x : 5 * x + 6]
        mean = truncated(((mask[part] + 13) * light[part]).sum(), (mask[part] + 13).sum())
        parts.append(truncated(mean * (int(mask[part].sum()) * 18 // 36), deviation * 255))
    edges = points[1:-1, 1:-1, 4:].astype(np.int64).sum(axis=(0, 1))
    edges = edges * 53 // (root(((edges >> 5) ** 2).sum() + 10500) << 5)
    aspect = truncated(140 * (height - width), height + width)
    return np.concatenate([colours, shape, parts, edges, [aspect]])
