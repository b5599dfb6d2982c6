#include "vision/built_in/classifiers/svm.h"

#include <stddef.h>
#include <string.h>

#include "base/scalar.h"

static int32_t weights_in_row(const bslam_svm_t *svm)
{
    return BSLAM_SVM_WEIGHTS(svm->features, svm->quadratic);
}

bool bslam_are_numbers(const float *values, int32_t count)
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
    if (!bslam_are_numbers(table, count) || !bslam_are_numbers(svm->bias, svm->rows)) {
        return BSLAM_E_NOT_FINITE;
    }
    for (int32_t r = 0; svm->bytes != NULL && r < svm->rows; r++) {
        if (svm->byte_scale[r] < 0) {
            return BSLAM_E_PARAMETER;
        }
    }
    return BSLAM_OK;
}

/// The sum of w[i] x[i], in eight sums side by side: each by its name, for vector instructions where there
/// are any, and for registers where not.
static float dot(const float *restrict w, const float *restrict x, int32_t count)
{
    float s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0, s5 = 0, s6 = 0, s7 = 0;
    float sum = 0;
    for (; count >= 8; count -= 8, w += 8, x += 8) {
        s0 += w[0] * x[0];
        s1 += w[1] * x[1];
        s2 += w[2] * x[2];
        s3 += w[3] * x[3];
        s4 += w[4] * x[4];
        s5 += w[5] * x[5];
        s6 += w[6] * x[6];
        s7 += w[7] * x[7];
    }
    for (int32_t i = 0; i < count; i++) {
        sum += w[i] * x[i];
    }
    return sum + s0 + s1 + s2 + s3 + s4 + s5 + s6 + s7;
}

static void decide_by_floats(const bslam_svm_t *svm, const float *x, float *values)
{
    const int32_t n = svm->features;
    for (int32_t r = 0; r < svm->rows; r++) {
        const float *w = svm->weights + r * weights_in_row(svm);
        float sum = dot(w, x, n);
        w += n;
        // x_i is taken out of the products of row i: fewer multiplications, and short sums round less.
        for (int32_t i = 0; svm->quadratic && i < n; i++) {
            sum += x[i] * dot(w, x + i, n - i);
            w += n - i;
        }
        values[r] = svm->bias[r] + sum;
    }
}

// --- Bytes: whole numbers all the way
//
// The values of phi are formed a block at a time, once for all rows: whole numbers to +-X_ONE stand for x_i,
// and the upper half of the product of two of them for phi, so at most 16384.

#define X_ONE 32767
/// Values of phi in a block: the sum of as many products with bytes fits in 32 bits by far.
#define BLOCK 160
/// So many at a time, constants, so that a compiler can use vector instructions.
#define STEP 8
#define STRIDE 16

/// Where the expansion goes on: with the product of `whole` at first and second. In front of the features
/// stands the number one, so that the first products are the features themselves. There is room beyond them
/// for a whole step.
typedef struct expansion {
    int32_t end;       ///< features, and one more
    int32_t rows_end;  ///< 1 in a linear machine: no products but those with one
    int32_t first, second;
    float unit;  ///< what 1 of phi's whole numbers stands for
    int16_t whole[1 + BSLAM_SVM_FEATURES_MAX + STEP];
} expansion_t;

/// The largest |x_i|, at least 1.
static float largest(const float *x, int32_t count)
{
    float lanes[STEP];
    float most = 1.0f;
    int32_t i = 0;
    for (int32_t k = 0; k < STEP; k++) {
        lanes[k] = 1.0f;
    }
    for (; i + STEP <= count; i += STEP) {
        for (int32_t k = 0; k < STEP; k++) {
            const float value = fabsf(x[i + k]);
            lanes[k] = value > lanes[k] ? value : lanes[k];
        }
    }
    for (; i < count; i++) {
        const float value = fabsf(x[i]);
        most = value > most ? value : most;
    }
    for (int32_t k = 0; k < STEP; k++) {
        most = lanes[k] > most ? lanes[k] : most;
    }
    return most;
}

