#include "bslam/recovery/recovery.h"

#include "base/bounds.h"
#include "base/trig.h"
#include "bslam/model/noise.h"
#include "bslam/model/pose.h"
#include "bslam/recovery/identity.h"
#include "bslam/slam/slam_internal.h"
#include "base/scalar.h"

// A sighting of a recognised beacon contradicts the pose beyond this squared distance. Rightly recognised
// ones are there once in 10^6.
static const bslam_real_t CONTRADICT_D2 = BSLAM_R(30.0);
// It agrees with the pose up to this one. One that was not recognised agrees if it is as near to any beacon.
static const bslam_real_t FIT_D2 = BSLAM_R(9.0);
// A fix carried on is the same as a later one within this and both doubts.
static const bslam_real_t SAME_PLACE_M = BSLAM_R(0.25);
static const bslam_real_t SAME_HEADING_RAD = BSLAM_R(0.15);
// Of the distance travelled since a clue was seen.
static const bslam_real_t TRAVEL_SD = BSLAM_R(0.15);
// The fix's doubt is that of its clues, which share the beacons' errors and the travel since: so much wider.
static const bslam_real_t DOUBT_FACTOR = BSLAM_R(1.5);
static const bslam_real_t DOUBT_M = BSLAM_R(0.05);
static const bslam_real_t DOUBT_RAD = BSLAM_R(0.03);
static const bslam_real_t DOUBT_POSITION_MAX_M = BSLAM_R(1.5);
// By distances a better fix comes soon: so far one is waited for.
static const bslam_real_t BY_RANGES_MAX_M = BSLAM_R(1.0);
static const bslam_real_t DOUBT_HEADING_MAX_RAD = BSLAM_R(0.6);

enum {
    EVIDENCE_SEVERAL = 8,  ///< frames that contradict, less those that agree, until the robot is lost,
    EVIDENCE_ONE = 25,     ///< if all show the same beacon, or with those that say neither, once several did
    SILENT_ONE = 8,  ///< frames in which nothing is recognised, which end a doubt that one beacon raised
    CLUE_AGE_US = 5000000,       ///< odometry carries a clue so long,
    DIRECTION_AGE_US = 3000000,  ///< or this, for three directions give a pose as if taken from here
    FIX_AGE_US = 1000000,
    ELSEWHERE_BEACONS = 4,  ///< beacons that another pose has more than the present one, in a map that grows,
    ELSEWHERE_FRAMES = 3,   ///< in as many frames: the robot is there
    CONFIRMED_BY_THIRD = 2,  ///< frames with the same fix, where three beacons agree,
    CONFIRMED_BY_TIME = 8    ///< or fewer than one more than a fix needs
};

void bslam_recovery_restart(bslam_recovery_t *recovery)
{
    *recovery = (bslam_recovery_t){.counters = recovery->counters};
}

bslam_recovery_state_t bslam_recovery_state(const bslam_recovery_t *recovery, const bslam_slam_t *slam)
{
    if (slam->is_lost) {
        return BSLAM_RECOVERY_LOST;
    }
    return recovery->evidence > 0 ? BSLAM_RECOVERY_DOUBTING : BSLAM_RECOVERY_FOLLOWING;
}

/// A frame, and which beacon each of its sightings is recognised as.
typedef struct view {
    bslam_vantage_t vantage;
    const bslam_sighting_t *sightings;
    int count, who[BSLAM_SIGHTINGS_MAX];
} view_t;

// ---- clues ------------------------------------------------------------------------------------------------

static bslam_real_t heading_var(const bslam_ekf_t *ekf)
{
    return bslam_ekf_covariance(ekf, BSLAM_STATE_THETA, BSLAM_STATE_THETA);
}

/// Sighting `i` of a frame, to be remembered.
static bslam_memory_t memorise(const bslam_slam_t *slam, const view_t *view, int i)
{
    bslam_memory_t memory = {.uid = slam->ekf.beacons[view->who[i]].uid,
                             .time_us = view->vantage.moment_us,
                             .sighting = view->sightings[i],
                             .mount = view->vantage.mount,
                             .robot = bslam_ekf_pose(&slam->ekf),
                             .heading_var_rad2 = heading_var(&slam->ekf)};
    memory.sighting.signature = NULL;
    return memory;
}

static bslam_real_t growth(bslam_real_t now, bslam_real_t then)
{
    return now > then ? now - then : 0;
}

