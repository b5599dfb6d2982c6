#include "bslam/slam/slam.h"

#include <string.h>

#include "bslam/association/doubles.h"
#include "bslam/math/trig.h"
#include "bslam/model/noise.h"
#include "bslam/model/pose.h"
#include "bslam/slam/internal.h"

static const bslam_real_t RANGE_MIN_M = BSLAM_R(1e-3);
static const bslam_real_t RANGE_MAX_M = BSLAM_R(1e4);
static const bslam_real_t WAY_MAX_M = BSLAM_R(1000.0);
static const bslam_real_t MICROMETRES_PER_M = BSLAM_R(1e6);
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

void bslam_slam_restart_smoother(bslam_slam_t *slam)
{
    if (slam->smoother != NULL) {
        slam->smoothing->restart(slam->smoother, &slam->params, &slam->ekf);
    }
}

// ---- odometry ---------------------------------------------------------------------------------------------

/// The length of a motion. Beyond 1 km it is 1 km: more than any way that correlation_m may name, and the
/// filter's own speed has no bound that would keep the conversion defined.
static uint32_t whole_micrometres(bslam_real_t forward_m)
{
    return bslam_in_range(forward_m, -WAY_MAX_M, WAY_MAX_M)
               ? (uint32_t)(bslam_abs(forward_m) * MICROMETRES_PER_M)
               : (uint32_t)(WAY_MAX_M * MICROMETRES_PER_M);
}

/// The filter goes through one waiting motion, or its part before the moment until_us before the newest end.
static void predict_step(bslam_slam_t *slam, int64_t until_us)
{
    bslam_history_place_t place = slam->history.filter;
    const bslam_motion_t motion = bslam_history_walk(&slam->history, &place, until_us);
    bslam_motion_t moved;
    bslam_ekf_predict(&slam->ekf, &slam->params, &motion, &moved);
    if (slam->smoother != NULL) {
        slam->smoothing->move(slam->smoother, &slam->ekf, &motion);
    }
    bslam_history_take(&slam->history, &place, &moved);
    slam->way_um += whole_micrometres(moved.forward_m);
}

/// The filter goes on to the moment until_us before the newest odometry.
static void predict_until(bslam_slam_t *slam, int64_t until_us)
{
    while (slam->history.filter.behind_us > until_us) {
        predict_step(slam, until_us);
    }
}

/// A motion waits until a frame shows what comes after it, or until the room is needed.
static void queue_motion(bslam_slam_t *slam, int32_t duration_us, const bslam_motion_t *motion)
{
    const int32_t steps = slam->params.history_steps;
    const int32_t room = steps < BSLAM_HISTORY_MAX ? steps : BSLAM_HISTORY_MAX;
    if (bslam_history_is_full(&slam->history, room)) {
        predict_step(slam, 0);
    }
    bslam_history_add(&slam->history, room, duration_us, motion);
}

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
        status = bslam_ekf_check_motion(&slam->params, &motion);
        if (status != BSLAM_OK) {
            return status;
        }
        queue_motion(slam, (int32_t)(odometry.time_us - slam->odometry.time_us), &motion);
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

static bool are_doubts(bslam_real_t position_sd_m, bslam_real_t heading_sd_rad)
{
    return bslam_in_range(position_sd_m, 0, POSITION_SD_MAX_M) &&
           bslam_in_range(heading_sd_rad, 0, HEADING_SD_MAX_RAD);
}

bslam_status_t bslam_slam_resume_odometry(bslam_slam_t *slam, bslam_real_t position_sd_m,
                                          bslam_real_t heading_sd_rad)
{
    if (!are_doubts(position_sd_m, heading_sd_rad)) {
        return BSLAM_E_RANGE;
    }
    predict_until(slam, 0);
    bslam_ekf_resume(&slam->ekf, &slam->params, position_sd_m * position_sd_m,
                     heading_sd_rad * heading_sd_rad);
    bslam_slam_restart_smoother(slam);
    bslam_odometry_restart(&slam->odometry);
    bslam_history_clear(&slam->history);
    slam->has_frame = false;
    return BSLAM_OK;
}

