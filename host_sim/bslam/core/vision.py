"""The vision front end of the C core: pictures in, beacon candidates out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.inputs import number, whole
from bslam.core.raw import VisionLibrary, vision_library
from bslam.core.scanner_tables import ScannerTables
from bslam.errors import BslamError
from bslam.modelfile import AdditiveSvm, BeaconClass, HingedSvm, Svm
from bslam.rig import Camera
from bslam.scannerfile import ScannerModel

Picture = NDArray[np.uint8] | NDArray[np.uint16]

SIGNATURE_SIZE = 71
"""Values of a signature."""

MARKS = (
    "cut_left",
    "cut_right",
    "cut_top",
    "cut_bottom",
    "small",
    "slanted",
    "part",
    "misplaced",
    "hidden",
)
"""Names of the bits of a candidate's marks, lowest first."""


@dataclass(frozen=True)
class DetectorModel:
    """The detector for one kind of lens, as bslam_detector_model_t describes it."""

    cell: Svm
    glance: Svm
    glance_threshold: float
    blob_offset: NDArray[np.float32]
    blob_scale: NDArray[np.float32]
    screen: Svm
    screen_threshold: float
    any_threshold: float
    kinds: AdditiveSvm
    fusion: Svm
    fusion_threshold: float
    close: HingedSvm
    verdict: Svm
    threshold: float


@dataclass(frozen=True)
class BeaconModel:
    """Everything trained: the kinds of beacons, and a detector for each kind of lens."""

    classes: tuple[BeaconClass, ...]
    pinhole: DetectorModel
    wide: DetectorModel


@dataclass(frozen=True)
class Told:
    """What a filter is told of a candidate beside its direction and distance (bslam_sighting_of)."""

    bearing_sd_rad: float
    range_sd_m: float  # 0: no distance
    range_scale_sd: float


@dataclass(frozen=True)
class Candidate:
    """A thing that is probably a beacon, as bslam_candidate_t describes it; None: not measured."""

    outline: tuple[float, float, float, float]  # left, top, right, bottom, px
    bearing_rad: float | None
    bearing_sd_rad: float | None
    range_m: float | None
    range_sd_m: float | None
    range_noise_sd_m: float | None  # the part of it that is another one in each frame
    beacon_class: int
    kind: str
    class_margin: float
    score: float
    marks: frozenset[str]
    misplaced_sds: float  # by how many standard deviations it hangs where its kind does not
    signature: NDArray[np.float32]  # (71,)
    told: Told | None  # None: it has no direction


@dataclass(frozen=True)
class Turn:
    """How far the robot turned since a camera's frame before, as bslam_turn_t describes it."""

    turn_rad: float
    variance_rad2: float
    mismatch: float
    parallax_rad_per_m: float
    parallax_sd_rad_per_m: float


@dataclass(frozen=True)
class Seeing:
    """What came of a frame: candidates, surest first; "seen", or why there is none ("black" say)."""

    candidates: tuple[Candidate, ...]
    reason: str
    turn: Turn | None = None  # since this camera's frame before, if the two tell


