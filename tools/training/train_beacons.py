"""Trains the front end to recognise your own objects, from a folder of pictures with labels.csv.

    .venv/bin/python -m tools.training.train_beacons FOLDER --out firmware/models/my_beacons.h

Writes the C header, the same as a model file for `bslam look --model` (.json), and the confusion matrix as a
picture (.png); prints it too. The figures are of pictures that a machine was not trained on, by
cross-validation. docs/RETRAIN.md is the guide, bslam/datasets/labels.py describes labels.csv.
"""

import argparse
import math
import sys
from pathlib import Path

import matplotlib
import numpy as np
import sklearn
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bslam import cheader as export
from bslam.datasets.labels import Folder, read_folder
from bslam.errors import BslamError
from bslam.modelfile import Recogniser, write_recogniser
from bslam.rig import load_rig
from tools.training import fit
from tools.training.compiled import TOLERANCE, CompiledSvm, worst_difference
from tools.training.samples import NONE, Samples, collect, folder_sha256

NO_RIG = """no --rig: taken for pictures of a camera 60 degrees wide that looks straight ahead. One that does
not has its horizon elsewhere, takes other colours for the wall's, and will recognise less."""

LEAST_RECOGNISED = 0.5
"""Share of the objects below which a recogniser is of no use."""

SEED_WEIGHT = 0.22
"""What a generic seed counts, against a box, where the reject margin is chosen: all 64 as much as the other
things in twenty pictures. At 1 the margin is for a room full of strangers, and too high."""

BESIDE = ("none", "elsewhere")
"""Rows of the confusion matrix below the objects': what the front end found besides in the pictures, and the
generic seeds, which are things of other rooms. The first is also its last column."""


def confusion(
    labels: NDArray[np.integer],
    values: NDArray[np.floating],
    margin: float,
    generic: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """Counts (objects + 2, objects + 1): row what it is, BESIDE last; column what it is taken for or none."""
    objects = values.shape[1]
    taken_for = np.where(values.max(axis=1) >= margin, values.argmax(axis=1), objects)
    counts = np.zeros((objects + len(BESIDE), objects + 1), dtype=np.int64)
    np.add.at(counts, (np.where(labels == NONE, objects + generic, labels), taken_for), 1)
    return counts


def train(
    folder: Folder, samples: Samples, precision: float
) -> tuple[Recogniser, fit.Machine, NDArray[np.int64]]:
    """The recogniser, scikit-learn's machines behind it, and its confusion matrix on pictures left out.

    BslamError if less than half of the objects get their own name.
    """
    targets = fit.one_vs_rest(samples.labels, len(folder.objects))
    cost, held_out = fit.choose_cost(samples.signatures, targets, balanced=True, groups=samples.pictures)
    labels, values = samples.labels[samples.counts], held_out[samples.counts]
    right = values.argmax(axis=1) == labels
    objects = int(np.sum(labels != NONE))
    generic = samples.generic[samples.counts]
    weights = np.where(generic, SEED_WEIGHT, 1.0)
    least = math.ceil(LEAST_RECOGNISED * objects)
    margin = reject_margin(values.max(axis=1), right, precision, least, weights)
    if margin is None:
        raise BslamError(
            f"{folder.path}: on pictures left out only {right.sum()} of {objects} objects get their own "
            "name; allowed: at least half, by more pictures, or objects that look less alike"
        )
    counts = confusion(labels, values, margin, generic)
    machine = fit.fit(samples.signatures, targets, cost, balanced=True)
    notes = {
        "training set": f"{len(folder.pictures)} pictures, {sum(samples.boxes.values())} boxes, "
        f"{len(samples.labels)} signatures with shaken boxes and generic seeds; "
        f"sha256 {folder_sha256(folder)}",
        "settings": f"scikit-learn {sklearn.__version__} LinearSVC, one against the rest, C {cost:g} of "
        f"{', '.join(f'{one:g}' for one in fit.COSTS)} by cross-validation, precision {precision:g}",
        "figures": figures(counts),
    }
    return Recogniser(machine.svm, folder.objects, margin, notes), machine, counts


def check_header(header: str, svm: str, x: NDArray[np.float32], machine: fit.Machine) -> None:
    """Compile the header and compare: it must decide as scikit-learn does, on every sample."""
    difference = worst_difference(CompiledSvm(header, svm), x, machine.decide(x))
    if not difference <= TOLERANCE:
        raise AssertionError(f"the header is off by {difference:g}; allowed: {TOLERANCE:g}")
    print(f"compiled, the header decides as scikit-learn on all {len(x)} samples, to {difference:.1g}")


def reject_margin(
    scores: NDArray[np.floating],
    right: NDArray[np.bool_],
    precision: float,
    least: int,
    weights: NDArray[np.floating],
) -> float | None:
    """The lowest margin of which at least `least` right samples are above, and the wanted share of all above,
    by weight.

    Where none gives that share, the one that gives most; where fewer are right at all, None. Half way to the
    next score below; where there is none 0, or the lowest: few pictures do not show how low a right score can
    be.
    """
    order = np.argsort(-scores, kind="stable")
    hits = np.cumsum(right[order])
    shares = np.cumsum((weights * right)[order]) / np.cumsum(weights[order])
    enough = np.flatnonzero(hits >= least)
    if len(enough) == 0:
        return None
    good = enough[shares[enough] >= precision]
    last = int(good[-1]) if len(good) else int(enough[shares[enough].argmax()])
    lowest = float(scores[order][last])
    if last + 1 == len(scores):
        return min(lowest, 0.0)
    return 0.5 * (lowest + float(scores[order][last + 1]))


def figures(counts: NDArray[np.int64]) -> str:
    """What the matrix says, in a sentence."""
    own, elsewhere = counts[:-1], counts[-1]
    right, named = int(np.trace(own)) - int(own[-1, -1]), int(own[:, :-1].sum())
    objects, others = int(own[:-1].sum()), int(own[-1].sum())
    return (
        f"on pictures left out {right} of {objects} objects recognised, {named - right} of {named} names "
        f"wrong, {int(own[-1, -1])} of {others} other things rejected, and {int(elsewhere[-1])} of "
        f"{int(elsewhere.sum())} things of other rooms"
    )


def reached(counts: NDArray[np.int64]) -> float:
    """The share of right names among all, by the weights that the reject margin was chosen with."""
    named = counts[:, :-1].sum(axis=1)
    right = int(np.trace(counts[:-2, :-1]))
    return float(right / max(named[:-1].sum() + SEED_WEIGHT * named[-1], 1.0))


def draw_confusion(path: Path, counts: NDArray[np.int64], names: list[str]) -> None:
    """The matrix as a picture: shares of a row as colour, counts as numbers. `names` are the rows'."""
    size = 2.0 + 0.6 * len(names)
    figure = Figure(figsize=(size + 0.4, size), layout="constrained")
    axes = figure.subplots()
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0)
    for (row, column), count in np.ndenumerate(counts):
        colour = "white" if shares[row, column] > 0.5 else "black"
        axes.text(column, row, str(count or ""), ha="center", va="center", color=colour)
    axes.set_xticks(range(len(names) - 1), names[:-1], rotation=45, ha="right")
    axes.set_yticks(range(len(names)), names)
    axes.set_xlabel("taken for")
    axes.set_ylabel("is")
    axes.set_title("On pictures left out")
    figure.savefig(path, dpi=120, metadata={"Software": None})


