"""How well machines that learn on the robot tell beacons apart, beside LinearSVC on all data they ever saw.

Rendered: the beacons of a dressed scenario, seen from all over it; some views to learn from, the others to
test with. Photographs: ETH-80 if it is at hand, views to learn from far apart, tested on views at least 20
degrees from each of them. Views come in random order, one at a time, and training goes on until nothing is
left to do. Prints top-1 % over all objects, mean over --splits, and what training takes.
`.venv/bin/python tools/measure_learner.py`
"""

from __future__ import annotations

import argparse
import contextlib
import warnings
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from sklearn.exceptions import ConvergenceWarning
from sklearn.svm import LinearSVC

from bslam.core.learner import Learner
from bslam.errors import BslamError
from training.eth80 import archive_path
from training.looks import Views, generic, photographs, rendered

COST = 10.0
APART_DEG = 20.0

Split = tuple[NDArray[np.int64], NDArray[np.int64]]  # views to learn from, in order, and to test with


def split_at_random(views: Views, count: int, random: np.random.Generator) -> Split:
    """`count` views of each object to learn from."""
    learn, test = [], []
    for index in range(views.object_count):
        own = random.permutation(np.flatnonzero(views.objects == index))
        learn += own[:count].tolist()
        test += own[count:].tolist()
    return random.permutation(learn), np.array(test)


def split_by_direction(views: Views, count: int, random: np.random.Generator) -> Split:
    """`count` directions to learn from, each far from those before; the test is far from all of them."""
    directions = np.unique(views.directions.round(6), axis=0)
    angles = np.degrees(np.arccos(np.clip(directions @ directions.T, -1, 1)))
    chosen = [int(random.integers(len(directions)))]
    while len(chosen) < count:
        far = angles[chosen].min(axis=0) + random.uniform(0.0, 1.0, len(directions))
        far[chosen] = -1.0
        chosen.append(int(far.argmax()))
    nearest = angles[chosen].min(axis=0)
    at = (views.directions @ directions.T).argmax(axis=1)
    learn = np.flatnonzero(np.isin(at, chosen))
    return random.permutation(learn), np.flatnonzero(nearest[at] >= APART_DEG)


def online(
    views: Views, order: NDArray[np.int64], seeds: NDArray[np.float32], real: str
) -> tuple[Learner, list[int]]:
    """A learner that was shown the views in order, and its machines by object."""
    learner = Learner(seeds, machines=views.object_count, real=real)
    machines = [learner.add() for _ in range(views.object_count)]
    for view in order.tolist():
        learner.show(machines[views.objects[view]], views.signatures[view])
        learner.train()
    return learner, machines


def right_of_all_data(views: Views, learn: NDArray[np.int64], test: NDArray[np.int64]) -> float:
    """Top-1 share of LinearSVC, trained at once on every view to learn from."""
    machine = LinearSVC(C=COST, loss="squared_hinge", tol=1e-4, max_iter=100_000, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ConvergenceWarning)
        warnings.filterwarnings("ignore", message="The number of unique classes")  # one view an object
        machine.fit(views.signatures[learn], views.objects[learn])
    return float(np.mean(machine.predict(views.signatures[test]) == views.objects[test]))


def measure(
    views: Views, learn: NDArray[np.int64], test: NDArray[np.int64], seeds: NDArray[np.float32]
) -> list[float]:
    """Shares of LinearSVC, of 8-bit samples, those with seeds, and float32; trainings a view, their steps."""
    figures = [right_of_all_data(views, learn, test)]
    none = seeds[:0]
    for given, real in ((none, "float"), (seeds, "float"), (none, "double")):
        learner, machines = online(views, learn, given, real)
        decided = learner.decide(machines, views.signatures[test]).argmax(axis=1)
        figures.append(float(np.mean(decided == views.objects[test])))
        counters = learner.counters
        if real == "float" and given is seeds:
            trainings = [counters["updates"] / len(learn), counters["steps"] / counters["updates"]]
    return figures + trainings


def report(
    title: str,
    views: Views,
    counts: Sequence[int],
    split: Callable[[Views, int, np.random.Generator], Split],
    splits: int,
    seeds: NDArray[np.float32],
) -> None:
    """Prints one table."""
    print(f"{title}: {views.object_count} objects, {len(views.objects)} views")
    heads = ("LinearSVC", "online", "+ seeds", "float32", "trainings", "steps")
    print(f"{'views each':>10} " + " ".join(f"{head:>9}" for head in heads))
    for count in counts:
        rows = [
            measure(views, *split(views, count, np.random.default_rng([number, count])), seeds)
            for number in range(splits)
        ]
        *shares, trainings, steps = np.mean(rows, axis=0).tolist()
        cells = " ".join(f"{100 * share:>9.2f}" for share in shares)
        print(f"{count:>10} {cells} {trainings:>9.2f} {steps:>9.0f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="building50")
    parser.add_argument("--world", type=int, default=11, help="seed of its looks (default 11)")
    parser.add_argument("--frames", type=int, default=5000, help="to render (default 5000)")
    parser.add_argument("--splits", type=int, default=5, help="to take the mean of (default 5)")
    options = parser.parse_args()
    seeds = generic(64, first_world=5000)
    views = rendered(options.scenario, options.world, options.frames, least=34)
    name = f"{options.scenario}, world {options.world}"
    report(name, views, (1, 2, 8, 24), split_at_random, options.splits, seeds)
    with contextlib.suppress(BslamError):  # where it is not at hand
        views = photographs(archive_path())
        report("ETH-80", views, (1, 4, 10, 24), split_by_direction, options.splits, seeds)


if __name__ == "__main__":
    main()
