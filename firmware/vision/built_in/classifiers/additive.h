/// Additive support vector machines: every feature has a curve of its own in each row, a polygon through
/// values at its knots, and chosen pairs of features a surface over a grid of knots. By explicit expansion of
/// a feature into tents ("hat functions") that is a linear machine, of whose weights only two a feature and
/// four a pair count for a sample: at the cost of a linear one it tells "about so high" from "higher" and
/// "lower". MATH-CAMERA "Additive SVM". Always float, in the double build too. Internal.
#ifndef BSLAM_VISION_BUILT_IN_CLASSIFIERS_ADDITIVE_H
#define BSLAM_VISION_BUILT_IN_CLASSIFIERS_ADDITIVE_H

#include "base/status.h"
#include "vision/model.h"

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
