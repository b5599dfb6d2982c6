// The public calls as a state machine: any in a row, good and bad. After each the state is sound; a call that
// is refused has changed nothing but what bslam.h says that it may.
#include "fuzz.h"

#include <string.h>

#include "map_memory.h"

enum { CALLS_MAX = 40, BLOB_MAX = 4096 };

static bslam_t robot;
static bslam_t before;
static bslam_settings_t settings;
static uint8_t blob[BLOB_MAX];
static uint32_t blob_size;

static bslam_slam_t *slam_of(bslam_t *one)
{
    return &bslam_instance(one)->slam;
}

/// What a refused call may have touched: counters, the sighting at fault, stamps that were refused, after a
/// jump the tick reference. And the seal over all of them.
static void require_unchanged(bslam_status_t status)
{
    bslam_slam_t *was = slam_of(&before);
    was->counters = slam_of(&robot)->counters;
    was->bad_sighting = slam_of(&robot)->bad_sighting;
    was->watch = slam_of(&robot)->watch;
    if (status == BSLAM_E_JUMP) {
        was->odometry = slam_of(&robot)->odometry;
    }
    bslam_instance(&before)->guard = bslam_instance(&robot)->guard;
    bslam_instance(&before)->copy = bslam_instance(&robot)->copy;
    fuzz_require(memcmp(&robot, &before, sizeof robot) == 0);
}

// ---- calls ------------------------------------------------------------------------------------------------

