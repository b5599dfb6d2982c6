"""What wrong associations are made of where images are all that is known, and how few any rule could leave.

Runs `svm` over rendered drives. The first table says what became of the sightings that were matched wrongly:
clutter with a false beacon that it had started itself, clutter with a beacon, a beacon with another one.

The second is a bound. Each thing in the map at the end of a drive that was seen from ten places, a decimetre
of way apart, has what a rule could go by: from how many places it was seen, how sure the detector was of it
in the median, how large it is beside its kind, which the true path tells, how far off its sightings were from
where the filter expected them (the mean of D^2 over the gate), and its kind. A judge that sees all of this
after the drive, and is taught with the truth of these very drives, says what is a beacon. What it gets wrong,
no rule of that form gets right while it drives. The third is what can be learned beforehand: a linear machine
that judges each drive and was taught with the truth of the others. `--set` changes a parameter.
`.venv/bin/python tools/measure_false.py --seeds 1000:1020`
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.tree import DecisionTreeClassifier

from booked_run import BookedRun
from bslam.experiment.camera import UNTOLD_THRESHOLD, CameraStore, camera_log
from bslam.experiment.ledger import CLUTTER
from bslam.experiment.runner import run_log
from bslam.experiment.truth import truth_at
from bslam.log import Log
from bslam.rig import load_rig
from bslam.world.kinds import KINDS
from bslam.world.simulate import load_scenario
from camera_drives import arguments
from measure_association import change, options_of

PLACE_M = 0.1
LEAST_PLACES = 10
JUDGES = {"places": [0], "score": [1], "size": [2], "offsets": [3], "all and the kind": [0, 1, 2, 3, 4]}
DEPTH = 3  # of a judge's tree: with one question it is a threshold
MACHINES = {
    "places": ["places"],
    "places, offsets": ["places", "offsets"],
    "places, kind": ["places", "kind"],
    "places, offsets, kind": ["places", "offsets", "kind"],
    "places, offsets, score, kind": ["places", "offsets", "score", "kind"],
}
MACHINE_C = 3.0


@dataclass
class Thing:
    """A beacon of the map, false or not."""

    identity: int
    rows: list[int] = field(default_factory=list)  # of the log's sightings: those matched with it
    test_ratio: list[float] = field(default_factory=list)  # of those but the first: how far off each was


class Books(BookedRun):
    """Which sightings went to which beacon of the map, and what the wrong ones were."""

    def __init__(self) -> None:
        super().__init__()
        self.wrong: Counter[str] = Counter()
        self.rows: defaultdict[int, list[int]] = defaultdict(list)
        """Of the log's sightings, by the beacon that they went to, in order of time."""
        self._test_ratio: defaultdict[int, list[float]] = defaultdict(list)

    def enter(self, time_us: int, true_id: Sequence[int], accounts: Sequence[Any]) -> None:
        """Notes a frame."""
        del time_us
        for row, (identity, account) in enumerate(zip(true_id, accounts, strict=False), self.sightings):
            if account.result in ("matched", "new") or account.reason == "trial":
                self.rows[account.beacon_uid].append(row)
            if account.result == "matched":
                self._test_ratio[account.beacon_uid].append(account.test_ratio)
                self._judge(identity, self.ledger.identity(account.beacon_uid))

    def things(self) -> list[Thing]:
        """What is in the map."""
        return [
            Thing(self.ledger.identity(uid), self.rows[uid], self._test_ratio[uid]) for uid in self.uids()
        ]

    def _judge(self, identity: int, matched: int) -> None:
        if identity == CLUTTER:
            self.wrong["clutter, its own beacon" if matched == CLUTTER else "clutter, a beacon"] += 1
        elif matched != identity:
            self.wrong["a beacon, false one" if matched == CLUTTER else "a beacon, another"] += 1


def size_error(log: Log, rows: NDArray[np.int64]) -> float:
    """By what part a thing's distances are too long, the median; 0 where its directions tell no place."""
    assert log.truth is not None
    poses = truth_at(log.truth, log.sightings.time_us[rows])[0]
    mount_m = complex(log.robot.sensor_x_m, log.robot.sensor_y_m) * np.exp(1j * poses[:, 2])
    eye_m = poses[:, :2] + np.stack([mount_m.real, mount_m.imag], axis=1)
    angle_rad = poses[:, 2] + log.sightings.bearing_rad[rows]
    normal = np.stack([-np.sin(angle_rad), np.cos(angle_rad)], axis=1)
    inverse = normal.T @ normal
    if np.linalg.cond(inverse) > 1e3:
        return 0.0
    place_m = np.linalg.solve(inverse, normal.T @ np.sum(normal * eye_m, axis=1))
    factor = log.sightings.range_m[rows] / np.hypot(*(place_m - eye_m).T)
    return float(np.nanmedian(factor)) - 1.0 if np.isfinite(factor).any() else 0.0


def features(log: Log, score: NDArray[np.float64], thing: Thing) -> list[float]:
    """Places, score, size, offsets, kind."""
    assert log.truth is not None and log.sightings.beacon_class is not None
    rows = np.array(thing.rows)
    poses = truth_at(log.truth, log.truth.time_us)[0]
    way_m = np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0, prepend=poses[:1, :2]).T))
    at_m = np.interp(log.sightings.time_us[rows], log.truth.time_us, way_m)
    places = len(np.unique((at_m / PLACE_M).astype(np.int64)))
    kind = float(np.bincount(log.sightings.beacon_class[rows]).argmax())
    offset = float(np.mean(thing.test_ratio)) if thing.test_ratio else 0.0
    return [float(places), float(np.median(score[rows])), abs(size_error(log, rows)), offset, kind]


