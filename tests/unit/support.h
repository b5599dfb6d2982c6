/// What the unit tests share: comparison with a tolerance, repeatable random numbers, sightings.
#ifndef UNIT_SUPPORT_H
#define UNIT_SUPPORT_H

// CMocka needs these before its own header.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/types.h"
#include "base/scalar.h"

/// Half the distance from 1 to the next number of bslam_real_t: the relative error of one rounding.
#define UNIT_ROUNDING (BSLAM_REAL_DOUBLE ? 1.12e-16 : 5.97e-8)

/// Fails unless |actual - expected| <= tolerance; a NaN fails.
#define assert_near(actual, expected, tolerance) \
    unit_check_near((double)(actual), (double)(expected), (double)(tolerance), #actual, __FILE__, __LINE__)

void unit_check_near(double actual, double expected, double tolerance, const char *what, const char *file,
                     int line);

/// Elements of an array.
#define COUNT_OF(array) ((int)(sizeof(array) / sizeof((array)[0])))

/// A number of the scalar type that comes from outside it: a loop variable in double, an expected value.
static inline bslam_real_t real(double value)
{
    return (bslam_real_t)value;
}

/// A repeatable stream of random numbers. Any seed but 0.
typedef struct unit_random {
    uint64_t state;
} unit_random_t;

/// The next number, uniform in [low, high).
double unit_random(unit_random_t *random, double low, double high);

/// 1 where the environment variable BSLAM_THOROUGH is set (`make proof`), else `quick`: how many cases of
/// very many a loop goes on by.
uint32_t unit_every(uint32_t quick);

/// A function of n numbers with m results, for finite differences. context is the caller's.
typedef void (*unit_function_t)(const double *in, double *out, const void *context);

/// Derivative of result `row` of a function with at most UNIT_RESULTS_MAX results by its argument `column`,
/// from two evaluations: the error is of order 1e-10 where the third derivative is of order 1.
double unit_derivative(unit_function_t function, const double *in, int in_count, int row, int column,
                       const void *context);

#define UNIT_ARGUMENTS_MAX 32
#define UNIT_RESULTS_MAX 8

/// Mean of (cos, sin) over the angles from start to start + turn, by Gauss quadrature, two points in each of
/// 512 panels: the error is (turn / 512)^4 / 4320, below 1e-12 for turns up to 4 rad.
void unit_mean_direction(double start, double turn, double *cosine, double *sine);

/// The angle from b to a, in [-pi, pi]: how far two directions differ.
double unit_angle_between(double a, double b);

/// A sighting with a distance, or bearing-only.
bslam_sighting_t unit_polar(double bearing_rad, double range_m, int32_t label);
bslam_sighting_t unit_direction(double bearing_rad, int32_t label);

#endif
