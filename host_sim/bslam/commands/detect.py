"""`bslam detect`: train a scanner for your own objects, try it, and look at what it finds."""

from __future__ import annotations

import argparse
import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.cheader import check_name, scanner_header
from bslam.commands.arguments import positive_count
from bslam.core.scanner import Detection, Detections, Scanner
from bslam.datasets.labels import FILE
from bslam.datasets.pictures import SUFFIXES, load_picture
from bslam.detect.boxes import curve, overlaps
from bslam.detect.examples import Example, read_collection
from bslam.detect.imports import import_labels
from bslam.detect.linear import linear_svc
from bslam.detect.page import Figures, page
from bslam.detect.train import HIT, Trained, alone, find, train
from bslam.errors import BslamError
from bslam.rig import load_rig
from bslam.runs.output import write_atomically
from bslam.runs.shots import VIDEOS, simulated, video
from bslam.scannerfile import ScannerModel, read_scanner, scanner_text
from bslam.view.frames import RIGHT, UNKNOWN, WRONG, Mark, annotate, contact_sheet, png
from bslam.world.simulate import load_scenario

SUMMARY = "find your own objects in pictures: train from labelled ones, run, test"
EXAMPLES = """examples:
  bslam detect train my_pictures --out firmware/models/my_things.json
  bslam detect train hall kitchen --classes extinguisher,door --out out/things.json
  bslam detect test new_pictures --model out/things.json
  bslam detect run new_pictures --model out/things.json --out out/detect
  bslam detect run drive.mp4 --model out/things.json --every 1
  bslam detect import coco annotations.json --pictures photographs
  bslam detect import yolo labels --pictures photographs --names classes.txt

train and test take folders of pictures with labels.csv, as tools/label.html writes it; import makes one from
COCO's json or YOLO's text files. train says how many labelled objects the model finds by itself in pictures
that were left out, writes MODEL.json, the C header MODEL.h and a page MODEL.html. run writes boxes.csv and
contact_sheet.png; where there is a labels.csv, green boxes are right and red ones wrong. docs/RETRAIN.md."""
_ACTIONS = ("train", "run", "test", "import")
_SHARE_MIN = 0.5
_FALSE = 0.1
_LOOSE = 0.3
_COLUMNS = ("picture", "class", "score", "left_px", "top_px", "right_px", "bottom_px")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("action", choices=_ACTIONS, help="what to do")
    parser.add_argument(
        "sources",
        nargs="+",
        metavar="SOURCE",
        help="folders; a video or scenario; see the examples",
    )
    parser.add_argument("--model", type=Path, metavar="FILE", help="run, test: the .json that train wrote")
    parser.add_argument(
        "--out", type=Path, metavar="PATH", help="train: MODEL.json; run: a folder (out/detect)"
    )
    parser.add_argument("--classes", metavar="A,B", help="train: of these classes alone (default: all)")
    parser.add_argument(
        "--false",
        type=_share,
        default=_FALSE,
        metavar="N",
        help=f"train: false detections allowed in a picture that was left out (default: {_FALSE:g})",
    )
    parser.add_argument(
        "--anyway", action="store_true", help="train: write a model that finds less than half by itself, too"
    )
    parser.add_argument(
        "--all", action="store_true", help="run: every box kept, not only those above thresholds"
    )
    parser.add_argument(
        "--rig", metavar="RIG", help="run: the cameras of a scenario or video (default: three60)"
    )
    parser.add_argument("--seed", type=int, default=0, help="run: of a simulated drive (default: 0)")
    parser.add_argument(
        "--frames", type=positive_count, default=12, metavar="N", help="run: of a drive or video (12)"
    )
    parser.add_argument("--every", type=float, default=5.0, metavar="S", help="run: seconds between them (5)")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="import: where the pictures are")
    parser.add_argument("--names", type=Path, metavar="FILE", help="import yolo: class names, a line each")


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    if arguments.rig is not None and (arguments.action != "run" or Path(arguments.sources[0]).is_dir()):
        raise BslamError(f"--rig {arguments.rig}: pictures need none; allowed: run of a scenario or a video")
    return {"train": _train, "run": _run, "test": _test, "import": _import}[arguments.action](arguments)


# ---- train ------------------------------------------------------------------------------------------------


