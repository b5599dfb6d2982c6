"""How well any rule could tell a beacon from clutter while the robot drives, by the sightings that each has.

Runs `svm` over rendered drives with nothing on trial, so that every thing that the map begins is used from
its first sighting on. A rule adds up something for each of a thing's sightings, and trusts the thing from a
sum on. Its price is deferred: what share of all sightings are of beacons and come before that. Its faults are
beacons of eight sightings and more that never come to it, however often the map begins them, and clutter that
does. The rules:

scores     what each lies above the detector's threshold, up to 1.5; above that 4; at most 0.05 without a
           distance: as the library does it
plain      the same up to 3, with a distance or without
fit        the odds that a logistic machine gives a sighting by its score, its distance and whether the frame
           cuts it off, taught with the truth of these very drives
and class  the same, told besides what the detector takes it for

The machines know the truth of the drives that they are asked about, so what they get wrong no rule of their
kind gets right. With `--teach SCENARIO=A:B`, as often as one likes, they are taught with those drives: what
could be known beforehand. `--set` changes a parameter. It says nothing of rules that keep more than a sum.
`.venv/bin/python tools/bound_trial.py --scenario lookalikes --seeds 100:104`
`.venv/bin/python tools/bound_trial.py --seeds 2000:2040 --teach paper_room=1020:1031 --teach pairs=100:106`
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import LogisticRegression

from bslam.commands.arguments import seeds_range
from bslam.experiment.camera import UNTOLD_THRESHOLD, CameraStore, camera_log
from bslam.experiment.ledger import CLUTTER
from bslam.experiment.runner import run_log
from bslam.rig import load_rig
from bslam.world.kinds import KINDS
from bslam.world.simulate import load_scenario
from camera_drives import arguments
from measure_association import options_of
from measure_false import Books, add_changes

SUMS = (1.0, 2.0, 3.0, 4.5, 6.5, 10.0)
NO_TRIAL = (("trust_sum", 0.0), ("trust_first_sum", 0.0))
LEAST_SIGHTINGS = 8  # of a beacon, for it to be missed
# A machine is taught with so many of a thing's sightings at most, which count as this many: one thing of a
# thousand sightings is one thing.
TAUGHT_MOST, TAUGHT_AS = 200, 8
ODDS_LOW, ODDS_HIGH = -2.0, 3.0  # what a fit says of one sighting at most: the next shows much the same
FIT_C = 0.3


@dataclass(frozen=True)
class Thing:
    """What the map began once, and its sightings in order of time."""

    identity: int  # that most of them show; CLUTTER: no beacon
    score: NDArray[np.float64]
    has_range: NDArray[np.bool_]
    is_cut: NDArray[np.bool_]
    beacon_class: NDArray[np.int64]


Rule = Callable[[Thing], NDArray[np.float64]]


def things_of(words: argparse.Namespace, world: str, seed: int) -> list[Thing]:
    """All that a drive's map begins."""
    scenario, rig, store = load_scenario(world), load_rig(words.rig), CameraStore(words.store)
    log = camera_log(scenario, seed, words.sigma, "speedometer", rig, store, UNTOLD_THRESHOLD)
    seen = store.drive(scenario, seed, rig).surer_than(UNTOLD_THRESHOLD).seen
    books = Books()
    run_log(log, options_of("svm", "camera", words.sigma, seed, (*NO_TRIAL, *words.changes)), watcher=books)
    found = []
    for uid, rows in books.rows.items():
        one = seen[np.array(rows)]
        found.append(
            Thing(
                identity=books.ledger.identity(uid),
                score=one["score"].astype(np.float64),
                has_range=np.isfinite(one["range_m"]),
                is_cut=one["is_cut"],
                beacon_class=one["beacon_class"].astype(np.int64),
            )
        )
    return found


def scores(thing: Thing) -> NDArray[np.float64]:
    """As the library sums them (firmware/bslam/slam/trust.c)."""
    above = thing.score - UNTOLD_THRESHOLD.whole
    ranged = np.where(above > 1.5, 4.0, above)
    return np.where(thing.has_range, ranged, np.minimum(above, 0.05))


def plain(thing: Thing) -> NDArray[np.float64]:
    """Scores alone."""
    return np.minimum(thing.score - UNTOLD_THRESHOLD.whole, 3.0)


