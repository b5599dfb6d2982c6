/// A beacon model that a test fills in: machines of the right sizes that decide 0.
#ifndef UNIT_BLANK_MODEL_H
#define UNIT_BLANK_MODEL_H

#include "vision/built_in/classifiers/beacon_model.h"

#define UNIT_MODEL_CLASSES 2

typedef struct unit_detector {
    float cell_weights[BSLAM_CELL_FEATURES];
    float blob_offset[BSLAM_BLOB_FEATURES];
    float blob_scale[BSLAM_BLOB_FEATURES];
    float glance_weights[BSLAM_GLANCE_FEATURES];
    float screen_weights[BSLAM_BLOB_FEATURES];
    float knots[BSLAM_BLOB_FEATURES * BSLAM_KNOTS];
    int8_t kind_weights[BSLAM_ADDITIVE_BYTES(UNIT_MODEL_CLASSES + 2, BSLAM_BLOB_FEATURES, 0)];
    float kind_scale[UNIT_MODEL_CLASSES + 2];
    float kind_bias[UNIT_MODEL_CLASSES + 2];
    float fusion_weights[UNIT_MODEL_CLASSES + 3];
    uint8_t close_knots[BSLAM_CLOSE_FEATURES];
    int8_t close_weights[BSLAM_HINGED_BYTES(UNIT_MODEL_CLASSES + 2, BSLAM_CLOSE_FEATURES)];
    float close_scale[UNIT_MODEL_CLASSES + 2];
    float close_bias[UNIT_MODEL_CLASSES + 2];
    float verdict_weights[UNIT_MODEL_CLASSES + 4];
    float cell_bias, glance_bias, screen_bias, fusion_bias, verdict_bias;
} unit_detector_t;

/// Machines that view the tables of `detector`, which are set to 0, scales to 1; both lenses share it.
/// Everything passes the glance, the screen and the fusion, whose value is the verdict; its threshold is 0.
bslam_beacon_model_t unit_blank_model(unit_detector_t *detector);

#endif
