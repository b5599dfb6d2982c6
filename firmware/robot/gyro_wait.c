#include "robot/gyro_wait.h"
#include "base/scalar.h"

#if SESSION_TURNS

#define SPEED_SD_LEAST_MPS 0.01f  // where the parameters say that the wheels hardly err
#define SPEED_SD_MOST_MPS 100.0f

/// A lens of 180 degrees among the cameras makes all rates rough.
static bslam_real_t least_sd_radps(const bslam_vision_t *vision)
{
    for (int i = 0; i < vision->camera_count; i++) {
        if (vision->cameras[i].lens == BSLAM_LENS_EQUIDISTANT) {
            return BSLAM_VISUAL_GYRO_WIDE_SD_RADPS;
        }
    }
    return BSLAM_VISUAL_GYRO_SD_RADPS;
}

void gyro_wait_start(gyro_wait_t *turning, const bslam_vision_t *vision)
{
    bslam_turns_init(&turning->turns, vision);
    bslam_visual_gyro_init(&turning->gyro, least_sd_radps(vision));
    bslam_odometry_init(&turning->wheels);
    turning->is_waiting = false;
}

static bslam_real_t within_limits(bslam_real_t sd_mps)
{
    if (sd_mps > SPEED_SD_MOST_MPS) {
        return SPEED_SD_MOST_MPS;
    }
    return sd_mps < SPEED_SD_LEAST_MPS ? SPEED_SD_LEAST_MPS : sd_mps;
}

static bslam_status_t advance(bslam_visual_gyro_t *gyro, int64_t time_us, const bslam_motion_t *motion)
{
    bslam_real_t speed_mps = 0;
    bslam_real_t sd_mps = SPEED_SD_LEAST_MPS;
    if (motion->dt_s > 0) {
        speed_mps = motion->forward_m / motion->dt_s;
        sd_mps = within_limits(bslam_sqrt(motion->forward_var_m2) / motion->dt_s);
    }
    return bslam_visual_gyro_advance(gyro, time_us, speed_mps, sd_mps);
}

bool gyro_wait_wait(gyro_wait_t *turning, const bslam_vision_t *vision, const bslam_settings_t *settings,
                    const bslam_odometry_reading_t *reading)
{
    bslam_motion_t motion;
    if (bslam_odometry_read(&turning->wheels, settings, reading, &motion) != BSLAM_OK ||
        advance(&turning->gyro, reading->time_us, &motion) != BSLAM_OK) {
        gyro_wait_start(turning, vision);
        return false;
    }
    turning->reading = *reading;
    turning->is_waiting = true;
    return true;
}

void gyro_wait_see(gyro_wait_t *turning, const bslam_vision_t *vision, int camera, int64_t time_us)
{
    if (!turning->gyro.running || turning->gyro.time_us != time_us) {
        return;
    }
    bslam_turn_t turn;
    const bool tells = bslam_turns_see(&turning->turns, vision, &turn);
    const bslam_status_t status = bslam_visual_gyro_take(&turning->gyro, camera, tells ? &turn : NULL);
    if (status == BSLAM_OK && turning->is_waiting) {
        bslam_odometry_reading_t *reading = &turning->reading;
        reading->has_gyro =
            bslam_visual_gyro_rate(&turning->gyro, &reading->gyro_radps, &reading->gyro_sd_radps);
    }
}

bool gyro_wait_end_wait(gyro_wait_t *turning, bslam_odometry_reading_t *reading)
{
    const bool was_waiting = turning->is_waiting;
    turning->is_waiting = false;
    *reading = turning->reading;
    return was_waiting;
}

#endif
