#include "blank_model.h"

#include <string.h>

static const bslam_beacon_class_t classes[UNIT_MODEL_CLASSES] = {
    {.name = "tall", .height_m = 2.0f},
    {.name = "small", .height_m = 0.3f},
};

static bslam_svm_t classifier(int32_t rows, int32_t features, bool quadratic, const float *weights,
                              const float *bias)
{
    const bslam_svm_t svm = {
        .rows = rows, .features = features, .quadratic = quadratic, .weights = weights, .bias = bias};
    return svm;
}

bslam_beacon_model_t unit_blank_model(unit_detector_t *detector)
{
    unit_detector_t *d = detector;
    memset(d, 0, sizeof *d);
    for (int i = 0; i < BSLAM_BLOB_FEATURES; i++) {
        d->blob_scale[i] = 1;
        for (int k = 0; k < BSLAM_KNOTS; k++) {
            d->knots[i * BSLAM_KNOTS + k] = (float)k;
        }
    }
    d->verdict_weights[0] = 1;
    const bslam_detector_model_t views = {
        .cell = classifier(1, BSLAM_CELL_FEATURES, false, d->cell_weights, &d->cell_bias),
        .glance = classifier(1, BSLAM_GLANCE_FEATURES, false, d->glance_weights, &d->glance_bias),
        .glance_threshold = -1e6f,
        .blob_offset = d->blob_offset,
        .blob_scale = d->blob_scale,
        .screen = classifier(1, BSLAM_BLOB_FEATURES, false, d->screen_weights, &d->screen_bias),
        .screen_threshold = -1e6f,
        .any_threshold = -1e6f,
        .kinds = {.rows = UNIT_MODEL_CLASSES + 2,
                  .features = BSLAM_BLOB_FEATURES,
                  .knots = d->knots,
                  .bytes = d->kind_weights,
                  .byte_scale = d->kind_scale,
                  .bias = d->kind_bias},
        .fusion = classifier(1, UNIT_MODEL_CLASSES + 3, false, d->fusion_weights, &d->fusion_bias),
        .fusion_threshold = -1e6f,
        .close = {.rows = UNIT_MODEL_CLASSES + 2,
                  .features = BSLAM_CLOSE_FEATURES,
                  .knots = d->close_knots,
                  .bytes = d->close_weights,
                  .byte_scale = d->close_scale,
                  .bias = d->close_bias},
        .verdict = classifier(1, UNIT_MODEL_CLASSES + 4, false, d->verdict_weights, &d->verdict_bias),
        .threshold = 0,
    };
    const bslam_beacon_model_t model = {
        .class_count = UNIT_MODEL_CLASSES, .classes = classes, .pinhole = views, .wide = views};
    return model;
}
