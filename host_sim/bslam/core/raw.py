"""The C library 1:1: one `Library` is one build. Nothing else in the package touches ffi."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib import import_module
from itertools import count
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bslam.core.builds import REALS, SIZE_CLASSES, VISION_EXTENSION, extension_name
from bslam.core.errors import CoreError
from bslam.errors import BslamError, did_you_mean
from bslam.modelfile import AdditiveSvm, HingedSvm, Svm
from bslam.rig import Camera

BUILD_IT = "run `make setup` in a clone, or install the package anew"


class Library:
    """A build of the estimator: `ffi` and `lib` of cffi, and the names of its enums."""

    def __init__(self, real: str, beacons_max: int) -> None:
        try:
            module = import_module(extension_name(real, beacons_max))
        except ImportError as error:
            raise BslamError(f"the C library is not built ({error}): {BUILD_IT}") from error
        self.real = real
        self.beacons_max = beacons_max
        self.ffi = module.ffi
        self.lib = module.lib
        self.sources = self.text(self.lib.SOURCES_DIGEST)
        """SHA-256 of the C sources that it was made of."""
        self.map_faults = self.enum_names("bslam_map_fault_t", "BSLAM_MAP_", space=" ")
        _answer_callbacks(self.ffi)

    def ensure(self, status: int, message: str, allowed: Mapping[str, str] = MappingProxyType({})) -> None:
        """Raises CoreError unless status is BSLAM_OK. allowed: words on what is, by the status's name."""
        if status != self.lib.BSLAM_OK:
            name = self.text(self.lib.bslam_status_name(status))
            raise CoreError(name, f"{message}: allowed is {allowed[name]}" if name in allowed else message)

    def settings_infos(self) -> Iterator[Any]:
        """Every line of the tables of settings."""
        for number in count():
            info = self.lib.bslam_settings_info(number)
            if info == self.ffi.NULL:
                return
            yield info

    def text(self, pointer: Any) -> str:
        """A C string."""
        return self.ffi.string(pointer).decode()

    def fields(self, struct: Any) -> dict[str, Any]:
        """The members of a C struct of plain numbers, by name."""
        return {name: getattr(struct, name) for name, _ in self.ffi.typeof(struct).fields}

    def enum_names(self, type_name: str, prefix: str, space: str = "_") -> dict[int, str]:
        """Value -> name in lower case without the prefix, with `space` between its words."""
        elements = self.ffi.typeof(type_name).elements
        return {
            value: name.removeprefix(prefix).lower().replace("_", space) for value, name in elements.items()
        }

    def sightings(
        self,
        rows: Sequence[tuple[float, float, int, int, float, float, float, float]],
        signature: NDArray[np.float32] | None = None,
    ) -> Any:
        """Rows as a C array.

        A row: bearing_rad, range_m or NaN, label, beacon_class, bearing_sd_rad, range_sd_m, range_scale_sd,
        score.

        signature: (rows, n) float32, C-contiguous; the array is good as long as it is.
        """
        array = self.ffi.new("bslam_sighting_t[]", len(rows))
        for sighting, row in zip(array, rows, strict=True):
            bearing_rad, range_m, label, beacon_class, *noise, score = row
            sighting.bearing_rad = bearing_rad
            sighting.has_range = range_m == range_m
            sighting.range_m = range_m if range_m == range_m else 0.0
            sighting.beacon_class = beacon_class
            sighting.label = label
            sighting.bearing_sd_rad, sighting.range_sd_m, sighting.range_scale_sd = noise
            sighting.score = score
        if signature is not None and len(rows) > 0:
            first = self.ffi.from_buffer("float[]", signature)
            for index, sighting in enumerate(array):
                sighting.signature = first + index * signature.shape[1]
        return array


class Flash(Protocol):
    """Two slots that keep a map over a power cut, as bslam_flash_t describes them. False: it failed."""

    slot_bytes: int

    def erase(self, slot: int) -> bool:
        """All of a slot becomes 0xff."""

    def write(self, slot: int, at: int, data: bytes) -> bool:
        """From a place in a slot on."""

    def read(self, slot: int, at: int, size: int) -> bytes:
        """So many bytes from there."""


def _answer_callbacks(ffi: Any) -> None:
    """Binds what C calls. A context is the handle of what answers: a sink's bytearray, a source's bytes, or
    a `Flash`.
    """

    @ffi.def_extern(error=False)
    def sink_write(context: Any, data: Any, size: int) -> bool:
        ffi.from_handle(context).extend(ffi.buffer(data, size))
        return True

    @ffi.def_extern(error=False)
    def source_read(context: Any, at: int, data: Any, size: int) -> bool:
        ffi.memmove(data, ffi.from_handle(context)[at : at + size], size)
        return True

    @ffi.def_extern(error=False)
    def flash_erase(context: Any, slot: int) -> bool:
        return bool(ffi.from_handle(context).erase(slot))

    @ffi.def_extern(error=False)
    def flash_write(context: Any, slot: int, at: int, data: Any, size: int) -> bool:
        return bool(ffi.from_handle(context).write(slot, at, bytes(ffi.buffer(data, size))))

    @ffi.def_extern(error=False)
    def flash_read(context: Any, slot: int, at: int, data: Any, size: int) -> bool:
        ffi.memmove(data, ffi.from_handle(context).read(slot, at, size), size)
        return True


