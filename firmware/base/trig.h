/// Sine, cosine and arc tangent of our own, and angle wrapping.
///
/// libm's functions differ between C libraries in the last bit, and newlib's carry a large-angle reduction.
/// These use only + - * / and comparisons, so every machine that follows IEEE 754 gets the same bits (MATH
/// "Trigonometry").
#ifndef BSLAM_BASE_TRIG_H
#define BSLAM_BASE_TRIG_H

#include "base/real.h"

#define BSLAM_PI BSLAM_R(3.14159265358979323846)

/// Up to this |angle| the functions keep full accuracy; beyond, any finite angle is first divided by 2 pi.
#define BSLAM_ANGLE_MAX BSLAM_R(1e4)

/// Sine and cosine of a finite angle.
/// Error <= 1.5e-7 in float and 1e-15 in double for |angle| <= pi; beyond, the reduction adds 1 ulp of the
/// angle.
void bslam_sin_cos(bslam_real_t angle_rad, bslam_real_t *sine, bslam_real_t *cosine);

/// Arc tangent of y/x in (-pi, pi], 0 for (0, 0). Error <= 4e-7 in float, 1e-15 in double. Finite arguments.
bslam_real_t bslam_atan2(bslam_real_t y, bslam_real_t x);

/// The same direction in (-pi, pi]. A finite angle.
bslam_real_t bslam_angle_wrap(bslam_real_t angle_rad);

#endif
