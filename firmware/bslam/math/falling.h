/// An exponential without libm.
#ifndef BSLAM_MATH_FALLING_H
#define BSLAM_MATH_FALLING_H

/// 1 / e^x for x >= 0, to 5 % where it is above 0.05; it falls off more slowly beyond, so that nothing is
/// ruled out.
static inline float bslam_falling(float x)
{
    return 1.0f / (1.0f + x * (1.0f + x * (0.5f + x * (1.0f / 6.0f + x * (1.0f / 24.0f)))));
}

#endif