/// The distance of a remembered sighting: a sized beacon's by its scale, with that scale's doubt; what the
/// scale of another may be is all doubt.
static void make_distance(const bslam_slam_t *slam, const bslam_beacon_t *beacon,
                          const bslam_sighting_t *sighting, bslam_clue_t *clue)
{
    const bslam_ekf_t *ekf = &slam->ekf;
    const bool is_sized = beacon->kind == BSLAM_BEACON_SIZED;
    const int at = beacon->at + BSLAM_POINT_DIM;
    bslam_real_t scale = is_sized ? ekf->mean[at] : 1;
    bslam_real_t scale_var =
        is_sized ? bslam_ekf_covariance(ekf, at, at) : bslam_unknown_scale_var(&slam->settings, sighting);
    if (beacon->known_scale > 0) {
        scale = beacon->known_scale;
        scale_var = 0;
    }
    clue->range_m = sighting->range_m / scale;
    clue->range_var_m2 = bslam_scaled_range_variance_m2(&slam->settings, sighting, clue->range_m, scale_var);
}

/// A remembered sighting, taken for a beacon, as it is from where the robot is now, by odometry.
static bslam_clue_t clue_of(const bslam_slam_t *slam, const bslam_memory_t *memory, int beacon)
{
    const bslam_ekf_t *ekf = &slam->ekf;
    const bslam_pose_t now = bslam_ekf_pose(ekf);
    const bslam_pose_t to_now = bslam_pose_inverse(&now);
    const bslam_pose_t robot = bslam_pose_compose(&to_now, &memory->robot);
    const bslam_sighting_t *sighting = &memory->sighting;
    bslam_clue_t clue = {.beacon = beacon,
                         .sensor = bslam_pose_compose(&robot, &memory->mount),
                         .bearing_rad = sighting->bearing_rad,
                         .has_range = sighting->has_range};
    bslam_ekf_beacon_position(ekf, beacon, &clue.x_m, &clue.y_m);
    const bslam_sym2_t place = bslam_ekf_beacon_covariance(ekf, beacon);
    const bslam_real_t turn_var = growth(heading_var(ekf), memory->heading_var_rad2);
    const bslam_real_t travel2_m2 = robot.x_m * robot.x_m + robot.y_m * robot.y_m;
    // A heading that drifts evenly bends the path by its deviation over the root of 3.
    const bslam_real_t drift_m2 =
        travel2_m2 * (TRAVEL_SD * TRAVEL_SD + turn_var / 3) + (place.xx + place.yy) / 2;
    const bslam_real_t range_m = sighting->has_range && sighting->range_m > 1 ? sighting->range_m : 1;
    clue.bearing_var_rad2 =
        bslam_bearing_variance_rad2(&slam->settings, sighting) + turn_var + drift_m2 / (range_m * range_m);
    if (sighting->has_range) {
        make_distance(slam, &ekf->beacons[beacon], sighting, &clue);
        clue.range_var_m2 += drift_m2;
    }
    return clue;
}

/// Adds the clues that a sighting is: one for each beacon that it may show. None if there is no room for all.
static int add_clues(const bslam_slam_t *slam, const bslam_memory_t *memory, bslam_clue_t *clues, int count)
{
    const int who = bslam_slam_find_beacon(slam, memory->uid);
    int added = 0;
    for (int b = 0; b < slam->ekf.beacon_count && who >= 0; b++) {
        if (bslam_may_be(slam, who, b)) {
            if (count + added == BSLAM_CLUES_MAX) {
                return count;
            }
            clues[count + added] = clue_of(slam, memory, b);
            clues[count + added].is_other = added > 0;
            added++;
        }
    }
    return count + added;
}

/// All that is remembered as clues. Returns how many.
static int recall(const bslam_recovery_t *recovery, const bslam_slam_t *slam, bslam_clue_t *clues)
{
    int count = 0;
    for (int m = 0; m < recovery->memory_count; m++) {
        count = add_clues(slam, &recovery->memories[m], clues, count);
    }
    return count;
}

// ---- noticing ---------------------------------------------------------------------------------------------

/// What a frame says of the pose.
typedef struct tally {
    int agreeing, contradicting, recognised;
    uint32_t uid;  ///< of one that contradicts
} tally_t;

