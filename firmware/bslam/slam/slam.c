#include "bslam/slam/slam.h"

#include "bslam/math/trig.h"
#include "bslam/model/pose.h"

static const bslam_real_t SECONDS_PER_US = BSLAM_R(1e-6);
static const bslam_real_t RANGE_MIN_M = BSLAM_R(1e-3);
static const bslam_real_t RANGE_MAX_M = BSLAM_R(1e4);
static const bslam_real_t BEARING_SD_MIN_RAD = BSLAM_R(1e-5);
static const bslam_real_t POSITION_SD_MAX_M = BSLAM_R(30.0);
static const bslam_real_t HEADING_SD_MAX_RAD = BSLAM_R(3.2);

bslam_status_t bslam_slam_init(bslam_slam_t *slam, const bslam_params_t *params, int *bad_id)
{
    const bslam_status_t status = bslam_params_check(params, bad_id);
    if (status != BSLAM_OK) {
        return status;
    }
    const bslam_params_t copy = *params;  // params may stand in *slam: starting over
    *slam = (bslam_slam_t){0};
    slam->params = copy;
    slam->bad_sighting = -1;
    bslam_ekf_init(&slam->ekf, &slam->params);
    bslam_odometry_init(&slam->odometry);
    return BSLAM_OK;
}

// ---- odometry and the past --------------------------------------------------------------------------------

static bslam_status_t take_odometry(bslam_slam_t *slam, const bslam_odometry_reading_t *reading)
{
    bslam_odometry_t odometry = slam->odometry;
    bslam_motion_t motion;
    bslam_status_t status = bslam_odometry_read(&odometry, &slam->params, reading, &motion);
    if (status == BSLAM_E_JUMP) {
        slam->odometry = odometry;
    }
    if (status != BSLAM_OK) {
        return status;
    }
    if (motion.dt_s > 0) {
        bslam_motion_t moved;
        status = bslam_ekf_predict(&slam->ekf, &slam->params, &motion, &moved);
        if (status != BSLAM_OK) {
            return status;
        }
        bslam_history_add(&slam->history, reading->time_us, &moved);
    }
    slam->odometry = odometry;
    return BSLAM_OK;
}

bslam_status_t bslam_slam_odometry(bslam_slam_t *slam, const bslam_odometry_reading_t *reading)
{
    const bslam_status_t status = take_odometry(slam, reading);
    if (status == BSLAM_OK) {
        slam->counters.odometry++;
    } else {
        slam->counters.odometry_refused++;
        slam->counters.jumps += status == BSLAM_E_JUMP ? 1u : 0u;
    }
    return status;
}

bslam_status_t bslam_slam_resume_odometry(bslam_slam_t *slam, bslam_real_t position_sd_m,
                                          bslam_real_t heading_sd_rad)
{
    if (!bslam_in_range(position_sd_m, 0, POSITION_SD_MAX_M) ||
        !bslam_in_range(heading_sd_rad, 0, HEADING_SD_MAX_RAD)) {
        return BSLAM_E_RANGE;
    }
    bslam_ekf_resume(&slam->ekf, &slam->params, position_sd_m * position_sd_m,
                     heading_sd_rad * heading_sd_rad);
    bslam_odometry_restart(&slam->odometry);
    bslam_history_clear(&slam->history);
    slam->has_frame = false;
    return BSLAM_OK;
}

/// The robot at time_us as seen from the robot now, where it started while no clock has.
static bslam_status_t relative_pose(const bslam_slam_t *slam, int64_t time_us, bslam_pose_t *relative)
{
    if (!slam->odometry.has_time) {
        *relative = (bslam_pose_t){0, 0, 0};
        return BSLAM_OK;
    }
    return bslam_history_relative_pose(&slam->history, &slam->params, slam->odometry.time_us, time_us,
                                       relative);
}

