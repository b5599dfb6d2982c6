// The state as it begins, and what is read of it.
#include "bslam/ekf/ekf.h"
#include "bslam/ekf/ekf_internal.h"
#include "bslam/ekf/sensor.h"
#include "base/scalar.h"

void bslam_ekf_init(bslam_ekf_t *ekf, const bslam_settings_t *settings)
{
    const bool has_speeds = settings->velocity_states != 0,
               has_scales = !has_speeds && settings->scale_states != 0;
    const bslam_real_t forward_sd = has_speeds ? settings->velocity_sd_mps : settings->scale_sd;
    const bslam_real_t turn_sd = has_speeds ? settings->turn_rate_sd_radps : settings->scale_sd;
    *ekf = (bslam_ekf_t){0};
    ekf->dim = ekf->base_dim = has_speeds || has_scales ? 5 : 3;
    bslam_factor_begin(&ekf->factor, ekf->dim == 5 ? 2 : 1, ekf->dim == 5 ? 3 : 2);
    if (ekf->dim == 5) {
        ekf->mean[BSLAM_STATE_FORWARD] = has_scales ? settings->forward_scale : 0;
        ekf->mean[BSLAM_STATE_TURN] = has_scales ? settings->turn_scale : 0;
        ekf->factor.d[bslam_ekf_place(ekf, BSLAM_STATE_FORWARD)] = forward_sd * forward_sd;
        ekf->factor.d[bslam_ekf_place(ekf, BSLAM_STATE_TURN)] = turn_sd * turn_sd;
    }
    bslam_ekf_begin_sensor(ekf, settings);
}

/// A ray's values with an inverse distance that has a point.
static bslam_ray_point_t ray_point(const bslam_ekf_t *ekf, int at)
{
    const bslam_real_t inverse = ekf->mean[at + 3];
    const bslam_real_t ray[BSLAM_RAY_DIM] = {ekf->mean[at], ekf->mean[at + 1], ekf->mean[at + 2],
                                             inverse > BSLAM_FAR_INVERSE_PER_M ? inverse
                                                                               : BSLAM_FAR_INVERSE_PER_M};
    return bslam_ray_to_point(ray);
}

void bslam_ekf_beacon_position(const bslam_ekf_t *ekf, int index, bslam_real_t *x_m, bslam_real_t *y_m)
{
    const bslam_beacon_t *beacon = &ekf->beacons[index];
    if (beacon->kind == BSLAM_BEACON_KNOWN) {
        *x_m = beacon->known_x_m;
        *y_m = beacon->known_y_m;
    } else if (beacon->kind == BSLAM_BEACON_RAY) {
        const bslam_ray_point_t point = ray_point(ekf, beacon->at);
        *x_m = point.x_m;
        *y_m = point.y_m;
    } else {
        *x_m = ekf->mean[beacon->at];
        *y_m = ekf->mean[beacon->at + 1];
    }
}

bslam_sym2_t bslam_ekf_beacon_covariance(const bslam_ekf_t *ekf, int index)
{
    const bslam_beacon_t *beacon = &ekf->beacons[index];
    const int at = beacon->at;
    bslam_sym2_t result = {0, 0, 0};
    if (beacon->kind == BSLAM_BEACON_POINT || beacon->kind == BSLAM_BEACON_SIZED) {
        result.xx = bslam_ekf_covariance(ekf, at, at);
        result.xy = bslam_ekf_covariance(ekf, at + 1, at);
        result.yy = bslam_ekf_covariance(ekf, at + 1, at + 1);
    } else if (beacon->kind == BSLAM_BEACON_RAY) {
        const bslam_ray_point_t point = ray_point(ekf, at);
        for (int i = 0; i < BSLAM_RAY_DIM; i++) {
            for (int j = 0; j < BSLAM_RAY_DIM; j++) {
                const bslam_real_t p = bslam_ekf_covariance(ekf, at + i, at + j);
                result.xx += point.x_by_ray[i] * p * point.x_by_ray[j];
                result.xy += point.x_by_ray[i] * p * point.y_by_ray[j];
                result.yy += point.y_by_ray[i] * p * point.y_by_ray[j];
            }
        }
    }
    return result;
}

bool bslam_ekf_is_sane(const bslam_ekf_t *ekf)
{
    for (int i = 0; i < ekf->dim; i++) {
        if (!bslam_is_number(ekf->mean[i])) {
            return false;
        }
    }
    for (int i = 0; i < bslam_factor_places(&ekf->factor); i++) {
        // Exactly zero is the pose before the first motion, and a ray's anchor taken from it.
        if (!bslam_in_range(ekf->factor.d[i], 0, BSLAM_R(1e30))) {
            return false;
        }
    }
    return true;
}
