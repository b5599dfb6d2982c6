#include "vision/built_in/gyro/visual_gyro.h"
#include "base/scalar.h"

#include <string.h>

// Places in the state.
enum {
    RATE = 0,
    SPEED = 1,
    HEADING = 2,  // from what was told
    TURNS = 3,
    NEARNESS = TURNS + BSLAM_CAMERAS_MAX,
    STATES = BSLAM_VISUAL_GYRO_STATES
};

_Static_assert(sizeof(bslam_gyro_filter_t) <= sizeof(bslam_visual_gyro_t), "size.h: the visual gyro");

static const int64_t NO_FRAME = INT64_MIN;
static const int64_t STEP_MAX_US = 4000000;
static const bslam_real_t SECONDS_PER_US = BSLAM_R(1e-6);

// Tried on the paper's room, drives 0:8, and on beacons in pairs, 100:106.
static const bslam_real_t RATE_SD = BSLAM_R(0.5);              // rad/s, before anything is known
static const bslam_real_t RATE_SD_PER_SQRT_S = BSLAM_R(0.75);  // rad/s
static const bslam_real_t SPEED_SD = BSLAM_R(0.2);             // m/s
static const bslam_real_t SPEED_SD_PER_SQRT_S = BSLAM_R(0.12);
// How much nearer things are than the turn's parallax has it, in that one's standard deviations.
static const bslam_real_t NEARNESS_SD = 2;
static const bslam_real_t NEARNESS_LASTS_S = BSLAM_R(0.6);
// A frame's turn: least noise, and how much more for patterns that match badly.
static const bslam_real_t TURN_SD = BSLAM_R(0.001);
static const bslam_real_t TURN_SD_PER_MISMATCH = BSLAM_R(0.02);
// Turns farther off than this many standard deviations are seen past something near that the floor line does
// not show, if that can be; else they are refused, and so many in a row believed.
static const bslam_real_t GATE = 5;
static const bslam_real_t NEAR_SD = 20;  // which is 1/m or so at the side
enum { REFUSED_MAX = 4 };
static const bslam_real_t TOLD_SD = BSLAM_R(0.4);  // rad/s
// How the heading's variance grows is averaged over so long, or a map would be told of an error, correct it
// by what it sees, and be told the correction, too, as if that were sure. Tried on drives 1020:1036 and
// 1040:1060.
static const bslam_real_t GROWTH_LASTS_S = 1;
static const bslam_real_t GROWTH_FACTOR = 2;

static bslam_real_t square(bslam_real_t x)
{
    return x * x;
}

bslam_status_t bslam_visual_gyro_init_sized(bslam_visual_gyro_t *instance, size_t gyro_bytes,
                                            uint32_t sizes_hash, bslam_real_t least_sd_radps)
{
    if (gyro_bytes != sizeof *instance || sizes_hash != BSLAM_VISION_HASH) {
        return BSLAM_E_SIZE;
    }
    bslam_gyro_filter_t *gyro = bslam_gyro_filter(instance);
    memset(gyro, 0, sizeof *gyro);
    gyro->least_sd_radps = least_sd_radps;
    gyro->covariance[RATE][RATE] = square(RATE_SD);
    gyro->covariance[SPEED][SPEED] = square(SPEED_SD);
    for (int32_t camera = 0; camera < BSLAM_CAMERAS_MAX; camera++) {
        gyro->covariance[NEARNESS + camera][NEARNESS + camera] = square(NEARNESS_SD);
        gyro->frame_us[camera] = NO_FRAME;
    }
    return BSLAM_OK;
}

/// A linear measurement, coefficients of the state, with its innovation and noise. False if gated out.
static bool update(bslam_gyro_filter_t *gyro, const bslam_real_t *coefficients, bslam_real_t innovation,
                   bslam_real_t variance, bool gated)
{
    bslam_real_t cross[STATES], sum = variance;
    for (int32_t i = 0; i < STATES; i++) {
        cross[i] = 0;
        for (int32_t j = 0; j < STATES; j++) {
            cross[i] += gyro->covariance[i][j] * coefficients[j];
        }
        sum += coefficients[i] * cross[i];
    }
    if (gated && square(innovation) > square(GATE) * sum) {
        return false;
    }
    for (int32_t i = 0; i < STATES; i++) {
        gyro->state[i] += cross[i] / sum * innovation;
        for (int32_t j = 0; j < STATES; j++) {
            gyro->covariance[i][j] -= cross[i] * cross[j] / sum;
        }
    }
    return true;
}

