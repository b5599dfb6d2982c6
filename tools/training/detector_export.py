"""The C header of a trained beacon model: firmware/models/beacons.h."""

from __future__ import annotations

from collections.abc import Mapping

from bslam.cheader import Header, c_float, named_initialiser
from bslam.core.vision import BeaconModel, DetectorModel


def beacons_header(model: BeaconModel, notes: Mapping[str, str]) -> str:
    """The header that holds `static const bslam_beacon_model_t bslam_beacons_model`."""
    header = Header("BSLAM_MODELS_BEACONS_H", ["vision/vision.h"], notes)
    fields = {
        "class_count": str(len(model.classes)),
        "classes": header.classes("bslam_beacons_classes", model.classes),
        "pinhole": _detector(header, "bslam_beacons_pinhole", model.pinhole),
        "wide": _detector(header, "bslam_beacons_wide", model.wide),
    }
    header.constant("bslam_beacon_model_t", "bslam_beacons_model", named_initialiser(fields))
    return header.text()


def _detector(header: Header, name: str, detector: DetectorModel) -> str:
    return named_initialiser(
        {
            "cell": header.svm(f"{name}_cell", detector.cell),
            "glance": header.svm(f"{name}_glance", detector.glance),
            "glance_threshold": c_float(detector.glance_threshold),
            "blob_offset": header.array(f"{name}_offset", detector.blob_offset),
            "blob_scale": header.array(f"{name}_scale", detector.blob_scale),
            "screen": header.svm(f"{name}_screen", detector.screen),
            "screen_threshold": c_float(detector.screen_threshold),
            "any_threshold": c_float(detector.any_threshold),
            "kinds": header.additive(f"{name}_kinds", detector.kinds),
            "fusion": header.svm(f"{name}_fusion", detector.fusion),
            "fusion_threshold": c_float(detector.fusion_threshold),
            "close": header.hinged(f"{name}_close", detector.close),
            "verdict": header.svm(f"{name}_verdict", detector.verdict),
            "threshold": c_float(detector.threshold),
        },
        depth=2,
    )
