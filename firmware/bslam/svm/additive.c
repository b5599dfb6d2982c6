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

static float share_between(float x, float low, float high)
{
    const float share = (x - low) / (high - low);
    return share < 0.0f ? 0.0f : share > 1.0f ? 1.0f : share;
}

void bslam_additive_locate(const bslam_additive_t *machine, const float *x, bslam_additive_place_t *place)
{
    for (int32_t i = 0; i < machine->features; i++) {
        const float *knots = machine->knots + i * BSLAM_KNOTS;
        int32_t k = 0;
        while (k < BSLAM_KNOTS - 2 && x[i] >= knots[k + 1]) {
            k++;
        }
        place->knot[i] = (uint8_t)k;
        place->share[i] = share_between(x[i], knots[k], knots[k + 1]);
    }
    for (int32_t c = 0; c < machine->crossed_count; c++) {
        const int32_t i = machine->crossed[c];
        const float *knots = machine->knots + i * BSLAM_KNOTS;
        int32_t k = 0;
        while (k < BSLAM_GRID_KNOTS - 2 && x[i] >= knots[grid_knots[k + 1]]) {
            k++;
        }
        place->grid_knot[c] = (uint8_t)k;
        place->grid_share[c] = share_between(x[i], knots[grid_knots[k]], knots[grid_knots[k + 1]]);
    }
}

/// Between two values, in steps of a byte.
static float between(const int8_t *bytes, float share)
{
    return (float)bytes[0] + share * (float)(bytes[1] - bytes[0]);
}

/// The sum of the grids of all pairs, in steps of a byte.
static float sum_grids(const bslam_additive_t *machine, const bslam_additive_place_t *place,
                       const int8_t *bytes)
{
    float sum = 0;
    for (int32_t a = 0; a < machine->crossed_count; a++) {
        const int8_t *row = bytes + place->grid_knot[a] * BSLAM_GRID_KNOTS;
        const float share = place->grid_share[a];
        for (int32_t b = a + 1; b < machine->crossed_count; b++) {
            const int8_t *corner = row + place->grid_knot[b];
            const float low = between(corner, place->grid_share[b]);
            const float high = between(corner + BSLAM_GRID_KNOTS, place->grid_share[b]);
            sum += low + share * (high - low);
            row += BSLAM_GRID_KNOTS * BSLAM_GRID_KNOTS;
        }
        bytes += (machine->crossed_count - 1 - a) * BSLAM_GRID_KNOTS * BSLAM_GRID_KNOTS;
    }
    return sum;
}

void bslam_additive_decide(const bslam_additive_t *machine, const bslam_additive_place_t *place,
                           int32_t first, int32_t end, float *values)
{
    const int32_t weights = BSLAM_ADDITIVE_WEIGHTS(machine->features, machine->crossed_count);
    for (int32_t row = first; row < end; row++) {
        const int8_t *bytes = machine->bytes + row * weights;
        float sum = 0;
        for (int32_t i = 0; i < machine->features; i++) {
            sum += between(bytes + i * BSLAM_KNOTS + place->knot[i], place->share[i]);
        }
        sum += sum_grids(machine, place, bytes + machine->features * BSLAM_KNOTS);
        values[row - first] = machine->bias[row] + machine->byte_scale[row] * sum;
    }
}
