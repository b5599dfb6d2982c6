/// What the libraries compute with numbers of the scalar type.
#ifndef BSLAM_BASE_SCALAR_H
#define BSLAM_BASE_SCALAR_H

#include <float.h>
#include <math.h>

#include "base/real.h"

/// From one to the next number.
#if BSLAM_REAL_DOUBLE
#define BSLAM_REAL_EPSILON DBL_EPSILON
#else
#define BSLAM_REAL_EPSILON FLT_EPSILON
#endif

/// Square root, correctly rounded by IEEE 754 and so the same bits everywhere. The argument is not negative.
static inline bslam_real_t bslam_sqrt(bslam_real_t x)
{
#if BSLAM_REAL_DOUBLE
    return sqrt(x);
#else
    return sqrtf(x);
#endif
}

static inline bslam_real_t bslam_abs(bslam_real_t x)
{
    return x < 0 ? -x : x;
}

/// True for a number in [low, high]; false outside and for NaN.
static inline bool bslam_in_range(bslam_real_t x, bslam_real_t low, bslam_real_t high)
{
    return x >= low && x <= high;
}

/// True for a number that a measurement may be: finite, and small enough that its square is finite too.
static inline bool bslam_is_number(bslam_real_t x)
{
    return bslam_in_range(x, BSLAM_R(-1e12), BSLAM_R(1e12));
}

#endif