/// Squared distance of a sighting from a beacon; negative: it has none.
static bslam_real_t distance2_of(const bslam_slam_t *slam, const bslam_pose_t *mount,
                                 const bslam_sighting_t *sighting, int beacon)
{
    return bslam_ekf_sighting_distance2(&slam->ekf, &slam->settings, mount, sighting, beacon);
}

/// Of the beacons that a sighting may show, the squared distance from the nearest; -1: it has none.
static bslam_real_t nearest2_of(const bslam_slam_t *slam, const bslam_pose_t *mount,
                                const bslam_sighting_t *sighting, int who)
{
    bslam_real_t nearest = -1;
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        if (bslam_may_be(slam, who, b)) {
            const bslam_real_t distance2 = distance2_of(slam, mount, sighting, b);
            nearest = nearest < 0 || (distance2 >= 0 && distance2 < nearest) ? distance2 : nearest;
        }
    }
    return nearest;
}

/// Whether a sighting stands where any beacon is.
static bool fits_any(const bslam_slam_t *slam, const bslam_pose_t *mount, const bslam_sighting_t *sighting)
{
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        if (slam->ekf.beacons[b].confirmed &&
            bslam_in_range(distance2_of(slam, mount, sighting, b), 0, FIT_D2)) {
            return true;
        }
    }
    return false;
}

/// What was recognised agrees or contradicts. What stands where some beacon is agrees, too: it may be that
/// one. But not in doubt: then the pose is odometry's alone and grows vague, by which anything stands
/// somewhere.
static tally_t weigh(const bslam_recovery_t *recovery, const bslam_slam_t *slam, const view_t *view)
{
    const bool in_doubt = recovery->evidence > 0;
    tally_t verdict = {0, 0, 0, 0};
    for (int i = 0; i < view->count; i++) {
        const bslam_sighting_t *sighting = &view->sightings[i];
        const int who = view->who[i];
        const bslam_real_t distance2 = who >= 0 ? nearest2_of(slam, &view->vantage.mount, sighting, who) : -1;
        verdict.recognised += who >= 0 ? 1 : 0;
        if (bslam_in_range(distance2, 0, FIT_D2)) {
            verdict.agreeing++;
        } else if (who < 0) {
            verdict.agreeing += !in_doubt && fits_any(slam, &view->vantage.mount, sighting) ? 1 : 0;
        } else if (distance2 > CONTRADICT_D2 &&
                   (in_doubt || !fits_any(slam, &view->vantage.mount, sighting))) {
            verdict.contradicting++;
            verdict.uid = slam->ekf.beacons[who].uid;
        }
    }
    return verdict;
}

/// Whether there is a pose by which all that was recognised in a frame is where it is seen.
static bool fits_elsewhere(const bslam_slam_t *slam, const view_t *view)
{
    bslam_clue_t clues[BSLAM_CLUES_MAX];
    int clue_count = 0;
    for (int i = 0; i < view->count; i++) {
        if (view->who[i] >= 0) {
            const bslam_memory_t memory = memorise(slam, view, i);
            clue_count = add_clues(slam, &memory, clues, clue_count);
        }
    }
    bslam_fix_t fix;
    return bslam_relocate(clues, clue_count, &fix) && fix.dissenting == 0;
}

static void get_lost(bslam_recovery_t *recovery, bslam_slam_t *slam)
{
    for (int b = slam->ekf.beacon_count - 1; b >= 0; b--) {
        const bslam_beacon_t *beacon = &slam->ekf.beacons[b];
        if (beacon->kind != BSLAM_BEACON_KNOWN && beacon->first_seen_us >= recovery->doubted_us) {
            const bslam_status_t removed = bslam_slam_remove_beacon(slam, beacon->uid);
            (void)removed;  // it is there
        }
    }
    const bslam_real_t known_var_rad2 = heading_var(&slam->ekf);
    bslam_slam_lose_pose(slam);
    for (int m = 0; m < recovery->memory_count; m++) {  // odometry's doubt begins anew
        recovery->memories[m].heading_var_rad2 -= known_var_rad2;
    }
    recovery->counters.lost++;
    recovery->evidence = 0;
}

static void add_evidence(bslam_recovery_t *recovery, const tally_t *verdict, int64_t time_us)
{
    if (recovery->evidence == 0) {
        recovery->doubted_us = time_us;
        recovery->doubted_uid = verdict->uid;
        recovery->several = false;
        recovery->undecided = 0;
    }
    recovery->silent = 0;
    recovery->several =
        recovery->several || verdict->contradicting > 1 || verdict->uid != recovery->doubted_uid;
    recovery->evidence++;
}

