/// Additive support vector machines: every feature has a curve of its own in each row, a polygon through
/// values at its knots, and chosen pairs of features a surface over a grid of knots. By explicit expansion of
/// a feature into tents ("hat functions") that is a linear machine, of whose weights only two a feature and
/// four a pair count for a sample: at the cost of a linear one it tells "about so high" from "higher" and
/// "lower". MATH-CAMERA "Additive SVM".
///
/// A machine is a view of constant tables, as in svm.h. Always float, in the double build too.
#ifndef BSLAM_SVM_ADDITIVE_H
#define BSLAM_SVM_ADDITIVE_H

#include <stdint.h>

#include "bslam/base/status.h"

enum {
    BSLAM_KNOTS = 9,       ///< of a feature
    BSLAM_GRID_KNOTS = 4,  ///< of these, each way of a pair's grid: knots 0, 3, 5 and 8
    BSLAM_ADDITIVE_FEATURES_MAX = 96,
    BSLAM_CROSSED_MAX = 24,  ///< features that have a grid with each other
};

/// Bytes of a machine's weights: rows stand in pairs, the first two rows' weights in turn, then those of the
/// next two; after an odd number of rows comes one of zeros. So a word holds what two rows make of a place
/// between two knots.
#define BSLAM_ADDITIVE_BYTES(rows, features, crossed_count) \
    (((rows) + 1) / 2 * 2 * BSLAM_ADDITIVE_WEIGHTS(features, crossed_count))

/// Weights of a row: those of the features' tents, feature by feature; then of the grids, of the pairs 0-1,
/// 0-2, ... 1-2, ... of `crossed`, the second one's knots running fastest.
#define BSLAM_ADDITIVE_WEIGHTS(features, crossed_count) \
    ((features) * BSLAM_KNOTS + \
     (crossed_count) * ((crossed_count) - 1) / 2 * BSLAM_GRID_KNOTS * BSLAM_GRID_KNOTS)

typedef struct bslam_additive {
    int32_t rows;             ///< a class each, against the rest
    int32_t features;         ///< length of x
    const float *knots;       ///< features * BSLAM_KNOTS, rising in each feature; beyond, curves are level
    int32_t crossed_count;    ///< 0 or 2 to BSLAM_CROSSED_MAX
    const uint8_t *crossed;   ///< so many features
    const int8_t *bytes;      ///< BSLAM_ADDITIVE_BYTES; a byte stands for byte * byte_scale[row]
    const float *byte_scale;  ///< rows values, not negative
    const float *bias;        ///< rows values
} bslam_additive_t;

/// A whole way between knots. Shares are whole numbers, so that sums are exact and in integers.
enum { BSLAM_SHARE_BITS = 15, BSLAM_SHARE_ONE = 1 << BSLAM_SHARE_BITS };

/// A place between two knots: where the lower one's weights stand, bytes from where a pair's weights begin,
/// of a grid those of the knot within a row of it; and how much the lower one counts, and the upper one: two
/// halves of a word, of 0 to -BSLAM_SHARE_ONE, since that fits 16 bits.
typedef struct bslam_between_knots {
    uint32_t at;
    uint32_t shares;
} bslam_between_knots_t;

/// Where a sample lies between knots: worked out once for all rows.
typedef struct bslam_additive_place {
    bslam_between_knots_t curves[BSLAM_ADDITIVE_FEATURES_MAX];
    bslam_between_knots_t grids[BSLAM_CROSSED_MAX];
} bslam_additive_place_t;

/// Looks a machine over, once, before its first use. BSLAM_E_COUNT: a count is out of range, there are not as
/// many features as the caller computes, or a crossed feature is none. BSLAM_E_PARAMETER: a table is missing,
/// knots do not rise, a scale is below 0. BSLAM_E_NOT_FINITE: a number is NaN, infinite or beyond 1e12.
BSLAM_MUST_CHECK bslam_status_t bslam_additive_check(const bslam_additive_t *machine, int32_t features);

/// The place of a sample x, which is finite; the machine has passed bslam_additive_check.
void bslam_additive_locate(const bslam_additive_t *machine, const float *x, bslam_additive_place_t *place);

/// values[r - first] = f_r(x) for rows [first, end). Two rows of a pair cost as much as one.
void bslam_additive_decide(const bslam_additive_t *machine, const bslam_additive_place_t *place,
                           int32_t first, int32_t end, float *values);

#endif
