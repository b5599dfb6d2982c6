/// What stands in a bslam_visual_gyro_t (vision.h). MATH-CAMERA "Visual gyro". Internal.
#ifndef BSLAM_VISION_BUILT_IN_GYRO_VISUAL_GYRO_H
#define BSLAM_VISION_BUILT_IN_GYRO_VISUAL_GYRO_H

#include "vision/vision.h"

/// State values: turn rate, speed, heading, and two for each camera.
#define BSLAM_VISUAL_GYRO_STATES (3 + 2 * BSLAM_CAMERAS_MAX)

typedef struct bslam_gyro_filter {
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
} bslam_gyro_filter_t;

static inline bslam_gyro_filter_t *bslam_gyro_filter(bslam_visual_gyro_t *gyro)
{
    void *memory = gyro;
    return memory;
}

#endif
