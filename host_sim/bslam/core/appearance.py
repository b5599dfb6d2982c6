"""Signatures as the estimator's classifiers take them: what they start from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError

SIGNATURE_SIZE = 71
"""Values of a signature (BSLAM_SAMPLE_FEATURES)."""
STEPS = 127
"""Of 1, as a float build stores a value (BSLAM_SAMPLE_UNIT)."""
_LARGEST = 1e12

_SEEDS = Path(__file__).with_name("seeds.npy")  # tools/training/make_seeds.py writes it


def encode(signatures: NDArray[np.float32], real: str = "float") -> NDArray[np.int8] | NDArray[np.float32]:
    """Signatures (n, 71) as samples (n, 72), to the bit those of firmware/bslam/appearance/sample.c.

    A value beyond -1 to 1 counts as that limit. Raises BslamError for another shape, or what is no number.
    """
    if np.ndim(signatures) != 2 or np.shape(signatures)[1] != SIGNATURE_SIZE:
        raise BslamError(f"signatures of shape {np.shape(signatures)}; allowed: (n, {SIGNATURE_SIZE})")
    values = np.asarray(signatures, np.float32)
    bad = np.flatnonzero(~(np.abs(values) <= _LARGEST).all(axis=1))
    if len(bad):
        raise BslamError(f"signature {bad[0]} has a value that is no number; allowed: -1 to 1")
    limited = np.clip(values, np.float32(-1), np.float32(1))
    whole = np.column_stack([limited, np.ones(len(limited), np.float32)])
    if real == "double":
        return whole
    nearest = whole * np.float32(STEPS) + np.copysign(np.float32(0.5), whole)
    return nearest.astype(np.int8)


def rendered_seeds() -> NDArray[np.float32]:
    """Signatures (n, 71) of rendered beacons that are nobody's: what a robot with cameras starts from."""
    return np.load(_SEEDS).astype(np.float32) / np.float32(STEPS)
