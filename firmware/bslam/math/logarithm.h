/// Natural logarithm of our own, from + - * / and an exact split into mantissa and exponent: the same bits on
/// every machine that follows IEEE 754, as MATH "Trigonometry" has it for angles.
#ifndef BSLAM_MATH_LOGARITHM_H
#define BSLAM_MATH_LOGARITHM_H

#include "bslam/base/real.h"

/// ln(x) of a positive, finite, normal number. Error <= 4e-7 in float and 1e-15 in double, relative to the
/// larger of 1 and |ln x|.
bslam_real_t bslam_ln(bslam_real_t x);

#endif
