#include "bslam/recovery/recovery.h"

#include "bslam/math/symmat.h"
#include "bslam/math/trig.h"
#include "bslam/model/noise.h"
#include "bslam/model/pose.h"
#include "bslam/slam/internal.h"

// A sighting of a recognised beacon contradicts the pose beyond this squared distance. Rightly recognised
// ones are there once in 10^6.
static const bslam_real_t CONTRADICT_D2 = BSLAM_R(30.0);
// One that was not recognised agrees with the pose if it is as near as this to any beacon.
static const bslam_real_t FIT_D2 = BSLAM_R(9.0);
// A machine recognises what it puts this far above 0, and this far above what the next machine says.
static const float RECOGNISE_WEIGHT = 0.8f;
static const float RECOGNISE_VALUE = 0.3f;
static const float RECOGNISE_LEAD = 0.5f;
// A fix carried on is the same as a later one within this and both doubts.
static const bslam_real_t SAME_PLACE_M = BSLAM_R(0.25);
static const bslam_real_t SAME_HEADING_RAD = BSLAM_R(0.15);
// Of the way since a clue was seen.
static const bslam_real_t WAY_SD = BSLAM_R(0.15);
// The fix's doubt is that of its clues, which share the beacons' errors and the way since: so much wider.
static const bslam_real_t DOUBT_FACTOR = BSLAM_R(1.5);
static const bslam_real_t DOUBT_M = BSLAM_R(0.05);
static const bslam_real_t DOUBT_RAD = BSLAM_R(0.03);
static const bslam_real_t DOUBT_POSITION_MAX_M = BSLAM_R(1.5);
static const bslam_real_t DOUBT_HEADING_MAX_RAD = BSLAM_R(0.6);

enum {
    EVIDENCE_SEVERAL = 8,   ///< frames that contradict, less those that agree, until the robot is lost,
    EVIDENCE_ONE = 25,      ///< if all show the same beacon, or with those that say neither, once several did
    CLUE_AGE_US = 3000000,  ///< odometry carries a clue so long
    FIX_AGE_US = 1000000,
    CONFIRMED_BY_THIRD = 2,  ///< frames with the same fix, where three beacons agree,
    CONFIRMED_BY_TIME = 8    ///< or fewer than one more than a fix needs
};

void bslam_recovery_init(bslam_recovery_t *recovery)
{
    *recovery = (bslam_recovery_t){0};
}

bslam_recovery_state_t bslam_recovery_state(const bslam_recovery_t *recovery, const bslam_slam_t *slam)
{
    if (slam->is_lost) {
        return BSLAM_RECOVERY_LOST;
    }
    return recovery->evidence > 0 ? BSLAM_RECOVERY_DOUBTING : BSLAM_RECOVERY_FOLLOWING;
}

// ---- who is seen ------------------------------------------------------------------------------------------

static int find_label(const bslam_ekf_t *ekf, int32_t label)
{
    for (int b = 0; b < ekf->beacon_count && label != BSLAM_LABEL_NONE; b++) {
        if (ekf->beacons[b].label == label && ekf->beacons[b].confirmed) {  // not one of its rivals
            return b;
        }
    }
    return -1;
}

/// The beacon whose machine takes a sample for its own, if no other beacon's comes near; else -1. Beacons
/// that share a machine look alike: neither is recognised.
static int find_looks(const bslam_slam_t *slam, const float *signature)
{
    bslam_sample_t sample;
    if (slam->looks == NULL || signature == NULL || bslam_sample_encode(signature, &sample) != BSLAM_OK) {
        return -1;
    }
    int best = -1;
    float best_value = RECOGNISE_VALUE;
    float next_value = RECOGNISE_VALUE - RECOGNISE_LEAD;
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        const bslam_opinion_t opinion = bslam_looks_ask(slam->looks, &slam->params, b, &sample);
        if (opinion.weight < RECOGNISE_WEIGHT) {
            continue;
        }
        if (opinion.value > best_value) {
            next_value = best >= 0 ? best_value : next_value;
            best = b;
            best_value = opinion.value;
        } else if (opinion.value > next_value) {
            next_value = opinion.value;
        }
    }
    return best_value - next_value >= RECOGNISE_LEAD ? best : -1;
}

static bool is_seen_once(const int *who, int count, int i)
{
    for (int j = 0; j < count; j++) {
        if (j != i && who[j] == who[i]) {
            return false;
        }
    }
    return true;
}

