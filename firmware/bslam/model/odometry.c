#include "bslam/model/odometry.h"

#include "base/trig.h"
#include "base/scalar.h"

static const bslam_real_t SECONDS_PER_US = BSLAM_R(1e-6);
static const int64_t TIME_MAX_US = INT64_MAX / 2;
/// More than this in one interval is no motion of a robot: 16 turns.
static const bslam_real_t TURN_MAX_RAD = BSLAM_R(100.0);
/// Limits of a reading's own gyro noise, as of the setting gyro_sd_radps.
static const bslam_real_t GYRO_SD_MIN_RADPS = BSLAM_R(1e-6), GYRO_SD_MAX_RADPS = BSLAM_R(100.0);

/// So many readings that jump from the reference and go with one another: the counters began anew.
enum { ODD_BELIEVED = 3 };

/// Travel of both wheels in one interval.
typedef struct wheel_travel {
    bslam_real_t left_m, right_m;
} wheel_travel_t;

void bslam_odometry_start(bslam_odometry_t *odometry, int64_t time_us)
{
    if (!odometry->has_time) {
        odometry->time_us = time_us;
        odometry->has_time = true;
    }
}

void bslam_odometry_restart(bslam_odometry_t *odometry)
{
    *odometry = (bslam_odometry_t){0};
}

uint32_t bslam_odometry_modulus(const bslam_settings_t *settings)
{
    return settings->counter_modulus > 0 ? (uint32_t)settings->counter_modulus
           : settings->counter_bits < 32 ? 1u << settings->counter_bits
                                         : 0;
}

int32_t bslam_odometry_tick_difference(uint32_t before, uint32_t after, uint32_t modulus)
{
    const uint32_t up = after - before + (after < before ? modulus : 0);
    const uint32_t down = modulus - up;
    if (up < down || up == 0) {
        return (int32_t)up;
    }
    return down == UINT32_C(1) << 31 ? INT32_MIN : -(int32_t)down;
}

/// From counts to those of a reading.
static wheel_travel_t travel_from(const bslam_settings_t *settings, uint32_t left_ticks, uint32_t right_ticks,
                                  const bslam_odometry_reading_t *reading)
{
    const uint32_t modulus = bslam_odometry_modulus(settings);
    const int32_t left = bslam_odometry_tick_difference(left_ticks, reading->left_ticks, modulus);
    const int32_t right = bslam_odometry_tick_difference(right_ticks, reading->right_ticks, modulus);
    const bslam_real_t radians_per_tick = 2 * BSLAM_PI / (bslam_real_t)settings->ticks_per_revolution;
    return (wheel_travel_t){(bslam_real_t)left * radians_per_tick * settings->left_radius_m,
                            (bslam_real_t)right * radians_per_tick * settings->right_radius_m};
}

static bslam_status_t ticks_to_travel(const bslam_odometry_t *odometry, const bslam_settings_t *settings,
                                      const bslam_odometry_reading_t *reading, wheel_travel_t *travel)
{
    const uint32_t last = bslam_odometry_modulus(settings) - 1;
    if (reading->left_ticks > last || reading->right_ticks > last) {
        return BSLAM_E_RANGE;
    }
    *travel = odometry->has_ticks
                  ? travel_from(settings, odometry->left_ticks, odometry->right_ticks, reading)
                  : (wheel_travel_t){0, 0};
    return BSLAM_OK;
}

static bslam_status_t reading_to_travel(const bslam_odometry_t *odometry, const bslam_settings_t *settings,
                                        const bslam_odometry_reading_t *reading, bslam_real_t dt_s,
                                        wheel_travel_t *travel)
{
    switch (reading->source) {
    case BSLAM_ODOMETRY_TICKS:
        return ticks_to_travel(odometry, settings, reading, travel);
    case BSLAM_ODOMETRY_WHEELS:
        *travel = (wheel_travel_t){reading->left_m, reading->right_m};
        break;
    case BSLAM_ODOMETRY_VELOCITY: {
        const bslam_real_t half_difference = reading->omega_radps * settings->wheelbase_m / 2;
        travel->left_m = (reading->v_mps - half_difference) * dt_s;
        travel->right_m = (reading->v_mps + half_difference) * dt_s;
        break;
    }
    default:
        return BSLAM_E_RANGE;
    }
    const bool finite = bslam_is_number(travel->left_m) && bslam_is_number(travel->right_m);
    return finite ? BSLAM_OK : BSLAM_E_NOT_FINITE;
}

static bslam_real_t square(bslam_real_t x)
{
    return x * x;
}