@dataclass(frozen=True)
class Drive:
    """What is known of a drive afterwards."""

    books: Books
    things: list[Thing]  # seen from enough places
    features: NDArray[np.float64]  # (things, 5)
    true_ids: set[int]  # of beacons that were seen at all often


def drive_of(words: argparse.Namespace, seed: int) -> Drive:
    scenario, rig, store = load_scenario(words.scenario), load_rig(words.rig), CameraStore(words.store)
    log = camera_log(scenario, seed, words.sigma, "speedometer", rig, store, UNTOLD_THRESHOLD)
    score = store.drive(scenario, seed, rig).surer_than(UNTOLD_THRESHOLD).seen["score"]
    books = Books()
    run_log(log, options_of("svm", "camera", words.sigma, seed, words.changes), watcher=books)
    found = [(one, features(log, score, one)) for one in books.things()]
    often = [(one, row) for one, row in found if row[0] >= LEAST_PLACES]
    table = np.array([row for _, row in often]).reshape(-1, 5)
    counts = Counter(log.sightings.beacon_id.tolist())
    true_ids = {one for one, count in counts.items() if one != CLUTTER and count >= 4}
    return Drive(books, [one for one, _ in often], table, true_ids)


def are_beacons(drive: Drive) -> NDArray[np.bool_]:
    """Of its things, which are beacons: of several with one identity, the one seen most."""
    most = {one.identity: one for one in sorted(drive.things, key=lambda one: len(one.rows))}
    return np.array([one.identity != CLUTTER and most[one.identity] is one for one in drive.things], bool)


def print_wrong(drives: Sequence[Drive]) -> None:
    total = sum(one.books.sightings for one in drives)
    print(f"\n{total} sightings, matched wrongly:\n\n| sighting, matched with | % | drives |\n|---|---|---|")
    for name in ("clutter, its own beacon", "clutter, a beacon", "a beacon, false one", "a beacon, another"):
        counts = [one.books.wrong[name] for one in drives]
        print(f"| {name} | {100.0 * sum(counts) / total:.3f} | {sum(count > 0 for count in counts)} |")


def print_bound(drives: Sequence[Drive]) -> None:
    truth = [are_beacons(one) for one in drives]
    all_features, all_truth = np.concatenate([one.features for one in drives]), np.concatenate(truth)
    unseen = sum(len(one.true_ids) - int(np.sum(there)) for one, there in zip(drives, truth, strict=True))
    print(
        f"\n{np.sum(all_truth)} beacons, {np.sum(~all_truth)} others seen from {LEAST_PLACES} places; "
        f"{unseen} beacons seen from fewer, or not in the map\n\n"
        "| a judge taught with the truth, by | beacons lost | others kept | exact drives | wrong % |\n"
        "|---|---|---|---|---|"
    )
    for name, columns in JUDGES.items():
        tree = DecisionTreeClassifier(max_depth=1 if len(columns) == 1 else DEPTH, random_state=0)
        tree.fit(all_features[:, columns], all_truth)
        print(verdict_row(name, drives, truth, [tree.predict(one.features[:, columns]) for one in drives]))


def print_machines(drives: Sequence[Drive]) -> None:
    truth = [are_beacons(one) for one in drives]
    print(
        "\n| a linear machine taught with the truth of the other drives, by | beacons lost | others kept "
        "| exact drives | wrong % |\n|---|---|---|---|---|"
    )
    for name, cues in MACHINES.items():
        tables = [cues_of(one.features, cues) for one in drives]
        said = []
        for k, table in enumerate(tables):
            machine = make_pipeline(StandardScaler(), LogisticRegression(C=MACHINE_C))
            others = [i for i in range(len(drives)) if i != k]
            machine.fit(
                np.concatenate([tables[i] for i in others]), np.concatenate([truth[i] for i in others])
            )
            said.append(machine.predict(table))
        print(verdict_row(name, drives, truth, said))


def cues_of(features: NDArray[np.float64], cues: Sequence[str]) -> NDArray[np.float64]:
    """What a linear machine weighs: places and offsets by their logarithms, a bit for each kind."""
    columns = {
        "places": np.log(features[:, :1]),
        "score": features[:, 1:2],
        "offsets": np.log(0.01 + features[:, 3:4]),
        "kind": features[:, 4:5] == np.arange(1, len(KINDS) + 1),
    }
    return np.hstack([columns[one] for one in cues])


def verdict_row(
    name: str, drives: Sequence[Drive], truth: Sequence[NDArray[np.bool_]], said: Sequence[NDArray[np.bool_]]
) -> str:
    """What becomes of the counts by what a judge says of each drive's things."""
    total = sum(one.books.sightings for one in drives)
    exact = lost = kept = wrong = 0
    for one, there, says in zip(drives, truth, said, strict=True):
        exact += int(np.all(says == there)) and int(np.sum(there)) == len(one.true_ids)
        lost, kept = lost + int(np.sum(there & ~says)), kept + int(np.sum(~there & says))
        wrong += sum(len(one.things[false].rows) for false in np.flatnonzero(~there & says))
    return f"| {name} | {lost} | {kept} | {exact} of {len(drives)} | {100.0 * wrong / total:.2f} |"


def add_changes(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--set", dest="changes", action="append", default=[], type=change, metavar="NAME=VALUE"
    )


def main() -> None:
    words = arguments(__doc__, range(1000, 1020), add_changes)
    drives = [drive_of(words, seed) for seed in words.seeds]
    print_wrong(drives)
    print_bound(drives)
    print_machines(drives)


if __name__ == "__main__":
    main()