bslam_status_t bslam_slam_set_pose(bslam_slam_t *slam, const bslam_pose_t *pose, bslam_real_t position_sd_m,
                                   bslam_real_t heading_sd_rad)
{
    if (!bslam_is_number(pose->x_m) || !bslam_is_number(pose->y_m) || !bslam_is_number(pose->theta_rad)) {
        return BSLAM_E_NOT_FINITE;
    }
    if (!are_doubts(position_sd_m, heading_sd_rad)) {
        return BSLAM_E_RANGE;
    }
    bslam_ekf_set_pose(&slam->ekf, pose, position_sd_m * position_sd_m, heading_sd_rad * heading_sd_rad);
    bslam_slam_restart_smoother(slam);
    slam->is_lost = false;
    return BSLAM_OK;
}

void bslam_slam_lose_pose(bslam_slam_t *slam)
{
    const bslam_pose_t pose = bslam_ekf_pose(&slam->ekf);
    bslam_ekf_set_pose(&slam->ekf, &pose, 0, 0);
    bslam_slam_restart_smoother(slam);
    slam->is_lost = true;
}

/// How long before the newest odometry a moment is; 0 while no clock has started.
static int64_t time_behind_us(const bslam_slam_t *slam, int64_t time_us)
{
    return slam->odometry.has_time ? slam->odometry.time_us - time_us : 0;
}

/// The robot of a moment that the filter has not passed, as it goes there from where it is known.
static bslam_robot_t robot_at(const bslam_slam_t *slam, int64_t behind_us, bslam_pose_t *pose)
{
    bslam_robot_t robot = bslam_ekf_robot(&slam->ekf);
    bslam_history_place_t place = slam->history.filter;
    bslam_motion_t moved = bslam_history_newest(&slam->history);
    const int64_t until_us = behind_us > 0 ? behind_us : 0;
    while (place.behind_us > until_us) {
        const bslam_motion_t motion = bslam_history_walk(&slam->history, &place, until_us);
        bslam_robot_predict(&robot, &slam->params, &motion, &moved);
    }
    *pose = bslam_robot_pose(&robot);
    if (behind_us < 0) {
        const bslam_pose_t ahead = bslam_history_look_ahead(&slam->params, &moved, -behind_us);
        *pose = bslam_pose_compose(pose, &ahead);
    }
    return robot;
}

// ---- sightings --------------------------------------------------------------------------------------------

/// A standard deviation, or 0 where the detector gives none.
static bool is_noise(bslam_real_t sd, bslam_real_t low, bslam_real_t high)
{
    return sd == 0 || bslam_in_range(sd, low, high);
}

/// Set in the bits of every float from 2 on, of infinities and of NaN.
#define LARGE_FLOAT 0x40000000U

/// Values of signatures are small as a rule, and then no value sets that bit: two instructions each.
static bool signature_is_finite(const float *signature)
{
    if (signature == NULL) {
        return true;
    }
    uint32_t bits = 0;
    for (int k = 0; k < BSLAM_SAMPLE_FEATURES; k++) {
        uint32_t value;
        memcpy(&value, &signature[k], sizeof value);
        bits |= value;
    }
    bool is_finite = true;
    for (int k = 0; (bits & LARGE_FLOAT) != 0 && is_finite && k < BSLAM_SAMPLE_FEATURES; k++) {
        is_finite = bslam_is_number((bslam_real_t)signature[k]);
    }
    return is_finite;
}

static bslam_status_t check_sighting(const bslam_sighting_t *sighting)
{
    if (!signature_is_finite(sighting->signature) || !bslam_is_number(sighting->bearing_rad) ||
        !bslam_is_number(sighting->bearing_sd_rad) ||
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

/// Checks a frame, and says how long before the newest odometry it was taken.
static bslam_status_t check_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                  int count, int64_t *behind_us)
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
    *behind_us = time_behind_us(slam, time_us - slam->params.sighting_delay_us);
    const bool in_reach =
        *behind_us <= slam->history.filter.behind_us && *behind_us >= -slam->params.ahead_max_us;
    return in_reach ? BSLAM_OK : BSLAM_E_TIME;
}

