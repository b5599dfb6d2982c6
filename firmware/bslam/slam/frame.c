#include "base/trig.h"
#include "bslam/association/duplicates.h"
#include "bslam/association/missed_beacons.h"
#include "bslam/model/noise.h"
#include "bslam/model/pose.h"
#include "bslam/slam/slam_internal.h"

// Six degrees: at the distance of a wall, as much as two beacons are apart.
static const bslam_real_t DOUBTFUL_HEADING_RAD2 = BSLAM_R(0.01);

static const bslam_real_t MICROMETRES_PER_M = BSLAM_R(1e6);
static const bslam_real_t SECONDS_PER_US = BSLAM_R(1e-6);

// ---- from where a frame was taken -------------------------------------------------------------------------

/// Of a frame that is older than the filter: the way since is odometry's, and so is its doubt; of speeds that
/// are states the filter knows more.
static bslam_pose_t look_back(const bslam_slam_t *slam, int64_t back_us, bslam_vantage_t *vantage)
{
    bslam_history_view_t view = {.robot = {0, 0, 0}};
    const bslam_status_t status = bslam_history_look_back(&slam->history, &slam->settings, back_us, &view);
    (void)status;  // the frame was checked
    bslam_real_t forward_var_m2 = view.forward_var_m2, turn_var_rad2 = view.turn_var_rad2;
    if (slam->settings.velocity_states != 0) {
        const bslam_robot_t robot = bslam_ekf_robot(&slam->ekf);
        const bslam_real_t back_s = (bslam_real_t)(int32_t)back_us * SECONDS_PER_US, square = back_s * back_s;
        forward_var_m2 = square * robot.covariance[BSLAM_STATE_FORWARD][BSLAM_STATE_FORWARD];
        turn_var_rad2 = square * robot.covariance[BSLAM_STATE_TURN][BSLAM_STATE_TURN];
    }
    const bslam_real_t way2_m2 = view.robot.x_m * view.robot.x_m + view.robot.y_m * view.robot.y_m;
    vantage->position_var_m2 = forward_var_m2 + way2_m2 * turn_var_rad2;
    vantage->heading_var_rad2 = turn_var_rad2;
    return view.robot;
}

/// The filter is there, or has passed it. Of a frame that is ahead of odometry: where the robot will be.
static bslam_vantage_t vantage_of(const bslam_slam_t *slam, int64_t behind_us)
{
    const bslam_settings_t *p = &slam->settings;
    const int64_t back_us = behind_us - slam->history.filter.behind_us;
    const int64_t moment_us = slam->elapsed_us - behind_us;
    bslam_vantage_t vantage = {.mount = {p->mount_x_m, p->mount_y_m, p->mount_yaw_rad},
                               .moment_us = moment_us > slam->moment_us ? moment_us : slam->moment_us,
                               .is_elsewhere = back_us != 0};
    if (vantage.is_elsewhere) {
        const bslam_motion_t last = bslam_history_newest(&slam->history);
        const bslam_pose_t robot =
            back_us < 0 ? bslam_history_look_ahead(p, &last, -back_us) : look_back(slam, back_us, &vantage);
        vantage.mount = bslam_pose_compose(&robot, &vantage.mount);
    }
    return vantage;
}

/// A sighting of a frame that is older than the filter is as doubtful as the way since makes it.
static void doubt(const bslam_slam_t *slam, const bslam_vantage_t *vantage, bslam_sighting_t *seen)
{
    if (!(vantage->position_var_m2 > 0 || vantage->heading_var_rad2 > 0)) {
        return;
    }
    const bslam_settings_t *settings = &slam->settings;
    const bslam_real_t sd_rad = seen->bearing_sd_rad > 0 ? seen->bearing_sd_rad : settings->bearing_sd_rad;
    const bslam_real_t per_m = seen->has_range ? 1 / seen->range_m : settings->ray_inverse_distance_per_m;
    if (seen->has_range) {
        seen->range_sd_m =
            bslam_sqrt(bslam_range_variance_m2(settings, seen, seen->range_m) + vantage->position_var_m2);
    }
    seen->bearing_sd_rad =
        bslam_sqrt(sd_rad * sd_rad + vantage->heading_var_rad2 + vantage->position_var_m2 * per_m * per_m);
}

