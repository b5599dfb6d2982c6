"""How near to known identity's position association comes if looks are never wrong.

Runs `known`, `svm`, and `svm` with other machines in place of its own, all else as it is. They are told by
the truth, and sure: `alike` of each sighting which look it has, so that beacons with one look are left to
position; `told` which beacon it shows. What is no beacon, or has the signature of a sighting of another look,
is left to the machines of the run. A beacon of the map is taken for what most of its sightings showed so far.
`untried` is `told` with nothing on trial, `unspoilt` that without clutter, too. So `alike` is what any
machines could reach at best, and `told` what they could if nothing looked like anything else; what is missing
then is what waits, what begins, and what is missed. Without a camera nothing is on trial: no `untried`.
`--draws`: each drive as often, with the noise of its wheels' readings drawn anew.
`.venv/bin/python tools/bound_looks.py lookalikes --sensor camera --seeds 2000:2020 --draws 4`
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.commands.arguments import seeds_range
from bslam.core.learner import encode
from bslam.core.slam import Account, Slam
from bslam.experiment.camera import TOLD_THRESHOLD, UNTOLD_THRESHOLD
from bslam.experiment.ledger import CLUTTER
from bslam.experiment.runner import run_log
from bslam.experiment.sources import CameraSource, ScenarioSource
from bslam.experiment.trace import Trace
from bslam.experiment.truth import truth_at
from bslam.log import Log
from bslam.world.scenario import load_scenario
from measure_association import draw_count, interval, options_of, without_clutter

METHODS = ("known", "svm", "alike", "told")
UNTRIED = ("untried", "unspoilt")  # of a camera, besides
NO_TRIALS = (("trust_sum", 0.0), ("trust_first_sum", 0.0))
SURE = 1.2  # a decision value: looks say all that they may for a match, and more against one
NO_LOOK = -1


class SureSlam(Slam):
    """A robot whose machines are told, and sure.

    look_of: of each true identity which look it has. log: what it is going to see, with true identities.
    """

    def __init__(self, look_of: Mapping[int, int], log: Log, **options: Any) -> None:
        super().__init__(looks=True, seeds=log.seeds, **options)
        assert log.sightings.signature is not None
        self._look_of = look_of
        self._identity_of = {
            one.tobytes(): int(identity)
            for one, identity in zip(log.sightings.signature, log.sightings.beacon_id, strict=True)
        }
        self._shown: defaultdict[int, Counter[int]] = defaultdict(Counter)
        self._looks_now: list[int] = []  # of the beacons, in the order of the map
        self._look_of_sample = self._looks_of_samples(log)
        self._ask_machines = self._slam.learning.answers.ask
        self._attach_sure()

    def _looks_of_samples(self, log: Log) -> dict[bytes, int]:
        """By what the core makes of a signature; NO_LOOK where two looks have the same."""
        samples = encode(self._raw, np.ascontiguousarray(log.sightings.signature, np.float32))
        look_of: dict[bytes, int] = {}
        for i, identity in enumerate(log.sightings.beacon_id.tolist()):
            key = bytes(self._ffi.buffer(samples + i, self._ffi.sizeof("bslam_sample_t")))
            look = self._look_of.get(identity, NO_LOOK)
            look_of[key] = look if look_of.get(key, look) == look else NO_LOOK
        return look_of

    def _attach_sure(self) -> None:
        """In place of what the core asks machines by."""
        ffi, learning = self._ffi, self._slam.learning
        ask_type = dict(ffi.typeof("bslam_looks_answers_t").fields)["ask"].type
        self._ask = ffi.callback(ask_type, self._answer)
        self._answers = ffi.new("bslam_looks_answers_t *", learning.answers[0])
        self._answers.ask = self._ask
        self._learning = ffi.new("bslam_learning_t *", learning[0])
        self._learning.answers = self._answers
        self._slam.learning = self._learning

    def _answer(self, looks: Any, params: Any, index: int, sample: Any) -> Any:
        """What looks say: all, where truth knows the look of both."""
        key = bytes(self._ffi.buffer(sample, self._ffi.sizeof("bslam_sample_t")))
        seen = self._look_of_sample.get(key, NO_LOOK)
        mapped = self._looks_now[index]
        if NO_LOOK in (seen, mapped):
            return self._ask_machines(looks, params, index, sample)
        value = SURE if seen == mapped else -SURE
        return self._ffi.new("bslam_opinion_t *", {"value": value, "weight": 1.0})[0]

    def look_of_beacon(self, uid: int) -> int:
        """Which look a beacon of the map has, by what most of its sightings showed."""
        shown = self._shown.get(uid)
        return NO_LOOK if shown is None else self._look_of.get(shown.most_common(1)[0][0], NO_LOOK)

    def sightings(self, time_us: int, *columns: Any, **named: Any) -> list[Account]:
        """As Slam has it."""
        ekf = self._slam.ekf
        self._looks_now = [self.look_of_beacon(ekf.beacons[b].uid) for b in range(ekf.beacon_count)]
        accounts = super().sightings(time_us, *columns, **named)
        signature = named.get("signature", columns[7] if len(columns) > 7 else None)
        for one, account in zip([] if signature is None else signature, accounts, strict=True):
            if account.beacon_uid is not None and account.result in ("matched", "new"):
                identity = self._identity_of[np.ascontiguousarray(one, np.float32).tobytes()]
                self._shown[account.beacon_uid][identity] += 1
        return accounts


def looks_of(world: str, alike: bool) -> dict[int, int]:
    """Which look each beacon of a world has: `alike` that of the one whose looks it shares, else its own."""
    return {
        one.beacon_id: one.looks_like if alike and one.looks_like is not None else one.beacon_id
        for one in load_scenario(world).arena.beacons
        if one.beacon_id != CLUTTER
    }


@dataclass(frozen=True)
class Drive:
    """A drive, and how it is run. rig and store: the camera's, if that is the sensor."""

    world: str
    seed: int
    sigma_mps: float
    sensor: str
    rig: str
    store: Path
    draw: int
    method: str

    def load(self) -> Log:
        """As the method gets it."""
        drive = (self.world, self.seed, self.sigma_mps, "speedometer")
        if self.sensor != "camera":
            return ScenarioSource(*drive, noise_draw=self.draw).load()
        threshold = TOLD_THRESHOLD if self.method == "known" else UNTOLD_THRESHOLD
        log = CameraSource(*drive, self.rig, self.store, threshold, noise_draw=self.draw).load()
        is_unspoilt = self.method == "unspoilt"
        return replace(log, sightings=without_clutter(log.sightings)) if is_unspoilt else log


