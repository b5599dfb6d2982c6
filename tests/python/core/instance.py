"""The filter's state as the C instance holds it, read through the raw layer: for tests only."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from bslam.core import Slam


@cache
def _places(dim: int) -> NDArray[np.int64]:
    """(dim, dim) places of the elements in the packed triangle: bslam/linalg/symmat.h."""
    row, column = (
        np.maximum.outer(np.arange(dim), np.arange(dim)),
        np.minimum.outer(np.arange(dim), np.arange(dim)),
    )
    block = row // 4
    return 4 * (block + 1) * (2 * block + row % 4) + column


def _array(slam: Slam, field: object) -> NDArray[np.float64]:
    """A member array of the instance, as a copy in double."""
    real = np.float64 if slam._raw.real == "double" else np.float32
    return np.frombuffer(slam._ffi.buffer(field), dtype=real).astype(np.float64)


def dim(slam: Slam) -> int:
    """Size of the state."""
    return int(slam._slam.ekf.dim)


def mean(slam: Slam) -> NDArray[np.float64]:
    """(n,) the state: robot, then beacons. m, rad."""
    return _array(slam, slam._slam.ekf.mean)[: dim(slam)]


def covariance(slam: Slam) -> NDArray[np.float64]:
    """(n, n) its covariance."""
    return _array(slam, slam._slam.ekf.covariance)[_places(dim(slam))]


def angles(slam: Slam) -> list[int]:
    """Which values of the state are angles: the heading, and rays' directions."""
    beacons = [slam._slam.ekf.beacons[i] for i in range(slam._slam.ekf.beacon_count)]
    return [2, *(b.at + 2 for b in beacons if b.kind == slam._lib.BSLAM_BEACON_RAY)]


def copy_of(slam: Slam) -> Slam:
    """Another instance in the same state."""
    other = Slam(beacons_max=slam._raw.beacons_max, real=slam._raw.real)
    slam._ffi.memmove(other._slam, slam._slam, slam._ffi.sizeof("bslam_slam_t"))
    return other


def state_without_counters(slam: Slam) -> bytes:
    """Every byte of the instance but those that a refusal may change: the counters, and which sighting was
    bad.
    """
    data = bytearray(slam.state_bytes)
    fields = dict(slam._ffi.typeof("bslam_slam_t").fields)
    for name in ("counters", "bad_sighting"):
        offset, size = fields[name].offset, slam._ffi.sizeof(fields[name].type)
        data[offset : offset + size] = bytes(size)
    return bytes(data)


def correlation_floor(slam: Slam) -> float:
    """The smallest eigenvalue of the correlation matrix; a value that is known exactly counts as
    uncorrelated.
    """
    p = covariance(slam)
    sd = np.sqrt(np.diag(p))
    scale = np.where(sd > 0, sd, 1.0)
    correlation = p / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    return float(np.linalg.eigvalsh(correlation)[0])
