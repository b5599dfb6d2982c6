/// Hinged support vector machines: linear ones on bytes, each told twice, as it is and by how much it exceeds
/// a knot of its own. For hundreds of features of a picture, where the curves of additive.h would take too
/// much. MATH-CAMERA "Hinged SVM". Sums are whole numbers, the same on every core. Internal.
#ifndef BSLAM_VISION_BUILT_IN_CLASSIFIERS_HINGED_H
#define BSLAM_VISION_BUILT_IN_CLASSIFIERS_HINGED_H

#include "base/status.h"
#include "vision/model.h"

/// Looks a machine over, once, before its first use. BSLAM_E_COUNT: a count is out of range, or there are not
/// as many features as the caller computes. BSLAM_E_PARAMETER: a table is missing, a scale is below 0.
/// BSLAM_E_NOT_FINITE: a number is NaN, infinite or beyond 1e12.
BSLAM_MUST_CHECK bslam_status_t bslam_hinged_check(const bslam_hinged_t *machine, int32_t features);

/// values[r] = f_r(x) of all rows; the machine has passed bslam_hinged_check. About 5 instructions a feature
/// and row on a Cortex-M4F.
void bslam_hinged_decide(const bslam_hinged_t *machine, const uint8_t *x, float *values);

#endif
