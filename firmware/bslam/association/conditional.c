#include "bslam/association/conditional.h"

#include "base/logarithm.h"
#include "base/scalar.h"

static const bslam_real_t LN_TWO_PI = BSLAM_R(1.83787706640934548356);
// Variances below it would divide by what rounding leaves.
static const bslam_real_t VARIANCE_MIN = BSLAM_R(1e-12);

/// Where row i of the factor begins.
static int32_t row_at(int32_t i)
{
    return i * (i + 1) / 2;
}

/// Appends one scalar: its row of the factor, and its part of the innovation that the others do not explain.
static bool push(const bslam_ekf_t *ekf, bslam_conditional_t *conditional, const bslam_row_t *row,
                 bslam_real_t y, bslam_real_t variance)
{
    const int32_t n = conditional->count;
    bslam_real_t *l = &conditional->factor[row_at(n)];
    bslam_real_t covariances[BSLAM_CONDITIONAL_SCALARS];
    conditional->rows[n] = *row;
    bslam_ekf_row_covariances(ekf, row, conditional->rows, n + 1, covariances);
    bslam_real_t left = covariances[n] + variance;
    for (int32_t i = 0; i < n; i++) {
        bslam_real_t sum = covariances[i];
        const bslam_real_t *other = &conditional->factor[row_at(i)];
        for (int32_t k = 0; k < i; k++) {
            sum -= l[k] * other[k];
        }
        l[i] = sum / other[i];
        left -= l[i] * l[i];
        y -= l[i] * conditional->white[i];
    }
    if (!bslam_in_range(left, VARIANCE_MIN, 1 / VARIANCE_MIN)) {
        return false;
    }
    l[n] = bslam_sqrt(left);
    conditional->white[n] = y / l[n];
    conditional->count = n + 1;
    return true;
}

static bool push_innovation(const bslam_ekf_t *ekf, bslam_conditional_t *conditional,
                            const bslam_innovation_t *innovation)
{
    return push(ekf, conditional, &innovation->bearing_row, innovation->bearing_rad,
                innovation->bearing_var_rad2) &&
           (!innovation->has_range ||
            push(ekf, conditional, &innovation->range_row, innovation->range_m, innovation->range_var_m2));
}

bslam_status_t bslam_conditional_weigh(const bslam_ekf_t *ekf, bslam_conditional_t *conditional,
                                       const bslam_innovation_t *innovation, bslam_weight_t *weight)
{
    const int32_t before = conditional->count;
    const bool pushed = push_innovation(ekf, conditional, innovation);
    const int32_t after = conditional->count;
    conditional->count = before;
    if (!pushed) {
        return BSLAM_E_SINGULAR;
    }
    bslam_real_t distance2 = 0, root = 1;
    for (int32_t i = before; i < after; i++) {
        distance2 += conditional->white[i] * conditional->white[i];
        root *= conditional->factor[row_at(i) + i];
    }
    weight->distance2 = distance2;
    weight->log_density = -(distance2 + (bslam_real_t)(after - before) * LN_TWO_PI) / 2 - bslam_ln(root);
    return BSLAM_OK;
}

bool bslam_conditional_add(const bslam_ekf_t *ekf, bslam_conditional_t *conditional,
                           const bslam_innovation_t *innovation)
{
    const int32_t before = conditional->count;
    if (before + 2 > 2 * BSLAM_CONDITIONAL_MAX || !push_innovation(ekf, conditional, innovation)) {
        conditional->count = before;
        return false;
    }
    return true;
}

bslam_real_t bslam_conditional_distance2(const bslam_conditional_t *conditional)
{
    bslam_real_t sum = 0;
    for (int32_t i = 0; i < conditional->count; i++) {
        sum += conditional->white[i] * conditional->white[i];
    }
    return sum;
}