def run(drive: Drive) -> tuple[float, float]:
    """Mean position error, m, and what was matched with another beacon, % of all sightings."""
    log = drive.load()
    trace = run_by(log, drive)
    assert log.truth is not None
    true_pose, _ = truth_at(log.truth, trace.time_us)
    off_m: NDArray[np.float64] = np.hypot(*(trace.pose - true_pose)[:, :2].T)
    return float(off_m.mean()), 100.0 * trace.counts.wrong_associations / trace.counts.sightings


def run_by(log: Log, drive: Drive) -> Trace:
    """A drive by its method."""
    if drive.method in ("known", "svm"):
        return run_log(log, options_of(drive.method, drive.sensor, drive.sigma_mps, drive.seed))
    look_of = looks_of(drive.world, drive.method == "alike")
    changes = NO_TRIALS if drive.method in UNTRIED else ()
    return run_log(
        log,
        options_of("svm", drive.sensor, drive.sigma_mps, drive.seed, changes),
        slam_factory=lambda params, beacons: SureSlam(
            look_of, log, params=params, beacons_max=beacons, recovery=True
        ),
    )


def row(name: str, error_m: NDArray[np.float64], wrong: NDArray[np.float64], known_m: Any) -> str:
    """A line of the table, of (draws, drives): means are over a drive's draws, then over drives."""
    ratio = error_m / known_m
    cells = [
        name,
        interval(wrong.mean(axis=0).tolist()),
        interval((100.0 * error_m).mean(axis=0).tolist()),
        interval(ratio.mean(axis=0).tolist()),
        f"{np.median(ratio):.3g}",
        ", ".join(f"{one:.3g}" for one in ratio.mean(axis=1)),
    ]
    return "| " + " | ".join(cells) + " |"


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("world")
    parser.add_argument("--sigma", type=float, default=0.6, metavar="M/S")
    parser.add_argument("--seeds", type=seeds_range, default=range(100, 104), metavar="A:B")
    parser.add_argument("--draws", type=draw_count, default=1, help="of the wheels' noise, of each drive")
    parser.add_argument("--sensor", choices=("simulated", "camera"), default="simulated")
    parser.add_argument("--rig", default="three60")
    parser.add_argument("--store", type=Path, default=Path("out") / "camera", metavar="DIR")
    parser.add_argument("--jobs", type=int, default=1)
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    words = parse(argv)
    print("| method | wrong % | position cm | against known | median | in each draw |")
    print("|---|---|---|---|---|---|")
    known_m: NDArray[np.float64] | None = None
    with ProcessPoolExecutor(words.jobs) as pool:
        for method in (*METHODS, *(UNTRIED if words.sensor == "camera" else ())):
            drives = [
                Drive(words.world, seed, words.sigma, words.sensor, words.rig, words.store, draw, method)
                for draw, seed in product(range(words.draws), words.seeds)
            ]
            shape = (2, words.draws, len(words.seeds))
            error_m, wrong = np.array(list(pool.map(run, drives))).T.reshape(shape)
            known_m = error_m if known_m is None else known_m
            print(row(method, error_m, wrong, known_m), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