/// Multiplies a state value, and adds to its variance.
static void scale_state(bslam_gyro_filter_t *gyro, int32_t place, bslam_real_t factor, bslam_real_t variance)
{
    gyro->state[place] *= factor;
    for (int32_t j = 0; j < STATES; j++) {
        gyro->covariance[place][j] *= factor;
        gyro->covariance[j][place] *= factor;
    }
    gyro->covariance[place][place] += variance;
}

/// Of a time that is not negative; one beyond 32 bits, half an hour, is as long as that. A conversion from 64
/// bits would be one by way of double on a core without floating point.
static bslam_real_t seconds(int64_t time_us)
{
    return (bslam_real_t)(time_us < INT32_MAX ? (int32_t)time_us : INT32_MAX) * SECONDS_PER_US;
}

/// Adds the rate's turn to an angle.
static void turn_on(bslam_gyro_filter_t *gyro, int32_t angle, bslam_real_t dt_s)
{
    gyro->state[angle] += dt_s * gyro->state[RATE];
    for (int32_t j = 0; j < STATES; j++) {
        gyro->covariance[angle][j] += dt_s * gyro->covariance[RATE][j];
    }
    for (int32_t j = 0; j < STATES; j++) {
        gyro->covariance[j][angle] += dt_s * gyro->covariance[j][RATE];
    }
}

static void predict(bslam_gyro_filter_t *gyro, bslam_real_t dt_s)
{
    gyro->covariance[RATE][RATE] += square(RATE_SD_PER_SQRT_S) * dt_s;
    gyro->covariance[SPEED][SPEED] += square(SPEED_SD_PER_SQRT_S) * dt_s;
    turn_on(gyro, HEADING, dt_s);
    for (int32_t camera = 0; camera < BSLAM_CAMERAS_MAX; camera++) {
        turn_on(gyro, TURNS + camera, dt_s);
        // What is near may be gone as soon as it came: the change is as large as the nearness itself.
        const bslam_real_t kept = NEARNESS_LASTS_S / (NEARNESS_LASTS_S + dt_s);
        const bslam_real_t spread = square(NEARNESS_SD) + square(gyro->state[NEARNESS + camera]);
        scale_state(gyro, NEARNESS + camera, kept, spread * (1 - square(kept)));
    }
}

/// By how much the heading's variance grows in a second, of late and in the last step; frames that tell of
/// steps before make it shrink.
static bslam_real_t growth(const bslam_gyro_filter_t *gyro)
{
    const bslam_real_t share = gyro->step_s < GROWTH_LASTS_S ? gyro->step_s / GROWTH_LASTS_S : 1;
    const bslam_real_t now_rad2ps = gyro->covariance[HEADING][HEADING] / gyro->step_s;
    return gyro->growth_rad2ps + share * (now_rad2ps - gyro->growth_rad2ps);
}

/// Whoever was told a rate knows of the heading and of how doubtful it is; else the wheels have told the
/// turn.
static void end_step(bslam_gyro_filter_t *gyro)
{
    if (gyro->told) {
        gyro->growth_rad2ps = growth(gyro);
        gyro->covariance[HEADING][HEADING] = 0;
        gyro->state[HEADING] = 0;
    } else {
        scale_state(gyro, HEADING, 0, 0);
    }
    gyro->told = false;
}

bslam_status_t bslam_visual_gyro_advance(bslam_visual_gyro_t *instance, int64_t time_us,
                                         bslam_real_t speed_mps, bslam_real_t speed_sd_mps)
{
    bslam_gyro_filter_t *gyro = bslam_gyro_filter(instance);
    if (!bslam_is_number(speed_mps)) {
        return BSLAM_E_NOT_FINITE;
    }
    if (!bslam_in_range(speed_sd_mps, BSLAM_R(1e-4), 100)) {
        return BSLAM_E_RANGE;
    }
    if (gyro->running && (time_us <= gyro->time_us || time_us - gyro->time_us > STEP_MAX_US)) {
        return BSLAM_E_TIME;
    }
    if (gyro->running) {
        end_step(gyro);
        gyro->step_s = seconds(time_us - gyro->time_us);
        predict(gyro, gyro->step_s);
        const bslam_real_t coefficients[STATES] = {[SPEED] = 1};
        (void)update(gyro, coefficients, speed_mps - gyro->state[SPEED], square(speed_sd_mps), false);
    }
    gyro->time_us = time_us;
    gyro->running = true;
    return BSLAM_OK;
}

