"""A detector that finds nothing, so that what is tested does not depend on the one that was trained."""

import numpy as np

from bslam.core.vision import BeaconModel, DetectorModel, feature_counts
from bslam.modelfile import BeaconClass, Svm, weights_in_row


def blind_model() -> BeaconModel:
    """For both kinds of lens; its one kind of beacon is never seen."""
    cells, blobs = feature_counts()
    kinds, fusion = _never(3, blobs, quadratic=True), _never(1, 4)
    offset, scale = np.zeros(blobs, np.float32), np.ones(blobs, np.float32)
    detector = DetectorModel(_never(1, cells), offset, scale, _never(1, blobs), 0.0, kinds, fusion, 0.0)
    return BeaconModel((BeaconClass("thing"),), detector, detector)


def _never(rows: int, features: int, quadratic: bool = False) -> Svm:
    weights = np.zeros((rows, weights_in_row(features, quadratic)), np.float32)
    return Svm(features, quadratic, weights, np.full(rows, -1.0, np.float32))