def report(samples: Samples, counts: NDArray[np.int64], names: list[str]) -> str:
    """The matrix and what became of the boxes, as text. `names` are the matrix' rows."""
    width = max(len(name) for name in names)
    lines = ["confusion on pictures left out (row: what it is, column: what it is taken for):"]
    lines.append(" " * (width + 2) + "  ".join(f"{name[:8]:>8}" for name in names[:-1]))
    for name, row in zip(names, counts, strict=True):
        lines.append(f"  {name:<{width}}" + "  ".join(f"{count:>8}" for count in row))
    lines.append("boxes, and how many of them the front end found by itself:")
    for name in names[: -len(BESIDE)]:
        lines.append(f"  {name:<{width}}  {samples.found[name]} of {samples.boxes[name]}")
    lines += [f"not used, {reason}: {picture}" for picture, reason in samples.useless.items()]
    return "\n".join(lines)


def run(folder_path: Path, out: Path, precision: float, rig: str | None) -> None:
    """From pictures to header, model file and matrix."""
    folder = read_folder(folder_path)
    if not folder.objects:
        raise BslamError(f"{folder_path}: no box in it; allowed: a box of each of one or more classes")
    samples = collect(folder, None if rig is None else load_rig(rig).cameras[0])
    recogniser, machine, counts = train(folder, samples, precision)
    header = export.recogniser_header(recogniser, out.stem)
    check_header(header, f"bslam_{out.stem}.svm", samples.signatures, machine)
    names = [*(one.name for one in folder.objects), *BESIDE]
    export.write_header(out, header)
    write_recogniser(out.with_suffix(".json"), recogniser)
    draw_confusion(out.with_suffix(".png"), counts, names)
    print(report(samples, counts, names))
    if rig is None:
        print(NO_RIG)
    if reached(counts) < precision:
        print(f"precision {precision:g} is not reached: of what is recognised {reached(counts):.2f} is right")
    print(f"{recogniser.notes['figures']}; reject margin {recogniser.reject_margin:.3f}")
    print(f"written: {out}, {out.with_suffix('.json')}, {out.with_suffix('.png')}")


def _precision(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.5 <= value <= 1.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: a number from 0.5 to 1")
    return value


def _header(text: str) -> Path:
    path = Path(text)
    if path.suffix != ".h" or not export.NAME.fullmatch(path.stem):
        allowed = "a path whose file is named by small letters, digits and _, and .h"
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: {allowed}")
    return path


def main(arguments: list[str] | None = None) -> int:
    """The command; exit status 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="pictures and labels.csv")
    parser.add_argument("--out", type=_header, default=Path("firmware/models/my_beacons.h"), metavar="FILE.h")
    parser.add_argument(
        "--precision", type=_precision, default=0.9, help="wanted of what is recognised (default: 0.9)"
    )
    parser.add_argument(
        "--rig", metavar="RIG", help="its first camera took the pictures: the one to recognise with"
    )
    words = parser.parse_args(arguments)
    matplotlib.use("Agg")
    try:
        run(words.folder, words.out, words.precision, words.rig)
    except BslamError as error:
        print(f"train_beacons: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