def _train(arguments: argparse.Namespace) -> int:
    out = arguments.out
    if out is None:
        raise BslamError("detect train: --out is missing; allowed: a file to be written, MODEL.json")
    if out.suffix != ".json":
        raise BslamError(f"--out {out}: allowed: a file to be written, MODEL.json")
    check_name(out.stem)
    linear_svc()  # is said before the pictures are read
    wanted = [one for one in (arguments.classes or "").split(",") if one]
    collection = read_collection([Path(one) for one in arguments.sources], wanted)
    print(f"{len(collection.examples)} pictures, classes: {', '.join(collection.kinds)}", flush=True)
    trained = None
    for step in train(collection, arguments.false):
        if isinstance(step, Trained):
            trained = step
        else:
            print(f"  {step}", flush=True)
    assert trained is not None
    figures = [
        Figures(
            one,
            trained.left.curve(one.name, _LOOSE),
            trained.left.curve(one.name),
            trained.left.without(one.name),
        )
        for one in trained.model.kinds
    ]
    print("in pictures that were left out of the training:")
    for one in figures:
        print(one.words())
    poor = [one for one in figures if one.share < _SHARE_MIN]
    if poor and not arguments.anyway:
        print(
            f"nothing written: {poor[0].kind.name!r} is found by itself in less than half; allowed: "
            "more pictures of it, --classes without it, or --anyway"
        )
        return 1
    _write_model(out, trained.model, figures, arguments)
    return 0


def _write_model(
    out: Path, bare: ScannerModel, figures: Sequence[Figures], arguments: argparse.Namespace
) -> None:
    asked = f" --classes {arguments.classes}" if arguments.classes else ""
    asked += f" --false {arguments.false:g}" if arguments.false != _FALSE else ""
    asked += " --anyway" if arguments.anyway else ""
    command = f"bslam detect train {' '.join(arguments.sources)}{asked} --out {out}"
    notes = {
        "trained by": command,
        "figures": "in pictures that were left out: "
        + "; ".join(one.words().split("\n")[0] for one in figures),
    }
    model = ScannerModel(bare.kinds, bare.windows, notes)
    header, html = out.with_suffix(".h"), out.with_suffix(".html")
    text = scanner_header(model, out.stem)
    write_atomically(out, scanner_text(model))
    write_atomically(header, text)
    words = (
        "What the model finds in labelled pictures that were left out of its training, part by part. The "
        "model itself is trained on all of them."
    )
    write_atomically(html, page(out.stem, words, figures, [command]))
    print(f"files: {out}, {header}, {html}")


# ---- test -------------------------------------------------------------------------------------------------


def _test(arguments: argparse.Namespace) -> int:
    model = _model(arguments)
    kinds = [one.name for one in model.kinds]
    collection = read_collection([Path(one) for one in arguments.sources])
    if not set(kinds) & set(collection.kinds):
        raise BslamError(
            f"{arguments.sources[0]}: labels {', '.join(collection.kinds)}; the model finds "
            f"{', '.join(kinds)}; allowed: pictures with labels of its classes"
        )
    for index, kind in enumerate(model.kinds):
        scanner = alone(model, index)
        its = [find(scanner, one, kind.name) for one in collection.examples]
        without = curve([one for one in its if not len(one.labelled)], HIT)
        print(Figures(kind, curve(its, _LOOSE), curve(its, HIT), without).words())
    missing = sorted(set(collection.kinds) - set(kinds))
    if missing:
        print(f"labelled, but not of the model: {', '.join(missing)}")
    return 0


def _model(arguments: argparse.Namespace) -> ScannerModel:
    if arguments.model is None:
        raise BslamError(
            f"detect {arguments.action}: --model is missing; allowed: the .json that train wrote"
        )
    return read_scanner(arguments.model)


# ---- run --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Look:
    """A picture to look at; its labels, where there are any."""

    name: str
    rgb: NDArray[np.uint8]
    example: Example | None = None
    scale: float = 1.0
    left_px: float = 0.0
    top_px: float = 0.0


