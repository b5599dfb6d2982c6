// A frame from its arrival to its end: checked, taken by each hypothesis, learned from.
#include "bslam/association/missed_beacons.h"
#include "bslam/model/pose.h"
#include "bslam/slam/doubt.h"
#include "bslam/slam/slam_internal.h"

static const bslam_real_t SECONDS_PER_US = BSLAM_R(1e-6);
// A sighting that is not used says nothing between two hypotheses.
static const bslam_real_t UNUSED = BSLAM_R(1e30);

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

// ---- hypotheses -------------------------------------------------------------------------------------------

/// Whether a match is a choice: of a beacon, or a new one.
static bool is_made(const bslam_match_t *match)
{
    return match->verdict == BSLAM_VERDICT_MATCH || match->verdict == BSLAM_VERDICT_NEW;
}

/// What a hypothesis pays for each sighting, in nats.
static void note_costs(const bslam_slam_t *slam, int count, bslam_real_t *cost)
{
    for (int i = 0; i < count; i++) {
        const bslam_match_t *match = &slam->records[i].match;
        cost[i] = is_made(match) ? -match->log_density : UNUSED;
        if (match->verdict == BSLAM_VERDICT_MATCH && bslam_slam_learns(slam)) {
            const bslam_beacon_appearance_t *of = &slam->appearance->of[match->beacon];
            cost[i] -= bslam_slam_view_gain(of, match->looks);
            cost[i] += match->slipped && of->view_frames == 0 ? BSLAM_SLIP_NATS : 0;
        }
    }
}

/// What a frame says between another hypothesis and the one in force. Errors hang together, so that a match
/// says a part of it; that a beacon is new is said once, in full.
static void compare(const bslam_slam_t *slam, bslam_hypothesis_t *other, const bslam_real_t *cost, int count)
{
    const bslam_real_t share = bslam_slam_evidence_share(slam);
    for (int i = 0; i < count; i++) {
        if (cost[i] < UNUSED && other->cost[i] < UNUSED) {
            const bool is_new = slam->records[i].match.verdict == BSLAM_VERDICT_NEW || other->is_new[i];
            other->behind += (is_new ? 1 : share) * (other->cost[i] - cost[i]);
        }
    }
}

/// A new beacon that may be a known one waits, unless another hypothesis takes it for that: sighting `but`.
static void wait_with_new(bslam_slam_t *slam, int count, int but)
{
    for (int i = 0; i < count; i++) {
        bslam_match_t *match = &slam->records[i].match;
        if (match->verdict == BSLAM_VERDICT_NEW && i != but && match->lead < slam->settings.doubt_nats) {
            match->verdict = BSLAM_VERDICT_DEFER;
            match->reason = BSLAM_REASON_APPEARANCE;
        }
    }
}

/// A frame as another hypothesis takes it. Counters are those of the one in force.
static void take_turn(bslam_slam_t *slam, bslam_hypothesis_t *hypothesis, const bslam_bar_t *bar,
                      const bslam_vantage_t *vantage, const bslam_sighting_t *sightings, int count)
{
    const bslam_slam_counters_t counters = slam->counters;
    bslam_hypothesis_exchange(slam, hypothesis);
    bslam_slam_associate(slam, vantage, sightings, count, bar);
    wait_with_new(slam, count, bar != NULL ? bar->sighting : -1);
    note_costs(slam, count, hypothesis->cost);
    for (int i = 0; i < count; i++) {
        hypothesis->is_new[i] = slam->records[i].match.verdict == BSLAM_VERDICT_NEW;
    }
    bslam_slam_use_associated(slam, vantage, count);
    bslam_slam_tidy_map(slam, vantage);
    bslam_hypothesis_exchange(slam, hypothesis);
    slam->counters = counters;
}

/// The sighting whose choice is the least sure, of those that come into view; -1: none is in doubt.
static int doubtful(const bslam_slam_t *slam, int64_t time_us, int count)
{
    int least = -1;
    for (int i = 0; i < count; i++) {
        const bslam_match_t *match = &slam->records[i].match;
        const bool is_new = match->verdict == BSLAM_VERDICT_NEW;
        const bool comes =
            is_new || (match->verdict == BSLAM_VERDICT_MATCH &&
                       time_us - slam->ekf.beacons[match->beacon].last_seen_us > BSLAM_VIEW_US);
        if (comes && match->lead < slam->settings.doubt_nats &&
            (least < 0 || match->lead < slam->records[least].match.lead)) {
            least = i;
        }
    }
    return least;
}

/// Whether there is room for another one. One that is farther behind than it would be makes room.
static bool has_room(bslam_slam_t *slam, bslam_real_t behind)
{
    const int most =
        slam->settings.hypotheses < BSLAM_HYPOTHESES_MAX ? slam->settings.hypotheses : BSLAM_HYPOTHESES_MAX;
    if (slam->doubts->count + 1 >= most) {
        bslam_slam_forget_worst(slam, behind);
    }
    return slam->doubts->count + 1 < most;
}

