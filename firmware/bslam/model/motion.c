#include "bslam/model/motion.h"

#include "base/trig.h"
#include "base/scalar.h"

/// sin(h)/h and its derivative.
static void sinc(bslam_real_t h, bslam_real_t *value, bslam_real_t *slope)
{
    if (bslam_abs(h) < BSLAM_R(0.2)) {
        const bslam_real_t z = h * h;
        *value = 1 - z / 6 * (1 - z / 20 * (1 - z / 42 * (1 - z / 72)));
        *slope = -h / 3 * (1 - z / 10 * (1 - z / 28 * (1 - z / 54 * (1 - z / 88))));
        return;
    }
    bslam_real_t s, c;
    bslam_sin_cos(h, &s, &c);
    *value = s / h;
    *slope = (c - *value) / h;
}

bslam_pose_t bslam_motion_step(bslam_motion_kind_t kind, const bslam_pose_t *pose, bslam_real_t forward_m,
                               bslam_real_t turn_rad, bslam_motion_jacobian_t *jacobian)
{
    // An arc is its chord, in the heading at half way: length forward * sinc(turn/2).
    const bool arc = kind == BSLAM_MOTION_ARC;
    const bslam_real_t half_rad = arc ? turn_rad / 2 : 0;
    bslam_real_t ratio = 1, ratio_slope = 0;
    if (arc) {
        sinc(half_rad, &ratio, &ratio_slope);
    }
    bslam_real_t s, c;
    bslam_sin_cos(bslam_angle_wrap(pose->theta_rad + half_rad), &s, &c);
    const bslam_real_t chord_m = forward_m * ratio;
    const bslam_real_t dx_m = chord_m * c;
    const bslam_real_t dy_m = chord_m * s;

    const bslam_real_t stretch = arc ? forward_m * ratio_slope / 2 : 0;
    const bslam_real_t swing = arc ? BSLAM_R(0.5) : 0;
    jacobian->x_theta = -dy_m;
    jacobian->y_theta = dx_m;
    jacobian->x_forward = ratio * c;
    jacobian->y_forward = ratio * s;
    jacobian->x_turn = stretch * c - swing * dy_m;
    jacobian->y_turn = stretch * s + swing * dx_m;

    return (bslam_pose_t){
        .x_m = pose->x_m + dx_m,
        .y_m = pose->y_m + dy_m,
        .theta_rad = bslam_angle_wrap(pose->theta_rad + turn_rad),
    };
}
