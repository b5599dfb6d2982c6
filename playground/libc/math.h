/// What the estimator takes of <math.h>. WebAssembly has the square root as an instruction, correctly
/// rounded.
#ifndef PLAYGROUND_MATH_H
#define PLAYGROUND_MATH_H

static inline float sqrtf(float x)
{
    return __builtin_sqrtf(x);
}

float frexpf(float x, int *exponent);

#endif
