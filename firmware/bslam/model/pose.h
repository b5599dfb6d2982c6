/// Rigid motions of the plane.
#ifndef BSLAM_MODEL_POSE_H
#define BSLAM_MODEL_POSE_H

#include "bslam/base/types.h"

/// a then b: the pose in a's reference of something whose pose in a's frame is b.
bslam_pose_t bslam_pose_compose(const bslam_pose_t *a, const bslam_pose_t *b);

/// The pose of a's reference in a's frame: compose(a, inverse(a)) is the identity.
bslam_pose_t bslam_pose_inverse(const bslam_pose_t *a);

/// V(turn): an increment (x, y), made while the frame turns by turn_rad, as a displacement in the frame
/// before. The translation of SE(2)'s exponential map. MATH "Right-invariant error".
void bslam_pose_exp_translation(bslam_real_t turn_rad, bslam_real_t *x, bslam_real_t *y);

#endif
