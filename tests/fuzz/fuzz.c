// What must hold of a pipeline, and one that has a map.
#include "fuzz.h"

#include <string.h>

#include "base/scalar.h"
#include "base/trig.h"
#include "bslam/store/map.h"

#include "definite.h"
#include "map_memory.h"

enum { BLOB_MAX = 1 << 18 };

/// What double leaves of an eigenvalue that is 0; and what float does, where values are taken out, of a
/// variance.
static const double EIGENVALUE_ROUNDING = 1e-9, VARIANCE_ROUNDING = 1e-4;

static void require_finite(const bslam_ekf_t *ekf)
{
    for (int i = 0; i < ekf->dim; i++) {
        fuzz_require(isfinite((double)ekf->mean[i]));
        for (int j = 0; j <= i; j++) {
            fuzz_require(isfinite((double)bslam_ekf_covariance(ekf, i, j)));
        }
    }
    const double theta_rad = (double)ekf->mean[BSLAM_STATE_THETA];
    fuzz_require(theta_rad >= -(double)BSLAM_PI && theta_rad <= (double)BSLAM_PI);
}

/// D is not negative, and L the triangle that it should be: then their product is a covariance.
static void require_factor(const bslam_factor_t *factor)
{
    const int places = bslam_factor_places(factor), tail_at = bslam_factor_tail_at(factor);
    for (int i = 0; i < places; i++) {
        const bool is_value = i < factor->body_count || (i >= tail_at && i < tail_at + factor->tail_count);
        const bslam_real_t *row =
            (i < tail_at ? factor->body + bslam_factor_block_at(i / 4 * 4) : factor->tail) + i % 4;
        fuzz_require(factor->d[i] >= 0 && isfinite((double)factor->d[i]) && (is_value || factor->d[i] == 0));
        for (int j = is_value ? i : 0; j < i / 4 * 4 + 4; j++) {
            fuzz_require(row[4 * j] == (j == i && is_value ? 1 : 0));
        }
    }
}

static void require_counts(const bslam_ekf_t *ekf)
{
    bool is_taken[BSLAM_STATE_MAX] = {false};
    int32_t dim = bslam_ekf_map_at(ekf);
    int32_t rays = 0;
    fuzz_require(ekf->beacon_count >= 0 && ekf->beacon_count <= BSLAM_BEACONS_MAX);
    for (int b = 0; b < ekf->beacon_count; b++) {
        const bslam_beacon_t *beacon = &ekf->beacons[b];
        fuzz_require(beacon->uid < ekf->next_uid && (b == 0 || beacon->uid > ekf->beacons[b - 1].uid));
        for (int at = beacon->at; at < beacon->at + bslam_beacon_dim(beacon->kind); at++) {
            fuzz_require(at >= bslam_ekf_map_at(ekf) && at < ekf->dim && !is_taken[at]);
            is_taken[at] = true;
            dim++;
        }
        rays += beacon->kind == BSLAM_BEACON_RAY ? 1 : 0;
    }
    fuzz_require(dim == ekf->dim && dim <= BSLAM_STATE_MAX);
    fuzz_require(rays == ekf->ray_count && rays <= BSLAM_RAYS_MAX);
}

