#include "bslam/ekf/sensor.h"

#include "base/trig.h"
#include "bslam/model/pose.h"

/// How doubtful each is at first, where sensor_doubt is 1.
static const bslam_real_t FIRST_SD[BSLAM_SENSOR_DIM] = {BSLAM_R(0.07), BSLAM_R(0.07), BSLAM_R(0.035),
                                                        BSLAM_R(0.05), BSLAM_R(0.1)};
/// Over so long the speed is a mean: one reading's noise would count as speed.
static const bslam_real_t SPEED_MEAN_S = BSLAM_R(0.3);

void bslam_ekf_begin_sensor(bslam_ekf_t *ekf, const bslam_settings_t *settings)
{
    if (!(settings->sensor_doubt > 0) || settings->filter == BSLAM_FILTER_SMOOTHER) {
        return;
    }
    const int first = ekf->factor.body_count;
    bslam_factor_widen(&ekf->factor, BSLAM_SENSOR_DIM);
    for (int k = 0; k < BSLAM_SENSOR_DIM; k++) {
        const bslam_real_t sd = settings->sensor_doubt * FIRST_SD[k];
        ekf->mean[ekf->base_dim + k] = k == BSLAM_SENSOR_SCALE ? 1 : 0;
        ekf->factor.d[first + k] = sd * sd;
    }
    ekf->sensor_dim = BSLAM_SENSOR_DIM;
    ekf->dim += BSLAM_SENSOR_DIM;
}

void bslam_ekf_note_speed(bslam_ekf_t *ekf, const bslam_motion_t *moved)
{
    const bslam_real_t share = 1 / (SPEED_MEAN_S + moved->dt_s);
    ekf->speed_mps += share * (moved->forward_m - moved->dt_s * ekf->speed_mps);
    ekf->turn_radps += share * (moved->turn_rad - moved->dt_s * ekf->turn_radps);
}

bslam_pose_t bslam_ekf_mount(const bslam_ekf_t *ekf, const bslam_pose_t *told)
{
    if (ekf->sensor_dim == 0) {
        return *told;
    }
    const bslam_real_t *sensor = &ekf->mean[ekf->base_dim];
    const bslam_real_t delay_s = sensor[BSLAM_SENSOR_DELAY];
    const bslam_pose_t back = {-delay_s * ekf->speed_mps, 0, -delay_s * ekf->turn_radps};
    const bslam_pose_t beside = {sensor[BSLAM_SENSOR_X], sensor[BSLAM_SENSOR_Y], sensor[BSLAM_SENSOR_YAW]};
    const bslam_pose_t then = bslam_pose_compose(&back, told);
    return bslam_pose_compose(&then, &beside);
}

void bslam_ekf_fill_sensor(const bslam_ekf_t *ekf, const bslam_pose_t *mount, bslam_real_t by_yaw,
                           bslam_real_t by_scale, bslam_row_t *row)
{
    row->sensor_dim = (uint16_t)ekf->sensor_dim;
    row->sensor_at = (uint16_t)ekf->base_dim;
    if (ekf->sensor_dim == 0) {
        return;
    }
    const bslam_real_t theta_rad = ekf->mean[BSLAM_STATE_THETA];
    const bslam_real_t by_x = row->base[0], by_y = row->base[1];
    bslam_real_t cos_robot, sin_robot, cos_sensor, sin_sensor;
    bslam_sin_cos(theta_rad, &sin_robot, &cos_robot);
    bslam_sin_cos(theta_rad + mount->theta_rad, &sin_sensor, &cos_sensor);
    row->sensor[BSLAM_SENSOR_X] = by_x * cos_sensor + by_y * sin_sensor;
    row->sensor[BSLAM_SENSOR_Y] = by_y * cos_sensor - by_x * sin_sensor;
    row->sensor[BSLAM_SENSOR_YAW] = by_yaw;
    row->sensor[BSLAM_SENSOR_SCALE] = by_scale;
    row->sensor[BSLAM_SENSOR_DELAY] =
        -ekf->speed_mps * (by_x * cos_robot + by_y * sin_robot) - ekf->turn_radps * row->base[2];
}
