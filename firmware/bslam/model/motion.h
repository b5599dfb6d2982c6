/// The motion model: where an increment of odometry takes the robot, with Jacobians. Paper equation (2); MATH
/// "Motion".
#ifndef BSLAM_MODEL_MOTION_H
#define BSLAM_MODEL_MOTION_H

#include "base/types.h"

typedef enum bslam_motion_kind {
    BSLAM_MOTION_EULER = 0,  ///< the whole way in the old heading: equation (2) as printed
    BSLAM_MOTION_ARC = 1     ///< the circular arc that constant wheel speeds drive
} bslam_motion_kind_t;

/// Derivatives of the new pose (x, y, theta). Those not listed are 0 or, d theta/d theta and d theta/d
/// turn, 1.
typedef struct bslam_motion_jacobian {
    bslam_real_t x_theta, y_theta, x_forward, y_forward, x_turn, y_turn;
} bslam_motion_jacobian_t;

/// The pose after going forward_m along the path while turning by turn_rad. Pure.
bslam_pose_t bslam_motion_step(bslam_motion_kind_t kind, const bslam_pose_t *pose, bslam_real_t forward_m,
                               bslam_real_t turn_rad, bslam_motion_jacobian_t *jacobian);

#endif
