/// How fast the robot turns, by its own cameras, for a robot without a gyro (vision/vision.h): a
/// reading of the encoders waits until the picture of its moment has been looked at, and goes on with what it
/// tells.
#ifndef ROBOT_GYRO_WAIT_H
#define ROBOT_GYRO_WAIT_H

#include "bslam/bslam.h"
#include "robot/camera_input.h"

#if ROBOT_VISION && BSLAM_VISION_TURNS

/// All members are this module's own.
typedef struct gyro_wait {
    bslam_visual_gyro_t gyro;
    bool is_running;  ///< there was a reading before
    bool is_waiting;
    bslam_odometry_reading_t reading;  ///< the last one, which waits if is_waiting
} gyro_wait_t;

/// For these cameras. No reading waits.
void gyro_wait_start(gyro_wait_t *wait, camera_input_t *input);

/// A reading of the encoders begins to wait. False, and it does not: it came too long after the one before,
/// or the wheels jumped.
bool gyro_wait_begin(gyro_wait_t *wait, camera_input_t *input, const bslam_settings_t *settings,
                     const bslam_odometry_reading_t *reading);

/// The front end has finished a camera's picture of that moment. If a reading of the same moment waits, it
/// has a gyro's rate and its noise from now on, where the picture tells.
void gyro_wait_see(gyro_wait_t *wait, camera_input_t *input, int camera, int64_t time_us);

/// The reading that waits, which waits no longer. False: none does.
bool gyro_wait_end(gyro_wait_t *wait, bslam_odometry_reading_t *reading);

#endif
#endif
