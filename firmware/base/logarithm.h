/// Natural logarithm of our own, from + - * / and an exact split into mantissa and exponent: the same bits on
/// every machine that follows IEEE 754, as MATH "Trigonometry" has it for angles.
#ifndef BSLAM_BASE_LOGARITHM_H
#define BSLAM_BASE_LOGARITHM_H

#include "base/real.h"

/// ln(x) of a positive, finite, normal number. Error <= 4e-7 in float and 1e-15 in double, relative to the
/// larger of 1 and |ln x|.
bslam_real_t bslam_ln(bslam_real_t x);

/// 1 / e^x for x >= 0, to 5 % where it is above 0.05; it falls off more slowly beyond, so that nothing is
/// ruled out.
static inline float bslam_falling(float x)
{
    return 1.0f / (1.0f + x * (1.0f + x * (0.5f + x * (1.0f / 6.0f + x * (1.0f / 24.0f)))));
}

#endif
