"""The C library 1:1: one `Library` is one build. Nothing else in the package touches ffi."""

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import Any

from bslam.core.builds import REALS, SIZE_CLASSES, extension_name
from bslam.core.errors import CoreError
from bslam.errors import BslamError


class Library:
    """A build of the C library: `ffi` and `lib` of cffi, and its status names."""

    def __init__(self, real: str, beacons_max: int) -> None:
        try:
            module = import_module(extension_name(real, beacons_max))
        except ImportError as error:
            raise BslamError(f"the C library is not built ({error}): run `make setup`") from error
        self.real = real
        self.beacons_max = beacons_max
        self.ffi = module.ffi
        self.lib = module.lib

    def ensure(self, status: int, message: str) -> None:
        """Raises CoreError unless status is BSLAM_OK."""
        if status != self.lib.BSLAM_OK:
            raise CoreError(self.text(self.lib.bslam_status_name(status)), message)

    def text(self, pointer: Any) -> str:
        """A C string."""
        return self.ffi.string(pointer).decode()

    def fields(self, struct: Any, type_name: str) -> dict[str, Any]:
        """The members of a C struct of plain numbers, by name."""
        return {name: getattr(struct, name) for name, _ in self.ffi.typeof(type_name).fields}

    def enum_names(self, type_name: str, prefix: str) -> dict[int, str]:
        """Value -> name in lower case without the prefix."""
        elements = self.ffi.typeof(type_name).elements
        return {value: name.removeprefix(prefix).lower() for value, name in elements.items()}

    def sightings(self, rows: Sequence[tuple[float, float, int, bool, float, float]]) -> Any:
        """Rows (bearing_rad, range_m or NaN, label, mappable, bearing_sd_rad, range_sd_m) as a C array."""
        array = self.ffi.new("bslam_sighting_t[]", len(rows))
        not_mappable = 255  # BSLAM_CLASS_NOT_MAPPABLE; a macro has no place in an ffi declaration
        for sighting, row in zip(array, rows, strict=True):
            bearing_rad, range_m, label, mappable, bearing_sd_rad, range_sd_m = row
            sighting.bearing_rad = bearing_rad
            sighting.has_range = range_m == range_m
            sighting.range_m = range_m if range_m == range_m else 0.0
            sighting.beacon_class = 0 if mappable else not_mappable
            sighting.label = label
            sighting.bearing_sd_rad = bearing_sd_rad
            sighting.range_sd_m = range_sd_m
        return array


@cache
def library(real: str, beacons_max: int) -> Library:
    """The smallest build of scalar type `real` that holds beacons_max beacons."""
    if real not in REALS:
        raise BslamError(f"scalar type {real!r}: allowed are {', '.join(REALS)}")
    for size in SIZE_CLASSES:
        if size >= beacons_max >= 1:
            return Library(real, size)
    raise BslamError(
        f"{beacons_max} beacons: allowed are 1 to {SIZE_CLASSES[-1]}, as the largest build holds "
        "(core/builds.py, SIZE_CLASSES)"
    )
