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

double unit_derivative(unit_function_t function, const double *in, int in_count, int row, int column,
                       const void *context)
{
    // Error of the central difference: step^2 from the third derivative, 1e-16 / step from rounding.
    const double step = 1e-5;
    double shifted[UNIT_ARGUMENTS_MAX];
    double before[UNIT_RESULTS_MAX];
    double after[UNIT_RESULTS_MAX];
    memcpy(shifted, in, (size_t)in_count * sizeof *in);
    shifted[column] = in[column] - step;
    function(shifted, before, context);
    shifted[column] = in[column] + step;
    function(shifted, after, context);
    return (after[row] - before[row]) / (2 * step);
}

bslam_params_t unit_params(void)
{
    bslam_params_t p;
    bslam_params_default(&p);
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