/// For the smoother, which knows no place but the filter's: the sighting of a beacon that is off as much
/// there as the frame's is from where it was taken.
static void carry_on(const bslam_slam_t *slam, const bslam_vantage_t *vantage, int beacon,
                     bslam_sighting_t *seen)
{
    const bslam_settings_t *p = &slam->settings;
    const bslam_pose_t mount = {p->mount_x_m, p->mount_y_m, p->mount_yaw_rad};
    bslam_innovation_t there, here;
    if (vantage->is_elsewhere &&
        bslam_ekf_innovation(&slam->ekf, p, &vantage->mount, seen, beacon, &there) == BSLAM_OK &&
        bslam_ekf_innovation(&slam->ekf, p, &mount, seen, beacon, &here) == BSLAM_OK) {
        seen->bearing_rad += bslam_angle_wrap(there.bearing_rad - here.bearing_rad);
        seen->range_m += seen->has_range ? there.range_m - here.range_m : 0;
    }
}

// ---- accounts ---------------------------------------------------------------------------------------------

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

static bslam_real_t test_ratio(bslam_real_t gate_d2, bslam_real_t distance2)
{
    return gate_d2 > 0 && distance2 >= 0 ? distance2 / gate_d2 : -1;
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

static void note_match(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sighting,
                       bslam_beacon_t *beacon, bslam_real_t distance2)
{
    beacon->sightings++;
    beacon->last_seen_us = time_us;
    bslam_slam_confirm_match(slam, beacon, sighting, distance2);
}

/// A sighting of what may be no beacon moves nothing, but says whether it is one.
static void count_tentative(bslam_slam_t *slam, int64_t time_us, const bslam_record_t *record)
{
    const bslam_match_t *match = &record->match;
    bslam_beacon_t *beacon = match->beacon >= 0 ? &slam->ekf.beacons[match->beacon] : NULL;
    if (beacon != NULL && slam->settings.gate_d2 > 0 && match->distance2 > slam->settings.gate_d2) {
        reject(slam, BSLAM_REASON_GATE, beacon, record->account);
        beacon->gated++;
        record->account->test_ratio = test_ratio(slam->settings.gate_d2, match->distance2);
        return;
    }
    fill_account(record->account, BSLAM_OUTCOME_DEFERRED, BSLAM_REASON_TENTATIVE, beacon);
    if (beacon != NULL) {
        note_match(slam, time_us, record->sighting, beacon, match->distance2);
    }
}

/// What of a sighting the smoother keeps.
static void keep_seen(bslam_slam_t *slam, const bslam_vantage_t *vantage, const bslam_sighting_t *sighting,
                      int index)
{
    bslam_sighting_t taken = bslam_ekf_taken_as(&slam->ekf.beacons[index], sighting);
    doubt(slam, vantage, &taken);
    carry_on(slam, vantage, index, &taken);
    bslam_smoother_see(slam->smoother, &taken, index);
}

/// Fuses a sighting with the beacon that association chose.
static void fuse_match(bslam_slam_t *slam, const bslam_vantage_t *vantage, bslam_record_t *record)
{
    bslam_beacon_t *beacon = &slam->ekf.beacons[record->match.beacon];
    bslam_innovation_t *innovation = &record->innovation;
    bslam_account_t *account = record->account;
    const bslam_real_t travelled_m =
        (bslam_real_t)(slam->travelled_um - beacon->travelled_um) / MICROMETRES_PER_M;
    const bslam_real_t factor = bslam_correlation_factor(&slam->settings, travelled_m);
    innovation->range_var_m2 *= factor;
    innovation->bearing_var_rad2 *= factor;
    bslam_fusion_t fusion = {.distance2 = -1, .weight = 0};
    const bslam_status_t status = bslam_ekf_fuse(&slam->ekf, &slam->settings, innovation, &fusion);
    if (status != BSLAM_OK) {
        reject(slam, status == BSLAM_E_RANGE ? BSLAM_REASON_GATE : BSLAM_REASON_SINGULAR, beacon, account);
        beacon->gated += status == BSLAM_E_RANGE ? 1u : 0u;
        account->test_ratio = test_ratio(innovation->gate_d2, fusion.distance2);
        return;
    }
    fill_account(account, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE, beacon);
    account->test_ratio = test_ratio(innovation->gate_d2, fusion.distance2);
    account->weight = fusion.weight;
    slam->counters.down_weighted += fusion.weight < 1 ? 1u : 0u;
    if (bslam_slam_smooths(slam)) {
        keep_seen(slam, vantage, record->sighting, record->match.beacon);
    }
    beacon->travelled_um = slam->travelled_um;
    note_match(slam, vantage->moment_us, record->sighting, beacon, fusion.distance2);
}

/// Known data association: a new beacon contradicts another of its label, and that one it.
static void note_competitors(bslam_slam_t *slam, int index)
{
    bslam_beacon_t *beacons = slam->ekf.beacons;
    for (int b = 0; b < index && slam->settings.association == BSLAM_ASSOCIATION_KNOWN; b++) {
        const uint32_t against = beacons[b].label == beacons[index].label ? 1 : 0;
        beacons[b].gated += against;
        beacons[index].gated += against;
    }
}

/// Whether there is room for what a sighting shows, or for the sensor where that has no distance.
static bool may_begin(const bslam_slam_t *slam, const bslam_pose_t *mount, const bslam_sighting_t *sighting)
{
    const bslam_pose_t pose = bslam_ekf_pose(&slam->ekf);
    const bslam_real_t range_m = sighting->has_range ? sighting->range_m : 0;
    const bslam_sighted_point_t place = bslam_locate_point(&pose, mount, range_m, sighting->bearing_rad);
    return bslam_slam_reaches(place.x_m, place.y_m) && bslam_slam_has_uid(slam);
}

/// As the filter takes it, or the smoother in its place.
static bslam_status_t begin_beacon(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                                   const bslam_sighting_t *sighting, int *index)
{
    const bslam_pose_t *mount = &vantage->mount;
    bslam_sighting_t seen = *sighting;
    if (!may_begin(slam, mount, sighting)) {
        return BSLAM_E_MAP_FULL;
    }
    doubt(slam, vantage, &seen);
    return bslam_slam_smooths(slam) ? bslam_smoother_add(slam->smoother, &slam->ekf, mount, &seen, index)
                                    : bslam_ekf_add(&slam->ekf, &slam->settings, mount, &seen, index);
}

static void add_new(bslam_slam_t *slam, const bslam_vantage_t *vantage, const bslam_record_t *record)
{
    const bslam_sighting_t *sighting = record->sighting;
    bslam_account_t *account = record->account;
    int index;
    const bslam_status_t status = begin_beacon(slam, vantage, sighting, &index);
    if (status != BSLAM_OK) {
        reject(slam, BSLAM_REASON_MAP_FULL, NULL, account);
        return;
    }
    bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    beacon->label = sighting->label;
    beacon->beacon_class = sighting->beacon_class;
    beacon->class_lead = sighting->has_range ? 1 : 0;
    beacon->first_seen_us = vantage->moment_us;
    beacon->last_seen_us = vantage->moment_us;
    beacon->sightings = 1;
    beacon->travelled_um = slam->travelled_um;
    bslam_slam_confirm_new(slam, beacon, sighting);
    note_competitors(slam, index);
    if (bslam_slam_smooths(slam)) {
        keep_seen(slam, vantage, sighting, index);
    }
    fill_account(account, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE, beacon);
    account->weight = 1;
}

/// The gate of a frame. Where appearance decides, and for a while nothing has been where it should be, it is
/// the pose that errs: all that association takes for a candidate is used.
static bslam_real_t gate_of(const bslam_slam_t *slam, int64_t time_us)
{
    const bslam_settings_t *settings = &slam->settings;
    const bool opens = settings->association == BSLAM_ASSOCIATION_SVM && settings->gate_d2 > 0 &&
                       settings->gate_d2 < settings->candidate_d2 &&
                       !bslam_is_placed(&slam->ekf, settings->decision_delay_us, -1, time_us);
    return opens ? settings->candidate_d2 : settings->gate_d2;
}

/// Whether a match would turn the robot to whatever it is taken for. It has no distance that might contradict
/// it, and nothing known has been where it should be for a while. The heading is doubtful, or the match
/// hardly leads.
static bool is_vague(const bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sighting,
                     const bslam_match_t *match)
{
    const bslam_settings_t *settings = &slam->settings;
    return settings->association == BSLAM_ASSOCIATION_SVM && slam->measures_distance &&
           !sighting->has_range &&
           (bslam_ekf_covariance(&slam->ekf, 2, 2) > DOUBTFUL_HEADING_RAD2 ||
            match->lead < settings->decision_delay_score) &&
           !bslam_is_placed(&slam->ekf, settings->decision_delay_us, -1, time_us);
}

// ---- the stages, in their order: bslam_slam_close_frame ---------------------------------------------------

static void associate(bslam_slam_t *slam, const bslam_vantage_t *vantage, const bslam_sighting_t *sightings,
                      int count)
{
    const bslam_sighting_frame_t frame = {.ekf = &slam->ekf,
                                          .settings = &slam->settings,
                                          .appearance = slam->appearance,
                                          .mount = &vantage->mount,
                                          .sightings = sightings,
                                          .count = count,
                                          .time_us = vantage->moment_us};
    for (int i = 0; i < count; i++) {
        slam->records[i].sighting = &sightings[i];
        slam->records[i].account = &slam->accounts[i];
    }
    const bslam_associate_fn method = bslam_associate_method(&slam->settings);
    method(&frame, slam->records);
}

/// What of a match's distance is used, before any innovation is taken.
static void choose_distances(bslam_slam_t *slam, const bslam_pose_t *mount, int count)
{
    for (int i = 0; i < count; i++) {
        bslam_match_t *match = &slam->records[i].match;
        const bslam_sighting_t *sighting = slam->records[i].sighting;
        match->range_used = match->verdict == BSLAM_VERDICT_MATCH &&
                            (bslam_slam_begin_scale(slam, mount, match->beacon, sighting) ||
                             !bslam_slam_vote_distance(slam, mount, match->beacon, sighting));
    }
}

static void take_innovation(bslam_slam_t *slam, const bslam_vantage_t *vantage, bslam_real_t gate_d2,
                            bslam_record_t *record)
{
    bslam_match_t *match = &record->match;
    bslam_innovation_t *innovation = &record->innovation;
    const bslam_beacon_t *beacon = &slam->ekf.beacons[match->beacon];
    bslam_sighting_t taken = bslam_ekf_taken_as(beacon, record->sighting);
    doubt(slam, vantage, &taken);
    if (bslam_ekf_innovation(&slam->ekf, &slam->settings, &vantage->mount, &taken, match->beacon,
                             innovation) != BSLAM_OK) {
        reject(slam, BSLAM_REASON_SINGULAR, beacon, record->account);
        match->verdict = BSLAM_VERDICT_REJECT;
    }
    innovation->has_range = innovation->has_range && !match->range_used;
    innovation->gate_d2 = gate_d2;
    innovation->gate_is_open = bslam_slam_opens_gate(slam, beacon);
}

/// Accounts for every sighting that is not to be fused, and takes the innovations of those that are: all of
/// them before the first is fused, so that the order within a frame does not matter.
static void measure(bslam_slam_t *slam, const bslam_vantage_t *vantage, int count)
{
    const int64_t moment_us = vantage->moment_us;
    choose_distances(slam, &vantage->mount, count);
    const bslam_real_t gate_d2 = gate_of(slam, moment_us);
    for (int i = 0; i < count; i++) {
        bslam_record_t *record = &slam->records[i];
        bslam_match_t *match = &record->match;
        if (match->verdict == BSLAM_VERDICT_MATCH && is_vague(slam, moment_us, record->sighting, match)) {
            match->verdict = BSLAM_VERDICT_DEFER;
            match->reason = BSLAM_REASON_AMBIGUOUS;
        }
        if (match->verdict == BSLAM_VERDICT_REJECT) {
            reject(slam, match->reason, NULL, record->account);
        } else if (match->verdict == BSLAM_VERDICT_DEFER) {
            fill_account(record->account, BSLAM_OUTCOME_DEFERRED, match->reason, NULL);
        } else if (match->verdict == BSLAM_VERDICT_MATCH) {
            take_innovation(slam, vantage, gate_d2, record);
        }
    }
}

static void fuse(bslam_slam_t *slam, const bslam_vantage_t *vantage, int count)
{
    for (int i = 0; i < count; i++) {
        bslam_record_t *record = &slam->records[i];
        if (record->match.verdict == BSLAM_VERDICT_TENTATIVE) {
            count_tentative(slam, vantage->moment_us, record);
        } else if (record->match.verdict == BSLAM_VERDICT_MATCH) {
            fuse_match(slam, vantage, record);
        }
    }
}

/// Moves the mean; then the detector's classes are counted, which another scale may follow.
static void correct(bslam_slam_t *slam, int count)
{
    bslam_ekf_correct(&slam->ekf, &slam->settings);
    for (int i = 0; i < count; i++) {
        const bslam_record_t *record = &slam->records[i];
        if (record->match.verdict == BSLAM_VERDICT_MATCH &&
            record->account->outcome == BSLAM_OUTCOME_MATCHED) {
            bslam_slam_vote_class(slam, record->match.beacon, record->sighting);
        }
    }
}

static void augment(bslam_slam_t *slam, const bslam_vantage_t *vantage, int count)
{
    for (int i = 0; i < count; i++) {
        const bslam_record_t *record = &slam->records[i];
        if (record->match.verdict == BSLAM_VERDICT_NEW && slam->is_frozen) {
            reject(slam, BSLAM_REASON_FROZEN, NULL, record->account);
        } else if (record->match.verdict == BSLAM_VERDICT_NEW) {
            add_new(slam, vantage, record);
        }
    }
}

/// Not to be inlined: association, before it, goes deepest, and would have its frame on the stack.
__attribute__((noinline)) static void use_matches(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                                                  int count)
{
    measure(slam, vantage, count);
    bslam_slam_doubt_sightings(slam, count);
    fuse(slam, vantage, count);
    bslam_slam_note_misfit(slam, count);
    correct(slam, count);
    augment(slam, vantage, count);
}

// ---- learning ---------------------------------------------------------------------------------------------

static bool was_tentative(const bslam_account_t *account)
{
    return account->reason == BSLAM_REASON_TENTATIVE && account->has_beacon;
}

/// Which matches are delayed, and how well those fit that were made. What has just begun is itself for sure.
static void note_matches(bslam_slam_t *slam, int64_t time_us, int count)
{
    for (int i = 0; i < count; i++) {
        const bslam_account_t *account = slam->records[i].account;
        const bslam_match_t *match = &slam->records[i].match;
        if (match->delayed_for >= 0) {
            bslam_appearance_note_delay(slam->appearance, &slam->settings, match->delayed_for, time_us);
        } else if (account->outcome == BSLAM_OUTCOME_NEW) {
            slam->appearance->of[bslam_slam_find_beacon(slam, account->beacon_uid)].view_score =
                slam->settings.again_odds;
        } else if (account->outcome == BSLAM_OUTCOME_MATCHED || was_tentative(account)) {
            slam->appearance->of[match->beacon].view_score = match->view_score;
        }
    }
}

static void learn(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count)
{
    if (!bslam_slam_learns(slam) || slam->settings.association != BSLAM_ASSOCIATION_SVM) {
        return;
    }
    note_matches(slam, time_us, count);
    if (slam->is_frozen) {
        return;
    }
    bool all_matched = count > 0;
    for (int i = 0; i < count; i++) {
        const bslam_account_t *account = slam->records[i].account;
        const bool is_new = account->outcome == BSLAM_OUTCOME_NEW;
        const bool is_matched = account->outcome == BSLAM_OUTCOME_MATCHED || was_tentative(account);
        all_matched = all_matched && is_matched;
        if (!is_new && !is_matched) {
            continue;
        }
        const int index = bslam_slam_find_beacon(slam, account->beacon_uid);
        if (is_new || slam->records[i].match.sure) {
            bslam_appearance_train(slam->appearance, &slam->settings, index, slam->ekf.beacon_count,
                                   slam->travelled_um, &sightings[i]);
        } else {
            slam->appearance->counters.unsure++;
        }
    }
    const int leaves = bslam_duplicates_settle(slam->appearance, &slam->ekf, &slam->settings, time_us);
    if (leaves != BSLAM_NO_DUPLICATE) {
        bslam_slam_drop_beacon(slam, leaves);
    }
    const int missed = bslam_missed_beacons_find(slam->appearance, &slam->ekf, &slam->settings, time_us,
                                                 slam->travelled_um, all_matched);
    if (missed != BSLAM_NO_MISSED_BEACON) {
        bslam_slam_drop_beacon(slam, missed);
    }
    (void)bslam_learner_work(&slam->appearance->learner, slam->settings.learn_budget);
}

// ---- tidying ----------------------------------------------------------------------------------------------

/// A tentative beacon leaves when its time is up, or as much spoke against it as for it. With known data
/// association leaving the view early is no reason: it leaves if sightings contradicted it.
static bool is_unconfirmed(const bslam_settings_t *settings, const bslam_beacon_t *beacon, int64_t time_us)
{
    const int64_t window_us = settings->confirm_window_us;
    if (beacon->confirmed) {
        return false;
    }
    if (beacon->views == 0 || beacon->score_sum < 0) {
        return true;
    }
    // Of a detector with scores it is these that speak against it.
    if (window_us == 0 || beacon->has_scores || time_us - beacon->first_seen_us <= window_us) {
        return false;
    }
    return settings->association != BSLAM_ASSOCIATION_KNOWN || beacon->gated > 0;
}

/// Known data association: the first of a label that is confirmed stays, its competitors leave.
static void drop_competitors(bslam_slam_t *slam)
{
    const bool is_known = slam->settings.association == BSLAM_ASSOCIATION_KNOWN;
    for (int b = slam->ekf.beacon_count - 1; b >= 0 && is_known; b--) {
        const bslam_beacon_t *beacon = &slam->ekf.beacons[b];
        for (int i = 0; i < slam->ekf.beacon_count && !beacon->confirmed; i++) {
            if (slam->ekf.beacons[i].confirmed && slam->ekf.beacons[i].label == beacon->label) {
                bslam_slam_drop_beacon(slam, b);
                slam->counters.removed++;
                break;
            }
        }
    }
    slam->confirmed_now = false;
}

/// Rays whose distance is known become points; tentative beacons whose time is up leave.
static void tidy_map(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount)
{
    for (int b = slam->ekf.beacon_count - 1; b >= 0; b--) {
        const bslam_beacon_t *beacon = &slam->ekf.beacons[b];
        if (is_unconfirmed(&slam->settings, beacon, time_us)) {
            bslam_slam_drop_beacon(slam, b);
            slam->counters.removed++;
        } else if (beacon->kind == BSLAM_BEACON_RAY &&
                   bslam_ekf_settle_ray(&slam->ekf, &slam->settings, mount, b)) {
            slam->counters.settled++;
        }
    }
    if (slam->confirmed_now) {
        drop_competitors(slam);
    }
}

/// Time passes in a withheld frame, too: it leaves what one without sightings does.
static void tidy(bslam_slam_t *slam, const bslam_vantage_t *vantage)
{
    if (!slam->is_lost) {
        tidy_map(slam, vantage->moment_us, &vantage->mount);
    }
    if (bslam_slam_smooths(slam)) {
        bslam_smoother_frame(slam->smoother, &slam->settings, &slam->ekf);
    }
}

static void count_accounts(bslam_slam_t *slam, int count)
{
    bslam_slam_counters_t *counters = &slam->counters;
    counters->frames++;
    counters->sightings += (uint32_t)count;
    uint32_t *const by_outcome[] = {[BSLAM_OUTCOME_REJECTED] = &counters->rejected,
                                    [BSLAM_OUTCOME_MATCHED] = &counters->matched,
                                    [BSLAM_OUTCOME_NEW] = &counters->added,
                                    [BSLAM_OUTCOME_DEFERRED] = &counters->deferred};
    for (int i = 0; i < count; i++) {
        (*by_outcome[slam->accounts[i].outcome])++;
    }
    counters->insane += bslam_ekf_is_sane(&slam->ekf) ? 0u : 1u;
}

bslam_status_t bslam_slam_open_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                     int count, bslam_vantage_t *vantage)
{
    int64_t behind_us;
    const bslam_status_t status = bslam_slam_check_frame(slam, time_us, sightings, count, &behind_us);
    if (status != BSLAM_OK) {
        slam->counters.frames_refused++;
        return status;
    }
    bslam_slam_note_frame(slam, time_us, sightings, count);
    bslam_slam_predict_until(slam, behind_us > 0 ? behind_us : 0);
    *vantage = vantage_of(slam, behind_us);
    slam->moment_us = vantage->moment_us;
    bslam_odometry_start(&slam->odometry, time_us);
    return BSLAM_OK;
}

static void withhold(bslam_slam_t *slam, int count)
{
    for (int i = 0; i < count; i++) {
        fill_account(&slam->accounts[i], BSLAM_OUTCOME_DEFERRED, BSLAM_REASON_LOST, NULL);
    }
}

void bslam_slam_close_frame(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                            const bslam_sighting_t *sightings, int count, bool use)
{
    if (use && !slam->is_lost) {
        associate(slam, vantage, sightings, count);
        bslam_slam_mark_tentative(slam, count);
        use_matches(slam, vantage, count);  // measure, fuse, correct, augment
        learn(slam, vantage->moment_us, sightings, count);
    } else {
        withhold(slam, count);
    }
    tidy(slam, vantage);
    slam->account_count = count;
    count_accounts(slam, count);
}

bslam_status_t bslam_slam_sightings(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings,
                                    int count)
{
    bslam_vantage_t vantage;
    const bslam_status_t status = bslam_slam_open_frame(slam, time_us, sightings, count, &vantage);
    if (status == BSLAM_OK) {
        bslam_slam_close_frame(slam, &vantage, sightings, count, true);
    }
    return status;
}
