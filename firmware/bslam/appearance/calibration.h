/// What a sighting's appearance says, as log odds: coefficients that `python -m tools.training.appearance`
/// fits on drives apart from all tests. Internal. MATH (44).
#ifndef BSLAM_APPEARANCE_CALIBRATION_H
#define BSLAM_APPEARANCE_CALIBRATION_H

#include <stdbool.h>

#include "bslam/settings.h"

/// log odds = offset + distance d + value v + ln(n) (more + more_distance d + more_value v): of a distance d
/// to what a classifier keeps of its beacon, its decision value v and the n samples that it keeps.
typedef struct bslam_calibration {
    float offset, distance, value, more, more_distance, more_value;
    bool to_middle;  ///< d is to the middle of all samples, not to the nearest one
} bslam_calibration_t;

/// Of a value of `association` that learns appearance.
const bslam_calibration_t *bslam_calibration_of(int32_t association);

#endif
