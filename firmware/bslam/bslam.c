// The public calls: what a robot's main loop would else have to do around each of them, in its order.
#include "bslam/bslam.h"

#include "base/scalar.h"
#include "bslam/instance.h"
#include "bslam/settings_internal.h"
#include "bslam/slam/fingerprint.h"
#include "bslam/slam/slam_internal.h"
#include "bslam/store/map.h"
#include "bslam/store/slots.h"

_Static_assert(sizeof(bslam_settings_t) <= BSLAM_SIZE_SETTINGS, "size.h: settings");
_Static_assert(sizeof(bslam_ekf_t) <= BSLAM_SIZE_EKF, "size.h: filter");
_Static_assert(sizeof(bslam_slam_t) <= BSLAM_SIZE_PIPELINE, "size.h: pipeline");
_Static_assert(sizeof(bslam_instance_t) <= sizeof(bslam_t), "size.h: the sum");

/// Sixteen turns, as much as one interval of odometry may have.
static const bslam_real_t HEADING_MAX_RAD = BSLAM_R(100.0);

// ---- the guard: a step begins with a look at the memory and ends with a seal on it ------------------------

#if BSLAM_GUARD
static bslam_slam_t *copy_of(bslam_instance_t *robot)
{
#if BSLAM_GUARD == 2
    return &robot->copy;
#else
    (void)robot;
    return NULL;
#endif
}

/// Checksums of what stands beside the pipeline. Samples are left out: a damaged one is judged by, no more.
static void sum_members(const bslam_instance_t *robot, uint32_t sums[BSLAM_GUARD_MEMBERS])
{
#if BSLAM_RECOVERY
    sums[0] = bslam_guard_sum(0, &robot->recovery, sizeof robot->recovery);
#endif
#if BSLAM_APPEARANCE
    const bslam_appearance_t *appearance = &robot->appearance;
    const bslam_learner_t *learner = &appearance->learner;
    sums[1] = bslam_guard_sum(0, appearance, offsetof(bslam_appearance_t, learner));
    sums[1] = bslam_guard_sum(sums[1], learner, offsetof(bslam_learner_t, samples));
    sums[1] = bslam_guard_sum(sums[1], &learner->training, sizeof learner->training);
#endif
#if BSLAM_SMOOTHER
    sums[2] = bslam_guard_sum(0, &robot->smoother, sizeof robot->smoother);
#endif
#if BSLAM_HYPOTHESES_MAX > 1
    const int count = robot->doubts.count;  // it may be what is damaged
    const size_t alive = count > 0 && count < BSLAM_HYPOTHESES_MAX ? (size_t)count : 0;
    sums[3] = bslam_guard_sum(0, &robot->doubts.count, sizeof robot->doubts.count);
    sums[3] = bslam_guard_sum(sums[3], robot->doubts.others, alive * sizeof robot->doubts.others[0]);
#endif
    (void)robot;
    (void)sums;
}

/// What stands beside the pipeline and is no longer what it was begins anew: no index in it may be believed.
/// Counted as corrupt.
static void check_members(bslam_instance_t *robot)
{
    uint32_t sums[BSLAM_GUARD_MEMBERS] = {0};
    bool is_good[BSLAM_GUARD_MEMBERS];
    sum_members(robot, sums);
    for (int m = 0; m < BSLAM_GUARD_MEMBERS; m++) {
        is_good[m] = sums[m] == robot->guard.members[m];
        robot->guard.counters.corrupt += is_good[m] ? 0u : 1u;
    }
#if BSLAM_RECOVERY
    if (!is_good[0]) {
        robot->recovery = (bslam_recovery_t){0};
    }
#endif
#if BSLAM_APPEARANCE
    if (!is_good[1]) {
        const bslam_settings_t *settings = &robot->slam.settings;
        const bslam_status_t status =
            bslam_appearance_init(&robot->appearance, settings->seeds, settings->seed_count);
        (void)status;                        // the seeds were taken before
        bslam_slam_end_doubt(&robot->slam);  // what the others know of it is of before
    }
#endif
#if BSLAM_SMOOTHER
    if (!is_good[2]) {
        robot->smoother = (bslam_smoother_t){0};
        bslam_slam_restart_smoother(&robot->slam);
    }
#endif
#if BSLAM_HYPOTHESES_MAX > 1
    if (!is_good[3]) {
        robot->doubts.count = 0;
        bslam_slam_end_doubt(&robot->slam);
    }
#endif
    sum_members(robot, robot->guard.members);
}
#endif

