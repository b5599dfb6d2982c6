"""How well do twenty pictures do? Trains on rendered rooms as a user would, and asks with new pictures.

For each world: 20 example pictures, training with the front end that comes with bslam, then 20 new pictures
from other places in other light. Counts boxes of objects that were trained: recognised, and named right.
`.venv/bin/python tools/measure_retraining.py [--worlds 0:20] [--pictures 20]`
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from bslam.core.vision import FrontEnd
from bslam.errors import BslamError
from bslam.experiment.pictures import load_picture
from bslam.modelfile import Recogniser
from bslam.rig import load_rig
from example_pictures import take
from train_beacons import train
from training.folder import Folder, read_folder
from training.samples import collect

CAMERA = load_rig("three60").cameras[0]


def ask(folder: Folder, recogniser: Recogniser) -> tuple[int, int, int]:
    """Boxes of trained objects in a folder: how many, how many get a name, how many the right one."""
    names = [one.name for one in recogniser.objects]
    frames = [load_picture(picture.path, CAMERA) for picture in folder.pictures]
    front_end = FrontEnd([CAMERA])
    for frame in frames:
        front_end.see(frame.rgb)
    boxes = named = right = 0
    for picture, frame in zip(folder.pictures, frames, strict=True):
        front_end.see(frame.rgb)
        for label in picture.labels:
            edges = (label.left_px, label.top_px, label.right_px, label.bottom_px)
            signature = front_end.signature(frame.box(*edges))
            if label.name not in names or signature is None:
                continue
            values = recogniser.svm.weights @ signature + recogniser.svm.bias
            boxes += 1
            if values.max() >= recogniser.reject_margin:
                named += 1
                right += names[int(values.argmax())] == label.name
    return boxes, named, right


def measure(world: int, pictures: int, folder: Path) -> tuple[int, int, int]:
    """The same for a world, training included. BslamError as training has it."""
    take(folder / "old", world, pictures, seed=0)
    take(folder / "new", world, pictures, seed=1)
    old = read_folder(folder / "old")
    recogniser, _ = train(old, collect(old, CAMERA), precision=0.9)
    return ask(read_folder(folder / "new"), recogniser)


def main() -> None:
    """Prints a line a world and the sums."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--worlds", default="0:20", metavar="A:B", help="worlds A to B - 1 (default: 0:20)")
    parser.add_argument("--pictures", type=int, default=20, help="to train on, and to ask (default: 20)")
    words = parser.parse_args()
    counts = []
    first, end = map(int, words.worlds.split(":"))
    for world in range(first, end):
        with tempfile.TemporaryDirectory() as folder:
            try:
                counts.append(measure(world, words.pictures, Path(folder)))
            except BslamError as error:
                print(f"world {world}: {str(error).split(': ', 1)[-1]}", flush=True)
                continue
        boxes, named, right = counts[-1]
        print(f"world {world}: {boxes} boxes, {named} recognised, {right} right", flush=True)
    boxes, named, right = np.sum(counts, axis=0)
    shares = f"{100 * named / boxes:.1f} % recognised, {100 * right / named:.1f} % of these right"
    print(f"{len(counts)} of {end - first} worlds trained; {boxes} boxes in new pictures: {shares}")


if __name__ == "__main__":
    main()
