"""The seeds that a robot starts with are those of the package."""

import numpy as np

from tools.training.make_seeds import HEADER, SEEDS, header


def test_the_header_of_the_seeds_is_written_from_the_package_s():
    assert HEADER.read_text(encoding="utf-8") == header(np.load(SEEDS))
