"""Writes host_sim/bslam/core/seeds.npy: signatures of rendered beacons of training worlds, one a world; and
firmware/models/seeds.h, which has the same for a robot.

None of them is a user's: the learner (firmware/bslam/appearance/learner.h) sets a new beacon against them.
They are to be made anew when signatures change; the same call writes the same bytes:

    .venv/bin/python -m tools.training.make_seeds [--count 64] [--first-world 5000]
    .venv/bin/python -m tools.training.make_seeds --header  # the header alone, of these seeds
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.core.appearance import SIGNATURE_SIZE, encode
from tools.training.looks import generic

ROOT = Path(__file__).resolve().parents[2]
SEEDS = ROOT / "host_sim/bslam/core/seeds.npy"
HEADER = ROOT / "firmware/models/seeds.h"


def stored(signatures: NDArray[np.float32]) -> NDArray[np.int8]:
    """The signatures (n, 71) as the learner keeps samples, in 127ths."""
    return encode(signatures)[:, :SIGNATURE_SIZE].astype(np.int8)


def header(seeds: NDArray[np.int8]) -> str:
    """The seeds (n, 71) as a C header."""
    rows = "".join(f"    {{{{{', '.join(map(str, [*row, 127]))}}}}},\n" for row in seeds.tolist())
    return f"""/// Signatures of rendered beacons, none of them a user's, for classifiers to start from
/// (settings.seeds). tools/training/make_seeds.py writes it from host_sim/bslam/core/seeds.npy.
#ifndef BSLAM_MODELS_SEEDS_H
#define BSLAM_MODELS_SEEDS_H

#include "bslam/bslam.h"

#define BSLAM_RENDERED_SEEDS {len(seeds)}

// clang-format off
/// In 127ths: of a build with 8-bit samples.
static const bslam_sample_t bslam_rendered_seeds[BSLAM_RENDERED_SEEDS] = {{
{rows}}};
// clang-format on

#endif
"""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=64)
    parser.add_argument("--first-world", type=int, default=5000)
    parser.add_argument("--header", action="store_true")
    options = parser.parse_args()
    if not options.header:
        np.save(SEEDS, stored(generic(options.count, options.first_world)))
    seeds = np.load(SEEDS)
    HEADER.write_text(header(seeds), encoding="utf-8")
    print(f"wrote {SEEDS} and {HEADER}: {len(seeds)} seeds")


if __name__ == "__main__":
    main()