/// How the sensor of an image of the past depends on v and omega. `relative` is the robot then, seen from the
/// robot now, and `mount` the sensor then.
static bslam_lag_t describe_lag(const bslam_slam_t *slam, int64_t taken_us, const bslam_pose_t *relative,
                                const bslam_pose_t *mount)
{
    bslam_lag_t lag = {{0, 0}, {0, 0, 0}};
    if (slam->params.velocity_states == 0 || !slam->odometry.has_time) {
        return lag;
    }
    // v and omega took the robot from there to here: backwards along the chord, and half of the turn about
    // it.
    const bslam_real_t elapsed_s = (bslam_real_t)(slam->odometry.time_us - taken_us) * SECONDS_PER_US;
    bslam_real_t s;
    bslam_real_t c;
    bslam_sin_cos(relative->theta_rad / 2, &s, &c);
    lag.mount_by_forward[0] = -elapsed_s * c;
    lag.mount_by_forward[1] = -elapsed_s * s;
    lag.mount_by_turn[0] = elapsed_s * (mount->y_m - relative->y_m / 2);
    lag.mount_by_turn[1] = -elapsed_s * (mount->x_m - relative->x_m / 2);
    lag.mount_by_turn[2] = -elapsed_s;
    return lag;
}

// ---- sightings --------------------------------------------------------------------------------------------

/// A standard deviation, or 0 where the detector gives none.
static bool is_noise(bslam_real_t sd, bslam_real_t low, bslam_real_t high)
{
    return sd == 0 || bslam_in_range(sd, low, high);
}

static bslam_status_t check_sighting(const bslam_sighting_t *sighting)
{
    if (!bslam_is_number(sighting->bearing_rad) || !bslam_is_number(sighting->bearing_sd_rad) ||
        (sighting->has_range &&
         (!bslam_is_number(sighting->range_m) || !bslam_is_number(sighting->range_sd_m)))) {
        return BSLAM_E_NOT_FINITE;
    }
    const bool bearing_ok = bslam_in_range(sighting->bearing_rad, -2 * BSLAM_PI, 2 * BSLAM_PI) &&
                            is_noise(sighting->bearing_sd_rad, BEARING_SD_MIN_RAD, BSLAM_PI);
    const bool range_ok =
        !sighting->has_range || (bslam_in_range(sighting->range_m, RANGE_MIN_M, RANGE_MAX_M) &&
                                 is_noise(sighting->range_sd_m, RANGE_MIN_M, RANGE_MAX_M));
    return bearing_ok && range_ok && sighting->label >= BSLAM_LABEL_NONE ? BSLAM_OK : BSLAM_E_RANGE;
}

/// Checks a frame, and says where the sensor was relative to the robot's present pose.
static bslam_status_t check_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                  int count, bslam_pose_t *mount, bslam_lag_t *lag)
{
    slam->bad_sighting = -1;
    if (count < 0 || count > BSLAM_SIGHTINGS_MAX) {
        return BSLAM_E_COUNT;
    }
    if (time_us < 0 || time_us > INT64_MAX / 2 || (slam->has_frame && time_us <= slam->last_frame_us)) {
        return BSLAM_E_TIME;
    }
    for (int i = 0; i < count; i++) {
        const bslam_status_t status = check_sighting(&sightings[i]);
        if (status != BSLAM_OK) {
            slam->bad_sighting = i;
            return status;
        }
    }
    const int64_t taken_us = time_us - slam->params.sighting_delay_us;
    bslam_pose_t relative;
    const bslam_status_t status = relative_pose(slam, taken_us, &relative);
    if (status == BSLAM_OK) {
        const bslam_params_t *p = &slam->params;
        const bslam_pose_t fixed = {p->mount_x_m, p->mount_y_m, p->mount_yaw_rad};
        *mount = bslam_pose_compose(&relative, &fixed);
        *lag = describe_lag(slam, taken_us, &relative, mount);
    }
    return status;
}