/// Where the sensor of a frame is on the robot, which has come as far as odometry has: of a frame that is
/// ahead of it, where it will be.
static bslam_pose_t mount_of_frame(const bslam_slam_t *slam, int64_t behind_us)
{
    const bslam_params_t *p = &slam->params;
    const bslam_pose_t mount = {p->mount_x_m, p->mount_y_m, p->mount_yaw_rad};
    if (behind_us >= 0) {
        return mount;
    }
    const bslam_motion_t last = bslam_history_newest(&slam->history);
    const bslam_pose_t ahead = bslam_history_look_ahead(p, &last, -behind_us);
    return bslam_pose_compose(&ahead, &mount);
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
    slam->counters.frozen += reason == BSLAM_REASON_FROZEN ? 1u : 0u;
}

/// A sighting counts towards a beacon's confirmation if the robot has gone far enough since the last that
/// did.
static void count_view(bslam_slam_t *slam, bslam_beacon_t *beacon)
{
    const uint32_t least_um = (uint32_t)(slam->params.confirm_way_m * MICROMETRES_PER_M);
    if (!beacon->confirmed && slam->way_um - beacon->view_um >= least_um) {
        beacon->view_um = slam->way_um;
        beacon->views++;
        beacon->confirmed = beacon->views >= slam->params.confirm_sightings;
        slam->confirmed_now = slam->confirmed_now || beacon->confirmed;
    }
}

/// What is fused of a sighting. How much too long a beacon's distances are goes with what it is taken for:
/// taken for something else, it has a direction only.
static bslam_sighting_t sighting_of(const bslam_sighting_t *sighting, const bslam_beacon_t *beacon)
{
    bslam_sighting_t taken = *sighting;
    const bool differs = beacon->beacon_class != sighting->beacon_class &&
                         beacon->beacon_class != BSLAM_CLASS_NONE &&
                         sighting->beacon_class != BSLAM_CLASS_NONE;
    taken.has_range = taken.has_range && (beacon->kind != BSLAM_BEACON_SIZED || !differs);
    return taken;
}

/// Fuses a sighting with the beacon that association chose.
static void fuse_match(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sighting,
                       bslam_beacon_t *beacon, bslam_innovation_t *innovation, bslam_account_t *account)
{
    const bslam_real_t way_m = (bslam_real_t)(slam->way_um - beacon->way_um) / MICROMETRES_PER_M;
    const bslam_real_t factor = bslam_correlation_factor(&slam->params, way_m);
    innovation->range_var_m2 *= factor;
    innovation->bearing_var_rad2 *= factor;
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
    if (slam->smoother != NULL) {
        const bslam_sighting_t taken = sighting_of(sighting, beacon);
        slam->smoothing->see(slam->smoother, &taken, (int)(beacon - slam->ekf.beacons));
    }
    beacon->sightings++;
    beacon->way_um = slam->way_um;
    beacon->last_seen_us = time_us;
    count_view(slam, beacon);
}

/// Where its identity was told, a beacon that starts although another has its label contradicts that one, as
/// that one does it.
static void note_rivals(bslam_slam_t *slam, int index)
{
    bslam_beacon_t *beacons = slam->ekf.beacons;
    for (int b = 0; b < index && slam->params.association == BSLAM_ASSOCIATION_KNOWN; b++) {
        const uint32_t rivals = beacons[b].label == beacons[index].label ? 1 : 0;
        beacons[b].gated += rivals;
        beacons[index].gated += rivals;
    }
}

