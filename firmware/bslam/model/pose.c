#include "bslam/model/pose.h"

#include "base/trig.h"
#include "base/scalar.h"

bslam_pose_t bslam_pose_compose(const bslam_pose_t *a, const bslam_pose_t *b)
{
    bslam_real_t s, c;
    bslam_sin_cos(a->theta_rad, &s, &c);
    return (bslam_pose_t){
        .x_m = a->x_m + c * b->x_m - s * b->y_m,
        .y_m = a->y_m + s * b->x_m + c * b->y_m,
        .theta_rad = bslam_angle_wrap(a->theta_rad + b->theta_rad),
    };
}

bslam_pose_t bslam_pose_inverse(const bslam_pose_t *a)
{
    bslam_real_t s, c;
    bslam_sin_cos(a->theta_rad, &s, &c);
    return (bslam_pose_t){
        .x_m = -c * a->x_m - s * a->y_m,
        .y_m = s * a->x_m - c * a->y_m,
        .theta_rad = bslam_angle_wrap(-a->theta_rad),
    };
}

bslam_turning_t bslam_turning(bslam_real_t turn_rad)
{
    bslam_real_t along, across;
    if (bslam_abs(turn_rad) < BSLAM_R(0.02)) {
        const bslam_real_t square = turn_rad * turn_rad;
        along = 1 - square / 6 * (1 - square / 20 * (1 - square / 42));
        across = turn_rad / 2 * (1 - square / 12 * (1 - square / 30 * (1 - square / 56)));
    } else {
        bslam_real_t s, c;
        bslam_sin_cos(turn_rad, &s, &c);
        along = s / turn_rad;
        // 1 - cos(t) = sin²(t) / (1 + cos(t)) keeps its digits for small t; the plain form does near pi.
        across = (c > 0 ? s * s / (1 + c) : 1 - c) / turn_rad;
    }
    return (bslam_turning_t){along, across};
}