static void fill_account(bslam_account_t *account, bslam_outcome_t outcome, bslam_reason_t reason,
                         const bslam_beacon_t *beacon)
{
    account->outcome = outcome;
    account->reason = reason;
    account->has_beacon = beacon != NULL;
    account->beacon_uid = beacon != NULL ? beacon->uid : 0;
    account->test_ratio = -1;
    account->weight = 0;
}

static bslam_real_t test_ratio(const bslam_params_t *params, bslam_real_t distance2)
{
    return params->gate_d2 > 0 && distance2 >= 0 ? distance2 / params->gate_d2 : -1;
}

static void reject(bslam_slam_t *slam, bslam_reason_t reason, const bslam_beacon_t *beacon,
                   bslam_account_t *account)
{
    fill_account(account, BSLAM_OUTCOME_REJECTED, reason, beacon);
    slam->counters.gated += reason == BSLAM_REASON_GATE ? 1u : 0u;
    slam->counters.map_full += reason == BSLAM_REASON_MAP_FULL ? 1u : 0u;
    slam->counters.duplicates += reason == BSLAM_REASON_DUPLICATE ? 1u : 0u;
    slam->counters.unidentified += reason == BSLAM_REASON_NO_IDENTITY ? 1u : 0u;
    slam->counters.unmappable += reason == BSLAM_REASON_CLASS ? 1u : 0u;
}

/// Fuses a sighting with the beacon that association chose.
static void fuse_match(bslam_slam_t *slam, int64_t time_us, bslam_beacon_t *beacon,
                       const bslam_innovation_t *innovation, bslam_account_t *account)
{
    bslam_fusion_t fusion = {.distance2 = -1, .weight = 0};
    const bslam_status_t status = bslam_ekf_fuse(&slam->ekf, &slam->params, innovation, &fusion);
    if (status != BSLAM_OK) {
        reject(slam, status == BSLAM_E_RANGE ? BSLAM_REASON_GATE : BSLAM_REASON_SINGULAR, beacon, account);
        beacon->gated += status == BSLAM_E_RANGE ? 1u : 0u;
        account->test_ratio = test_ratio(&slam->params, fusion.distance2);
        return;
    }
    fill_account(account, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE, beacon);
    account->test_ratio = test_ratio(&slam->params, fusion.distance2);
    account->weight = fusion.weight;
    slam->counters.down_weighted += fusion.weight < 1 ? 1u : 0u;
    beacon->sightings++;
    beacon->last_seen_us = time_us;
    beacon->confirmed = beacon->confirmed || beacon->sightings >= (uint32_t)slam->params.confirm_sightings;
}

static void add_new(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount,
                    const bslam_sighting_t *sighting, bslam_account_t *account)
{
    int index;
    if (bslam_ekf_add(&slam->ekf, &slam->params, mount, sighting, &index) != BSLAM_OK) {
        reject(slam, BSLAM_REASON_MAP_FULL, NULL, account);
        return;
    }
    bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    beacon->label = sighting->label;
    beacon->beacon_class = sighting->beacon_class;
    beacon->first_seen_us = time_us;
    beacon->last_seen_us = time_us;
    beacon->sightings = 1;
    beacon->confirmed = slam->params.confirm_sightings <= 1;
    fill_account(account, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE, beacon);
    account->weight = 1;
}

/// Accounts for every sighting that is not to be fused, and takes the innovations of those that are: all of
/// them before the first is fused, so that the order within a frame does not matter.
static void take_innovations(bslam_slam_t *slam, const bslam_pose_t *mount, const bslam_sighting_t *sightings,
                             int count)
{
    for (int i = 0; i < count; i++) {
        bslam_match_t *match = &slam->matches[i];
        if (match->verdict == BSLAM_VERDICT_REJECT) {
            reject(slam, match->reason, NULL, &slam->accounts[i]);
        } else if (match->verdict == BSLAM_VERDICT_DEFER) {
            fill_account(&slam->accounts[i], BSLAM_OUTCOME_DEFERRED, match->reason, NULL);
        } else if (match->verdict == BSLAM_VERDICT_MATCH &&
                   bslam_ekf_innovation(&slam->ekf, &slam->params, mount, &sightings[i], match->beacon,
                                        &slam->innovations[i]) != BSLAM_OK) {
            reject(slam, BSLAM_REASON_SINGULAR, &slam->ekf.beacons[match->beacon], &slam->accounts[i]);
            match->verdict = BSLAM_VERDICT_REJECT;
        }
    }
}