@cache
def library(real: str, beacons_max: int) -> Library:
    """The smallest build of scalar type `real` that holds beacons_max beacons."""
    if real not in REALS:
        near = did_you_mean(real, REALS)
        raise BslamError(f"scalar type {real!r}: allowed are {', '.join(REALS)}{near}")
    for size in SIZE_CLASSES:
        if size >= beacons_max >= 1:
            return Library(real, size)
    raise BslamError(
        f"{beacons_max} beacons: allowed are 1 to {SIZE_CLASSES[-1]}, as the largest build holds "
        "(core/builds.py, SIZE_CLASSES)"
    )


class VisionLibrary:
    """The vision library 1:1: `ffi` and `lib` of cffi, and C views on machines and models."""

    def __init__(self, module: Any) -> None:
        self.ffi = module.ffi
        self.lib = module.lib
        self.sources: str = self.ffi.string(self.lib.SOURCES_DIGEST).decode()
        """SHA-256 of the C sources that it was made of."""

    def ensure(self, status: int, message: str) -> None:
        """Raises CoreError unless status is BSLAM_OK."""
        if status != self.lib.BSLAM_OK:
            raise CoreError(self.ffi.string(self.lib.bslam_status_name(status)).decode(), message)

    def size_of(self, type_name: str) -> tuple[int, int]:
        """Bytes of an instance and the hash of the sizes, as the init macros of the header give them."""
        return self.ffi.sizeof(type_name), self.lib.BSLAM_VISION_HASH

    def new_filled(self, type_name: str, **values: Any) -> Any:
        """A struct with these members set and all else zero."""
        struct = self.ffi.new(f"{type_name} *")
        for name, value in values.items():
            setattr(struct, name, value)
        return struct

    def table(self, kind: str, values: NDArray[Any], keep: list[Any]) -> Any:
        """A C array of `kind` that holds a copy of the values; `keep` keeps it alive."""
        array = self.ffi.new(f"{kind}[]", values.ravel().tolist())
        keep.append(array)
        return array

    def svm(self, svm: Svm, keep: list[Any]) -> Any:
        """A bslam_svm_t; `keep` keeps its tables alive."""
        made = self.new_filled(
            "bslam_svm_t",
            rows=svm.rows,
            features=svm.features,
            quadratic=svm.quadratic,
            bias=self.table("float", svm.bias, keep),
        )
        if svm.byte_scale is None:
            made.weights = self.table("float", svm.weights, keep)
        else:
            made.bytes = self.table("int8_t", svm.weights, keep)
            made.byte_scale = self.table("float", svm.byte_scale, keep)
        keep.append(made)
        return made[0]

    def additive(self, machine: AdditiveSvm, keep: list[Any]) -> Any:
        """A bslam_additive_t; `keep` keeps its tables alive."""
        made = self.new_filled(
            "bslam_additive_t",
            rows=machine.rows,
            features=machine.features,
            knots=self.table("float", machine.knots, keep),
            crossed_count=len(machine.crossed),
            crossed=self.table("uint8_t", machine.crossed, keep),
            bytes=self.table("int8_t", machine.paired, keep),
            byte_scale=self.table("float", machine.byte_scale, keep),
            bias=self.table("float", machine.bias, keep),
        )
        keep.append(made)
        return made[0]

    def hinged(self, machine: HingedSvm, keep: list[Any]) -> Any:
        """A bslam_hinged_t; `keep` keeps its tables alive."""
        made = self.new_filled(
            "bslam_hinged_t",
            rows=machine.rows,
            features=machine.features,
            knots=self.table("uint8_t", machine.knots, keep),
            bytes=self.table("int8_t", machine.paired, keep),
            byte_scale=self.table("float", machine.byte_scale, keep),
            bias=self.table("float", machine.bias, keep),
        )
        keep.append(made)
        return made[0]

    def camera(self, camera: Camera) -> Any:
        """A bslam_camera_t."""
        lens = camera.lens
        kinds = {
            "pinhole": self.lib.BSLAM_LENS_PINHOLE,
            "equidistant": self.lib.BSLAM_LENS_EQUIDISTANT,
        }
        same = ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2")
        return self.new_filled(
            "bslam_camera_t",
            lens=kinds[lens.kind],
            yaw_rad=camera.yaw_rad,
            pitch_rad=camera.pitch_rad,
            z_m=camera.z_m,
            zoom=camera.zoom,
            **{name: getattr(lens, name) for name in same},
        )

    def pixels(self, rgb: NDArray[Any]) -> Any:
        """The bytes of a C-contiguous picture, good as long as the array is."""
        return self.ffi.cast("uint8_t *", rgb.ctypes.data)

    def floats(self, array: NDArray[np.float32]) -> Any:
        """The numbers of a C-contiguous float32 array, to be written by C."""
        return self.ffi.cast("float *", array.ctypes.data)

    def bytes(self, array: NDArray[np.uint8]) -> Any:
        """The numbers of a C-contiguous uint8 array, to be written by C."""
        return self.ffi.cast("uint8_t *", array.ctypes.data)

    def shorts(self, array: NDArray[np.int16]) -> Any:
        """The numbers of a C-contiguous int16 array, to be written by C."""
        return self.ffi.cast("int16_t *", array.ctypes.data)

    def copy_of(self, pointer: Any, count: int, dtype: Any) -> NDArray[Any]:
        """`count` numbers from a C array, copied."""
        size = count * np.dtype(dtype).itemsize
        return np.frombuffer(self.ffi.buffer(pointer, size), dtype=dtype).copy()


@cache
def vision_library() -> VisionLibrary:
    """The one build of the vision library."""
    try:
        return VisionLibrary(import_module(VISION_EXTENSION))
    except ImportError as error:
        raise BslamError(f"the vision library is not built ({error}): {BUILD_IT}") from error
