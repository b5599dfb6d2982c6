/// The motions that odometry reported lately: those that wait for the filter, which stands at the last frame,
/// and before them those that it went through. MATH "Late sightings".
#ifndef BSLAM_MODEL_ODOMETRY_HISTORY_H
#define BSLAM_MODEL_ODOMETRY_HISTORY_H

#include "bslam/settings.h"
#include "base/types.h"

/// One motion: as odometry reported it while it waits, as the filter took it from then on.
typedef struct bslam_history_step {
    int32_t duration_us;
    bslam_real_t forward_m, turn_rad, forward_var_m2, turn_var_rad2, forward_turn_cov_mrad;
} bslam_history_step_t;

/// A moment within the waiting motions.
typedef struct bslam_history_place {
    int64_t behind_us;  ///< before the end of the newest motion
    int32_t waiting;    ///< motions that end after it
    int32_t gone_us;    ///< since the oldest of these began
} bslam_history_place_t;

/// The last motions, as many as there is room for: 1 to BSLAM_HISTORY_MAX. All zero is the empty history.
typedef struct bslam_history {
    bslam_history_step_t steps[BSLAM_HISTORY_MAX];
    int32_t count;
    int32_t next;                  ///< where the next one goes
    bslam_history_place_t filter;  ///< where the filter stands
    bslam_real_t gone_forward_m;   ///< as the filter took it, since the oldest waiting motion began
    bslam_real_t gone_turn_rad;
} bslam_history_t;

/// Remembers a motion of this duration, which now waits, of fewer than `room` then; forgets the oldest if
/// there is no room.
void bslam_history_add(bslam_history_t *history, int32_t room, int32_t duration_us,
                       const bslam_motion_t *motion);

/// Forgets all.
void bslam_history_clear(bslam_history_t *history);

/// The motion from *place on, as odometry has it: to the end of its step, or if that is earlier to the moment
/// until_us before the end of the newest motion. A part of a step has its share of way, turn and variances.
/// Moves *place there. place->behind_us > until_us >= 0. O(1).
bslam_motion_t bslam_history_walk(const bslam_history_t *history, bslam_history_place_t *place,
                                  int64_t until_us);

/// The filter has gone on to *place, where bslam_history_walk led from history->filter, and took that motion
/// for `moved`.
void bslam_history_take(bslam_history_t *history, const bslam_history_place_t *place,
                        const bslam_motion_t *moved);

/// The robot of a moment before the filter's, as seen from where the filter stands.
typedef struct bslam_history_view {
    bslam_pose_t robot;
    bslam_real_t forward_var_m2, turn_var_rad2;  ///< of the way between, as odometry told it
} bslam_history_view_t;

/// That of back_us > 0 before the filter. O(count). BSLAM_E_TIME, and no change: older than the history.
BSLAM_MUST_CHECK bslam_status_t bslam_history_look_back(const bslam_history_t *history,
                                                        const bslam_settings_t *settings, int64_t back_us,
                                                        bslam_history_view_t *view);

/// The newest motion as it stands; dt_s = 0 if there is none.
bslam_motion_t bslam_history_newest(const bslam_history_t *history);

/// The robot ahead_us < 2^31 after the end of `last` as seen from there, if it goes on as in that motion.
bslam_pose_t bslam_history_look_ahead(const bslam_settings_t *settings, const bslam_motion_t *last,
                                      int64_t ahead_us);

#endif