/// Fuses all matches, then adds what is new.
static void use_matches(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount,
                        const bslam_sighting_t *sightings, int count)
{
    take_innovations(slam, mount, sightings, count);
    for (int i = 0; i < count; i++) {
        if (slam->matches[i].verdict == BSLAM_VERDICT_MATCH) {
            fuse_match(slam, time_us, &slam->ekf.beacons[slam->matches[i].beacon], &slam->innovations[i],
                       &slam->accounts[i]);
        }
    }
    bslam_ekf_correct(&slam->ekf, &slam->params);
    for (int i = 0; i < count; i++) {
        if (slam->matches[i].verdict == BSLAM_VERDICT_NEW) {
            add_new(slam, time_us, mount, &sightings[i], &slam->accounts[i]);
        }
    }
}

/// A provisional beacon leaves when its time is up. Where its identity was told, leaving the view early is no
/// reason against it: it leaves if sightings contradicted it.
static bool is_unconfirmed(const bslam_params_t *params, const bslam_beacon_t *beacon, int64_t time_us)
{
    const int64_t window_us = params->confirm_window_us;
    if (window_us == 0 || beacon->confirmed || time_us - beacon->first_seen_us <= window_us) {
        return false;
    }
    return params->association != 0 || beacon->gated > 0;
}

/// Rays whose distance is known become points; provisional beacons whose time is up leave.
static void tidy_map(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount)
{
    for (int b = slam->ekf.beacon_count - 1; b >= 0; b--) {
        const bslam_beacon_t *beacon = &slam->ekf.beacons[b];
        if (is_unconfirmed(&slam->params, beacon, time_us)) {
            bslam_ekf_remove(&slam->ekf, b);
            slam->counters.removed++;
        } else if (bslam_ekf_settle_ray(&slam->ekf, &slam->params, mount, b)) {
            slam->counters.settled++;
        }
    }
}

static void count_accounts(bslam_slam_t *slam, int count)
{
    bslam_counters_t *counters = &slam->counters;
    counters->frames++;
    counters->sightings += (uint32_t)count;
    for (int i = 0; i < count; i++) {
        switch (slam->accounts[i].outcome) {
        case BSLAM_OUTCOME_MATCHED:
            counters->matched++;
            break;
        case BSLAM_OUTCOME_NEW:
            counters->added++;
            break;
        case BSLAM_OUTCOME_DEFERRED:
            counters->deferred++;
            break;
        case BSLAM_OUTCOME_REJECTED:
        default:
            counters->rejected++;
            break;
        }
    }
    counters->insane += bslam_ekf_is_sane(&slam->ekf) ? 0u : 1u;
}

bslam_status_t bslam_slam_sightings(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                    int count)
{
    bslam_pose_t mount;
    bslam_lag_t lag;
    const bslam_status_t status = check_frame(slam, time_us, sightings, count, &mount, &lag);
    if (status != BSLAM_OK) {
        slam->counters.frames_refused++;
        return status;
    }
    const bslam_sighting_frame_t frame = {
        .ekf = &slam->ekf, .params = &slam->params, .mount = &mount, .sightings = sightings, .count = count};
    const bslam_associate_fn associate = bslam_associate_method(&slam->params);
    slam->ekf.lag = lag;
    associate(&frame, slam->matches);
    use_matches(slam, time_us, &mount, sightings, count);
    slam->ekf.lag = (bslam_lag_t){{0, 0}, {0, 0, 0}};
    tidy_map(slam, time_us, &mount);
    slam->last_frame_us = time_us;
    slam->has_frame = true;
    bslam_odometry_start(&slam->odometry, time_us);
    slam->account_count = count;
    count_accounts(slam, count);
    return BSLAM_OK;
}

