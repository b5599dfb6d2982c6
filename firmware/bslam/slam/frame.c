// A frame as one hypothesis takes it: associated, fused, tidied up.
#include "base/trig.h"
#include "bslam/association/duplicates.h"
#include "bslam/model/noise.h"
#include "bslam/model/pose.h"
#include "bslam/settings_internal.h"
#include "bslam/slam/doubt.h"
#include "bslam/slam/slam_internal.h"

static const bslam_real_t MICROMETRES_PER_M = BSLAM_R(1e6);
// Of a view so many frames speak of appearance: they err together.
enum { VIEW_FRAMES = 5 };
// A heading is far in doubt beyond ten degrees; after so many steps it is not.
static const bslam_real_t TURNED_VAR_RAD2 = BSLAM_R(0.03);
enum { STEPS_MAX = 4 };

// ---- from where a frame was taken -------------------------------------------------------------------------

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

void bslam_slam_fill_account(bslam_account_t *account, bslam_outcome_t outcome, bslam_reason_t reason,
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
    bslam_slam_fill_account(account, BSLAM_OUTCOME_REJECTED, reason, beacon);
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
    const bool is_again = bslam_slam_confirm_again(slam, beacon, time_us);
    beacon->last_seen_us = time_us;
    if (!is_again) {
        bslam_slam_confirm_match(slam, beacon, sighting, distance2);
    }
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
    bslam_slam_fill_account(record->account, BSLAM_OUTCOME_DEFERRED, BSLAM_REASON_TENTATIVE, beacon);
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
    bslam_slam_fill_account(account, BSLAM_OUTCOME_MATCHED, BSLAM_REASON_NONE, beacon);
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
    bslam_slam_fill_account(account, BSLAM_OUTCOME_NEW, BSLAM_REASON_NONE, beacon);
    account->weight = 1;
}

/// The gate of a frame. By likelihood, where for a while nothing has been where it should be, it is the pose
/// that errs: all that association takes for a candidate is used.
static bslam_real_t gate_of(const bslam_slam_t *slam, int64_t time_us)
{
    const bslam_settings_t *settings = &slam->settings;
    const bool opens = bslam_weighs_likelihood(settings) && settings->gate_d2 > 0 &&
                       settings->gate_d2 < settings->candidate_d2 &&
                       !bslam_is_placed(&slam->ekf, BSLAM_VIEW_US, -1, time_us);
    return opens ? settings->candidate_d2 : settings->gate_d2;
}

// ---- the stages, in their order: bslam_slam_close_frame ---------------------------------------------------

/// What comes into view is looked at anew.
static void begin_views(bslam_slam_t *slam, int64_t time_us, int count)
{
    for (int i = 0; i < count && bslam_slam_learns(slam); i++) {
        const bslam_match_t *match = &slam->records[i].match;
        if (match->verdict == BSLAM_VERDICT_MATCH &&
            (uint32_t)time_us - slam->appearance->of[match->beacon].viewed_us > BSLAM_VIEW_US) {
            slam->appearance->of[match->beacon].view_frames = 0;
            slam->appearance->of[match->beacon].view_looks = 0;
        }
    }
}

