"""bslam's scanner beside OpenCV's HOG, a network like FOMO and AprilTag, on labelled pictures.

Each is trained on the same pictures and tried on those left out, in the same parts. AprilTag is there for its
cost alone. Times are compared within rounds in which every one sees the same frames.

    .venv/bin/python -m tools.bench.peers.pictures DIR... [--out FILE.md] [--limit N]
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

from bslam.core.scanner import Level, Scanner
from bslam.detect.boxes import Curve, Floats, Found, curve
from bslam.detect.examples import Collection, Example, read_collection
from bslam.detect.train import FOLDS, Trained, check_collection, parts_of, train
from bslam.detect.windows import Shape, halved, row_values
from bslam.errors import BslamError
from bslam.scannerfile import ScannerModel, Window
from tools.bench.peers import finders
from tools.bench.peers.finders import Fitted, Frame, Rng, fit_hog, fit_network
from tools.bench.peers.programs import ROOT
from tools.checks.markdown import Row, table
from tools.checks.sizes import instance_bytes

OWN, TAGS, NONE = "bslam", "AprilTag 36h11, OpenCV", "—"
FALSE, PRECISION = 0.1, 0.9
FRAMES, ROUNDS = 8, 7
RECALLS = ("recall, precision .9", "recall, .1 false")
ACCURACY = ("AP .5", "AP .3", *RECALLS, "middle: AP", *(f"middle: {each}" for each in RECALLS))
COST = ("products a frame", "a pixel", "time, in times of bslam's", "RAM", "flash")


@dataclass(frozen=True)
class Entrant:
    """One that is trained. has_boxes: it finds more than middles."""

    name: str
    package: str
    is_here: Callable[[], bool]
    fit: Callable[[Sequence[Example], str, Rng], Fitted]
    has_boxes: bool = True


HOG = Entrant(
    "HOG, linear SVM, OpenCV",
    "opencv-contrib-python-headless",
    lambda: hasattr(finders.cv2, "HOGDescriptor"),
    fit_hog,
)
NETWORK = Entrant(
    "network like FOMO, PyTorch", "torch", lambda: finders.torch is not None, fit_network, has_boxes=False
)


def own_result(collection: Collection, kind: str) -> tuple[Sequence[Found], Fitted]:
    """What bslam found in pictures left out, and its scanner, trained on all."""
    for step in train(collection, FALSE):
        if isinstance(step, Trained):
            return step.left.found[kind], _fitted(step.model)
        say(f"{OWN}: {step}")
    raise AssertionError("a training ends with its model")


def _fitted(model: ScannerModel) -> Fitted:
    scanner, cells = Scanner(model), Scanner()
    room = f"-I{ROOT / 'firmware'} -DBSLAM_IMAGE_WIDTH_MAX=320 -DBSLAM_IMAGE_HEIGHT_MAX=240"
    ram_bytes = instance_bytes(f"cc {room}", "nm", 1, "bslam_scanner_t", "vision/vision.h")

    def find(frame: Frame) -> tuple[Floats, Floats]:
        items = scanner.see(frame).items
        return np.array([one.box for one in items]).reshape(-1, 4), np.array([one.score for one in items])

    def cost(frame: Frame) -> tuple[int, int]:
        return sum(_products(cells, frame, one) for one in model.windows), ram_bytes

    tables = [its for one in model.windows for its in vars(one).values() if isinstance(its, np.ndarray)]
    return Fitted(find, cost, sum(its.nbytes for its in tables))


def _products(cells: Scanner, frame: Frame, window: Window) -> int:
    """Of the rows of all coarse windows until each is given up, and of the four fine ones where it is not."""
    rows, columns, channels = window.weights.shape
    shape, count = Shape(columns, rows, window.box_columns, window.box_rows).halved, 0
    for level in cells.levels(frame):
        coarse = Level(halved(level.cells), level.cell_px)
        values = row_values(coarse, shape, window.coarse.astype(np.float32))[:, window.order]
        stays = window.coarse_bias + np.cumsum(values, axis=1) >= window.floors
        added = len(values) + int(np.cumprod(stays[:, :-1], axis=1).sum())
        count += added * shape.columns * channels + 4 * int(stays.all(axis=1).sum()) * window.weights.size
    return count


def result_of(entrant: Entrant, collection: Collection, kind: str) -> tuple[Sequence[Found], Fitted]:
    """The same of another: without each part once; the last one trained is the one that is timed."""
    found: list[Found] = []
    parts = np.array(parts_of(collection))
    for part in range(FOLDS):
        rest = [collection.examples[index] for index in np.flatnonzero(parts != part)]
        fitted = entrant.fit(rest, kind, np.random.default_rng([0, part]))
        left = [collection.examples[index] for index in np.flatnonzero(parts == part)]
        found += [Found(*fitted.find(one.frame), one.of(kind)) for one in left]
        say(f"{entrant.name}: {kind}: trained on {len(rest)} pictures, without part {part + 1} of {FOLDS}")
    return found, fitted


# ---- figures ----------------------------------------------------------------------------------------------


def by_middle(found: Found) -> Found:
    """A box whose middle is within a labelled one becomes that one; any other, nothing."""
    boxes = np.zeros_like(found.boxes)
    for index, box in enumerate(found.boxes):
        middle = (box[:2] + box[2:]) / 2
        inside = ((found.labelled[:, :2] <= middle) & (middle <= found.labelled[:, 2:])).all(axis=1)
        if inside.any():
            boxes[index] = found.labelled[inside][0]
    return Found(boxes, found.scores, found.labelled)


def accuracy_row(name: str, found: Sequence[Found], has_boxes: bool) -> Row:
    """By boxes, and by middles."""
    tight, middle = curve(found, 0.5), curve([by_middle(one) for one in found], 0.5)
    loose = _share(curve(found, 0.3).average_precision)
    own = [_share(tight.average_precision), loose, *_recalls(tight)] if has_boxes else [NONE] * 4
    return [name, *own, _share(middle.average_precision), *_recalls(middle)]


def _recalls(its: Curve) -> list[str]:
    at_precision = float(its.recall[its.precision >= PRECISION].max(initial=0.0))
    return [_share(at_precision), _share(its.recall_at(FALSE))]


def _share(value: float) -> str:
    return f"{value:.2f}".removeprefix("0")


def cost_row(name: str, fitted: Fitted, frames: Sequence[Frame], taken: str) -> Row:
    """Means of the frames; RAM for the largest."""
    costs = [fitted.cost(frame) for frame in frames]
    products, pixels = sum(count for count, _ in costs), sum(frame[..., 0].size for frame in frames)
    counts = [f"{products / len(frames) / 1e6:.1f} M", f"{products / pixels:.0f}"]
    ram_kb = max(ram_bytes for _, ram_bytes in costs) / 1024
    return [name, *counts, taken, f"{ram_kb:.0f} KB", f"{fitted.flash_bytes / 1024:.1f} KB"]


def times(entrants: Mapping[str, Callable[[Frame], object]], frames: Sequence[Frame]) -> dict[str, str]:
    """Ratios to bslam's time, from rounds in which each sees all frames; the first does not count."""
    taken_s: dict[str, list[float]] = {name: [] for name in entrants}
    for _ in range(ROUNDS + 1):
        for name, find in entrants.items():
            start = perf_counter()
            for frame in frames:
                find(frame)
            taken_s[name].append((perf_counter() - start) / len(frames))
    words = {}
    for name, its_s in taken_s.items():
        ratios = [its / own for its, own in zip(its_s[1:], taken_s[OWN][1:], strict=True)]
        words[name] = f"{median(ratios):.1f} [{min(ratios):.1f}, {max(ratios):.1f}]"
    return words | {OWN: f"1 ({1e3 * min(taken_s[OWN]):.1f} ms)"}


