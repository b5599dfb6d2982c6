"""A detector that finds nothing, so that what is tested does not depend on the one that was trained."""

from bslam.core.vision import BeaconModel
from tools.training.detector_samples import blank_detector, model_of


def blind_model() -> BeaconModel:
    """For both kinds of lens."""
    return model_of(blank_detector())