void bslam_slam_associate(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                          const bslam_sighting_t *sightings, int count, const bslam_bar_t *bar)
{
    const bslam_sighting_frame_t frame = {.ekf = &slam->ekf,
                                          .settings = &slam->settings,
                                          .appearance = slam->appearance,
                                          .mount = &vantage->mount,
                                          .sightings = sightings,
                                          .count = count,
                                          .time_us = vantage->moment_us,
                                          .bar = bar,
                                          .is_exact = bslam_slam_doubts(slam) > 0 && slam->doubts->is_exact};
    for (int i = 0; i < count; i++) {
        slam->records[i].sighting = &sightings[i];
        slam->records[i].account = &slam->accounts[i];
    }
    const bslam_associate_fn method = bslam_associate_method(&slam->settings);
    method(&frame, slam->records);
    begin_views(slam, vantage->moment_us, count);
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

/// What a match shows, from where the frame was taken.
static bslam_status_t innovation_of(const bslam_slam_t *slam, const bslam_vantage_t *vantage,
                                    const bslam_record_t *record, bslam_innovation_t *innovation)
{
    const int index = record->match.beacon;
    bslam_sighting_t taken = bslam_ekf_taken_as(&slam->ekf.beacons[index], record->sighting);
    doubt(slam, vantage, &taken);
    return bslam_ekf_innovation(&slam->ekf, &slam->settings, &vantage->mount, &taken, index, innovation);
}

static void take_innovation(bslam_slam_t *slam, const bslam_vantage_t *vantage, bslam_real_t gate_d2,
                            bslam_record_t *record)
{
    bslam_match_t *match = &record->match;
    bslam_innovation_t *innovation = &record->innovation;
    const bslam_beacon_t *beacon = &slam->ekf.beacons[match->beacon];
    if (innovation_of(slam, vantage, record, innovation) != BSLAM_OK) {
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
    choose_distances(slam, &vantage->mount, count);
    const bslam_real_t gate_d2 = gate_of(slam, vantage->moment_us);
    for (int i = 0; i < count; i++) {
        bslam_record_t *record = &slam->records[i];
        bslam_match_t *match = &record->match;
        if (match->verdict == BSLAM_VERDICT_REJECT) {
            reject(slam, match->reason, NULL, record->account);
        } else if (match->verdict == BSLAM_VERDICT_DEFER) {
            bslam_slam_fill_account(record->account, BSLAM_OUTCOME_DEFERRED, match->reason, NULL);
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

/// Of others a vote decides, once, what a distance is used for.
static bool has_one_distance(const bslam_beacon_t *beacon)
{
    return beacon->kind == BSLAM_BEACON_POINT || beacon->kind == BSLAM_BEACON_KNOWN;
}

/// A step towards a heading that is far in doubt: matches at a part of their worth. False: none goes
/// anywhere.
static bool take_step(bslam_slam_t *slam, const bslam_vantage_t *vantage, int count)
{
    const bslam_real_t gate_d2 = gate_of(slam, vantage->moment_us);
    bool moves = false;
    for (int i = 0; i < count; i++) {
        bslam_record_t *record = &slam->records[i];
        bslam_innovation_t *innovation = &record->innovation;
        innovation->has_range = record->match.verdict == BSLAM_VERDICT_MATCH &&
                                has_one_distance(&slam->ekf.beacons[record->match.beacon]) &&
                                innovation_of(slam, vantage, record, innovation) == BSLAM_OK &&
                                innovation->has_range && bslam_ekf_soften(&slam->ekf, innovation);
        innovation->gate_d2 = gate_d2;
    }
    for (int i = 0; i < count; i++) {
        const bslam_innovation_t *innovation = &slam->records[i].innovation;
        bslam_fusion_t fusion;
        if (innovation->has_range) {
            moves = bslam_ekf_fuse(&slam->ekf, &slam->settings, innovation, &fusion) == BSLAM_OK || moves;
        }
    }
    bslam_ekf_correct(&slam->ekf, &slam->settings);
    return moves;
}

/// Each step looks at the matches from where the last one led. MATH "Which beacon is it".
static void approach(bslam_slam_t *slam, const bslam_vantage_t *vantage, int count)
{
    bool moves = slam->settings.filter != BSLAM_FILTER_STANDARD &&
                 bslam_ekf_covariance(&slam->ekf, BSLAM_STATE_THETA, BSLAM_STATE_THETA) > TURNED_VAR_RAD2;
    for (int step = 0; step < STEPS_MAX && moves; step++) {
        moves = take_step(slam, vantage, count);
    }
}

/// Not to be inlined: association, before it, goes deepest, and would have its frame on the stack.
__attribute__((noinline)) static void use_matches(bslam_slam_t *slam, const bslam_vantage_t *vantage,
                                                  int count)
{
    approach(slam, vantage, count);
    measure(slam, vantage, count);
    bslam_slam_doubt_sightings(slam, count);
    fuse(slam, vantage, count);
    bslam_slam_note_misfit(slam, count);
    correct(slam, count);
    augment(slam, vantage, count);
}

// ---- views ------------------------------------------------------------------------------------------------

bool bslam_slam_was_tentative(const bslam_account_t *account)
{
    return account->reason == BSLAM_REASON_TENTATIVE && account->has_beacon;
}

bslam_real_t bslam_slam_view_gain(const bslam_beacon_appearance_t *of, bslam_real_t looks)
{
    return of->view_frames < VIEW_FRAMES ? (looks - of->view_looks) / (bslam_real_t)(of->view_frames + 1) : 0;
}

/// In how many frames of its view a beacon was matched, as far as they count; used or not.
static void count_views(bslam_slam_t *slam, int64_t time_us, int count)
{
    for (int i = 0; i < count && bslam_slam_learns(slam); i++) {
        const bslam_match_t *match = &slam->records[i].match;
        if (match->beacon >= 0 &&
            (match->verdict == BSLAM_VERDICT_MATCH || match->verdict == BSLAM_VERDICT_TENTATIVE)) {
            bslam_beacon_appearance_t *of = &slam->appearance->of[match->beacon];
            of->viewed_us = (uint32_t)time_us;
            of->view_looks += (float)bslam_slam_view_gain(of, match->looks);
            of->view_frames = (uint8_t)(of->view_frames + (of->view_frames < VIEW_FRAMES ? 1 : 0));
        }
    }
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
    // Of a detector with scores it is these that speak against it; what only was not seen for long enough may
    // be seen again.
    if (window_us == 0 || beacon->has_scores || beacon->views >= settings->confirm_sightings ||
        time_us - beacon->first_seen_us <= window_us) {
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

/// Of two beacons in one place one leaves, where identity is not known.
static void drop_duplicate(bslam_slam_t *slam, int64_t time_us)
{
    if (!bslam_weighs_likelihood(&slam->settings) || slam->is_frozen) {
        return;
    }
    const int leaves = bslam_duplicates_settle(&slam->ekf, &slam->settings, time_us);
    if (leaves != BSLAM_NO_DUPLICATE) {
        bslam_slam_drop_beacon(slam, leaves);
        slam->counters.retired++;
    }
}

/// Rays whose distance is known become points; tentative beacons whose time is up leave.
void bslam_slam_tidy_map(bslam_slam_t *slam, const bslam_vantage_t *vantage)
{
    drop_duplicate(slam, vantage->moment_us);
    for (int b = slam->ekf.beacon_count - 1; b >= 0; b--) {
        const bslam_beacon_t *beacon = &slam->ekf.beacons[b];
        if (is_unconfirmed(&slam->settings, beacon, vantage->moment_us)) {
            bslam_slam_drop_beacon(slam, b);
            slam->counters.removed++;
        } else if (beacon->kind == BSLAM_BEACON_RAY &&
                   bslam_ekf_settle_ray(&slam->ekf, &slam->settings, &vantage->mount, b)) {
            slam->counters.settled++;
        }
    }
    if (slam->confirmed_now) {
        drop_competitors(slam);
    }
}

void bslam_slam_use_associated(bslam_slam_t *slam, const bslam_vantage_t *vantage, int count)
{
    bslam_slam_mark_tentative(slam, count);
    use_matches(slam, vantage, count);  // measure, fuse, correct, augment
    count_views(slam, vantage->moment_us, count);
}