void fuzz_require_sound(const bslam_slam_t *slam)
{
    require_counts(&slam->ekf);
    require_finite(&slam->ekf);
    require_factor(&slam->ekf.factor);
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

// ---- keeping ----------------------------------------------------------------------------------------------

/// Larger than a map may have: as an element of L or D, or as a variance.
static bool has_large_number(const bslam_ekf_t *ekf)
{
    const bslam_factor_t *factor = &ekf->factor;
    double largest = 0;
    for (int i = 0; i < factor->body_count; i++) {
        largest = fmax(largest, (double)bslam_factor_get(factor, i, i));
        for (int j = 0; j < i; j++) {
            largest = fmax(largest, fabs((double)bslam_factor_row(factor, i)[4 * j]));
        }
    }
    return largest > 0.999e12;
}

/// The map's bytes; 0 of them where a number is too large to be kept.
static uint32_t save(const bslam_slam_t *slam, uint8_t bytes[BLOB_MAX])
{
    map_memory_t memory = {bytes, BLOB_MAX, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    bslam_map_fault_t fault;
    const bslam_status_t status = bslam_map_write(slam, &sink, &fault);
    fuzz_require(status == BSLAM_OK || has_large_number(&slam->ekf));
    return status == BSLAM_OK ? memory.count : 0;
}

static void load(bslam_slam_t *slam, const uint8_t *bytes, uint32_t size)
{
    const bslam_map_source_t source = map_from_memory(bytes, size);
    bslam_map_fault_t fault;
    fuzz_require(bslam_map_check(&source) == BSLAM_MAP_FINE);
    fuzz_require(bslam_map_load(slam, &source, BSLAM_MAP_LIVING, &fault) == BSLAM_OK);
}

/// Of each beacon that both have, what is known of its values.
static void require_same_beacons(const bslam_ekf_t *a, const bslam_ekf_t *b)
{
    for (int i = 0, k = 0; k < b->beacon_count; k++) {
        while (a->beacons[i].uid != b->beacons[k].uid) {
            i++;
        }
        for (int v = 0; v < bslam_beacon_dim(b->beacons[k].kind); v++) {
            const int of_a = a->beacons[i].at + v, of_b = b->beacons[k].at + v;
            const double was = definite_covariance(a, of_a, of_a), is = definite_covariance(b, of_b, of_b);
            fuzz_require((float)a->mean[of_a] == (float)b->mean[of_b]);
            fuzz_require(fabs(is - was) <= VARIANCE_ROUNDING * was + 1e-30);
        }
    }
}

bool fuzz_require_kept(const bslam_slam_t *slam)
{
    static bslam_slam_t other;
    static uint8_t bytes[BLOB_MAX], again[BLOB_MAX];
    fuzz_require(definite_least_eigenvalue(&slam->ekf.factor) >= -EIGENVALUE_ROUNDING);
    memcpy(&other, slam, sizeof other);
    other.appearance = NULL;
    other.smoother = NULL;
    const uint32_t size = save(&other, bytes);
    if (size == 0) {
        return false;
    }
    load(&other, bytes, size);
    require_same_beacons(&slam->ekf, &other.ekf);
    const uint32_t left = save(&other, bytes);  // what its values hung on is gone now
    if (left > 0) {
        load(&other, bytes, left);
        fuzz_require(save(&other, again) == left && memcmp(bytes, again, left) == 0);
    }
    return left > 0;
}

// ---- a map ------------------------------------------------------------------------------------------------

void fuzz_make_map(bslam_slam_t *slam, bslam_appearance_t *appearance)
{
    bslam_settings_t settings;
    int bad_id;
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    settings.association = BSLAM_ASSOCIATION_SVM;
    settings.left_speed_sd_mps = BSLAM_R(1e-3);
    settings.right_speed_sd_mps = BSLAM_R(1e-3);
    fuzz_require(bslam_slam_init(slam, &settings, &bad_id) == BSLAM_OK);
    if (appearance != NULL) {
        fuzz_require(bslam_appearance_init(appearance, NULL, 0) == BSLAM_OK);
        bslam_slam_attach_appearance(slam, appearance);
    }
    for (int view = 1; view <= 8; view++) {
        // To and fro, so far that each view is learned, and for so long that beacons are confirmed.
        const int64_t now_us = view * INT64_C(50000);
        const bslam_real_t way_m = view % 2 == 0 ? BSLAM_R(-0.11) : BSLAM_R(0.11);
        const bslam_real_t at_m = view % 2 == 0 ? 0 : BSLAM_R(0.11);
        const bslam_odometry_reading_t reading = {.time_us = now_us, .left_m = way_m, .right_m = way_m};
        float signatures[2][BSLAM_SAMPLE_FEATURES] = {{0}};
        bslam_sighting_t seen[3] = {
            {.bearing_rad = bslam_atan2(-2, 1 - at_m), .has_range = true, .label = -1},
            {.bearing_rad = bslam_atan2(1, 3 - at_m), .has_range = true, .label = -1},
            {.bearing_rad = BSLAM_R(2.5), .label = -1}};
        seen[0].range_m = bslam_sqrt((1 - at_m) * (1 - at_m) + 4);
        seen[1].range_m = bslam_sqrt((3 - at_m) * (3 - at_m) + 1);
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
