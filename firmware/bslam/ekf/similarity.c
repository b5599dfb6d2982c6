// The similarity form: besides turned, the world may be scaled. MATH "The similarity form".
#include <string.h>

#include "bslam/ekf/ekf.h"
#include "bslam/ekf/internal.h"
#include "bslam/model/observation.h"

/// Once nothing waits for the covariance, the columns in which it would are free.
enum { GAUGE = 0, COLUMN = 1, STRETCH = 2, CHANGE = 3 };

/// A distance is not known better than to 1 mm in a metre: keeps weights finite.
static const bslam_real_t LOG_RANGE_VAR_MIN = BSLAM_R(1e-6);

/// What a world that is larger by d ln(scale) adds to each state value.
static void fill_stretch(const bslam_ekf_t *ekf, bslam_real_t *stretch)
{
    memset(stretch, 0, (size_t)BSLAM_SYMMAT_PADDED(ekf->dim) * sizeof *stretch);
    stretch[BSLAM_STATE_X] = ekf->mean[BSLAM_STATE_X];
    stretch[BSLAM_STATE_Y] = ekf->mean[BSLAM_STATE_Y];
    if (ekf->base_dim > POSE_DIM) {
        stretch[BSLAM_STATE_FORWARD] = ekf->mean[BSLAM_STATE_FORWARD];
    }
    for (int b = 0; b < ekf->beacon_count; b++) {
        const bslam_beacon_t *beacon = &ekf->beacons[b];
        const int at = beacon->at;
        if (beacon->kind != BSLAM_BEACON_KNOWN) {
            stretch[at] = ekf->mean[at];
            stretch[at + 1] = ekf->mean[at + 1];
        }
        if (beacon->kind == BSLAM_BEACON_SIZED) {
            stretch[at + 2] = -ekf->mean[at + 2];
        } else if (beacon->kind == BSLAM_BEACON_RAY) {
            stretch[at + 3] = -ekf->mean[at + 3];
        }
    }
}

static bslam_real_t dot(const bslam_real_t *a, const bslam_real_t *b, int n)
{
    bslam_real_t sum = 0;
    for (int i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/// d ln(distance) of a beacon. False: it has none that is positive.
static bool fill_log_range(const bslam_ekf_t *ekf, const bslam_pose_t *mount, const bslam_beacon_t *beacon,
                           bslam_row_t *row)
{
    const bslam_pose_t pose = bslam_ekf_pose(ekf);
    const bslam_real_t *state = &ekf->mean[beacon->at];
    bslam_observation_t seen;
    if (beacon->kind == BSLAM_BEACON_KNOWN) {
        return false;
    }
    if (beacon->kind == BSLAM_BEACON_RAY) {
        if (!(state[3] > 0) || bslam_observe_ray(&pose, mount, state, &seen) != BSLAM_OK) {
            return false;
        }
        seen.stretch_by_beacon[3] -= 1 / state[3];
    } else if (bslam_observe_point(&pose, mount, state[0], state[1], &seen) != BSLAM_OK) {
        return false;
    }
    *row = (bslam_row_t){.at = (uint16_t)beacon->at, .dim = (uint16_t)bslam_beacon_dim(beacon->kind)};
    memcpy(row->base, seen.stretch_by_pose, sizeof seen.stretch_by_pose);
    memcpy(row->other, seen.stretch_by_beacon, sizeof seen.stretch_by_beacon);
    return true;
}

/// The mean of these over all beacons, each counted by how well its distance is known, as a dense row that
/// says 1 of `stretch`. False: no beacon has a distance.
static bool fill_gauge(const bslam_ekf_t *ekf, const bslam_pose_t *mount, const bslam_real_t *stretch,
                       bslam_real_t *gauge)
{
    memset(gauge, 0, (size_t)BSLAM_SYMMAT_PADDED(ekf->dim) * sizeof *gauge);
    bslam_real_t weights = 0;
    for (int b = 0; b < ekf->beacon_count; b++) {
        bslam_row_t row;
        if (!fill_log_range(ekf, mount, &ekf->beacons[b], &row)) {
            continue;
        }
        const bslam_real_t weight = 1 / (bslam_ekf_row_covariance(ekf, &row, &row) + LOG_RANGE_VAR_MIN);
        for (int k = 0; k < POSE_DIM; k++) {
            gauge[k] += weight * row.base[k];
        }
        for (int k = 0; k < row.dim; k++) {
            gauge[row.at + k] += weight * row.other[k];
        }
        weights += weight;
    }
    // A sensor away from the axle does not move when all else is scaled.
    const bslam_real_t norm = dot(gauge, stretch, ekf->dim);
    if (!(norm > weights / 2)) {
        return false;
    }
    for (int i = 0; i < ekf->dim; i++) {
        gauge[i] /= norm;
    }
    return true;
}

bool bslam_ekf_note_scale(bslam_ekf_t *ekf, const bslam_params_t *params)
{
    const bslam_pose_t mount = {params->mount_x_m, params->mount_y_m, params->mount_yaw_rad};
    bslam_ekf_settle(ekf);
    fill_stretch(ekf, ekf->pending[STRETCH]);
    return fill_gauge(ekf, &mount, ekf->pending[STRETCH], ekf->pending[GAUGE]);
}

void bslam_ekf_scale_covariance(bslam_ekf_t *ekf)
{
    bslam_real_t *gauge = ekf->pending[GAUGE];
    bslam_real_t *column = ekf->pending[COLUMN];
    bslam_real_t *change = ekf->pending[CHANGE];
    fill_stretch(ekf, change);
    for (int i = 0; i < ekf->dim; i++) {
        change[i] -= ekf->pending[STRETCH][i];
    }
    bslam_symmat_multiply(ekf->covariance, ekf->dim, gauge, column);
    const bslam_real_t half_variance = dot(column, gauge, ekf->dim) / 2;
    for (int i = 0; i < ekf->dim; i++) {
        column[i] += change[i] * half_variance;
    }
    const bslam_symmat_term_t terms[BSLAM_PENDING_MAX] = {
        {.row_factors = change, .scale = 1, .columns = column},
        {.row_factors = column, .scale = 1, .columns = change},
        {.row_factors = change, .scale = 0, .columns = column},
        {.row_factors = change, .scale = 0, .columns = column},
    };
    bslam_symmat_add_rank4(ekf->covariance, ekf->dim, terms, 2);
}