/// The pipeline, if it has begun and is as the step before left it; else NULL, for BSLAM_E_STATE.
static bslam_slam_t *begin_step(bslam_t *robot)
{
    bslam_instance_t *instance = bslam_instance(robot);
#if BSLAM_GUARD
    // Neither of the two flags that say so can be damaged unnoticed while the other is good.
    if (instance->slam.settings.guard != 0 || bslam_guard_is_sealed(&instance->guard)) {
        if (bslam_guard_check(&instance->guard, &instance->slam) != BSLAM_OK) {
            return NULL;
        }
        check_members(instance);
    }
#endif
    return instance->slam.settings.wheelbase_m > 0 ? &instance->slam : NULL;  // 0: nothing has begun it
}

/// A step that failed has changed counters, which are sealed, too.
static bslam_status_t ended(bslam_t *robot, bslam_status_t status)
{
#if BSLAM_GUARD
    bslam_instance_t *instance = bslam_instance(robot);
    if (instance->slam.settings.guard != 0) {
        instance->guard.copy = copy_of(instance);
        bslam_guard_seal(&instance->guard, &instance->slam);
        sum_members(instance, instance->guard.members);
    }
#endif
    (void)robot;
    return status;
}

// ---- beginning --------------------------------------------------------------------------------------------

/// A setting that asks for what this build leaves out; negative: none does.
static int asks_for_more(const bslam_settings_t *settings)
{
    size_t offset = 0;
    if (!BSLAM_SMOOTHER && settings->filter == BSLAM_FILTER_SMOOTHER) {
        offset = offsetof(bslam_settings_t, filter);
    } else if (!BSLAM_APPEARANCE && bslam_weighs_looks(settings)) {
        offset = offsetof(bslam_settings_t, association);
    } else if (!BSLAM_RECOVERY && settings->recovery != 0) {
        offset = offsetof(bslam_settings_t, recovery);
    } else if (!BSLAM_GUARD && settings->guard != 0) {
        offset = offsetof(bslam_settings_t, guard);
    } else {
        return -1;
    }
    return bslam_settings_at(offset);
}

/// What may stand beside the pipeline, empty.
static bslam_status_t begin_members(bslam_instance_t *robot)
{
    bslam_status_t status = BSLAM_OK;
#if BSLAM_RECOVERY
    robot->recovery = (bslam_recovery_t){0};
#endif
#if BSLAM_GUARD
    robot->guard = (bslam_guard_t){.copy = copy_of(robot)};
#endif
#if BSLAM_APPEARANCE
    const bslam_settings_t *settings = &robot->slam.settings;
    status = bslam_appearance_init(&robot->appearance, settings->seeds, settings->seed_count);
    if (bslam_weighs_looks(settings)) {
        bslam_slam_attach_appearance(&robot->slam, &robot->appearance);
    }
#endif
#if BSLAM_SMOOTHER
    bslam_slam_attach_smoother(&robot->slam, &robot->smoother);
#endif
#if BSLAM_HYPOTHESES_MAX > 1
    robot->doubts.count = 0;
    bslam_slam_attach_doubts(&robot->slam, &robot->doubts);
#endif
    (void)robot;
    return status;
}

bslam_status_t bslam_init_sized(bslam_t *robot, size_t robot_bytes, uint32_t sizes_hash,
                                const bslam_settings_t *settings, int *bad_setting)
{
    *bad_setting = -1;
    if (robot_bytes != sizeof *robot || sizes_hash != BSLAM_SIZES_HASH) {
        return BSLAM_E_SIZE;
    }
    *bad_setting = asks_for_more(settings);
    if (*bad_setting >= 0) {
        return BSLAM_E_PARAMETER;
    }
    if (settings->seed_count < 0 || settings->seed_count > BSLAM_SEEDS_MAX ||
        (settings->seeds == NULL && settings->seed_count > 0)) {
        return BSLAM_E_COUNT;
    }
    bslam_instance_t *instance = bslam_instance(robot);
    const bslam_status_t status = bslam_slam_init(&instance->slam, settings, bad_setting);
    return status != BSLAM_OK ? status : ended(robot, begin_members(instance));
}

