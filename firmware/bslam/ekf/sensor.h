/// What the sensor is told wrong, as state values: its place and yaw, the scale of its distances.
/// MATH "Sensor states". The setting sensor_doubt switches them on; a smoother has none.
#ifndef BSLAM_EKF_SENSOR_H
#define BSLAM_EKF_SENSOR_H

#include "bslam/ekf/ekf.h"

/// Puts them into a state that has no beacons yet.
void bslam_ekf_begin_sensor(bslam_ekf_t *ekf, const bslam_settings_t *settings);

/// The mount as the state has it: the sensor beside where it is told to be.
bslam_pose_t bslam_ekf_mount(const bslam_ekf_t *ekf, const bslam_pose_t *told);

/// All distances are too long by this factor.
static inline bslam_real_t bslam_ekf_range_scale(const bslam_ekf_t *ekf)
{
    return ekf->sensor_dim > 0 ? ekf->mean[ekf->base_dim + BSLAM_SENSOR_SCALE] : 1;
}

/// bslam_ekf_fill_sensor where there are such values.
void bslam_ekf_fill_row(const bslam_ekf_t *ekf, const bslam_pose_t *mount, bslam_real_t by_yaw,
                        bslam_real_t by_scale, bslam_row_t *row);

/// Completes a row that has its part by the robot's pose, for a sensor at this mount. by_yaw, by_scale: what
/// it has of these.
static inline void bslam_ekf_fill_sensor(const bslam_ekf_t *ekf, const bslam_pose_t *mount,
                                         bslam_real_t by_yaw, bslam_real_t by_scale, bslam_row_t *row)
{
    row->sensor_dim = (uint16_t)ekf->sensor_dim;
    if (ekf->sensor_dim > 0) {
        bslam_ekf_fill_row(ekf, mount, by_yaw, by_scale, row);
    }
}

#endif
