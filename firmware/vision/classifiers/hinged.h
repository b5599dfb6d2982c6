/// Hinged support vector machines: linear ones on bytes, each told twice, as it is and by how much it exceeds
/// a knot of its own: by that explicit expansion every feature has a curve of two straight parts in each row.
/// For hundreds of features of a picture, where the curves of additive.h would take too much. MATH-CAMERA
/// "Hinged SVM".
///
/// A machine is a view of constant tables, as in svm.h. Sums are whole numbers, the same on every core.
#ifndef BSLAM_VISION_CLASSIFIERS_HINGED_H
#define BSLAM_VISION_CLASSIFIERS_HINGED_H

#include <stdint.h>

#include "base/status.h"

enum { BSLAM_HINGED_FEATURES_MAX = 512 };

/// Bytes of a machine's weights: rows stand in pairs, after an odd number of them comes one of zeros. A pair
/// has a word a feature: both rows' weights of the byte, then both rows' weights of what is above the knot.
#define BSLAM_HINGED_BYTES(rows, features) (((rows) + 1) / 2 * 4 * (features))

typedef struct bslam_hinged {
    int32_t rows;             ///< a class each, against the rest
    int32_t features;         ///< length of x
    const uint8_t *knots;     ///< one a feature
    const int8_t *bytes;      ///< BSLAM_HINGED_BYTES; a byte stands for byte * byte_scale[row]
    const float *byte_scale;  ///< rows values, not negative
    const float *bias;        ///< rows values
} bslam_hinged_t;

/// Looks a machine over, once, before its first use. BSLAM_E_COUNT: a count is out of range, or there are not
/// as many features as the caller computes. BSLAM_E_PARAMETER: a table is missing, a scale is below 0.
/// BSLAM_E_NOT_FINITE: a number is NaN, infinite or beyond 1e12.
BSLAM_MUST_CHECK bslam_status_t bslam_hinged_check(const bslam_hinged_t *machine, int32_t features);

/// values[r] = f_r(x) of all rows; the machine has passed bslam_hinged_check. About 5 instructions a feature
/// and row on a Cortex-M4F.
void bslam_hinged_decide(const bslam_hinged_t *machine, const uint8_t *x, float *values);

#endif
