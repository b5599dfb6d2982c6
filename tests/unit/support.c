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

bslam_settings_t unit_params(void)
{
    bslam_settings_t p;
    bslam_settings_default(&p);
    p.filter = 0;
    p.motion = 0;
    p.velocity_states = 0;
    p.scale_states = 0;
    p.velocity_sd_mps = BSLAM_R(0.4);
    p.velocity_walk_mps_sqrt_s = BSLAM_R(0.2);
    p.velocity_decay_s = BSLAM_R(5.0);
    p.turn_rate_sd_radps = BSLAM_R(0.5);
    p.turn_rate_walk_radps_sqrt_s = BSLAM_R(0.7);
    p.turn_rate_decay_s = BSLAM_R(3.0);
    p.forward_scale = 1;
    p.turn_scale = 1;
    p.scale_sd = BSLAM_R(0.2);
    p.scale_walk_sqrt_s = BSLAM_R(0.002);
    p.wheelbase_m = BSLAM_R(0.4);
    p.left_radius_m = BSLAM_R(0.05);
    p.right_radius_m = BSLAM_R(0.05);
    p.ticks_per_revolution = 1000;
    p.counter_bits = 16;
    p.speed_max_mps = 20;
    p.left_speed_sd_mps = BSLAM_R(0.3);
    p.right_speed_sd_mps = BSLAM_R(0.2);
    p.travel_sd_per_sqrt_m = 0;
    p.forward_sd_per_sqrt_s = 0;
    p.forward_sd_per_sqrt_m = 0;
    p.turn_sd_per_sqrt_s = 0;
    p.turn_sd_per_sqrt_m = 0;
    p.turn_sd_per_sqrt_rad = 0;
    p.gyro_sd_radps = BSLAM_R(0.02);
    p.gap_us = 2000000;
    p.gap_speed_sd_mps = BSLAM_R(0.2);
    p.gap_turn_sd_radps = BSLAM_R(0.5);
    p.mount_x_m = 0;
    p.mount_y_m = 0;
    p.mount_yaw_rad = 0;
    p.sighting_delay_us = 0;
    p.ahead_max_us = 200000;
    p.bearing_sd_rad = BSLAM_R(0.02);
    p.range_sd_floor_m = BSLAM_R(0.01);
    p.range_sd_fraction = BSLAM_R(0.02);
    p.range_sd_per_m = BSLAM_R(0.01);
    p.bearing_only_variance_factor = 2;
    p.bearing_only_curvature_factor = 0;
    p.gate_d2 = 0;
    p.huber_d = 0;
    p.ray_inverse_distance_per_m = BSLAM_R(0.2);
    p.ray_inverse_distance_sd_per_m = BSLAM_R(0.1);
    p.ray_linear_limit = BSLAM_R(0.1);
    p.association = 0;
    p.nearest_threshold_m = 1;
    p.nearest_threshold_rad = BSLAM_R(0.2);
    p.match_d2 = BSLAM_R(13.8);
    p.new_d2 = 40;
    p.confirm_sightings = 4;
    p.confirm_window_us = 0;
    p.existence_score = BSLAM_R(0.5);
    p.existence_sum = BSLAM_R(6.5);
    p.existence_first_sum = 3;
    p.existence_beacons = 4;
    return p;
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
