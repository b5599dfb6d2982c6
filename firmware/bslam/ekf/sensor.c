#include "bslam/ekf/sensor.h"

#include "base/trig.h"
#include "bslam/model/pose.h"

/// How doubtful each is at first, where sensor_doubt is 1.
static const bslam_real_t FIRST_SD[BSLAM_SENSOR_DIM] = {BSLAM_R(0.07), BSLAM_R(0.07), BSLAM_R(0.035),
                                                        BSLAM_R(0.05)};

void bslam_ekf_begin_sensor(bslam_ekf_t *ekf, const bslam_settings_t *settings)
{
    if (!(settings->sensor_doubt > 0) || settings->filter == BSLAM_FILTER_SMOOTHER) {
        return;
    }
    const int first = ekf->factor.body_count;
    bslam_factor_widen(&ekf->factor, BSLAM_SENSOR_DIM);
    for (int k = 0; k < BSLAM_SENSOR_DIM; k++) {
        // Distances that are too long and a way that is too short look the same: one scale can be a state.
        const bool is_given = k == BSLAM_SENSOR_SCALE && settings->scale_states != 0;
        const bslam_real_t sd = is_given ? 0 : settings->sensor_doubt * FIRST_SD[k];
        ekf->mean[ekf->base_dim + k] = k == BSLAM_SENSOR_SCALE ? 1 : 0;
        ekf->factor.d[first + k] = sd * sd;
    }
    ekf->sensor_dim = BSLAM_SENSOR_DIM;
    ekf->dim += BSLAM_SENSOR_DIM;
}

bslam_pose_t bslam_ekf_mount(const bslam_ekf_t *ekf, const bslam_pose_t *told)
{
    if (ekf->sensor_dim == 0) {
        return *told;
    }
    const bslam_real_t *sensor = &ekf->mean[ekf->base_dim];
    const bslam_pose_t beside = {sensor[BSLAM_SENSOR_X], sensor[BSLAM_SENSOR_Y], sensor[BSLAM_SENSOR_YAW]};
    return bslam_pose_compose(told, &beside);
}

void bslam_ekf_fill_row(const bslam_ekf_t *ekf, const bslam_pose_t *mount, bslam_real_t by_yaw,
                        bslam_real_t by_scale, bslam_row_t *row)
{
    const bslam_real_t yaw_rad = ekf->mean[ekf->base_dim + BSLAM_SENSOR_YAW];
    const bslam_real_t by_x = row->base[0], by_y = row->base[1];
    bslam_real_t cosine, sine;  // of the told mount's direction, which is what it stands beside
    bslam_sin_cos(ekf->mean[BSLAM_STATE_THETA] + mount->theta_rad - yaw_rad, &sine, &cosine);
    row->sensor_at = (uint16_t)ekf->base_dim;
    row->sensor[BSLAM_SENSOR_X] = by_x * cosine + by_y * sine;
    row->sensor[BSLAM_SENSOR_Y] = by_y * cosine - by_x * sine;
    row->sensor[BSLAM_SENSOR_YAW] = by_yaw;
    row->sensor[BSLAM_SENSOR_SCALE] = by_scale;
}
