// What must hold of a pipeline, and one that has a map.
#include "fuzz.h"

#include <string.h>

#include "base/trig.h"
#include "base/scalar.h"

/// The covariance is rounded: a number of it may be wrong by so much of the largest variance that the input
/// has made so far, from which it came down. Below the other its square is 0 in float.
static const double ROUNDING = 1e-6;
static const double COVARIANCE_MIN = 1e-19;
static double largest_variance;
/// Where the filter stood when it was last looked at.
static int64_t filter_us;

void fuzz_begin(void)
{
    largest_variance = 0;
    filter_us = 0;
}

/// The variance of the speeds that the last call's prediction made, which a sighting of the same call may
/// have taken away again: no look between calls has seen it.
static void count_walk(const bslam_slam_t *slam)
{
    const int64_t now_us = slam->odometry.time_us - slam->history.filter.behind_us;
    const double gone_s = 1e-6 * (double)(now_us - filter_us);
    const double walk = fmax((double)slam->settings.velocity_walk_mps_sqrt_s,
                             (double)slam->settings.turn_rate_walk_radps_sqrt_s);
    if (slam->ekf.base_dim > BSLAM_STATE_FORWARD && gone_s > 0) {
        largest_variance = fmax(largest_variance, walk * walk * gone_s);
    }
    filter_us = now_us;
}

static void require_finite(const bslam_ekf_t *ekf)
{
    for (int i = 0; i < ekf->dim; i++) {
        fuzz_require(isfinite((double)ekf->mean[i]));
        for (int j = 0; j <= i; j++) {
            fuzz_require(isfinite((double)bslam_symmat_get(ekf->covariance, i, j)));
        }
    }
    const double theta_rad = (double)ekf->mean[BSLAM_STATE_THETA];
    fuzz_require(theta_rad >= -(double)BSLAM_PI && theta_rad <= (double)BSLAM_PI);
}

static bool is_positive(const bslam_ekf_t *ekf)
{
    const double slack = COVARIANCE_MIN + ROUNDING * largest_variance;
    for (int i = 0; i < ekf->dim; i++) {
        const double own = (double)bslam_symmat_get(ekf->covariance, i, i);
        for (int j = 0; j < i; j++) {
            const double other = (double)bslam_symmat_get(ekf->covariance, j, j);
            const double both = fabs((double)bslam_symmat_get(ekf->covariance, i, j)) - slack;
            if (both > 0 && both * both > 1.01 * (own + slack) * (other + slack)) {
                return false;
            }
        }
        if (own < 0) {
            return false;
        }
        largest_variance = fmax(largest_variance, own);
    }
    return true;
}

static void require_counts(const bslam_ekf_t *ekf)
{
    int32_t dim = ekf->base_dim;
    int32_t rays = 0;
    fuzz_require(ekf->beacon_count >= 0 && ekf->beacon_count <= BSLAM_BEACONS_MAX);
    for (int b = 0; b < ekf->beacon_count; b++) {
        const bslam_beacon_t *beacon = &ekf->beacons[b];
        fuzz_require(beacon->kind == BSLAM_BEACON_KNOWN || beacon->at == dim);
        fuzz_require(beacon->uid < ekf->next_uid && (b == 0 || beacon->uid > ekf->beacons[b - 1].uid));
        dim += bslam_beacon_dim(beacon->kind);
        rays += beacon->kind == BSLAM_BEACON_RAY ? 1 : 0;
    }
    fuzz_require(dim == ekf->dim && dim <= BSLAM_STATE_MAX);
    fuzz_require(rays == ekf->ray_count && rays <= BSLAM_RAYS_MAX);
}

void fuzz_require_sound(const bslam_slam_t *slam)
{
    require_counts(&slam->ekf);
    require_finite(&slam->ekf);
    count_walk(slam);
    fuzz_require(is_positive(&slam->ekf) || slam->counters.insane > 0);
    const bslam_pose_t pose = bslam_slam_pose(slam);
    fuzz_require(isfinite((double)pose.x_m) && isfinite((double)pose.y_m) &&
                 isfinite((double)pose.theta_rad));
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        bslam_beacon_view_t view;
        fuzz_require(bslam_slam_beacon(slam, b, &view) == BSLAM_OK);
        fuzz_require(isfinite((double)view.x_m) && isfinite((double)view.y_m));
        fuzz_require(isfinite((double)view.covariance_m2.xx) && isfinite((double)view.covariance_m2.yy));
    }
    const bslam_slam_counters_t *counters = &slam->counters;
    fuzz_require(counters->matched + counters->added + counters->rejected + counters->deferred ==
                 counters->sightings);
}

void fuzz_clear_unused(bslam_slam_t *slam)
{
    bslam_real_t *m = slam->ekf.covariance;
    const size_t used = bslam_symmat_row(slam->ekf.dim);
    memset(m + used, 0, (BSLAM_SYMMAT_LENGTH(BSLAM_STATE_MAX) - used) * sizeof *m);
}

// ---- a map ------------------------------------------------------------------------------------------------

void fuzz_make_map(bslam_slam_t *slam, bslam_appearance_t *appearance)
{
    bslam_settings_t settings;
    int bad_id;
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    settings.association = BSLAM_ASSOCIATION_SVM;
    settings.learn_travel_m = 0;
    settings.left_speed_sd_mps = BSLAM_R(1e-3);
    settings.right_speed_sd_mps = BSLAM_R(1e-3);
    fuzz_require(bslam_slam_init(slam, &settings, &bad_id) == BSLAM_OK);
    if (appearance != NULL) {
        fuzz_require(bslam_appearance_init(appearance, NULL, 0) == BSLAM_OK);
        bslam_slam_attach_appearance(slam, appearance);
    }
    for (int view = 1; view <= 8; view++) {
        const int64_t now_us = view * INT64_C(40000);
        const bslam_odometry_reading_t reading = {
            .time_us = now_us, .left_m = BSLAM_R(1e-4), .right_m = BSLAM_R(1e-4)};
        float signatures[2][BSLAM_SAMPLE_FEATURES] = {{0}};
        bslam_sighting_t seen[3] = {
            {.bearing_rad = BSLAM_R(-1.0), .range_m = 2, .has_range = true, .label = -1},
            {.bearing_rad = BSLAM_R(0.5), .range_m = 3, .has_range = true, .label = -1},
            {.bearing_rad = BSLAM_R(2.5), .label = -1}};
        for (int i = 0; i < 2; i++) {
            signatures[i][9 * i] = 0.7f;
            signatures[i][9 * i + view % 3 + 1] = 0.4f;
            seen[i].signature = signatures[i];
        }
        fuzz_require(bslam_slam_odometry(slam, &reading) == BSLAM_OK);
        fuzz_require(bslam_slam_sightings(slam, now_us, seen, 3) == BSLAM_OK);
    }
    fuzz_require(slam->ekf.beacon_count == 3);
}
