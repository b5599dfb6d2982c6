"""Pictures with a thing in them that is easy to find: a red panel with a pale band, before other things."""

from pathlib import Path

import numpy as np
from PIL import Image

from bslam.datasets.labels import COLUMNS, FILE

WIDTH, HEIGHT = 320, 240


def picture(rng, with_thing=True):
    """A picture (h, w, 3), and the thing's box; None without one."""
    top, bottom = rng.uniform(60, 200, (2, 3))
    frame = np.linspace(top, bottom, HEIGHT)[:, None] * np.ones((1, WIDTH, 1))
    for _ in range(12):  # other things
        width, height = rng.integers(12, 90, 2)
        left, upper = rng.integers(0, WIDTH - width), rng.integers(0, HEIGHT - height)
        frame[upper : upper + height, left : left + width] = rng.uniform(30, 220, 3)
    box = None
    if with_thing:
        height = int(rng.integers(50, 130))
        width = int(height * rng.uniform(0.45, 0.55))
        left, upper = int(rng.integers(0, WIDTH - width)), int(rng.integers(0, HEIGHT - height))
        light = rng.uniform(0.7, 1.0)
        frame[upper : upper + height, left : left + width] = np.array([220, 30, 40]) * light
        band = slice(upper + height // 4, upper + height // 2)
        frame[band, left + width // 8 : left + width - width // 8] = np.array([240, 240, 230]) * light
        box = (left, upper, left + width, upper + height)
    noise = rng.normal(0.0, 4.0, frame.shape)
    return np.clip(frame + noise, 0, 255).astype(np.uint8), box


def write_folder(folder: Path, count: int, seed: int, empty: int = 0, name="panel"):
    """Such pictures with labels.csv; the last ones are empty."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    rows = [",".join(COLUMNS)]
    for index in range(count + empty):
        frame, box = picture(rng, index < count)
        file = f"p{index:03}.png"
        Image.fromarray(frame).save(folder / file)
        edges = ",,,,," if box is None else f"{name}," + ",".join(map(str, box)) + ",0.5"
        rows.append(f"{file},{edges},")
    (folder / FILE).write_text("\n".join(rows) + "\n")
    return folder
