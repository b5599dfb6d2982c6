/// Notices when the pipeline's memory is no longer what it was: a flipped bit, a stray write. Optional: who
/// does not call it pays nothing.
///
///     bslam_guard_init(&guard, &copy);
///     each step:  bslam_guard_check(&guard, &slam)     before it
///                 bslam_slam_odometry(...), ...
///                 bslam_guard_seal(&guard, &slam)      after it
///
/// Guarded is all that a later result depends on: parameters, state, covariance, beacons, odometry, waiting
/// motions, counters; not scratch, not the last accounts, and not machines and samples (a damaged one judges
/// looks worse, until its next training). The checksum is multiplicative, a word a time: any change within
/// one aligned word of 32 bits changes it for certain, any other change with odds of 2^32 to 1. A CRC would
/// find the same at ten times the instructions. About 5 instructions a word: 3,000 for 6 beacons, 11,000 for
/// 20, for a check or a seal.
///
/// After a warm restart (the RAM kept through a watchdog reset) a check says whether it can go on.
#ifndef BSLAM_STORE_GUARD_H
#define BSLAM_STORE_GUARD_H

#include "bslam/slam/slam.h"

/// Private but for the counters.
typedef struct bslam_guard {
    bslam_guard_counters_t counters;
    uint32_t checksum;
    uint32_t seal;  ///< a constant once there is a checksum: memory that holds anything has no such number
    bslam_slam_t *copy;
} bslam_guard_t;

/// Nothing is sealed yet. copy: the caller's, where each seal keeps the state to fall back to; NULL: none.
void bslam_guard_init(bslam_guard_t *guard, bslam_slam_t *copy);

/// The state is good as it is now.
void bslam_guard_seal(bslam_guard_t *guard, const bslam_slam_t *slam);

/// BSLAM_E_STATE: it is not as it was when it was sealed, or nothing was. Counts it, and changes nothing.
BSLAM_MUST_CHECK bslam_status_t bslam_guard_check(bslam_guard_t *guard, const bslam_slam_t *slam);

/// Puts the copy in the place of a state that is no longer good. What was fed since the seal is missing:
/// feed it again, or say so by bslam_slam_resume_odometry. BSLAM_E_STATE, and no change: there is no copy, or
/// it is not good either. Then init, and load the saved map (store/slots.h).
BSLAM_MUST_CHECK bslam_status_t bslam_guard_restore(bslam_guard_t *guard, bslam_slam_t *slam);

#endif
