"""Writes host_sim/bslam/core/seeds.npy: signatures of rendered beacons of training worlds, one a world.

None of them is a user's: the learner (firmware/bslam/svm/learner.h) sets a new beacon against them. They are
to be made anew when signatures change; the same call writes the same bytes:

    .venv/bin/python -m tools.training.make_seeds [--count 64] [--first-world 5000]
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.core.learner import SIGNATURE_SIZE, encode
from bslam.core.raw import library
from tools.training.looks import generic

SEEDS = Path(__file__).resolve().parents[2] / "host_sim/bslam/core/seeds.npy"


def stored(signatures: NDArray[np.float32]) -> NDArray[np.int8]:
    """The signatures (n, 71) as the learner keeps samples, in 127ths."""
    samples = encode(library("float", 1), signatures)
    return np.array([list(one.q)[:SIGNATURE_SIZE] for one in samples], np.int8)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=64)
    parser.add_argument("--first-world", type=int, default=5000)
    parser.add_argument("--out", type=Path, default=SEEDS)
    options = parser.parse_args()
    np.save(options.out, stored(generic(options.count, options.first_world)))
    print(f"wrote {options.out}: {options.count} seeds")


if __name__ == "__main__":
    main()
