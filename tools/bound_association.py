"""Which wrong associations a better pose would have spared: hindsight on drives of simulated worlds.

Runs `svm`, and takes each sighting that it matched with another beacon than it shows. Which of the two is
nearer to it, in the standard deviations of the sensor, told where beacons truly stand? Asked with the pose of
that run, with the pose of a filter that was told every identity on the same drive, and with the true pose.
What even the last gets wrong no rule of position can tell; what it gets right was lost with the pose.
`--sensor camera`: of rendered drives.
`.venv/bin/python tools/bound_association.py pairs --sigma 1.0 --seeds 2000:2020`
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from booked_run import BookedRun
from bslam.commands.arguments import seeds_range
from bslam.experiment.align import wrap_angle
from bslam.experiment.camera import UNTOLD_THRESHOLD
from bslam.experiment.ledger import CLUTTER
from bslam.experiment.runner import run_log
from bslam.experiment.sources import CameraSource, ScenarioSource
from bslam.experiment.trace import Trace
from bslam.experiment.truth import truth_at
from bslam.log import Log
from measure_association import options_of

POSES = ("of the run itself", "of a filter told all identities", "true")


class Confusions(BookedRun):
    """Sightings of a beacon that were matched with another."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[tuple[int, int, int]] = []  # of the log's sightings; true identity, that matched

    def enter(self, time_us: int, true_id: Sequence[int], accounts: Sequence[Any]) -> None:
        """Notes those of a frame."""
        del time_us
        for row, (identity, account) in enumerate(zip(true_id, accounts, strict=False), self.sightings):
            if account.result == "matched":
                matched = self.ledger.identity(account.beacon_uid)
                if matched != identity and CLUTTER not in (matched, identity):
                    self.rows.append((row, identity, matched))


def offset2(
    log: Log, row: NDArray[np.int64], poses: NDArray[np.float64], beacon: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Squared distance of sightings (n,) from beacons (n,), poses (n, 3), in the sensor's deviations."""
    assert log.beacons is not None
    robot, seen = log.robot, log.sightings
    order = np.argsort(log.beacons.beacon_id)
    at = order[np.searchsorted(log.beacons.beacon_id[order], beacon)]
    heading_rad = poses[:, 2]
    ahead = np.stack([np.cos(heading_rad), np.sin(heading_rad)], axis=1)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    eye_m = poses[:, :2] + robot.sensor_x_m * ahead + robot.sensor_y_m * left
    way_m = np.stack([log.beacons.x_m[at], log.beacons.y_m[at]], axis=1) - eye_m
    range_m = np.hypot(way_m[:, 0], way_m[:, 1])
    expected_rad = np.arctan2(way_m[:, 1], way_m[:, 0]) - heading_rad - robot.sensor_yaw_rad
    range_var_m2 = (
        robot.range_sigma_floor_m**2
        + (robot.range_sigma_fraction * range_m) ** 2
        + (range_m**2 / robot.range_sigma_scale_m) ** 2
    )
    bearing_sd_rad = np.full(len(row), robot.bearing_sigma_rad)
    if seen.bearing_sd_rad is not None and seen.range_sd_m is not None:  # a camera says how sure each is
        bearing_sd_rad = seen.bearing_sd_rad[row]
        range_var_m2 = seen.range_sd_m[row] ** 2
    off = (wrap_angle(seen.bearing_rad[row] - expected_rad) / bearing_sd_rad) ** 2
    has_range = np.isfinite(seen.range_m[row])
    off[has_range] += ((seen.range_m[row] - range_m) ** 2)[has_range] / range_var_m2[has_range]
    return off


def told_right(log: Log, confused: Confusions, run: Trace, told: Trace) -> list[int]:
    """How many of the confused sightings are nearer to the beacon that they show, by each of POSES."""
    if not confused.rows:
        return [0] * len(POSES)
    row, identity, matched = np.array(confused.rows).T
    assert log.truth is not None
    time_us = log.sightings.time_us[row]
    of_runs = [one.pose[np.searchsorted(one.time_us, time_us, side="right") - 1] for one in (run, told)]
    poses = [*of_runs, truth_at(log.truth, time_us)[0]]
    return [int(np.sum(offset2(log, row, one, identity) < offset2(log, row, one, matched))) for one in poses]


def load(words: argparse.Namespace, seed: int) -> Log:
    """The drive, as both filters get it."""
    drive = (words.world, seed, words.sigma, "speedometer")
    if words.sensor == "camera":
        return CameraSource(*drive, words.rig, words.store, UNTOLD_THRESHOLD).load()
    return ScenarioSource(*drive).load()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("world")
    parser.add_argument("--sigma", type=float, default=0.6, metavar="M/S")
    parser.add_argument("--seeds", type=seeds_range, default=range(100, 104), metavar="A:B")
    parser.add_argument("--sensor", choices=("simulated", "camera"), default="simulated")
    parser.add_argument("--rig", default="three60")
    parser.add_argument("--store", type=Path, default=Path("out") / "camera", metavar="DIR")
    words = parser.parse_args()
    right, wrong, sightings = np.zeros(len(POSES), np.int64), [], 0
    for seed in words.seeds:
        log, confused = load(words, seed), Confusions()
        run = run_log(log, options_of("svm", words.sensor, words.sigma, seed), watcher=confused)
        told = run_log(log, options_of("known", words.sensor, words.sigma, seed))
        right += told_right(log, confused, run, told)
        wrong.append(len(confused.rows))
        sightings += confused.sightings
    total = sum(wrong)
    print(f"{total} of {sightings} sightings matched with another beacon, {100.0 * total / sightings:.3g} %;")
    print(f"on the drives with most of them {sorted(wrong, reverse=True)[:4]}")
    print("\n| pose | nearer to the beacon they show | left, % of all sightings |\n|---|---|---|")
    for name, count in zip(POSES, right.tolist(), strict=True):
        print(f"| {name} | {count} | {100.0 * (total - count) / sightings:.4f} |")


if __name__ == "__main__":
    main()
