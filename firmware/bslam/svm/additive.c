#include "bslam/svm/additive.h"

#include <stdbool.h>
#include <stddef.h>

#define ROWS_MAX 255
#define LARGEST 1e12f

static const uint8_t grid_knots[BSLAM_GRID_KNOTS] = {0, 3, 5, BSLAM_KNOTS - 1};

static bool are_numbers(const float *values, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        if (!(values[i] >= -LARGEST && values[i] <= LARGEST)) {
            return false;
        }
    }
    return true;
}

static bool do_rise(const float *knots)
{
    for (int32_t k = 1; k < BSLAM_KNOTS; k++) {
        if (!(knots[k] > knots[k - 1])) {
            return false;
        }
    }
    return true;
}

static bool is_in(int32_t value, int32_t low, int32_t high)
{
    return value >= low && value <= high;
}

static bslam_status_t check_counts(const bslam_additive_t *machine, int32_t features)
{
    const int32_t crossed = machine->crossed_count;
    if (machine->features != features || !is_in(machine->rows, 1, ROWS_MAX) ||
        !is_in(features, 1, BSLAM_ADDITIVE_FEATURES_MAX) ||
        (crossed != 0 && !is_in(crossed, 2, BSLAM_CROSSED_MAX))) {
        return BSLAM_E_COUNT;
    }
    if (machine->knots == NULL || machine->bytes == NULL || machine->byte_scale == NULL ||
        machine->bias == NULL || (crossed > 0 && machine->crossed == NULL)) {
        return BSLAM_E_PARAMETER;
    }
    for (int32_t i = 0; i < crossed; i++) {
        if (machine->crossed[i] >= features) {
            return BSLAM_E_COUNT;
        }
    }
    return BSLAM_OK;
}

bslam_status_t bslam_additive_check(const bslam_additive_t *machine, int32_t features)
{
    const bslam_status_t status = check_counts(machine, features);
    if (status != BSLAM_OK) {
        return status;
    }
    if (!are_numbers(machine->knots, features * BSLAM_KNOTS) ||
        !are_numbers(machine->byte_scale, machine->rows) || !are_numbers(machine->bias, machine->rows)) {
        return BSLAM_E_NOT_FINITE;
    }
    for (int32_t i = 0; i < features; i++) {
        if (!do_rise(machine->knots + i * BSLAM_KNOTS)) {
            return BSLAM_E_PARAMETER;
        }
    }
    for (int32_t row = 0; row < machine->rows; row++) {
        if (machine->byte_scale[row] < 0) {
            return BSLAM_E_PARAMETER;
        }
    }
    return BSLAM_OK;
}

static uint16_t share_between(float x, float low, float high)
{
    const float share = (x - low) / (high - low);
    const float within = share < 0.0f ? 0.0f : share > 1.0f ? 1.0f : share;
    return (uint16_t)(within * (float)BSLAM_SHARE_ONE + 0.5f);
}

_Static_assert(BSLAM_KNOTS == 9, "eight intervals, found by halves");

/// Between which knots x lies, the lower one; beyond all of them in the outermost interval.
static int32_t interval_of(float x, const float *knots)
{
    int32_t k = x >= knots[4] ? 4 : 0;
    k += x >= knots[k + 2] ? 2 : 0;
    return k + (x >= knots[k + 1] ? 1 : 0);
}

void bslam_additive_locate(const bslam_additive_t *machine, const float *x, bslam_additive_place_t *place)
{
    const float *knots = machine->knots;
    for (int32_t i = 0; i < machine->features; i++, knots += BSLAM_KNOTS) {
        const int32_t k = interval_of(x[i], knots);
        place->curves[i].at = (uint16_t)(i * BSLAM_KNOTS + k);
        place->curves[i].share = share_between(x[i], knots[k], knots[k + 1]);
    }
    for (int32_t c = 0; c < machine->crossed_count; c++) {
        const int32_t i = machine->crossed[c];
        const float *of_feature = machine->knots + i * BSLAM_KNOTS;
        int32_t k = 0;
        while (k < BSLAM_GRID_KNOTS - 2 && x[i] >= of_feature[grid_knots[k + 1]]) {
            k++;
        }
        place->grids[c].at = (uint16_t)k;
        place->grids[c].share = share_between(x[i], of_feature[grid_knots[k]], of_feature[grid_knots[k + 1]]);
    }
}

/// Of a row's curves, in steps of a byte, times BSLAM_SHARE_ONE: three times 96 * 127 * 32768 fits.
static int32_t sum_curves(const bslam_between_knots_t *place, int32_t features, const int8_t *bytes)
{
    int32_t lower = 0, more = 0;
    for (const bslam_between_knots_t *end = place + features; place != end; place++) {
        const int8_t *weights = bytes + place->at;
        lower += weights[0];
        more += place->share * (weights[1] - weights[0]);
    }
    return lower * BSLAM_SHARE_ONE + more;
}

/// Of a row's grids, in steps of a byte, times BSLAM_SHARE_ONE squared.
static int64_t sum_grids(const bslam_additive_place_t *place, int32_t crossed_count, const int8_t *bytes)
{
    int64_t sum = 0;
    const bslam_between_knots_t *end = place->grids + crossed_count;
    for (const bslam_between_knots_t *a = place->grids; a != end; a++) {
        // Of all grids of this feature: along its lower knots and its upper ones.
        const int8_t *grid = bytes + a->at * BSLAM_GRID_KNOTS;
        int32_t low = 0, low_more = 0, high = 0, high_more = 0;
        for (const bslam_between_knots_t *b = a + 1; b != end; b++) {
            const int8_t *corner = grid + b->at;
            low += corner[0];
            low_more += b->share * (corner[1] - corner[0]);
            high += corner[BSLAM_GRID_KNOTS];
            high_more += b->share * (corner[BSLAM_GRID_KNOTS + 1] - corner[BSLAM_GRID_KNOTS]);
            grid += BSLAM_GRID_KNOTS * BSLAM_GRID_KNOTS;
        }
        sum += (int64_t)(low * BSLAM_SHARE_ONE + low_more) * (BSLAM_SHARE_ONE - a->share) +
               (int64_t)(high * BSLAM_SHARE_ONE + high_more) * a->share;
        bytes += (end - a - 1) * BSLAM_GRID_KNOTS * BSLAM_GRID_KNOTS;
    }
    return sum;
}

void bslam_additive_decide(const bslam_additive_t *machine, const bslam_additive_place_t *place,
                           int32_t first, int32_t end, float *values)
{
    const int32_t weights = BSLAM_ADDITIVE_WEIGHTS(machine->features, machine->crossed_count);
    for (int32_t row = first; row < end; row++) {
        const int8_t *bytes = machine->bytes + row * weights;
        const int64_t sum = (int64_t)sum_curves(place->curves, machine->features, bytes) * BSLAM_SHARE_ONE +
                            sum_grids(place, machine->crossed_count, bytes + machine->features * BSLAM_KNOTS);
        values[row - first] =
            machine->bias[row] +
            machine->byte_scale[row] * ((float)(int32_t)(sum / BSLAM_SHARE_ONE) * (1.0f / BSLAM_SHARE_ONE));
    }
}