/// A frame that does not speak against the pose. A doubt that one beacon raised ends when another agrees,
/// since then it is that one that is odd; and when nothing was recognised for a moment.
static void doubt_less(bslam_recovery_t *recovery, bslam_slam_t *slam, const tally_t *verdict)
{
    if (verdict->agreeing > verdict->contradicting) {
        recovery->evidence--;
        return;
    }
    const bool is_silent = verdict->recognised == 0;
    recovery->silent += is_silent ? 1 : 0;
    recovery->undecided += recovery->several || !is_silent ? 1 : 0;
    if (!recovery->several && (verdict->agreeing > 0 || recovery->silent >= SILENT_ONE)) {
        recovery->evidence = 0;
    } else if (recovery->undecided + recovery->evidence >= EVIDENCE_ONE) {
        get_lost(recovery, slam);
    }
}

/// True if the frame may be used. In doubt it may not, unless more agree: a kidnapped robot would learn from
/// it that its beacons are new ones.
static bool notice(bslam_recovery_t *recovery, bslam_slam_t *slam, int64_t time_us, const tally_t *verdict)
{
    recovery->counters.contradicting += (uint32_t)verdict->contradicting;
    if (verdict->contradicting > verdict->agreeing) {
        add_evidence(recovery, verdict, time_us);
        if (recovery->evidence >= (recovery->several ? EVIDENCE_SEVERAL : EVIDENCE_ONE)) {
            get_lost(recovery, slam);
        }
        return false;
    }
    if (recovery->evidence > 0) {
        doubt_less(recovery, slam, verdict);
    }
    return !slam->is_lost && (recovery->evidence == 0 || verdict->agreeing > verdict->contradicting);
}

// ---- finding ----------------------------------------------------------------------------------------------

/// Of each beacon the newest with a distance is kept, and the newest without: that is a rough one at a
/// frame's edge, often, which is no match for the other.
static bslam_memory_t *memory_for(bslam_recovery_t *recovery, uint32_t uid, bool has_range)
{
    int oldest = 0;
    for (int m = 0; m < recovery->memory_count; m++) {
        if (recovery->memories[m].uid == uid && recovery->memories[m].sighting.has_range == has_range) {
            return &recovery->memories[m];
        }
        oldest = recovery->memories[m].time_us < recovery->memories[oldest].time_us ? m : oldest;
    }
    if (recovery->memory_count < BSLAM_CLUES_MAX) {
        return &recovery->memories[recovery->memory_count++];
    }
    return &recovery->memories[oldest];
}

static void forget_old(bslam_recovery_t *recovery, const bslam_slam_t *slam, int64_t time_us)
{
    int kept = 0;
    for (int m = 0; m < recovery->memory_count; m++) {
        const bslam_memory_t *memory = &recovery->memories[m];
        const int64_t age_us = memory->sighting.has_range ? CLUE_AGE_US : DIRECTION_AGE_US;
        if (bslam_slam_find_beacon(slam, memory->uid) >= 0 && time_us - memory->time_us <= age_us) {
            recovery->memories[kept] = *memory;
            kept++;
        }
    }
    recovery->memory_count = kept;
}

static void forget_all(bslam_recovery_t *recovery)
{
    recovery->memory_count = 0;
    recovery->confirmed = 0;
    recovery->has_fix = false;
    recovery->has_contradicted = false;
}

/// Keeps the newest sightings of each recognised beacon. True if there is one.
static bool remember(bslam_recovery_t *recovery, const bslam_slam_t *slam, const view_t *view)
{
    bool any = false;
    for (int i = 0; i < view->count; i++) {
        if (view->who[i] >= 0) {
            const bslam_memory_t memory = memorise(slam, view, i);
            *memory_for(recovery, memory.uid, memory.sighting.has_range) = memory;
            any = true;
        }
    }
    return any;
}