bslam_status_t bslam_restart(bslam_t *robot, bslam_real_t position_sd_m, bslam_real_t heading_sd_rad)
{
#if BSLAM_GUARD
    bslam_instance_t *instance = bslam_instance(robot);
    instance->guard.copy = copy_of(instance);  // whatever the reset left of it
    bslam_status_t status = bslam_guard_check(&instance->guard, &instance->slam);
    if (status != BSLAM_OK) {
        status = bslam_guard_restore(&instance->guard, &instance->slam);
    }
    if (status != BSLAM_OK) {
        return status;
    }
    check_members(instance);
    status = bslam_slam_resume_odometry(&instance->slam, position_sd_m, heading_sd_rad);
#if BSLAM_RECOVERY
    if (status == BSLAM_OK) {
        bslam_recovery_restart(&instance->recovery);
    }
#endif
    return ended(robot, status);
#else
    (void)robot;
    (void)position_sd_m;
    (void)heading_sd_rad;
    return BSLAM_E_STATE;
#endif
}

// ---- steps ------------------------------------------------------------------------------------------------

bslam_status_t bslam_odometry(bslam_t *robot, const bslam_odometry_reading_t *reading)
{
    bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE : ended(robot, bslam_slam_odometry(slam, reading));
}

bslam_status_t bslam_resume_odometry(bslam_t *robot, bslam_real_t position_sd_m, bslam_real_t heading_sd_rad)
{
    bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE
                        : ended(robot, bslam_slam_resume_odometry(slam, position_sd_m, heading_sd_rad));
}

static bslam_status_t take_frame(bslam_instance_t *robot, int64_t time_us, const bslam_sighting_t *sightings,
                                 int count)
{
#if BSLAM_RECOVERY
    if (robot->slam.settings.recovery != 0) {
        return bslam_recovery_sightings(&robot->recovery, &robot->slam, time_us, sightings, count);
    }
#endif
    return bslam_slam_sightings(&robot->slam, time_us, sightings, count);
}

bslam_status_t bslam_sightings(bslam_t *robot, int64_t time_us, const bslam_sighting_t *sightings, int count)
{
    bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE
                        : ended(robot, take_frame(bslam_instance(robot), time_us, sightings, count));
}

// ---- results ----------------------------------------------------------------------------------------------

bslam_pose_t bslam_pose(const bslam_t *robot)
{
    return bslam_slam_pose(&bslam_const_instance(robot)->slam);
}

bslam_status_t bslam_pose_at(const bslam_t *robot, int64_t time_us, bslam_pose_t *pose)
{
    return bslam_slam_pose_at(&bslam_const_instance(robot)->slam, time_us, pose);
}

void bslam_pose_covariance(const bslam_t *robot, bslam_real_t lower[6])
{
    bslam_slam_pose_covariance(&bslam_const_instance(robot)->slam, lower);
}

bslam_health_t bslam_health(const bslam_t *robot)
{
    const bslam_instance_t *instance = bslam_const_instance(robot);
    bslam_health_t health = {.state = instance->slam.is_lost ? BSLAM_RECOVERY_LOST : BSLAM_RECOVERY_FOLLOWING,
                             .is_frozen = instance->slam.is_frozen,
                             .beacons = instance->slam.ekf.beacon_count,
                             .bad_sighting = instance->slam.bad_sighting};
#if BSLAM_RECOVERY
    health.state = bslam_recovery_state(&instance->recovery, &instance->slam);
#endif
    health.hypotheses = 1 + bslam_slam_doubts(&instance->slam);
    health.lead_nats = bslam_slam_lead(&instance->slam);
    if (health.state == BSLAM_RECOVERY_FOLLOWING && health.hypotheses > 1) {
        health.state = BSLAM_RECOVERY_DOUBTING;
    }
    return health;
}

uint64_t bslam_fingerprint(const bslam_t *robot, uint64_t before)
{
    return bslam_slam_fingerprint(&bslam_const_instance(robot)->slam, before);
}

const bslam_account_t *bslam_results(const bslam_t *robot, int *count)
{
    const bslam_slam_t *slam = &bslam_const_instance(robot)->slam;
    *count = slam->account_count;
    return slam->accounts;
}

bslam_counters_t bslam_counters(const bslam_t *robot)
{
    const bslam_instance_t *instance = bslam_const_instance(robot);
    bslam_counters_t counters = {.slam = instance->slam.counters};
#if BSLAM_RECOVERY
    counters.recovery = instance->recovery.counters;
#endif
#if BSLAM_GUARD
    counters.guard = instance->guard.counters;
#endif
#if BSLAM_APPEARANCE
    counters.appearance = instance->appearance.counters;
    counters.learner = instance->appearance.learner.counters;
#endif
    return counters;
}