/// Takes a turn that spans the time since the camera's frame before.
static void take_turn(bslam_gyro_filter_t *gyro, int32_t camera, const bslam_turn_t *turn)
{
    const int32_t nearness = NEARNESS + camera;
    const bslam_real_t span_s = seconds(gyro->time_us - gyro->frame_us[camera]);
    const bslam_real_t speed_mps = gyro->state[SPEED];
    const bslam_real_t parallax =
        turn->parallax_rad_per_m + turn->parallax_sd_rad_per_m * gyro->state[nearness];
    bslam_real_t coefficients[STATES] = {0};
    coefficients[TURNS + camera] = 1;
    coefficients[SPEED] = -span_s * parallax;
    coefficients[nearness] = -span_s * speed_mps * turn->parallax_sd_rad_per_m;
    const bslam_real_t innovation =
        turn->turn_rad - (gyro->state[TURNS + camera] - span_s * speed_mps * parallax);
    const bslam_real_t variance =
        turn->variance_rad2 + square(TURN_SD) + square(TURN_SD_PER_MISMATCH * turn->mismatch);
    bool taken = update(gyro, coefficients, innovation, variance, true);
    if (!taken) {
        gyro->covariance[nearness][nearness] += square(NEAR_SD);
        taken = update(gyro, coefficients, innovation, variance, true);
    }
    if (!taken && gyro->refused >= REFUSED_MAX) {
        gyro->covariance[RATE][RATE] += square(RATE_SD);
        gyro->covariance[TURNS + camera][TURNS + camera] += square(RATE_SD * span_s);
        taken = update(gyro, coefficients, innovation, variance, false);
    }
    gyro->refused = (uint8_t)(taken ? 0 : gyro->refused + 1);
}

bslam_status_t bslam_visual_gyro_take(bslam_visual_gyro_t *instance, int32_t camera, const bslam_turn_t *turn)
{
    bslam_gyro_filter_t *gyro = bslam_gyro_filter(instance);
    if (camera < 0 || camera >= BSLAM_CAMERAS_MAX) {
        return BSLAM_E_RANGE;
    }
    if (!gyro->running || (turn != NULL && gyro->frame_us[camera] == NO_FRAME)) {
        return BSLAM_E_TIME;
    }
    if (turn != NULL) {
        const bool finite = bslam_is_number(turn->turn_rad) && bslam_is_number(turn->variance_rad2) &&
                            bslam_is_number(turn->mismatch) && bslam_is_number(turn->parallax_rad_per_m) &&
                            bslam_is_number(turn->parallax_sd_rad_per_m);
        if (!finite) {
            return BSLAM_E_NOT_FINITE;
        }
        if (!(turn->variance_rad2 > 0)) {
            return BSLAM_E_RANGE;
        }
        take_turn(gyro, camera, turn);
    }
    scale_state(gyro, TURNS + camera, 0, 0);  // counts anew
    gyro->frame_us[camera] = gyro->time_us;
    return BSLAM_OK;
}

bool bslam_visual_gyro_rate(bslam_visual_gyro_t *instance, bslam_real_t *rate_radps, bslam_real_t *sd_radps)
{
    bslam_gyro_filter_t *gyro = bslam_gyro_filter(instance);
    gyro->told = gyro->step_s > 0 && gyro->covariance[RATE][RATE] <= square(TOLD_SD);
    if (gyro->told) {
        const bslam_real_t grown = growth(gyro) > 0 ? GROWTH_FACTOR * growth(gyro) / gyro->step_s : 0;
        *rate_radps = gyro->state[HEADING] / gyro->step_s;
        *sd_radps = bslam_sqrt(grown + square(gyro->least_sd_radps));
    }
    return gyro->told;
}
