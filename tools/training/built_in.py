"""The detectors that are compiled into the core, as training makes them: so that one lens can be trained anew
and the other stays as it is."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.raw import vision_library
from bslam.core.vision import DetectorModel
from bslam.modelfile import AdditiveSvm, HingedSvm, Svm, weights_in_row
from tools.training.additive import KNOTS, weights_of


def built_in_detector(lens: str) -> DetectorModel:
    """That of a kind of lens, "pinhole" or "wide"."""
    made = getattr(vision_library().lib.built_in_model(), lens)
    features = made.screen.features
    return DetectorModel(
        cell=_svm(made.cell),
        glance=_svm(made.glance),
        glance_threshold=made.glance_threshold,
        blob_offset=_copy(made.blob_offset, features, np.float32),
        blob_scale=_copy(made.blob_scale, features, np.float32),
        screen=_svm(made.screen),
        screen_threshold=made.screen_threshold,
        any_threshold=made.any_threshold,
        kinds=_additive(made.kinds),
        fusion=_svm(made.fusion),
        fusion_threshold=made.fusion_threshold,
        close=_hinged(made.close),
        verdict=_svm(made.verdict),
        threshold=made.threshold,
    )


def _copy(pointer: Any, count: int, dtype: type) -> NDArray[Any]:
    return vision_library().copy_of(pointer, count, dtype)


def _svm(made: Any) -> Svm:
    shape = made.rows, weights_in_row(made.features, made.quadratic)
    is_bytes = made.weights == vision_library().ffi.NULL
    source, dtype = (made.bytes, np.int8) if is_bytes else (made.weights, np.float32)
    weights = _copy(source, shape[0] * shape[1], dtype).reshape(shape)
    scale = _copy(made.byte_scale, made.rows, np.float32) if is_bytes else None
    return Svm(made.features, made.quadratic, weights, _copy(made.bias, made.rows, np.float32), scale)


def _additive(made: Any) -> AdditiveSvm:
    row, pair_count = weights_of(made.features, made.crossed_count), (made.rows + 1) // 2
    pairs = _copy(made.bytes, 2 * pair_count * row, np.int8).reshape(pair_count, row, 2)
    return AdditiveSvm(
        _copy(made.knots, made.features * KNOTS, np.float32).reshape(-1, KNOTS),
        _copy(made.crossed, made.crossed_count, np.uint8),
        pairs.transpose(0, 2, 1).reshape(-1, row)[: made.rows],
        _copy(made.byte_scale, made.rows, np.float32),
        _copy(made.bias, made.rows, np.float32),
    )


def _hinged(made: Any) -> HingedSvm:
    pair_count = (made.rows + 1) // 2
    pairs = _copy(made.bytes, 4 * pair_count * made.features, np.int8).reshape(pair_count, -1, 2, 2)
    return HingedSvm(
        _copy(made.knots, made.features, np.uint8),
        pairs.transpose(0, 3, 1, 2).reshape(2 * pair_count, -1, 2)[: made.rows],
        _copy(made.byte_scale, made.rows, np.float32),
        _copy(made.bias, made.rows, np.float32),
    )
