#include "vision/built_in/classifiers/hinged.h"

#include <stdbool.h>
#include <stddef.h>

#include "vision/pixels/bytes.h"
#include "vision/built_in/classifiers/svm.h"

#define ROWS_MAX 255
/// Of a pair.
#define ROWS 2

bslam_status_t bslam_hinged_check(const bslam_hinged_t *machine, int32_t features)
{
    if (machine->features != features || features < 1 || features > BSLAM_HINGED_FEATURES_MAX ||
        machine->rows < 1 || machine->rows > ROWS_MAX) {
        return BSLAM_E_COUNT;
    }
    if (machine->knots == NULL || machine->bytes == NULL || machine->byte_scale == NULL ||
        machine->bias == NULL) {
        return BSLAM_E_PARAMETER;
    }
    if (!bslam_are_numbers(machine->byte_scale, machine->rows) ||
        !bslam_are_numbers(machine->bias, machine->rows)) {
        return BSLAM_E_NOT_FINITE;
    }
    for (int32_t row = 0; row < machine->rows; row++) {
        if (machine->byte_scale[row] < 0) {
            return BSLAM_E_PARAMETER;
        }
    }
    return BSLAM_OK;
}

/// What a feature counts: its byte, and how much that is above the knot.
static inline uint32_t both_of(uint8_t x, uint8_t knot)
{
    return bslam_halves(x, x > knot ? x - knot : 0);
}

/// Adds a feature's word of a pair of rows.
static inline void add_word(const int8_t *bytes, uint32_t both, int32_t sums[ROWS])
{
    const uint32_t word = bslam_word_at(bytes);
    sums[0] = bslam_halves_dot(bslam_bytes_signed_even(word), both, sums[0]);
    sums[1] = bslam_halves_dot(bslam_bytes_signed_odd(word), both, sums[1]);
}

/// Sums of a pair of rows: 512 * 2 * 255 * 128 fits.
static void sum_pair(const bslam_hinged_t *machine, const uint8_t *x, const int8_t *bytes, int32_t sums[ROWS])
{
    const uint8_t *knots = machine->knots;
    int32_t pair[ROWS] = {0, 0};
    for (const uint8_t *end = x + machine->features; x != end; x++, knots++, bytes += 2 * ROWS) {
        add_word(bytes, both_of(*x, *knots), pair);
    }
    sums[0] = pair[0];
    sums[1] = pair[1];
}

/// Sums of two pairs of rows, whose weights begin `next` bytes apart: what a feature counts is then worked
/// out half as often.
static void sum_pairs(const bslam_hinged_t *machine, const uint8_t *x, const int8_t *bytes, int32_t next,
                      int32_t sums[2 * ROWS])
{
    int32_t first[ROWS] = {0, 0}, second[ROWS] = {0, 0};
    const uint8_t *knots = machine->knots;
    for (const uint8_t *end = x + machine->features; x != end; x++, knots++, bytes += 2 * ROWS) {
        const uint32_t both = both_of(*x, *knots);
        add_word(bytes, both, first);
        add_word(bytes + next, both, second);
    }
    sums[0] = first[0];
    sums[1] = first[1];
    sums[2] = second[0];
    sums[3] = second[1];
}

void bslam_hinged_decide(const bslam_hinged_t *machine, const uint8_t *x, float *values)
{
    const int32_t pair_bytes = 2 * ROWS * machine->features, rows = machine->rows;
    const int8_t *bytes = machine->bytes;
    for (int32_t first = 0; first < rows; first += 2 * ROWS, bytes += 2 * pair_bytes) {
        int32_t sums[2 * ROWS] = {0};
        if (rows - first <= ROWS) {
            sum_pair(machine, x, bytes, sums);
        } else {
            sum_pairs(machine, x, bytes, pair_bytes, sums);
        }
        for (int32_t row = first; row < first + 2 * ROWS && row < rows; row++) {
            values[row] = machine->bias[row] + machine->byte_scale[row] * (float)sums[row - first];
        }
    }
}
