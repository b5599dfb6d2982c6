"""Feeds one log to the core on this computer and on emulated boards, and compares the state after every step.

Prints the fingerprint of all states for each, and where the first difference is. The fingerprint is computed
where the core runs (bslam_fingerprint): the state, its covariance, the weights of every machine that was
learned on the way, and all that a smoother keeps.

A board whose image is too small for the run, or has no smoother, is left out, and named. The last line
counts them.

Exit status 0: all the same. 1: some differ, or none was compared.
"""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import SimpleQueue
from pathlib import Path
from typing import Any

from bslam.commands.arguments import CAMERA_STORE
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.log import Log, first_steps
from bslam.options import FILTERS, RunOptions
from bslam.recording.recorder import FINGERPRINT_START
from bslam.rig import load_rig
from bslam.runs.camera import CameraStore, camera_log
from bslam.runs.runner import run_log
from bslam.target.lines import TargetError, boards_here
from bslam.target.remote import connect
from bslam.world.simulate import load_scenario, simulate


class Noting:
    """A pipeline that keeps a fingerprint after every reading and frame."""

    def __init__(self, slam: Any) -> None:
        self._slam = slam
        self.notes: list[int] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._slam, name)

    def odometry(self, *inputs: Any) -> Any:
        try:
            return self._slam.odometry(*inputs)
        finally:
            self._note()

    def sightings(self, *inputs: Any) -> Any:
        try:
            return self._slam.sightings(*inputs)
        finally:
            self._note()

    def _note(self) -> None:
        self.notes.append(self._slam.fingerprint(self.notes[-1] if self.notes else FINGERPRINT_START))


def fingerprints(log: Log, options: RunOptions) -> list[int]:
    """After every reading and frame of a run on options.target, chained: the last stands for all."""
    if options.target == "host":
        made: list[Noting] = []

        def factory(params: Any, beacons: int) -> Noting:
            slam = Slam(params, beacons_max=beacons, seeds=log.seeds)
            made.append(Noting(slam))
            return made[0]

        run_log(log, options, factory)
        return made[0].notes
    opened: list[Noting] = []

    def connected(params: Any, beacons: int) -> Noting:
        slam = connect(options.target, params, beacons, fingerprints=True, seeds=log.seeds)
        opened.append(Noting(slam))  # chained over there
        return opened[0]

    try:
        run_log(log, options, connected)
    finally:
        for one in opened:
            one.close()
    return opened[0].notes


def first_difference(one: list[int], other: list[int]) -> int | None:
    """The first place where two chains differ, or None."""
    for place, (a, b) in enumerate(zip(one, other, strict=True)):
        if a != b:
            return place
    return None


def read_log(options: argparse.Namespace) -> Log:
    """The log that the command line names. A drive seen by cameras is rendered once, which takes minutes."""
    folder = Path(options.log)
    if folder.is_dir():
        return Log.read(folder)
    scenario = load_scenario(options.log)
    if options.rig is None:
        return simulate(scenario, options.seed)
    noise = scenario.wheels.noise
    return camera_log(scenario, options.seed, None, noise, load_rig(options.rig), CameraStore(CAMERA_STORE))


def stay_on_a_core(cores: SimpleQueue[int]) -> None:
    """This process, and the emulators that it starts: their threads hand each byte of the line to each other,
    which takes half of the time where none has to wake another core.
    """
    os.sched_setaffinity(0, {cores.get()})


def on_board(log: Log, words: dict[str, Any], board: str) -> list[int] | str:
    """The fingerprints of a board, or why it is left out."""
    try:
        return fingerprints(log, RunOptions(target=f"qemu:{board}", **words))
    except BslamError as error:  # a small board's image
        return str(error)
    except TargetError as error:
        if "BSLAM_SMOOTHER=0" in str(error):
            return str(error)
        raise


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("log", nargs="?", default="paper_room", help="a scenario, or the folder of a log")
    parser.add_argument("--steps", type=int, default=5000, help="of the log (default: 5000)")
    parser.add_argument(
        "--rig", help="see the scenario through these cameras; signatures go to the boards, too"
    )
    parser.add_argument("--seed", type=int, default=0, help="of a scenario (default: 0)")
    parser.add_argument("--boards", nargs="+", default=boards_here(), help="default: all that are here")
    parser.add_argument("--association", default="svm", help="default: svm")
    parser.add_argument("--observation", default="distance", help="default: distance")
    parser.add_argument("--filter", choices=FILTERS, default="invariant", help="default: invariant")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="boards at a time (default: 1)")
    options = parser.parse_args(argv)
    log = first_steps(read_log(options), options.steps)
    words = {
        "association": options.association,
        "observation": options.observation,
        "filter": options.filter,
    }
    if options.rig is not None:
        words["sensor"] = "camera"
    here = fingerprints(log, RunOptions(**words))
    print(f"{log.name}, {len(log.odometry.time_us)} steps, {len(here)} states, {words}")
    print(f"{'host':<12} {here[-1]:016x}")
    here_on = sorted(os.sched_getaffinity(0))
    counts = {"the same": 0, "different": 0, "left out": 0}
    cores: SimpleQueue[int] = SimpleQueue()
    for worker in range(options.jobs):
        cores.put(here_on[worker % len(here_on)])
    with ProcessPoolExecutor(options.jobs, initializer=stay_on_a_core, initargs=(cores,)) as pool:
        found = pool.map(partial(on_board, log, words), options.boards)
        for board, there in zip(options.boards, found, strict=True):
            if isinstance(there, str):
                counts["left out"] += 1
                print(f"{board:<12} left out: {there}", flush=True)
                continue
            place = first_difference(here, there)
            counts["the same" if place is None else "different"] += 1
            said = "the same" if place is None else f"differs from state {place} on"
            print(f"{board:<12} {there[-1]:016x}  {said}", flush=True)
    figures = ", ".join(f"{count} {what}" for what, count in counts.items())
    print(f"boards: {figures}, over {len(here)} states")
    return 0 if counts["the same"] > 0 and counts["different"] == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