/// Wheel travel to body motion, with the noise of the wheels, of the body and of a gap. MATH "Odometry".
static void travel_to_motion(const bslam_settings_t *settings, const wheel_travel_t *travel,
                             bslam_real_t dt_s, bslam_real_t gap_s, bslam_motion_t *motion)
{
    const bslam_real_t base = settings->wheelbase_m;
    const bslam_real_t growth = square(settings->travel_sd_per_sqrt_m);
    const bslam_real_t left_var =
        square(settings->left_speed_sd_mps * dt_s) + growth * bslam_abs(travel->left_m);
    const bslam_real_t right_var =
        square(settings->right_speed_sd_mps * dt_s) + growth * bslam_abs(travel->right_m);
    motion->dt_s = dt_s;
    motion->forward_m = (travel->left_m + travel->right_m) / 2;
    motion->turn_rad = (travel->right_m - travel->left_m) / base;
    motion->forward_var_m2 = (left_var + right_var) / 4;
    motion->turn_var_rad2 = (left_var + right_var) / (base * base);
    motion->forward_turn_cov_mrad = (right_var - left_var) / (2 * base);

    const bslam_real_t travel_m = bslam_abs(motion->forward_m), turn = bslam_abs(motion->turn_rad);
    const bslam_real_t moving_s = travel_m > 0 || turn > 0 ? dt_s : 0;
    motion->forward_var_m2 += square(settings->forward_sd_per_sqrt_s) * moving_s +
                              square(settings->forward_sd_per_sqrt_m) * travel_m;
    motion->turn_var_rad2 += square(settings->turn_sd_per_sqrt_s) * moving_s +
                             square(settings->turn_sd_per_sqrt_m) * travel_m +
                             square(settings->turn_sd_per_sqrt_rad) * turn;
    motion->forward_var_m2 += square(settings->gap_speed_sd_mps * gap_s);
    motion->turn_var_rad2 += square(settings->gap_turn_sd_radps * gap_s);
}

/// The part of an interval in which the robot may have moved unseen: all of it while the tick reference is
/// missing.
static bslam_real_t unseen(const bslam_odometry_t *odometry, const bslam_settings_t *settings,
                           const bslam_odometry_reading_t *reading, bslam_real_t dt_s)
{
    if (reading->source == BSLAM_ODOMETRY_TICKS && !odometry->has_ticks) {
        return dt_s;
    }
    const bslam_real_t excess_s = dt_s - (bslam_real_t)settings->gap_us * SECONDS_PER_US;
    return excess_s > 0 ? excess_s : 0;
}

/// A stamp that may follow the last one.
static bool time_is_valid(const bslam_odometry_t *odometry, int64_t time_us)
{
    if (time_us < 0 || time_us > TIME_MAX_US) {
        return false;
    }
    return !odometry->has_time ||
           (time_us > odometry->time_us && time_us - odometry->time_us <= BSLAM_INTERVAL_MAX_US);
}

bool bslam_odometry_is_elsewhere(const bslam_odometry_t *odometry, int64_t time_us)
{
    return odometry->has_time && time_us >= 0 && time_us <= TIME_MAX_US &&
           (time_us > odometry->time_us + BSLAM_INTERVAL_MAX_US ||
            time_us < odometry->time_us - BSLAM_INTERVAL_MAX_US);
}

/// True if the wheels cannot have moved like this.
static bool is_jump(const bslam_settings_t *settings, const wheel_travel_t *travel, bslam_real_t dt_s)
{
    const bslam_real_t travel_max_m = settings->speed_max_mps * dt_s;
    return bslam_abs(travel->left_m) > travel_max_m || bslam_abs(travel->right_m) > travel_max_m ||
           bslam_abs(travel->right_m - travel->left_m) > TURN_MAX_RAD * settings->wheelbase_m;
}

/// A reading whose counts go with an odd one says that the counters began anew there, once enough do: *travel
/// is that since then, *unseen_s what went before. One that goes with the reference again says that the odd
/// one was a glitch, of which nothing is lost.
static bslam_status_t judge_ticks(bslam_odometry_t *odometry, const bslam_settings_t *settings,
                                  const bslam_odometry_reading_t *reading, int32_t dt_us,
                                  wheel_travel_t *travel, bslam_real_t *unseen_s)
{
    const bool jumps = is_jump(settings, travel, (bslam_real_t)dt_us * SECONDS_PER_US);
    const wheel_travel_t since_odd =
        travel_from(settings, odometry->odd_left_ticks, odometry->odd_right_ticks, reading);
    const bslam_real_t since_s = (bslam_real_t)(dt_us - odometry->odd_after_us) * SECONDS_PER_US;
    const bool goes_with_odd = odometry->odd_count > 0 && !is_jump(settings, &since_odd, since_s);
    if (!jumps && !goes_with_odd) {
        return BSLAM_OK;
    }
    if (!goes_with_odd) {
        odometry->odd_left_ticks = reading->left_ticks;
        odometry->odd_right_ticks = reading->right_ticks;
        odometry->odd_after_us = dt_us;
        odometry->odd_count = 0;
    }
    odometry->odd_count++;
    if (odometry->odd_count < ODD_BELIEVED) {
        return BSLAM_E_JUMP;
    }
    *travel = since_odd;
    *unseen_s = (bslam_real_t)odometry->odd_after_us * SECONDS_PER_US;
    return BSLAM_OK;
}