/// Whether a fix is the one before it, carried on by odometry. The fix before is held as where the map is in
/// the frame of odometry.
static bool is_same(const bslam_recovery_t *recovery, const bslam_pose_t *robot, const bslam_fix_t *fix,
                    int64_t time_us)
{
    if (!recovery->has_fix || time_us - recovery->fix_us > FIX_AGE_US) {
        return false;
    }
    const bslam_pose_t carried = bslam_pose_compose(&recovery->last_fix, robot);
    const bslam_real_t dx = carried.x_m - fix->pose.x_m, dy = carried.y_m - fix->pose.y_m;
    const bslam_real_t turn = bslam_abs(bslam_angle_wrap(carried.theta_rad - fix->pose.theta_rad));
    const bslam_real_t place = SAME_PLACE_M + 2 * fix->position_sd_m;
    return dx * dx + dy * dy <= place * place && turn <= SAME_HEADING_RAD + 2 * fix->heading_sd_rad;
}

/// Clues that a fix has beyond those that any pose could have met.
static bool is_verified(const bslam_fix_t *fix)
{
    return fix->beacons > (fix->with_range >= 2 ? 2 : 3);
}

static bool is_clear(const bslam_fix_t *fix)
{
    const bslam_real_t most_m = fix->with_range >= 2 ? BY_RANGES_MAX_M : DOUBT_POSITION_MAX_M;
    return fix->agreeing > 2 * fix->dissenting && fix->position_sd_m <= most_m &&
           fix->heading_sd_rad <= DOUBT_HEADING_MAX_RAD;
}

/// Counts frames with the same fix.
static int32_t confirm(bslam_recovery_t *recovery, const bslam_slam_t *slam, const bslam_fix_t *fix,
                       int64_t time_us)
{
    const bslam_pose_t robot = bslam_ekf_pose(&slam->ekf);
    recovery->confirmed = is_same(recovery, &robot, fix, time_us) ? recovery->confirmed + 1 : 1;
    const bslam_pose_t back = bslam_pose_inverse(&robot);
    recovery->last_fix = bslam_pose_compose(&fix->pose, &back);
    recovery->has_fix = true;
    recovery->fix_us = time_us;
    return recovery->confirmed;
}

static bslam_real_t doubt(bslam_real_t sd, bslam_real_t least, bslam_real_t most)
{
    const bslam_real_t wide = DOUBT_FACTOR * sd + least;
    return wide < most ? wide : most;
}

/// Remembers who is seen in a frame that is not used. True if that confirms where the robot is: *fix.
static bool seek(bslam_recovery_t *recovery, const bslam_slam_t *slam, const view_t *view, bslam_fix_t *fix)
{
    if (!remember(recovery, slam, view)) {
        return false;
    }
    bslam_clue_t clues[BSLAM_CLUES_MAX];
    const int count = recall(recovery, slam, clues);
    return bslam_relocate(clues, count, fix) && is_clear(fix) &&
           confirm(recovery, slam, fix, view->vantage.moment_us) >=
               (is_verified(fix) ? CONFIRMED_BY_THIRD : CONFIRMED_BY_TIME);
}

static void be_found(bslam_recovery_t *recovery, bslam_slam_t *slam, const bslam_fix_t *fix)
{
    const bslam_status_t set =
        bslam_slam_set_pose(slam, &fix->pose, doubt(fix->position_sd_m, DOUBT_M, DOUBT_POSITION_MAX_M),
                            doubt(fix->heading_sd_rad, DOUBT_RAD, DOUBT_HEADING_MAX_RAD));
    if (set == BSLAM_OK) {
        recovery->counters.found++;
    }
}

// ---- a map that grows -------------------------------------------------------------------------------------

/// Notes when something began in the map. What a kept map was loaded with did not.
static void note_growth(bslam_recovery_t *recovery, const bslam_slam_t *slam, int64_t time_us)
{
    if (recovery->added != slam->counters.added) {
        recovery->added = slam->counters.added;
        recovery->has_grown = true;
        recovery->grew_us = time_us;
    }
}

/// Whether something began within `settled_us`, so that more may, and look like a beacon of the map.
static bool is_growing(const bslam_recovery_t *recovery, const bslam_slam_t *slam, int64_t time_us)
{
    return slam->settings.association != BSLAM_ASSOCIATION_KNOWN && !slam->is_frozen && recovery->has_grown &&
           time_us - recovery->grew_us < slam->settings.settled_us;
}