def cues_of(thing: Thing, with_class: bool) -> NDArray[np.float64]:
    """(sightings, cues): what a machine is told of each."""
    score, blind = np.minimum(thing.score, 2.0), ~thing.has_range & ~thing.is_cut
    columns = [np.ones_like(score), score, thing.has_range, blind * score, thing.is_cut]
    if with_class:
        kinds = thing.beacon_class[:, None] == np.arange(1, len(KINDS) + 1)
        columns += [*kinds.T, *(kinds & blind[:, None]).T]
    return np.stack(columns, axis=1).astype(np.float64)


def fit(things: Sequence[Thing], with_class: bool) -> Rule:
    """A machine that was taught with the truth of all these; beacons and clutter weigh the same."""
    tables = [cues_of(one, with_class)[:TAUGHT_MOST] for one in things]
    truth = np.concatenate(
        [np.full(len(t), one.identity != CLUTTER) for one, t in zip(things, tables, strict=True)]
    )
    weight = np.concatenate([np.full(len(t), min(len(t), TAUGHT_AS) / len(t)) for t in tables])
    for side in (truth, ~truth):
        weight[side] *= len(truth) / (10.0 * np.sum(weight[side]))
    machine = LogisticRegression(C=FIT_C, max_iter=3000, fit_intercept=False)
    machine.fit(np.concatenate(tables), truth, sample_weight=weight)
    return lambda thing: np.clip(cues_of(thing, with_class) @ machine.coef_[0], ODDS_LOW, ODDS_HIGH)


def sightings_before(rule: Rule, thing: Thing, trusted_sum: float) -> int:
    """After how many sightings a thing is trusted; all that it has: never."""
    enough = np.flatnonzero(np.cumsum(rule(thing)) >= trusted_sum)
    return int(enough[0]) if len(enough) else len(thing.score)


def missed_in(things: Sequence[Thing], before: Sequence[int]) -> int:
    """How many beacons of a drive were seen often enough, but trusted never, however often they began."""
    seen: Counter[int] = Counter()
    trusted = set()
    for one, sightings in zip(things, before, strict=True):
        seen[one.identity] += len(one.score)
        if sightings < len(one.score):
            trusted.add(one.identity)
    often = {identity for identity, count in seen.items() if count >= LEAST_SIGHTINGS}
    return len(often - trusted - {CLUTTER})


def verdict_row(name: str, rule: Rule, drives: Sequence[Sequence[Thing]], trusted_sum: float) -> str:
    """What a rule costs, and where it is wrong."""
    sightings = deferred = wrong = missed = used = right = 0
    for things in drives:
        before = [sightings_before(rule, one, trusted_sum) for one in things]
        lost, false = missed_in(things, before), 0
        for one, until in zip(things, before, strict=True):
            count = len(one.score)
            sightings += count
            if one.identity != CLUTTER:
                deferred += until
            elif until < count:
                false += 1
                wrong += count - until - 1
        missed, used, right = missed + lost, used + false, right + (lost + false == 0)
    faults = f"{missed / len(drives):.2f} | {used / len(drives):.2f} | {right} of {len(drives)}"
    costs = f"{100.0 * deferred / sightings:.1f} | {faults} | {100.0 * wrong / sightings:.3f}"
    return f"| {name}, {trusted_sum:g} | {costs} |"


def lesson(text: str) -> tuple[str, range]:
    """SCENARIO=A:B."""
    world, _, seeds = text.partition("=")
    return world, seeds_range(seeds)


def add_options(parser: argparse.ArgumentParser) -> None:
    add_changes(parser)
    parser.add_argument("--teach", action="append", default=[], type=lesson, metavar="SCENARIO=A:B")


def main() -> None:
    words = arguments(__doc__, range(1000, 1020), add_options)
    drives = [things_of(words, words.scenario, seed) for seed in words.seeds]
    things = [one for drive in drives for one in drive]
    taught = [one for world, seeds in words.teach for seed in seeds for one in things_of(words, world, seed)]
    beacons = sum(one.identity != CLUTTER for one in things)
    print(
        f"{words.scenario}, sigma {words.sigma:g}, {words.seeds}: {beacons} beacons begun, "
        f"{len(things) - beacons} others\n\n| a rule, from a sum of | deferred % "
        "| beacons missed a drive | others used a drive | drives without either | others' sightings used % |"
        "\n|---|---|---|---|---|---|"
    )
    rules = {
        "scores": scores,
        "plain": plain,
        "fit": fit(taught or things, with_class=False),
        "and class": fit(taught or things, with_class=True),
    }
    for name, rule in rules.items():
        for trusted_sum in SUMS:
            print(verdict_row(name, rule, drives, trusted_sum))


if __name__ == "__main__":
    main()
