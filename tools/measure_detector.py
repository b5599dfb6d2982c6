"""What the built-in beacon detector reaches in worlds it has never seen: the table of docs/EXPERIMENTS.md.

Renders worlds of style "test" for each kind of lens (kept under build/training), looks at their frames with
the built-in model, its own threshold left out, and prints recall at a precision, by kind and distance, with
the 95 % intervals of a bootstrap over worlds. What counts as found, and what does not count, stands in
tools/training/truth.py.
"""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.core.vision import FrontEnd
from training.detector_score import Score, Sightings, is_found, look_at_worlds, score
from training.render_set import KINDS, RIGS, render_set

ROOT = Path(__file__).resolve().parent.parent
NEAR_M = {"pinhole": 6.0, "wide": 5.0}
BINS_M = (0.0, 1.5, 2.5, 3.5, 5.0, 7.0, 10.0, 15.0)
DRAWS = 200


def recall(found: NDArray[np.bool_], chosen: NDArray[np.bool_]) -> str:
    """Share of the chosen objects that were found, and how many there were."""
    return f"{found[chosen].mean():.3f} of {int(chosen.sum())}" if chosen.any() else "none"


def interval(seen: Sightings, precision: float, near_m: float) -> dict[str, tuple[float, float]]:
    """95 % intervals of the recalls at a precision, from worlds drawn anew."""
    random = np.random.default_rng(0)
    worlds = np.unique(seen.objects["world"])
    drawn: dict[str, list[float]] = {"all": [], "near": []}
    for _ in range(DRAWS):
        sample = seen.of_worlds(random.choice(worlds, len(worlds)))
        found = score(sample, precision).found
        drawn["all"].append(float(found.mean()))
        drawn["near"].append(float(found[sample.objects["range_m"] < near_m].mean()))
    return {
        name: (float(np.quantile(values, 0.025)), float(np.quantile(values, 0.975)))
        for name, values in drawn.items()
    }


def repeats(seen: Sightings, result: Score) -> tuple[float, float]:
    """How likely an object is found in the frame after one in which it was, and after one in which not."""
    after: dict[bool, list[bool]] = {True: [], False: []}
    last: dict[tuple[int, int], tuple[int, bool]] = {}
    order = np.argsort(seen.objects["frame"], kind="stable")
    for one, found in zip(seen.objects[order], result.found[order], strict=True):
        key = (int(one["world"]), int(one["beacon_id"]))
        frame, was_found = last.get(key, (-2, False))
        if frame == one["frame"] - 1:
            after[was_found].append(bool(found))
        last[key] = (int(one["frame"]), bool(found))
    hit, miss = (float(np.mean(after[was])) if after[was] else float("nan") for was in (True, False))
    return hit, miss


def report(lens: str, seen: Sightings, threshold: float) -> None:
    """Prints the table of a lens."""
    objects, near = seen.objects, seen.objects["range_m"] < NEAR_M[lens]
    print(f"\n{lens}: {len(objects)} objects in {len(np.unique(objects['world']))} worlds")
    for precision in (0.95, 0.90):
        result = score(seen, precision)
        bounds = interval(seen, precision, NEAR_M[lens])
        for name, chosen in ((f"to {NEAR_M[lens]:g} m", near), ("all distances", np.ones_like(near))):
            low, high = bounds["near" if chosen is near else "all"]
            print(
                f"  recall at precision {precision:.2f}, {name}: {recall(result.found, chosen)} "
                f"({low:.2f} to {high:.2f})"
            )
    accepting = score(seen, 0.98, clutter_is_accepted=True)
    print(f"  recall at precision .98, clutter accepted: {accepting.recall:.3f}")
    result = score(seen, 0.95)
    for index, kind in enumerate(KINDS):
        print(f"  {kind}: {recall(result.found, objects['kind'] == index)}")
    for low_m, high_m in pairwise(BINS_M):
        chosen = (objects["range_m"] >= low_m) & (objects["range_m"] < high_m)
        print(f"  {low_m:g} to {high_m:g} m: {recall(result.found, chosen)}")
    print_confusion(result)
    print("  P(hit after hit) {:.3f}, P(hit after miss) {:.3f}".format(*repeats(seen, result)))
    print_operating_point(seen, threshold)


def print_confusion(result: Score) -> None:
    """Which kind is said for which, of the right detections."""
    right = result.accepted[result.right]
    print("  said (across) for true (down): " + " ".join(f"{kind[:6]:>6}" for kind in KINDS))
    for index, kind in enumerate(KINDS):
        said = np.bincount(right["kind"][right["true_kind"] == index], minlength=len(KINDS))
        print(f"  {kind:>30} " + " ".join(f"{count:>6}" for count in said))


def print_operating_point(seen: Sightings, threshold: float) -> None:
    """What the model's own threshold gives."""
    accepted = seen.detections[(seen.detections["score"] >= threshold) & (seen.detections["object"] != -2)]
    right = accepted["object"] >= 0
    clutter = accepted["on_clutter"] & ~right
    found = is_found(seen.objects, accepted)
    frames = len(np.unique(seen.objects["world"])) * 25
    print(
        f"  at threshold {threshold:.2f}, the model's: recall {found.mean():.3f}, "
        f"precision {right.mean():.3f} "
        f"({(right | clutter).mean():.3f} with clutter accepted), {(~right).sum() / frames:.3f} false a frame"
    )


def main() -> int:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=40, help="of style test, a lens (default: 40)")
    parser.add_argument("--first-seed", type=int, default=9000, help="of the worlds (default: 9000)")
    parser.add_argument("--style", default="test", choices=("train", "test"))
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "training", help="rendered worlds")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.worlds)
    for lens in RIGS:
        render_set(options.folder, lens, options.style, seeds, options.processes)
        seen = look_at_worlds(options.folder, lens, options.style, seeds, None, options.processes)
        report(lens, seen, FrontEnd(RIGS[lens].cameras).threshold())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
