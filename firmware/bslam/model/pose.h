/// Rigid motions of the plane.
#ifndef BSLAM_MODEL_POSE_H
#define BSLAM_MODEL_POSE_H

#include "base/types.h"

/// a then b: the pose in a's reference of something whose pose in a's frame is b.
bslam_pose_t bslam_pose_compose(const bslam_pose_t *a, const bslam_pose_t *b);

/// The pose of a's reference in a's frame: compose(a, inverse(a)) is the identity.
bslam_pose_t bslam_pose_inverse(const bslam_pose_t *a);

/// V(turn) of MATH "Right-invariant error": what a turn by an angle t makes of an increment.
typedef struct bslam_turning {
    bslam_real_t along;   ///< sin(t) / t
    bslam_real_t across;  ///< (1 - cos(t)) / t
} bslam_turning_t;

bslam_turning_t bslam_turning(bslam_real_t turn_rad);

/// An increment (x, y), made while the frame turns, as a displacement in the frame before: the translation of
/// SE(2)'s exponential map.
static inline void bslam_turning_apply(const bslam_turning_t *turning, bslam_real_t *x, bslam_real_t *y)
{
    const bslam_real_t x_before = *x;
    *x = turning->along * x_before - turning->across * *y;
    *y = turning->across * x_before + turning->along * *y;
}

#endif