// ---- the map ----------------------------------------------------------------------------------------------

bslam_status_t bslam_beacon(const bslam_t *robot, int index, bslam_beacon_view_t *view)
{
    return bslam_slam_beacon(&bslam_const_instance(robot)->slam, index, view);
}

bslam_status_t bslam_add_known_beacon(bslam_t *robot, int32_t label, bslam_real_t x_m, bslam_real_t y_m)
{
    bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE : ended(robot, bslam_slam_add_known_beacon(slam, label, x_m, y_m));
}

static bslam_status_t remove_beacon(bslam_slam_t *slam, uint32_t uid)
{
    if (uid == BSLAM_ALL_BEACONS) {
        bslam_slam_forget_map(slam);
        return BSLAM_OK;
    }
    return bslam_slam_remove_beacon(slam, uid);
}

bslam_status_t bslam_remove_beacon(bslam_t *robot, uint32_t uid)
{
    bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE : ended(robot, remove_beacon(slam, uid));
}

void bslam_freeze_map(bslam_t *robot, bool is_frozen)
{
    bslam_slam_t *slam = begin_step(robot);
    if (slam != NULL) {
        slam->is_frozen = is_frozen;
        (void)ended(robot, BSLAM_OK);
    }
}

/// What is no number is called that, and not far.
static bool is_far(bslam_real_t value, bslam_real_t most)
{
    return bslam_is_number(value) && !bslam_in_range(value, -most, most);
}

static bslam_status_t set_pose(bslam_slam_t *slam, const bslam_pose_t *pose, bslam_real_t position_sd_m,
                               bslam_real_t heading_sd_rad)
{
    if (pose == NULL) {
        bslam_slam_lose_pose(slam);
        return BSLAM_OK;
    }
    if (is_far(pose->x_m, BSLAM_POSE_MAX_M) || is_far(pose->y_m, BSLAM_POSE_MAX_M) ||
        is_far(pose->theta_rad, HEADING_MAX_RAD)) {
        return BSLAM_E_RANGE;
    }
    return bslam_slam_set_pose(slam, pose, position_sd_m, heading_sd_rad);
}

bslam_status_t bslam_set_pose(bslam_t *robot, const bslam_pose_t *pose, bslam_real_t position_sd_m,
                              bslam_real_t heading_sd_rad)
{
    bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE : ended(robot, set_pose(slam, pose, position_sd_m, heading_sd_rad));
}

// ---- keeping the map --------------------------------------------------------------------------------------

bslam_status_t bslam_save_map(bslam_t *robot, const bslam_map_sink_t *sink, uint32_t *bytes)
{
    const bslam_slam_t *slam = begin_step(robot);
    bslam_map_fault_t fault;
    *bytes = slam == NULL ? 0 : bslam_map_size(slam);
    if (slam == NULL) {
        return BSLAM_E_STATE;
    }
    return ended(robot, sink == NULL ? BSLAM_OK : bslam_map_write(slam, sink, &fault));
}

/// A robot whose map is frozen takes another one frozen.
static bslam_map_mode_t mode_of(const bslam_slam_t *slam)
{
    return slam->is_frozen ? BSLAM_MAP_FROZEN : BSLAM_MAP_LIVING;
}

bslam_status_t bslam_load_map(bslam_t *robot, const bslam_map_source_t *source, bslam_map_fault_t *fault)
{
    *fault = BSLAM_MAP_FINE;
    bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE : ended(robot, bslam_map_load(slam, source, mode_of(slam), fault));
}

bslam_status_t bslam_save_to_flash(bslam_t *robot, const bslam_flash_t *flash, bslam_map_fault_t *fault)
{
    *fault = BSLAM_MAP_FINE;
    const bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE : ended(robot, bslam_slots_save(flash, slam, fault));
}

bslam_status_t bslam_load_from_flash(bslam_t *robot, const bslam_flash_t *flash, bslam_map_fault_t *fault)
{
    *fault = BSLAM_MAP_FINE;
    bslam_slam_t *slam = begin_step(robot);
    return slam == NULL ? BSLAM_E_STATE : ended(robot, bslam_slots_load(flash, slam, mode_of(slam), fault));
}
