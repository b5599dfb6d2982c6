"""tests/vectors is what the reference gives today."""

import re

from reference.make_vectors import HEADER, text

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]\d+)?(?![\w.])")
SIZE_MAX_BYTES = 200_000


def test_text_again_is_the_file_in_the_tree() -> None:
    again, stored = text(), HEADER.read_text(encoding="utf-8")
    # Another machine's NumPy may round a last digit the other way; what is 0 but for rounding has another
    # length then, and lines break elsewhere.
    assert NUMBER.sub("#", again).split() == NUMBER.sub("#", stored).split()
    for new, old in zip(NUMBER.findall(again), NUMBER.findall(stored), strict=True):
        assert new == old or abs(float(new) - float(old)) <= 1e-9 * abs(float(old)) + 1e-15


def test_file_is_small() -> None:
    assert HEADER.stat().st_size < SIZE_MAX_BYTES
