/// The one scalar type of the library: float on the target, double in the twin build.
#ifndef BSLAM_BASE_REAL_H
#define BSLAM_BASE_REAL_H

#include <limits.h>
#include <stdbool.h>

#include "base/config.h"

#if INT_MAX < 2147483647
#error "bslam needs an int of 32 bits: shorter ones overflow where times and indices are computed"
#endif
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error \
    "bslam refuses what is no number, which -ffast-math and -ffinite-math-only assume away: do without them"
#endif

#if BSLAM_REAL_DOUBLE
typedef double bslam_real_t;
/// A literal of the scalar type: BSLAM_R(0.5).
#define BSLAM_R(literal) literal
#else
typedef float bslam_real_t;
#define BSLAM_R(literal) literal##f
#endif

#endif
