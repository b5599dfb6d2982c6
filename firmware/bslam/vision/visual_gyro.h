/// A gyroscope made of images: turns between frames of one camera each, which may overlap in time, become
/// the robot's turn rate from each step to the next. MATH-CAMERA "Visual gyro".
///
///     bslam_visual_gyro_init(&gyro, BSLAM_VISUAL_GYRO_SD_RADPS)
///     bslam_visual_gyro_advance(&gyro, time_us, speed_mps, speed_sd_mps)    at each reading of the wheels,
///     bslam_visual_gyro_take(&gyro, camera, turn)                           then for each frame of that
///     time, reading.has_gyro = bslam_visual_gyro_rate(&gyro, &reading.gyro_radps, &reading.gyro_sd_radps)
///
/// A small Kalman filter of its own, so that a frame's turn, which spans several steps, need not wait in the
/// map's filter: turn rate, speed, the turn since each camera's frame before, how much nearer than the
/// floor line said is what each camera sees, and by how much the heading has turned from what was told.
#ifndef BSLAM_VISION_VISUAL_GYRO_H
#define BSLAM_VISION_VISUAL_GYRO_H

#include "bslam/vision/turn.h"

/// What the rate of a step errs by at least. Errors of some steps follow each other; this is what their sum
/// over seconds asks for.
#define BSLAM_VISUAL_GYRO_SD_RADPS 0.04f
/// The same through a lens of 180 degrees: its columns are coarse, and what is beside the robot moves most.
#define BSLAM_VISUAL_GYRO_WIDE_SD_RADPS 1.0f

/// State values: turn rate, speed, heading, and two for each camera.
#define BSLAM_VISUAL_GYRO_STATES (3 + 2 * BSLAM_CAMERAS_MAX)

typedef struct bslam_visual_gyro {
    int64_t time_us;                      ///< of the last advance
    int64_t frame_us[BSLAM_CAMERAS_MAX];  ///< of each camera's last frame
    bslam_real_t step_s;                  ///< between the last two advances; 0: there was one at most
    bslam_real_t least_sd_radps;          ///< of a rate
    bslam_real_t growth_rad2ps;           ///< by which the heading's variance grew of late
    bool running;                         ///< there was an advance
    bool told;                            ///< bslam_visual_gyro_rate said a rate of the last step
    uint8_t refused;                      ///< turns in a row that contradicted the rate
    bslam_real_t state[BSLAM_VISUAL_GYRO_STATES];
    bslam_real_t covariance[BSLAM_VISUAL_GYRO_STATES][BSLAM_VISUAL_GYRO_STATES];
} bslam_visual_gyro_t;

/// Nothing known yet. least_sd_radps: what a rate errs by where all goes well, above 0.
void bslam_visual_gyro_init(bslam_visual_gyro_t *gyro, bslam_real_t least_sd_radps);

/// Goes on to a time. speed_mps: forward, mean since the time before, by the wheels, and its noise; it only
/// corrects for how driving by moves things in the image. The first call starts the clock.
/// BSLAM_E_TIME: the time does not advance, or by more than 4 s (after which bslam_visual_gyro_init starts
/// anew). BSLAM_E_NOT_FINITE: the speed. BSLAM_E_RANGE: a noise outside 1e-4 to 100 m/s. On any of these
/// nothing changes.
BSLAM_MUST_CHECK bslam_status_t bslam_visual_gyro_advance(bslam_visual_gyro_t *gyro, int64_t time_us,
                                                          bslam_real_t speed_mps, bslam_real_t speed_sd_mps);

/// A frame of a camera, taken at the time of the last advance, and the turn that bslam_turns_see found; null
/// if it found none. BSLAM_E_RANGE: another camera than 0 to BSLAM_CAMERAS_MAX - 1, a variance not above 0;
/// BSLAM_E_NOT_FINITE; BSLAM_E_TIME: before the first advance, or a turn without a frame before. On any of
/// these nothing changes.
BSLAM_MUST_CHECK bslam_status_t bslam_visual_gyro_take(bslam_visual_gyro_t *gyro, int32_t camera,
                                                       const bslam_turn_t *turn);

/// The turn rate of the last step, positive to the left, and its noise. The rate brings the heading to where
/// it is thought to be, with what steps before were told wrongly, so that the sum over steps is right; the
/// noise is what the heading's variance grew by of late. False, both unchanged, where too little was seen to
/// know the rate to about 0.4 rad/s. It may be asked after each frame of a step; the last answer counts as
/// told.
bool bslam_visual_gyro_rate(bslam_visual_gyro_t *gyro, bslam_real_t *rate_radps, bslam_real_t *sd_radps);

#endif