def tag_finders() -> dict[str, Callable[[Frame], object]]:
    """AprilTag's, where OpenCV is installed."""
    cv2 = finders.cv2
    if cv2 is None:
        return {}
    cv2.setNumThreads(1)
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
    tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36H11)
    detector = cv2.aruco.ArucoDetector(tags, settings)
    return {TAGS: lambda frame: detector.detectMarkers(cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY))}


# ---- the page ---------------------------------------------------------------------------------------------


def class_section(collection: Collection, kind: str) -> str:
    """Both tables of a class; who is not installed has a row that says so."""
    tags = tag_finders()
    here = [one for one in (HOG, NETWORK) if one.is_here()]
    results = {OWN: own_result(collection, kind)}
    results |= {one.name: result_of(one, collection, kind) for one in here}
    frames = [one.frame for one in collection.examples][:: -(-len(collection.examples) // FRAMES)]
    taken = times({name: fitted.find for name, (_, fitted) in results.items()} | tags, frames)
    boxed = {OWN, *(one.name for one in here if one.has_boxes)}
    accuracy = [accuracy_row(name, found, name in boxed) for name, (found, _) in results.items()]
    cost = [cost_row(name, fitted, frames, taken[name]) for name, (_, fitted) in results.items()]
    cost += [[name, NONE, NONE, taken[name], NONE, NONE] for name in tags]
    absent = [
        f"{one.name}: not installed: `pip install {one.package}`" for one in (HOG, NETWORK) if one not in here
    ]
    accuracy += [[name, *[NONE] * len(ACCURACY)] for name in [*absent, *tags]]
    things = sum(len(one.of(kind)) for one in collection.examples)
    head = f"{kind}: {things} in {len(collection.examples)} pictures, {FOLDS} parts"
    return f"{head}\n\n{table(['', *ACCURACY], accuracy)}\n{table(['', *COST], cost)}"


def sections(folder: Path, limit: int | None) -> Iterator[str]:
    """Each class of a folder; of one that cannot be trained, why."""
    everything = read_collection([folder])
    examples = everything.examples[:: -(-len(everything.examples) // limit) if limit else 1]
    for kind in everything.kinds:
        collection = Collection(examples, {kind: everything.heights_m[kind]})
        try:
            check_collection(collection)
        except BslamError as error:
            say(f"{folder}: skipped: {error}")
            yield f"{folder.name}: skipped: {error}\n"
        else:
            yield f"{folder.name}, {class_section(collection, kind)}"


def say(words: str) -> None:
    """What is being done; the page alone goes to the output."""
    print(words, file=sys.stderr, flush=True)


NOTE = f"""bslam's products are at most so many.

AP is average precision at an overlap (IoU) of .5 and .3, in pictures left out of the training.
Recall is at an overlap of .5: at a precision of .9, and at .1 false ones a picture. By the *middle* rule a
thing is found if the middle of what is found lies in its box: FOMO finds middles, no boxes. All train on
the same {FOLDS - 1} of {FOLDS} parts, and on clutter of the kind that bslam makes of them. HOG has as many
windows as bslam, of about 64x64 pixels. The network is MobileNetV2 at a width of .35, up to an eighth of a
half-size frame. It starts from nothing, not from ImageNet. *Products* are of weights with what is seen,
without what prepares that: bslam's cells, HOG's gradients. *Time*, in one thread, is the median of {ROUNDS}
rounds [least, largest]; in brackets bslam's least one a frame. bslam is plain C, the others have vector
code. *RAM*: bslam's instance for 320x240; HOG's padded frame and gradients, 13 bytes a pixel; the layer of
the network that reads and writes most, a byte a value. *Flash*: bslam's tables; of the others a byte a
weight. No tag is to be seen: AprilTag is there for its time.
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Writes the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR", help="pictures with labels.csv")
    parser.add_argument("--out", type=Path, metavar="FILE", help="default: printed")
    parser.add_argument("--limit", type=int, metavar="N", help="pictures of a folder, spread over it (all)")
    options = parser.parse_args(argv)
    if options.limit is not None and options.limit < 1:
        parser.error(f"--limit {options.limit}: allowed: 1 or more pictures")
    try:
        page = [section for one in options.folders for section in sections(one, options.limit)]
    except BslamError as error:
        raise SystemExit(f"pictures: {error}") from error
    text = "\n".join([*page, NOTE])
    if options.out is None:
        print(text, end="")
    else:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