static void add_new(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount,
                    const bslam_sighting_t *sighting, bslam_account_t *account)
{
    int index;
    const bslam_status_t status =
        slam->smoother != NULL ? slam->smoothing->add(slam->smoother, &slam->ekf, mount, sighting, &index)
                               : bslam_ekf_add(&slam->ekf, &slam->params, mount, sighting, &index);
    if (status != BSLAM_OK) {
        reject(slam, BSLAM_REASON_MAP_FULL, NULL, account);
        return;
    }
    bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    beacon->label = sighting->label;
    beacon->beacon_class = sighting->beacon_class;
    beacon->first_seen_us = time_us;
    beacon->last_seen_us = time_us;
    beacon->sightings = 1;
    beacon->way_um = slam->way_um;
    beacon->view_um = slam->way_um;
    beacon->views = 1;
    beacon->confirmed = slam->params.confirm_sightings <= 1;
    note_rivals(slam, index);
    if (slam->smoother != NULL) {
        slam->smoothing->see(slam->smoother, sighting, index);
    }
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
        } else if (match->verdict == BSLAM_VERDICT_MATCH) {
            const bslam_beacon_t *beacon = &slam->ekf.beacons[match->beacon];
            const bslam_sighting_t taken = sighting_of(&sightings[i], beacon);
            if (bslam_ekf_innovation(&slam->ekf, &slam->params, mount, &taken, match->beacon,
                                     &slam->innovations[i]) != BSLAM_OK) {
                reject(slam, BSLAM_REASON_SINGULAR, beacon, &slam->accounts[i]);
                match->verdict = BSLAM_VERDICT_REJECT;
            }
        }
    }
}

/// Fuses all matches, then adds what is new. Not to be inlined: association, before it, goes deepest, and
/// would have its frame on the stack.
__attribute__((noinline)) static void use_matches(bslam_slam_t *slam, int64_t time_us,
                                                  const bslam_pose_t *mount,
                                                  const bslam_sighting_t *sightings, int count)
{
    take_innovations(slam, mount, sightings, count);
    for (int i = 0; i < count; i++) {
        if (slam->matches[i].verdict == BSLAM_VERDICT_MATCH) {
            fuse_match(slam, time_us, &sightings[i], &slam->ekf.beacons[slam->matches[i].beacon],
                       &slam->innovations[i], &slam->accounts[i]);
        }
    }
    bslam_ekf_correct(&slam->ekf, &slam->params);
    for (int i = 0; i < count; i++) {
        if (slam->matches[i].verdict != BSLAM_VERDICT_NEW) {
            continue;
        }
        if (slam->is_frozen) {
            reject(slam, BSLAM_REASON_FROZEN, NULL, &slam->accounts[i]);
        } else {
            add_new(slam, time_us, mount, &sightings[i], &slam->accounts[i]);
        }
    }
}

// ---- looks ------------------------------------------------------------------------------------------------

static int find_uid(const bslam_ekf_t *ekf, uint32_t uid)
{
    for (int b = 0; b < ekf->beacon_count; b++) {
        if (ekf->beacons[b].uid == uid) {
            return b;
        }
    }
    return -1;
}

/// Takes a beacon out of the map, and what is known of its looks with it.
static void drop_beacon(bslam_slam_t *slam, int index)
{
    if (slam->looks != NULL) {
        slam->learning->forget(slam->looks, index, slam->ekf.beacon_count);
    }
    if (slam->smoother != NULL) {
        slam->smoothing->remove(slam->smoother, index);
    }
    bslam_ekf_remove(&slam->ekf, index);
}

/// Machines learn from what a frame surely showed, and train for a bounded time.
static void learn_looks(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count)
{
    for (int i = 0; i < count; i++) {
        const bslam_account_t *account = &slam->accounts[i];
        const bool is_new = account->outcome == BSLAM_OUTCOME_NEW;
        if (!is_new && account->outcome != BSLAM_OUTCOME_MATCHED) {
            continue;
        }
        const int index = find_uid(&slam->ekf, account->beacon_uid);
        if (is_new || slam->matches[i].sure) {
            bslam_looks_teach(slam->looks, &slam->params, index, slam->ekf.beacon_count, slam->way_um,
                              &sightings[i]);
        } else {
            slam->looks->counters.unsure++;
        }
    }
    const int leaves = bslam_doubles_settle(slam->looks, &slam->ekf, &slam->params, time_us);
    if (leaves != BSLAM_NO_DOUBLE) {
        drop_beacon(slam, leaves);
    }
    (void)bslam_learner_work(&slam->looks->learner, slam->params.learn_budget);
}

