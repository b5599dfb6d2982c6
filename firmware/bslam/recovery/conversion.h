/// The paper's localisation by one recognised beacon (Section III): the robot's pose in the beacon's frame
/// from how large and how slanted it appears, and that pose turned into the global frame, equation (12).
/// MATH "Coordinate conversion".
///
/// The beacon's frame: origin at the beacon, x out of the wall it hangs on, y to the left of someone who
/// looks along x. A flat beacon looks as slanted from one side as from the other: the caller chooses.
#ifndef BSLAM_RECOVERY_CONVERSION_H
#define BSLAM_RECOVERY_CONVERSION_H

#include "bslam/base/status.h"
#include "bslam/base/types.h"

/// A pose and its covariance: the lower triangle xx, yx, yy, tx, ty, tt in m², m rad, rad².
typedef struct bslam_doubtful_pose {
    bslam_pose_t pose;
    bslam_real_t covariance[6];
} bslam_doubtful_pose_t;

/// What is known of a recognised beacon, and how it appears.
typedef struct bslam_appearance {
    bslam_real_t height_m;  ///< its true size
    bslam_real_t width_m;
    bslam_real_t height_rad;  ///< apparent size
    bslam_real_t width_rad;
    bslam_real_t bearing_rad;  ///< in the robot's frame
    bslam_real_t size_sd_rad;  ///< of each apparent size
    bslam_real_t bearing_sd_rad;
    bool from_left;  ///< the robot is at positive y in the beacon's frame
} bslam_appearance_t;

/// X_B, the robot in the beacon's frame: distance from the apparent height, viewing angle from the apparent
/// width against the height. BSLAM_E_NOT_FINITE; BSLAM_E_RANGE: a size, an apparent size or a deviation that
/// is not positive, or an apparent size of a quarter turn and more. Wider than it can be counts as seen from
/// the front. The covariance is of first order; near the front, where the width hardly changes, the angle is
/// as doubtful as its second order makes it.
BSLAM_MUST_CHECK bslam_status_t bslam_pose_in_beacon_frame(const bslam_appearance_t *seen,
                                                           bslam_doubtful_pose_t *in_beacon);

/// Equation (12), X_G = C X_B: `beacon` is the pose of the beacon's frame in the global one, with its own
/// covariance, independent of the other's.
void bslam_pose_to_global(const bslam_doubtful_pose_t *beacon, const bslam_doubtful_pose_t *in_beacon,
                          bslam_doubtful_pose_t *global);

#endif
