"""The learning curve of association: what becomes of a sighting, by how often its beacon was seen before.

A view is a sighting after which the robot went a decimetre, as a machine counts them. By the views of the
beacon before a sighting: the share of right decisions (matched with its own beacon, or new where it is not in
the map), of wrong ones, and of those that wait. Beside `svm` stands what position alone decides, with
machines that are never trained. Prints a table a world and writes the picture.
`.venv/bin/python tools/measure_decisions.py pairs --sigma 1.0 --seeds 2000:2010 --picture out/curve.png`
"""

import argparse
import sys
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from booked_run import BookedRun
from bslam.experiment.runner import run_log
from bslam.experiment.truth import truth_at
from bslam.log import Log
from bslam.view.style import ESTIMATE, SECOND, new_figure, png, tidy
from bslam.world.simulate import load_scenario, simulate
from measure_association import options_of

COLOURS = {"svm": ESTIMATE, "untrained": SECOND}
FIRST_VIEWS = (0, 1, 2, 3, 5, 8, 12, 20, 35, 60, 100, 180)  # of each class, up to the next
RIGHT, WRONG, WAITS = range(3)
VIEW_M = 0.1


class Decisions(BookedRun):
    """Counts decisions by class of views (classes, 3) while a run goes on."""

    def __init__(self, log: Log) -> None:
        super().__init__()
        self.counts = np.zeros((len(FIRST_VIEWS), 3), np.int64)
        self._way_m = _way_m(log)
        self._times_us = log.odometry.time_us
        self._views: Counter[int] = Counter()
        self._viewed_m: defaultdict[int, float] = defaultdict(lambda: -np.inf)

    def enter(self, time_us: int, true_id: Sequence[int], accounts: Sequence[Any]) -> None:
        """Counts a frame's decisions."""
        way_m = float(self._way_m[np.searchsorted(self._times_us, time_us)])
        for identity, account in zip(true_id, accounts, strict=False):
            group = int(np.searchsorted(FIRST_VIEWS, self._views[identity], side="right")) - 1
            self.counts[group, self._judge(identity, account)] += 1
        for identity in true_id:
            if way_m - self._viewed_m[identity] >= VIEW_M:
                self._viewed_m[identity] = way_m
                self._views[identity] += 1

    def _judge(self, identity: int, account: Any) -> int:
        if account.result == "matched":
            return RIGHT if self.ledger.identity(account.beacon_uid) == identity else WRONG
        if account.result == "new":
            mapped = {self.ledger.identity(uid) for uid in self.uids() if uid != account.beacon_uid}
            return WRONG if identity in mapped else RIGHT
        return WAITS


def _way_m(log: Log) -> NDArray[np.float64]:
    """The true way at the end of each step, (n + 1,); the last stands for what comes after."""
    assert log.truth is not None
    poses = truth_at(log.truth, log.odometry.time_us)[0]
    way_m = np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0, prepend=poses[:1, :2]).T))
    return np.append(way_m, way_m[-1])


def measure(world: str, sigma_mps: float, seeds: Sequence[int], method: str) -> NDArray[np.int64]:
    """Counts (classes, 3) over the seeds."""
    total = np.zeros((len(FIRST_VIEWS), 3), np.int64)
    for seed in seeds:
        log = simulate(load_scenario(world), seed, sigma_mps, "speedometer")
        watcher = Decisions(log)
        run_log(log, options_of(method, "simulated", sigma_mps, seed), watcher=watcher)
        total += watcher.counts
    return total


def shares(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Per cent (classes, 3); NaN where there is nothing."""
    sums = counts.sum(axis=1, keepdims=True)
    return np.where(sums > 0, 100.0 * counts / np.maximum(sums, 1), np.nan)


def print_table(world: str, found: dict[str, NDArray[np.int64]]) -> None:
    names = [f"{first}+" for first in FIRST_VIEWS]
    print(f"\n{world}: right / wrong / waits, %\n\n| views before | " + " | ".join(names) + " |")
    print("|---" * (len(names) + 1) + "|")
    for method, counts in found.items():
        cells = ["{:.1f} / {:.2f} / {:.1f}".format(*row) for row in shares(counts)]
        print(f"| {method} | " + " | ".join(cells) + " |")


def draw(tables: dict[str, dict[str, NDArray[np.int64]]]) -> bytes:
    """A column a world: above the share of right ones among those decided, below of those that wait."""
    figure = new_figure(5.2 * len(tables), 5.6)
    axes = figure.subplots(2, len(tables), squeeze=False, sharex=True)
    for column, (world, found) in enumerate(tables.items()):
        above, below = axes[:, column]
        for method, counts in found.items():
            decided = counts[:, [RIGHT, WRONG]]
            words = {"label": method, "color": COLOURS[method], "marker": "o", "markersize": 3}
            above.plot(FIRST_VIEWS, shares(decided)[:, 0], **words)
            below.plot(FIRST_VIEWS, shares(counts)[:, WAITS], **words)
        above.set_title(world)
        above.legend(frameon=False)
        for one, label in ((above, "right of those decided, %"), (below, "undecided or refused, %")):
            one.set_xscale("symlog", linthresh=1.0)
            one.set_xticks(FIRST_VIEWS[::2], [str(first) for first in FIRST_VIEWS[::2]])
            tidy(one, "views of the beacon before" if one is below else "", label)
    return png(figure)


def main(argv: Sequence[str] | None = None) -> int:
    """Prints the tables, writes the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("worlds", nargs="+", help="scenarios")
    parser.add_argument("--sigma", type=float, default=0.6)
    parser.add_argument(
        "--seeds", type=lambda text: range(*map(int, text.split(":"))), default=range(100, 104)
    )
    parser.add_argument("--picture", type=Path, default=Path("out") / "decisions.png")
    words = parser.parse_args(argv)
    tables = {}
    for world in words.worlds:
        tables[world] = {one: measure(world, words.sigma, words.seeds, one) for one in COLOURS}
        print_table(f"{world}, sigma {words.sigma:g}, seeds {words.seeds}", tables[world])
    words.picture.parent.mkdir(parents=True, exist_ok=True)
    words.picture.write_bytes(draw(tables))
    print(f"\nwritten: {words.picture}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
