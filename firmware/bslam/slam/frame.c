#include "bslam/association/duplicates.h"
#include "bslam/association/missed_beacons.h"
#include "bslam/model/noise.h"
#include "bslam/model/pose.h"
#include "bslam/slam/slam_internal.h"

// Six degrees: at the distance of a wall, as much as two beacons are apart.
static const bslam_real_t DOUBTFUL_HEADING_RAD2 = BSLAM_R(0.01);

static const bslam_real_t MICROMETRES_PER_M = BSLAM_R(1e6);

/// Where the sensor of a frame is on the robot, which has come as far as odometry has: of a frame that is
/// ahead of it, where it will be.
static bslam_pose_t mount_of_frame(const bslam_slam_t *slam, int64_t behind_us)
{
    const bslam_settings_t *p = &slam->settings;
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

/// Fuses a sighting with the beacon that association chose.
static void fuse_match(bslam_slam_t *slam, int64_t time_us, bslam_record_t *record)
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
        const bslam_sighting_t taken = bslam_ekf_taken_as(beacon, record->sighting);
        bslam_smoother_see(slam->smoother, &taken, record->match.beacon);
    }
    beacon->travelled_um = slam->travelled_um;
    note_match(slam, time_us, record->sighting, beacon, fusion.distance2);
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

static void add_new(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount,
                    const bslam_record_t *record)
{
    const bslam_sighting_t *sighting = record->sighting;
    bslam_account_t *account = record->account;
    int index;
    const bslam_status_t status =
        bslam_slam_smooths(slam) ? bslam_smoother_add(slam->smoother, &slam->ekf, mount, sighting, &index)
                                 : bslam_ekf_add(&slam->ekf, &slam->settings, mount, sighting, &index);
    if (status != BSLAM_OK) {
        reject(slam, BSLAM_REASON_MAP_FULL, NULL, account);
        return;
    }
    bslam_beacon_t *beacon = &slam->ekf.beacons[index];
    beacon->label = sighting->label;
    beacon->beacon_class = sighting->beacon_class;
    beacon->class_lead = sighting->has_range ? 1 : 0;
    beacon->first_seen_us = time_us;
    beacon->last_seen_us = time_us;
    beacon->sightings = 1;
    beacon->travelled_um = slam->travelled_um;
    bslam_slam_confirm_new(slam, beacon, sighting);
    note_competitors(slam, index);
    if (bslam_slam_smooths(slam)) {
        bslam_smoother_see(slam->smoother, sighting, index);
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

static void associate(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount,
                      const bslam_sighting_t *sightings, int count)
{
    const bslam_sighting_frame_t frame = {&slam->ekf, &slam->settings, slam->appearance, mount,
                                          sightings,  count,           time_us};
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

static void take_innovation(bslam_slam_t *slam, const bslam_pose_t *mount, bslam_real_t gate_d2,
                            bslam_record_t *record)
{
    bslam_match_t *match = &record->match;
    bslam_innovation_t *innovation = &record->innovation;
    const bslam_beacon_t *beacon = &slam->ekf.beacons[match->beacon];
    const bslam_sighting_t taken = bslam_ekf_taken_as(beacon, record->sighting);
    if (bslam_ekf_innovation(&slam->ekf, &slam->settings, mount, &taken, match->beacon, innovation) !=
        BSLAM_OK) {
        reject(slam, BSLAM_REASON_SINGULAR, beacon, record->account);
        match->verdict = BSLAM_VERDICT_REJECT;
    }
    innovation->has_range = innovation->has_range && !match->range_used;
    innovation->gate_d2 = gate_d2;
}

/// Accounts for every sighting that is not to be fused, and takes the innovations of those that are: all of
/// them before the first is fused, so that the order within a frame does not matter.
static void measure(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount, int count)
{
    choose_distances(slam, mount, count);
    const bslam_real_t gate_d2 = gate_of(slam, time_us);
    for (int i = 0; i < count; i++) {
        bslam_record_t *record = &slam->records[i];
        bslam_match_t *match = &record->match;
        if (match->verdict == BSLAM_VERDICT_MATCH && is_vague(slam, time_us, record->sighting, match)) {
            match->verdict = BSLAM_VERDICT_DEFER;
            match->reason = BSLAM_REASON_AMBIGUOUS;
        }
        if (match->verdict == BSLAM_VERDICT_REJECT) {
            reject(slam, match->reason, NULL, record->account);
        } else if (match->verdict == BSLAM_VERDICT_DEFER) {
            fill_account(record->account, BSLAM_OUTCOME_DEFERRED, match->reason, NULL);
        } else if (match->verdict == BSLAM_VERDICT_MATCH) {
            take_innovation(slam, mount, gate_d2, record);
        }
    }
}

static void fuse(bslam_slam_t *slam, int64_t time_us, int count)
{
    for (int i = 0; i < count; i++) {
        bslam_record_t *record = &slam->records[i];
        if (record->match.verdict == BSLAM_VERDICT_TENTATIVE) {
            count_tentative(slam, time_us, record);
        } else if (record->match.verdict == BSLAM_VERDICT_MATCH) {
            fuse_match(slam, time_us, record);
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

static void augment(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount, int count)
{
    for (int i = 0; i < count; i++) {
        const bslam_record_t *record = &slam->records[i];
        if (record->match.verdict == BSLAM_VERDICT_NEW && slam->is_frozen) {
            reject(slam, BSLAM_REASON_FROZEN, NULL, record->account);
        } else if (record->match.verdict == BSLAM_VERDICT_NEW) {
            add_new(slam, time_us, mount, record);
        }
    }
}

/// Not to be inlined: association, before it, goes deepest, and would have its frame on the stack.
__attribute__((noinline)) static void use_matches(bslam_slam_t *slam, int64_t time_us,
                                                  const bslam_pose_t *mount, int count)
{
    measure(slam, time_us, mount, count);
    fuse(slam, time_us, count);
    correct(slam, count);
    augment(slam, time_us, mount, count);
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
static void tidy(bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount)
{
    if (!slam->is_lost) {
        tidy_map(slam, time_us, mount);
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
                                     int count, bslam_pose_t *mount)
{
    int64_t behind_us;
    const bslam_status_t status = bslam_slam_check_frame(slam, time_us, sightings, count, &behind_us);
    if (status != BSLAM_OK) {
        slam->counters.frames_refused++;
        return status;
    }
    bslam_slam_predict_until(slam, behind_us > 0 ? behind_us : 0);
    *mount = mount_of_frame(slam, behind_us);
    return BSLAM_OK;
}

static void withhold(bslam_slam_t *slam, int count)
{
    for (int i = 0; i < count; i++) {
        fill_account(&slam->accounts[i], BSLAM_OUTCOME_DEFERRED, BSLAM_REASON_LOST, NULL);
    }
}

void bslam_slam_close_frame(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count,
                            const bslam_pose_t *mount, bool use)
{
    if (use && !slam->is_lost) {
        associate(slam, time_us, mount, sightings, count);
        bslam_slam_mark_tentative(slam, count);
        use_matches(slam, time_us, mount, count);  // measure, fuse, correct, augment
        learn(slam, time_us, sightings, count);
    } else {
        withhold(slam, count);
    }
    tidy(slam, time_us, mount);
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
