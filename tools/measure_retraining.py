"""How well do twenty pictures do? Trains on rendered rooms as a user would, and asks with new pictures.

For each world: 20 example pictures, training with the front end that comes with bslam, then 20 new pictures
from other places in other light. Counts boxes of objects that were trained: recognised, and named right.
`.venv/bin/python tools/measure_retraining.py [--worlds 0:20] [--pictures 20]`
"""

import argparse
import tempfile
from dataclasses import astuple, dataclass
from pathlib import Path

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


@dataclass
class Counts:
    """Boxes in new pictures: of trained objects, those with a name, with the right one; of others."""

    boxes: int = 0
    named: int = 0
    right: int = 0
    others: int = 0
    others_named: int = 0


def ask(folder: Folder, recogniser: Recogniser, counts: Counts) -> None:
    """Count what the recogniser says of the boxes in a folder."""
    names = [one.name for one in recogniser.objects]
    frames = [load_picture(picture.path, CAMERA) for picture in folder.pictures]
    front_end = FrontEnd([CAMERA])
    for frame in frames:
        front_end.see(frame.rgb)
    for picture, frame in zip(folder.pictures, frames, strict=True):
        front_end.see(frame.rgb)
        for label in picture.labels:
            edges = (label.left_px, label.top_px, label.right_px, label.bottom_px)
            signature = front_end.signature(frame.box(*edges))
            if signature is None:
                continue
            values = recogniser.svm.weights @ signature + recogniser.svm.bias
            has_name = bool(values.max() >= recogniser.reject_margin)
            if label.name in names:
                counts.boxes += 1
                counts.named += has_name
                counts.right += has_name and names[int(values.argmax())] == label.name
            else:
                counts.others += 1
                counts.others_named += has_name


def measure(world: int, pictures: int, folder: Path, counts: Counts) -> None:
    """Train on a world as a user would, and ask. BslamError as training has it."""
    take(folder / "old", world, pictures, seed=0, least=3)
    take(folder / "new", world, pictures, seed=1, least=1)
    old = read_folder(folder / "old")
    recogniser, _, _ = train(old, collect(old, CAMERA), precision=0.9)
    ask(read_folder(folder / "new"), recogniser, counts)


def main() -> None:
    """Prints a line a world and the sums."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--worlds", default="0:20", metavar="A:B", help="worlds A to B - 1 (default: 0:20)")
    parser.add_argument("--pictures", type=int, default=20, help="to train on, and to ask (default: 20)")
    words = parser.parse_args()
    total, trained = Counts(), 0
    first, end = map(int, words.worlds.split(":"))
    for world in range(first, end):
        counts = Counts()
        with tempfile.TemporaryDirectory() as folder:
            try:
                measure(world, words.pictures, Path(folder), counts)
            except BslamError as error:
                print(f"world {world}: {str(error).split(': ', 1)[-1]}", flush=True)
                continue
        trained += 1
        print(f"world {world}: {counts}", flush=True)
        total = Counts(*(a + b for a, b in zip(astuple(total), astuple(counts), strict=True)))
    print(f"{trained} of {end - first} worlds trained: {total}")
    print(f"{100 * total.named / total.boxes:.1f} % of trained objects recognised, ", end="")
    print(f"{100 * total.right / total.named:.1f} % of these right, ", end="")
    print(f"{100 * total.others_named / total.others:.1f} % of other objects given a name")


if __name__ == "__main__":
    main()
