"""tools/make_seeds.py writes a header that compiles to the samples that the learner itself would store."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bslam.core.learner import SIGNATURE_SIZE, encode
from bslam.core.raw import library
from make_seeds import seeds_header

FIRMWARE = Path(__file__).resolve().parents[3] / "firmware"

PRINTER = """#include <stdio.h>
#include "seeds.h"
int main(void) {
    for (int i = 0; i < BSLAM_SEED_COUNT; i++) {
        for (int k = 0; k < BSLAM_SAMPLE_SIZE; k++) {
            printf("%.9g ", (double)bslam_seeds[i].q[k]);
        }
    }
    return 0;
}
"""


@pytest.mark.parametrize(("real", "is_float"), [("float", 0), ("double", 1)])
def test_header_compiles_to_the_stored_samples(tmp_path: Path, real: str, is_float: int) -> None:
    signatures = np.random.default_rng(1).uniform(-1, 1, (3, SIGNATURE_SIZE)).astype(np.float32)
    Path(tmp_path, "seeds.h").write_text(seeds_header(signatures, 7), encoding="utf-8")
    Path(tmp_path, "main.c").write_text(PRINTER, encoding="utf-8")
    command = [os.environ.get("CC", "cc"), "-std=c11", "-Wall", "-Wextra", "-Werror", f"-I{FIRMWARE}"]
    command += [f"-DBSLAM_SAMPLE_FLOAT={is_float}", str(tmp_path / "main.c"), "-o", str(tmp_path / "main")]
    subprocess.run(command, check=True)
    printed = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout
    stored = np.array([list(one.q) for one in encode(library(real, 1), signatures)])
    # In the float32 build a seed is the 8-bit one, half a step of 1/127 off.
    assert np.abs(np.array(printed.split(), float) - stored.ravel()).max() <= (0.501 / 127 if is_float else 0)


def test_header_lines_are_not_too_long() -> None:
    text = seeds_header(np.zeros((2, SIGNATURE_SIZE), np.float32), 5000)
    assert max(map(len, text.splitlines())) <= 110