void bslam_slam_attach_smoother(bslam_slam_t *slam, bslam_smoother_t *smoother)
{
    static const bslam_smoothing_t smoothing = {bslam_smoother_restart, bslam_smoother_move,
                                                bslam_smoother_see,     bslam_smoother_add,
                                                bslam_smoother_remove,  bslam_smoother_frame};
    slam->smoothing = &smoothing;
    slam->smoother = slam->params.filter == BSLAM_FILTER_SMOOTHER ? smoother : NULL;
    bslam_slam_restart_smoother(slam);
}

void bslam_slam_attach_looks(bslam_slam_t *slam, bslam_looks_t *looks)
{
    static const bslam_learning_t learning = {bslam_looks_clear, bslam_looks_forget, learn_looks};
    slam->looks = looks;
    slam->learning = &learning;
    if (looks != NULL) {
        bslam_looks_clear(looks);
    }
}

// ---- tidying ----------------------------------------------------------------------------------------------

/// A provisional beacon leaves when its time is up. Where its identity was told, leaving the view early is no
/// reason against it: it leaves if sightings contradicted it.
static bool is_unconfirmed(const bslam_params_t *params, const bslam_beacon_t *beacon, int64_t time_us)
{
    const int64_t window_us = params->confirm_window_us;
    if (window_us == 0 || beacon->confirmed || time_us - beacon->first_seen_us <= window_us) {
        return false;
    }
    return params->association != BSLAM_ASSOCIATION_KNOWN || beacon->gated > 0;
}

/// The first that is confirmed of several with one told label stays, the others leave.
static void drop_rivals(bslam_slam_t *slam)
{
    const bool is_told = slam->params.association == BSLAM_ASSOCIATION_KNOWN;
    for (int b = slam->ekf.beacon_count - 1; b >= 0 && is_told; b--) {
        const bslam_beacon_t *beacon = &slam->ekf.beacons[b];
        for (int i = 0; i < slam->ekf.beacon_count && !beacon->confirmed; i++) {
            if (slam->ekf.beacons[i].confirmed && slam->ekf.beacons[i].label == beacon->label) {
                drop_beacon(slam, b);
                slam->counters.removed++;
                break;
            }
        }
    }
    slam->confirmed_now = false;
}

/// Rays whose distance is known become points; provisional beacons whose time is up leave.
static void tidy_map(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount)
{
    for (int b = slam->ekf.beacon_count - 1; b >= 0; b--) {
        const bslam_beacon_t *beacon = &slam->ekf.beacons[b];
        if (is_unconfirmed(&slam->params, beacon, time_us)) {
            drop_beacon(slam, b);
            slam->counters.removed++;
        } else if (bslam_ekf_settle_ray(&slam->ekf, &slam->params, mount, b)) {
            slam->counters.settled++;
        }
    }
    if (slam->confirmed_now) {
        drop_rivals(slam);
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

bslam_status_t bslam_slam_open_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                     int count, bslam_pose_t *mount)
{
    int64_t behind_us;
    const bslam_status_t status = check_frame(slam, time_us, sightings, count, &behind_us);
    if (status != BSLAM_OK) {
        slam->counters.frames_refused++;
        return status;
    }
    predict_until(slam, behind_us > 0 ? behind_us : 0);
    *mount = mount_of_frame(slam, behind_us);
    return BSLAM_OK;
}

void bslam_slam_close_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count,
                            const bslam_pose_t *mount, bool use)
{
    if (use && !slam->is_lost) {
        const bslam_sighting_frame_t frame = {&slam->ekf, &slam->params, slam->looks,
                                              mount,      sightings,     count};
        const bslam_associate_fn associate = bslam_associate_method(&slam->params);
        associate(&frame, slam->matches);
        use_matches(slam, time_us, mount, sightings, count);
        if (slam->looks != NULL && !slam->is_frozen && slam->params.association == BSLAM_ASSOCIATION_SVM) {
            slam->learning->learn(slam, time_us, sightings, count);
        }
        tidy_map(slam, time_us, mount);
    } else {
        for (int i = 0; i < count; i++) {
            fill_account(&slam->accounts[i], BSLAM_OUTCOME_DEFERRED, BSLAM_REASON_LOST, NULL);
        }
    }
    if (slam->smoother != NULL) {
        slam->smoothing->frame(slam->smoother, &slam->params, &slam->ekf);
    }
    slam->last_frame_us = time_us;
    slam->has_frame = true;
    bslam_odometry_start(&slam->odometry, time_us);
    slam->account_count = count;
    count_accounts(slam, count);
}