/// Begins a hypothesis for every other choice of a sighting that is near enough to the one in force. False:
/// there is room for none.
static bool branch(bslam_slam_t *slam, const bslam_vantage_t *vantage, const bslam_sighting_t *sightings,
                   int count, int i)
{
    bslam_bar_t bar = {.sighting = i};
    const bslam_match_t *match = &slam->records[i].match;
    bslam_real_t gap = match->lead;
    while (gap < slam->settings.doubt_nats && (is_made(match) || match->verdict == BSLAM_VERDICT_TENTATIVE) &&
           has_room(slam, gap)) {
        bslam_hypothesis_t *other = &slam->doubts->others[slam->doubts->count];
        bar.choices[bar.count++] = match->beacon;
        bslam_hypothesis_copy(slam, other);
        other->since_us = vantage->moment_us;
        other->behind = 0;
        slam->doubts->count++;
        bslam_hypotheses_share(slam);
        take_turn(slam, other, &bar, vantage, sightings, count);
        gap += match->lead;
    }
    return bar.count > 0;
}

/// bslam_slam_associate for the hypothesis in force, once the others have taken the frame. A doubtful choice
/// begins another one.
static void follow_doubts(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                          const bslam_sighting_t *sightings, int count)
{
    if (!bslam_slam_can_doubt(slam)) {
        bslam_slam_associate(slam, vantage, sightings, count, NULL);
        return;
    }
    bslam_doubts_t *doubts = slam->doubts;
    const int64_t time_us = vantage->moment_us;
    doubts->is_exact = doubts->count > 0;
    for (int k = 0; k < doubts->count; k++) {
        take_turn(slam, &doubts->others[k], NULL, vantage, sightings, count);
    }
    bslam_slam_associate(slam, vantage, sightings, count, NULL);
    const int i = doubtful(slam, time_us, count);
    const bool begins = i >= 0 && branch(slam, vantage, sightings, count, i);
    if (begins) {
        bslam_slam_associate(slam, vantage, sightings, count, NULL);
    }
    wait_with_new(slam, count, begins ? i : -1);
    bslam_real_t cost[BSLAM_SIGHTINGS_MAX];
    note_costs(slam, count, cost);
    for (int k = 0; k < doubts->count; k++) {
        compare(slam, &doubts->others[k], cost, count);
    }
}

// ---- learning ---------------------------------------------------------------------------------------------

static void learn(bslam_slam_t *slam, int64_t time_us, const bslam_sighting_t *sightings, int count)
{
    if (!bslam_slam_learns(slam) || slam->is_frozen) {
        return;
    }
    if (bslam_slam_doubts(slam) > 0) {  // nothing new is learned, but what is known may be finished
        (void)bslam_learner_work(&slam->appearance->learner, slam->settings.learn_budget);
        return;
    }
    bool all_matched = count > 0;
    for (int i = 0; i < count; i++) {
        const bslam_account_t *account = slam->records[i].account;
        const bool is_new = account->outcome == BSLAM_OUTCOME_NEW;
        const bool is_matched =
            account->outcome == BSLAM_OUTCOME_MATCHED || bslam_slam_was_tentative(account);
        all_matched = all_matched && is_matched;
        if (!is_new && !is_matched) {
            continue;
        }
        const int index = bslam_slam_find_beacon(slam, account->beacon_uid);
        if (is_new || slam->records[i].match.sure) {
            bslam_appearance_train(slam->appearance, index, slam->ekf.beacon_count, slam->travelled_um,
                                   &sightings[i]);
        } else {
            slam->appearance->counters.unsure++;
        }
    }
    const int missed = bslam_missed_beacons_find(slam->appearance, &slam->ekf, &slam->settings, time_us,
                                                 slam->travelled_um, all_matched);
    if (missed != BSLAM_NO_MISSED_BEACON) {
        bslam_slam_drop_beacon(slam, missed);
    }
    (void)bslam_learner_work(&slam->appearance->learner, slam->settings.learn_budget);
}

// ---- the two halves ---------------------------------------------------------------------------------------

/// Time passes in a withheld frame, too: it leaves what one without sightings does.
static void tidy(bslam_slam_t *slam, const bslam_vantage_t *vantage)
{
    if (!slam->is_lost) {
        bslam_slam_tidy_map(slam, vantage);
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
        bslam_slam_fill_account(&slam->accounts[i], BSLAM_OUTCOME_DEFERRED, BSLAM_REASON_LOST, NULL);
    }
}

void bslam_slam_close_frame(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                            const bslam_sighting_t *sightings, int count, bool use)
{
    if (use && !slam->is_lost) {
        bslam_slam_settle_doubts(slam, vantage->moment_us);
        follow_doubts(slam, vantage, sightings, count);
        bslam_slam_use_associated(slam, vantage, count);
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
