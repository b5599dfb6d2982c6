/// The smaller and the larger of two numbers, a number within bounds, and what damaged memory may have.
#ifndef BSLAM_BASE_BOUNDS_H
#define BSLAM_BASE_BOUNDS_H

#include <stdbool.h>
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

/// Whether something can be a count: not below 0, and no more than there is room for.
static inline bool bslam_is_count(int32_t value, int32_t most)
{
    return value >= 0 && value <= most;
}

/// Makes a flag one, whatever its byte is: any but 0 says true.
static inline void bslam_mend_flag(bool *flag)
{
    *flag = *(const unsigned char *)flag != 0;
}

#endif
