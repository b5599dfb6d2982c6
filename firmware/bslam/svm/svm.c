#include "bslam/svm/svm.h"

#include <stddef.h>

#include "bslam/base/real.h"

static int32_t weights_in_row(const bslam_svm_t *svm)
{
    return BSLAM_SVM_WEIGHTS(svm->features, svm->quadratic);
}

static bool all_numbers(const float *values, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        if (!bslam_is_number(values[i])) {
            return false;
        }
    }
    return true;
}

static bool has_tables(const bslam_svm_t *svm)
{
    const bool one_kind = (svm->weights == NULL) != (svm->bytes == NULL);
    return one_kind && svm->bias != NULL && (svm->bytes == NULL || svm->byte_scale != NULL);
}

bslam_status_t bslam_svm_check(const bslam_svm_t *svm, int32_t features)
{
    if (svm->rows < 1 || svm->rows > BSLAM_SVM_ROWS_MAX || features < 1 ||
        features > BSLAM_SVM_FEATURES_MAX || svm->features != features) {
        return BSLAM_E_COUNT;
    }
    if (!has_tables(svm)) {
        return BSLAM_E_PARAMETER;
    }
    // A scale a row in place of the weights, where the weights are bytes.
    const float *table = svm->bytes != NULL ? svm->byte_scale : svm->weights;
    const int32_t count = svm->rows * (svm->bytes != NULL ? 1 : weights_in_row(svm));
    if (!all_numbers(table, count) || !all_numbers(svm->bias, svm->rows)) {
        return BSLAM_E_NOT_FINITE;
    }
    for (int32_t r = 0; svm->bytes != NULL && r < svm->rows; r++) {
        if (svm->byte_scale[r] < 0) {
            return BSLAM_E_PARAMETER;
        }
    }
    return BSLAM_OK;
}

/// Partial sums of a dot product, so that a compiler can use vector instructions where there are any.
#define LANES 8

/// The sum of w[i] x[i] over the bytes w.
static float dot_bytes(const int8_t *restrict w, const float *restrict x, int32_t count)
{
    float lanes[LANES] = {0};
    float sum = 0;
    int32_t i = 0;
    for (; i + LANES <= count; i += LANES) {
        for (int32_t k = 0; k < LANES; k++) {
            lanes[k] += (float)w[i + k] * x[i + k];
        }
    }
    for (; i < count; i++) {
        sum += (float)w[i] * x[i];
    }
    for (int32_t k = 0; k < LANES; k++) {
        sum += lanes[k];
    }
    return sum;
}

/// The same over floats.
static float dot_floats(const float *restrict w, const float *restrict x, int32_t count)
{
    float lanes[LANES] = {0};
    float sum = 0;
    int32_t i = 0;
    for (; i + LANES <= count; i += LANES) {
        for (int32_t k = 0; k < LANES; k++) {
            lanes[k] += w[i + k] * x[i + k];
        }
    }
    for (; i < count; i++) {
        sum += w[i] * x[i];
    }
    for (int32_t k = 0; k < LANES; k++) {
        sum += lanes[k];
    }
    return sum;
}

/// The sum of w[first + i] x[i], the weights as they are stored.
static float dot(const bslam_svm_t *svm, int32_t first, const float *x, int32_t count)
{
    return svm->bytes != NULL ? dot_bytes(svm->bytes + first, x, count)
                              : dot_floats(svm->weights + first, x, count);
}

void bslam_svm_decide(const bslam_svm_t *svm, const float *x, float *values)
{
    const int32_t n = svm->features;
    for (int32_t r = 0; r < svm->rows; r++) {
        int32_t at = r * weights_in_row(svm);
        float sum = dot(svm, at, x, n);
        at += n;
        // x_i is taken out of the products of row i: fewer multiplications, and short sums round less.
        for (int32_t i = 0; svm->quadratic && i < n; i++) {
            sum += x[i] * dot(svm, at, x + i, n - i);
            at += n - i;
        }
        values[r] = svm->bias[r] + (svm->bytes != NULL ? svm->byte_scale[r] * sum : sum);
    }
}
