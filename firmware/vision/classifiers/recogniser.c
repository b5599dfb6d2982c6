#include "vision/classifiers/recogniser.h"

#include <stddef.h>

#include "base/scalar.h"

bslam_status_t bslam_recogniser_check(const bslam_recogniser_t *recogniser)
{
    // First what says how long the tables are.
    if (recogniser->svm.rows > BSLAM_OBJECTS_MAX) {
        return BSLAM_E_COUNT;
    }
    if (recogniser->svm.quadratic || recogniser->objects == NULL) {
        return BSLAM_E_PARAMETER;
    }
    const bslam_status_t status = bslam_svm_check(&recogniser->svm, BSLAM_SIGNATURE_SIZE);
    if (status != BSLAM_OK) {
        return status;
    }
    for (int32_t i = 0; i < recogniser->svm.rows; i++) {
        if (!bslam_in_range((bslam_real_t)recogniser->objects[i].height_m, 0, 10)) {
            return BSLAM_E_RANGE;
        }
    }
    return bslam_is_number((bslam_real_t)recogniser->reject_margin) ? BSLAM_OK : BSLAM_E_NOT_FINITE;
}

static bool is_taken(const float signature[BSLAM_SIGNATURE_SIZE])
{
    for (int32_t i = 0; i < BSLAM_SIGNATURE_SIZE; i++) {
        if (signature[i] != 0) {
            return true;
        }
    }
    return false;
}

int16_t bslam_recognise(const bslam_recogniser_t *recogniser, const float signature[BSLAM_SIGNATURE_SIZE],
                        float *margin)
{
    if (!is_taken(signature)) {
        *margin = 0;
        return BSLAM_OBJECT_NONE;
    }
    float values[BSLAM_OBJECTS_MAX];
    bslam_svm_decide(&recogniser->svm, signature, values);
    int32_t best = 0;
    for (int32_t i = 1; i < recogniser->svm.rows; i++) {
        best = values[i] > values[best] ? i : best;
    }
    *margin = values[best];
    return values[best] >= recogniser->reject_margin ? (int16_t)best : BSLAM_OBJECT_NONE;
}
