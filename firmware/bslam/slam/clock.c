// Odometry's clock: an interruption that is told, and a clock that begins again without a word.
#include <string.h>

#include "base/scalar.h"
#include "bslam/slam/doubt.h"
#include "bslam/slam/slam_internal.h"

static const bslam_real_t SECONDS_PER_US = BSLAM_R(1e-6);
/// Readings that follow one another elsewhere in time for so long are no glitch of a stamp.
static const int64_t WATCH_US = INT64_C(1000000);

/// The past is no longer that of the next reading, which starts the clock anew.
static void resume(bslam_slam_t *slam, bslam_real_t position_sd_m, bslam_real_t heading_sd_rad)
{
    bslam_slam_predict_until(slam, 0);
    bslam_slam_end_doubt(slam);
    bslam_ekf_resume(&slam->ekf, &slam->settings, position_sd_m * position_sd_m,
                     heading_sd_rad * heading_sd_rad);
    bslam_slam_restart_smoother(slam);
    bslam_odometry_restart(&slam->odometry);
    bslam_history_clear(&slam->history);
    memset(slam->frames, 0, sizeof slam->frames);
    slam->watch.has_some = false;
}

bslam_status_t bslam_slam_resume_odometry(bslam_slam_t *slam, bslam_real_t position_sd_m,
                                          bslam_real_t heading_sd_rad)
{
    if (!bslam_slam_are_doubts(position_sd_m, heading_sd_rad)) {
        return BSLAM_E_RANGE;
    }
    resume(slam, position_sd_m, heading_sd_rad);
    return BSLAM_OK;
}

/// Whether readings that are refused for their time have followed one another for WATCH_US: not the stamps
/// are wrong then, it is the clock that began again.
static bool clock_began_again(bslam_slam_t *slam, int64_t time_us)
{
    bslam_clock_watch_t *watch = &slam->watch;
    if (!bslam_odometry_is_elsewhere(&slam->odometry, time_us)) {
        watch->has_some = false;
        return false;
    }
    if (!watch->has_some || time_us <= watch->to_us || time_us - watch->to_us > BSLAM_INTERVAL_MAX_US) {
        watch->from_us = time_us;
    }
    watch->has_some = true;
    watch->to_us = time_us;
    return time_us - watch->from_us >= WATCH_US;
}

static bslam_real_t least(bslam_real_t a, bslam_real_t b)
{
    return a < b ? a : b;
}

/// The refused readings were a gap, and this one starts the clock.
static bslam_status_t begin_again(bslam_slam_t *slam, const bslam_odometry_reading_t *reading)
{
    const bslam_settings_t *settings = &slam->settings;
    bslam_odometry_t begun = {0};
    bslam_motion_t none;
    const bslam_status_t status = bslam_odometry_read(&begun, settings, reading, &none);
    if (status == BSLAM_OK) {
        const int32_t gap_us = (int32_t)(slam->watch.to_us - slam->watch.from_us);  // two of the longest
        const bslam_real_t gap_s = (bslam_real_t)gap_us * SECONDS_PER_US;           // intervals at most
        resume(slam, least(settings->gap_speed_sd_mps * gap_s, BSLAM_POSITION_SD_MAX_M),
               least(settings->gap_turn_sd_radps * gap_s, BSLAM_HEADING_SD_MAX_RAD));
        slam->odometry = begun;
        slam->counters.clock_restarts++;
    }
    return status;
}

bslam_status_t bslam_slam_odometry(bslam_slam_t *slam, const bslam_odometry_reading_t *reading)
{
    bslam_status_t status = bslam_slam_queue_odometry(slam, reading);
    if (status == BSLAM_E_TIME && clock_began_again(slam, reading->time_us)) {
        status = begin_again(slam, reading);
    }
    if (status == BSLAM_OK) {
        slam->watch.has_some = false;
        slam->counters.odometry++;
    } else {
        slam->counters.odometry_refused++;
        slam->counters.jumps += status == BSLAM_E_JUMP ? 1u : 0u;
    }
    return status;
}
