#include "vision/built_in/classifiers/beacon_model.h"

#include <stddef.h>

#include "base/scalar.h"
#include "vision/frame.h"

/// A machine of one row. A quadratic one has more weights than who asks for a linear one would give it.
static bslam_status_t check_svm(const bslam_svm_t *svm, int32_t features, bool may_be_quadratic)
{
    if (svm->rows != 1) {
        return BSLAM_E_COUNT;
    }
    return svm->quadratic && !may_be_quadratic ? BSLAM_E_PARAMETER : bslam_svm_check(svm, features);
}

static bslam_status_t check_detector(const bslam_detector_model_t *detector, int32_t class_count)
{
    const struct {
        const bslam_svm_t *svm;
        int32_t features;
        bool may_be_quadratic;
    } parts[] = {
        {&detector->cell, BSLAM_CELL_FEATURES, false},   {&detector->glance, BSLAM_GLANCE_FEATURES, false},
        {&detector->screen, BSLAM_BLOB_FEATURES, false}, {&detector->fusion, class_count + 3, true},
        {&detector->verdict, class_count + 4, true},
    };
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        const bslam_status_t status = check_svm(parts[i].svm, parts[i].features, parts[i].may_be_quadratic);
        if (status != BSLAM_OK) {
            return status;
        }
    }
    if (detector->kinds.rows != class_count + 2 || detector->close.rows != class_count + 2) {
        return BSLAM_E_COUNT;
    }
    bslam_status_t status = bslam_additive_check(&detector->kinds, BSLAM_BLOB_FEATURES);
    if (status == BSLAM_OK) {
        status = bslam_hinged_check(&detector->close, BSLAM_CLOSE_FEATURES);
    }
    if (status != BSLAM_OK) {
        return status;
    }
    const float limits[] = {detector->glance_threshold, detector->screen_threshold, detector->any_threshold,
                            detector->fusion_threshold, detector->threshold};
    if (!bslam_are_numbers(limits, sizeof limits / sizeof limits[0]) ||
        !bslam_are_numbers(detector->blob_offset, BSLAM_BLOB_FEATURES) ||
        !bslam_are_numbers(detector->blob_scale, BSLAM_BLOB_FEATURES)) {
        return BSLAM_E_NOT_FINITE;
    }
    return BSLAM_OK;
}

bslam_status_t bslam_beacon_model_check(const bslam_beacon_model_t *model)
{
    if (model->class_count < 1 || model->class_count > BSLAM_CLASSES_MAX) {
        return BSLAM_E_COUNT;
    }
    for (int32_t c = 0; c < model->class_count; c++) {
        if (!bslam_in_range((bslam_real_t)model->classes[c].height_m, 0, 10)) {
            return BSLAM_E_RANGE;
        }
    }
    const bslam_status_t status = check_detector(&model->pinhole, model->class_count);
    if (status != BSLAM_OK) {
        return status;
    }
    return check_detector(&model->wide, model->class_count);
}