static bslam_status_t judge(bslam_odometry_t *odometry, const bslam_settings_t *settings,
                            const bslam_odometry_reading_t *reading, int32_t dt_us, wheel_travel_t *travel,
                            bslam_real_t *unseen_s)
{
    const bslam_real_t dt_s = (bslam_real_t)dt_us * SECONDS_PER_US;
    *unseen_s = unseen(odometry, settings, reading, dt_s);
    if (!odometry->has_time) {
        return BSLAM_OK;
    }
    if (reading->source == BSLAM_ODOMETRY_TICKS && odometry->has_ticks) {
        return judge_ticks(odometry, settings, reading, dt_us, travel, unseen_s);
    }
    return is_jump(settings, travel, dt_s) ? BSLAM_E_JUMP : BSLAM_OK;
}

static bslam_status_t check_gyro(const bslam_odometry_reading_t *reading, bslam_real_t dt_s)
{
    const bslam_real_t sd_radps = reading->gyro_sd_radps;
    if (!bslam_is_number(reading->gyro_radps) || !bslam_is_number(sd_radps)) {
        return BSLAM_E_NOT_FINITE;
    }
    const bool is_far = bslam_abs(reading->gyro_radps) * dt_s > TURN_MAX_RAD;
    const bool is_odd = sd_radps != 0 && !bslam_in_range(sd_radps, GYRO_SD_MIN_RADPS, GYRO_SD_MAX_RADPS);
    return is_far || is_odd ? BSLAM_E_RANGE : BSLAM_OK;
}

/// Kalman update of (forward, turn) with the turn that the gyro measured.
static void fuse_gyro(bslam_motion_t *motion, bslam_real_t gyro_turn_rad, bslam_real_t gyro_var_rad2)
{
    const bslam_real_t sum = motion->turn_var_rad2 + gyro_var_rad2;
    const bslam_real_t forward_gain = motion->forward_turn_cov_mrad / sum;
    const bslam_real_t turn_gain = motion->turn_var_rad2 / sum;
    const bslam_real_t innovation = gyro_turn_rad - motion->turn_rad;
    motion->forward_m += forward_gain * innovation;
    motion->turn_rad += turn_gain * innovation;
    motion->forward_var_m2 -= forward_gain * motion->forward_turn_cov_mrad;
    motion->forward_turn_cov_mrad -= turn_gain * motion->forward_turn_cov_mrad;
    motion->turn_var_rad2 -= turn_gain * motion->turn_var_rad2;
}

bslam_status_t bslam_odometry_read(bslam_odometry_t *odometry, const bslam_settings_t *settings,
                                   const bslam_odometry_reading_t *reading, bslam_motion_t *motion)
{
    if (!time_is_valid(odometry, reading->time_us)) {
        return BSLAM_E_TIME;
    }
    const int32_t dt_us = odometry->has_time ? (int32_t)(reading->time_us - odometry->time_us) : 0;
    const bslam_real_t dt_s = (bslam_real_t)dt_us * SECONDS_PER_US;
    if (reading->has_gyro) {
        const bslam_status_t gyro_status = check_gyro(reading, dt_s);
        if (gyro_status != BSLAM_OK) {
            return gyro_status;
        }
    }
    wheel_travel_t travel;
    bslam_real_t unseen_s;
    bslam_status_t status = reading_to_travel(odometry, settings, reading, dt_s, &travel);
    if (status == BSLAM_OK) {
        status = judge(odometry, settings, reading, dt_us, &travel, &unseen_s);
    }
    if (status != BSLAM_OK) {
        return status;
    }
    *motion = (bslam_motion_t){0};
    if (odometry->has_time) {
        travel_to_motion(settings, &travel, dt_s, unseen_s, motion);
        // A rate is that of the time since the reading before, refused ones too.
        if (reading->has_gyro && odometry->odd_count == 0) {
            const bslam_real_t own_sd_radps = reading->gyro_sd_radps;
            const bslam_real_t sd_radps = own_sd_radps > 0 ? own_sd_radps : settings->gyro_sd_radps;
            fuse_gyro(motion, reading->gyro_radps * dt_s, square(sd_radps * dt_s));
        }
    }
    // A reading of another source covers motion that the counters saw too: the next tick reading starts
    // afresh.
    *odometry = (bslam_odometry_t){
        .time_us = reading->time_us, .has_time = true, .has_ticks = reading->source == BSLAM_ODOMETRY_TICKS};
    if (odometry->has_ticks) {
        odometry->left_ticks = reading->left_ticks;
        odometry->right_ticks = reading->right_ticks;
    }
    return BSLAM_OK;
}