bslam_status_t bslam_slam_sightings(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                    int count)
{
    bslam_pose_t mount;
    const bslam_status_t status = bslam_slam_open_frame(slam, time_us, sightings, count, &mount);
    if (status == BSLAM_OK) {
        bslam_slam_close_frame(slam, time_us, sightings, count, &mount, true);
    }
    return status;
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
        bslam_slam_restart_smoother(slam);
    }
    return status;
}

void bslam_slam_forget_map(bslam_slam_t *slam)
{
    if (slam->looks != NULL) {
        slam->learning->clear(slam->looks);
    }
    bslam_ekf_forget_map(&slam->ekf);
    bslam_slam_restart_smoother(slam);
    slam->is_frozen = false;
}

bslam_status_t bslam_slam_remove_beacon(bslam_slam_t *slam, uint32_t uid)
{
    const int index = find_uid(&slam->ekf, uid);
    if (index < 0) {
        return BSLAM_E_NO_BEACON;
    }
    drop_beacon(slam, index);
    return BSLAM_OK;
}

// ---- results ----------------------------------------------------------------------------------------------

bslam_pose_t bslam_slam_pose(const bslam_slam_t *slam)
{
    bslam_pose_t pose;
    (void)robot_at(slam, 0, &pose);
    return pose;
}

bslam_status_t bslam_slam_pose_at(const bslam_slam_t *slam, int64_t time_us, bslam_pose_t *pose)
{
    if (time_us < 0 || time_us > INT64_MAX / 2) {
        return BSLAM_E_TIME;
    }
    const int64_t behind_us = time_behind_us(slam, time_us);
    if (behind_us < -slam->params.ahead_max_us) {
        return BSLAM_E_TIME;
    }
    const int64_t back_us = behind_us - slam->history.filter.behind_us;
    if (back_us <= 0) {
        (void)robot_at(slam, behind_us, pose);
        return BSLAM_OK;
    }
    bslam_pose_t relative;
    const bslam_status_t status = bslam_history_look_back(&slam->history, &slam->params, back_us, &relative);
    if (status == BSLAM_OK) {
        const bslam_pose_t filter = bslam_ekf_pose(&slam->ekf);
        *pose = bslam_pose_compose(&filter, &relative);
    }
    return status;
}

void bslam_slam_pose_covariance(const bslam_slam_t *slam, bslam_real_t lower[6])
{
    bslam_pose_t unused;
    const bslam_robot_t robot = robot_at(slam, 0, &unused);
    int k = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            lower[k] = bslam_symmat_get(robot.covariance, i, j);
            k++;
        }
    }
    if (slam->is_lost) {
        lower[0] += POSITION_SD_MAX_M * POSITION_SD_MAX_M;
        lower[2] += POSITION_SD_MAX_M * POSITION_SD_MAX_M;
        lower[5] += HEADING_SD_MAX_RAD * HEADING_SD_MAX_RAD;
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
