#include "base/logarithm.h"

#include <math.h>

static const bslam_real_t LN_2 = BSLAM_R(0.69314718055994530942);
static const bslam_real_t SQRT_HALF = BSLAM_R(0.70710678118654752440);

// Terms of the series: the first left out is below a rounding, at s² <= 0.0295.
#if BSLAM_REAL_DOUBLE
enum { TERMS = 10 };
#else
enum { TERMS = 5 };
#endif

/// x = mantissa 2^exponent with a mantissa in [1/2, 1).
static bslam_real_t split(bslam_real_t x, int *exponent)
{
#if BSLAM_REAL_DOUBLE
    return frexp(x, exponent);
#else
    return frexpf(x, exponent);
#endif
}

bslam_real_t bslam_ln(bslam_real_t x)
{
    int exponent;
    bslam_real_t mantissa = split(x, &exponent);
    if (mantissa < SQRT_HALF) {
        mantissa *= 2;
        exponent--;
    }
    // ln m = 2 artanh(s) = 2 (s + s³/3 + s⁵/5 ...)
    const bslam_real_t s = (mantissa - 1) / (mantissa + 1);
    const bslam_real_t s2 = s * s;
    bslam_real_t sum = 0;
    for (int k = TERMS; k >= 1; k--) {
        sum = s2 * (sum + 1 / (bslam_real_t)(2 * k + 1));
    }
    return (bslam_real_t)exponent * LN_2 + 2 * (s + s * sum);
}
