// The library as a state machine: any calls in a row, good and bad. After each the state is sound; a call
// that is refused has changed nothing but what slam.h says that it may.
#include "fuzz.h"

#include <string.h>

#include "bslam/recovery/recovery.h"
#include "bslam/store/guard.h"
#include "bslam/store/map.h"
#include "base/scalar.h"
#include "bslam/settings_internal.h"

enum { CALLS_MAX = 40, BLOB_MAX = 4096 };

typedef struct robot {
    bslam_slam_t slam;
    bslam_appearance_t appearance;
    bslam_recovery_t recovery;
} robot_t;

static robot_t robot;
static robot_t before;
static uint8_t blob[BLOB_MAX];
static uint32_t blob_size;

/// What a refused call may have touched: counters, the sighting at fault, after a jump the tick reference; a
/// load leaves zeros where the covariance's memory holds nothing.
static void require_unchanged(bslam_status_t status)
{
    before.slam.counters = robot.slam.counters;
    before.slam.bad_sighting = robot.slam.bad_sighting;
    if (status == BSLAM_E_JUMP) {
        before.slam.odometry = robot.slam.odometry;
    }
    if (status == BSLAM_E_MAP) {
        fuzz_clear_unused(&before.slam);
        fuzz_clear_unused(&robot.slam);
    }
    fuzz_require(memcmp(&robot, &before, sizeof robot) == 0);
}

// ---- calls ------------------------------------------------------------------------------------------------

static bslam_status_t call_odometry(fuzz_input_t *input, int64_t *now_us)
{
    *now_us += 40000;
    const bslam_odometry_reading_t reading = fuzz_reading(input, *now_us);
    const bslam_status_t status = bslam_slam_odometry(&robot.slam, &reading);
    if (status == BSLAM_OK) {
        *now_us = reading.time_us;
    }
    return status;
}

static int take_frame(fuzz_input_t *input, bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX],
                      float signatures[BSLAM_SIGHTINGS_MAX][BSLAM_SAMPLE_FEATURES])
{
    const int count = (int)(fuzz_u8(input) % (BSLAM_SIGHTINGS_MAX + 2));
    for (int i = 0; i < count && i < BSLAM_SIGHTINGS_MAX; i++) {
        seen[i] = fuzz_sighting(input, signatures[i]);
    }
    return count;
}

static bslam_status_t call_sightings(fuzz_input_t *input, int64_t *now_us, bool recovers)
{
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX];
    float signatures[BSLAM_SIGHTINGS_MAX][BSLAM_SAMPLE_FEATURES];
    const int64_t time_us = fuzz_time(input, *now_us);
    const int count = take_frame(input, seen, signatures);
    return recovers ? bslam_recovery_sightings(&robot.recovery, &robot.slam, time_us, seen, count)
                    : bslam_slam_sightings(&robot.slam, time_us, seen, count);
}

static bslam_status_t call_resume(fuzz_input_t *input)
{
    const bslam_real_t position_sd_m = fuzz_real(input, 0, 30);
    const bslam_real_t heading_sd_rad = fuzz_real(input, 0, 3.2);
    return bslam_slam_resume_odometry(&robot.slam, position_sd_m, heading_sd_rad);
}

static bslam_status_t call_set_pose(fuzz_input_t *input)
{
    bslam_pose_t pose;
    pose.x_m = fuzz_real(input, -10, 10);
    pose.y_m = fuzz_real(input, -10, 10);
    pose.theta_rad = fuzz_real(input, -4, 4);
    const bslam_real_t position_sd_m = fuzz_real(input, 0, 30);
    const bslam_real_t heading_sd_rad = fuzz_real(input, 0, 3.2);
    return bslam_slam_set_pose(&robot.slam, &pose, position_sd_m, heading_sd_rad);
}

static bslam_status_t call_add_known(fuzz_input_t *input)
{
    const int32_t label = (int32_t)fuzz_u8(input) - 1;
    const bslam_real_t x_m = fuzz_real(input, -10, 10);
    const bslam_real_t y_m = fuzz_real(input, -10, 10);
    return bslam_slam_add_known_beacon(&robot.slam, label, x_m, y_m);
}

static bslam_status_t call_pose_at(fuzz_input_t *input, int64_t now_us)
{
    bslam_pose_t pose = {0, 0, 0};
    const bslam_status_t status = bslam_slam_pose_at(&robot.slam, fuzz_time(input, now_us), &pose);
    fuzz_require(isfinite((double)pose.x_m) && isfinite((double)pose.y_m) &&
                 isfinite((double)pose.theta_rad));
    return status;
}

static bslam_status_t call_save(void)
{
    bslam_map_memory_t memory = {blob, BLOB_MAX, 0};
    const bslam_map_sink_t sink = bslam_map_to_memory(&memory);
    bslam_map_fault_t fault;
    const bslam_status_t status = bslam_map_write(&robot.slam, &sink, &fault);
    blob_size = memory.count;
    return status;
}

