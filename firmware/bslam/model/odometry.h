/// Odometry of a two-wheel robot: readings in, motion increments with covariance out.
///
/// Three sources: tick counts of two wheel encoders, the travel of each wheel, or velocities (v, omega); a
/// gyro rate may come beside each. All noise is described at the wheels and at the body (MATH "Odometry").
#ifndef BSLAM_MODEL_ODOMETRY_H
#define BSLAM_MODEL_ODOMETRY_H

#include "bslam/settings.h"
#include "base/types.h"

typedef enum bslam_odometry_source {
    BSLAM_ODOMETRY_WHEELS = 0,  ///< left_m, right_m: travel of each wheel since the reading before
    BSLAM_ODOMETRY_TICKS,       ///< left_ticks, right_ticks: the counters, which roll over at counter_bits
    BSLAM_ODOMETRY_VELOCITY     ///< v_mps, omega_radps: held over the interval that ends at time_us
} bslam_odometry_source_t;

/// One reading. Only the source's own fields are read.
typedef struct bslam_odometry_reading {
    int64_t time_us;  ///< end of the interval
    bslam_odometry_source_t source;
    uint32_t left_ticks;
    uint32_t right_ticks;
    bslam_real_t left_m;
    bslam_real_t right_m;
    bslam_real_t v_mps;
    bslam_real_t omega_radps;
    bool has_gyro;
    bslam_real_t gyro_radps;     ///< mean turn rate over the interval; read only if has_gyro
    bslam_real_t gyro_sd_radps;  ///< noise of this one, as that is; 0: the parameter gyro_sd_radps
} bslam_odometry_reading_t;

/// What the next reading is compared with.
typedef struct bslam_odometry {
    int64_t time_us;  ///< of the last reading
    uint32_t left_ticks;
    uint32_t right_ticks;
    bool has_time;
    bool has_ticks;  ///< false: the next tick reading only sets the reference
} bslam_odometry_t;

/// No reading yet. The first one starts the clock; wheel travel and velocities then count from start_us.
void bslam_odometry_init(bslam_odometry_t *odometry);

/// Starts the clock, if nothing has: intervals count from here.
void bslam_odometry_start(bslam_odometry_t *odometry, int64_t time_us);

/// Forgets the clock and the tick reference: the next reading starts both. Its motion since is not known.
void bslam_odometry_restart(bslam_odometry_t *odometry);

/// The motion since the reading before, into *motion. O(1).
/// BSLAM_E_TIME: the time is negative, does not advance, or jumps by more than 4 s. BSLAM_E_NOT_FINITE,
/// BSLAM_E_RANGE (a counter beyond counter_bits, a gyro turn beyond 100 rad, a noise of it that is not 0
/// and outside the limits of the parameter, an unknown source),
/// BSLAM_E_JUMP: see status.h. On any of these nothing changes, but that
/// after BSLAM_E_JUMP the next tick reading is the new reference (the encoder was reset), and its interval a
/// gap. A first reading without a started clock has no interval: BSLAM_OK with motion->dt_s = 0.
BSLAM_MUST_CHECK bslam_status_t bslam_odometry_read(bslam_odometry_t *odometry,
                                                    const bslam_settings_t *settings,
                                                    const bslam_odometry_reading_t *reading,
                                                    bslam_motion_t *motion);

/// Ticks from one counter value to a later one, across at most half a roll-over either way. 2 <= bits <= 32.
int32_t bslam_odometry_tick_difference(uint32_t before, uint32_t after, int bits);

#endif
