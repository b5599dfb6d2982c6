/// How fast the robot turns, by its own cameras, for a robot without a gyro (vision/gyro/visual_gyro.h): a
/// reading of the encoders waits until the picture of its moment has been looked at, and goes on with what it
/// tells.
#ifndef ROBOT_GYRO_WAIT_H
#define ROBOT_GYRO_WAIT_H

#include "bslam/bslam.h"
#include "robot/camera_input.h"
#include "vision/gyro/visual_gyro.h"

/// 1: an application that is built with ROBOT_VISION does this. Some 4 KB of RAM with one camera, and 4
/// instructions a pixel.
#ifndef ROBOT_VISUAL_GYRO
#define ROBOT_VISUAL_GYRO 0
#endif

#if ROBOT_VISUAL_GYRO

/// All members are this module's own.
typedef struct gyro_wait {
    bslam_turns_t turns;
    bslam_visual_gyro_t gyro;
    bool is_waiting;
    bslam_odometry_reading_t reading;  ///< the last one, which waits if is_waiting
} gyro_wait_t;

/// For the cameras of a front end. No reading waits.
void gyro_wait_start(gyro_wait_t *wait, const bslam_vision_t *vision);

/// A reading of the encoders begins to wait. False, and it does not: it came too long after the one before,
/// or the wheels jumped.
bool gyro_wait_begin(gyro_wait_t *wait, const bslam_vision_t *vision, const bslam_settings_t *settings,
                     const bslam_odometry_reading_t *reading);

/// The front end has finished a camera's picture of that moment. If a reading of the same moment waits, it
/// has a gyro's rate and its noise from now on, where the picture tells.
void gyro_wait_see(gyro_wait_t *wait, const bslam_vision_t *vision, int camera, int64_t time_us);

/// The reading that waits, which waits no longer. False: none does.
bool gyro_wait_end(gyro_wait_t *wait, bslam_odometry_reading_t *reading);

#endif
#endif