static bslam_status_t call_load(fuzz_input_t *input)
{
    const bslam_map_source_t source = bslam_map_from_memory(blob, blob_size);
    const bslam_map_mode_t mode = (fuzz_u8(input) & 1u) != 0 ? BSLAM_MAP_FROZEN : BSLAM_MAP_LIVING;
    bslam_map_fault_t fault;
    return bslam_map_load(&robot.slam, &source, mode, &fault);
}

/// Starts over with other parameters, some of which may contradict each other.
static bslam_status_t call_init(fuzz_input_t *input)
{
    bslam_settings_t settings = robot.slam.settings;
    for (unsigned i = fuzz_u8(input) % 4; i > 0; i--) {
        const int id = (int)fuzz_u8(input) % bslam_settings_count();
        const bslam_setting_info_t *info = bslam_settings_info(id);
        const bslam_real_t value = fuzz_real(input, (double)info->low, (double)info->high);
        const bslam_real_t whole =
            bslam_in_range(value, -1000000, 1000000) ? (bslam_real_t)(int32_t)value : value;
        const bslam_real_t old = bslam_settings_get(&settings, id);
        const bslam_status_t set = bslam_settings_set(&settings, id, info->is_integer ? whole : value);
        fuzz_require(set == BSLAM_OK || bslam_settings_get(&settings, id) == old);
    }
    int bad_id;
    const bslam_status_t status = bslam_slam_init(&robot.slam, &settings, &bad_id);
    if (status == BSLAM_OK) {
        bslam_slam_attach_appearance(&robot.slam, (fuzz_u8(input) & 1u) != 0 ? &robot.appearance : NULL);
    }
    return status;
}

/// A flipped bit is found, and a seal fits what it sealed.
static bslam_status_t call_guard(fuzz_input_t *input)
{
    bslam_guard_t guard;
    bslam_guard_init(&guard, NULL);
    bslam_guard_seal(&guard, &robot.slam);
    fuzz_require(bslam_guard_check(&guard, &robot.slam) == BSLAM_OK);
    uint32_t *word = (uint32_t *)(void *)&robot.slam.ekf.mean[fuzz_u8(input) % BSLAM_STATE_MAX];
    const uint32_t bit = UINT32_C(1) << fuzz_u8(input) % 32;
    *word ^= bit;
    fuzz_require(bslam_guard_check(&guard, &robot.slam) == BSLAM_E_STATE);
    *word ^= bit;
    return BSLAM_OK;
}

static bslam_status_t call(fuzz_input_t *input, int64_t *now_us)
{
    switch (fuzz_u8(input) % 16) {
    case 0:
    case 1:
        return call_odometry(input, now_us);
    case 2:
    case 3:
        return call_sightings(input, now_us, false);
    case 4:
        return call_sightings(input, now_us, true);
    case 5:
        return call_resume(input);
    case 6:
        return call_set_pose(input);
    case 7:
        return call_add_known(input);
    case 8:
        return bslam_slam_remove_beacon(&robot.slam, fuzz_u8(input));
    case 9:
        return call_pose_at(input, *now_us);
    case 10:
        return call_save();
    case 11:
        return call_load(input);
    case 12:
        return call_init(input);
    case 13:
        return call_guard(input);
    case 14:
        bslam_slam_lose_pose(&robot.slam);
        return BSLAM_OK;
    default:
        bslam_slam_forget_map(&robot.slam);
        return BSLAM_OK;
    }
}

static void start(fuzz_input_t *input)
{
    static robot_t fresh;
    static bool is_made;
    if (!is_made) {
        bslam_settings_t settings;
        int bad_id;
        bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
        settings.learn_budget = 50;
        fuzz_require(bslam_slam_init(&fresh.slam, &settings, &bad_id) == BSLAM_OK);
        fuzz_require(bslam_appearance_init(&fresh.appearance, NULL, 0) == BSLAM_OK);
        bslam_recovery_init(&fresh.recovery);
        is_made = true;
    }
    const unsigned choice = fuzz_u8(input);
    memcpy(&robot, &fresh, sizeof robot);
    robot.slam.settings.association = (int32_t)(choice % 5);
    robot.slam.settings.filter = (int32_t)(choice / 5 % 2);
    bslam_slam_attach_appearance(&robot.slam, choice >= 128 ? &robot.appearance : NULL);
    blob_size = 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input_t input = {data, size};
    fuzz_begin();
    start(&input);
    int64_t now_us = 0;
    for (int calls = 0; calls < CALLS_MAX && input.left > 0; calls++) {
        memcpy(&before, &robot, sizeof before);
        const bslam_status_t status = call(&input, &now_us);
        if (status != BSLAM_OK) {
            require_unchanged(status);
        }
        fuzz_require_sound(&robot.slam);
    }
    return 0;
}
