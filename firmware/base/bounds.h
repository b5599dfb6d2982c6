/// The smaller and the larger of two numbers, and a number within bounds.
#ifndef BSLAM_BASE_BOUNDS_H
#define BSLAM_BASE_BOUNDS_H

#include <stdint.h>

static inline int32_t bslam_least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static inline int32_t bslam_most(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

/// A number above INT32_MIN without its sign.
static inline int32_t bslam_magnitude(int32_t value)
{
    return value < 0 ? -value : value;
}

/// The number of [low, high] that is nearest to a value.
static inline int32_t bslam_clamp(int32_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : value;
}

/// The same of a float; NaN stays.
static inline float bslam_clampf(float value, float low, float high)
{
    return value < low ? low : value > high ? high : value;
}

#endif