static bslam_status_t call_odometry(fuzz_input_t *input, int64_t *now_us)
{
    *now_us += 40000;
    const bslam_odometry_reading_t reading = fuzz_reading(input, *now_us);
    const bslam_status_t status = bslam_odometry(&robot, &reading);
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

static bslam_status_t call_sightings(fuzz_input_t *input, int64_t now_us)
{
    bslam_sighting_t seen[BSLAM_SIGHTINGS_MAX];
    float signatures[BSLAM_SIGHTINGS_MAX][BSLAM_SAMPLE_FEATURES];
    const int64_t time_us = fuzz_time(input, now_us);
    const int count = take_frame(input, seen, signatures);
    const bslam_status_t status = bslam_sightings(&robot, time_us, seen, count);
    int accounts = 0;
    (void)bslam_results(&robot, &accounts);
    fuzz_require(status != BSLAM_OK || accounts == count);
    return status;
}

static bslam_status_t call_resume(fuzz_input_t *input)
{
    const bslam_real_t position_sd_m = fuzz_real(input, 0, 30);
    const bslam_real_t heading_sd_rad = fuzz_real(input, 0, 3.2);
    return bslam_resume_odometry(&robot, position_sd_m, heading_sd_rad);
}

static bslam_status_t call_set_pose(fuzz_input_t *input)
{
    bslam_pose_t pose;
    pose.x_m = fuzz_real(input, -10, 10);
    pose.y_m = fuzz_real(input, -10, 10);
    pose.theta_rad = fuzz_real(input, -4, 4);
    const bslam_real_t position_sd_m = fuzz_real(input, 0, 30);
    const bslam_real_t heading_sd_rad = fuzz_real(input, 0, 3.2);
    return bslam_set_pose(&robot, &pose, position_sd_m, heading_sd_rad);
}

static bslam_status_t call_add_known(fuzz_input_t *input)
{
    const int32_t label = (int32_t)fuzz_u8(input) - 1;
    const bslam_real_t x_m = fuzz_real(input, -10, 10);
    const bslam_real_t y_m = fuzz_real(input, -10, 10);
    return bslam_add_known_beacon(&robot, label, x_m, y_m);
}

static bslam_status_t call_pose_at(fuzz_input_t *input, int64_t now_us)
{
    bslam_pose_t pose = {0, 0, 0};
    const bslam_status_t status = bslam_pose_at(&robot, fuzz_time(input, now_us), &pose);
    fuzz_require(isfinite((double)pose.x_m) && isfinite((double)pose.y_m) &&
                 isfinite((double)pose.theta_rad));
    return status;
}

static bslam_status_t call_save(void)
{
    map_memory_t memory = {blob, BLOB_MAX, 0};
    const bslam_map_sink_t sink = map_to_memory(&memory);
    const bslam_status_t status = bslam_save_map(&robot, &sink, &blob_size);
    fuzz_require(status != BSLAM_OK || memory.count == blob_size);
    return status;
}

static bslam_status_t call_load(fuzz_input_t *input)
{
    const bslam_map_source_t source = map_from_memory(blob, blob_size);
    bslam_map_fault_t fault;
    bslam_freeze_map(&robot, (fuzz_u8(input) & 1u) != 0);
    memcpy(&before, &robot, sizeof before);
    const bslam_status_t status = bslam_load_map(&robot, &source, &fault);
    fuzz_require((status == BSLAM_OK) == (fault == BSLAM_MAP_FINE));
    return status;
}

/// Starts over with other settings, some of which may contradict each other.
static bslam_status_t call_init(fuzz_input_t *input)
{
    bslam_settings_t asked = settings;
    for (unsigned i = fuzz_u8(input) % 4; i > 0; i--) {
        const int id = (int)fuzz_u8(input) % bslam_settings_count();
        const bslam_setting_info_t *info = bslam_settings_info(id);
        const bslam_real_t value = fuzz_real(input, (double)info->low, (double)info->high);
        const bslam_real_t whole =
            bslam_in_range(value, -1000000, 1000000) ? (bslam_real_t)(int32_t)value : value;
        const bslam_real_t old = bslam_settings_get(&asked, id);
        const bslam_status_t set = bslam_settings_set(&asked, id, info->is_integer ? whole : value);
        fuzz_require(set == BSLAM_OK || bslam_settings_get(&asked, id) == old);
    }
    int bad_setting = -1;
    const bslam_status_t status = bslam_init(&robot, &asked, &bad_setting);
    fuzz_require(status == BSLAM_OK || bslam_settings_info(bad_setting) != NULL);
    if (status == BSLAM_OK) {
        settings = asked;
    }
    return status;
}

/// A flipped bit is found by the next call, and the copy is there to go on with.
static bslam_status_t call_damaged(fuzz_input_t *input, int64_t now_us)
{
    uint32_t *word = (uint32_t *)(void *)&slam_of(&robot)->ekf.mean[fuzz_u8(input) % BSLAM_STATE_MAX];
    const uint32_t bit = UINT32_C(1) << fuzz_u8(input) % 32;
    if (settings.guard == 0) {
        fuzz_require(bslam_restart(&robot, 0, 0) == BSLAM_E_STATE);
        return BSLAM_OK;
    }
    *word ^= bit;
    fuzz_require(bslam_sightings(&robot, now_us, NULL, 0) == BSLAM_E_STATE);
    fuzz_require(bslam_save_map(&robot, NULL, &blob_size) == BSLAM_E_STATE);
    blob_size = 0;
    return bslam_restart(&robot, BSLAM_R(0.1), BSLAM_R(0.1));
}

static bslam_status_t call(fuzz_input_t *input, int64_t *now_us)
{
    switch (fuzz_u8(input) % 16) {
    case 0:
    case 1:
        return call_odometry(input, now_us);
    case 2:
    case 3:
    case 4:
        return call_sightings(input, *now_us);
    case 5:
        return call_resume(input);
    case 6:
        return call_set_pose(input);
    case 7:
        return call_add_known(input);
    case 8:
        return bslam_remove_beacon(&robot, fuzz_u8(input));
    case 9:
        return call_pose_at(input, *now_us);
    case 10:
        return call_save();
    case 11:
        return call_load(input);
    case 12:
        return call_init(input);
    case 13:
        return call_damaged(input, *now_us);
    case 14:
        return bslam_set_pose(&robot, NULL, 0, 0);
    default:
        return bslam_remove_beacon(&robot, BSLAM_ALL_BEACONS);
    }
}

static void start(fuzz_input_t *input)
{
    const unsigned choice = fuzz_u8(input);
    int bad_setting;
    bslam_settings_preset(&settings, BSLAM_PRESET_PAPER);
    settings.learn_budget = 50;
    settings.association = (int32_t)(choice % 5);
    settings.filter = (int32_t)(choice / 5 % 2);
    settings.recovery = choice >= 128 ? 1 : 0;
    settings.guard = (int32_t)(choice >> 6 & 1u);
    memset(&robot, 0, sizeof robot);
    fuzz_require(bslam_init(&robot, &settings, &bad_setting) == BSLAM_OK);
    blob_size = 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input_t input = {data, size};
    start(&input);
    int64_t now_us = 0;
    for (int calls = 0; calls < CALLS_MAX && input.left > 0; calls++) {
        memcpy(&before, &robot, sizeof before);
        const bslam_status_t status = call(&input, &now_us);
        if (status != BSLAM_OK) {
            require_unchanged(status);
        }
        fuzz_require_sound(slam_of(&robot));
    }
    (void)fuzz_require_kept(slam_of(&robot));
    return 0;
}