// ---- the map ----------------------------------------------------------------------------------------------

bslam_status_t bslam_slam_add_known_beacon(bslam_slam_t *slam, int32_t label, bslam_real_t x_m,
                                           bslam_real_t y_m)
{
    if (!bslam_is_number(x_m) || !bslam_is_number(y_m)) {
        return BSLAM_E_NOT_FINITE;
    }
    if (label < 0) {
        return BSLAM_E_RANGE;
    }
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        if (slam->ekf.beacons[b].label == label) {
            return BSLAM_E_DUPLICATE;
        }
    }
    int index;
    const bslam_status_t status = bslam_ekf_add_known(&slam->ekf, x_m, y_m, &index);
    if (status == BSLAM_OK) {
        slam->ekf.beacons[index].label = label;
    }
    return status;
}

bslam_status_t bslam_slam_remove_beacon(bslam_slam_t *slam, uint32_t uid)
{
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        if (slam->ekf.beacons[b].uid == uid) {
            bslam_ekf_remove(&slam->ekf, b);
            return BSLAM_OK;
        }
    }
    return BSLAM_E_NO_BEACON;
}

// ---- results ----------------------------------------------------------------------------------------------

bslam_pose_t bslam_slam_pose(const bslam_slam_t *slam)
{
    return bslam_ekf_pose(&slam->ekf);
}

bslam_status_t bslam_slam_pose_at(const bslam_slam_t *slam, int64_t time_us, bslam_pose_t *pose)
{
    if (time_us < 0 || time_us > INT64_MAX / 2) {
        return BSLAM_E_TIME;
    }
    bslam_pose_t relative;
    const bslam_status_t status = relative_pose(slam, time_us, &relative);
    if (status == BSLAM_OK) {
        const bslam_pose_t now = bslam_ekf_pose(&slam->ekf);
        *pose = bslam_pose_compose(&now, &relative);
    }
    return status;
}

void bslam_slam_pose_covariance(const bslam_slam_t *slam, bslam_real_t lower[6])
{
    int k = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            lower[k] = bslam_symmat_get(slam->ekf.covariance, i, j);
            k++;
        }
    }
}

const bslam_account_t *bslam_slam_accounts(const bslam_slam_t *slam, int *count)
{
    *count = slam->account_count;
    return slam->accounts;
}

int bslam_slam_bad_sighting(const bslam_slam_t *slam)
{
    return slam->bad_sighting;
}

const bslam_counters_t *bslam_slam_counters(const bslam_slam_t *slam)
{
    return &slam->counters;
}

int bslam_slam_beacon_count(const bslam_slam_t *slam)
{
    return slam->ekf.beacon_count;
}

bslam_status_t bslam_slam_beacon(const bslam_slam_t *slam, int index, bslam_beacon_view_t *view)
{
    if (index < 0 || index >= slam->ekf.beacon_count) {
        return BSLAM_E_NO_BEACON;
    }
    const bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    view->uid = beacon->uid;
    view->label = beacon->label;
    view->kind = beacon->kind;
    view->confirmed = beacon->confirmed;
    view->beacon_class = beacon->beacon_class;
    view->sightings = beacon->sightings;
    bslam_ekf_beacon_position(&slam->ekf, index, &view->x_m, &view->y_m);
    view->covariance_m2 = bslam_ekf_beacon_covariance(&slam->ekf, index);
    view->range_m = bslam_sqrt(view->x_m * view->x_m + view->y_m * view->y_m);
    view->phi_rad = bslam_atan2(view->y_m, view->x_m);
    return BSLAM_OK;
}
