#include "vision/built_in/classifiers/additive.h"

#include <stdbool.h>
#include <stddef.h>

#include "vision/pixels/bytes.h"
#include "vision/built_in/classifiers/svm.h"

#define ROWS_MAX 255
/// Of a pair.
#define ROWS 2
/// Weights that a pair has of a grid.
#define GRID_BYTES (ROWS * BSLAM_GRID_KNOTS * BSLAM_GRID_KNOTS)

static const uint8_t grid_knots[BSLAM_GRID_KNOTS] = {0, 3, 5, BSLAM_KNOTS - 1};

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
    if (!bslam_are_numbers(machine->knots, features * BSLAM_KNOTS) ||
        !bslam_are_numbers(machine->byte_scale, machine->rows) ||
        !bslam_are_numbers(machine->bias, machine->rows)) {
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

static uint32_t shares_between(float x, float low, float high)
{
    const float share = (x - low) / (high - low);
    const float within = share < 0.0f ? 0.0f : share > 1.0f ? 1.0f : share;
    const int32_t upper = (int32_t)(within * (float)BSLAM_SHARE_ONE + 0.5f);
    return bslam_halves(upper - BSLAM_SHARE_ONE, -upper);
}

_Static_assert(BSLAM_KNOTS == 9, "eight intervals, found by halves");

/// The lower one of the knots that x lies between; beyond all of them that of the outermost interval.
static const float *knot_below(float x, const float *knots)
{
    knots = x >= knots[4] ? knots + 4 : knots;
    knots = x >= knots[2] ? knots + 2 : knots;
    return x >= knots[1] ? knots + 1 : knots;
}

void bslam_additive_locate(const bslam_additive_t *machine, const float *x, bslam_additive_place_t *place)
{
    const float *knots = machine->knots;
    for (int32_t i = 0; i < machine->features; i++, knots += BSLAM_KNOTS) {
        const float *low = knot_below(x[i], knots);
        place->curves[i].at = (uint32_t)(ROWS * (low - machine->knots));
        place->curves[i].shares = shares_between(x[i], low[0], low[1]);
    }
    for (int32_t c = 0; c < machine->crossed_count; c++) {
        const int32_t feature = machine->crossed[c];
        const float *of_feature = machine->knots + feature * BSLAM_KNOTS;
        const float value = x[feature];
        int32_t k = 0;
        while (k < BSLAM_GRID_KNOTS - 2 && value >= of_feature[grid_knots[k + 1]]) {
            k++;
        }
        place->grids[c].at = (uint32_t)(ROWS * k);
        place->grids[c].shares =
            shares_between(value, of_feature[grid_knots[k]], of_feature[grid_knots[k + 1]]);
    }
}

/// Adds to both rows' sums, times -BSLAM_SHARE_ONE, what the weights of a knot, first two bytes, and of the
/// next one count.
static inline void add_pair(const int8_t *weights, uint32_t shares, int32_t sums[ROWS])
{
    const uint32_t word = bslam_word_at(weights);
    sums[0] = bslam_halves_dot(bslam_bytes_signed_even(word), shares, sums[0]);
    sums[1] = bslam_halves_dot(bslam_bytes_signed_odd(word), shares, sums[1]);
}

/// Of a pair's curves, in steps of a byte, times -BSLAM_SHARE_ONE: 96 * 127 * 32768 fits.
static void sum_curves(const bslam_between_knots_t *place, int32_t features, const int8_t *bytes,
                       int32_t sums[ROWS])
{
    sums[0] = sums[1] = 0;
    if (features % 2 != 0) {
        add_pair(bytes + place->at, place->shares, sums);
        place++;
    }
    for (const bslam_between_knots_t *end = place + features / 2 * 2; place != end; place += 2) {
        add_pair(bytes + place[0].at, place[0].shares, sums);
        add_pair(bytes + place[1].at, place[1].shares, sums);
    }
}

/// What all grids of a feature with those after it, [b, end), make along its lower knots and its upper ones.
static inline void sum_grids(const bslam_between_knots_t *b, const bslam_between_knots_t *end,
                             const int8_t *grid, int32_t low[ROWS], int32_t high[ROWS])
{
    low[0] = low[1] = high[0] = high[1] = 0;
    for (; b != end; b++) {
        add_pair(grid + b->at, b->shares, low);
        add_pair(grid + b->at + ROWS * BSLAM_GRID_KNOTS, b->shares, high);
        grid += GRID_BYTES;
    }
}

/// Adds a pair's grids, in steps of a byte, times BSLAM_SHARE_ONE squared.
static void add_grids(const bslam_additive_place_t *place, int32_t crossed_count, const int8_t *bytes,
                      int64_t sums[ROWS])
{
    const bslam_between_knots_t *end = place->grids + crossed_count;
    for (const bslam_between_knots_t *a = place->grids; a != end; a++) {
        int32_t low[ROWS], high[ROWS];
        sum_grids(a + 1, end, bytes + a->at * BSLAM_GRID_KNOTS, low, high);
        const int32_t low_share = (int16_t)a->shares, high_share = (int16_t)(a->shares >> 16);
        for (int32_t r = 0; r < ROWS; r++) {
            sums[r] = bslam_product_add(low[r], low_share, sums[r]);
            sums[r] = bslam_product_add(high[r], high_share, sums[r]);
        }
        bytes += (end - a - 1) * GRID_BYTES;
    }
}

void bslam_additive_decide(const bslam_additive_t *machine, const bslam_additive_place_t *place,
                           int32_t first, int32_t end, float *values)
{
    const int32_t weights = BSLAM_ADDITIVE_WEIGHTS(machine->features, machine->crossed_count);
    for (int32_t pair = first / ROWS * ROWS; pair < end; pair += ROWS) {
        const int8_t *bytes = machine->bytes + pair * weights;
        int32_t curves[ROWS];
        sum_curves(place->curves, machine->features, bytes, curves);
        int64_t sums[ROWS] = {-(int64_t)curves[0] * BSLAM_SHARE_ONE, -(int64_t)curves[1] * BSLAM_SHARE_ONE};
        add_grids(place, machine->crossed_count, bytes + ROWS * machine->features * BSLAM_KNOTS, sums);
        for (int32_t row = pair < first ? first : pair; row < pair + ROWS && row < end; row++) {
            const float steps = (float)(int32_t)(sums[row - pair] / BSLAM_SHARE_ONE);
            values[row - first] =
                machine->bias[row] + machine->byte_scale[row] * (steps * (1.0f / BSLAM_SHARE_ONE));
        }
    }
}
