/// The motions that the filter took lately, so that a sighting may be older than the pose. MATH "Late
/// sightings".
#ifndef BSLAM_SLAM_HISTORY_H
#define BSLAM_SLAM_HISTORY_H

#include "bslam/base/params.h"
#include "bslam/base/types.h"

/// One motion.
typedef struct bslam_history_step {
    int64_t end_us;
    bslam_real_t dt_s;
    bslam_real_t forward_m;
    bslam_real_t turn_rad;
} bslam_history_step_t;

/// The last BSLAM_HISTORY_MAX motions. All zero is the empty history.
typedef struct bslam_history {
    bslam_history_step_t steps[BSLAM_HISTORY_MAX];
    int32_t count;
    int32_t next;  ///< where the next one goes
} bslam_history_t;

/// Remembers a motion that ended at end_us; forgets the oldest if there is no room.
void bslam_history_add(bslam_history_t *history, int64_t end_us, const bslam_motion_t *moved);

/// Forgets all.
void bslam_history_clear(bslam_history_t *history);

/// The robot at time_us as seen from the robot at now_us, the end of the last motion; after it the robot goes
/// on as in that motion. O(count). BSLAM_E_TIME, and no change: older than the history, or more than
/// ahead_max_us ahead.
BSLAM_MUST_CHECK bslam_status_t bslam_history_relative_pose(const bslam_history_t *history,
                                                            const bslam_params_t *params, int64_t now_us,
                                                            int64_t time_us, bslam_pose_t *relative);

#endif
