/// Odometry of a two-wheel robot: readings in, motion increments with covariance out.
///
/// Three sources: tick counts of two wheel encoders, the travel of each wheel, or velocities (v, omega); a
/// gyro rate may come beside each. All noise is described at the wheels and at the body (MATH "Odometry").
#ifndef BSLAM_MODEL_ODOMETRY_H
#define BSLAM_MODEL_ODOMETRY_H

#include "bslam/bslam.h"
#include "base/types.h"

/// Longer than this is no interval of odometry but an interruption. It also keeps the variance that one
/// interval can add within what float's digits carry through the next update.
#define BSLAM_INTERVAL_MAX_US INT64_C(4000000)

/// What the next reading is compared with. All zero: no reading yet; the first one starts the clock.
typedef struct bslam_odometry {
    int64_t time_us;  ///< of the last reading
    uint32_t left_ticks, right_ticks;
    uint32_t odd_left_ticks,
        odd_right_ticks;   ///< refused as a jump: either a glitch or the counters' new start
    int32_t odd_after_us;  ///< since the last reading
    uint8_t odd_count;     ///< refused readings that go with it, itself included; 0: none
    bool has_time;
    bool has_ticks;  ///< false: the next tick reading only sets the reference
} bslam_odometry_t;

/// Starts the clock, if nothing has: intervals count from here.
void bslam_odometry_start(bslam_odometry_t *odometry, int64_t time_us);

/// Forgets the clock and the tick reference: the next reading starts both. Its motion since is not known.
void bslam_odometry_restart(bslam_odometry_t *odometry);

/// Whether a stamp is a possible one, and farther from the clock than an interval may be, ahead or back.
bool bslam_odometry_is_elsewhere(const bslam_odometry_t *odometry, int64_t time_us);

/// The motion since the reading before, with the statuses of bslam_odometry. On any of these nothing changes,
/// but that BSLAM_E_JUMP notes odd counts. A first reading has no interval: BSLAM_OK with motion->dt_s = 0.
/// O(1).
BSLAM_MUST_CHECK bslam_status_t bslam_odometry_read(bslam_odometry_t *odometry,
                                                    const bslam_settings_t *settings,
                                                    const bslam_odometry_reading_t *reading,
                                                    bslam_motion_t *motion);

/// The count that the counters start at 0 in place of; 0: 2^32.
uint32_t bslam_odometry_modulus(const bslam_settings_t *settings);

/// Ticks from one counter value below the modulus to a later one, across at most half a roll-over either way.
int32_t bslam_odometry_tick_difference(uint32_t before, uint32_t after, uint32_t modulus);

#endif
