"""Instructions that learning on the robot takes on this host, as callgrind counts them: `make bench-learner`.

Renders the beacons of a scenario, shows them to a learner one view at a time (tests/bench/bench_learner.c,
compiled at -O2), and counts for each showing, each training and, at the end, each piece of work. Unlike time,
the counts are the same from run to run. Instructions are not cycles.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tools.training.looks import Views, generic, rendered

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "bench"
FLAGS = ["-std=c11", "-O2", "-g", "-ffp-contract=off", f"-I{ROOT / 'firmware'}"]
UPDATE_MEAN_MAX = 150_000


def build(machines: int) -> Path:
    """The bench program for that many machines."""
    BUILD.mkdir(parents=True, exist_ok=True)
    program = BUILD / f"learner_{machines}"
    learner = [
        ROOT / f"firmware/bslam/appearance/{name}.c" for name in ("learner", "sample", "solver", "training")
    ]
    sources = [ROOT / "tests/bench/bench_learner.c", *learner]
    command = ["cc", *FLAGS, f"-DBSLAM_LEARNER_SLOTS={machines}", *map(str, sources), "-lm"]
    subprocess.run([*command, "-o", str(program)], check=True)
    return program


def recording(views: Views, seeds: NDArray[np.float32], each: int) -> tuple[bytes, int]:
    """What the program reads, `each` views an object in random order, and how many views that is."""
    random = np.random.default_rng(0)
    objects = [np.flatnonzero(views.objects == one) for one in range(views.object_count)]
    order = random.permutation(np.concatenate([random.permutation(own)[:each] for own in objects]))
    record = np.dtype([("machine", "<i4"), ("signature", "<f4", 71)])
    records = np.zeros(len(seeds) + len(order), record)
    records["machine"] = np.concatenate([np.full(len(seeds), -1), views.objects[order]])
    records["signature"] = np.concatenate([seeds, views.signatures[order]])
    return records.tobytes(), len(order)


def counts(program: Path, data: bytes, sightings: int, function: str) -> NDArray[np.int64]:
    """Instructions of each call of a function."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out"]
        command += [f"--toggle-collect={function}", f"--dump-after={function}", str(program), str(sightings)]
        done = subprocess.run(command, input=data, capture_output=True)
        if done.returncode != 0:
            raise SystemExit(f"bench: {program.name} failed:\n{done.stderr.decode()}")
        found = []
        for dump in Path(folder).iterdir():
            total = re.search(r"^(?:summary|totals): (\d+)", dump.read_text(), re.MULTILINE)
            found += [int(total[1])] if total and int(total[1]) > 0 else []
    return np.array(found)


def main() -> int:
    """Prints the table; exits 1 if a training takes more than 150 000 instructions in the mean."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="building50")
    parser.add_argument("--world", type=int, default=11, help="seed of its looks (default 11)")
    parser.add_argument("--frames", type=int, default=5000, help="to render (default 5000)")
    parser.add_argument("--views", type=int, default=24, help="of each beacon (default 24)")
    options = parser.parse_args()
    views = rendered(options.scenario, options.world, options.frames, least=options.views)
    data, sightings = recording(views, generic(64, first_world=5000), options.views)
    program = build(views.object_count)
    print(
        f"{views.object_count} machines, {sightings} views, host -O2, callgrind; instructions are not cycles"
    )
    print(f"{'':>10} {'calls':>7} {'mean':>8} {'median':>8} {'p99':>8} {'max':>8}")
    means = {}
    for name in ("show", "update", "piece"):
        found = counts(program, data, sightings, f"measured_{name}")
        means[name] = found.mean()
        middle, high = np.percentile(found, (50, 99))
        print(f"{name:>10} {len(found):>7} {means[name]:>8.0f} {middle:>8.0f} {high:>8.0f} {found.max():>8}")
    return 0 if means["update"] <= UPDATE_MEAN_MAX else 1


if __name__ == "__main__":
    sys.exit(main())