/// Whether there is a pose that has many more of the recognised beacons where they were seen than the present
/// one has, frame after frame.
static bool is_elsewhere(bslam_recovery_t *recovery, const bslam_slam_t *slam, int64_t time_us,
                         bslam_fix_t *fix)
{
    bslam_clue_t clues[BSLAM_CLUES_MAX];
    const int count = recall(recovery, slam, clues);
    const bslam_pose_t here = bslam_ekf_pose(&slam->ekf);
    return bslam_relocate(clues, count, fix) && is_clear(fix) &&
           fix->beacons >= ELSEWHERE_BEACONS + bslam_relocate_agreeing(clues, count, &here) &&
           confirm(recovery, slam, fix, time_us) >= ELSEWHERE_FRAMES;
}

/// A frame of a robot in a map that grows. True if it shows that the robot is elsewhere: at *fix.
static bool look_around(bslam_recovery_t *recovery, const bslam_slam_t *slam, const view_t *view,
                        const tally_t *verdict, bslam_fix_t *fix)
{
    (void)remember(recovery, slam, view);
    if (verdict->contradicting == 0) {
        return false;
    }
    recovery->counters.contradicting += (uint32_t)verdict->contradicting;
    if (!recovery->has_contradicted || view->vantage.moment_us - recovery->contradicted_us > CLUE_AGE_US) {
        recovery->doubted_us = view->vantage.moment_us;
    }
    recovery->has_contradicted = true;
    recovery->contradicted_us = view->vantage.moment_us;
    return is_elsewhere(recovery, slam, view->vantage.moment_us, fix);
}

/// A frame of a robot in a map that has settled, or in doubt. True if it may be used.
static bool look_again(bslam_recovery_t *recovery, bslam_slam_t *slam, const view_t *view, tally_t *verdict)
{
    if (recovery->evidence == 0) {
        forget_all(recovery);  // what was remembered while the map grew
    }
    // A pose that gave way to the first beacon seen agrees with that one.
    if (verdict->contradicting > 0 && verdict->contradicting == verdict->agreeing &&
        fits_elsewhere(slam, view)) {
        verdict->agreeing = 0;
    }
    if (notice(recovery, slam, view->vantage.moment_us, verdict)) {
        forget_all(recovery);  // the pose is no longer odometry's alone
        return true;
    }
    bslam_fix_t unused;  // where it is by then is not believed before it is lost
    (void)seek(recovery, slam, view, &unused);
    return false;
}

// ---- a frame ----------------------------------------------------------------------------------------------

/// A frame of a robot that is not lost. True if it may be used; *is_found: not, for it shows that the robot
/// is at *fix.
static bool follow(bslam_recovery_t *recovery, bslam_slam_t *slam, const view_t *view, bool *is_found,
                   bslam_fix_t *fix)
{
    note_growth(recovery, slam, view->vantage.moment_us);
    tally_t verdict = weigh(recovery, slam, view);
    if (recovery->evidence > 0 || !is_growing(recovery, slam, view->vantage.moment_us)) {
        return look_again(recovery, slam, view, &verdict);
    }
    *is_found = look_around(recovery, slam, view, &verdict, fix);
    if (*is_found) {
        get_lost(recovery, slam);
        forget_all(recovery);
    }
    return !*is_found;
}

bslam_status_t bslam_recovery_sightings(bslam_recovery_t *recovery, bslam_slam_t *slam, int64_t time_us,
                                        const bslam_sighting_t *sightings, int count)
{
    view_t view = {.sightings = sightings, .count = count};
    const bslam_status_t status = bslam_slam_open_frame(slam, time_us, sightings, count, &view.vantage);
    if (status != BSLAM_OK) {
        return status;
    }
    bslam_identify(slam, sightings, count, view.who);
    forget_old(recovery, slam, view.vantage.moment_us);
    bslam_fix_t fix;
    bool use = false;
    bool is_found = false;
    if (slam->is_lost) {
        if (recovery->memory_count == 0) {
            bslam_slam_lose_pose(slam);  // odometry's doubt begins anew with the first clue
        }
        is_found = seek(recovery, slam, &view, &fix);
    } else if (!bslam_is_findable(slam)) {
        use = true;
    } else {
        use = follow(recovery, slam, &view, &is_found, &fix);
    }
    recovery->counters.withheld += use ? 0u : 1u;
    bslam_slam_close_frame(slam, &view.vantage, sightings, count, use);
    if (is_found) {  // behind it: of a lost robot's frame the map stays as it is
        be_found(recovery, slam, &fix);
    }
    return BSLAM_OK;
}