/// To the nearest; what is cut off is positive, so that this takes one conversion and no comparison.
static int16_t rounded(float x)
{
    return (int16_t)((int32_t)(x + ((float)X_ONE + 1.5f)) - (X_ONE + 1));
}

static void begin_expansion(expansion_t *e, const bslam_svm_t *svm, const float *x)
{
    const int32_t n = svm->features;
    const float most = largest(x, n);
    const float scale = (float)X_ONE / most;
    int16_t *whole = e->whole + 1;
    int32_t i = 0;
    for (; i + STEP <= n; i += STEP) {
        for (int32_t k = 0; k < STEP; k++) {
            whole[i + k] = rounded(x[i + k] * scale);
        }
    }
    for (; i < n; i++) {
        whole[i] = rounded(x[i] * scale);
    }
    memset(whole + n, 0, STEP * sizeof whole[0]);
    e->whole[0] = rounded(scale);
    e->end = n + 1;
    e->rows_end = svm->quadratic ? n + 1 : 1;
    e->first = 0;
    e->second = 1;
    e->unit = 65536.0f / (scale * scale);
}

/// Products of x_i with values from `x` on: whole steps, so up to STEP - 1 more than `count`.
static void multiply(int16_t *restrict phi, const int16_t *restrict x, int32_t x_i, int32_t count)
{
    for (int32_t i = 0; i < count; i += STEP) {
        for (int32_t k = i; k < i + STEP; k++) {
            phi[k] = (int16_t)(x_i * x[k] >> 16);
        }
    }
}

/// The next values of phi, at most BLOCK; returns how many.
static int32_t expand(expansion_t *e, int16_t phi[BLOCK + STEP])
{
    int32_t count = 0;
    while (count < BLOCK && e->first < e->rows_end) {
        const int32_t left = e->end - e->second, room = BLOCK - count;
        const int32_t now = left < room ? left : room;
        multiply(phi + count, e->whole + e->second, e->whole[e->first], now);
        count += now;
        e->second += now;
        if (now == left) {
            e->first++;
            e->second = e->first;
        }
    }
    return count;
}

/// The sum of w[i] phi[i] over a whole block.
static int32_t dot_block(const int8_t *restrict w, const int16_t *restrict phi)
{
    int32_t sum = 0;
    for (int32_t i = 0; i < BLOCK; i++) {
        sum += w[i] * phi[i];
    }
    return sum;
}

/// The same over what is left at the end.
static int32_t dot_rest(const int8_t *restrict w, const int16_t *restrict phi, int32_t count)
{
    int32_t sum = 0;
    int32_t i = 0;
    for (; i + STRIDE <= count; i += STRIDE) {
        for (int32_t k = 0; k < STRIDE; k++) {
            sum += w[i + k] * phi[i + k];
        }
    }
    for (; i < count; i++) {
        sum += w[i] * phi[i];
    }
    return sum;
}

static void decide_by_bytes(const bslam_svm_t *svm, const float *x, float *values)
{
    expansion_t expansion;
    int16_t phi[BLOCK + STEP];
    begin_expansion(&expansion, svm, x);
    for (int32_t r = 0; r < svm->rows; r++) {
        values[r] = 0;
    }
    const int32_t weights = weights_in_row(svm);
    for (int32_t at = 0; at < weights;) {
        const int32_t count = expand(&expansion, phi);
        for (int32_t r = 0; r < svm->rows; r++) {
            const int8_t *w = svm->bytes + r * weights + at;
            values[r] += (float)(count == BLOCK ? dot_block(w, phi) : dot_rest(w, phi, count));
        }
        at += count;
    }
    for (int32_t r = 0; r < svm->rows; r++) {
        values[r] = svm->bias[r] + svm->byte_scale[r] * expansion.unit * values[r];
    }
}

void bslam_svm_decide(const bslam_svm_t *svm, const float *x, float *values)
{
    if (svm->bytes != NULL) {
        decide_by_bytes(svm, x, values);
    } else {
        decide_by_floats(svm, x, values);
    }
}