def _run(arguments: argparse.Namespace) -> int:
    model = _model(arguments)
    out = arguments.out or Path("out") / "detect"
    scanners = [alone(model, i) for i in range(len(model.kinds))] if arguments.all else [Scanner(model)]
    rows: list[Sequence[object]] = []
    pictures, right, wrong = [], 0, 0
    for look in _looks(arguments):
        seen = _see(scanners, look.rgb)
        marks = [_mark(one, look) for one in seen.items]
        right += sum(one.colour == RIGHT for one in marks)
        wrong += sum(one.colour == WRONG for one in marks)
        rows += [(look.name, one.kind, f"{one.score:.4f}", *_in_picture(one, look)) for one in seen.items]
        why = "" if seen.reason == "nothing" else f": {seen.reason}"
        what = f"{len(seen.items)} found" if seen.items else f"nothing found{why}"
        if seen.dropped:
            what += f", {seen.dropped} weaker boxes dropped"
        print(f"{look.name}: {what}")
        pictures.append(annotate(look.rgb, marks, f"{look.name}: {what}"))
    table = io.StringIO()
    csv.writer(table, lineterminator="\n").writerows([_COLUMNS, *rows])
    write_atomically(out / "boxes.csv", table.getvalue())
    write_atomically(out / "contact_sheet.png", png(contact_sheet(pictures)))
    if right or wrong:
        print(f"beside labels: {right} right, {wrong} wrong")
    print(f"{len(rows)} boxes in {len(pictures)} pictures; files in {out}: boxes.csv, contact_sheet.png")
    return 0


def _see(scanners: Sequence[Scanner], rgb: NDArray[np.uint8]) -> Detections:
    """What all of them see in a picture."""
    views = [scanner.see(rgb) for scanner in scanners]
    items = tuple(one for view in views for one in view.items)
    return replace(views[0], items=items, dropped=sum(view.dropped for view in views))


def _looks(arguments: argparse.Namespace) -> Iterator[_Look]:
    if len(arguments.sources) != 1:
        raise BslamError(f"detect run: {len(arguments.sources)} sources; allowed: one")
    path = Path(arguments.sources[0])
    if path.is_dir():
        yield from _folder_looks(path)
        return
    rig = None if arguments.rig is None else load_rig(arguments.rig)
    if path.suffix.lower() in VIDEOS:
        source = video(path, rig, arguments.frames, arguments.every)
    else:
        scenario = load_scenario(arguments.sources[0])
        source = simulated(
            scenario, arguments.seed, rig or load_rig("three60"), arguments.frames, arguments.every
        )
    yield from (_Look(shot.name, np.ascontiguousarray(shot.rgb)) for shot in source.shots if shot.shown)


def _folder_looks(path: Path) -> Iterator[_Look]:
    examples = {}
    if (path / FILE).is_file():
        examples = {one.name: one for one in read_collection([path]).examples}
    files = sorted(one for one in path.iterdir() if one.suffix.lower() in SUFFIXES)
    files = sorted({*files, *(path / name for name in examples)})
    if not files:
        raise BslamError(f"{path}: no picture in it; allowed: files named {', '.join(SUFFIXES)}")
    for file in files:
        name = str(file.relative_to(path))
        scaled = load_picture(file)
        yield _Look(name, scaled.rgb, examples.get(name), scaled.scale, scaled.left_px, scaled.top_px)


def _in_picture(found: Detection, look: _Look) -> list[str]:
    places = (look.left_px, look.top_px, look.left_px, look.top_px)
    return [f"{edge / look.scale + place:.1f}" for edge, place in zip(found.box, places, strict=True)]


def _mark(found: Detection, look: _Look) -> Mark:
    colour = UNKNOWN
    if look.example is not None:
        its = look.example.of(found.kind)
        hit = overlaps(np.array([found.box]), its).max(initial=0.0) >= HIT
        colour = RIGHT if hit else WRONG
    left, top, right, bottom = (edge - 0.5 for edge in found.box)
    return Mark((left, top, right, bottom), (found.kind, f"{found.score:.2f}"), colour)


# ---- import -----------------------------------------------------------------------------------------------


def _import(arguments: argparse.Namespace) -> int:
    if len(arguments.sources) != 2 or arguments.pictures is None:
        raise BslamError(
            "detect import: allowed: import coco FILE.json --pictures DIR, import yolo DIR --pictures DIR"
        )
    kind, source = arguments.sources
    file, boxes = import_labels(kind, Path(source), arguments.pictures, arguments.names)
    print(f"{boxes} boxes written: {file}")
    return 0


def _share(text: str) -> float:
    if not re.fullmatch(r"\d*\.?\d+", text) or not 0.0 < float(text) <= 10.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: a number above 0, at most 10")
    return float(text)
