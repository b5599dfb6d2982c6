"""Files of kept maps, held against what the core would say of them."""

from __future__ import annotations

from pathlib import Path

from bslam.core.builds import SIZE_CLASSES
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.maps.blob import SUFFIX


def read_blob(path: Path) -> bytes:
    """The bytes of a map that the core would load. Raises BslamError with what is wrong."""
    try:
        blob = path.read_bytes()
    except OSError as error:
        raise BslamError(f"{path}: cannot be read: {error.strerror}; allowed: a map, *{SUFFIX}") from error
    ensure_sound(path, blob)
    return blob


def ensure_sound(path: Path, blob: bytes) -> None:
    """Raises BslamError if the core would refuse these bytes, which are or shall be in `path`."""
    fault = Slam(beacons_max=SIZE_CLASSES[-1]).map_fault(blob)
    if fault != "fine":
        raise BslamError(f"{path}: {fault}; allowed: a whole map of at most {SIZE_CLASSES[-1]} beacons")
