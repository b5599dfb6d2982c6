#include "support.h"

#include <math.h>

void unit_check_near(double actual, double expected, double tolerance, const char *what, const char *file,
                     int line)
{
    if (!(fabs(actual - expected) <= tolerance)) {
        print_error("%s is %.17g; expected %.17g within %.3g, off by %.3g\n", what, actual, expected,
                    tolerance, actual - expected);
        _fail(file, line);
    }
}

double unit_random(unit_random_t *random, double low, double high)
{
    // xorshift64*: 53 good bits from 8 bytes of state.
    random->state ^= random->state >> 12;
    random->state ^= random->state << 25;
    random->state ^= random->state >> 27;
    const uint64_t bits = random->state * UINT64_C(2685821657736338717);
    return low + (high - low) * (double)(bits >> 11) / 9007199254740992.0;
}

uint32_t unit_every(uint32_t quick)
{
    return getenv("BSLAM_THOROUGH") != NULL ? 1 : quick;
}

double unit_derivative(unit_function_t function, const double *in, int in_count, int row, int column,
                       const void *context)
{
    // Five points: the error is step^4 / 30 times the fifth derivative, and 1e-16 / step from rounding.
    const double step = 2e-4 * fmax(0.1, fmin(1, fabs(in[column])));
    static const struct {
        double at;
        double weight;
    } stencil[] = {{-2, 1.0 / 12}, {-1, -2.0 / 3}, {1, 2.0 / 3}, {2, -1.0 / 12}};
    double sum = 0;
    for (int i = 0; i < COUNT_OF(stencil); i++) {
        double shifted[UNIT_ARGUMENTS_MAX];
        double out[UNIT_RESULTS_MAX];
        memcpy(shifted, in, (size_t)in_count * sizeof *in);
        shifted[column] = in[column] + stencil[i].at * step;
        function(shifted, out, context);
        sum += stencil[i].weight * out[row];
    }
    return sum / step;
}

void unit_mean_direction(double start, double turn, double *cosine, double *sine)
{
    static const struct {
        double at;
        double weight;
    } gauss[] = {{-0.906179845938663993, 0.236926885056189088},
                 {-0.538469310105683091, 0.478628670499366468},
                 {0, 0.568888888888888889},
                 {0.538469310105683091, 0.478628670499366468},
                 {0.906179845938663993, 0.236926885056189088}};
    const int panels = 8;
    *cosine = 0;
    *sine = 0;
    for (int i = 0; i < panels; i++) {
        for (int k = 0; k < COUNT_OF(gauss); k++) {
            const double angle = start + turn * (i + 0.5 + gauss[k].at / 2) / panels;
            *cosine += gauss[k].weight * cos(angle) / (2 * panels);
            *sine += gauss[k].weight * sin(angle) / (2 * panels);
        }
    }
}

double unit_angle_between(double a, double b)
{
    return remainder(a - b, 6.283185307179586476925);
}

bslam_sighting_t unit_polar(double bearing_rad, double range_m, int32_t label)
{
    return (bslam_sighting_t){
        .bearing_rad = real(bearing_rad), .range_m = real(range_m), .has_range = true, .label = label};
}

bslam_sighting_t unit_direction(double bearing_rad, int32_t label)
{
    return (bslam_sighting_t){.bearing_rad = real(bearing_rad), .label = label};
}
