/// Notices when the pipeline's memory is no longer what it was: a flipped bit, a stray write.
///
/// Guarded is all that a later result depends on, but scratch, the last accounts, and the samples of
/// classifiers: a damaged sample judges appearance worse until it is replaced. Of what stands beside the
/// pipeline each member has a checksum of its own: one that is damaged begins anew (bslam.c).
///
/// The checksum is multiplicative, a word a time: any change within one aligned word of 32 bits changes it
/// for certain, any other change with odds of 2^32 to 1. A CRC would find the same at ten times the
/// instructions.
#ifndef BSLAM_STORE_GUARD_H
#define BSLAM_STORE_GUARD_H

#include "bslam/slam/slam.h"

/// What is watched beside the pipeline: recovery, appearance, smoother, doubts.
#define BSLAM_GUARD_MEMBERS 4

typedef struct bslam_guard {
    bslam_guard_counters_t counters;
    uint32_t checksum;
    uint32_t seal;  ///< a constant once there is a checksum: memory that holds anything has no such number
    uint32_t members[BSLAM_GUARD_MEMBERS];  ///< their checksums
    bslam_slam_t *copy;  ///< where each seal keeps the state to fall back to; NULL: nowhere
} bslam_guard_t;

/// Goes on with a checksum: five instructions for each whole word of 32 bits.
uint32_t bslam_guard_sum(uint32_t sum, const void *bytes, size_t size);

/// The state is good as it is now.
void bslam_guard_seal(bslam_guard_t *guard, const bslam_slam_t *slam);

bool bslam_guard_is_sealed(const bslam_guard_t *guard);

/// BSLAM_E_STATE: it is not as it was when it was sealed, or nothing was. Counts it, and changes nothing.
BSLAM_MUST_CHECK bslam_status_t bslam_guard_check(bslam_guard_t *guard, const bslam_slam_t *slam);

/// Puts the copy in the place of a state that is no longer good. BSLAM_E_STATE, and no change: there is no
/// copy, or it is not good either.
BSLAM_MUST_CHECK bslam_status_t bslam_guard_restore(bslam_guard_t *guard, bslam_slam_t *slam);

#endif
