"""The filter's state as the C instance holds it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core import Slam
from internals import inside, module_of


def _array(slam: Slam, field: object) -> NDArray[np.float64]:
    """A member array of the instance, as a copy in double."""
    real = np.float64 if slam._raw.real == "double" else np.float32
    return np.frombuffer(module_of(slam).ffi.buffer(field), dtype=real).astype(np.float64)


def dim(slam: Slam) -> int:
    """Size of the state."""
    return int(inside(slam).slam.ekf.dim)


def mean(slam: Slam) -> NDArray[np.float64]:
    """(n,) the state: robot, then beacons in the order of the map. m, rad."""
    return _array(slam, inside(slam).slam.ekf.mean)[_order(slam)]


def covariance(slam: Slam) -> NDArray[np.float64]:
    """(n, n) its covariance: L D Lᵀ of the factor (bslam/linalg/factor.h)."""
    ekf = inside(slam).slam.ekf
    body, tail = int(ekf.factor.body_count), int(ekf.factor.tail_count)
    places = -(-body // 4) * 4 + 4
    flat = _array(slam, ekf.factor.body)
    lower = np.zeros((places, places))
    for at in range(0, places - 4, 4):
        block = flat[at * (at + 4) // 2 :][: 4 * (at + 4)]
        lower[at : at + 4, : at + 4] = block.reshape(-1, 4).T
    lower[places - 4 :] = _array(slam, ekf.factor.tail)[: 4 * places].reshape(-1, 4).T
    full = lower @ np.diag(_array(slam, ekf.factor.d)[:places]) @ lower.T
    heading = int(ekf.base_dim) - tail - 1
    robot = [places - 4 + tail - 2, places - 4 + tail - 1, heading, places - 4, 0][: int(ekf.base_dim)]
    order = [*robot, *range(heading + 1, body)]
    order = np.array(order)[_order(slam)]
    return full[np.ix_(order, order)]


def begins(slam: Slam) -> list[int]:
    """Where each beacon's values begin in what `mean` returns."""
    ends = np.cumsum([map_at(slam), *(_dim_of(slam, one) for one in beacons(slam))])
    return [int(end) for end in ends[:-1]]


def map_at(slam: Slam) -> int:
    """Size of what stands before the beacons."""
    ekf = inside(slam).slam.ekf
    return int(ekf.base_dim + ekf.sensor_dim)


def _dim_of(slam: Slam, beacon: Any) -> int:
    lib = module_of(slam).lib
    dims = {lib.BSLAM_BEACON_POINT: 2, lib.BSLAM_BEACON_SIZED: 3, lib.BSLAM_BEACON_RAY: 4}
    return dims.get(beacon.kind, 0)


def _order(slam: Slam) -> list[int]:
    """Where each value stands in the core, whose beacons move to the end when they become points."""
    places = [range(one.at, one.at + _dim_of(slam, one)) for one in beacons(slam)]
    return [*range(map_at(slam)), *(at for own in places for at in own)]


def beacons(slam: Slam) -> list[Any]:
    """The filter's beacons, bslam_beacon_t."""
    ekf = inside(slam).slam.ekf
    return [ekf.beacons[i] for i in range(ekf.beacon_count)]


def angles(slam: Slam) -> list[int]:
    """Which values of the state are angles: the heading, and rays' directions."""
    ray = module_of(slam).lib.BSLAM_BEACON_RAY
    return [2, *(at + 2 for at, one in zip(begins(slam), beacons(slam), strict=True) if one.kind == ray)]


def copy_of(slam: Slam) -> Slam:
    """Another instance in the same state, with the same settings."""
    other = Slam(slam.params, beacons_max=slam._raw.beacons_max, real=slam._raw.real)
    mine = inside(other).slam
    own = mine.appearance, mine.smoother
    module_of(slam).ffi.memmove(inside(other), inside(slam), len(slam.state_bytes))
    mine.appearance, mine.smoother = own
    return other


def state_without_counters(slam: Slam) -> bytes:
    """Every byte of the instance but those that a refusal may change: the counters, which sighting was bad,
    and stamps that were refused.
    """
    changing = (("slam", name) for name in ("counters", "bad_sighting", "watch"))
    return _blanked(slam, *changing, ("guard", "counters"))


def state_without_addresses(slam: Slam) -> bytes:
    """Every byte of the instance that two which were fed alike have alike: scratch holds addresses, too."""
    held = (("slam", name) for name in ("appearance", "smoother", "records"))
    return _blanked(slam, *held, ("guard", "copy"))


def _blanked(slam: Slam, *paths: tuple[str, ...]) -> bytes:
    """The bytes of an instance, those of some members 0."""
    data, ffi = bytearray(slam.state_bytes), module_of(slam).ffi
    for path in paths:
        kind = ffi.typeof("bslam_instance_t")
        for name in path:
            kind = dict(kind.fields)[name].type
        offset, size = ffi.offsetof("bslam_instance_t", *path), ffi.sizeof(kind)
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