class FrontEnd:
    """One robot's cameras, taken in turn. The memory of the room starts empty."""

    def __init__(
        self,
        cameras: Sequence[Camera],
        model: BeaconModel | ScannerModel | None = None,
        threshold: float | None = None,
    ) -> None:
        """`model`: the built-in one unless given, or a scanner's of a user's own kinds. `threshold`: of a
        candidate's score, in place of the model's; not with a scanner's.

        BslamError if the library refuses model or cameras.
        """
        self._library = self._open()
        ffi, lib = self._library.ffi, self._library.lib
        self._cameras = tuple(cameras)
        self._keep: list[Any] = []
        self._vision = ffi.new("bslam_vision_t *")
        array = ffi.new("bslam_camera_t[]", [self._library.camera(camera)[0] for camera in cameras])
        if isinstance(model, ScannerModel):
            tables = ScannerTables(self._library, model)
            self._keep.append(tables)
            self._kinds, self._model, init = tables.names, tables.model, lib.bslam_vision_init_scanner_sized
        else:
            self._model = self._detector_model(model, threshold)
            self._kinds = self._class_names(self._model)
            init = lib.bslam_vision_init_sized
        self._library.ensure(
            init(
                self._vision,
                *self._library.size_of("bslam_vision_t"),
                self._model,
                array,
                len(self._cameras),
            ),
            f"the front end refuses its model or one of its {len(self._cameras)} cameras",
        )

    def _detector_model(self, model: BeaconModel | None, threshold: float | None) -> Any:
        ffi = self._library.ffi
        made = self._library.lib.built_in_model() if model is None else self._new_model(model)
        if made == ffi.NULL:
            raise BslamError("no built-in model: run `make train`, or give one")
        made = ffi.new("bslam_beacon_model_t *", made[0])
        if threshold is not None:
            made.pinhole.threshold = made.wide.threshold = threshold
        return made

    def _class_names(self, model: Any) -> list[str]:
        return [self._library.ffi.string(model.classes[i].name).decode() for i in range(model.class_count)]

    @staticmethod
    def _open() -> VisionLibrary:
        """The build of the library that this front end uses."""
        return vision_library()

    def see(self, rgb: Picture, camera: int = 0, moved: bool = True) -> Seeing:
        """Looks at a picture of a camera by its index: (height, width, 3) uint8, or (height, width) uint16 of
        RGB565; C-contiguous.

        `moved`: the robot moved since this camera's picture before. BslamError for another shape, dtype or
        camera than allowed.
        """
        self._stream(rgb, None, camera)
        self._library.ensure(self._library.lib.bslam_vision_end(self._vision, moved), "the end of a frame")
        return Seeing(tuple(self._candidates()), self._last_reason(), self._turn())

    def see_part(self, rgb: Picture, rows: int, camera: int = 0) -> tuple[str, str]:
        """The same of a picture of which only the upper rows come: with which status it is refused, and why
        nothing is seen.
        """
        self._stream(rgb, rows, camera)
        lib = self._library.lib
        status = lib.bslam_vision_end(self._vision, True)
        return self._library.ffi.string(lib.bslam_status_name(status)).decode(), self._last_reason()

    def _stream(self, rgb: Picture, rows: int | None, camera: int) -> None:
        """Begins a frame, and gives its upper rows; None: all."""
        lib = self._library.lib
        self._check_picture(rgb, self._checked_camera(camera))
        height, width = rgb.shape[:2]
        pixels_are = lib.BSLAM_PIXELS_RGB888 if rgb.ndim == 3 else lib.BSLAM_PIXELS_RGB565
        begun = lib.bslam_vision_begin(self._vision, camera, pixels_are, width, height)
        self._library.ensure(begun, f"a frame of {width}x{height} for camera {camera}")
        pixels = self._library.pixels(rgb)
        for row in range(height if rows is None else rows):
            self._library.ensure(
                lib.bslam_vision_row(self._vision, pixels + row * rgb.strides[0]), f"row {row}"
            )

    def _last_reason(self) -> str:
        return self._reason(self._library.lib.bslam_vision_reason(self._vision))

    def _turn(self) -> Turn | None:
        found = self._library.ffi.new("bslam_turn_t *")
        if not self._library.lib.bslam_vision_turn(self._vision, found):
            return None
        return Turn(**{one.name: getattr(found, one.name) for one in fields(Turn)})

    def threshold(self, camera: int = 0) -> float:
        """The score from which on a box in a camera's pictures is a candidate; of the built-in detector."""
        model, kind = self._model, self._cameras[self._checked_camera(camera)].lens.kind
        return float((model.pinhole if kind == "pinhole" else model.wide).threshold)

    def point(self, camera: int, yaw_rad: float) -> None:
        """Turns a camera on a pan unit. BslamError: no such camera, or |yaw| above pi."""
        yaw = number(yaw_rad, f"camera {camera}: yaw_rad")
        status = self._library.lib.bslam_vision_point(self._vision, self._checked_camera(camera), yaw)
        self._library.ensure(status, f"camera {camera} turned to {yaw_rad} rad")

    def counts(self) -> dict[str, int]:
        """How many frames there were so far, by what came of them."""
        frames = self._library.lib.bslam_vision_counters(self._vision).frames
        return {self._reason(number): count for number, count in enumerate(frames)}

    def _checked_camera(self, camera: int) -> int:
        return whole(camera, "camera", (0, len(self._cameras) - 1))

    def _check_picture(self, rgb: Picture, camera: int) -> None:
        lens = self._cameras[camera].lens
        colour, packed = (lens.height_px, lens.width_px, 3), (lens.height_px, lens.width_px)
        what = (getattr(rgb, "shape", "none"), getattr(rgb, "dtype", type(rgb).__name__))
        if what not in ((colour, np.uint8), (packed, np.uint16)) or not rgb.flags.c_contiguous:
            raise BslamError(
                f"a picture of shape {what[0]}, {what[1]}: allowed for camera {camera}, C-contiguous: "
                f"{colour} uint8, or {packed} uint16 (RGB565)"
            )

    def _reason(self, number: int) -> str:
        return self._library.ffi.string(self._library.lib.bslam_vision_reason_name(number)).decode()

    def _candidates(self) -> list[Candidate]:
        count = self._library.ffi.new("int32_t *")
        found = self._library.lib.bslam_vision_candidates(self._vision, count)
        return [self._candidate(found[i]) for i in range(count[0])]

    def _candidate(self, found: Any) -> Candidate:
        box = found.outline
        name = self._kinds[found.beacon_class - 1] if found.beacon_class > 0 else ""
        return Candidate(
            outline=(box.left_px, box.top_px, box.right_px, box.bottom_px),
            bearing_rad=found.bearing_rad if found.has_bearing else None,
            bearing_sd_rad=found.bearing_sd_rad if found.has_bearing else None,
            range_m=found.range_m if found.has_range else None,
            range_sd_m=found.range_sd_m if found.has_range else None,
            range_noise_sd_m=found.range_noise_sd_m if found.has_range else None,
            beacon_class=found.beacon_class,
            kind=name,
            class_margin=found.class_margin,
            score=found.score,
            marks=frozenset(name for bit, name in enumerate(MARKS) if found.marks >> bit & 1),
            misplaced_sds=found.misplaced_sds,
            signature=self._library.copy_of(found.signature, SIGNATURE_SIZE, np.float32),
            told=self._told(found) if found.has_bearing else None,
        )

    def _told(self, found: Any) -> Told:
        sighting = self._library.lib.bslam_sighting_of(self._library.ffi.addressof(found))
        return Told(sighting.bearing_sd_rad, sighting.range_sd_m, sighting.range_scale_sd)

    def _new_model(self, model: BeaconModel) -> Any:
        return self._library.new_filled(
            "bslam_beacon_model_t",
            class_count=len(model.classes),
            classes=self._classes(model.classes),
            pinhole=self._detector(model.pinhole),
            wide=self._detector(model.wide),
        )

    def _classes(self, classes: Sequence[BeaconClass]) -> Any:
        ffi = self._library.ffi
        names = [ffi.new("char[]", one.name.encode()) for one in classes]
        rows = [(name, *astuple(one)[1:]) for name, one in zip(names, classes, strict=True)]
        table = ffi.new("bslam_beacon_class_t[]", rows)
        self._keep += [*names, table]
        return table

    def _detector(self, model: DetectorModel) -> Any:
        library, keep = self._library, self._keep
        made = library.new_filled(
            "bslam_detector_model_t",
            cell=library.svm(model.cell, keep),
            glance=library.svm(model.glance, keep),
            glance_threshold=model.glance_threshold,
            blob_offset=library.table("float", model.blob_offset, keep),
            blob_scale=library.table("float", model.blob_scale, keep),
            screen=library.svm(model.screen, keep),
            screen_threshold=model.screen_threshold,
            any_threshold=model.any_threshold,
            kinds=library.additive(model.kinds, keep),
            fusion=library.svm(model.fusion, keep),
            fusion_threshold=model.fusion_threshold,
            close=library.hinged(model.close, keep),
            verdict=library.svm(model.verdict, keep),
            threshold=model.threshold,
        )
        keep.append(made)
        return made[0]
