#include "robot/gyro_wait.h"

#if ROBOT_VISION && BSLAM_VISION_TURNS

#define SPEED_SD_LEAST_MPS 0.01f  // where the settings say that the wheels hardly err
#define SPEED_SD_MOST_MPS 100.0f
#define PAUSE_US 5000000  // longer than the visual gyro goes on over
#define TURN_RAD 6.2831853f
#define ROOT_HALF 0.70710678f

/// A lens of 180 degrees among the cameras makes all rates rough.
static bslam_real_t least_sd_radps(const camera_input_t *input)
{
    for (int i = 0; i < input->camera_count; i++) {
        if (input->cameras[i].lens == BSLAM_LENS_EQUIDISTANT) {
            return BSLAM_VISUAL_GYRO_WIDE_SD_RADPS;
        }
    }
    return BSLAM_VISUAL_GYRO_SD_RADPS;
}

void gyro_wait_start(gyro_wait_t *wait, camera_input_t *input)
{
    bslam_vision_forget_turns(&input->vision);
    const bslam_status_t status = bslam_visual_gyro_init(&wait->gyro, least_sd_radps(input));
    (void)status;  // of sizes that differ the front end tells
    wait->is_running = false;
    wait->is_waiting = false;
}

/// How far a wheel went: its counter rolls over at counter_modulus, or 2^counter_bits.
static bslam_real_t travel_m(const bslam_settings_t *settings, uint32_t before, uint32_t after,
                             bslam_real_t radius_m)
{
    const uint32_t by_bits = settings->counter_bits < 32 ? 1u << settings->counter_bits : 0;
    const uint32_t modulus = settings->counter_modulus > 0 ? (uint32_t)settings->counter_modulus : by_bits;
    const uint32_t up = after - before + (after < before ? modulus : 0), down = modulus - up;
    const bslam_real_t ticks = up < down ? (bslam_real_t)up : -(bslam_real_t)down;
    return ticks * (TURN_RAD / (bslam_real_t)settings->ticks_per_revolution) * radius_m;
}

/// Forward, mean since the reading before, not long ago.
static bslam_real_t speed_mps(const bslam_settings_t *settings, const bslam_odometry_reading_t *before,
                              const bslam_odometry_reading_t *now)
{
    const bslam_real_t left_m =
        travel_m(settings, before->left_ticks, now->left_ticks, settings->left_radius_m);
    const bslam_real_t right_m =
        travel_m(settings, before->right_ticks, now->right_ticks, settings->right_radius_m);
    return (left_m + right_m) / 2 * 1e6f / (bslam_real_t)(int32_t)(now->time_us - before->time_us);
}

/// Of the mean of two wheels that err independently.
static bslam_real_t speed_sd_mps(const bslam_settings_t *settings)
{
    const bslam_real_t sd_mps = ROOT_HALF * (settings->left_speed_sd_mps + settings->right_speed_sd_mps) / 2;
    if (sd_mps > SPEED_SD_MOST_MPS) {
        return SPEED_SD_MOST_MPS;
    }
    return sd_mps < SPEED_SD_LEAST_MPS ? SPEED_SD_LEAST_MPS : sd_mps;
}

bool gyro_wait_begin(gyro_wait_t *wait, camera_input_t *input, const bslam_settings_t *settings,
                     const bslam_odometry_reading_t *reading)
{
    const int64_t passed_us = reading->time_us - wait->reading.time_us;
    const bool follows = wait->is_running && passed_us > 0 && passed_us < PAUSE_US;
    const bslam_real_t mps = follows ? speed_mps(settings, &wait->reading, reading) : 0;
    const bool jumped = mps > settings->speed_max_mps || mps < -settings->speed_max_mps;
    wait->reading = *reading;
    if (jumped ||
        bslam_visual_gyro_advance(&wait->gyro, reading->time_us, mps, speed_sd_mps(settings)) != BSLAM_OK) {
        gyro_wait_start(wait, input);
        return false;
    }
    wait->is_running = true;
    wait->is_waiting = true;
    return true;
}

void gyro_wait_see(gyro_wait_t *wait, camera_input_t *input, int camera, int64_t time_us)
{
    if (!wait->is_running || wait->reading.time_us != time_us) {
        return;
    }
    bslam_turn_t turn;
    const bool tells = bslam_vision_turn(&input->vision, &turn);
    const bslam_status_t status = bslam_visual_gyro_take(&wait->gyro, camera, tells ? &turn : NULL);
    if (status == BSLAM_OK && wait->is_waiting) {
        bslam_odometry_reading_t *reading = &wait->reading;
        reading->has_gyro =
            bslam_visual_gyro_rate(&wait->gyro, &reading->gyro_radps, &reading->gyro_sd_radps);
    }
}

bool gyro_wait_end(gyro_wait_t *wait, bslam_odometry_reading_t *reading)
{
    const bool was_waiting = wait->is_waiting;
    wait->is_waiting = false;
    *reading = wait->reading;
    return was_waiting;
}

#endif