/// Which beacon each sighting shows, by what does not come from position; -1: nobody knows.
static void recognise(const bslam_slam_t *slam, const bslam_sighting_t *sightings, int count, int *who)
{
    for (int i = 0; i < count; i++) {
        const bool by_label = slam->params.association == BSLAM_ASSOCIATION_KNOWN;
        who[i] = sightings[i].beacon_class == BSLAM_CLASS_NOT_MAPPABLE ? -1
                 : by_label ? find_label(&slam->ekf, sightings[i].label)
                            : find_looks(slam, sightings[i].signature);
        if (who[i] >= 0 && !slam->ekf.beacons[who[i]].confirmed) {
            who[i] = -1;
        }
    }
    for (int i = 0; i < count; i++) {
        if (who[i] >= 0 && !is_seen_once(who, count, i)) {
            who[i] = -1;
        }
    }
}

// ---- clues ------------------------------------------------------------------------------------------------

static bslam_real_t heading_var(const bslam_ekf_t *ekf)
{
    return bslam_symmat_get(ekf->covariance, BSLAM_STATE_THETA, BSLAM_STATE_THETA);
}

static bslam_memory_t memorise(const bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount,
                               const bslam_sighting_t *sighting, uint32_t uid)
{
    bslam_memory_t memory = {.uid = uid,
                             .time_us = time_us,
                             .sighting = *sighting,
                             .mount = *mount,
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
    bslam_real_t scale_var = is_sized ? bslam_symmat_get(ekf->covariance, at, at)
                                      : bslam_unknown_scale_var(&slam->params, sighting);
    if (beacon->known_scale > 0) {
        scale = beacon->known_scale;
        scale_var = 0;
    }
    clue->range_m = sighting->range_m / scale;
    clue->range_var_m2 = bslam_scaled_range_variance_m2(&slam->params, sighting, clue->range_m, scale_var);
}

/// A remembered sighting as it looks from where the robot is now, by odometry.
static void make_clue(const bslam_slam_t *slam, const bslam_memory_t *memory, bslam_clue_t *clue)
{
    const bslam_ekf_t *ekf = &slam->ekf;
    int beacon = 0;
    while (ekf->beacons[beacon].uid != memory->uid) {
        beacon++;
    }
    const bslam_pose_t now = bslam_ekf_pose(ekf);
    const bslam_pose_t to_now = bslam_pose_inverse(&now);
    const bslam_pose_t robot = bslam_pose_compose(&to_now, &memory->robot);
    const bslam_sighting_t *sighting = &memory->sighting;
    *clue = (bslam_clue_t){.sensor = bslam_pose_compose(&robot, &memory->mount),
                           .bearing_rad = sighting->bearing_rad,
                           .has_range = sighting->has_range};
    bslam_ekf_beacon_position(ekf, beacon, &clue->x_m, &clue->y_m);
    const bslam_sym2_t place = bslam_ekf_beacon_covariance(ekf, beacon);
    const bslam_real_t turn_var = growth(heading_var(ekf), memory->heading_var_rad2);
    const bslam_real_t way2_m2 = robot.x_m * robot.x_m + robot.y_m * robot.y_m;
    // A heading that drifts evenly bends the way by its deviation over the root of 3.
    const bslam_real_t drift_m2 = way2_m2 * (WAY_SD * WAY_SD + turn_var / 3) + (place.xx + place.yy) / 2;
    const bslam_real_t range_m = sighting->has_range && sighting->range_m > 1 ? sighting->range_m : 1;
    clue->bearing_var_rad2 =
        bslam_bearing_variance_rad2(&slam->params, sighting) + turn_var + drift_m2 / (range_m * range_m);
    if (sighting->has_range) {
        make_distance(slam, &ekf->beacons[beacon], sighting, clue);
        clue->range_var_m2 += drift_m2;
    }
}

// ---- noticing ---------------------------------------------------------------------------------------------

/// What a frame says of the pose.
typedef struct verdict {
    int agreeing;
    int contradicting;
    uint32_t uid;  ///< of one that contradicts
} verdict_t;

/// Squared distance of a sighting from a beacon; negative: it has none.
static bslam_real_t distance2_of(const bslam_slam_t *slam, const bslam_pose_t *mount,
                                 const bslam_sighting_t *sighting, int beacon)
{
    bslam_innovation_t innovation;
    bslam_real_t distance2;
    const bool has =
        bslam_ekf_innovation(&slam->ekf, &slam->params, mount, sighting, beacon, &innovation) == BSLAM_OK &&
        bslam_ekf_distance2(&slam->ekf, &innovation, &distance2) == BSLAM_OK;
    return has ? distance2 : -1;
}

/// Whether a sighting stands where a beacon is, other than those that were found while the pose was in doubt.
static bool fits_any(const bslam_recovery_t *recovery, const bslam_slam_t *slam, const bslam_pose_t *mount,
                     const bslam_sighting_t *sighting)
{
    for (int b = 0; b < slam->ekf.beacon_count; b++) {
        const bslam_beacon_t *beacon = &slam->ekf.beacons[b];
        if (beacon->confirmed && (recovery->evidence == 0 || beacon->first_seen_us < recovery->doubted_us) &&
            bslam_in_range(distance2_of(slam, mount, sighting, b), 0, FIT_D2)) {
            return true;
        }
    }
    return false;
}

/// Several beacons were elsewhere: what merely stands where some beacon is dispels such a doubt no more.
static bool is_serious(const bslam_recovery_t *recovery)
{
    return recovery->evidence > 0 && recovery->several;
}

static verdict_t weigh(const bslam_recovery_t *recovery, const bslam_slam_t *slam, const bslam_pose_t *mount,
                       const bslam_sighting_t *sightings, int count, const int *who)
{
    verdict_t verdict = {0, 0, 0};
    for (int i = 0; i < count; i++) {
        if (who[i] < 0) {
            verdict.agreeing +=
                !is_serious(recovery) && fits_any(recovery, slam, mount, &sightings[i]) ? 1 : 0;
            continue;
        }
        const bslam_real_t distance2 = distance2_of(slam, mount, &sightings[i], who[i]);
        if (distance2 > CONTRADICT_D2) {
            // What stands where another beacon is may be that one, and look alike from here.
            if (!fits_any(recovery, slam, mount, &sightings[i])) {
                verdict.contradicting++;
                verdict.uid = slam->ekf.beacons[who[i]].uid;
            }
        } else if (bslam_in_range(distance2, 0, FIT_D2)) {
            verdict.agreeing++;
        }
    }
    return verdict;
}

/// Whether there is a pose by which all that was recognised in a frame is where it is seen.
static bool fits_elsewhere(const bslam_slam_t *slam, const bslam_pose_t *mount,
                           const bslam_sighting_t *sightings, int count, const int *who)
{
    bslam_clue_t clues[BSLAM_CLUES_MAX];
    int clue_count = 0;
    for (int i = 0; i < count && clue_count < BSLAM_CLUES_MAX; i++) {
        if (who[i] >= 0) {
            const bslam_memory_t memory =
                memorise(slam, 0, mount, &sightings[i], slam->ekf.beacons[who[i]].uid);
            make_clue(slam, &memory, &clues[clue_count]);
            clue_count++;
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
    bslam_slam_lose_pose(slam);
    recovery->counters.lost++;
    recovery->evidence = 0;
    recovery->memory_count = 0;
    recovery->confirmed = 0;
    recovery->has_fix = false;
}

static void add_evidence(bslam_recovery_t *recovery, const verdict_t *verdict, int64_t time_us)
{
    if (recovery->evidence == 0) {
        recovery->doubted_us = time_us;
        recovery->doubted_uid = verdict->uid;
        recovery->several = false;
        recovery->undecided = 0;
    }
    recovery->several =
        recovery->several || verdict->contradicting > 1 || verdict->uid != recovery->doubted_uid;
    recovery->evidence++;
}

/// True if the frame may be used: one beacon alone that is elsewhere may have been carried there, or be
/// another one that looks like it.
static bool notice(bslam_recovery_t *recovery, bslam_slam_t *slam, int64_t time_us, const verdict_t *verdict)
{
    recovery->counters.contradicting += (uint32_t)verdict->contradicting;
    if (verdict->contradicting > verdict->agreeing) {
        add_evidence(recovery, verdict, time_us);
        if (recovery->evidence >= (recovery->several ? EVIDENCE_SEVERAL : EVIDENCE_ONE)) {
            get_lost(recovery, slam);
            return false;
        }
    } else if (verdict->contradicting < verdict->agreeing && recovery->evidence > 0) {
        recovery->evidence--;
        return true;
    } else if (is_serious(recovery)) {
        recovery->undecided++;
        if (recovery->undecided + recovery->evidence >= EVIDENCE_ONE) {
            get_lost(recovery, slam);
            return false;
        }
    }
    return recovery->evidence == 0 || !recovery->several;
}

// ---- finding ----------------------------------------------------------------------------------------------

static bslam_memory_t *memory_for(bslam_recovery_t *recovery, uint32_t uid)
{
    int oldest = 0;
    for (int m = 0; m < recovery->memory_count; m++) {
        if (recovery->memories[m].uid == uid) {
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
        bool is_there = false;
        for (int b = 0; b < slam->ekf.beacon_count; b++) {
            is_there = is_there || slam->ekf.beacons[b].uid == recovery->memories[m].uid;
        }
        if (is_there && time_us - recovery->memories[m].time_us <= CLUE_AGE_US) {
            recovery->memories[kept] = recovery->memories[m];
            kept++;
        }
    }
    recovery->memory_count = kept;
}

/// Keeps the newest sighting of each recognised beacon. True if there is one.
static bool remember(bslam_recovery_t *recovery, const bslam_slam_t *slam, int64_t time_us,
                     const bslam_pose_t *mount, const bslam_sighting_t *sightings, int count, const int *who)
{
    bool any = false;
    for (int i = 0; i < count; i++) {
        if (who[i] >= 0) {
            const uint32_t uid = slam->ekf.beacons[who[i]].uid;
            *memory_for(recovery, uid) = memorise(slam, time_us, mount, &sightings[i], uid);
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
    const bslam_real_t dx = carried.x_m - fix->pose.x_m;
    const bslam_real_t dy = carried.y_m - fix->pose.y_m;
    const bslam_real_t turn = bslam_abs(bslam_angle_wrap(carried.theta_rad - fix->pose.theta_rad));
    const bslam_real_t place = SAME_PLACE_M + 2 * fix->position_sd_m;
    return dx * dx + dy * dy <= place * place && turn <= SAME_HEADING_RAD + 2 * fix->heading_sd_rad;
}

/// Clues that a fix has beyond those that any pose could have met.
static bool is_verified(const bslam_fix_t *fix)
{
    return fix->agreeing > (fix->with_range >= 2 ? 2 : 3);
}

static bool is_clear(const bslam_fix_t *fix)
{
    return fix->agreeing > 2 * fix->dissenting && fix->position_sd_m <= DOUBT_POSITION_MAX_M &&
           fix->heading_sd_rad <= DOUBT_HEADING_MAX_RAD;
}

/// Counts frames with the same fix. True when it is confirmed.
static bool confirm(bslam_recovery_t *recovery, const bslam_slam_t *slam, const bslam_fix_t *fix,
                    int64_t time_us)
{
    const bslam_pose_t robot = bslam_ekf_pose(&slam->ekf);
    recovery->confirmed = is_same(recovery, &robot, fix, time_us) ? recovery->confirmed + 1 : 1;
    const bslam_pose_t back = bslam_pose_inverse(&robot);
    recovery->last_fix = bslam_pose_compose(&fix->pose, &back);
    recovery->has_fix = true;
    recovery->fix_us = time_us;
    return recovery->confirmed >= (is_verified(fix) ? CONFIRMED_BY_THIRD : CONFIRMED_BY_TIME);
}

static bslam_real_t doubt(bslam_real_t sd, bslam_real_t least, bslam_real_t most)
{
    const bslam_real_t wide = DOUBT_FACTOR * sd + least;
    return wide < most ? wide : most;
}

static void seek(bslam_recovery_t *recovery, bslam_slam_t *slam, int64_t time_us, const bslam_pose_t *mount,
                 const bslam_sighting_t *sightings, int count, const int *who)
{
    forget_old(recovery, slam, time_us);
    if (recovery->memory_count == 0) {
        bslam_slam_lose_pose(slam);  // odometry's doubt begins anew with the first clue
    }
    if (!remember(recovery, slam, time_us, mount, sightings, count, who)) {
        return;
    }
    bslam_clue_t clues[BSLAM_CLUES_MAX];
    for (int m = 0; m < recovery->memory_count; m++) {
        make_clue(slam, &recovery->memories[m], &clues[m]);
    }
    bslam_fix_t fix;
    if (bslam_relocate(clues, recovery->memory_count, &fix) && is_clear(&fix) &&
        confirm(recovery, slam, &fix, time_us) &&
        bslam_slam_set_pose(slam, &fix.pose, doubt(fix.position_sd_m, DOUBT_M, DOUBT_POSITION_MAX_M),
                            doubt(fix.heading_sd_rad, DOUBT_RAD, DOUBT_HEADING_MAX_RAD)) == BSLAM_OK) {
        recovery->counters.found++;
    }
}

// ---- a frame ----------------------------------------------------------------------------------------------

bslam_status_t bslam_recovery_sightings(bslam_recovery_t *recovery, bslam_slam_t *slam, int64_t time_us,
                                        const bslam_sighting_t *sightings, int count)
{
    bslam_pose_t mount;
    const bslam_status_t status = bslam_slam_open_frame(slam, time_us, sightings, count, &mount);
    if (status != BSLAM_OK) {
        return status;
    }
    int who[BSLAM_SIGHTINGS_MAX];
    recognise(slam, sightings, count, who);
    bool use = false;
    if (slam->is_lost) {
        seek(recovery, slam, time_us, &mount, sightings, count, who);
    } else {
        verdict_t verdict = weigh(recovery, slam, &mount, sightings, count, who);
        // A pose that gave way to the first beacon seen agrees with that one.
        if (verdict.contradicting > 0 && verdict.contradicting == verdict.agreeing &&
            fits_elsewhere(slam, &mount, sightings, count, who)) {
            verdict.agreeing = 0;
        }
        use = notice(recovery, slam, time_us, &verdict);
    }
    recovery->counters.withheld += use ? 0u : 1u;
    bslam_slam_close_frame(slam, time_us, sightings, count, &mount, use);
    return BSLAM_OK;
}
